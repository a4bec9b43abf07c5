#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "app/config/configuration.hpp"

namespace vergence::test {

/// 8-bit grey BMP of width x height pixels without padding, rows from the top.
[[nodiscard]] std::vector<std::uint8_t> bmp_of(const std::uint8_t* pixels, int width, int height);
void write_bytes(const std::filesystem::path& file, const std::vector<std::uint8_t>& bytes);

/// Drives the mock of `configuration` (two cameras, `mock.pattern: gbrg`) in virtual time and
/// writes what its devices bring as a folder of the St Lucia data set: raw mosaics, both logs, with
/// the stamps that `vergence run --fast` gives the same drive. The INS's axes are the MTi-G's own:
/// north, west, up; yaw from north counter-clockwise; pitch positive with the nose down.
void write_st_lucia(const app::Configuration& configuration, double duration_s,
                    const std::filesystem::path& folder);

}  // namespace vergence::test
