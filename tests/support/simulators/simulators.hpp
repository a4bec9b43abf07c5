#pragma once
/// Devices at byte level, behind lines in virtual time.
#include "tests/support/simulators/board_simulator.hpp"
#include "tests/support/simulators/simulated_line.hpp"
#include "tests/support/simulators/xsens_simulator.hpp"
