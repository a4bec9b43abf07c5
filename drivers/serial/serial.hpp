#pragma once
/// Lines that carry bytes to and from a device: one interface, serial ports
/// behind it.
#include "drivers/serial/serial_link.hpp"
#include "drivers/serial/serial_port.hpp"
