"""What the usage examples of public headers take for given: header → further includes, parameters, declarations before them."""

CONTEXTS = {
    "app/datasets/recorded_session.hpp": ((), "std::vector<std::uint8_t> pixels"),
    "app/publish/http_server.hpp": (
        ("app/publish/live_state.hpp", "drivers/clock.hpp"),
        "const HostPort& address, const HttpPolicy& policy, std::string_view page, LiveState& state, bool ended, void (*act)(HttpRoute)"),
    "app/recorder/recorder.hpp": ((), "const PoseSample& sample"),
    "app/recording/mcap_file.hpp": (
        ("app/recording/disk.hpp",),
        "Disk& disk, std::span<const McapTopic> topics, std::vector<std::uint8_t> record, std::span<const std::uint8_t> body, "
        "std::span<const std::span<const std::uint8_t>> parts"),
    "app/recording/recording.hpp": (
        ("core/types/pose_sample.hpp",),
        "const Recording::Options& options, std::size_t kPose, Stamp stamp, const PoseSample& sample, "
        "std::size_t (*encode)(const PoseSample&, std::span<std::uint8_t>)"),
    "app/session/session_runner.hpp": (
        ("app/session/live_source.hpp",),
        "const RunRequest& request, const SignalGuard& signals"),
    "core/bundle/bundle.hpp": (
        (),
        "std::span<Camera> cameras, std::span<Transform> T_camera_left, std::span<Transform> poses, std::span<Vec3> points, "
        "std::span<const BundleObservation> observations"),
    "core/calibration/monitor.hpp": (
        (),
        "const MonitorOptions& options, const Transform& T_right_left, const Pinhole& left, const Pinhole& right, const Mat6& covariance, "
        "const MonitorFrame& frame, void (*recalibrate)(std::uint64_t)"),
    "core/calibration/rig_solver.hpp": (
        (),
        "const CalibrationOptions& options, const MonitorOptions& monitor, std::size_t features, Arena& arena, const LoggedFrame& frame, "
        "std::span<const LoggedObservation> observations, const RigCalibration& rig"),
    "core/camera/camera.hpp": ((), "const Intrinsics& intrinsics"),
    "core/comparison/comparison.hpp": (
        (), "const ComparisonOptions& options, const InsSample& reading, const PoseSample& pose"),
    "core/estimator/background_solve.hpp": (
        (), "BackgroundSolve& solve, const calibration::TrackLog& log, const BackgroundSolve::Start& start"),
    "core/estimator/estimator.hpp": (
        ("core/types/parallel.hpp",),
        "const EstimatorOptions& options, const RigCalibration& rig, BackgroundRunner& solver, bool (*next_frame)(RigFrame*)"),
    "core/estimator/online_calibrator.hpp": (
        (), "OnlineCalibrator& calibrator, odometry::Odometry& odometry, const odometry::FrameOutcome& out, const RigFrame& frame"),
    "core/estimator/rig_monitor.hpp": (
        (),
        "RigMonitor& monitor, const RigCalibration& rig, bool confirmed, odometry::Odometry& odometry, "
        "const odometry::FrameOutcome& outcome, const RigFrame& frame"),
    "core/memory/arena.hpp": (("core/odometry/map.hpp",), ""),
    "core/memory/frame_pool.hpp": ((), "void (*fill)(std::span<std::uint8_t>, std::size_t stride)"),
    "core/odometry/drift_covariance.hpp": ((), "DriftCovariance& drift, const Transform& T_left_world, const Mat6& fit, bool keyframe"),
    "core/odometry/odometry.hpp": (
        (), "const OdometryOptions& options, const RigCalibration& rig, Arena& arena, PairRunner& runner, const RigFrame& frame"),
    "drivers/acquisition/acquisition.hpp": (
        (), "CameraDevice& left, CameraDevice& right, InsDevice& ins, TriggerDevice& board, const Acquisition::Options& options"),
    "drivers/camera.hpp": ((), "CameraDriver& driver"),
    "drivers/common/frame_queue.hpp": (
        (), "FrameQueue& queue, Notifier* ready, const Frame& frame, void (*give_back)(FrameSlot), bool lost_it, HostStamp now"),
    "drivers/common/last_error.hpp": ((), "LastError& last_error_"),
    "drivers/common/side_by_side_camera.hpp": ((), "CameraDriver& driver, std::string_view serial, DeviceStatus status"),
    "drivers/common/wake_event.hpp": (
        ("core/memory/ring.hpp",), "WakeEvent& event, Ring<int, 8>& ring, int item"),
    "drivers/ins.hpp": (("drivers/sync/clock_mapper.hpp",), "InsDevice& ins, ClockMapper& mapper"),
    "drivers/options/option_table.hpp": (
        (), "", "enum class At { start, end };\nstruct Options {\n  Duration delay{};\n  At stamp = At::start;\n};"),
    "drivers/sync/clock_mapper.hpp": (("drivers/camera.hpp",), "const Frame& frame"),
    "drivers/sync/clock_tie.hpp": (
        ("drivers/sync/durations.hpp", "drivers/sync/sync_types.hpp", "drivers/trigger.hpp"),
        "ClockTie& tie, const SyncFrame& frame, const Pulse& pulse, const Pulse& next, DeviceStamp stamp"),
    "drivers/sync/pulse_matcher.hpp": ((), "PulseAcquisition& acquisition, const StampedFrame& frame, const PulseTrain& train"),
    "drivers/sync/rig_synchronizer.hpp": (("drivers/camera.hpp",), "const SyncFrame& frame, CameraDevice& camera"),
    "drivers/trigger.hpp": (
        ("drivers/camera.hpp", "drivers/sync/rig_synchronizer.hpp"),
        "TriggerDevice& board, CameraDevice& left, RigSynchronizer& synchronizer"),
    "drivers/trigger_board/board_line.hpp": (
        (), "PauseRequest& request, HostStamp now, std::uint8_t (*send_pause)(std::uint32_t)"),
    "drivers/xsens/decoder.hpp": (
        (), "Decoder& decoder, const StreamSettings& settings, std::span<const std::uint8_t> bytes, HostStamp arrival"),
    "firmware_iface/xbus/frame.hpp": ((), "FrameStream& stream, std::span<const std::uint8_t> bytes"),
    "firmware_iface/xbus/mtdata2.hpp": (("firmware_iface/xbus/frame.hpp",), "FrameStream& stream"),
}
