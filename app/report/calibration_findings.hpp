#pragma once
#include "app/report/analysis.hpp"
#include "app/report/session.hpp"
#include "app/report/usability.hpp"
#include "app/report/verdict.hpp"

/// What a session says about its calibration: reasons and advice for the verdict.
///
/// Threads  Any. Memory: that of the sentences. Errors: what a session does not say is no finding.
namespace vergence::app::report {

/// A calibration written down in a way that the matches give away.
void judge_mistake(const Session& s, const Analysis& a, Findings* j);
/// A focal length that the drive itself measures to be another: all distances are off by as much.
void judge_focal_length(const Session& s, Findings* j);
/// How well it is known, and whether the last attempt at it succeeded.
void judge_calibration(const Session& s, const Usability& use, Findings* j);
/// Whether the drive itself has confirmed what its poses stand on.
void judge_verification(const Session& s, const Analysis& a, const Usability& use, Findings* j);
/// What events about calibrations and lengths ask for.
void advise_on_events(const Session& s, Findings* j);

}  // namespace vergence::app::report
