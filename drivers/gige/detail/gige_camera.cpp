#include "drivers/gige/detail/gige_camera.hpp"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>
#include <utility>

#include "drivers/clock.hpp"

namespace vergence::gige {

void PeriodicThread::start(const char* name, Duration interval, std::function<void()> round) {
  if (thread_.joinable()) return;
  thread_ = std::thread(
      [this, name, interval, round = std::move(round)] { work(name, interval, round); });
}

void PeriodicThread::stop() noexcept {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  thread_.join();
  stopping_ = false;
}

void PeriodicThread::work(const char* name, Duration interval, const std::function<void()>& round) {
  (void)pthread_setname_np(pthread_self(), name);
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      if (wake_.wait_for(lock, std::chrono::nanoseconds(interval.ns()),
                         [this] { return stopping(); }))
        return;
    }
    round();
  }
}

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

GigeCamera::GigeCamera(std::unique_ptr<Session> session)
    : info_(session->info()), session_(std::move(session)), address_(info_.place) {}

GigeCamera::~GigeCamera() {
  stop();
  session_.reset();
}

std::string GigeCamera::remark() const { return remark_.get(); }

DeviceStatus GigeCamera::configure(const CameraConfiguration& requested,
                                   CameraConfiguration* actual) noexcept {
  try {
    if (queue_.state() != FrameQueue::State::stopped)
      return last_error_.refuse(DeviceStatus::busy, "the camera is streaming; stop it first");
    if (queue_.held() != 0)
      return last_error_.refuse(DeviceStatus::busy, "images are still in use; release them first");
    if (const std::string invalid = find_invalid(requested); !invalid.empty())
      return last_error_.refuse(DeviceStatus::bad_configuration,
                                invalid + " is not a valid configuration");
    Options options;
    if (std::string why;
        !parse_options(requested.options, option_table(), "GigE cameras", &options, &why))
      return last_error_.refuse(DeviceStatus::unsupported, std::move(why));
    const std::lock_guard lock(device_);
    if (const DeviceStatus s = reach(); s != DeviceStatus::ok) return s;
    Applied applied;
    stale_ = true;
    if (const DeviceStatus s = session_->apply(requested, options, &applied); s != DeviceStatus::ok)
      return last_error_.refuse(s, session_->last_error());
    stale_ = false;
    requested_ = requested;
    options_ = options;
    applied_ = std::move(applied);
    in_force_ = {applied_.actual.exposure, applied_.actual.gain_db};
    memory_.allocate(*applied_.format, requested_.width, requested_.height, applied_.payload,
                     static_cast<std::size_t>(options_.buffers));
    slots_.set_limit(static_cast<std::size_t>(options_.buffers));
    configured_ = true;
    if (actual != nullptr) *actual = applied_.actual;
    remark_.set(session_->remark());
    return DeviceStatus::ok;
  } catch (const std::exception& e) {
    configured_ = false;
    return DeviceStatus::failed;
  }
}

DeviceTiming GigeCamera::timing() const noexcept {
  DeviceTiming t;
  t.min_delay =
      applied_.plan.transfer + (options_.stamp_at_end ? Duration{} : applied_.actual.exposure);
  if (applied_.tick_frequency > 0)
    t.resolution = std::max(Duration::nanoseconds(1),
                            Duration::seconds(1.0 / static_cast<double>(applied_.tick_frequency)));
  return t;
}

/// Opens only the camera with the known identity: addresses are reassigned, and the left camera
/// must not become the right one. If null, *why has the reason.
std::unique_ptr<Session> GigeCamera::open_ours(const std::string& address, std::string* why) const {
  DeviceStatus status = DeviceStatus::ok;
  std::unique_ptr<Session> session = Session::open(address, &status, why);
  if (session == nullptr || session->info().serial == info_.serial) return session;
  *why = "another camera, " + session->info().serial + ", has the address " + address +
         " now, where " + info_.serial + " was";
  return nullptr;
}

/// Ensures a working session, the old one or a new one. Precondition: device_ held.
DeviceStatus GigeCamera::reach() {
  if (session_ != nullptr && !session_->lost() && session_->in_control()) return DeviceStatus::ok;
  session_.reset();
  std::string why;
  session_ = open_ours(address_, &why);
  if (session_ == nullptr) return last_error_.refuse(DeviceStatus::disconnected, why);
  stale_ = true;
  return DeviceStatus::ok;
}

