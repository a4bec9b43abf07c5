#pragma once
#include <string_view>

namespace vergence::app {

/// The live page: HTML, style sheet and script in one, from app/publish/page/. Lives as long as
/// the program.
[[nodiscard]] std::string_view page_html();

}  // namespace vergence::app
