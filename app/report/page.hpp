#pragma once
#include <string>

#include "app/report/analysis.hpp"
#include "app/report/session.hpp"
#include "app/report/verdict.hpp"

namespace vergence::app::report {

/// The whole of report.html: one document, well-formed as XML, too; no script, nothing loaded from
/// anywhere.
[[nodiscard]] std::string page_html(const Session& session, const Analysis& analysis,
                                    const Verdict& verdict);

}  // namespace vergence::app::report
