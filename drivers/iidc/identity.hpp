#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace vergence::iidc {

/// A GUID as lists show it and configurations name it: sixteen hexadecimal digits.
[[nodiscard]] std::string guid_text(std::uint64_t guid);

/// Returns true if `requested` names this camera: its GUID (hexadecimal, with or without 0x), the
/// decimal number in the GUID's lower half, which is the serial number on Point Grey's labels, or
/// the text that the transport calls its serial number. Empty names any.
[[nodiscard]] bool names_camera(std::string_view requested, std::uint64_t guid,
                                std::string_view transport_serial = {});

}  // namespace vergence::iidc
