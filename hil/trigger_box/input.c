// Input capture: Timer1's value is latched by the edge itself, independently of the processor's load.
#include "input.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "clock.h"
#include "events.h"
#include "pins.h"
#include "protocol.h"

static struct input_counts counts;
volatile bool input_muted;
static uint8_t turn; // timer period of the last edge
static uint8_t edges_left = EDGES_PER_TURN; // in this turn
static bool stale; // the latched value dates from a pause of the input

static inline void count(uint16_t *n)
{
    if (*n != UINT16_MAX)
        ++*n;
}

static inline bool is_high(void)
{
    return PINB & _BV(PIN_INPUT);
}

// Kept short: it delays train edges that are due.
static void record(bool level, uint16_t timer)
{
    struct event *e = events_new_input();
    if (!e) {
        count(&counts.ignored);
        return;
    }
    ++counts.edges;
    e->kind = level ? EVENT_INPUT_ROSE : EVENT_INPUT_FELL;
    e->code = 0;
    clock_extend(timer, &e->ticks);
}

static inline void wait_for(bool level)
{
    if (level)
        TCCR1B |= _BV(ICES1);
    else
        TCCR1B &= (uint8_t)~_BV(ICES1);
}

// True while the input is within its edge limit; otherwise it is paused until `input_tend` resumes it.
static inline bool within_bounds(void)
{
    uint8_t now = (uint8_t)clock_overflows;
    if (now != turn) {
        turn = now;
        edges_left = EDGES_PER_TURN;
    }
    if (edges_left == 0) {
        TIMSK1 &= (uint8_t)~_BV(ICIE1);
        input_muted = true;
        count(&counts.mutes);
        return false;
    }
    --edges_left;
    return true;
}

static inline void take_edge(uint16_t timer)
{
    bool level = TCCR1B & _BV(ICES1);
    if (is_high() != level) {
        // Ended before it could be read (or caused by the change of polarity itself): not a reliable edge.
        count(&counts.glitches);
        return;
    }
    record(level, timer);
    wait_for(!level);
    if (is_high() != level) {
        // The opposite edge came before the capture was ready for it: time-stamped at most 1 us late.
        record(!level, TCNT1);
        wait_for(level);
    }
}

ISR(TIMER1_CAPT_vect)
{
    uint16_t timer = ICR1;
    if (stale) {
        stale = false;
        wait_for(!is_high());
        return;
    }
    if (!within_bounds())
        return;
    take_edge(timer);
    // The edge of a train that has become due comes before the next edge of the input, whose interrupt ranks higher. The
    // last thing looked at, so that at most one interrupt of the input is between the two (see LEAD_TICKS).
    if (TIFR1 & _BV(OCF1A))
        TIMSK1 &= (uint8_t)~_BV(ICIE1);
}

void input_setup(void)
{
    // The pull-up keeps an unconnected input silent.
    PORTB |= _BV(PIN_INPUT);
    // The noise canceller wants four equal samples: it rejects spikes under 250 ns and delays time stamps by as much.
    TCCR1B |= _BV(ICNC1);
    wait_for(!is_high());
    TIMSK1 |= _BV(ICIE1);
}

void input_tend(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        if (input_muted && (uint8_t)clock_overflows != turn) {
            wait_for(!is_high());
            // Left to the interrupt to clear: simavr 1.6 would clear the trains' flag in the same register too.
            stale = TIFR1 & _BV(ICF1);
            input_muted = false;
            TIMSK1 |= _BV(ICIE1);
        }
    }
}

bool input_high(void)
{
    return is_high();
}

void input_count(struct input_counts *out)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { *out = counts; }
}
