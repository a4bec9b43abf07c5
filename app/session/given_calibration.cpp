#include "app/session/given_calibration.hpp"

#include <algorithm>
#include <string_view>
#include <system_error>

#include "app/datasets/text_file.hpp"
#include "app/foreign_calibration/foreign_calibration.hpp"
#include "app/runtime/errors.hpp"

namespace vergence::app {
namespace {

/// Ours is one file: a pair or a folder of them is refused with the other formats.
bool is_foreign(const std::string& in) {
  std::error_code ignored;
  return !std::filesystem::is_regular_file(in, ignored) || !is_own_calibration(in);
}

}  // namespace

std::vector<double> parse_distortion(const std::string& text) {
  std::array<std::string_view, 5> fields;
  const std::size_t count = split(text, ',', fields);
  std::vector<double> values(std::min(count, fields.size()));
  bool numbers = count == 4 || count == 5;
  for (std::size_t i = 0; numbers && i < values.size(); ++i)
    numbers = parse_number(fields[i], &values[i]);
  if (!numbers)
    throw InputError(
        "--distortion is \"" + text.substr(0, 60) +
        "\"; it takes k1,k2,p1,p2[,k3] of a radtan lens or k1,k2,k3,k4 of an equidistant one");
  return values;
}

CalibrationFile read_given_calibration(const std::string& in, const CalibrationUse& use,
                                       const std::optional<ImageSize>& size,
                                       std::vector<std::string>* remarks) {
  return read_any_calibration(in, size, remarks, use);
}

GivenCalibration given_calibration(const std::string& in, const CalibrationUse& use,
                                   std::vector<std::string>* remarks) {
  return {in, [in, use, remarks](const StereoSequence& sequence) {
            // The images are only looked at for a file that may lack their size.
            const std::optional<ImageSize> size =
                is_foreign(in) ? std::optional(first_image_size(sequence, 0)) : std::nullopt;
            return read_given_calibration(in, use, size, remarks);
          }};
}

GivenCalibration given_calibration(const KnownNumbers& known) {
  return {"--focal", [known](const StereoSequence& sequence) {
            const ImageSize size = first_image_size(sequence, 0);
            CalibrationFile file;
            file.source = "given";
            RigCalibration& rig = file.rig;
            rig.cameras = 2;
            rig.baseline = known.baseline;
            Intrinsics lens;
            lens.kind = known.model;
            lens.width = size.width, lens.height = size.height;
            lens.fx = lens.fy = known.focal;
            lens.cx = (size.width - 1) / 2.0, lens.cy = (size.height - 1) / 2.0;
            std::copy(known.distortion.begin(), known.distortion.end(), lens.distortion.begin());
            rig.intrinsics = {lens, lens};
            make_parallel(&rig);
            return file;
          }};
}

}  // namespace vergence::app
