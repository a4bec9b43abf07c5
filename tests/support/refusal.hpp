#pragma once
#include <gtest/gtest.h>

#include <string>

#include "app/runtime/errors.hpp"

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

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Every part stands in the text.
template <class... Parts>
testing::AssertionResult mentions(const std::string& text, const Parts&... parts) {
  std::string missing;
  for (const std::string& part : {std::string(parts)...})
    if (!contains(text, part)) missing += " `" + part + "`";
  if (missing.empty()) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "`" << text << "` lacks" << missing;
}

}  // namespace vergence::test
