#include "drivers/gige/detail/gige_camera.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "drivers/clock.hpp"

namespace vergence::gige {
namespace {

constexpr std::size_t kSpare =
    3;  // buffers beside the slots that may be out: one is being filled, the next two wait
constexpr std::size_t kWireBuffers = 4;  // where every frame is converted at once

}  // namespace

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

GigeCamera::GigeCamera(std::unique_ptr<Session> session)
    : info_(session->info()), session_(std::move(session)), address_(info_.place) {}

GigeCamera::~GigeCamera() {
  stop();
  session_.reset();
  drop_buffers();
}

DeviceStatus GigeCamera::refuse(DeviceStatus status, std::string sentence) {
  const std::lock_guard lock(words_);
  last_error_ = std::move(sentence);
  return status;
}

std::string GigeCamera::last_error() const {
  const std::lock_guard lock(words_);
  return last_error_;
}

std::string GigeCamera::remark() const {
  const std::lock_guard lock(words_);
  const std::uint64_t untold = untold_.load(std::memory_order_relaxed);
  if (untold == 0) return remark_;
  return remark_ + (remark_.empty() ? "" : "; ") + std::to_string(untold) +
         " images came without their exposure in the chunk data: it was reckoned; if that is most "
         "of them, set the option chunks to off";
}

DeviceStatus GigeCamera::configure(const CameraConfiguration& requested,
                                   CameraConfiguration* actual) noexcept {
  try {
    if (handover_.state() != Handover::State::stopped)
      return refuse(DeviceStatus::busy, "the camera streams; stop it first");
    if (handover_.any_out())
      return refuse(DeviceStatus::busy, "images are still in use; release them first");
    if (requested.width <= 0 || requested.height <= 0 || requested.offset_x < 0 ||
        requested.offset_y < 0)
      return refuse(DeviceStatus::bad_configuration,
                    "a region of " + size_text(requested.width, requested.height) + " px is none");
    if (!(requested.rate_hz > 0) || requested.exposure <= Duration{} ||
        requested.exposure.to_seconds() * requested.rate_hz > 1)
      return refuse(DeviceStatus::bad_configuration,
                    "rate and exposure must be positive, the exposure shorter than the time "
                    "between two images");
    Options options;
    if (std::string why;
        !take_options(requested.options, option_table(), "GigE cameras", &options, &why))
      return refuse(DeviceStatus::unsupported, std::move(why));
    const std::lock_guard lock(device_);
    if (const DeviceStatus s = reach(); s != DeviceStatus::ok) return s;
    Applied applied;
    stale_ = true;
    if (const DeviceStatus s = session_->apply(requested, options, &applied); s != DeviceStatus::ok)
      return refuse(s, session_->last_error());
    stale_ = false;
    requested_ = requested;
    options_ = options;
    applied_ = std::move(applied);
    in_force_ = {applied_.actual.exposure, applied_.actual.gain_db};
    untold_.store(0, std::memory_order_relaxed);
    make_slots();
    configured_ = true;
    if (actual != nullptr) *actual = applied_.actual;
    const std::lock_guard words(words_);
    remark_ = session_->remark();
    return DeviceStatus::ok;
  } catch (const std::exception& e) {
    configured_ = false;
    return DeviceStatus::failed;
  }
}

void GigeCamera::make_slots() {
  drop_buffers();
  converting_ = applied_.format->how != GreyFormat::How::as_it_is;
  const auto most = static_cast<std::size_t>(options_.buffers);
  const auto width = static_cast<std::size_t>(requested_.width),
             height = static_cast<std::size_t>(requested_.height);
  const auto padded = [](std::size_t bytes) {
    return (bytes + kCacheLine - 1) / kCacheLine * kCacheLine;
  };
  slots_ = most +
           (converting_
                ? 1
                : kSpare);  // converting: one more, into which the frame goes that is then refused
  stride_ = converting_ ? FramePool::stride(requested_.width) : width;
  slot_bytes_ = converting_ ? stride_ * height : padded(applied_.payload);
  wire_bytes_ = converting_ ? padded(applied_.payload) : 0;
  arena_ = std::make_unique<Arena>(slots_ * slot_bytes_ + kWireBuffers * wire_bytes_);
  pixels_ = arena_->make<std::uint8_t>(slots_ * slot_bytes_, "slots");
  wire_ = arena_->make<std::uint8_t>(converting_ ? kWireBuffers * wire_bytes_ : 0, "packets");
  // Exactly the payload: Aravis counts the packets of a frame by it.
  for (std::size_t i = 0; i < (converting_ ? kWireBuffers : slots_); ++i)
    buffers_.push_back(arv_buffer_new_full(
        applied_.payload,
        converting_ ? wire_.data() + i * wire_bytes_ : pixels_.data() + i * slot_bytes_,
        GSIZE_TO_POINTER(i), nullptr));
  free_.reserve(slots_);
  handover_.set_slots(slots_, most);
}

void GigeCamera::drop_buffers() noexcept {
  for (ArvBuffer* b : buffers_) g_object_unref(b);
  buffers_.clear();
}

DeviceTiming GigeCamera::timing() const noexcept {
  DeviceTiming t;
  t.least_delay =
      applied_.plan.transfer + (options_.stamp_at_end ? Duration{} : applied_.actual.exposure);
  if (applied_.tick_frequency > 0)
    t.resolution = std::max(Duration::nanoseconds(1),
                            Duration::seconds(1.0 / static_cast<double>(applied_.tick_frequency)));
  return t;
}

/// A session, the old one or a new one. Precondition: device_ held.
DeviceStatus GigeCamera::reach() {
  if (session_ != nullptr && !session_->lost() && session_->in_control()) return DeviceStatus::ok;
  session_.reset();
  DeviceStatus status = DeviceStatus::ok;
  std::string why;
  session_ = Session::open(address_, &status, &why);
  if (session_ == nullptr) return refuse(DeviceStatus::gone, why);
  stale_ = true;
  return DeviceStatus::ok;
}

/// Precondition: device_ held, configured. The slots stay: the same configuration has the same
/// payload.
DeviceStatus GigeCamera::apply_again() {
  Applied again;
  if (const DeviceStatus s = session_->apply(requested_, options_, &again); s != DeviceStatus::ok)
    return refuse(s, session_->last_error());
  if (again.payload != applied_.payload || again.format != applied_.format)
    return refuse(DeviceStatus::gone, "the camera came back with frames of another size");
  applied_ = std::move(again);
  in_force_ = {applied_.actual.exposure, applied_.actual.gain_db};
  stale_ = false;
  return DeviceStatus::ok;
}

DeviceStatus GigeCamera::start(Notifier* ready) noexcept {
  try {
    if (!configured_) return DeviceStatus::bad_configuration;
    const Handover::State state = handover_.state();
    if (state == Handover::State::streaming) return DeviceStatus::ok;
    if (state == Handover::State::gone) return DeviceStatus::gone;  // the supervisor is at it
    const std::lock_guard lock(device_);
    DeviceStatus status = state == Handover::State::stopped ? reach() : DeviceStatus::ok;
    if (status == DeviceStatus::ok && stale_) status = apply_again();
    if (status == DeviceStatus::ok) status = begin(ready);
    if (status == DeviceStatus::ok) {
      handover_.count_start();
      if (!supervising_.joinable()) supervising_ = std::thread([this] { supervise(); });
      return status;
    }
    if (session_ != nullptr) session_->close_stream(false);
    stream_ = nullptr;
    if (state == Handover::State::back) {  // not yet, after all
      session_.reset();
      handover_.fail(monotonic_now());
      return DeviceStatus::gone;
    }
    handover_.end();
    return status == DeviceStatus::unsupported ? DeviceStatus::bad_configuration : status;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

/// Precondition: device_ held, a session that is configured.
DeviceStatus GigeCamera::begin(Notifier* ready) {
  if (const DeviceStatus s = session_->open_stream(applied_, &GigeCamera::called, this);
      s != DeviceStatus::ok)
    return refuse(s, session_->last_error());
  stream_ = session_->stream();
  blocks_.restart();
  exposures_.reset(in_force_);
  exposure_now_ = in_force_.exposure;
  wrong_sizes_ = 0;
  heard_ns_ = monotonic_now().ns();
  handover_.begin(ready);
  free_.clear();
  for (std::size_t i = 0; i < slots_; ++i) {
    const auto slot = static_cast<FrameSlot>(i);
    if (handover_.is_out(slot)) continue;  // comes when it is released
    if (converting_)
      free_.push_back(slot);
    else
      session_->push(buffers_[i]);
  }
  if (converting_)
    for (ArvBuffer* b : buffers_) session_->push(b);
  if (const DeviceStatus s = session_->start_acquisition(); s != DeviceStatus::ok)
    return refuse(s, session_->last_error());
  const std::lock_guard words(words_);
  remark_ = session_->remark();
  return DeviceStatus::ok;
}

void GigeCamera::stop() noexcept {
  handover_.end();
  {
    const std::lock_guard lock(supervisor_);
    quit_ = true;
  }
  wake_.notify_all();
  if (supervising_.joinable()) supervising_.join();
  quit_ = false;
  const std::lock_guard lock(device_);
  if (session_ != nullptr) session_->close_stream(!session_->lost());
  stream_ = nullptr;
}

DeviceStatus GigeCamera::standing() const noexcept {
  switch (handover_.state()) {
    case Handover::State::stopped:
      return DeviceStatus::stopped;
    case Handover::State::streaming:
      return DeviceStatus::ok;
    default:
      return DeviceStatus::gone;
  }
}

DeviceStatus GigeCamera::set_exposure(const ExposureSetting& requested,
                                      ExposureSetting* actual) noexcept {
  try {
    if (const DeviceStatus s = standing(); s != DeviceStatus::ok) return s;
    if (requested.exposure <= Duration{} ||
        requested.exposure.to_seconds() * requested_.rate_hz > 1)
      return refuse(DeviceStatus::bad_configuration,
                    "the exposure must be positive, and shorter than the time between two images");
    const std::lock_guard lock(device_);
    if (session_ == nullptr || standing() != DeviceStatus::ok)
      return standing() == DeviceStatus::stopped ? DeviceStatus::stopped : DeviceStatus::gone;
    ExposureSetting taken;
    if (const DeviceStatus s = session_->change_exposure(requested, options_, &taken);
        s != DeviceStatus::ok)
      return refuse(s, session_->last_error());
    requested_.exposure = taken.exposure;  // also after it was unplugged
    requested_.gain_db = taken.gain_db;
    in_force_ = taken;
    (void)exposures_.change(taken, monotonic_now());
    if (actual != nullptr) *actual = taken;
    return DeviceStatus::ok;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

DeviceStatus GigeCamera::trigger_once() noexcept {
  if (!configured_ || requested_.trigger != CameraTrigger::software)
    return DeviceStatus::unsupported;
  try {
    if (const DeviceStatus s = standing(); s != DeviceStatus::ok) return s;
    const std::lock_guard lock(device_);
    if (session_ == nullptr || standing() != DeviceStatus::ok)
      return standing() == DeviceStatus::stopped ? DeviceStatus::stopped : DeviceStatus::gone;
    const DeviceStatus s = session_->trigger();
    return s == DeviceStatus::ok ? s : refuse(s, session_->last_error());
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

ImageView GigeCamera::view(FrameSlot slot) const noexcept {
  return {pixels_.data() + slot * slot_bytes_, requested_.width, requested_.height,
          static_cast<std::ptrdiff_t>(stride_)};
}

}  // namespace vergence::gige
