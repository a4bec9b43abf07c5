#include "drivers/iidc/camera_plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/types/bayer.hpp"
#include "drivers/common/refused.hpp"
#include "drivers/format_text.hpp"

namespace vergence::iidc {
bool GreyConversion::possible() const noexcept {
  switch (coding) {
    case ColorCoding::mono8:
    case ColorCoding::raw8:
      return true;
    case ColorCoding::mono16:
    case ColorCoding::raw16:
      return !mosaic && effective_bits >= 8 && effective_bits <= 16;
    case ColorCoding::yuv422:
      return !mosaic;
    default:
      return false;
  }
}

void to_grey(const GreyConversion& conversion, const std::uint8_t* in, int width, int height,
             std::uint8_t* out, std::size_t stride) noexcept {
  if (conversion.mosaic) {
    bayer_to_grey(in, width, width, height, out, static_cast<std::ptrdiff_t>(stride));
    return;
  }
  const std::size_t in_stride = frame_bytes(static_cast<unsigned>(width), 1, conversion.coding);
  for (int y = 0; y < height; ++y) {
    const std::uint8_t* row = in + static_cast<std::size_t>(y) * in_stride;
    std::uint8_t* to = out + static_cast<std::size_t>(y) * stride;
    switch (conversion.coding) {
      case ColorCoding::mono16:
      case ColorCoding::raw16:
        for (int x = 0; x < width; ++x) {
          const unsigned v = static_cast<unsigned>(row[2 * x]) << 8U | row[2 * x + 1];
          to[x] = static_cast<std::uint8_t>(std::min(255U, v >> (conversion.effective_bits - 8)));
        }
        break;
      case ColorCoding::yuv422:  // U Y V Y
        for (int x = 0; x < width; ++x) to[x] = row[2 * x + 1];
        break;
      default:
        return;
    }
  }
}

namespace {

// Tolerance of a rate: 29.96 Hz counts as 30 Hz.
constexpr double kRateSlack = 0.01;
constexpr unsigned kFormat7Modes = 8;

/// Ordered from the cheapest to the most expensive on the bus.
constexpr std::array kCodings{ColorCoding::mono8, ColorCoding::raw8, ColorCoding::mono16,
                              ColorCoding::raw16, ColorCoding::yuv422};

class Planner {
 public:
  Planner(CameraRegisters* registers, const BusTraits& bus, const CameraConfiguration& requested,
          CameraPlan* plan, std::string* error)
      : r_(*registers), bus_(bus), requested_(requested), plan_(*plan), last_error_(*error) {}

  DeviceStatus run() {
    return run_steps([this] {
      check_numbers();
      if (!parse_options(requested_.options, option_table(), "IIDC cameras", &plan_.options,
                         &last_error_))
        throw Refused{DeviceStatus::unsupported};
      plan_.trigger = requested_.trigger;
      plan_.requested_rate_hz = requested_.rate_hz;
      plan_.size = {static_cast<std::uint16_t>(requested_.width),
                    static_cast<std::uint16_t>(requested_.height)};
      plan_.position = {static_cast<std::uint16_t>(requested_.offset_x),
                        static_cast<std::uint16_t>(requested_.offset_y)};
      for (const auto step :
           {&Planner::choose_speed, &Planner::choose_trigger, &Planner::choose_features,
            &Planner::choose_strobe, &Planner::choose_mode}) {
        (this->*step)();
        check_registers();
      }
    });
  }

 private:
  /// A failed register takes precedence over the values read.
  void check_registers() {
    if (r_.status() == DeviceStatus::ok) return;
    const DeviceStatus failed = r_.pop_status();
    last_error_ = r_.last_error();
    throw Refused{failed};
  }
  [[noreturn]] void refuse(std::string message, DeviceStatus status = DeviceStatus::unsupported) {
    check_registers();
    last_error_ = std::move(message);
    throw Refused{status};
  }

  void check_numbers() {
    constexpr int kMax = 65535;
    if (const std::string invalid = find_invalid(requested_); !invalid.empty())
      refuse(invalid + " is not a valid configuration", DeviceStatus::bad_configuration);
    if (requested_.width > kMax || requested_.height > kMax || requested_.offset_x > kMax ||
        requested_.offset_y > kMax)
      refuse(
          format_text("%d x %d is more than any camera has", requested_.width, requested_.height));
  }

