#pragma once
#include <memory>

#include "app/datasets/recorded_session.hpp"
#include "app/session/frame_source.hpp"
#include "app/session/replay_session.hpp"

namespace vergence::app {

/// A recorded session as the source of another, which holds the recording. `request` outlives it.
/// Precondition: request.start is a frame of it. Throws InputError: a damaged description, images
/// of another size than the calibration's.
[[nodiscard]] std::unique_ptr<FrameSource> session_source(const ReplayRequest& request,
                                                          RecordedSession session);

}  // namespace vergence::app
