#include "app/session/records.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <iterator>
#include <numbers>

#include "app/datasets/text_file.hpp"
#include "app/runtime/errors.hpp"
#include "app/runtime/terminal_text.hpp"
#include "core/math/so3.hpp"

namespace vergence::app {

LineFile::LineFile(const std::filesystem::path& file, std::size_t pending)
    : path_(file),
      pending_(pending),
      fd_(::open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644)) {
  if (fd_ < 0)
    throw InputError(file.string() + ": cannot be written (" + std::strerror(errno) +
                     "); check the disk and the directory's permissions");
  waiting_.reserve(pending_);
}

LineFile::~LineFile() { close(); }

bool LineFile::append(std::string_view line) {
  const auto fits = [&] { return waiting_.size() + line.size() <= pending_; };
  // A full buffer between two of the owner's flushes is no sign of a full disk.
  if (!fits() && (fault_ != 0 || !flush() || !fits())) {
    ++lost_lines_;
    return false;
  }
  waiting_.append(line);
  return true;
}

bool LineFile::flush() {
  if (fd_ < 0) return false;
  std::size_t done = 0;
  fault_ = pretend_full_ && !waiting_.empty() ? ENOSPC : 0;
  while (done < waiting_.size() && fault_ == 0) {
    const ssize_t n = ::write(fd_, waiting_.data() + done, waiting_.size() - done);
    if (n > 0)
      done += static_cast<std::size_t>(n);
    else if (n == 0 || errno != EINTR)
      fault_ = n == 0 ? ENOSPC : errno;
  }
  waiting_.erase(0, done);
  return fault_ == 0;
}

void LineFile::write_back() noexcept {
  // sync_file_range() fails for a pipe, which has nothing to write back.
  (void)::sync_file_range(fd_, 0, 0, SYNC_FILE_RANGE_WRITE);
}

bool LineFile::close() {
  if (fd_ < 0) return fault_ == 0;
  // Pipes cannot be synchronised and report EINVAL, which is no loss.
  if (flush() && ::fdatasync(fd_) != 0 && errno != EINVAL) fault_ = errno;
  if (::close(fd_) != 0 && fault_ == 0) fault_ = errno;
  fd_ = -1;
  return fault_ == 0;
}

void LineFile::close(std::vector<std::string>* faults) {
  const bool good = close();
  if (good && lost_lines_ == 0) return;
  faults->push_back(
      fmt::format("{}: is not complete ({}); check the disk and free space on it", path_.string(),
                  good ? fmt::format("{} lines are lost", lost_lines_) : std::strerror(fault_)));
}

