#pragma once
/// Lines that carry bytes to and from a device: one interface, serial ports and a pipe within the
/// process behind it.
#include "drivers/serial/byte_line.hpp"
#include "drivers/serial/byte_pipe.hpp"
#include "drivers/serial/serial_port.hpp"
