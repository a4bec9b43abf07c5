#include "tests/support/st_lucia_writer.hpp"

#include <cmath>
#include <fstream>
#include <memory>
#include <numbers>
#include <string>

#include <fmt/format.h>

#include "tests/support/mock_source.hpp"

namespace vergence::test {
namespace {

const std::string kPrefix = "200101_100000_";  // that in Brisbane
const std::string kImages = kPrefix + "MultiCamera0";

std::string stamp_text(Stamp stamp) {
  return fmt::format("{} {}", stamp.ns() / 1'000'000'000, stamp.ns() % 1'000'000'000 / 1'000);
}

std::vector<std::uint8_t> mosaic_of(const ImageView& v) {
  std::vector<std::uint8_t> pixels;
  for (int y = 0; y < v.height; ++y) pixels.insert(pixels.end(), v.row(y), v.row(y) + v.width);
  return bmp_of(pixels.data(), v.width, v.height);
}

std::string ins_line(const InsSample& s) {
  const Mat3 R = Eigen::Quaterniond(s.q_enu_ins[3], s.q_enu_ins[0], s.q_enu_ins[1], s.q_enu_ins[2])
                     .toRotationMatrix();
  const double roll = std::atan2(R(2, 1), R(2, 2)), pitch = std::asin(-R(2, 0)),
               yaw = std::atan2(R(1, 0), R(0, 0));
  const auto& v = s.velocity_enu;
  constexpr double kGeoid = 40;  // m, about what it is there
  return fmt::format(
      "{} {:.13f} {:.13f} {:.7f} {:.7f} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f}\n",
      stamp_text(s.stamp), s.position.latitude_deg, s.position.longitude_deg, s.position.height_m,
      s.position.height_m - kGeoid, v[1], -v[0], v[2], roll, pitch,
      std::remainder(yaw - std::numbers::pi / 2, 2 * std::numbers::pi));
}

}  // namespace

std::vector<std::uint8_t> bmp_of(const std::uint8_t* pixels, int width, int height) {
  constexpr std::uint32_t kPixelsAt = 14 + 40 + 4 * 256;
  const auto row = static_cast<std::uint32_t>((width + 3) / 4 * 4);
  std::vector<std::uint8_t> out;
  const auto put = [&](std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
  };
  put('B' | 'M' << 8, 2);
  put(kPixelsAt + row * static_cast<std::uint32_t>(height), 4);
  put(0, 4);
  put(kPixelsAt, 4);
  put(40, 4);
  put(static_cast<std::uint32_t>(width), 4);
  put(static_cast<std::uint32_t>(height), 4);
  put(1, 2);
  put(8, 2);
  for (int i = 0; i < 6; ++i) put(0, 4);
  for (std::uint32_t grey = 0; grey < 256; ++grey) put(grey * 0x010101U, 4);
  for (int y = height - 1; y >= 0; --y) {
    out.insert(out.end(), pixels + y * width, pixels + (y + 1) * width);
    out.resize(out.size() + row - static_cast<std::uint32_t>(width));
  }
  return out;
}

void write_bytes(const std::filesystem::path& file, const std::vector<std::uint8_t>& bytes) {
  std::ofstream out(file, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()),
            static_cast<std::streamsize>(bytes.size()));
}

void write_st_lucia(const app::Configuration& c, double duration_s,
                    const std::filesystem::path& folder) {
  const app::MockDrive drive = app::make_mock_drive(c, {}, false, duration_s, true);
  Acquisition source({&drive.rig->camera(0), &drive.rig->camera(1)},
                     drive.has_ins ? &drive.rig->ins() : nullptr, &drive.rig->trigger(),
                     mock_source_options(c, drive));

  std::filesystem::create_directories(folder / kImages);
  std::ofstream images(folder / (kImages + ".log")), ins(folder / (kPrefix + "Ins0.log"));
  images << "sec0 usec0 width0 height0 format0 sec1 usec1 width1 height1 format1 path0 path1\n";
  if (source.start()) throw std::runtime_error("the mock does not start");
  for (Acquired item; source.next(&item);) {
    if (const auto* reading = std::get_if<AcquiredReading>(&item)) ins << ins_line(reading->sample);
    const auto* frame = std::get_if<AcquiredFrame>(&item);
    if (frame == nullptr) continue;
    if (frame->set.complete) {
      const std::string size = fmt::format("{} {} GBRG8", c.cameras[0].width, c.cameras[0].height),
                        stamp = stamp_text(frame->rig.stamp);
      const auto name = [&](int k) {
        return fmt::format("cam{}_image{:05d}.bmp", k, frame->rig.number);
      };
      for (int k = 0; k < 2; ++k)
        write_bytes(folder / kImages / name(k),
                    mosaic_of(frame->rig.images[static_cast<std::size_t>(k)]));
      // One with the folder in front, one without: the readers of the data set meet both.
      images << fmt::format("{} {} {} {} {}/{} {}\n", stamp, size, stamp, size, kImages, name(0),
                            name(1));
    }
    source.release(*frame);
  }
  source.join();
}

}  // namespace vergence::test
