#pragma once
#include <span>
#include <string>

#include "firmware_iface/iidc/bandwidth.hpp"

namespace vergence::iidc {

/// Empty when the streams fit on one bus. Else one sentence: what each needs, what there is, and
/// the packet and rate that would fit if all were equal.
[[nodiscard]] std::string budget_error(std::span<const BusShare> shares);

}  // namespace vergence::iidc
