#include "app/report/style.hpp"

#include "app/report/page_css.hpp"  // made by CMake from app/report/page.css

namespace vergence::app::report {
namespace {

std::string variables(bool dark) {
  std::string css;
  const auto add = [&](const Colour& c) {
    css += std::string("--") + c.name + ":" + (dark ? c.dark : c.light) + ";";
  };
  add(kPage);
  add(kPanel);
  for (const Colour& c : kColours) add(c);
  return css;
}

}  // namespace

std::string palette() {
  // Paper is light whatever the screen's theme.
  return ":root{color-scheme:light dark;" + variables(false) +
         "}\n@media screen and (prefers-color-scheme:dark){:root{" + variables(true) + "}}";
}

std::string style_sheet() { return palette() + kPageCss; }

}  // namespace vergence::app::report
