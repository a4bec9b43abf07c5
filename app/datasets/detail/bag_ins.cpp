#include "app/datasets/detail/bag_ins.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "app/datasets/text_file.hpp"

namespace vergence::app::detail {
namespace {

// Maximum distance of two orientations that are interpolated.
constexpr Duration kMaxGap = Duration::milliseconds(100);

template <typename Topics>
std::vector<std::string> usable(const Topics& topics) {
  std::vector<std::string> names;
  for (const auto& [name, topic] : topics)
    if (!topic.readings.empty()) names.push_back(name);
  return names;
}

std::string joined(const std::vector<std::string>& names) {
  return names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "));
}

template <typename Reading>
void remark_left_out(const std::string& name, const ReadingTopic<Reading>& topic,
                     std::vector<std::string>* remarks) {
  if (topic.unreadable + topic.backwards == 0) return;
  remarks->push_back(fmt::format(
      "{}: skipped are {} messages without usable numbers and {} whose stamps do not increase",
      name, topic.unreadable, topic.backwards));
}

Eigen::Quaterniond to_quaternion(const RosAttitude& a) {
  const auto& q = a.q_world_body;
  return {q[3], q[0], q[1], q[2]};
}

void set_attitude(const Eigen::Quaterniond& q, InsSample* s) {
  s->q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
  s->attitude_valid = true;
}

/// Interpolates the orientation at the fix's time. *next is the index of the first orientation that
/// is not before the previous fix, and is advanced to this one. Returns false if none is near.
bool attitude_at(const std::vector<RosAttitude>& attitudes, std::size_t* next, InsRecord* r) {
  const Stamp stamp = r->sample.stamp;
  while (*next < attitudes.size() && attitudes[*next].stamp < stamp) ++*next;
  if (*next == attitudes.size()) return false;
  const RosAttitude& after = attitudes[*next];
  if (after.stamp == stamp) {
    set_attitude(to_quaternion(after), &r->sample);
  } else {
    if (*next == 0) return false;
    const RosAttitude& before = attitudes[*next - 1];
    if (after.stamp - before.stamp > kMaxGap) return false;
    const double share =
        (stamp - before.stamp).to_seconds() / (after.stamp - before.stamp).to_seconds();
    set_attitude(to_quaternion(before).slerp(share, to_quaternion(after)), &r->sample);
  }
  r->sample.tilt_sigma = after.tilt_sigma;
  r->sample.heading_sigma = after.heading_sigma;
  return true;
}

void remark_without_fix(const std::string& name, RecordedIns* ins) {
  const auto without = std::ranges::count_if(ins->readings, [](const InsRecord& r) {
    return r.sample.fix != FixStatus::fix_2d && r.sample.fix != FixStatus::fix_3d;
  });
  if (without > 0)
    ins->remarks.push_back(
        fmt::format("{}: {} of {} samples have no fix: poses are not compared there", name, without,
                    ins->readings.size()));
}

RecordedIns combine(const std::string& name, const std::vector<InsRecord>& fixes,
                    const std::string& imu, const std::vector<RosAttitude>& attitudes) {
  RecordedIns ins;
  ins.readings.reserve(fixes.size());
  std::size_t next = 0, without = 0;
  for (const InsRecord& fix : fixes) {
    InsRecord& r = ins.readings.emplace_back(fix);
    r.sample.number = ins.readings.size() - 1;
    if (!attitude_at(attitudes, &next, &r)) ++without;
  }
  ins.remarks.push_back(fmt::format("the INS is {} with the orientation of {}", name, imu));
  remark_without_fix(name, &ins);
  if (without > 0)
    ins.remarks.push_back(fmt::format(
        "{}: {} fixes have no orientation of {} within {} ms: poses are not compared there", name,
        without, imu, kMaxGap.ns() / 1'000'000));
  return ins;
}

void require(const std::filesystem::path& path, const BagIndex& bag, const std::string& option,
             const std::string& requested, const std::vector<std::string>& there) {
  if (requested.empty() || std::ranges::find(there, requested) != there.end()) return;
  refuse(
      path, 0,
      "has no usable sample on {} for {}; NavSatFix topics: {}; Imu topics with an orientation: {}",
      requested, option, joined(usable(bag.fixes)), joined(usable(bag.attitudes)));
}

}  // namespace

RecordedIns bag_ins(const std::filesystem::path& path, const BagIndex& bag,
                    const BagTopics& topics) {
  const std::vector<std::string> fixes = usable(bag.fixes), imus = usable(bag.attitudes);
  require(path, bag, "--ins-topic", topics.ins, fixes);
  require(path, bag, "--imu-topic", topics.imu, imus);
  const auto chosen = [](const std::string& requested, const std::vector<std::string>& there) {
    return requested.empty() && there.size() == 1 ? there.front() : requested;
  };
  const std::string fix = chosen(topics.ins, fixes), imu = chosen(topics.imu, imus);
  RecordedIns ins;
  if (fix.empty() && fixes.empty()) return ins;
  if (!fix.empty() && !imu.empty()) {
    ins = combine(fix, bag.fixes.at(fix).readings, imu, bag.attitudes.at(imu).readings);
    remark_left_out(imu, bag.attitudes.at(imu), &ins.remarks);
  } else if (!fix.empty() && imus.empty()) {
    ins.remarks.push_back("the NavSatFix of " + fix +
                          " has no matching Imu orientation: poses are not compared");
  } else {
    ins.remarks.push_back(fmt::format(
        "several topics could be the INS, so poses are not compared; choose with --ins-topic and "
        "--imu-topic; NavSatFix topics: {}; Imu topics with an orientation: {}",
        joined(fixes), joined(imus)));
  }
  if (!fix.empty()) remark_left_out(fix, bag.fixes.at(fix), &ins.remarks);
  return ins;
}

}  // namespace vergence::app::detail
