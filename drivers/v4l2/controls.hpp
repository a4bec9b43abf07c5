#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vergence::v4l2 {

/// One control of a camera, as the kernel describes it.
struct Control {
  int fd = -1;  // of the node that has it
  std::uint32_t id = 0;
  std::uint32_t type = 0;   // V4L2_CTRL_TYPE_…
  std::uint32_t flags = 0;  // V4L2_CTRL_FLAG_…
  std::string
      key;  // "exposure_time_absolute": lower case, one '_' for all that is no letter or digit
  std::int64_t least = 0, most = 0, step = 1;
  std::vector<std::pair<std::int64_t, std::string>> menu;  // values with the keys of their names
};

[[nodiscard]] std::string key_of(std::string_view name);

/// Controls of a video node and, for sensors behind a media controller, of the sensor's own node.
///
/// Ownership  The descriptors stay the caller's and open.
class Controls {
 public:
  /// Reads the descriptions; a node without controls adds none.
  void add(int fd);
  [[nodiscard]] const Control* find(std::uint32_t id) const noexcept;
  [[nodiscard]] const Control* find(std::string_view key) const noexcept;
  /// The control to switch an external trigger on with: the first whose key has the word "trigger"
  /// in it and that is a switch, a menu or a number. Null: none.
  [[nodiscard]] const Control* trigger() const noexcept;
  /// Keys of all that can be written, for a message; at most `most`.
  [[nodiscard]] std::string keys(std::size_t most = 24) const;

 private:
  std::vector<Control> controls_;
};

/// Parses a control's value: a number, or the name of a menu item in any spelling of case
/// and blanks. False: neither, or out of range.
[[nodiscard]] bool parse_value(const Control& control, std::string_view text, std::int64_t* value);
/// A value on a control's grid, inside its range.
[[nodiscard]] std::int64_t clamped(const Control& control, std::int64_t value) noexcept;
/// The value a trigger control takes to be on: a menu item whose name speaks of external, hardware,
/// on or enabled; else 1.
[[nodiscard]] std::int64_t trigger_on(const Control& control) noexcept;
/// "0 to 4095 in steps of 1", or the names of the menu.
[[nodiscard]] std::string format_range(const Control& control);

/// → 0 or the errno.
[[nodiscard]] int write(const Control& control, std::int64_t value) noexcept;
[[nodiscard]] int read(const Control& control, std::int64_t* value) noexcept;

}  // namespace vergence::v4l2
