#pragma once
#include <memory>

#include "drivers/ins.hpp"
#include "drivers/xsens/options.hpp"

namespace vergence::xsens {

/// XSens INS on serial links: the row `xsens` of the table of INS drivers.
[[nodiscard]] std::unique_ptr<InsDriver> make_driver(const Options& options = {});

}  // namespace vergence::xsens
