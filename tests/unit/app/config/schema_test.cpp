#include "app/config/schema.hpp"

#include <limits>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "app/runtime/errors.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

/// Taken with this value of this key, and the value arrives.
bool accepts(const Key& key, const KeyValue& value) {
  const std::string text = to_text(value);
  try {
    // Both sides of the one relation between keys, so that only the range of this row decides.
    std::vector<std::string> set{"odometry.min_inliers=6",
                                 "odometry.ok_inliers=1000",
                                 "calibration.min_frames=5",
                                 "calibration.max_frames=150",
                                 "calibration.good_depth_percent=0.01",
                                 "calibration.usable_depth_percent=100"};
    // A lens is given whole.
    const std::string lens = key.name.substr(0, key.name.find('.', 8)) + ".intrinsics";
    if (key.name.starts_with(lens + "."))
      set.push_back(fmt::format("{0}=[{1}, {1}, {1}, {1}]", lens, text));
    if (key.name.find(".distortion.") != std::string::npos)
      set.push_back(lens + "=[500, 500, 320, 240]");
    set.push_back(key.name + "=" + text);
    return to_text(key.get(parse_configuration("", "", set))) == text;
  } catch (const InputError&) {
    return false;
  }
}

KeyValue value_at(const Key& key, double x) {
  if (key.type == KeyType::integer) return static_cast<std::int64_t>(x);
  return x;
}

TEST(Schema, everyRangeIsEnforcedAtBothEnds) {
  int rows = 0;
  for (const Group& group : schema())
    for (const Key& key : group.keys) {
      if (key.type == KeyType::text) continue;
      SCOPED_TRACE(key.name);
      const bool integer = key.type == KeyType::integer;
      const double below = integer ? key.least - 1 : std::nextafter(key.least, -1e300);
      EXPECT_TRUE(accepts(key, value_at(key, key.least)));
      EXPECT_FALSE(accepts(key, value_at(key, below)));
      if (integer && key.most >= 0x1p63) {
        EXPECT_TRUE(accepts(key, std::numeric_limits<std::int64_t>::max()));
      } else {
        EXPECT_TRUE(accepts(key, value_at(key, key.most)));
        EXPECT_FALSE(
            accepts(key, value_at(key, integer ? key.most + 1 : std::nextafter(key.most, 1e300))));
      }
      ++rows;
    }
  EXPECT_GE(rows, 19);
}

TEST(Schema, everyKeyChangesItsOwnValueOnly) {
  for (const Group& group : schema())
    for (const Key& key : group.keys) {
      // Such a key has no other value.
      if (key.words.size() == 1) continue;
      SCOPED_TRACE(key.name);
      Configuration changed;
      const bool options = key.name.ends_with(".options");
      // The driver defines the options that exist.
      if (options)
        changed.cameras[static_cast<std::size_t>(key.name[8] - '0')].options =
            v4l2::Options{.subdevice = "other"};
      const std::string text = key.words.empty() ? "other" : key.words.front();
      if (!options)
        key.set(changed, key.type == KeyType::text ? KeyValue(text) : value_at(key, key.least));
      if (!key.words.empty() && to_text(key.get(changed)) == to_text(key.get(Configuration{})))
        key.set(changed, key.words.back());
      if (to_text(key.get(changed)) == to_text(key.get(Configuration{})))
        key.set(changed, value_at(key, key.least + 1));
      for (const Group& other_group : schema())
        for (const Key& other : other_group.keys) {
          const bool same = to_text(other.get(changed)) == to_text(other.get(Configuration{}));
          EXPECT_EQ(same, other.name != key.name) << other.name;
        }
    }
}

TEST(Schema, documentIsWrittenFromTheTable) {
  EXPECT_EQ(test::read_file(VERGENCE_SOURCE_DIR "/docs/configuration.md"),
            test::read_file(VERGENCE_SOURCE_DIR "/app/config/configuration_opening.md") +
                configuration_tables())
      << "write it again: ninja -C build docs";
}

}  // namespace
}  // namespace vergence::app
