#include "drivers/iidc/identity.hpp"

#include <charconv>

#include "drivers/format_text.hpp"

namespace vergence::iidc {

std::string guid_text(std::uint64_t guid) {
  return format_text("%016llx", static_cast<unsigned long long>(guid));
}

bool names_camera(std::string_view requested, std::uint64_t guid,
                  std::string_view transport_serial) {
  if (requested.empty() || requested == transport_serial) return true;
  const auto value = [](std::string_view text, int base) -> std::uint64_t {
    std::uint64_t v = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), v, base);
    return error == std::errc{} && end == text.data() + text.size() ? v : 0;
  };
  if (requested.starts_with("0x") || requested.starts_with("0X")) requested.remove_prefix(2);
  if (value(requested, 16) == guid && guid != 0) return true;
  const std::uint64_t number = value(requested, 10);
  return number != 0 && number == (guid & 0xFFFF'FFFFU);
}

}  // namespace vergence::iidc
