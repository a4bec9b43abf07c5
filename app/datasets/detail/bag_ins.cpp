#include "app/datasets/detail/bag_ins.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "app/datasets/text_file.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/math/angle.hpp"

namespace vergence::app::detail {
namespace {

constexpr Duration kMaxGap = Duration::milliseconds(100);    // between two orientations
constexpr Duration kSameTime = Duration::milliseconds(500);  // fix to odometry, a vehicle's 15 m
constexpr Duration kFixHolds = Duration::seconds(3);  // so long a fix says how its successors are
constexpr double kLongEnough = 50;  // m: below, receivers' errors tell no direction

template <typename Topics>
std::vector<std::string> usable(const Topics& topics) {
  std::vector<std::string> names;
  for (const auto& [name, topic] : topics)
    if (!topic.readings.empty()) names.push_back(name);
  return names;
}

std::string joined(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list.empty() ? "none" : list;
}

template <typename Reading>
void remark_left_out(const std::string& name, const ReadingTopic<Reading>& topic,
                     std::vector<std::string>* remarks) {
  if (topic.unreadable + topic.backwards == 0) return;
  remarks->push_back(
      fmt::format("{}: left out were {} messages without numbers that can be used and {} whose "
                  "stamps do not go forward",
                  name, topic.unreadable, topic.backwards));
}

Eigen::Quaterniond quaternion_of(const RosAttitude& a) {
  const auto& q = a.q_world_body;
  return {q[3], q[0], q[1], q[2]};
}

void set_attitude(const Eigen::Quaterniond& q, InsSample* s) {
  s->q_enu_ins = {q.x(), q.y(), q.z(), q.w()};
  s->attitude_valid = true;
}

RecordedReading reading_of(const RosFix& fix, std::size_t number) {
  RecordedReading r;
  r.sample.number = number;
  r.sample.stamp = fix.stamp;
  r.sample.fix = fix.fix;
  r.sample.position = fix.position;
  r.sample.position_sigma = fix.position_sigma;
  r.sample.height_sigma = fix.height_sigma;
  r.quality.status = fix.status;
  r.quality.filter_valid = fix.fix != FixStatus::none;
  return r;
}

/// Orientation at the fix's time from those around it; *next: the first that is not before, of the
/// fix before on entry. False: none is near.
bool attitude_at(const std::vector<RosAttitude>& attitudes, std::size_t* next, RecordedReading* r) {
  const Stamp stamp = r->sample.stamp;
  while (*next < attitudes.size() && attitudes[*next].stamp < stamp) ++*next;
  if (*next == attitudes.size()) return false;
  const RosAttitude& after = attitudes[*next];
  if (after.stamp == stamp) {
    set_attitude(quaternion_of(after), &r->sample);
  } else {
    if (*next == 0) return false;
    const RosAttitude& before = attitudes[*next - 1];
    if (after.stamp - before.stamp > kMaxGap) return false;
    const double share =
        (stamp - before.stamp).to_seconds() / (after.stamp - before.stamp).to_seconds();
    set_attitude(quaternion_of(before).slerp(share, quaternion_of(after)), &r->sample);
  }
  r->sample.tilt_sigma = after.tilt_sigma;
  r->sample.heading_sigma = after.heading_sigma;
  return true;
}

void print_without_fix(const std::string& name, RecordedIns* ins) {
  const auto without =
      std::count_if(ins->readings.begin(), ins->readings.end(), [](const RecordedReading& r) {
        return r.sample.fix != FixStatus::fix_2d && r.sample.fix != FixStatus::fix_3d;
      });
  if (without > 0)
    ins->remarks.push_back(
        fmt::format("{}: {} of {} readings have no fix: nothing is compared there", name, without,
                    ins->readings.size()));
}

RecordedIns of_fixes(const std::string& name, const std::vector<RosFix>& fixes,
                     const std::string& imu, const std::vector<RosAttitude>& attitudes) {
  RecordedIns ins;
  ins.readings.reserve(fixes.size());
  std::size_t next = 0, without = 0;
  for (const RosFix& fix : fixes) {
    RecordedReading& r = ins.readings.emplace_back(reading_of(fix, ins.readings.size()));
    if (!attitude_at(attitudes, &next, &r)) ++without;
  }
  ins.remarks.push_back(fmt::format("the INS is {} with the orientation of {}", name, imu));
  print_without_fix(name, &ins);
  if (without > 0)
    ins.remarks.push_back(
        fmt::format("{}: {} fixes have no orientation of {} within {} ms around them: nothing is "
                    "compared there",
                    name, without, imu, kMaxGap.ns() / 1'000'000));
  return ins;
}

/// Georeference of an odometry's world: p_enu = Rz(yaw) p_world + t in the axes at `origin`.
struct WorldPlace {
  LocalTangentPlane plane{};
  double yaw = 0;
  Vec3 t = Vec3::Zero();
  double way = 0;     // m: the largest distance from the first place
  std::size_t n = 0;  // places that it rests on
  bool turned = false;
};

/// Places of the two at about the same time.
struct Match {
  Vec3 world, enu;
};

std::vector<Match> matches(const std::vector<RosOdometry>& odometry,
                           const std::vector<RosFix>& fixes, const LocalTangentPlane& plane) {
  std::vector<Match> out;
  std::size_t i = 0;
  const auto apart = [&](std::size_t k, Stamp to) {
    return std::abs((odometry[k].attitude.stamp - to).ns());
  };
  for (const RosFix& fix : fixes) {
    if (fix.fix == FixStatus::none) continue;
    while (i + 1 < odometry.size() && apart(i + 1, fix.stamp) <= apart(i, fix.stamp)) ++i;
    if (apart(i, fix.stamp) <= kSameTime.ns())
      out.push_back({odometry[i].p_world_body, plane.to_enu(fix.position)});
  }
  return out;
}

/// The turn about up and the shift by which the places differ least. Few places or a short way: the
/// world is taken to be east, north, up.
WorldPlace place_world(const std::vector<RosOdometry>& odometry, const std::vector<RosFix>& fixes) {
  WorldPlace w;
  const auto first = std::find_if(fixes.begin(), fixes.end(),
                                  [](const RosFix& f) { return f.fix != FixStatus::none; });
  if (first == fixes.end()) return w;
  w.plane = LocalTangentPlane(first->position);
  const std::vector<Match> list = matches(odometry, fixes, w.plane);
  w.n = list.size();
  if (list.empty()) return w;
  Vec3 world = Vec3::Zero(), enu = Vec3::Zero();
  for (const Match& m : list) {
    world += m.world / static_cast<double>(list.size());
    enu += m.enu / static_cast<double>(list.size());
    w.way = std::max(w.way, (m.enu - list.front().enu).head<2>().norm());
  }
  double along = 0, across = 0;
  for (const Match& m : list) {
    const Vec3 a = m.world - world, b = m.enu - enu;
    along += a.x() * b.x() + a.y() * b.y();
    across += a.x() * b.y() - a.y() * b.x();
  }
  w.turned = w.way >= kLongEnough;
  if (w.turned) w.yaw = std::atan2(across, along);
  w.t = enu - exp_so3(Vec3(0, 0, w.yaw)) * world;
  return w;
}

RecordedReading reading_of(const RosOdometry& o, const WorldPlace& world, std::size_t number) {
  RecordedReading r;
  InsSample& s = r.sample;
  const Mat3 R_enu_world = exp_so3(Vec3(0, 0, world.yaw));
  s.number = number;
  s.stamp = o.attitude.stamp;
  s.position = world.plane.to_geodetic(R_enu_world * o.p_world_body + world.t);
  s.fix = s.position.plausible() ? FixStatus::fix_3d : FixStatus::none;
  // Attitude and velocity of a sample are in the axes at its own place.
  const Mat3 R = world.plane.rotation_from(s.position).transpose() * R_enu_world *
                 quaternion_of(o.attitude).toRotationMatrix();
  set_attitude(Eigen::Quaterniond(R), &s);
  const Vec3 v = R * o.v_body;
  s.velocity_enu = {v.x(), v.y(), v.z()};
  s.velocity_valid = o.velocity_valid;
  s.position_sigma = o.position_sigma;
  s.height_sigma = o.height_sigma;
  s.velocity_sigma = o.velocity_sigma;
  s.tilt_sigma = o.attitude.tilt_sigma;
  s.heading_sigma = o.attitude.heading_sigma;
  r.quality.filter_valid = true;
  return r;
}

void print_place(const std::string& name, const std::string& fix, const WorldPlace& world,
                 RecordedIns* ins) {
  if (world.n == 0) {
    ins->remarks.push_back(
        name +
        ": no NavSatFix says where on the earth it is. Its world is taken to lie at "
        "latitude 0, longitude 0, x to the east: errors mean what they say, places on the "
        "earth and compass headings do not");
    return;
  }
  ins->remarks.push_back(
      world.turned
          ? fmt::format("{}: its world is placed by {} fixes of {} over {:.0f} m, turned by {:.1f} "
                        "deg from east, north, up",
                        name, world.n, fix, world.way, world.yaw / kRadiansPerDegree)
          : fmt::format("{}: its world is placed by {} fixes of {} over {:.0f} m, too few to show "
                        "how it is turned: taken to be east, north, up",
                        name, world.n, fix, world.way));
}

/// While the receiver has no fix the filter carries on by inertia alone.
void pause_without_fix(const std::vector<RosFix>& fixes, RecordedIns* ins) {
  std::size_t next = 0;
  for (RecordedReading& r : ins->readings) {
    while (next < fixes.size() && fixes[next].stamp <= r.sample.stamp) ++next;
    if (next == 0) continue;
    const RosFix& last = fixes[next - 1];
    if (last.fix == FixStatus::none && r.sample.stamp - last.stamp < kFixHolds)
      r.sample.fix = FixStatus::dead_reckoning;
  }
}

RecordedIns of_odometry(const std::string& name, const std::vector<RosOdometry>& odometry,
                        const std::string& fix, const std::vector<RosFix>& fixes) {
  RecordedIns ins;
  const WorldPlace world = place_world(odometry, fixes);
  ins.readings.reserve(odometry.size());
  for (const RosOdometry& o : odometry)
    ins.readings.push_back(reading_of(o, world, ins.readings.size()));
  ins.remarks.push_back("the INS is the Odometry of " + name);
  print_place(name, fix, world, &ins);
  pause_without_fix(fixes, &ins);
  print_without_fix(name, &ins);
  return ins;
}

/// Chosen topics; an empty name means not used.
struct Choice {
  std::string fix{}, imu{}, odometry{};
};

void require(const std::filesystem::path& path, const BagIndex& bag, const std::string& option,
             const std::string& requested, const std::vector<std::string>& there) {
  if (requested.empty() || std::find(there.begin(), there.end(), requested) != there.end()) return;
  refuse(path, 0,
         fmt::format("has no reading on {} that can be used as {} says; of NavSatFix are {}, of "
                     "Imu with an orientation {}, of Odometry {}",
                     requested, option, joined(usable(bag.fixes)), joined(usable(bag.attitudes)),
                     joined(usable(bag.odometry))));
}

/// A choice that is none has its reason in *why; no reason: the bag has no INS.
Choice choose(const BagIndex& bag, const BagTopics& topics, std::string* why) {
  const auto of = [](const std::vector<std::string>& requested) {
    return requested.size() == 1 ? requested.front() : std::string();
  };
  const std::vector<std::string> fixes = usable(bag.fixes), imus = usable(bag.attitudes),
                                 odometry = usable(bag.odometry);
  const auto list = [&] {
    return fmt::format("topics of NavSatFix: {}; of Imu with an orientation: {}; of Odometry: {}",
                       joined(fixes), joined(imus), joined(odometry));
  };
  if (bag.odometry.contains(topics.ins)) return {of(fixes), "", topics.ins};
  const std::string fix = topics.ins.empty() ? of(fixes) : topics.ins;
  const std::string imu = topics.imu.empty() ? of(imus) : topics.imu;
  if (!fix.empty() && !imu.empty()) return {fix, imu, ""};
  const bool no_orientation =
      !fix.empty() && imus.empty() && (!topics.ins.empty() || odometry.empty());
  if (topics.ins.empty() && fixes.size() <= 1 && imus.empty() && odometry.size() == 1)
    return {fix, "", odometry.front()};
  if (topics.ins.empty() && fixes.empty() && odometry.size() == 1) return {"", "", of(odometry)};
  if (fixes.empty() && odometry.empty()) return {};
  *why = no_orientation
             ? "the NavSatFix of " + fix +
                   " has no orientation beside it (of an Imu): nothing can be compared"
             : "several topics could be the INS, nothing is compared; choose with --ins-topic and "
               "--imu-topic; " +
                   list();
  return {};
}

}  // namespace

RecordedIns bag_ins(const std::filesystem::path& path, const BagIndex& bag,
                    const BagTopics& topics) {
  std::vector<std::string> possible = usable(bag.fixes);
  for (const std::string& name : usable(bag.odometry)) possible.push_back(name);
  require(path, bag, "--ins-topic", topics.ins, possible);
  require(path, bag, "--imu-topic", topics.imu, usable(bag.attitudes));
  std::string why;
  const Choice chosen = choose(bag, topics, &why);
  RecordedIns ins;
  const ReadingTopic<RosFix> none;
  const ReadingTopic<RosFix>& fixes = chosen.fix.empty() ? none : bag.fixes.at(chosen.fix);
  if (!chosen.odometry.empty()) {
    const auto& topic = bag.odometry.at(chosen.odometry);
    ins = of_odometry(chosen.odometry, topic.readings, chosen.fix, fixes.readings);
    remark_left_out(chosen.odometry, topic, &ins.remarks);
  } else if (!chosen.imu.empty()) {
    const auto& topic = bag.attitudes.at(chosen.imu);
    ins = of_fixes(chosen.fix, fixes.readings, chosen.imu, topic.readings);
    remark_left_out(chosen.imu, topic, &ins.remarks);
  }
  remark_left_out(chosen.fix, fixes, &ins.remarks);
  if (!why.empty()) ins.remarks.push_back(why);
  return ins;
}

}  // namespace vergence::app::detail