  void choose_speed() {
    const bool beta = BasicFunctions::of(r_.get(reg::kBasicFunctions)).beta;
    BusSpeed most =
        bus_.isochronous && !beta ? std::min(bus_.fastest, BusSpeed::s400) : bus_.fastest;
    if (plan_.options.speed && bus_.isochronous) {
      if (*plan_.options.speed > most)
        refuse(format_text("option speed: the camera and its bus reach %s",
                           std::string(to_string(most)).c_str()));
      most = *plan_.options.speed;
    }
    plan_.shape.speed = most;
    plan_.shape.buffers = plan_.options.buffers;
    largest_ = std::min(bus_.largest_packet,
                        bus_.isochronous ? largest_packet(most) : bus_.largest_packet);
  }

  void choose_trigger() {
    if (requested_.trigger == CameraTrigger::free) return;
    const TriggerInquiry t = TriggerInquiry::of(r_.get(reg::kTriggerInquiry));
    const unsigned source = requested_.trigger == CameraTrigger::software
                                ? kTriggerSourceSoftware
                                : plan_.options.trigger_source;
    if (!t.present || !t.has_source(source) || (!t.has_mode(0) && !t.has_mode(14)))
      refuse((requested_.trigger == CameraTrigger::software
                  ? "this camera has no software trigger"
                  : format_text("this camera has no trigger input %u", source)) +
             offered_triggers(t));
    plan_.trigger_mode = plan_.options.trigger_mode.value_or(t.has_mode(14) ? 14 : 0);
    if (!t.has_mode(plan_.trigger_mode))
      refuse(format_text("this camera has no trigger mode %u", plan_.trigger_mode) +
             offered_triggers(t));
    if (!plan_.options.trigger_rising && !t.polarity)
      refuse(
          "the edge of this camera's trigger cannot be changed; option trigger_edge must be "
          "rising");
  }
  static std::string offered_triggers(const TriggerInquiry& t) {
    if (!t.present) return "; it offers trigger: free";
    std::string out = "; it offers inputs";
    for (unsigned n = 0; n < 4; ++n)
      if (t.has_source(n)) out += " " + std::to_string(n);
    if (t.software) out += ", the software trigger";
    out += ", modes";
    for (unsigned n = 0; n < 16; ++n)
      if (t.has_mode(n)) out += " " + std::to_string(n);
    return out;
  }

  void choose_features() {
    // Relative tolerance for the camera's single-precision values.
    constexpr double kFloat = 1e-6;
    const AbsoluteRange shutter = r_.absolute_range(Feature::shutter);
    const double s = requested_.exposure.to_seconds();
    if (!shutter.present)
      refuse("this camera does not support absolute exposure (IIDC 1.31 and later do)");
    if (s < shutter.least * (1 - kFloat) || s > shutter.most * (1 + kFloat))
      refuse(
          format_text("an exposure of %.6g us is not possible; this camera offers %.6g to %.6g us",
                      s * 1e6, shutter.least * 1e6, shutter.most * 1e6));
    const AbsoluteRange gain = r_.absolute_range(Feature::gain);
    const double slack = kFloat * std::max(1.0, std::abs(requested_.gain_db));
    if (gain.present
            ? requested_.gain_db < gain.least - slack || requested_.gain_db > gain.most + slack
            : requested_.gain_db != 0)
      refuse(gain.present
                 ? format_text("a gain of %g dB is not possible; this camera offers %g to %g dB",
                               requested_.gain_db, gain.least, gain.most)
                 : "this camera does not support absolute gain; set gain_db to 0");
    plan_.exposure = requested_.exposure;
    plan_.gain_db = requested_.gain_db;
    frame_rate_ = r_.absolute_range(Feature::frame_rate);
  }

  void choose_strobe() {
    if (!plan_.options.strobe_pin) return;
    const bool any = (r_.get(reg::kOptionalFunctions) & bit(28)) != 0;
    const std::uint64_t csr = any ? r_.table(reg::kStrobeBase) : 0;
    if (csr != 0 &&
        (r_.get_at(csr + reg::strobe::inquiry(*plan_.options.strobe_pin)) & bit(31)) != 0)
      return;
    refuse(csr == 0
               ? "this camera has no strobe outputs"
               : format_text("this camera has no strobe output %u", *plan_.options.strobe_pin));
  }

