// Input capture: Timer1's value is latched by the edge itself, whatever the processor is doing.
#include "input.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

#include "clock.h"
#include "events.h"
#include "pins.h"
#include "protocol.h"

static struct input_counts counts;

static inline bool is_high(void)
{
    return PINB & _BV(PIN_INPUT);
}

// Kept short: while it runs, an edge of a train that is due must wait.
static void record(bool level, uint16_t timer)
{
    ++counts.edges;
    struct event *e = events_new();
    if (!e)
        return;
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

ISR(TIMER1_CAPT_vect)
{
    uint16_t timer = ICR1;
    bool level = TCCR1B & _BV(ICES1);
    if (is_high() != level) {
        // Over before it could be looked at (or raised by the change of polarity itself): not an edge to rely on.
        if (counts.glitches != UINT16_MAX)
            ++counts.glitches;
        return;
    }
    record(level, timer);
    wait_for(!level);
    if (is_high() != level) {
        // The opposite edge came before the capture was ready for it: stamped a microsecond late at most.
        record(!level, TCNT1);
        wait_for(level);
    }
}

void input_setup(void)
{
    // With its pull-up an input that nothing is wired to stays silent.
    PORTB |= _BV(PIN_INPUT);
    wait_for(!is_high());
    TIMSK1 |= _BV(ICIE1);
}

bool input_high(void)
{
    return is_high();
}

void input_count(struct input_counts *out)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { *out = counts; }
}
