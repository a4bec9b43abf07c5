#pragma once
#include <stdexcept>

#include "drivers/camera.hpp"

namespace vergence::test {

/// Sets an option from its text, of the kind `Options` where there were none. Throws where it
/// cannot be: the test is wrong.
template <class Options>
void give(CameraConfiguration* c, const std::string& name, const std::string& value) {
  if (!std::holds_alternative<Options>(c->options)) c->options = Options{};
  if (!set_option(name, value, &c->options))
    throw std::invalid_argument("option " + name + "=" + value);
}

}  // namespace vergence::test
