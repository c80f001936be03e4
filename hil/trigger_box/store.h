// Data kept without power: the box's serial number and its reset count.
#pragma once
#include <stdint.h>

// Counts this reset and returns its number, modulo 2^16.
uint16_t store_count_boot(void);

// Copies the serial number to `out` (SERIAL_MAX bytes) and returns its length; 0 if none was set.
uint8_t store_serial(char *out);

// Stores a serial number of `length` bytes, at most SERIAL_MAX.
void store_set_serial(const char *serial, uint8_t length);
