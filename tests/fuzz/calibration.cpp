/// Any bytes as a calibration, the project's own or that of another program. The byte 0x1e
/// ends the first of two files. Entry point of libFuzzer.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "app/datasets/foreign_calibration.hpp"
#include "tests/fuzz/input_errors.hpp"

namespace {

using namespace vergence;
using namespace vergence::app;

/// Guarantees of every reader for an accepted calibration.
void check(const CalibrationFile& file) {
  if (file.rig.cameras < 2 || file.rig.cameras > kMaxCameras) std::abort();
  for (std::size_t k = 0; k < static_cast<std::size_t>(file.rig.cameras); ++k) {
    const Intrinsics& lens = file.rig.intrinsics[k];
    if (lens.width <= 0 || lens.height <= 0 || !(lens.fx > 0) || !(lens.fy > 0)) std::abort();
    if (!file.rig.T_camera_left[k].t.allFinite() || !file.rig.T_camera_left[k].R.allFinite())
      std::abort();
  }
}

using test::probe;

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::size_t end = text.find('\x1e');
  const std::string left(text.substr(0, end));
  const std::string right(end == std::string_view::npos ? text : text.substr(end + 1));
  Remarks remarks;
  probe([&] {
    const CalibrationFile file = parse_calibration(left, "a.yaml");
    check(file);
    // A written calibration must read back.
    check(parse_calibration(format_calibration(file), "again.yaml"));
  });
  probe([&] { check(parse_calibration(left, "a.yaml", {.length_only = true, .baseline = 0.5})); });
  const std::vector<CalibrationText> one{{"a.yaml", left}},
      two{{"a.yaml", left}, {"b.yaml", right}};
  for (const std::vector<CalibrationText>& files : {one, two}) {
    probe([&] { check(parse_any_calibration(files, ImageSize{640, 480}, &remarks)); });
    probe([&] {
      check(parse_any_calibration(files, std::nullopt, &remarks,
                                  {.length_only = true, .baseline = 0.5}));
    });
  }
  return 0;
}
