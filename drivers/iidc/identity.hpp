#pragma once
#include <cstdint>
#include <string>
#include <string_view>

namespace vergence::iidc {

/// GUID as sixteen hexadecimal digits, the form used in lists and configurations.
[[nodiscard]] std::string guid_text(std::uint64_t guid);

/// Returns true if `requested` names this camera: its GUID (hexadecimal, with or without 0x), the
/// decimal serial number on Point Grey's labels (the GUID's lower half), or the transport's serial
/// number. An empty text matches any.
[[nodiscard]] bool names_camera(std::string_view requested, std::uint64_t guid,
                                std::string_view transport_serial = {});

}  // namespace vergence::iidc
