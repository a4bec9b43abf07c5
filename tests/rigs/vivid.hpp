#pragma once
#include <atomic>
#include <functional>
#include <span>
#include <thread>

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
  /// 640 x 480 at 59.94 Hz.
  vga,
  /// 1280 x 720 at 30 Hz.
  hd,
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

  /// An image in the place that a looped camera copies from, CLOCK_MONOTONIC.
  struct Showing {
    /// kNoise if the player was late and the camera shows noise.
    std::int64_t number = 0;
    /// The image is not shown earlier.
    std::int64_t from_ns = 0;
    /// The image is not shown later.
    std::int64_t until_ns = 0;
  };
  static constexpr std::int64_t kNoise = -1;
  /// Images shown by an output, in order; neighbours may overlap by the time between two looks at
  /// the output's queue. Call after stop().
  [[nodiscard]] const std::vector<Showing>& showings(std::size_t output) const {
    return outputs_[output].showings;
  }

 private:
  struct Output {
    UniqueFd fd;
    std::vector<std::span<std::uint8_t>> buffers;
    /// Numbers by buffer; buffers are shown in their order.
    std::vector<std::int64_t> numbers;
    /// The buffer that is shown.
    std::size_t current = 0;
    std::vector<Showing> showings;
    /// Start of the image after the last returned one.
    std::int64_t next_from_ns = 0;
    /// Last time at which no other buffer was returned.
    std::int64_t looked_ns = 0;
  };
  void feed();
  [[nodiscard]] bool refill(std::size_t output, std::uint64_t first);
  [[nodiscard]] std::uint64_t due() const noexcept;

  std::vector<Output> outputs_;
  std::int64_t interval_ns_, ahead_ns_;
  Draw draw_;
  std::uint32_t image_bytes_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace vergence::test
