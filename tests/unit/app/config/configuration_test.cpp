#include "app/config/configuration.hpp"

#include <sys/stat.h>

#include <limits>

#include "app/config/schema.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace vergence::app {
namespace {

using test::contains;

/// The message with which a configuration is refused; empty when it is taken.
std::string refusal(const std::string& yaml, const std::vector<std::string>& set = {}) {
  return test::refusal_of([&] { (void)parse_configuration(yaml, "drive.yaml", set); });
}

TEST(Configuration, nestedAndDottedKeysAreRead) {
  const auto c = parse_configuration(
      "rig: {name: van}\nodometry:\n  features: 400\n  band_px: 3.5\nthreads: 1\n", "drive.yaml",
      {});
  EXPECT_EQ(c.rig.name, "van");
  EXPECT_EQ(c.odometry.features, 400);
  EXPECT_EQ(c.odometry.band_px, 3.5);
  EXPECT_EQ(c.threads, 1);
  EXPECT_EQ(parse_configuration("odometry.features: 401", "drive.yaml", {}).odometry.features, 401);
}

TEST(Configuration, unknownKeyNamesNearestFileAndLine) {
  EXPECT_EQ(refusal("threads: 1\nodometry:\n  featurs: 3\n"),
            "drive.yaml:3: unknown key \"odometry.featurs\"; did you mean \"odometry.features\"?");
  EXPECT_EQ(refusal("", {"thread=1"}),
            "--set thread=1: unknown key \"thread\"; did you mean \"threads\"?");
}

TEST(Configuration, suggestsOnlyKeysThatAreNear) {
  for (const auto& [setting, part] :
       {std::pair{"foo.bar=1", "\"foo.bar\"; docs/configuration.md lists all keys"},
        std::pair{"cameras.0.driver=GIEG", "did you mean \"gige\"?"},
        std::pair{"cameras.0.rate=1", "\"trigger.rate\"?"},
        std::pair{"cameras.driver=mock", "cameras is a list"},
        std::pair{"cameras.7.name=a", "at most 4 items, numbered from 0"},
        std::pair{"rig.name:a=1", "a colon needs a space"},
        std::pair{"calibration.online=of", "one of off, on; did you mean \"off\"?"},
        std::pair{"sync.mode=bus", "it is now ieee1394_cycle_time"}})
    EXPECT_TRUE(contains(refusal("", {setting}), part)) << refusal("", {setting});
}

TEST(Configuration, wrongYamlIsExplainedWithLine) {
  for (const auto& [text, part] :
       {std::pair{"threads:2\n", "yaml:1: is not a configuration; write `key: value`"},
        std::pair{"rig:\n  name: a\n   state_dir: b\n",
                  "yaml:3: is not YAML: a second `key: value`"},
        std::pair{"rig: name: a\n", "yaml:1: is not YAML: a second `key: value`"},
        std::pair{"rig:\n\tname: a\n", "yaml:2: is not YAML: the line is indented by a tab"},
        std::pair{"cameras:\n- name: a\n  - name: b\n", "is not YAML: the indentation"},
        std::pair{"rig: {name: a\nthreads: 2\n", "is not YAML: a `{` or `[` is not closed"},
        std::pair{"rig: {name: a}}\n", "is not YAML: a `}` or `]` that nothing opens"},
        std::pair{"rig: @a\n", "a character that YAML reserves"}}) {
    const std::string message = refusal(text);
    EXPECT_TRUE(contains(message, part)) << text << ": " << message;
  }
  EXPECT_TRUE(
      test::mentions(refusal("", {"cameras.0.size=[3"}), "size=[3: is not YAML: a `{` or `[`"));
}

TEST(Configuration, listItemsAreNamedByNumber) {
  const auto c = parse_configuration("cameras: [{serial: a, size: [800, 600]}, {serial: b}]",
                                     "drive.yaml", {"cameras.1.serial=c"});
  EXPECT_EQ(c.cameras[0].serial, "a");
  EXPECT_EQ(c.cameras[0].width, 800);
  EXPECT_EQ(c.cameras[0].height, 600);
  EXPECT_EQ(c.cameras[1].serial, "c");
}

TEST(Configuration, faultNamesLineOrGroup) {
  const auto c = parse_configuration(
      "faults: [{at: 42.0, kind: knock, camera: 1, pitch_deg: 0.2}, 'cover@3 camera=0']",
      "drive.yaml", {});
  EXPECT_EQ(c.faults[0], "knock@42.0 camera=1 pitch_deg=0.2");
  EXPECT_EQ(c.faults[1], "cover@3 camera=0");
  EXPECT_EQ(refusal("faults: []"), "");
}

TEST(Configuration, impossibleValuesAreRefusedWithPlace) {
  const std::string long_name = "rig: {name: " + std::string(65, 'x') + "}";
  for (const auto& [yaml, mentions] : std::vector<std::pair<std::string, const char*>>{
           {"odometry:\n  features: many", "drive.yaml:2: odometry.features is \"many\""},
           {"odometry: {features: 300.5}", "not an integer"},
           {"odometry: {features: 99999999999999999999}", "not an integer"},
           {"odometry: {band_px: 2px}", "not a number"},
           {"odometry: {features: }", "not an integer"},
           {"odometry: {features: [1, 2]}", "takes one value"},
           {"odometry: {features: {a: 1}}", "takes one value"},
           {"threads: []", "takes one value"},
           {"odometry: 3", "is a group of keys"},
           {"[1, 2]", "is not a configuration"},
           {long_name, "longer than the limit of 64 bytes"},
           {"odometry: {min_inliers: 60, ok_inliers: 50}",
            "odometry.ok_inliers (50) is below odometry.min_inliers (60)"},
           {"cameras: [{serail: a}]", "drive.yaml:1: unknown key \"cameras.0.serail\""},
           {"cameras: [{}, {}, {}, {}, {driver: mock}]", "unknown key \"cameras."},
           {"faults: [{kind: knock}]", "drive.yaml:1: faults.0 needs `kind` and `at`"},
           {"faults: [{kind: knock, at: [1, 2]}]", "faults.0"},
           {"record: [poses, pictures]\n", "drive.yaml:1: unknown key \"record.pictures\""},
           {"record: images\n", "is a group of keys"},
           {"threads: 1\nodometry: {features: 300\n", "drive.yaml:"},
           {"a: 1\n---\nb: 2\n", "several YAML documents"},
           {"threads: *unknown", "drive.yaml"},
           // This text is nested beyond any stack.
           {std::string(100'000, '['), "drive.yaml"},
       })
    EXPECT_TRUE(test::mentions(refusal(yaml), mentions)) << yaml.substr(0, 80);
}

TEST(Configuration, endlesslyUnfoldingAliasesAreStopped) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string last = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + last;
    for (int j = 1; j < 10; ++j) bomb += ", " + last;
    bomb += "]\n";
  }
  EXPECT_NE(refusal(bomb), "");
}

TEST(Configuration, unreadableFilesAreNamed) {
  const test::TemporaryFolder folder;
  const auto message = [](const std::filesystem::path& path) {
    return test::refusal_of([&] { (void)load_configuration(path, {}); });
  };
  EXPECT_TRUE(contains(message(folder / "none.yaml"), "none.yaml: cannot be opened (No such "));
  EXPECT_TRUE(contains(message(folder.path()), "is a directory"));
  const std::filesystem::path pipe = folder / "pipe.yaml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_TRUE(contains(message(pipe), "is a pipe or a device"));
  EXPECT_TRUE(
      contains(message(folder.write("huge.yaml", std::string(2'000'000, ' '))), "is longer than"));
  EXPECT_EQ(load_configuration(folder.write("good.yaml", "threads: 1\n"), {}).threads, 1);
}

TEST(ConfigurationHash, hashDependsOnValuesNotOnWriting) {
  const auto a = parse_configuration("odometry: {band_px: 2.50}\nthreads: 1", "a.yaml", {});
  const auto b =
      parse_configuration("threads: 1 # one\nodometry:\n    band_px: 25e-1\n", "b.yaml", {});
  EXPECT_EQ(configuration_hash(a), configuration_hash(b));
  EXPECT_EQ(configuration_hash(a).size(), 16U);
  EXPECT_NE(configuration_hash(a), configuration_hash(Configuration{}));
}

TEST(Configuration, listOfRecordSwitchesItsWordsOn) {
  EXPECT_FALSE(Configuration{}.record.any());
  const auto c = parse_configuration("record: [poses, images]\n", "drive.yaml", {});
  EXPECT_EQ(c.record.poses, 1);
  EXPECT_EQ(c.record.ins, 0);
  EXPECT_EQ(c.record.images, 1);
  const auto keys = parse_configuration("record: {images: on, split_mb: 30}\n", "drive.yaml",
                                        {"record=[ins]", "record.images=off"});
  EXPECT_EQ(keys.record.ins, 1);
  EXPECT_EQ(keys.record.images, 0);
  EXPECT_EQ(keys.record.split_mb, 30);
}

TEST(Configuration, aPresetIsWhatKeysAreThatNobodyGave) {
  const Configuration plain = parse_configuration("threads: 2", "c.yaml", {});
  const Configuration small = parse_configuration("odometry: {features: 333, preset: small}",
                                                  "c.yaml", {"calibration.max_frames=60"});
  EXPECT_EQ(small.odometry.features, 333) << "given before it";
  EXPECT_EQ(small.calibration.max_frames, 60) << "given after it";
  EXPECT_EQ(small.odometry.window_keyframes, 8);
  EXPECT_EQ(small.calibration.max_observations, 50'000);
  const Configuration taken_back =
      parse_configuration("odometry: {preset: small}", "c.yaml", {"odometry.preset=default"});
  EXPECT_EQ(canonical_text(taken_back), canonical_text(plain)) << "the last one counts";
  EXPECT_THROW((void)parse_configuration("odometry: {preset: tiny}", "c.yaml", {}), InputError);
}

TEST(Configuration, strayBracketOrCommaIsRefused) {
  // yaml-cpp 0.7 reads empty documents there for ever.
  for (const char* text : {",a: 1}", "  ,k: 2]x", "\n, 72], m", "threads: 1\n...\n,a: 1}"}) {
    const std::string message = refusal(text);
    EXPECT_TRUE(contains(message, "is not YAML") || contains(message, "several YAML documents"))
        << text << ": " << message;
  }
  EXPECT_TRUE(test::mentions(refusal("\n,a: 1}"), ":2: is not YAML: a value is expected"));
}

TEST(CameraOptionKeys, typesFollowTheDriversTable) {
  const Configuration c = parse_configuration(R"(
cameras:
  - {driver: gige, options: {packet_size: 9000, ptp: yes, feature.BlackLevel: 3}}
  - {options: packet_bytes=1024 embedded=no, driver: iidc-usb}
  - {driver: v4l2, options: {thin: 3}}
)",
                                              "rig.yaml", {"cameras.2.options.thin=4"});
  const auto& gige = std::get<gige::Options>(c.cameras[0].options);
  EXPECT_EQ(gige.packet_size, 9000);
  EXPECT_TRUE(gige.ptp);
  EXPECT_EQ(gige.features.at(0).second, "3");
  const auto& iidc = std::get<iidc::Options>(c.cameras[1].options);
  EXPECT_EQ(iidc.packet_bytes, std::optional<std::size_t>(1024));
  EXPECT_FALSE(iidc.embedded);
  EXPECT_EQ(std::get<v4l2::Options>(c.cameras[2].options).thin, 4);
  EXPECT_TRUE(
      test::mentions(canonical_text(c), "cameras.1.options=embedded=off packet_bytes=1024\n"));
}

TEST(CameraOptionKeys, impossibleOptionsNamePlaceAndChoices) {
  const auto said = [](const std::string& options) {
    return refusal("cameras:\n  - {driver: gige, options: " + options + "}\n");
  };
  EXPECT_EQ(said("{buffers: 3}"),
            "drive.yaml:2: cameras.0.options: buffers is \"3\"; it takes 4 to 48");
  const std::string unknown = said("{paket_size: 9000}");
  for (const char* part : {"drive.yaml:2", "there is no option \"paket_size\"",
                           "did you mean \"packet_size\"?", "trigger_line"})
    EXPECT_NE(unknown.find(part), std::string::npos) << unknown;
  for (const char* bad :
       {"{buffers: }", "{trigger_line: a b}", "{buffers: [4]}", "buffers", "buffers=", "=4"})
    EXPECT_NE(said(bad).find("cameras.0.options"), std::string::npos) << said(bad);
}

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
