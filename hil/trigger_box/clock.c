// Timer1 at the processor's clock, and its overflows.
#include "clock.h"

volatile uint32_t clock_overflows;
volatile uint16_t clock_overflows_high;

ISR(TIMER1_OVF_vect)
{
    if (++clock_overflows == 0)
        ++clock_overflows_high;
}

void clock_start(void)
{
    TCCR1A = 0;
    TIMSK1 = _BV(TOIE1);
    TCCR1B = _BV(CS10);
}

uint64_t clock_now(void)
{
    uint8_t sreg = SREG;
    cli();
    uint64_t now;
    clock_extend(TCNT1, &now);
    SREG = sreg;
    return now;
}
