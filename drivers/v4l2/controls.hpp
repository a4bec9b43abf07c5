#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vergence::v4l2 {

/// Control of a camera, as described by the kernel.
struct Control {
  /// Descriptor of the node that has the control.
  int fd = -1;
  std::uint32_t id = 0;
  /// One of V4L2_CTRL_TYPE_….
  std::uint32_t type = 0;
  /// Bit set of V4L2_CTRL_FLAG_….
  std::uint32_t flags = 0;
  /// Name in lower case with every run of other characters replaced by one '_', as in
  /// "exposure_time_absolute".
  std::string key;
  std::int64_t least = 0, most = 0, step = 1;
  /// Values of a menu with the keys of their names.
  std::vector<std::pair<std::int64_t, std::string>> menu;
};

[[nodiscard]] std::string key_of(std::string_view name);

/// Controls of a video node and, for sensors behind a media controller, of the sensor's subdevice.
/// Does not own the descriptors, which must stay open.
class Controls {
 public:
  /// Reads the descriptions; a node without controls adds none.
  void add(int fd);
  [[nodiscard]] const Control* find(std::uint32_t id) const noexcept;
  [[nodiscard]] const Control* find(std::string_view key) const noexcept;
  /// Control that enables an external trigger: the first switch, menu or number whose key contains
  /// the word "trigger". Null if none.
  [[nodiscard]] const Control* trigger() const noexcept;
  /// Keys of at most `most` writable controls, for a message.
  [[nodiscard]] std::string keys(std::size_t most = 24) const;

 private:
  std::vector<Control> controls_;
};

/// Parses a control's value: a number, or the name of a menu item regardless of case and blanks.
/// Returns false for anything else or out of range.
[[nodiscard]] bool parse_value(const Control& control, std::string_view text, std::int64_t* value);
/// Nearest value in a control's range and step.
[[nodiscard]] std::int64_t clamped(const Control& control, std::int64_t value) noexcept;
/// Value that enables a trigger control: a menu item whose name contains external, hardware, on or
/// enabled; otherwise 1.
[[nodiscard]] std::int64_t trigger_on(const Control& control) noexcept;
/// Formats the range as "0 to 4095 in steps of 1", or as the names of the menu.
[[nodiscard]] std::string format_range(const Control& control);

/// → 0 or the errno.
[[nodiscard]] int write(const Control& control, std::int64_t value) noexcept;
[[nodiscard]] int read(const Control& control, std::int64_t* value) noexcept;

}  // namespace vergence::v4l2
