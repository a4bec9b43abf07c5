#include "drivers/iidc/identity.hpp"

#include <gtest/gtest.h>

namespace vergence::iidc {
namespace {

TEST(Identity, guidIsGivenInHexOrAsSerialNumber) {
  constexpr std::uint64_t kGuid = 0x00B0'9D01'00A1'2345;
  EXPECT_EQ(guid_text(kGuid), "00b09d0100a12345");
  EXPECT_TRUE(names_camera("", kGuid));
  EXPECT_TRUE(names_camera("00b09d0100a12345", kGuid));
  EXPECT_TRUE(names_camera("0x00B09D0100A12345", kGuid));
  // The serial number is 0x00A12345.
  EXPECT_TRUE(names_camera("10560325", kGuid));
  EXPECT_TRUE(names_camera("F3-77", kGuid, "F3-77"));
  EXPECT_FALSE(names_camera("10560326", kGuid));
  EXPECT_FALSE(names_camera("F3-77", kGuid));
  EXPECT_FALSE(names_camera("00b09d0100a1234", kGuid));
  EXPECT_FALSE(names_camera("99999999999999999999999", kGuid));
  EXPECT_FALSE(names_camera("0", 0));
}

}  // namespace
}  // namespace vergence::iidc
