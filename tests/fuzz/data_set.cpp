/// Any bytes as the text files of a data set. The first byte chooses the format, 0x1e ends a file;
/// the images are whole. Entry point of libFuzzer.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "app/datasets/stereo_sequence.hpp"
#include "app/datasets/trajectory_files.hpp"
#include "tests/fuzz/input_errors.hpp"
#include "tests/fuzz/scratch_folder.hpp"

namespace {

using namespace vergence;
using namespace vergence::app;

/// 96 × 72 grey pixels, none of which is ever decoded here: the head is what readers look at.
constexpr std::string_view kPng("\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\x60\0\0\0\x48\x08\0\0\0\0",
                                29);

struct Layout {
  SequenceFormat format;
  // Text files in the order of the pieces.
  std::vector<std::string> texts;
  // Image files.
  std::vector<std::string> images;
};

const std::vector<Layout>& layouts() {
  static const std::string drive = "2011_09_26/2011_09_26_drive_0001_extract/";
  static const std::string log = "200101_100000_";
  static const std::vector<Layout> all{
      {SequenceFormat::folder,
       {"times.txt", "calibration.yaml", "truth.tum", "poses.txt"},
       {"left/0.png", "left/1.png", "right/0.png", "right/1.png"}},
      {SequenceFormat::kitti,
       {"calib.txt", "times.txt", "poses.txt"},
       {"image_0/000000.png", "image_0/000001.png", "image_1/000000.png", "image_1/000001.png"}},
      {SequenceFormat::euroc,
       {"mav0/cam0/data.csv", "mav0/cam1/data.csv", "mav0/cam0/sensor.yaml",
        "mav0/cam1/sensor.yaml", "mav0/state_groundtruth_estimate0/data.csv"},
       {"mav0/cam0/data/1.png", "mav0/cam0/data/2.png", "mav0/cam1/data/1.png",
        "mav0/cam1/data/2.png"}},
      {SequenceFormat::kitti_raw,
       {"2011_09_26/calib_cam_to_cam.txt", "2011_09_26/calib_imu_to_velo.txt",
        "2011_09_26/calib_velo_to_cam.txt", drive + "image_00/timestamps.txt",
        drive + "image_01/timestamps.txt", drive + "oxts/timestamps.txt",
        drive + "oxts/data/0000000000.txt", drive + "oxts/data/0000000001.txt"},
       {drive + "image_00/data/0000000000.png", drive + "image_00/data/0000000001.png",
        drive + "image_01/data/0000000000.png", drive + "image_01/data/0000000001.png"}},
      {SequenceFormat::st_lucia, {log + "MultiCamera0.log", log + "Ins0.log"}, {}},
  };
  return all;
}

using test::probe;

void check(const StereoSequence& s) {
  if (s.calibration.cameras < 2) std::abort();
  probe([&] { check_image_sizes(s, 0, s.pairs.size()); });
}

void check(const Trajectory& trajectory) {
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    if (trajectory[i].stamp <= trajectory[i - 1].stamp) std::abort();
}

void check(const RecordedIns& ins) {
  for (std::size_t i = 1; i < ins.readings.size(); ++i)
    if (ins.readings[i].sample.stamp <= ins.readings[i - 1].sample.stamp) std::abort();
}

struct Folders {
  test::ScratchFolder root;
  Folders() {
    for (std::size_t i = 0; i < layouts().size(); ++i)
      for (const std::string& image : layouts()[i].images) write(i, image, kPng);
  }
  [[nodiscard]] static std::string name(std::size_t i) { return std::to_string(i) + "/"; }
  void write(std::size_t i, const std::string& file, std::string_view bytes) const {
    root.write(name(i) + file, bytes);
  }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folders folders;
  if (size < 1) return 0;
  const std::size_t i = data[0] % layouts().size();
  const Layout& layout = layouts()[i];
  std::string_view rest(reinterpret_cast<const char*>(data + 1), size - 1);
  for (const std::string& file : layout.texts) {
    const std::size_t end = std::min(rest.find('\x1e'), rest.size());
    folders.write(i, file, rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  const auto folder = folders.root.path() / Folders::name(i);
  probe([&] { check(open_sequence(layout.format, folder)); });
  probe([&] { check(open_sequence(layout.format, folder, {.use = {true, 0.5}})); });
  probe([&] { check(read_recorded_ins(layout.format, folder, {0, 1}, true)); });
  probe([&] { check(read_trajectory_file(folder).poses); });
  if (layout.format == SequenceFormat::folder)
    probe([&] { check(read_trajectory_file(folder / "truth.tum").poses); });
  return 0;
}
