#pragma once
#include <atomic>

#include "tests/unit/drivers/conformance/camera_conformance.hpp"

namespace vergence::test {

/// Counts what a camera tells it.
class CountingNotifier final : public Notifier {
 public:
  void notify() noexcept override { reported_.fetch_add(1); }
  [[nodiscard]] std::uint64_t reported() const noexcept { return reported_.load(); }

 private:
  std::atomic<std::uint64_t> reported_{0};
};

/// The model beside the camera: every call goes through it, and what the camera answers is held
/// against the contract.
///
/// Failures are GoogleTest's, each with the number of the step. Threads  One.
class ShadowCamera {
 public:
  explicit ShadowCamera(ConformanceRig* rig);
  ~ShadowCamera();

  enum class State : std::uint8_t { unconfigured, stopped, streaming, disconnected };
  [[nodiscard]] State state() const noexcept { return state_; }
  [[nodiscard]] bool holds() const noexcept { return !held_.empty(); }
  [[nodiscard]] std::size_t held() const noexcept { return held_.size(); }
  [[nodiscard]] const CameraConfiguration& configuration() const noexcept { return now_; }

  void configure(const CameraConfiguration& requested);
  /// Must be refused and change nothing.
  void refuse(const CameraConfiguration& nonsense);
  void start();
  void stop();
  /// → what the camera answered, checked.
  DeviceStatus wait(Duration limit);
  void release(std::size_t which);
  void release_all();
  /// Takes frames until one comes, releasing as it goes; fails when none comes in time.
  void expect_frames(int count);
  /// Cable out and in again; what is in between is checked. False: the rig cannot.
  bool unplug_and_replug();
  /// Statistics against the model.
  void check_statistics();

  // Number of exposures missing between delivered frames since this start.
  [[nodiscard]] std::uint64_t gaps() const noexcept { return gaps_; }

 private:
  struct Held {
    Frame frame;
    ImageView view;
    std::uint64_t sum = 0;
  };
  void check(const Frame& frame);
  void trigger_if_asked();

  ConformanceRig* rig_;
  CameraDevice& camera_;
  CountingNotifier notifier_;
  State state_ = State::unconfigured;
  bool unplugged_ = false;
  CameraConfiguration now_{};
  std::vector<Held> held_;
  std::uint64_t delivered_ = 0, incomplete_ = 0, starts_ = 0;
  CameraStatistics last_{}, at_start_{};
  // True after the first frame since start().
  bool any_ = false;
  Frame newest_{};
  std::uint64_t gaps_ = 0;
};

}  // namespace vergence::test
