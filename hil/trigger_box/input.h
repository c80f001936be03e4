// The time-stamped input: a contact against ground, or an optical gate.
#pragma once
#include <stdbool.h>
#include <stdint.h>

void input_setup(void);

// The level now.
bool input_high(void);

// Edges that were stamped, and pulses too short to be stamped, since reset.
struct input_counts {
    uint32_t edges;
    uint16_t glitches;
};
void input_count(struct input_counts *out);
