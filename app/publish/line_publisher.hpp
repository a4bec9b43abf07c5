#pragma once
#include "app/publish/line_socket.hpp"
#include "app/session/session_observer.hpp"
#include "core/calibration/options.hpp"

namespace vergence::app {

/// Publishes the pose stream to robots and bridges (docs/live_interface.md): a line per frame,
/// calibration and alignment when a reader connects and when they change, a status per second, and
/// images on request.
///
/// Threads  on_…() run on the estimator's thread: they fill rings, copy two images if a reader is
///          due, and wake, without a lock or another system call. A thread of its own is
///          started for formatting, sending and requests.
/// Memory   Fixed for the estimator's part. After the first request for images two pairs, and one
///          per requesting reader. If a ring is full, the line is dropped and counted.
/// Errors   Throws std::system_error if there is no thread.
///
/// `requests` must outlive it. `options` rate a calibration.
[[nodiscard]] std::unique_ptr<SessionObserver> make_line_publisher(
    std::unique_ptr<LineSocket> socket, SessionRequests* requests,
    const calibration::CalibrationOptions& options);

}  // namespace vergence::app
