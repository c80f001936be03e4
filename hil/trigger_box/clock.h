// The box's clock: processor cycles since reset, 16 to the microsecond, 64 bits.
#pragma once
#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

#define TICKS_PER_US 16UL
#define TICKS_PER_MS (1000UL * TICKS_PER_US)

// Overflows of Timer1 since reset, one each 4.096 ms. Written by its interrupt only.
extern volatile uint32_t clock_overflows;
extern volatile uint16_t clock_overflows_high;

// Starts Timer1, which counts cycles and never stops.
void clock_start(void);

// The current time.
uint64_t clock_now(void);

// Sets `*ticks` to the instant at which Timer1 read `timer`, at most half a turn (2 ms) ago. Interrupts are off.
static inline void clock_extend(uint16_t timer, uint64_t *ticks)
{
    struct {
        uint16_t timer;
        uint32_t overflows;
        uint16_t overflows_high;
    } __attribute__((packed, may_alias)) *parts = (void *)ticks;
    parts->timer = timer;
    parts->overflows = clock_overflows;
    parts->overflows_high = clock_overflows_high;
    // An overflow that waits for its interrupt counts for instants after it.
    if ((TIFR1 & _BV(TOV1)) && timer < 0x8000 && ++parts->overflows == 0)
        ++parts->overflows_high;
}

// The lower 32 bits of the current time. Interrupts are off.
static inline uint32_t clock_low(void)
{
    uint16_t timer = TCNT1;
    uint16_t overflows = (uint16_t)clock_overflows;
    if ((TIFR1 & _BV(TOV1)) && timer < 0x8000)
        ++overflows;
    return ((uint32_t)overflows << 16) | timer;
}