namespace {

/// Representation of an event of the estimator in events.jsonl.
struct EventFormat {
  const char* kind;
  // Text before the estimator's message; may be empty.
  const char* opening;
  // JSON name of EstimatorEvent::value; null if the event has no value.
  const char* field;
};
/// In the order of EstimatorEvent::Kind.
constexpr std::array kEventFormats{
    EventFormat{"state", "", nullptr},
    EventFormat{"map_reset", "", "gap_s"},
    EventFormat{"time_gap", "", "gap_s"},
    EventFormat{"relocalised", "", nullptr},
    EventFormat{"frame_dropped", "", "older_s"},
    EventFormat{"rig_changed", "", "frames_since_onset"},
    EventFormat{"rig_not_rigid", "", "offset_frames"},
    EventFormat{"out_of_sync", "", "lag_frames"},
    EventFormat{"cameras_in_sync", "", nullptr},
    EventFormat{"calibration_verified", "", "depth_sigma_percent"},
    EventFormat{"calibration_contradicted", "", "depth_percent"},
    EventFormat{"focal_length_contradicted", "", "measured_px"},
    EventFormat{"calibration_accepted", "a new calibration is in use", "frames"},
    EventFormat{"calibration_rejected", "a calibration was rejected", "frames"},
    EventFormat{"calibration_applied", "", "fitting_percent"},
    EventFormat{"calibration_pending", "the calibration is postponed", nullptr},
    EventFormat{"calibration_resumed", "the last calibration is in use again", nullptr}};
static_assert(kEventFormats.size() ==
              static_cast<std::size_t>(EstimatorEvent::Kind::calibration_resumed) + 1);

/// As much of the text as fits, in whole UTF-8 characters, with a 0 behind it.
template <std::size_t N>
void copy_text(std::string_view text, std::array<char, N>* out) noexcept {
  std::size_t n = std::min(text.size(), N - 1);
  if (n < text.size())
    while (n > 0 && (static_cast<unsigned char>(text[n]) & 0xc0U) == 0x80U) --n;
  std::copy_n(text.begin(), n, out->begin());
  (*out)[n] = 0;
}

/// east … heading_deg, a comma before each; empty where there is nothing.
void append_enu(std::string* line, bool valid, const EnuPose& e) {
  if (!valid) {
    *line += ",,,,,,,";
    return;
  }
  const auto out = std::back_inserter(*line);
  for (const double v : e.T_enu_left.t) fmt::format_to(out, ",{:.4f}", v);
  // 1e-9 degrees are a tenth of a millimetre.
  fmt::format_to(out, ",{:.9f},{:.9f},{:.4f},{:.4f}", e.position.latitude_deg,
                 e.position.longitude_deg, e.position.height_m, compass_heading_deg(e.yaw));
}

/// x y z qx qy qz qw, `between` before each.
void append_transform(std::string* line, const Transform& T, char between) {
  const auto out = std::back_inserter(*line);
  const Eigen::Quaterniond q = quaternion(T.R);
  for (const double v : {T.t.x(), T.t.y(), T.t.z(), q.x(), q.y(), q.z(), q.w()})
    fmt::format_to(out, "{}{:.9f}", between, v);
}

/// A comma and a number for each; commas alone where all are zero, which stands for "not given".
template <std::size_t N>
void append_sigmas(std::string* line, const std::array<double, N>& values) {
  const bool given = std::ranges::any_of(values, [](double v) { return v > 0; });
  for (const double v : values)
    if (given)
      fmt::format_to(std::back_inserter(*line), ",{:.9f}", v);
    else
      *line += ',';
}

/// The first four coefficients and their sigmas.
void append_distortion(std::string* line, const Intrinsics& lens) {
  std::array<double, 4> sigma{};
  std::copy_n(lens.distortion_sigma.begin(), sigma.size(), sigma.begin());
  for (std::size_t i = 0; i < sigma.size(); ++i)
    fmt::format_to(std::back_inserter(*line), ",{:.9f}", lens.distortion[i]);
  append_sigmas(line, sigma);
}

/// A comma, and a word or message as one field.
void append_field(std::string* line, std::string_view text) {
  *line += ',';
  for (const char c : text) *line += c == ',' || c == '\n' || c == '"' ? ';' : c;
}

void append_text(std::string* line, std::string_view text) {
  constexpr std::string_view kReplacement = "\xef\xbf\xbd";
  *line += '"';
  while (!text.empty()) {
    const std::size_t n = utf8_length(text);
    const char c = text.front();
    if (n == 0)
      *line += kReplacement;
    else if (c == '"' || c == '\\')
      (*line += '\\') += c;
    else if (static_cast<unsigned char>(c) < 0x20)
      fmt::format_to(std::back_inserter(*line), "\\u{:04x}", static_cast<unsigned>(c));
    else
      *line += text.substr(0, n);
    text.remove_prefix(n == 0 ? 1 : n);
  }
  *line += '"';
}

void append_value(std::string* line, std::int64_t value) {
  fmt::format_to(std::back_inserter(*line), "{}", value);
}

/// The shortest digits that read back the same; always recognisable as a number with a point.
void append_value(std::string* line, double value) {
  if (!std::isfinite(value)) {
    *line += "null";
    return;
  }
  const std::size_t begin = line->size();
  fmt::format_to(std::back_inserter(*line), "{}", value);
  if (line->find_first_of(".e", begin) == std::string::npos) *line += ".0";
}

void append_value(std::string* line, const char* value) { append_text(line, value); }

}  // namespace

void FrameCounts::add(const PoseSample& sample) noexcept {
  ++read;
  ++(sample.status == PoseStatus::ok         ? ok
     : sample.status == PoseStatus::degraded ? degraded
                                             : lost);
  if (sample.status == PoseStatus::lost) return;
  const Vec3& position = sample.T_world_left.t;
  const Vec3 step = position - newest_position_.value_or(position);
  path_m += std::hypot(step.x(), step.y(), step.z());
  newest_position_ = position;
}

void FrameReport::set_comparison(const ComparedPose& with_ins) noexcept {
  ComparedPose::operator=(with_ins);
  if (ins_valid) T_reference_left = reference.T_enu_left;
}

std::array<double, 4> FrameReport::error() const noexcept {
  // A compass counts clockwise, a yaw the other way.
  return {error_enu.x(), error_enu.y(), error_enu.z(), -error_yaw * (180.0 / std::numbers::pi)};
}

void EventRecord::set_message(std::string_view text) noexcept { copy_text(text, &message); }

EventRecord::EventRecord(Stamp when, const char* what, std::string_view text) noexcept
    : stamp(when), kind(what) {
  set_message(text);
}

EventRecord EventRecord::of(const EstimatorEvent& event) noexcept {
  using Kind = EstimatorEvent::Kind;
  const EventFormat& format = kEventFormats[static_cast<std::size_t>(event.kind)];
  if (event.kind == Kind::state) {
    const auto from = to_string(event.from), to = to_string(event.to);
    EventRecord r(event.stamp, format.kind, "{} to {}: {}", from, to, event.why);
    // The words are string literals: views of them end with 0.
    r.fields[0] = {"from", from.data()};
    r.fields[1] = {"to", to.data()};
    return r;
  }
  const std::string_view begin = format.opening,
                         why = event.kind == Kind::calibration_accepted ? "" : event.why;
  EventRecord r =
      event.kind == Kind::calibration_contradicted && event.value > 0
          ? EventRecord(event.stamp, format.kind, "{}: depth error {:.1f} %", why, event.value)
      : event.kind == Kind::focal_length_contradicted
          ? EventRecord(event.stamp, format.kind, "{}: measured {:.0f} px", why, event.value)
          : EventRecord(event.stamp, format.kind, "{}{}{}", begin,
                        begin.empty() || why.empty() ? "" : ": ", why);
  if (format.field != nullptr) r.fields[0] = {format.field, event.value};
  std::size_t n = 1;
  const ChangeEvidence& e = event.evidence;
  if (e.log_likelihood_ratio > 0) r.fields[n++] = {"log_likelihood_ratio", e.log_likelihood_ratio};
  if (e.shift_px > 0) {
    r.fields[n++] = {"shift_px", e.shift_px};
    r.fields[n] = {"rotation_mrad", e.rotation_mrad};
  }
  return r;
}

