#pragma once
#include <memory>
#include <optional>
#include <string>

#include "app/datasets/recorded_session.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/replay_session.hpp"

namespace vergence::app {

/// Returns the initial calibration of a recorded session. InputError: the recording's description
/// is damaged.
[[nodiscard]] StartingCalibration recorded_beginning(const SessionDescription& description,
                                                     const std::string& name);

/// A recorded session as the source of another, which holds the recording. `request` outlives it.
/// `other`: begins with this instead of what the drive began with, adopting after a fixed number of
/// frames. Precondition: request.start is a frame of it. Throws InputError: a damaged description,
/// images of another size than the calibration's.
[[nodiscard]] std::unique_ptr<FrameSource> session_source(const ReplayRequest& request,
                                                          RecordedSession session,
                                                          std::optional<StartingCalibration> other);

}  // namespace vergence::app
