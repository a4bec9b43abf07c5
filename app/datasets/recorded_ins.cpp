#include "app/datasets/recorded_ins.hpp"

#include "app/datasets/detail/formats.hpp"
#include "app/datasets/st_lucia.hpp"

namespace vergence::app {
namespace {

RecordedIns of_st_lucia(const std::filesystem::path& folder) {
  StLuciaIns log = read_st_lucia_ins(folder);
  RecordedIns out;
  out.remarks = std::move(log.remarks);
  out.readings.reserve(log.samples.size());
  for (const InsSample& sample : log.samples) {
    RecordedReading& reading = out.readings.emplace_back();
    reading.sample = sample;
    reading.quality.filter_valid = true;  // the log tells nothing else
  }
  return out;
}

}  // namespace

RecordedIns read_recorded_ins(SequenceFormat format, const std::filesystem::path& folder,
                              const std::array<int, 2>& cameras, bool mount_wanted) {
  switch (format) {
    case SequenceFormat::kitti_raw:
      return detail::read_oxts(folder, cameras, mount_wanted);
    case SequenceFormat::st_lucia:
      return of_st_lucia(folder);
    case SequenceFormat::kitti:
    case SequenceFormat::euroc:
    case SequenceFormat::folder:
    case SequenceFormat::mcap:  // has it in StereoSequence::ins
    case SequenceFormat::rosbag:
    case SequenceFormat::db3:
    case SequenceFormat::session:
      break;
  }
  return {};
}

}  // namespace vergence::app