  [[nodiscard]] std::vector<ColorCoding> codings() {
    if (requested_.pixel_format.empty()) return {kCodings.begin(), kCodings.end()};
    const auto c = color_coding(requested_.pixel_format);
    return c ? std::vector{*c} : std::vector<ColorCoding>{};
  }

  void choose_mode() {
    const auto candidates = codings();
    const bool region = requested_.offset_x != 0 || requested_.offset_y != 0;
    const bool may_fixed =
        !region && !plan_.options.packet_bytes && !plan_.options.format7.value_or(false);
    const bool may_format7 = plan_.options.format7.value_or(true);
    for (const ColorCoding c : candidates) {
      if ((may_fixed && fixed(c, true)) || (may_format7 && format7(c))) return;
      check_registers();
    }
    for (const ColorCoding c : candidates)
      if (may_fixed && fixed(c, false)) return;
    refuse(format_text("%d x %d", requested_.width, requested_.height) +
           (requested_.pixel_format.empty() ? "" : " " + requested_.pixel_format) +
           format_text(" at %g Hz is not possible", requested_.rate_hz) +
           (why_not_.empty() ? "" : ": " + why_not_) + "; this camera offers " + offers());
  }

  /// If `exactly`, a free-running camera must run at the requested rate instead of the next higher
  /// one, and every camera of the rig must be able to send a packet in each cycle.
  bool fixed(ColorCoding coding, bool exactly) {
    for (const FixedMode& m : fixed_modes()) {
      if (m.coding != coding || m.width != requested_.width || m.height != requested_.height ||
          !r_.has_mode(m.format, m.mode))
        continue;
      const std::uint32_t rates = r_.get(reg::rate_inquiry(m.format, m.mode));
      for (unsigned code = 0; code < kRates; ++code) {
        const std::size_t packet = fixed_packet_bytes(m, code);
        if ((rates & bit(31 - code)) == 0 || packet == 0 || packet > largest_) continue;
        if (rate_of(code) < requested_.rate_hz * (1 - kRateSlack)) continue;
        if (exactly && crowded(packet)) break;
        if (exactly && requested_.trigger == CameraTrigger::free &&
            rate_of(code) > requested_.rate_hz * (1 + kRateSlack))
          break;
        plan_.format = m.format;
        plan_.mode = m.mode;
        plan_.rate_code = code;
        plan_.coding = coding;
        plan_.rate_hz =
            requested_.trigger == CameraTrigger::free ? rate_of(code) : requested_.rate_hz;
        plan_.shape.image_bytes = plan_.shape.frame_bytes = frame_bytes(m.width, m.height, coding);
        plan_.shape.packet_bytes = packet;
        return possible_as_grey();
      }
    }
    return false;
  }

  [[nodiscard]] bool crowded(std::size_t packet) const {
    return bus_.isochronous && requested_.sharing > 1 &&
           bandwidth_units(packet, plan_.shape.speed) * static_cast<unsigned>(requested_.sharing) >
               kBandwidthUnits;
  }

