#include "drivers/v4l2/media.hpp"

#include <gtest/gtest.h>

namespace vergence::v4l2 {
namespace {

/// Sensor → receiver → video node, as on a board with a CSI camera.
MediaGraph board() {
  MediaGraph g;
  g.node = "/dev/media0";
  g.entities = {
      {1, "ov9281 10-0060", "/dev/v4l-subdev1", {{false, "0x200a/1280x800"}}},
      {2, "csi", "/dev/v4l-subdev0", {{true, "0x200a/1280x800"}, {false, "0x200a/1280x800"}}},
      {3, "unicam-image", "/dev/video0", {{true, ""}}}};
  g.links = {{1, 2, 0, 0, true}, {2, 3, 1, 0, true}};
  return g;
}

TEST(V4l2Media, theChainIsNamedFromTheSensorOn) {
  const std::string text = advice(board(), "/dev/video0");
  EXPECT_NE(
      text.find(
          "ov9281 10-0060 [0x200a/1280x800] → csi [0x200a/1280x800] → unicam-image (/dev/video0)"),
      std::string::npos)
      << text;
  EXPECT_NE(text.find("media-ctl -d /dev/media0 -p"), std::string::npos);
  EXPECT_NE(text.find("subdevice: /dev/v4l-subdev1"), std::string::npos)
      << "where the sensor's controls are";
  EXPECT_EQ(text.find("off"), std::string::npos) << "nothing is wrong";
}

TEST(V4l2Media, aLinkThatIsOffIsMendedByACommand) {
  MediaGraph g = board();
  g.links[0].enabled = false;
  EXPECT_NE(advice(g, "/dev/video0")
                .find(R"(media-ctl -d /dev/media0 -l '"ov9281 10-0060":0->"csi":0[1]')"),
            std::string::npos)
      << advice(g, "/dev/video0");
}

TEST(V4l2Media, padsThatDisagreeAreNamed) {
  MediaGraph g = board();
  g.entities[1].pads[0].format = "0x2001/640x400";
  const std::string text = advice(g, "/dev/video0");
  EXPECT_NE(text.find("gives 0x200a/1280x800"), std::string::npos) << text;
  EXPECT_NE(text.find("wants 0x2001/640x400"), std::string::npos) << text;
}

TEST(V4l2Media, anEnabledLinkGoesBeforeOneThatIsOff) {
  MediaGraph g = board();
  g.entities.push_back({4, "other sensor", "", {{false, ""}}});
  g.links.insert(g.links.begin(), MediaLink{4, 2, 0, 0, false});
  EXPECT_EQ(advice(g, "/dev/video0").find("other sensor"), std::string::npos);
}

TEST(V4l2Media, anotherNodeOrNothingBeforeItNeedsNoAdvice) {
  EXPECT_EQ(advice(board(), "/dev/video7"), "");
  MediaGraph alone = board();
  alone.links.clear();
  EXPECT_EQ(advice(alone, "/dev/video0"), "");
}

TEST(V4l2Media, aRingOfLinksEnds) {
  MediaGraph g = board();
  g.links.push_back({2, 1, 1, 0, true});
  EXPECT_FALSE(advice(g, "/dev/video0").empty());
}

}  // namespace
}  // namespace vergence::v4l2