/// Precondition: device_ held, configured. The slots stay: the same configuration has the same
/// payload.
DeviceStatus GigeCamera::apply_again() {
  Applied again;
  if (const DeviceStatus s = session_->apply(requested_, options_, &again); s != DeviceStatus::ok)
    return last_error_.refuse(s, session_->last_error());
  if (again.payload != applied_.payload || again.format != applied_.format)
    return last_error_.refuse(
        DeviceStatus::disconnected,
        "the camera reconnected with frames of another size; configure it again");
  applied_ = std::move(again);
  in_force_ = {applied_.actual.exposure, applied_.actual.gain_db};
  stale_ = false;
  return DeviceStatus::ok;
}

DeviceStatus GigeCamera::start(Notifier* ready) noexcept {
  try {
    if (!configured_) return DeviceStatus::bad_configuration;
    const FrameQueue::State state = queue_.state();
    if (state == FrameQueue::State::streaming) return DeviceStatus::ok;
    // The supervisor is reconnecting.
    if (state == FrameQueue::State::disconnected) return DeviceStatus::disconnected;
    const std::lock_guard lock(device_);
    DeviceStatus status = state == FrameQueue::State::stopped ? reach() : DeviceStatus::ok;
    if (status == DeviceStatus::ok && stale_) status = apply_again();
    if (status == DeviceStatus::ok) status = begin(ready);
    if (status == DeviceStatus::ok) {
      queue_.count_start();
      start_supervising();
      return status;
    }
    close_stream(false);
    // The camera has disconnected again.
    if (state == FrameQueue::State::reconnected) {
      session_.reset();
      queue_.fail(monotonic_now());
      return DeviceStatus::disconnected;
    }
    queue_.end();
    return status == DeviceStatus::unsupported ? DeviceStatus::bad_configuration : status;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

/// Precondition: device_ held, a session that is configured.
DeviceStatus GigeCamera::begin(Notifier* ready) {
  if (const DeviceStatus s = session_->open_stream(applied_, &FrameReceiver::callback, &receiver_);
      s != DeviceStatus::ok)
    return last_error_.refuse(s, session_->last_error());
  receiver_.begin(*session_, applied_, requested_.width, requested_.height, in_force_);
  slots_.withdraw();
  queue_.begin(ready);
  receiver_.supply_buffers();
  if (const DeviceStatus s = session_->start_acquisition(); s != DeviceStatus::ok)
    return last_error_.refuse(s, session_->last_error());
  remark_.set(session_->remark());
  return DeviceStatus::ok;
}

/// Precondition: device_ held.
void GigeCamera::close_stream(bool reachable) noexcept {
  if (session_ != nullptr) session_->close_stream(reachable);
  receiver_.end();
}

void GigeCamera::stop() noexcept {
  queue_.end();
  supervisor_.stop();
  const std::lock_guard lock(device_);
  close_stream(session_ != nullptr && !session_->lost());
}

DeviceStatus GigeCamera::set_exposure(const ExposureSetting& requested,
                                      ExposureSetting* actual) noexcept {
  try {
    if (const DeviceStatus s = queue_.standing(); s != DeviceStatus::ok) return s;
    if (requested.exposure <= Duration{} ||
        requested.exposure.to_seconds() * requested_.rate_hz > 1)
      return last_error_.refuse(DeviceStatus::bad_configuration,
                                "the exposure must be positive and shorter than the time between "
                                "two images; change exposure_us");
    const std::lock_guard lock(device_);
    if (session_ == nullptr || queue_.standing() != DeviceStatus::ok)
      return queue_.standing() == DeviceStatus::stopped ? DeviceStatus::stopped
                                                        : DeviceStatus::disconnected;
    ExposureSetting applied;
    if (const DeviceStatus s = session_->change_exposure(requested, &applied);
        s != DeviceStatus::ok)
      return last_error_.refuse(s, session_->last_error());
    // The setting also applies after a reconnect.
    requested_.exposure = applied.exposure;
    requested_.gain_db = applied.gain_db;
    in_force_ = applied;
    receiver_.change_exposure(applied);
    if (actual != nullptr) *actual = applied;
    return DeviceStatus::ok;
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

DeviceStatus GigeCamera::trigger_once() noexcept {
  if (!configured_ || requested_.trigger != CameraTrigger::software)
    return DeviceStatus::unsupported;
  try {
    if (const DeviceStatus s = queue_.standing(); s != DeviceStatus::ok) return s;
    const std::lock_guard lock(device_);
    if (session_ == nullptr || queue_.standing() != DeviceStatus::ok)
      return queue_.standing() == DeviceStatus::stopped ? DeviceStatus::stopped
                                                        : DeviceStatus::disconnected;
    const DeviceStatus s = session_->trigger();
    return s == DeviceStatus::ok ? s : last_error_.refuse(s, session_->last_error());
  } catch (const std::exception&) {
    return DeviceStatus::failed;
  }
}

namespace {

constexpr Duration kTick = Duration::milliseconds(100);
// Silence after which a free-running camera counts as disconnected.
constexpr Duration kMinSilence = Duration::seconds(1);
// Query interval of a triggered camera, which may be idle.
constexpr Duration kAskEvery = Duration::seconds(1);
// Pauses between attempts to reopen.
constexpr Duration kFirstPause = Duration::milliseconds(500), kLongestPause = Duration::seconds(5);
// Consecutive frames of wrong size that count as a fault.
constexpr int kWrongSizes = 3;

}  // namespace

/// State between two rounds of the supervisor.
struct GigeCamera::Watch {
  Duration pause = kFirstPause;
  HostStamp next_try{}, asked = monotonic_now();
};

void GigeCamera::start_supervising() {
  supervisor_.start("vergence-watch", kTick,
                    [this, watch = std::make_shared<Watch>()] { supervise(watch.get()); });
}

void GigeCamera::supervise(Watch* watch) {
  try {
    switch (queue_.state()) {
      case FrameQueue::State::streaming:
        watch->pause = kFirstPause;
        watch->next_try = monotonic_now() + watch->pause;
        if (const Fault fault = check(monotonic_now(), &watch->asked); !fault.reason.empty())
          lose(fault);
        break;
      case FrameQueue::State::disconnected:
        if (monotonic_now() < watch->next_try) break;
        if (reopen()) queue_.ready_again();
        watch->pause = std::min(watch->pause * 2, kLongestPause);
        watch->next_try = monotonic_now() + watch->pause;
        break;
      case FrameQueue::State::reconnected:
        queue_.ready_again();
        break;
      case FrameQueue::State::stopped:
        break;
    }
    // Out of memory for a message; the next round tries again.
  } catch (const std::exception&) {
  }
}

GigeCamera::Fault GigeCamera::check(HostStamp at, HostStamp* asked) {
  static const Fault kSilent{"the camera no longer responds; check cable and power", false};
  if (receiver_.wrong_sizes() >= kWrongSizes)
    return {"the camera sends " +
            (receiver_.wrong_width() > 0
                 ? size_text(receiver_.wrong_width(), receiver_.wrong_height())
                 : "images without their size") +
            " where " + size_text(requested_.width, requested_.height) +
            " was configured; switch it off and on"};
  const std::lock_guard lock(device_);
  if (session_ == nullptr || queue_.state() != FrameQueue::State::streaming) return {};
  if (session_->lost()) return kSilent;
  const Duration silence = at - receiver_.last_buffer();
  const Duration period = Duration::seconds(1 / requested_.rate_hz);
  if (requested_.trigger == CameraTrigger::free && silence > std::max(kMinSilence, period * 10)) {
    if (!session_->in_control()) return kSilent;
    return {
        "the camera responds, but sends no images; check the firewall and the MTU of every switch"};
  }
  if (requested_.trigger != CameraTrigger::free && silence > std::max(kAskEvery, period * 3) &&
      at - *asked > kAskEvery) {
    *asked = at;
    if (!session_->in_control()) return kSilent;
  }
  return {};
}

void GigeCamera::lose(const Fault& fault) {
  last_error_.set(fault.reason);
  queue_.lose(monotonic_now());
  const std::lock_guard lock(device_);
  close_stream(fault.reachable);
  session_.reset();
}

bool GigeCamera::reopen() {
  const std::lock_guard lock(device_);
  std::string why;
  session_ = open_ours(address_, &why);
  // Searches by serial number: the camera may have a new address, and another camera its old one.
  if (session_ == nullptr && !info_.serial.empty() && !supervisor_.stopping())
    for (const Found& f : discover())
      if (f.info.serial == info_.serial && session_ == nullptr)
        session_ = open_ours(f.info.place, &why);
  if (session_ == nullptr || supervisor_.stopping()) return false;
  address_ = session_->info().place;
  if (apply_again() == DeviceStatus::ok) return true;
  session_.reset();
  return false;
}

}  // namespace vergence::gige
