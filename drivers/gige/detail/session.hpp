#pragma once
#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera.hpp"
#include "drivers/gige/detail/glib.hpp"
#include "drivers/gige/detail/grey.hpp"
#include "drivers/gige/detail/link.hpp"
#include "drivers/options/gige_options.hpp"

namespace vergence::gige {

/// Features of a camera; their names differ between cameras.
enum class Purpose : std::uint8_t {
  exposure,       // µs
  gain,           // dB
  frame_rate,     // Hz
  trigger_delay,  // µs
  serial,
  ptp_enable,
  ptp_status,
  ptp_latch,
  chunk_mode,  // whether frames have chunk data at all
};

/// The GenICam features of an open camera, with messages for what it does not have.
///
/// Threads  One caller at a time; each call asks the camera and may take 2.5 s when that is gone.
/// Errors   Setters return false and leave the message in last_error().
class Features {
 public:
  explicit Features(ArvDevice* device) : device_(device) {}

  [[nodiscard]] bool has(const std::string& name) const;
  /// The first name that this camera has; null: none.
  [[nodiscard]] const char* find(Purpose purpose) const;

  struct Bounds {
    double least = 0, most = 0, step = 0;
  };
  [[nodiscard]] std::optional<Bounds> bounds(const std::string& name) const;
  [[nodiscard]] std::optional<double> number(const std::string& name) const;
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> choices(const std::string& name) const;

  /// A number of a float or integer feature, rounded to the integer's step; outside its bounds it
  /// is refused. *actual: as read back.
  [[nodiscard]] bool set(const std::string& name, double value, const char* unit, double* actual);
  /// One of the entries of an enumeration.
  [[nodiscard]] bool choose(const std::string& name, const std::string& entry);
  [[nodiscard]] bool switch_on(const std::string& name, bool on);
  [[nodiscard]] bool execute(const std::string& name);
  /// As words, whatever the feature is.
  [[nodiscard]] bool set_text(const std::string& name, const std::string& value);
  /// choose() where the camera has feature and entry; never complains.
  void choose_if_there(const std::string& name, const std::string& entry);

  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }

 private:
  [[nodiscard]] bool refuse(std::string message) {
    last_error_ = std::move(message);
    return false;
  }
  ArvDevice* device_;
  std::string last_error_;
};

/// Cameras that answer a broadcast.
struct Found {
  DeviceInfo info;
  std::string id;  // Aravis's, unique
};
/// Takes a second.
[[nodiscard]] std::vector<Found> discover();

/// A configuration as the camera took it.
struct Applied {
  CameraConfiguration actual{};
  Options options{};
  const GreyFormat* format = nullptr;
  std::size_t payload = 0;           // bytes a frame on the wire
  std::uint64_t tick_frequency = 0;  // Hz; 0: the camera has no clock
  LinkPlan plan{};
  Interface link{};
};

/// Control of one camera, and its stream.
///
/// Threads  One caller at a time; `lost()` any. Every call may take 2.5 s when the camera has gone,
///          and no longer.
/// Errors   Statuses, with the message in last_error().
class Session {
 public:
  /// By address or Aravis's id. Null: *status and *error say why. → ok, not_found, busy, failed
  [[nodiscard]] static std::unique_ptr<Session> open(const std::string& where, DeviceStatus* status,
                                                     std::string* error);
  ~Session();

  [[nodiscard]] const DeviceInfo& info() const noexcept { return info_; }
  /// The whole configuration, in the order that cameras want. → ok, unsupported, bad_configuration,
  /// disconnected
  [[nodiscard]] DeviceStatus apply(const CameraConfiguration& requested, const Options& options,
                                   Applied* applied);

  /// Makes the stream; the callback comes from its thread, from the first push() on. → ok,
  /// disconnected, failed
  [[nodiscard]] DeviceStatus open_stream(const Applied& applied, ArvStreamCallback callback,
                                         void* user);
  /// Precondition: a stream is open.
  void push(ArvBuffer* buffer) noexcept;
  [[nodiscard]] ArvStream* stream() noexcept { return stream_.get(); }
  /// The camera begins to expose. → ok, disconnected
  [[nodiscard]] DeviceStatus start_acquisition();
  /// Ends both; after it no callback comes. `reachable`: the camera is told, too.
  void close_stream(bool reachable) noexcept;
  [[nodiscard]] DeviceStatus trigger();
  /// The nearest that the camera has, also while it streams. *actual: as read back. → ok,
  /// unsupported, disconnected
  [[nodiscard]] DeviceStatus change_exposure(const ExposureSetting& requested,
                                             ExposureSetting* actual);

  /// Asks the camera: it answers, and we are in control.
  [[nodiscard]] bool in_control();
  /// Noticed by the heartbeat.
  [[nodiscard]] bool lost() const noexcept { return lost_.load(std::memory_order_acquire); }

  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }
  [[nodiscard]] const std::string& remark() const noexcept { return remark_; }

 private:
  explicit Session(Object<ArvDevice> device);
  [[nodiscard]] DeviceStatus refuse(DeviceStatus status, std::string message);
  [[nodiscard]] DeviceStatus set_format(const CameraConfiguration& requested, Applied* applied);
  [[nodiscard]] DeviceStatus set_region(const CameraConfiguration& requested);
  [[nodiscard]] DeviceStatus set_exposure(const CameraConfiguration& requested, Applied* applied);
  [[nodiscard]] DeviceStatus set_trigger(const CameraConfiguration& requested,
                                         const Options& options);
  [[nodiscard]] DeviceStatus set_rate(const CameraConfiguration& requested, Applied* applied);
  [[nodiscard]] DeviceStatus set_packets(const CameraConfiguration& requested,
                                         const Options& options, Applied* applied);
  [[nodiscard]] DeviceStatus set_clock(const Options& options, Applied* applied);
  void enlarge_socket_buffer(const Applied& applied);
  void add_remark(const std::string& message) {
    remark_ += (remark_.empty() ? "" : "; ") + message;
  }

  Object<ArvDevice> device_;
  Object<ArvStream> stream_;
  Features features_;
  DeviceInfo info_;
  Interface link_;
  std::string last_error_, remark_;
  std::atomic<bool> lost_{false};
};

}  // namespace vergence::gige
