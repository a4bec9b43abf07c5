#pragma once
#include <optional>
#include <span>

#include "core/comparison/attitude_check.hpp"
#include "core/comparison/geodesy.hpp"
#include "core/math/se3.hpp"
#include "core/memory/arena.hpp"
#include "core/types/ins_sample.hpp"

namespace vergence {

struct ComparisonOptions;
struct ComparisonCounters;
enum class InsMatch : std::uint8_t;

/// Newest samples of an INS, in `enu`, with interpolation between them.
///
/// Not thread-safe. Memory from the arena at construction; if full, the oldest sample is dropped.
class InsHistory {
 public:
  /// Standard deviations of a sample in m and rad: its own, else those of the options.
  struct Sigmas {
    double position = 0, height = 0, tilt = 0;
  };
  /// Interpolation between two samples.
  struct Reference {
    Transform T_enu_left{};
    /// The larger ones of both samples.
    Sigmas sigmas{};
    /// True if one of the samples has no height, so its height is the last measured one.
    bool flat = false;
  };

  /// Counts rejected samples and jumps in `counters`; `counters` and `options` must outlive this
  /// object.
  InsHistory(const ComparisonOptions& options, ComparisonCounters& counters, Arena& arena);

  /// Adds a sample. Samples that are not in order of their stamps are rejected and counted.
  void add(const InsSample& sample) noexcept;
  /// Interpolates the left camera's pose at this stamp. If the result is not `ok`, *out is
  /// unchanged.
  [[nodiscard]] InsMatch reference_at(Stamp stamp, Reference* out) const noexcept;
  /// True if the newest sample is not older than this.
  [[nodiscard]] bool reaches(Stamp stamp) const noexcept;
  /// Returns true if the position has jumped by the time `now`; once per jump or series of jumps.
  /// Within a series it returns true on every call, because no two positions there need to fit
  /// together.
  [[nodiscard]] bool pop_leap(Stamp now) noexcept;

  [[nodiscard]] bool has_origin() const noexcept { return has_origin_; }
  [[nodiscard]] const LocalTangentPlane& plane() const noexcept { return plane_; }

 private:
  // An InsSample in enu.
  struct Reading {
    Stamp stamp{};
    bool valid = false;
    // True if it jumped relative to the previous fix.
    bool jumped = false;
    // True for a 2D fix.
    bool flat = false;
    Vec3 p_enu_ins = Vec3::Zero();
    Mat3 R_enu_ins = Mat3::Identity();
    Sigmas sigmas{};
  };
  struct Fix {
    Stamp stamp{};
    Vec3 p_enu_ins = Vec3::Zero();
    bool flat = false;
  };
  // Consecutive rejected samples, in ascending order of stamps among themselves.
  struct Refused {
    int count = 0;
    Stamp first{}, last{};
  };
  struct Leaps {
    Stamp first{}, last{};
  };

  [[nodiscard]] const Reading& reading(std::uint64_t i) const noexcept {
    return readings_[static_cast<std::size_t>(i) & (readings_.size() - 1)];
  }
  /// Returns false if the stamp goes back.
  [[nodiscard]] bool accept_stamp(Stamp stamp) noexcept;
  /// Returns true if the stamps have gone back permanently, counting this rejected one.
  [[nodiscard]] bool back_for_good(Stamp stamp) noexcept;
  /// Returns true, and counts it, if a valid sample is farther from the last one than a vehicle can
  /// drive.
  [[nodiscard]] bool leapt(const Reading& r) noexcept;
  void begin_plane(const Geodetic& position) noexcept;
  [[nodiscard]] bool agrees(const InsSample& sample, const Mat3& R_local_ins) noexcept;
  /// Sets the sample's position in enu, if it has one.
  void locate(const InsSample& sample, Reading* r) noexcept;

  const ComparisonOptions& options_;
  ComparisonCounters& counters_;
  LocalTangentPlane plane_{};
  bool has_origin_ = false;
  std::span<Reading> readings_;
  std::uint64_t begin_ = 0, end_ = 0;
  Refused refused_{};
  // Last fix since the start or restart of the INS.
  std::optional<Fix> last_fix_;
  // Newest yaw in rad of a sample without attitude.
  std::optional<double> yaw_;
  // Newest measured height, in m.
  std::optional<double> height_;
  AttitudeCheck attitude_check_;
  // Jumps not yet returned by pop_leap().
  std::optional<Leaps> leaps_;
};

}  // namespace vergence
