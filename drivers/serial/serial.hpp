#pragma once
/// Interface of byte links to devices, and its implementation by serial ports.
#include "drivers/serial/serial_link.hpp"
#include "drivers/serial/serial_port.hpp"
