#include "drivers/mock/faults.hpp"

#include <numbers>

#include "tests/support/mentions.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::mock {
namespace {

std::string refusal(const std::string& text) {
  try {
    (void)parse_fault(text);
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

TEST(Faults, lineIsParsed) {
  const Fault f = parse_fault("knock@42 camera=1 pitch_deg=0.2");
  EXPECT_EQ(f.kind, FaultKind::knock);
  EXPECT_EQ(f.at, Duration::seconds(42));
  EXPECT_EQ(f.camera, 1);
  EXPECT_DOUBLE_EQ(f.turn.x(), 0.2 * std::numbers::pi / 180);
  EXPECT_EQ(f.turn.y(), 0);
  EXPECT_EQ(f.shift, Vec3::Zero());
}

TEST(Faults, everyKindTakesItsParameterRanges) {
  for (std::size_t i = 0; i < fault_rows().size(); ++i) {
    const FaultRow& row = fault_rows()[i];
    EXPECT_EQ(static_cast<std::size_t>(row.kind), i) << row.name;
    EXPECT_EQ(to_string(row.kind), row.name);
    EXPECT_NO_THROW((void)make_fault(row.name, 0, {})) << row.name;
    for (const FaultParameter& p : row.parameters) {
      EXPECT_NO_THROW((void)make_fault(row.name, 0, {{p.name, p.least}})) << row.name << p.name;
      EXPECT_NO_THROW((void)make_fault(row.name, 0, {{p.name, p.most}})) << row.name << p.name;
      EXPECT_THROW((void)make_fault(row.name, 0, {{p.name, p.most + 1}}), std::invalid_argument)
          << row.name << p.name;
      EXPECT_THROW((void)make_fault(row.name, 0, {{p.name, p.least - 1}}), std::invalid_argument)
          << row.name << p.name;
    }
  }
}

TEST(Faults, documentationHasTheTable) {
  const std::string page = test::read_file(VERGENCE_SOURCE_DIR "/docs/simulated_rig.md");
  EXPECT_TRUE(test::mentions(page, "-->\n" + fault_document() + "<!--"))
      << "the table between the comments of docs/simulated_rig.md is not this one:\n"
      << fault_document();
}

TEST(Faults, invalidLineIsNamed) {
  EXPECT_NE(refusal("knock").find("KIND@SECONDS"), std::string::npos);
  EXPECT_NE(refusal("knok@3").find("unknown fault \"knok\""), std::string::npos);
  EXPECT_NE(refusal("knock@soon").find("not a number"), std::string::npos);
  EXPECT_NE(refusal("knock@-1").find("0 … 86400"), std::string::npos);
  EXPECT_NE(refusal("knock@nan").find("0 … 86400"), std::string::npos);
  EXPECT_NE(refusal("knock@1 pitch_deg").find("NAME=NUMBER"), std::string::npos);
  EXPECT_NE(refusal("knock@1 share=0.1").find("has no parameter \"share\""), std::string::npos);
  EXPECT_NE(refusal("knock@1 pitch_deg=nan").find("must be in"), std::string::npos);
  EXPECT_NE(refusal("cover@1 camera=0.5").find("whole number"), std::string::npos);
  EXPECT_NE(refusal("").find("KIND@SECONDS"), std::string::npos);
  EXPECT_NE(refusal("recalibrate@1 camera=1").find("it has none"), std::string::npos);
}

TEST(Faults, zeroDurationLastsToTheEnd) {
  Fault f = parse_fault("cover@2 duration_s=3");
  EXPECT_FALSE(f.active(Duration::seconds(1.999)));
  EXPECT_TRUE(f.active(Duration::seconds(2)));
  EXPECT_FALSE(f.active(Duration::seconds(5)));
  f = parse_fault("cover@2 duration_s=0");
  EXPECT_TRUE(f.active(Duration::seconds(5000)));
}

}  // namespace
}  // namespace vergence::mock
