#pragma once
#include <string>

#include "app/report/analysis.hpp"
#include "app/report/assessment.hpp"
#include "app/report/session.hpp"

namespace vergence::app::report {

/// Counts, errors, times, calibration, memory, drops: what is known; a figure that does not exist
/// has no row.
[[nodiscard]] std::string metrics_table(const Session& session, const Analysis& analysis);

/// The word for the calibration and the depth errors it predicts, at the start and at the end.
/// Empty when the summary has neither.
[[nodiscard]] std::string health_table(const Session& session);

/// The calibrations accepted, rejected and measured, the newest sixty of them: why they were
/// sought, how long it took, how held-out frames fit, what was known of the depth.
[[nodiscard]] std::string calibrations_table(const Session& session);

/// Events in their order, successive ones of one kind and message as one row with a count; of very
/// many the first and the last.
[[nodiscard]] std::string events_table(const Session& session);

/// `0.004 m`, `54.34 m`: millimetres below a decimetre.
[[nodiscard]] std::string metres(double value);

/// 12 400: a space between thousands.
[[nodiscard]] std::string grouped(std::size_t count);

/// The whole of report.html: one document, well-formed as XML, too; no script, nothing loaded from
/// anywhere.
[[nodiscard]] std::string page_html(const Session& session, const Analysis& analysis,
                                    const Assessment& assessment);

}  // namespace vergence::app::report
