#pragma once
#include <string>

#include "app/report/analysis.hpp"
#include "app/report/assessment.hpp"
#include "app/report/session.hpp"

namespace vergence::app::report {

/// `0.004 m`, `54.34 m`: millimetres below a decimetre.
[[nodiscard]] std::string metres(double value);

/// The whole of report.html: one document, well-formed as XML, too; no script, nothing loaded from
/// anywhere.
[[nodiscard]] std::string page_html(const Session& session, const Analysis& analysis,
                                    const Assessment& assessment);

}  // namespace vergence::app::report
