// The time-stamped input: a contact against ground, or an optical gate.
#pragma once
#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>

void input_setup(void);

// The current level.
bool input_high(void);

// A permanently changing input must not take processor time or event memory from the trains. After
// EDGES_PER_TURN edges within one turn of the clock (4.096 ms) it is paused until the next turn.
#define EDGES_PER_TURN 32

// The input is paused until the clock's next turn.
extern volatile bool input_muted;

// Resumes the input after its pause. Call periodically.
void input_tend(void);

// Ends the precedence that the input gave to the edge of a train. Interrupts are off.
static inline void input_resume(void)
{
    if (!input_muted)
        TIMSK1 |= _BV(ICIE1);
}

// Since reset: edges that were stamped; pulses too short to be stamped; edges that found their share of the memory taken; times
// that the input was not looked at for the rest of a turn.
struct input_counts {
    uint32_t edges;
    uint16_t glitches;
    uint16_t ignored;
    uint16_t mutes;
};
void input_count(struct input_counts *out);
