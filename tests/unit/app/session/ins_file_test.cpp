#include "app/session/ins_file.hpp"

#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

InsRecord reading(std::uint64_t number) {
  const Stamp stamp(1'577'836'800'123'456'789 + static_cast<std::int64_t>(number) * 8'333'333);
  return {.sample = {.number = number,
                     .stamp = stamp,
                     .stamp_error = Duration::nanoseconds(180'123),
                     .fix = FixStatus::fix_3d,
                     .attitude_valid = true,
                     .velocity_valid = true,
                     .position = {-27.4975123456, 153.0137654321, 61.12345},
                     .velocity_enu = {12.345678, -0.5, 0.000001},
                     .q_enu_ins = {0.5, -0.5, 0.5, 0.5},
                     .position_sigma = 2.5,
                     .heading_sigma = 0.0174532925},
          .quality = {0xfe000007U, true, 1'577'836'800'100'000'000, 11, 0, true, false}};
}

std::string line_of(const InsRecord& record) {
  std::string line;
  format_ins_record(record, &line);
  return line;
}

const std::string kHead = std::string(kInsHeader) + "\n";

/// The message that refuses the file; empty: it was taken.
std::string refusal(const std::string& text) {
  const test::TemporaryFolder folder;
  return test::refusal_of([&] { (void)read_ins_file(folder.write("ins.csv", text)); });
}

TEST(InsFile, roundTripsReading) {
  const test::TemporaryFolder folder;
  InsRecord bare;
  bare.sample.number = 8;
  bare.sample.stamp = reading(8).sample.stamp;
  const auto read =
      read_ins_file(folder.write("ins.csv", kHead + line_of(reading(7)) + line_of(bare)));
  ASSERT_EQ(read.size(), 2U);
  const InsRecord &a = read[0], b = reading(7);
  EXPECT_EQ(a.sample.stamp, b.sample.stamp);
  EXPECT_EQ(a.sample.stamp_error.ns(), 180'123);
  EXPECT_EQ(a.sample.number, 7U);
  EXPECT_EQ(a.sample.fix, FixStatus::fix_3d);
  EXPECT_NEAR(a.sample.position.latitude_deg, b.sample.position.latitude_deg, 1e-10);
  EXPECT_NEAR(a.sample.position.longitude_deg, b.sample.position.longitude_deg, 1e-10);
  EXPECT_NEAR(a.sample.position.height_m, b.sample.position.height_m, 1e-5);
  EXPECT_TRUE(a.sample.velocity_valid && a.sample.attitude_valid);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(a.sample.velocity_enu[i], b.sample.velocity_enu[i], 1e-6);
  EXPECT_EQ(a.sample.q_enu_ins, b.sample.q_enu_ins);
  EXPECT_EQ(a.sample.position_sigma, 2.5);
  EXPECT_EQ(a.sample.height_sigma, 0);
  EXPECT_NEAR(a.sample.heading_sigma, b.sample.heading_sigma, 1e-7);
  EXPECT_EQ(a.quality.status, 0xfe000007U);
  EXPECT_EQ(a.quality.satellites, 11);
  EXPECT_TRUE(a.quality.filter_valid && a.quality.utc_valid);
  EXPECT_EQ(a.quality.utc_ns, b.quality.utc_ns);
  EXPECT_EQ(read[1].sample.fix, FixStatus::none);
  EXPECT_FALSE(read[1].sample.velocity_valid || read[1].sample.attitude_valid ||
               read[1].quality.utc_valid);
}

TEST(InsFile, refusalNamesPlaceOfMalformedLine) {
  const std::string good = line_of(reading(1));
  ASSERT_TRUE(refusal(kHead + good).empty());
  const auto with = [&](std::size_t column, const std::string& value) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < column; ++i) at = good.find(',', at) + 1;
    std::string line = good;
    line.replace(at, line.find_first_of(",\n", at) - at, value);
    return refusal(kHead + line_of(reading(0)) + line);
  };
  EXPECT_TRUE(
      test::contains(with(0, "1.5"), "ins.csv:3: `1.5` is not a value of the column stamp_ns"))
      << with(0, "1.5");
  EXPECT_TRUE(test::contains(with(0, "99999999999999999999"), "column stamp_ns"));
  EXPECT_TRUE(test::contains(with(1, "-1"), "column stamp_error_ns"));
  EXPECT_TRUE(test::contains(with(3, "great"), "`great` is not a value of the column fix"));
  EXPECT_TRUE(test::contains(with(4, "153"), "not a valid latitude"));
  EXPECT_TRUE(test::contains(with(5, ""), "`` is not a value of the column longitude_deg"));
  EXPECT_TRUE(test::contains(with(7, "nan"), "`nan` is not a value of the column velocity_east"));
  EXPECT_TRUE(test::contains(with(10, "7"), "the quaternion has the length"));
  EXPECT_TRUE(test::contains(with(10, "1e308"), "the quaternion has the length"));
  EXPECT_TRUE(test::contains(with(14, "-2"), "`-2` is not a value of the column position_sigma_m"));
  EXPECT_TRUE(test::contains(with(19, "4294967296"), "column status"));
  EXPECT_TRUE(test::contains(with(20, "256"), "column satellites"));
  EXPECT_TRUE(test::contains(with(21, "yes"), "`yes` is not a value of the column filter_valid"));
  EXPECT_TRUE(test::contains(with(22, "later"), "column utc_ns"));
  EXPECT_TRUE(test::contains(with(22, "1,2"), "has 24 columns instead of 23"));
  EXPECT_TRUE(test::contains(refusal(kHead + "1,2\n"), "ins.csv:2: has 2 columns"));
  EXPECT_TRUE(test::contains(refusal("a,b\n" + good), "ins.csv:1: is not the first line"));
  EXPECT_TRUE(test::contains(refusal(""), "is not the first line"));
  EXPECT_TRUE(test::contains(refusal(kHead), "has no sample"));
  EXPECT_TRUE(test::contains(refusal(kHead + good.substr(0, good.size() - 1)), "has no sample"))
      << "truncated";
}

TEST(InsFile, isFoundInFolderOrByHeader) {
  const test::TemporaryFolder folder;
  EXPECT_TRUE(find_ins_file(folder.path()).empty());
  EXPECT_TRUE(find_ins_file(folder / "none").empty());
  EXPECT_TRUE(find_ins_file(folder.write("a.tum", "1 0 0 0 0 0 0 1\n")).empty());
  EXPECT_EQ(find_ins_file(folder.write("renamed.csv", kHead)), folder / "renamed.csv");
  folder.write("ins.csv", kHead);
  EXPECT_EQ(find_ins_file(folder.path()), folder / "ins.csv");
}

}  // namespace
}  // namespace vergence::app
