// Pin assignment. All outputs share one port, so that one write raises them in the same cycle.
#pragma once
#include <avr/io.h>

#define PIN_INPUT PB0     // ICP1, Arduino D8
#define PIN_CAMERA_1 PB1  // Arduino D9
#define PIN_CAMERA_2 PB2  // Arduino D10
#define PIN_SPARE PB3     // Arduino D11
#define PIN_ARMED PB5     // Arduino D13, the LED

#define OUTPUTS (_BV(PIN_CAMERA_1) | _BV(PIN_CAMERA_2) | _BV(PIN_SPARE))
