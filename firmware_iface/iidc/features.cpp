#include "firmware_iface/iidc/features.hpp"

namespace vergence::iidc {

std::string_view to_string(Feature f) noexcept {
  switch (f) {
    case Feature::brightness:
      return "brightness";
    case Feature::auto_exposure:
      return "auto exposure";
    case Feature::sharpness:
      return "sharpness";
    case Feature::white_balance:
      return "white balance";
    case Feature::hue:
      return "hue";
    case Feature::saturation:
      return "saturation";
    case Feature::gamma:
      return "gamma";
    case Feature::shutter:
      return "shutter";
    case Feature::gain:
      return "gain";
    case Feature::iris:
      return "iris";
    case Feature::focus:
      return "focus";
    case Feature::temperature:
      return "temperature";
    case Feature::trigger:
      return "trigger";
    case Feature::trigger_delay:
      return "trigger delay";
    case Feature::white_shading:
      return "white shading";
    case Feature::frame_rate:
      return "frame rate";
    case Feature::zoom:
      return "zoom";
    case Feature::pan:
      return "pan";
    case Feature::tilt:
      return "tilt";
  }
  return "unknown feature";
}

}  // namespace vergence::iidc
