#include "drivers/v4l2/controls.hpp"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "drivers/v4l2/node.hpp"

namespace vergence::v4l2 {
namespace {

// Exceeds any sensor's number of controls; stops at a driver whose list does not end.
constexpr int kMaxControls = 512;
constexpr std::int64_t kMaxItems = 64;

bool is_number_like(std::uint32_t type) noexcept {
  return type == V4L2_CTRL_TYPE_INTEGER || type == V4L2_CTRL_TYPE_BOOLEAN ||
         type == V4L2_CTRL_TYPE_MENU || type == V4L2_CTRL_TYPE_INTEGER_MENU ||
         type == V4L2_CTRL_TYPE_INTEGER64 || type == V4L2_CTRL_TYPE_BITMASK;
}

/// Text of a fixed field that need not end in a zero.
template <class Char, std::size_t N>
std::string text(const Char (&field)[N]) {
  const char* first = reinterpret_cast<const char*>(field);
  return {first, std::find(first, first + N, '\0')};
}

void read_menu(Control* control) {
  for (std::int64_t i = control->least; i <= control->most && i < control->least + kMaxItems; ++i) {
    v4l2_querymenu item{};
    item.id = control->id;
    item.index = static_cast<__u32>(i);
    // Menus may have gaps.
    if (v4l2::control(control->fd, VIDIOC_QUERYMENU, &item) != 0) continue;
    control->menu.emplace_back(i, control->type == V4L2_CTRL_TYPE_MENU
                                      ? key_of(text(item.name))
                                      : std::to_string(item.value));
  }
}

}  // namespace

std::string key_of(std::string_view name) {
  std::string key;
  for (const char c : name) {
    const bool upper = c >= 'A' && c <= 'Z';
    if (upper || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'))
      key.push_back(upper ? static_cast<char>(c - 'A' + 'a') : c);
    else if (!key.empty() && key.back() != '_')
      key.push_back('_');
  }
  if (!key.empty() && key.back() == '_') key.pop_back();
  return key;
}

void Controls::add(int fd) {
  v4l2_query_ext_ctrl query{};
  for (int i = 0; i < kMaxControls; ++i) {
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    if (v4l2::control(fd, VIDIOC_QUERY_EXT_CTRL, &query) != 0) return;
    if ((query.flags & V4L2_CTRL_FLAG_DISABLED) != 0) continue;
    Control c;
    c.fd = fd;
    c.id = query.id;
    c.type = query.type;
    c.flags = query.flags;
    c.key = key_of(text(query.name));
    c.least = query.minimum;
    c.most = query.maximum;
    c.step = std::max<std::int64_t>(static_cast<std::int64_t>(query.step), 1);
    if (c.type == V4L2_CTRL_TYPE_MENU || c.type == V4L2_CTRL_TYPE_INTEGER_MENU) read_menu(&c);
    controls_.push_back(std::move(c));
  }
}

const Control* Controls::find(std::uint32_t id) const noexcept {
  const auto it = std::find_if(controls_.begin(), controls_.end(),
                               [&](const Control& c) { return c.id == id; });
  return it == controls_.end() ? nullptr : &*it;
}

const Control* Controls::find(std::string_view key) const noexcept {
  const auto it = std::find_if(controls_.begin(), controls_.end(),
                               [&](const Control& c) { return c.key == key; });
  return it == controls_.end() ? nullptr : &*it;
}

const Control* Controls::trigger() const noexcept {
  const auto it = std::find_if(controls_.begin(), controls_.end(), [](const Control& c) {
    return c.key.find("trigger") != std::string::npos && is_number_like(c.type) &&
           (c.flags & V4L2_CTRL_FLAG_READ_ONLY) == 0;
  });
  return it == controls_.end() ? nullptr : &*it;
}

std::string Controls::keys(std::size_t most) const {
  std::string list;
  std::size_t named = 0;
  for (const Control& c : controls_) {
    if (c.type == V4L2_CTRL_TYPE_CTRL_CLASS || (c.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0) continue;
    if (named == most) return list + ", …";
    list += (named++ == 0 ? "" : ", ") + c.key;
  }
  return list.empty() ? "none" : list;
}

bool parse_value(const Control& control, std::string_view text, std::int64_t* value) {
  for (const auto& [item, name] : control.menu) {
    if (name != key_of(text)) continue;
    *value = item;
    return true;
  }
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return false;
  if (control.type != V4L2_CTRL_TYPE_BUTTON && (number < control.least || number > control.most))
    return false;
  *value = number;
  return true;
}

std::int64_t clamped(const Control& control, std::int64_t value) noexcept {
  const std::int64_t inside =
      std::clamp(value, control.least, std::max(control.least, control.most));
  return control.least + (inside - control.least + control.step / 2) / control.step * control.step;
}

std::int64_t trigger_on(const Control& control) noexcept {
  constexpr std::array<std::string_view, 5> kNames = {"external", "hardware", "slave", "enable",
                                                      "on"};
  for (const std::string_view word : kNames)
    for (const auto& [item, name] : control.menu)
      if (("_" + name + "_").find("_" + std::string(word)) != std::string::npos) return item;
  return 1;
}

std::string format_range(const Control& control) {
  if (control.menu.empty())
    return std::to_string(control.least) + " to " + std::to_string(control.most) + " in steps of " +
           std::to_string(control.step);
  std::string list;
  for (const auto& [item, name] : control.menu) list += (list.empty() ? "" : ", ") + name;
  return list;
}

int write(const Control& control, std::int64_t value) noexcept {
  v4l2_ext_control one{};
  one.id = control.id;
  if (control.type == V4L2_CTRL_TYPE_INTEGER64)
    one.value64 = value;
  else
    one.value = static_cast<__s32>(value);
  v4l2_ext_controls all{};
  all.which = V4L2_CTRL_WHICH_CUR_VAL;
  all.count = 1;
  all.controls = &one;
  return v4l2::control(control.fd, VIDIOC_S_EXT_CTRLS, &all);
}

int read(const Control& control, std::int64_t* value) noexcept {
  v4l2_ext_control one{};
  one.id = control.id;
  v4l2_ext_controls all{};
  all.which = V4L2_CTRL_WHICH_CUR_VAL;
  all.count = 1;
  all.controls = &one;
  const int error = v4l2::control(control.fd, VIDIOC_G_EXT_CTRLS, &all);
  if (error == 0) *value = control.type == V4L2_CTRL_TYPE_INTEGER64 ? one.value64 : one.value;
  return error;
}

}  // namespace vergence::v4l2
