#include "drivers/v4l2/settings.hpp"

#include <linux/v4l2-subdev.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <vector>

#include "drivers/common/refused.hpp"
#include "drivers/format_text.hpp"

namespace vergence::v4l2 {

namespace {

std::string number_text(double value) { return format_text("%.6g", value); }

// Relative difference of requested and chosen rate above which a remark is made.
constexpr double kRateTolerance = 0.02;
// Maximum number of sizes and formats named in a message.
constexpr std::uint32_t kMaxListed = 24;

std::string size_text(std::uint32_t width, std::uint32_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

DeviceStatus to_status(int error) noexcept {
  switch (error) {
    case ENODEV:
      return DeviceStatus::disconnected;
    case EBUSY:
      return DeviceStatus::busy;
    default:
      return DeviceStatus::failed;
  }
}

/// Steps of apply(), which share intermediate results.
class Applier {
 public:
  Applier(int fd, std::uint32_t type, const Controls& controls,
          const CameraConfiguration& requested, const Options& options, std::string* message)
      : fd_(fd),
        type_(type),
        controls_(controls),
        requested_(requested),
        options_(options),
        last_error_(message) {
    out_.actual = requested;
    out_.options = options;
  }

  DeviceStatus run(Settings* settings) {
    return run_steps([&] {
      other_controls();
      region();
      format();
      rate();
      exposure();
      gain();
      trigger();
      out_.readout = options_.readout < Duration{} ? sensor_readout() : options_.readout;
      *settings = std::move(out_);
    });
  }

 private:
  [[noreturn]] void refuse(DeviceStatus status, std::string message) {
    *last_error_ = std::move(message);
    throw Refused{status};
  }
  [[noreturn]] void system(int error, const std::string& what) {
    if (error == EBUSY)
      refuse(DeviceStatus::busy, "another program streams from this camera; end it first");
    refuse(to_status(error), what + " failed: " + std::strerror(error));
  }
  void remark(const std::string& message) {
    out_.remark += (out_.remark.empty() ? "" : "; ") + message;
  }

  void set(const Control& control, std::int64_t value) {
    const int error = write(control, value);
    if (error == 0) return;
    if (error == EINVAL || error == ERANGE)
      refuse(DeviceStatus::unsupported,
             control.key + " takes " + format_range(control) + ", not " + std::to_string(value));
    system(error, "setting " + control.key);
  }
  /// Value of a control that may be absent.
  void set_if_there(std::uint32_t id, std::int64_t value) {
    const Control* c = controls_.find(id);
    if (c != nullptr) set(*c, clamped(*c, value));
  }
  [[nodiscard]] double read_or(std::uint32_t id, double fallback) const {
    const Control* c = controls_.find(id);
    std::int64_t value = 0;
    return c != nullptr && read(*c, &value) == 0 ? static_cast<double>(value) : fallback;
  }

  void other_controls() {
    for (const auto& [key, text] : options_.controls) {
      const Control* c = controls_.find(key);
      if (c == nullptr)
        refuse(DeviceStatus::unsupported,
               "there is no control " + key + "; this camera has " + controls_.keys());
      std::int64_t value = 0;
      if (!parse_value(*c, text, &value))
        refuse(DeviceStatus::unsupported,
               "control_" + key + " is \"" + text + "\"; it takes " + format_range(*c));
      set(*c, value);
    }
  }

  void region() {
    if (requested_.offset_x == 0 && requested_.offset_y == 0) return;
    v4l2_selection s{};
    s.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    s.target = V4L2_SEL_TGT_CROP;
    s.r = {requested_.offset_x, requested_.offset_y, static_cast<__u32>(requested_.width),
           static_cast<__u32>(requested_.height)};
    if (control(fd_, VIDIOC_S_SELECTION, &s) == 0 && s.r.left == requested_.offset_x &&
        s.r.top == requested_.offset_y && s.r.width == static_cast<__u32>(requested_.width) &&
        s.r.height == static_cast<__u32>(requested_.height))
      return;
    refuse(DeviceStatus::unsupported,
           "this camera cannot read out a region at " + std::to_string(requested_.offset_x) + ", " +
               std::to_string(requested_.offset_y) + "; set offset to [0, 0]");
  }

  [[nodiscard]] std::vector<std::uint32_t> offered() const {
    std::vector<std::uint32_t> list;
    v4l2_fmtdesc d{};
    d.type = type_;
    for (d.index = 0; d.index < 256 && control(fd_, VIDIOC_ENUM_FMT, &d) == 0; ++d.index)
      list.push_back(d.pixelformat);
    return list;
  }

  [[nodiscard]] std::string sizes(std::uint32_t fourcc) const {
    std::string list;
    v4l2_frmsizeenum e{};
    e.pixel_format = fourcc;
    for (e.index = 0; e.index < kMaxListed && control(fd_, VIDIOC_ENUM_FRAMESIZES, &e) == 0;
         ++e.index) {
      if (e.type != V4L2_FRMSIZE_TYPE_DISCRETE)
        return size_text(e.stepwise.min_width, e.stepwise.min_height) + " to " +
               size_text(e.stepwise.max_width, e.stepwise.max_height);
      list += (list.empty() ? "" : ", ") + size_text(e.discrete.width, e.discrete.height);
    }
    return list;
  }

  void format() {
    const std::vector<std::uint32_t> list = offered();
    const PixelFormat* chosen = choose_format(list, requested_.pixel_format);
    if (chosen == nullptr) {
      std::string names;
      for (const std::uint32_t f : list) names += (names.empty() ? "" : ", ") + name_of(f);
      refuse(DeviceStatus::unsupported,
             (requested_.pixel_format.empty() ? "no pixel format with grey values"
                                              : "no pixel format " + requested_.pixel_format) +
                 "; this camera offers " + (names.empty() ? "none" : names));
    }
    v4l2_format f{};
    f.type = type_;
    const auto width = static_cast<__u32>(requested_.width),
               height = static_cast<__u32>(requested_.height);
    const bool planes = V4L2_TYPE_IS_MULTIPLANAR(type_);
    if (planes) {
      f.fmt.pix_mp.width = width;
      f.fmt.pix_mp.height = height;
      f.fmt.pix_mp.pixelformat = chosen->fourcc;
      f.fmt.pix_mp.field = V4L2_FIELD_NONE;
      f.fmt.pix_mp.num_planes = 1;
    } else {
      f.fmt.pix.width = width;
      f.fmt.pix.height = height;
      f.fmt.pix.pixelformat = chosen->fourcc;
      f.fmt.pix.field = V4L2_FIELD_NONE;
    }
    if (const int error = control(fd_, VIDIOC_S_FMT, &f); error != 0)
      system(error, "setting " + name_of(chosen->fourcc) + " " + size_text(width, height));
    // The kernel silently adjusts values that it does not support.
    const __u32 got_width = planes ? f.fmt.pix_mp.width : f.fmt.pix.width,
                got_height = planes ? f.fmt.pix_mp.height : f.fmt.pix.height;
    const __u32 got_format = planes ? f.fmt.pix_mp.pixelformat : f.fmt.pix.pixelformat,
                field = planes ? f.fmt.pix_mp.field : f.fmt.pix.field;
    if (got_width != width || got_height != height) {
      const std::string list_of_sizes = sizes(chosen->fourcc);
      refuse(DeviceStatus::unsupported,
             "no size " + size_text(width, height) + " in " + name_of(chosen->fourcc) +
                 "; this camera offers " +
                 (list_of_sizes.empty() ? size_text(got_width, got_height) : list_of_sizes));
    }
    if (got_format != chosen->fourcc || (planes && f.fmt.pix_mp.num_planes != 1))
      refuse(DeviceStatus::unsupported, "the camera gives " + name_of(got_format) + " where " +
                                            name_of(chosen->fourcc) +
                                            " was requested: name another pixel_format");
    if (field != V4L2_FIELD_NONE && field != V4L2_FIELD_ANY)
      refuse(DeviceStatus::unsupported,
             "the camera sends interlaced images, whose halves are exposed at different times; "
             "choose another format");
    out_.stride = planes ? f.fmt.pix_mp.plane_fmt[0].bytesperline : f.fmt.pix.bytesperline;
    out_.image_size = planes ? f.fmt.pix_mp.plane_fmt[0].sizeimage : f.fmt.pix.sizeimage;
    out_.format = *chosen;
    if (chosen->layout == Layout::mosaic && (requested_.width < 2 || requested_.height < 2))
      refuse(DeviceStatus::unsupported, "a Bayer mosaic needs at least two rows and columns");
    if (options_.shift >= 0 && chosen->layout == Layout::words) out_.format.shift = options_.shift;
    out_.stride = std::max(out_.stride, min_row_bytes(out_.format, requested_.width));
    if (out_.image_size <
        min_frame_bytes(out_.format, requested_.width, requested_.height, out_.stride))
      refuse(DeviceStatus::unsupported,
             "the driver's buffers of " + std::to_string(out_.image_size) + " bytes do not hold " +
                 size_text(width, height) + " in " + name_of(chosen->fourcc));
    out_.actual.pixel_format = name_of(chosen->fourcc);
  }

  void rate() {
    v4l2_streamparm p{};
    p.type = type_;
    const int error = control(fd_, VIDIOC_G_PARM, &p);
    if (error == 0 && (p.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0) {
      p.parm.capture.timeperframe = {
          1000, static_cast<__u32>(std::lround(requested_.rate_hz * options_.thin * 1000))};
      if (const int set_error = control(fd_, VIDIOC_S_PARM, &p); set_error != 0)
        system(set_error, "setting the rate");
    }
    const v4l2_fract& t = p.parm.capture.timeperframe;
    if (error == 0 && t.numerator > 0 && t.denominator > 0)
      out_.camera_rate_hz = static_cast<double>(t.denominator) / t.numerator;
    if (error != 0) out_.camera_rate_hz = sensor_rate();
    // The pulses determine the rate.
    if (requested_.trigger == CameraTrigger::hardware) return;
    const double camera = out_.camera_rate_hz;
    if (!(camera > 0)) {
      remark("the camera does not report its rate");
      return;
    }
    if (options_.thin > 1 && camera >= requested_.rate_hz) return;
    if (std::abs(camera - requested_.rate_hz) > kRateTolerance * requested_.rate_hz)
      remark("the camera runs at " + number_text(camera) + " Hz instead of " +
             number_text(requested_.rate_hz) + " requested" +
             (camera > 1.5 * requested_.rate_hz
                  ? "; the option thin reduces the rate to the requested one"
                  : ""));
    out_.actual.rate_hz = camera;
  }

  /// Line time of a raw sensor from blanking and pixel clock; 0 if unknown.
  [[nodiscard]] double sensor_rate() const {
    const double line = line_seconds();
    const double lines = static_cast<double>(requested_.height) + read_or(V4L2_CID_VBLANK, 0);
    return line > 0 ? 1 / (line * lines) : 0;
  }
  [[nodiscard]] double line_seconds() const {
    const double clock = read_or(V4L2_CID_PIXEL_RATE, 0);
    const double blank = read_or(V4L2_CID_HBLANK, -1);
    return clock > 0 && blank >= 0 ? (requested_.width + blank) / clock : 0;
  }
  [[nodiscard]] Duration sensor_readout() const {
    return Duration::seconds(line_seconds() * requested_.height);
  }

  void exposure() {
    set_if_there(V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL);
    set_if_there(V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0);
    if (const Control* c = controls_.find(V4L2_CID_EXPOSURE_ABSOLUTE); c != nullptr)
      return set_exposure(*c, 1e-4);
    if (const Control* c = controls_.find(V4L2_CID_EXPOSURE); c != nullptr && line_seconds() > 0)
      return set_exposure(*c, line_seconds());
    remark(
        "the camera has no exposure control in microseconds; exposure_us is assumed to be its "
        "exposure");
  }
  /// `unit` is the number of seconds per step of the control.
  void set_exposure(const Control& c, double unit) {
    const std::int64_t steps = std::llround(requested_.exposure.to_seconds() / unit);
    const std::int64_t value = clamped(c, steps);
    if (std::llabs(value - steps) > c.step)
      refuse(DeviceStatus::unsupported,
             "no exposure of " + number_text(requested_.exposure.to_seconds() * 1e6) +
                 " us; this camera offers " +
                 number_text(static_cast<double>(c.least) * unit * 1e6) + " to " +
                 number_text(static_cast<double>(c.most) * unit * 1e6) + " us at this rate");
    set(c, value);
    out_.exposure_id = c.id;
    out_.exposure_unit_s = unit;
    out_.actual.exposure = Duration::seconds(static_cast<double>(value) * unit);
    if (out_.actual.exposure <= Duration{}) out_.actual.exposure = requested_.exposure;
  }

  void gain() {
    set_if_there(V4L2_CID_AUTOGAIN, 0);
    const Control* c = controls_.find(V4L2_CID_ANALOGUE_GAIN);
    if (c == nullptr) c = controls_.find(V4L2_CID_GAIN);
    if (c == nullptr) {
      if (requested_.gain_db == 0) return;
      refuse(DeviceStatus::unsupported,
             "the camera has no gain control: set gain_db to 0; it has " + controls_.keys());
    }
    for (const auto& [key, text] : options_.controls)
      // The gain is set by number.
      if (key == c->key) return;
    if (requested_.gain_db != 0 && options_.gain_step_db <= 0)
      refuse(DeviceStatus::unsupported, "the camera does not report the dB per step of " + c->key +
                                            " (" + format_range(*c) +
                                            "); set the option gain_step_db, or control_" + c->key);
    const double step = options_.gain_step_db > 0 ? options_.gain_step_db : 1;
    const std::int64_t value = c->least + std::llround(requested_.gain_db / step);
    if (value < c->least || value > c->most)
      refuse(DeviceStatus::unsupported,
             "no gain of " + number_text(requested_.gain_db) + " dB; this camera offers 0 to " +
                 number_text(static_cast<double>(c->most - c->least) * step));
    out_.gain_id = c->id;
    out_.gain_unit_db = options_.gain_step_db;
    out_.actual.gain_db = static_cast<double>(value - c->least) * options_.gain_step_db;
    set(*c, clamped(*c, value));
  }

  void trigger() {
    if (requested_.trigger == CameraTrigger::software)
      refuse(DeviceStatus::unsupported,
             "V4L2 has no software trigger; set trigger to hardware or free");
    const bool hardware = requested_.trigger == CameraTrigger::hardware;
    if (options_.trigger_control == "external") return;
    const Control* c = options_.trigger_control.empty() ? controls_.trigger()
                                                        : controls_.find(options_.trigger_control);
    if (c == nullptr) {
      if (!hardware && options_.trigger_control.empty()) return;
      refuse(DeviceStatus::unsupported,
             (options_.trigger_control.empty()
                  ? "the camera has no control with \"trigger\" in its name"
                  : "there is no control " + options_.trigger_control) +
                 "; it has " + controls_.keys() +
                 ". If a module parameter or the device tree switches its trigger, set the "
                 "option trigger_control to external; "
                 "else set trigger to free");
    }
    std::int64_t value = hardware ? trigger_on(*c) : 0;
    if (hardware && !options_.trigger_value.empty() &&
        !parse_value(*c, options_.trigger_value, &value))
      refuse(DeviceStatus::unsupported, "trigger_value is \"" + options_.trigger_value + "\"; " +
                                            c->key + " takes " + format_range(*c));
    set(*c, value);
  }

  int fd_;
  std::uint32_t type_;
  const Controls& controls_;
  const CameraConfiguration& requested_;
  const Options& options_;
  std::string* last_error_;
  Settings out_{};
};

}  // namespace

DeviceStatus apply(int fd, std::uint32_t buffer_type, const Controls& controls,
                   const CameraConfiguration& requested, const Options& options, Settings* settings,
                   std::string* message) {
  return Applier(fd, buffer_type, controls, requested, options, message).run(settings);
}

DeviceStatus change_exposure(const Controls& controls, const Settings& settings,
                             const ExposureSetting& requested, ExposureSetting* actual) noexcept {
  const auto to_status = [](int error) {
    return error == 0        ? DeviceStatus::ok
           : error == ENODEV ? DeviceStatus::disconnected
                             : DeviceStatus::failed;
  };
  const Control* exposure =
      settings.exposure_id != 0 ? controls.find(settings.exposure_id) : nullptr;
  if (exposure == nullptr) return DeviceStatus::unsupported;
  const std::int64_t steps =
      clamped(*exposure, std::llround(requested.exposure.to_seconds() / settings.exposure_unit_s));
  if (const DeviceStatus s = to_status(write(*exposure, steps)); s != DeviceStatus::ok) return s;
  *actual = {Duration::seconds(static_cast<double>(steps) * settings.exposure_unit_s),
             settings.actual.gain_db};
  const Control* gain = settings.gain_id != 0 && settings.gain_unit_db > 0
                            ? controls.find(settings.gain_id)
                            : nullptr;
  if (gain == nullptr) return DeviceStatus::ok;
  const std::int64_t level =
      clamped(*gain, gain->least + std::llround(requested.gain_db / settings.gain_unit_db));
  if (const DeviceStatus s = to_status(write(*gain, level)); s != DeviceStatus::ok) return s;
  actual->gain_db = static_cast<double>(level - gain->least) * settings.gain_unit_db;
  return DeviceStatus::ok;
}

}  // namespace vergence::v4l2
