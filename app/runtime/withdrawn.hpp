#pragma once
#include <span>
#include <string>
#include <string_view>

namespace vergence::app {

/// Something of an earlier version that a user may still write, and what to do now.
struct Withdrawn {
  enum class Kind { key, camera_option, record_topic, option, command } kind;
  std::string_view name;     // record.roll_s, replay --through-devices, completion
  std::string_view instead;  // the end of an error message: what replaced it
};

[[nodiscard]] std::span<const Withdrawn> withdrawn();

/// `; it was removed: …` for an error message about an unknown name; empty where no earlier version
/// had it.
[[nodiscard]] std::string why_withdrawn(Withdrawn::Kind kind, std::string_view name);

}  // namespace vergence::app
