#include "app/runtime/version.hpp"

#include <regex>
#include <string>

#include <gtest/gtest.h>

namespace vergence::app {
namespace {

TEST(Version, IsTheProjectsVersionWithTheCommitWhereOneIsKnown) {
  const std::string text(version());
  EXPECT_EQ(text.substr(0, text.find(' ')), VERGENCE_PROJECT_VERSION);
  EXPECT_TRUE(std::regex_match(text, std::regex(R"([0-9]+\.[0-9]+\.[0-9]+( \([0-9a-f]+\+?\))?)")))
      << text;
}

}  // namespace
}  // namespace vergence::app
