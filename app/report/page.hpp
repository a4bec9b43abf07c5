#pragma once

#include "app/report/assessment.hpp"

namespace vergence::app::report {

/// Complete report.html: one document, also well-formed XML, without scripts or external content.
[[nodiscard]] std::string page_html(const Session& session, const Analysis& analysis,
                                    const Assessment& assessment);

}  // namespace vergence::app::report
