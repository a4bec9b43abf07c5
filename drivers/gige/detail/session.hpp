#pragma once
#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera.hpp"
#include "drivers/gige/detail/chunks.hpp"
#include "drivers/gige/detail/features.hpp"
#include "drivers/gige/detail/glib.hpp"
#include "drivers/gige/detail/grey.hpp"
#include "drivers/gige/detail/link.hpp"
#include "drivers/options/gige_options.hpp"

namespace vergence::gige {

/// Who answers a broadcast.
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
  std::size_t payload = 0;                     // bytes a frame on the wire, chunk data among them
  std::size_t pixels = 0;                      // of these, in front
  std::optional<ChunkField> exposure_chunk{};  // frames say their exposure there
  std::uint64_t tick_frequency = 0;            // Hz; 0: the camera has no clock
  LinkPlan plan{};
  Interface link{};
};

/// Control of one camera, and its stream.
///
/// Threads  One caller at a time; `lost()` any. Every call may take 2.5 s when the camera has gone,
///          and no longer.
/// Errors   Statuses, with the sentence in last_error().
class Session {
 public:
  /// By address or Aravis's id. Null: *status and *error say why. → ok, not_found, busy, failed
  [[nodiscard]] static std::unique_ptr<Session> open(const std::string& where, DeviceStatus* status,
                                                     std::string* error);
  ~Session();

  [[nodiscard]] const DeviceInfo& info() const noexcept { return info_; }
  /// The whole configuration, in the order that cameras want. → ok, unsupported, bad_configuration,
  /// gone
  [[nodiscard]] DeviceStatus apply(const CameraConfiguration& requested, const Options& options,
                                   Applied* applied);

  /// Makes the stream; the callback comes from its thread, from the first push() on. → ok,
  /// no_permission, gone, failed
  [[nodiscard]] DeviceStatus open_stream(const Applied& applied, ArvStreamCallback callback,
                                         void* user);
  /// Precondition: a stream is open.
  void push(ArvBuffer* buffer) noexcept;
  [[nodiscard]] ArvStream* stream() noexcept { return stream_.get(); }
  /// The camera begins to expose. → ok, gone
  [[nodiscard]] DeviceStatus start_acquisition();
  /// Ends both; after it no callback comes. `reachable`: the camera is told, too.
  void close_stream(bool reachable) noexcept;
  [[nodiscard]] DeviceStatus trigger();
  /// The nearest that the camera has, also while it streams. *actual: as read back. → ok,
  /// unsupported, gone
  [[nodiscard]] DeviceStatus change_exposure(const ExposureSetting& requested,
                                             const Options& options, ExposureSetting* actual);

  /// °C; nothing where it does not tell.
  [[nodiscard]] std::optional<double> temperature_c() const;

  /// Asks the camera: it answers, and we are in control.
  [[nodiscard]] bool in_control();
  /// Noticed by the heartbeat.
  [[nodiscard]] bool lost() const noexcept { return lost_.load(std::memory_order_acquire); }

  [[nodiscard]] const std::string& last_error() const noexcept { return last_error_; }
  [[nodiscard]] const std::string& remark() const noexcept { return remark_; }

 private:
  explicit Session(Object<ArvDevice> device);
  [[nodiscard]] DeviceStatus refuse(DeviceStatus status, std::string sentence);
  [[nodiscard]] DeviceStatus set_format(const CameraConfiguration& requested, Applied* applied);
  [[nodiscard]] DeviceStatus set_region(const CameraConfiguration& requested);
  [[nodiscard]] DeviceStatus set_exposure(const CameraConfiguration& requested,
                                          const Options& options, Applied* applied);
  [[nodiscard]] DeviceStatus set_trigger(const CameraConfiguration& requested,
                                         const Options& options);
  [[nodiscard]] DeviceStatus set_rate(const CameraConfiguration& requested, Applied* applied);
  [[nodiscard]] DeviceStatus set_packets(const CameraConfiguration& requested,
                                         const Options& options, Applied* applied);
  [[nodiscard]] DeviceStatus set_clock(const Options& options, Applied* applied);
  void set_chunks(const Options& options, Applied* applied);
  [[nodiscard]] bool ask_for_exposures(const char* mode, Applied* applied);
  void enlarge_socket_buffer(const Applied& applied);
  void note(const std::string& sentence) { remark_ += (remark_.empty() ? "" : "; ") + sentence; }

  Object<ArvDevice> device_;
  Object<ArvStream> stream_;
  Features features_;
  DeviceInfo info_;
  Interface link_;
  std::string last_error_, remark_;
  std::atomic<bool> lost_{false};
};

}  // namespace vergence::gige
