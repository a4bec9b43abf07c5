#pragma once
#include <string>

#include "app/runtime/errors.hpp"

namespace vergence::test {

/// The sentence with which `f` refuses what it is given, as wrong or as not there; empty: it took
/// it.
template <class F>
std::string refusal_of(const F& f) {
  try {
    f();
  } catch (const app::InputError& e) {
    return e.what();
  } catch (const app::DeviceError& e) {
    return e.what();
  }
  return "";
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace vergence::test
