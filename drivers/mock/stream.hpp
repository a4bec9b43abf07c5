#pragma once
#include "drivers/stream.hpp"

namespace vergence::mock {

using vergence::Delivery;
using vergence::Stream;

}  // namespace vergence::mock