  bool format7(ColorCoding coding) {
    using namespace reg::format7;
    for (unsigned mode = 0; mode < kFormat7Modes; ++mode) {
      if (!r_.has_mode(7, mode)) continue;
      const std::uint64_t csr = r_.table(reg::format7_base(mode));
      if (csr == 0 ||
          (r_.get_at(csr + kCodingInquiry) & bit(31 - static_cast<unsigned>(coding))) == 0)
        continue;
      const Size most = Size::of(r_.get_at(csr + kMaxSize)),
                 unit = Size::of(r_.get_at(csr + kUnitSize));
      Size step = Size::of(r_.get_at(csr + kUnitPosition));
      if (step.width == 0 || step.height == 0) step = unit;
      if (unit.width == 0 || unit.height == 0) continue;
      if (requested_.offset_x + requested_.width > most.width ||
          requested_.offset_y + requested_.height > most.height)
        continue;
      if (requested_.width % unit.width != 0 || requested_.height % unit.height != 0 ||
          requested_.offset_x % step.width != 0 || requested_.offset_y % step.height != 0)
        continue;
      const std::size_t bytes = frame_bytes(plan_.size.width, plan_.size.height, coding);
      // Unit and maximum size of packets.
      const Size limits = Size::of(r_.get_at(csr + kPacketLimits));
      if (!choose_packet(bytes, limits)) continue;
      if (requested_.trigger == CameraTrigger::free && frame_rate_.present &&
          (requested_.rate_hz < frame_rate_.least * (1 - kRateSlack) ||
           requested_.rate_hz > frame_rate_.most * (1 + kRateSlack))) {
        explain_refusal(format_text("its frame rate goes from %g to %g Hz", frame_rate_.least,
                                    frame_rate_.most));
        continue;
      }
      plan_.format = 7;
      plan_.mode = mode;
      plan_.csr = csr;
      plan_.coding = coding;
      plan_.rate_hz = requested_.trigger != CameraTrigger::free || frame_rate_.present
                          ? requested_.rate_hz
                          : packet_rate(bytes, plan_.shape.packet_bytes);
      plan_.shape.image_bytes = bytes;
      plan_.shape.frame_bytes =
          packets_for(bytes, plan_.shape.packet_bytes) * plan_.shape.packet_bytes;
      return possible_as_grey();
    }
    return false;
  }

  /// `limits` are the camera's unit and largest packet; zeros mean no limit.
  bool choose_packet(std::size_t bytes, const Size& limits) {
    const std::size_t unit = limits.width == 0 ? 4 : limits.width;
    const std::size_t most =
        limits.height == 0 ? largest_ : std::min<std::size_t>(limits.height, largest_);
    const std::size_t asked = plan_.options.packet_bytes.value_or(0);
    const std::size_t packet =
        asked != 0 ? asked
                   : packet_for_rate(bytes, requested_.rate_hz * (1 - kRateSlack), unit, most);
    if (packet == 0 || packet > most || packet % unit != 0 ||
        packet_rate(bytes, packet) < requested_.rate_hz * (1 - kRateSlack)) {
      const std::size_t best = asked != 0 && asked <= most ? asked : most / unit * unit;
      explain_refusal(
          format_text("packets of %zu bytes (largest %zu, in steps of %zu) carry %.4g Hz of it",
                      best, most, unit, packet_rate(bytes, best)));
      return false;
    }
    // Larger packets transfer the image faster, if they do not set the rate of a free-running
    // camera.
    const bool paced = requested_.trigger != CameraTrigger::free || frame_rate_.present;
    plan_.shape.packet_bytes =
        asked == 0 && paced ? std::max(packet, std::min(share(), most) / unit * unit) : packet;
    return true;
  }

  /// Bytes per cycle for this camera if the rig's cameras share the bus equally.
  [[nodiscard]] std::size_t share() const {
    const auto cameras = static_cast<unsigned>(std::max(requested_.sharing, 1));
    if (bus_.isochronous) return packet_for_units(kBandwidthUnits / cameras, plan_.shape.speed);
    return static_cast<std::size_t>(bus_.bytes_per_second * kUsbPractical / kCyclesPerSecond) /
           cameras;
  }

  bool possible_as_grey() {
    const bool raw = plan_.coding == ColorCoding::raw8 || plan_.coding == ColorCoding::raw16;
    plan_.grey.coding = plan_.coding;
    plan_.grey.mosaic = raw && is_bayer_tile(r_.get_optional(reg::kBayerTile));
    if (plan_.grey.possible() &&
        (!plan_.grey.mosaic || (requested_.width > 1 && requested_.height > 1)))
      return true;
    explain_refusal(std::string(to_string(plan_.coding)) +
                    " of this camera is not supported; choose another pixel_format");
    return false;
  }

  /// The error of the first and cheapest mode is reported.
  void explain_refusal(const std::string& why) {
    if (why_not_.empty()) why_not_ = why;
  }

