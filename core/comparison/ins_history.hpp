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

/// The newest samples of an INS, in `enu`, and what it said at an instant between two of them.
///
/// Threads one. Memory from the arena at construction; full: the oldest sample goes.
class InsHistory {
 public:
  /// Sigmas of a sample, m and rad: its own, else those of the options.
  struct Sigmas {
    double position = 0, height = 0, tilt = 0;
  };
  /// Between two samples.
  struct Reference {
    Transform T_enu_left{};
    Sigmas sigmas{};    // the larger of both
    bool flat = false;  // one of them has no height: its height is the last measured one
  };

  /// Counts refused samples and jumps in `counters`, which outlive this, as `options` do.
  InsHistory(const ComparisonOptions& options, ComparisonCounters& counters, Arena& arena);
  [[nodiscard]] static std::size_t bytes_needed(const ComparisonOptions& options) noexcept;

  /// Samples in order of their stamps; others are refused and counted.
  void add(const InsSample& sample) noexcept;
  /// Where the INS has the left camera at this stamp. Not `ok`: *out as it was.
  [[nodiscard]] InsMatch reference_at(Stamp stamp, Reference* out) const noexcept;
  /// The newest sample is not older than this.
  [[nodiscard]] bool reaches(Stamp stamp) const noexcept;
  /// Returns true if the position has jumped, by `now` at the latest; once for a leap, or for
  /// several before one `now`. Between the first and the last of several it is true whenever it is
  /// asked: no two places there need fit together.
  [[nodiscard]] bool pop_leap(Stamp now) noexcept;

  [[nodiscard]] bool has_origin() const noexcept { return has_origin_; }
  [[nodiscard]] const LocalTangentPlane& plane() const noexcept { return plane_; }

 private:
  struct Reading {  // an InsSample in enu
    Stamp stamp{};
    bool valid = false;
    bool jumped = false;  // against the last fix before
    bool flat = false;    // a fix in two dimensions
    Vec3 p_enu_ins = Vec3::Zero();
    Mat3 R_enu_ins = Mat3::Identity();
    Sigmas sigmas{};
  };
  struct Fix {
    Stamp stamp{};
    Vec3 p_enu_ins = Vec3::Zero();
    bool flat = false;
  };
  struct Refused {  // in a row for their stamps, which ascend among themselves
    int count = 0;
    Stamp first{}, last{};
  };
  struct Leaps {
    Stamp first{}, last{};
  };

  [[nodiscard]] const Reading& reading(std::uint64_t i) const noexcept {
    return readings_[static_cast<std::size_t>(i) & (readings_.size() - 1)];
  }
  /// False: its stamp goes back.
  [[nodiscard]] bool accept_stamp(Stamp stamp) noexcept;
  /// With this refused stamp, too.
  [[nodiscard]] bool back_for_good(Stamp stamp) noexcept;
  /// Returns true if a valid sample is farther from the last one than a vehicle can drive; counted.
  [[nodiscard]] bool leapt(const Reading& r) noexcept;
  void begin_plane(const Geodetic& position) noexcept;
  [[nodiscard]] bool agrees(const InsSample& sample, const Mat3& R_local_ins) noexcept;
  /// The sample's place in enu, if it has one.
  void locate(const InsSample& sample, Reading* r) noexcept;

  const ComparisonOptions& options_;
  ComparisonCounters& counters_;
  LocalTangentPlane plane_{};
  bool has_origin_ = false;
  std::span<Reading> readings_;
  std::uint64_t begin_ = 0, end_ = 0;  // numbers of the readings held
  Refused refused_{};
  std::optional<Fix> last_fix_;   // since the INS began or began anew
  std::optional<double> yaw_;     // rad, the newest of a sample without attitude
  std::optional<double> height_;  // m, the newest that was measured
  AttitudeCheck attitude_check_;
  std::optional<Leaps> leaps_;  // not yet taken
};

}  // namespace vergence
