// What outlives a loss of power: the box's serial number, and how often it was reset.
#pragma once
#include <stdint.h>

// Counts this reset and returns its number, modulo 2^16.
uint16_t store_count_boot(void);

// Copies the serial number to `out` (SERIAL_MAX bytes) and returns its length; 0 when none was ever given.
uint8_t store_serial(char *out);

// Keeps a serial number of `length` bytes, at most SERIAL_MAX.
void store_set_serial(const char *serial, uint8_t length);
