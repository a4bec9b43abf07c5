#pragma once
#include <array>
#include <string>

namespace vergence::app::report {

/// Colour for the light and the dark page, as #rrggbb.
struct Colour {
  /// Name of the CSS variable.
  const char* name;
  const char* light;
  const char* dark;
  /// True for text, which needs a contrast of 4.5 to `page` and `panel`; others need 3.
  bool text;
};

inline constexpr Colour kPage{"page", "#f5f6f8", "#101418", false};
inline constexpr Colour kPanel{"panel", "#ffffff", "#181e25", false};
inline constexpr std::array kColours{
    Colour{"ink", "#17202a", "#e6ebf0", true},    Colour{"soft", "#4d5b69", "#a6b3c0", true},
    Colour{"frame", "#7c8896", "#73808d", false}, Colour{"ours", "#0b5cc4", "#6fb1ff", true},
    Colour{"theirs", "#8a1266", "#f5a8dc", true}, Colour{"good", "#007561", "#6ee7c8", true},
    Colour{"care", "#875b00", "#e0b03c", true},   Colour{"bad", "#a3001e", "#ff7a70", true},
    Colour{"third", "#7a3fb0", "#c79bf2", true},  Colour{"fourth", "#00707a", "#4fc7d1", true},
};

/// The colours as CSS variables, light and dark.
[[nodiscard]] std::string palette();

/// The page's style sheet: both themes, phone, print.
[[nodiscard]] std::string style_sheet();

}  // namespace vergence::app::report
