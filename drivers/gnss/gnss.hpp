#pragma once
#include <memory>

#include "drivers/gnss/options.hpp"
#include "drivers/ins.hpp"

namespace vergence::gnss {

/// Satellite receivers on serial links: the rows `nmea` and `ubx` of the table of INS drivers.
[[nodiscard]] std::unique_ptr<InsDriver> make_driver(const Options& options);

}  // namespace vergence::gnss
