#include "app/publish/page_html.hpp"

#include <string>

#include "app/publish/page_parts.hpp"  // made by CMake from app/publish/page/
#include "app/report/style.hpp"

namespace vergence::app {

std::string_view page_html() {
  static const std::string page =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">"
      "<link rel=\"icon\" href=\"data:,\"><title>vergence</title><style>" +
      report::palette() + kPageCss + "</style></head>" + kPageBody + "<script>" + kPageScript +
      "</script></html>\n";
  return page;
}

}  // namespace vergence::app
