#pragma once
#include <gtest/gtest.h>

#include <string>

namespace vergence::test {

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

/// Succeeds if the text contains every part.
template <class... Parts>
testing::AssertionResult mentions(const std::string& text, const Parts&... parts) {
  std::string missing;
  for (const std::string& part : {std::string(parts)...})
    if (!contains(text, part)) missing += " `" + part + "`";
  if (missing.empty()) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "`" << text << "` lacks" << missing;
}

}  // namespace vergence::test
