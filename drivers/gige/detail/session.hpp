#pragma once
#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera.hpp"
#include "drivers/gige/detail/glib.hpp"
#include "drivers/gige/detail/grey.hpp"
#include "drivers/gige/detail/link.hpp"
#include "drivers/options/gige_options.hpp"

namespace vergence::gige {

/// Features of a camera whose names differ between cameras.
enum class Purpose : std::uint8_t {
  /// In µs.
  exposure,
  /// In dB.
  gain,
  /// In Hz.
  frame_rate,
  /// In µs.
  trigger_delay,
  serial,
  ptp_enable,
  ptp_status,
  ptp_latch,
  /// Enables chunk data in frames.
  chunk_mode,
};

/// GenICam features of an open camera, with messages about missing ones.
///
/// Threads  One caller at a time. Each call accesses the camera and may take 2.5 s if it is
///          disconnected.
/// Errors   Setters return false and store the message in last_error().
class Features {
 public:
  explicit Features(ArvDevice* device) : device_(device) {}

  [[nodiscard]] bool has(const std::string& name) const;
  /// First of the purpose's names that this camera has; null if none.
  [[nodiscard]] const char* find(Purpose purpose) const;

  struct Bounds {
    double least = 0, most = 0, step = 0;
  };
  [[nodiscard]] std::optional<Bounds> bounds(const std::string& name) const;
  [[nodiscard]] std::optional<double> number(const std::string& name) const;
  [[nodiscard]] std::string text(const std::string& name) const;
  [[nodiscard]] std::vector<std::string> choices(const std::string& name) const;

  /// Sets a float or integer feature, rounded to the integer's step. Rejects values out of bounds.
  /// *actual receives the value read back.
  [[nodiscard]] bool set(const std::string& name, double value, const char* unit, double* actual);
  /// Selects an entry of an enumeration.
  [[nodiscard]] bool choose(const std::string& name, const std::string& entry);
  [[nodiscard]] bool switch_on(const std::string& name, bool on);
  [[nodiscard]] bool execute(const std::string& name);
  /// Sets any feature from its text form.
  [[nodiscard]] bool set_text(const std::string& name, const std::string& value);
  /// Same as choose() if the camera has feature and entry; otherwise does nothing.
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

/// Camera that responded to a broadcast.
struct Found {
  DeviceInfo info;
  /// Aravis's unique device id.
  std::string id;
};
/// Broadcasts and collects responses for one second.
[[nodiscard]] std::vector<Found> discover();

/// Configuration as applied by the camera.
struct Applied {
  CameraConfiguration actual{};
  Options options{};
  const GreyFormat* format = nullptr;
  /// Bytes per frame on the wire.
  std::size_t payload = 0;
  /// In Hz; 0 if the camera has no clock.
  std::uint64_t tick_frequency = 0;
  LinkPlan plan{};
  Interface link{};
};

/// Control channel of one camera, and its stream.
///
/// Threads  One caller at a time; lost() is thread-safe. Every call takes at most 2.5 s if the
///          camera is disconnected.
/// Errors   Calls return a status and store the message in last_error().
class Session {
 public:
  /// Opens a camera by its address or Aravis's id. Returns null on failure; *status and *error have
  /// the reason. → ok, not_found, busy, failed
  [[nodiscard]] static std::unique_ptr<Session> open(const std::string& where, DeviceStatus* status,
                                                     std::string* error);
  ~Session();

  [[nodiscard]] const DeviceInfo& info() const noexcept { return info_; }
  /// Applies the whole configuration, in the order that cameras require. → ok, unsupported,
  /// bad_configuration, disconnected
  [[nodiscard]] DeviceStatus apply(const CameraConfiguration& requested, const Options& options,
                                   Applied* applied);

  /// Creates the stream. Its thread calls `callback` from the first push() on. → ok, disconnected,
  /// failed
  [[nodiscard]] DeviceStatus open_stream(const Applied& applied, ArvStreamCallback callback,
                                         void* user);
  /// Precondition: a stream is open.
  void push(ArvBuffer* buffer) noexcept;
  [[nodiscard]] ArvStream* stream() noexcept { return stream_.get(); }
  /// Starts exposing. → ok, disconnected
  [[nodiscard]] DeviceStatus start_acquisition();
  /// Ends acquisition and stream; no callback runs afterwards. If `reachable`, the camera is also
  /// commanded to stop.
  void close_stream(bool reachable) noexcept;
  [[nodiscard]] DeviceStatus trigger();
  /// Applies the nearest supported values, also while streaming. *actual receives the values read
  /// back. → ok, unsupported, disconnected
  [[nodiscard]] DeviceStatus change_exposure(const ExposureSetting& requested,
                                             ExposureSetting* actual);

  /// Queries the camera. True if it responds and this program has control.
  [[nodiscard]] bool in_control();
  /// True once the heartbeat detected a lost connection.
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
