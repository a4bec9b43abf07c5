#pragma once
#include <cstdint>
#include <string>

#include "app/report/analysis.hpp"
#include "app/report/session.hpp"

namespace vergence::app::report {

/// Whether a drive has any pose to rely on.
enum class Use : std::uint8_t {
  ok,          // at least one frame is ok, or statuses are not known
  unverified,  // none is, because the drive ended before it could confirm its calibration
  nothing,     // none is, for other reasons, or for so long
};

struct Usability {
  Use use = Use::ok;
  std::string reason;  // half a sentence with counts; empty: ok
  std::string advice;  // what to do about the main reason; may be empty
};

/// A drive of so many moving frames can confirm its calibration: 36 with a calibration given, 54
/// from scratch (docs/calibration.md).
inline constexpr std::size_t kFramesToConfirm = 60;

[[nodiscard]] Usability usability_of(const Session& session, const Analysis& analysis);

}  // namespace vergence::app::report
