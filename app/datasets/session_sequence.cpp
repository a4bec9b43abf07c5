#include <algorithm>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "app/config/calibration_file.hpp"
#include "app/datasets/decimal.hpp"
#include "app/datasets/detail/formats.hpp"
#include "app/datasets/image_store.hpp"
#include "app/datasets/recorded_session.hpp"
#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

/// Images of a recorded session, named `CAMERA#FRAME`.
class SessionImages final : public ImageStore {
 public:
  explicit SessionImages(RecordedSession session) noexcept : session_(std::move(session)) {}

  [[nodiscard]] const RecordedSession& session() const noexcept { return session_; }

  [[nodiscard]] ImageFileStatus size(const std::string& name, ImageSize* size) const override {
    const auto [frame, camera] = find(name);
    if (frame == nullptr) return ImageFileStatus::missing;
    *size = {frame->images[camera].width, frame->images[camera].height};
    return ImageFileStatus::ok;
  }
  [[nodiscard]] std::optional<std::uint16_t> peak(
      const std::string& /*name*/, std::vector<std::uint8_t>* /*work*/) const override {
    return std::nullopt;
  }
  [[nodiscard]] ImageFileStatus decode(const std::string& name, ImageSize size, std::uint8_t* out,
                                       std::size_t stride, int /*deep_bits*/,
                                       std::vector<std::uint8_t>* /*work*/) const override {
    const auto [frame, camera] = find(name);
    if (frame == nullptr) return ImageFileStatus::missing;
    if (size != ImageSize{frame->images[camera].width, frame->images[camera].height})
      return ImageFileStatus::wrong_size;
    return session_.read(*frame, camera, out, stride) ? ImageFileStatus::ok
                                                      : ImageFileStatus::truncated;
  }

 private:
  [[nodiscard]] std::pair<const RecordedFrame*, std::size_t> find(const std::string& name) const {
    const auto hash = name.find('#');
    if (hash != 1) return {nullptr, 0};
    const auto camera = static_cast<std::size_t>(name[0] - '0');
    const auto index = parse_integer(std::string_view(name).substr(hash + 1));
    if (camera > 1 || !index || *index < 0 ||
        static_cast<std::size_t>(*index) >= session_.frames().size())
      return {nullptr, 0};
    const RecordedFrame& frame = session_.frames()[static_cast<std::size_t>(*index)];
    return {frame.images[camera].offset != 0 ? &frame : nullptr, camera};
  }

  RecordedSession session_;
};

}  // namespace

StereoSequence open_recorded_session(const std::filesystem::path& folder, bool given) {
  auto images = std::make_shared<const SessionImages>(RecordedSession::open(folder));
  const RecordedSession& session = images->session();
  StereoSequence sequence;
  sequence.root = folder;
  sequence.times = folder;
  sequence.remarks = session.remarks();
  if (!given) {
    sequence.calibration =
        parse_calibration(session.description().calibration, folder.string()).rig;
    sequence.calibration_source = "the recording";
  }
  for (std::size_t i = 0; i < session.frames().size(); ++i) {
    const RecordedFrame& frame = session.frames()[i];
    if (frame.images[0].offset == 0 || frame.images[1].offset == 0)
      ++sequence.left_out;
    else
      sequence.pairs.push_back(
          {frame.given.stamp, {fmt::format("0#{}", i), fmt::format("1#{}", i)}});
  }
  if (sequence.pairs.empty()) refuse(folder, 0, "has a recording without a frame of both images");
  if (!session.readings().empty()) {
    RecordedIns ins;
    ins.readings = session.readings();
    sequence.ins = std::make_shared<const RecordedIns>(std::move(ins));
  }
  sequence.store = std::move(images);
  return sequence;
}

}  // namespace vergence::app::detail
