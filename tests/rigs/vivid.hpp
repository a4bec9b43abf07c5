#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "drivers/v4l2/node.hpp"

/// The kernel's test camera, from its far side: buttons that break it, and an output that is looped
/// to its input.
namespace vergence::test {

/// Sets a control of a node by its key ("disconnect", "inject_fatal_streaming_error",
/// "percentage_of_dropped_buffers"). Throws std::runtime_error when there is none, or it takes no
/// such value.
void set_control(const std::string& node, const std::string& key, std::int64_t value = 1);

/// A picture that looped nodes can have.
enum class LoopSize : std::uint8_t {
  vga,  // 640 x 480, 59.94 Hz
  hd,   // 1280 x 720, 30 Hz
};
[[nodiscard]] constexpr int width_of(LoopSize size) noexcept {
  return size == LoopSize::vga ? 640 : 1280;
}
[[nodiscard]] constexpr int height_of(LoopSize size) noexcept {
  return size == LoopSize::vga ? 480 : 720;
}

/// Makes /dev/videoCAPTURE show what /dev/videoOUTPUT is given, GREY, of one size on both.
void loop(const std::string& capture, const std::string& output, LoopSize size = LoopSize::vga);

/// Feeds outputs of looped cameras from a thread, all at once: each shows the same image number
/// until the next is due.
///
/// Ownership  `draw` is called from the thread for every image of every output until stop();
///            `image` is of the nodes' size, rows without padding.
/// Errors     The constructor throws std::runtime_error naming the node.
class VividPlayer {
 public:
  using Draw =
      std::function<void(std::size_t output, std::uint64_t number, std::span<std::uint8_t> image)>;

  /// Image n is shown from (n + 1/2) interval_ns of CLOCK_MONOTONIC on, `first` being the one now
  /// due: halfway between the multiples of the interval, at which a thinned camera looks.
  VividPlayer(const std::vector<std::string>& outputs, std::int64_t interval_ns, Draw draw,
              LoopSize size = LoopSize::vga);
  ~VividPlayer();
  VividPlayer(const VividPlayer&) = delete;
  VividPlayer& operator=(const VividPlayer&) = delete;

  void stop();
  /// Images that have been given to all outputs at least once.
  [[nodiscard]] std::uint64_t shown() const noexcept { return shown_.load(); }

 private:
  struct Output {
    v4l2::UniqueFd fd;
    std::vector<std::span<std::uint8_t>> buffers;
    std::uint64_t last = 0;
  };
  void feed();

  std::vector<Output> outputs_;
  std::int64_t interval_ns_, ahead_ns_;
  Draw draw_;
  std::uint32_t image_bytes_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> shown_{0};
  std::thread thread_;
};

}  // namespace vergence::test