CalibrationRecord CalibrationRecord::begin(const RigCalibration& rig, Stamp stamp,
                                           const char* cause, std::string_view origin) noexcept {
  CalibrationRecord r;
  r.stamp = stamp;
  r.accepted = true;
  r.calibration = rig;
  r.decided = false;
  r.began_as = cause;
  copy_text(origin, &r.origin);
  return r;
}

void format_pose_row(const FrameReport& r, std::string* line) {
  const PoseSample& p = r.pose;
  const bool posed = p.status != PoseStatus::lost;
  line->clear();
  const auto out = std::back_inserter(*line);
  fmt::format_to(out, "{},{},{},{},{}", p.frame, p.stamp.ns(), to_string(p.state),
                 to_string(p.status), to_string(p.reason));
  if (posed)
    append_transform(line, p.T_world_left, ',');
  else
    *line += ",,,,,,,";
  append_enu(line, r.placed, r.estimate);
  append_enu(line, r.ins_valid, r.reference);
  for (const double v : r.error())
    if (r.compared)
      fmt::format_to(out, ",{:.4f}", v);
    else
      *line += ',';
  fmt::format_to(out, ",{}", p.inliers);
  if (posed)
    fmt::format_to(out, ",{:.4f}", p.reprojection_px);
  else
    *line += ',';
  fmt::format_to(out, ",{:.3f}\n", p.estimate_ms);
}

void format_tum(Stamp stamp, const Transform& T, std::string* line) {
  line->clear();
  append_seconds(line, stamp.ns());
  append_transform(line, T, ' ');
  *line += '\n';
}

void format_calibration(const CalibrationRecord& c, int camera, std::string* line) {
  const auto k = static_cast<std::size_t>(camera);
  const RigCalibration& rig = c.calibration;
  line->clear();
  const auto out = std::back_inserter(*line);
  fmt::format_to(out, "{},{}", c.stamp.ns(),
                 c.accepted        ? "accepted"
                 : c.is_refinement ? "unchanged"
                                   : "rejected");
  append_field(line, c.cause_name());
  append_field(line, c.why());
  fmt::format_to(out, ",{}", rig.frames);
  if (c.decided)
    fmt::format_to(out, ",{},{},{:.4f},{:.4f},{:.4f},{:.6f}", c.latency_frames, c.onset_frame,
                   rig.reprojection_px, c.held_out_before_px, c.held_out_after_px, rig.scale_sigma);
  else
    fmt::format_to(out, ",,,{:.4f},,,{:.6f}", rig.reprojection_px, rig.scale_sigma);
  const Transform& T = rig.T_camera_left[k];
  const Vec3 phi = log_so3(T.R);
  fmt::format_to(out, ",{}", k);
  for (const double v : {phi.x(), phi.y(), phi.z(), T.t.x(), T.t.y(), T.t.z()})
    fmt::format_to(out, ",{:.9f}", v);
  append_sigmas(line, rig.sigma_noise[k]);
  append_sigmas(line, rig.sigma_total[k]);
  const Intrinsics& lens = rig.intrinsics[k];
  fmt::format_to(out, ",{:.5f},{:.5f},{:.5f},{:.5f}", lens.fx, lens.fy, lens.cx, lens.cy);
  append_sigmas(line, lens.sigma);
  append_distortion(line, lens);
  append_distortion(line, rig.intrinsics[0]);
  if (c.decided && c.reference_depth_m > 0)
    fmt::format_to(out, ",{:.2f},{:.4f},{:.4f},{:d}", c.reference_depth_m, c.depth_sigma_percent,
                   c.depth_error_percent, c.verified);
  else
    *line += ",,,,";
  *line += '\n';
}

void format_event(const EventRecord& event, std::string* line) {
  line->clear();
  fmt::format_to(std::back_inserter(*line), "{{\"stamp_ns\":{},\"kind\":", event.stamp.ns());
  append_text(line, event.kind);
  *line += ",\"message\":";
  append_text(line, event.message.data());
  *line += ",\"fields\":{";
  bool any = false;
  for (const EventField& f : event.fields) {
    if (f.name == nullptr) continue;
    if (any) *line += ',';
    any = true;
    append_text(line, f.name);
    *line += ':';
    std::visit([line](auto value) { append_value(line, value); }, f.value);
  }
  *line += "}}\n";
}

}  // namespace vergence::app
