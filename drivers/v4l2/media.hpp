#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace vergence::v4l2 {

/// A media controller's graph, as far as advice needs it.
struct MediaPad {
  bool sink = false;
  std::string format;  // "Y10_1X10/1280x800" by code and size; empty: not known
};
struct MediaEntity {
  std::uint32_t id = 0;
  std::string name;
  std::string node;  // /dev/v4l-subdev0, /dev/video0; empty: none
  std::vector<MediaPad> pads;
};
struct MediaLink {
  std::uint32_t from = 0, to = 0;  // entities
  std::uint32_t from_pad = 0, to_pad = 0;
  bool enabled = false;
};
struct MediaGraph {
  std::string node;  // /dev/media0
  std::vector<MediaEntity> entities;
  std::vector<MediaLink> links;
};

/// The advice of media_advice() for the video node `video`; empty: nothing stands before it.
[[nodiscard]] std::string advice(const MediaGraph& graph, const std::string& video);

/// The graph that a video node belongs to, from /dev/mediaN. Nothing: it has none, or it cannot be
/// read.
[[nodiscard]] std::optional<MediaGraph> read_graph(const std::string& video);

}  // namespace vergence::v4l2
