#pragma once

#include "app/runtime/errors.hpp"
#include "tests/support/mentions.hpp"

namespace vergence::test {

/// The message with which `f` refuses what it is given, as wrong or as not there; empty: it took
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

}  // namespace vergence::test