  std::string offers() {
    std::string out;
    for (const FixedMode& m : fixed_modes()) {
      if (!r_.has_mode(m.format, m.mode)) continue;
      out += (out.empty() ? "" : ", ") + format_text("%d x %d ", m.width, m.height) +
             std::string(to_string(m.coding)) + " at";
      const std::uint32_t rates = r_.get(reg::rate_inquiry(m.format, m.mode));
      for (unsigned code = 0; code < kRates; ++code)
        if ((rates & bit(31 - code)) != 0) out += format_text(" %g", rate_of(code));
      out += " Hz";
    }
    for (unsigned mode = 0; mode < kFormat7Modes; ++mode) {
      const std::uint64_t csr = r_.has_mode(7, mode) ? r_.table(reg::format7_base(mode)) : 0;
      if (csr == 0) continue;
      const Size most = Size::of(r_.get_at(csr + reg::format7::kMaxSize)),
                 unit = Size::of(r_.get_at(csr + reg::format7::kUnitSize));
      out +=
          (out.empty() ? "" : ", ") + format_text("any region of %d x %d in steps of %d x %d",
                                                  most.width, most.height, unit.width, unit.height);
      const std::uint32_t codings = r_.get_at(csr + reg::format7::kCodingInquiry);
      for (unsigned c = 0; c < kColorCodings; ++c)
        if ((codings & bit(31 - c)) != 0)
          out += " " + std::string(to_string(static_cast<ColorCoding>(c)));
    }
    return out.empty() ? "no format in its registers" : out;
  }

