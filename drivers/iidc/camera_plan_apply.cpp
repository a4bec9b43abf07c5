#include <algorithm>
#include <cmath>
#include <string>

#include "drivers/iidc/camera_plan.hpp"
#include "drivers/iidc/text.hpp"

namespace vergence::iidc {
namespace {

/// The size and packets of a Format 7 mode, in the order in which region and sensor always agree.
bool write_format7(CameraRegisters& r, const CameraPlan& plan, std::string* error) {
  using namespace reg::format7;
  r.set_at(plan.csr + kCoding, static_cast<std::uint32_t>(plan.coding) << 24U);
  r.set_at(plan.csr + kPosition, 0);
  r.set_at(plan.csr + kSize, plan.size.quadlet());
  r.set_at(plan.csr + kPosition, plan.position.quadlet());
  if (!r.apply_format7(plan.csr, kErrorRegion)) {
    *error = text("the camera refuses the region %d x %d at (%d, %d)", plan.size.width,
                  plan.size.height, plan.position.width, plan.position.height);
    return false;
  }
  const Size limits = Size::of(r.get_at(plan.csr + kPacketLimits));  // they may depend on the size
  const std::size_t packet = plan.shape.packet_bytes;
  if (limits.height != 0 &&
      (packet > limits.height || (limits.width != 0 && packet % limits.width != 0))) {
    *error =
        text("the camera takes packets of at most %d bytes in steps of %d at this size, not %zu",
             limits.height, limits.width, packet);
    return false;
  }
  r.set_at(plan.csr + kPacketBytes, static_cast<std::uint32_t>(packet) << 16U);
  if (!r.apply_format7(plan.csr, kErrorPacket)) {
    *error = text("the camera refuses packets of %zu bytes", packet);
    return false;
  }
  return true;
}

/// Exposure and gain by hand, every automatic that would change them off.
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
    r.switch_off(Feature::frame_rate);  // on, it shortens exposures and skips pulses
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
  return FrameInfoLayout::of(r.get(reg::kFrameInfo));  // what a camera lacks stays off
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
  r.transmit(false);  // also what a program that crashed has left on
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
    const std::uint32_t total =
        r.get_at(out.csr + reg::format7::kTotalBytesLow);  // the high half: frames of 4 GB
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
  const DeviceStatus status = r.take_status();
  if (status != DeviceStatus::ok) {
    *error = r.last_error();
    return status;
  }
  *plan = out;
  return DeviceStatus::ok;
}

}  // namespace vergence::iidc