  CameraRegisters& r_;
  const BusTraits& bus_;
  const CameraConfiguration& requested_;
  CameraPlan& plan_;
  std::string& last_error_;
  // Largest packet size.
  std::size_t largest_ = 0;
  AbsoluteRange frame_rate_{};
  std::string why_not_;
};

}  // namespace

DeviceStatus make_plan(CameraRegisters* registers, const BusTraits& bus,
                       const CameraConfiguration& requested, CameraPlan* plan, std::string* error) {
  CameraPlan out;
  const DeviceStatus status = Planner(registers, bus, requested, &out, error).run();
  if (status == DeviceStatus::ok) *plan = out;
  return status;
}

namespace {

/// Writes size and packets of a Format 7 mode, in the order in which region and sensor always
/// agree.
bool write_format7(CameraRegisters& r, const CameraPlan& plan, std::string* error) {
  using namespace reg::format7;
  r.set_at(plan.csr + kCoding, static_cast<std::uint32_t>(plan.coding) << 24U);
  r.set_at(plan.csr + kPosition, 0);
  r.set_at(plan.csr + kSize, plan.size.quadlet());
  r.set_at(plan.csr + kPosition, plan.position.quadlet());
  if (!r.apply_format7(plan.csr, kErrorRegion)) {
    *error = format_text("the camera refuses the region %d x %d at (%d, %d)", plan.size.width,
                         plan.size.height, plan.position.width, plan.position.height);
    return false;
  }
  // The limits may depend on the size.
  const Size limits = Size::of(r.get_at(plan.csr + kPacketLimits));
  const std::size_t packet = plan.shape.packet_bytes;
  if (limits.height != 0 &&
      (packet > limits.height || (limits.width != 0 && packet % limits.width != 0))) {
    *error = format_text(
        "the camera supports packets of at most %d bytes in steps of %d at this size, not %zu",
        limits.height, limits.width, packet);
    return false;
  }
  r.set_at(plan.csr + kPacketBytes, static_cast<std::uint32_t>(packet) << 16U);
  if (!r.apply_format7(plan.csr, kErrorPacket)) {
    *error = format_text("the camera refuses packets of %zu bytes", packet);
    return false;
  }
  return true;
}

/// Sets exposure and gain manually and turns off every automatic control of them.
void write_features(CameraRegisters& r, CameraPlan* plan) {
  for (const Feature f : {Feature::auto_exposure, Feature::gamma, Feature::trigger_delay})
    r.switch_off(f);
  plan->exposure = Duration::seconds(r.set_absolute(Feature::shutter, plan->exposure.to_seconds()));
  if (r.absolute_range(Feature::gain).present)
    plan->gain_db = r.set_absolute(Feature::gain, plan->gain_db);
  const AbsoluteRange rate = r.absolute_range(Feature::frame_rate);
  if (plan->trigger == CameraTrigger::free && rate.present && plan->format == 7) {
    plan->rate_hz = r.set_absolute(Feature::frame_rate,
                                   std::clamp(plan->requested_rate_hz, rate.least, rate.most));
  } else if (plan->trigger != CameraTrigger::free) {
    // When on, this feature would shorten exposures and skip pulses.
    r.switch_off(Feature::frame_rate);
  }
}

void write_trigger(CameraRegisters& r, const CameraPlan& plan) {
  if ((r.get(reg::kTriggerInquiry) & bit(31)) == 0) return;
  TriggerMode t;
  t.on = plan.trigger != CameraTrigger::free;
  t.rising = plan.options.trigger_rising;
  t.source = plan.trigger == CameraTrigger::software ? kTriggerSourceSoftware
                                                     : plan.options.trigger_source;
  t.mode = plan.trigger_mode;
  r.set(reg::kTriggerMode, t.quadlet());
}

void write_strobe(CameraRegisters& r, const Options& o) {
  if (!o.strobe_pin) return;
  const auto ticks = [](Duration d) {
    return static_cast<std::uint32_t>(std::min(4095.0, std::round(d.to_seconds() * 1024e3)));
  };
  StrobeControl s;
  s.on = true;
  s.high = o.strobe_high;
  s.delay = ticks(o.strobe_delay);
  s.duration = ticks(o.strobe_duration);
  const std::uint64_t csr = r.table(reg::kStrobeBase);
  if (csr != 0) r.set_at(csr + reg::strobe::control(*o.strobe_pin), s.quadlet());
}

FrameInfoLayout write_frame_info(CameraRegisters& r, bool requested) {
  if (!BasicFunctions::of(r.get(reg::kBasicFunctions)).advanced) return {};
  if ((r.get_optional(reg::kFrameInfo) & kFrameInfoPresent) == 0) return {};
  const std::uint32_t items =
      frame_info_bit(FrameInfoItem::time) | frame_info_bit(FrameInfoItem::counter);
  r.set(reg::kFrameInfo, kFrameInfoPresent | (requested ? items : 0));
  // Items that the camera lacks stay off.
  return FrameInfoLayout::of(r.get(reg::kFrameInfo));
}

unsigned effective_bits(CameraRegisters& r, const CameraPlan& plan) {
  constexpr std::uint32_t kDataDepth = 0x630, kFormat7DataDepth = 0x54;
  if (bits_per_pixel(plan.coding) != 16) return 16;
  const std::uint32_t depth =
      (plan.format == 7 ? r.get_at(plan.csr + kFormat7DataDepth) : r.get_optional(kDataDepth)) >>
      24U;
  return depth >= 8 && depth <= 16 ? depth : 16;
}

}  // namespace

DeviceStatus apply_plan(CameraRegisters* registers, const BusTraits& bus, CameraPlan* plan,
                        std::string* error) {
  CameraRegisters& r = *registers;
  CameraPlan out = *plan;
  // Stops a stream left running by a program that crashed.
  r.transmit(false);
  if (BasicFunctions::of(r.get(reg::kBasicFunctions)).power_switch) r.set(reg::kPower, bit(31));
  r.set(reg::kVideoFormat, out.format << 29U);
  r.set(reg::kVideoMode, out.mode << 29U);
  if (bus.isochronous) {
    IsoChannel iso = IsoChannel::of(r.get(reg::kIsoChannel));
    iso.beta = out.shape.speed == BusSpeed::s800;
    iso.speed = static_cast<unsigned>(out.shape.speed);
    r.set(reg::kIsoChannel, iso.quadlet());
  }
  if (out.format == 7) {
    if (!write_format7(r, out, error) && r.status() == DeviceStatus::ok)
      return DeviceStatus::unsupported;
    // The high half is not read: it is for frames above 4 GB.
    const std::uint32_t total = r.get_at(out.csr + reg::format7::kTotalBytesLow);
    if (total >= out.shape.image_bytes && total <= out.shape.image_bytes + out.shape.packet_bytes)
      out.shape.frame_bytes = total;
  } else {
    r.set(reg::kFrameRate, out.rate_code << 29U);
  }
  write_features(r, &out);
  write_trigger(r, out);
  write_strobe(r, out.options);
  out.info = write_frame_info(r, out.options.embedded);
  out.grey.effective_bits = effective_bits(r, out);
  const DeviceStatus status = r.pop_status();
  if (status != DeviceStatus::ok) {
    *error = r.last_error();
    return status;
  }
  *plan = out;
  return DeviceStatus::ok;
}

}  // namespace vergence::iidc
