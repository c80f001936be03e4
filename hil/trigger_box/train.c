// The pulse trains: each edge has a scheduled clock value and occurs in exactly that cycle.
//
// The compare interrupt of Timer1 comes a little early, waits for the rest in a loop that accounts for every cycle, and
// writes the port once. Other interrupts may delay its beginning, never the edge.
#include "train.h"

#include <avr/interrupt.h>
#include <util/atomic.h>
#include <util/delay.h>

#include "clock.h"
#include "events.h"
#include "input.h"
#include "pins.h"
#include "protocol.h"

// How long before an edge its interrupt is due: longer than all that can come before the look at the clock in it. That is
// one interrupt of the input with two edges (440 cycles), which begins last in the other's last instructions (50) or after
// any other stretch without interrupts (110 at most), and the interrupt's own beginning (130): 700 cycles, 44 us. Half a
// microsecond off the grid of the edges, so that no match falls on the timer's overflow, where simavr 1.6 misses it.
#define LEAD_TICKS (52UL * TICKS_PER_US + TICKS_PER_US / 2)
// Delay from the request to the first edge of a train that starts immediately.
#define START_LEAD_TICKS (100UL * TICKS_PER_US)
// Cycles between the reading of Timer1 in `write_at` and the change of the port, besides the wait itself.
#define WRITE_CYCLES 17

struct train {
    uint8_t kind;       // event_kind
    uint32_t data;      // 20 bits
    uint32_t bits;      // of all pulses, first in the highest bit; the bit of the start pulse is unused
    uint64_t start;     // first rising edge
};

enum { IDLE, ACTIVE };
static volatile uint8_t state;
static volatile bool waiting; // `next` begins after `current`
static struct train current, next;

static uint8_t pulse;       // of the current train
static uint32_t bits_left;  // of the current train, current pulse in the highest bit
static bool high;           // the outputs are high
static uint32_t rise;       // lower 32 bits of the current pulse's rising edge
static uint32_t due;        // lower 32 bits of the next edge
static uint64_t free_at;    // earliest start of the next train

static struct train_counts counts;

// Writes `value` to the port of the outputs in the cycle in which the lower half of the clock reads `at`. True when
// that cycle had already passed; then it writes immediately.
static inline bool write_at(uint16_t at, uint8_t value)
{
    uint16_t left = at - WRITE_CYCLES;
    uint16_t now;
    uint8_t late;
    asm volatile("lds %A[now], %[timer]\n\t"
                 "lds %B[now], %[timer]+1\n\t"
                 "sub %A[left], %A[now]\n\t"
                 "sbc %B[left], %B[now]\n\t"
                 "mov %[late], %B[left]\n\t"
                 "brmi 2f\n\t"
                 "1: sbiw %[left], 4\n\t" // four cycles a turn
                 "brcc 1b\n\t"
                 "sbrc %A[left], 0\n\t" // the rest: 0 to 3 cycles
                 "rjmp .+0\n\t"
                 "sbrc %A[left], 1\n\t"
                 "rjmp .+0\n\t"
                 "sbrc %A[left], 1\n\t"
                 "rjmp .+0\n\t"
                 "2: out %[port], %[value]\n\t"
                 : [left] "+w"(left), [now] "=&r"(now), [late] "=&r"(late)
                 : [timer] "n"(_SFR_MEM_ADDR(TCNT1L)), [port] "I"(_SFR_IO_ADDR(PORTB)), [value] "r"(value)
                 : "memory");
    return late & 0x80;
}

static uint32_t width_us(void)
{
    if (pulse == 0)
        return START_WIDTH_US;
    return bits_left >> 31 ? ONE_WIDTH_US : ZERO_WIDTH_US;
}

static void begin(void)
{
    pulse = 0;
    bits_left = current.bits;
    high = false;
    rise = due = (uint32_t)current.start;
    state = ACTIVE;
    free_at = current.start + TRAIN_US * TICKS_PER_US;
    OCR1A = (uint16_t)due - (uint16_t)LEAD_TICKS;
}

ISR(TIMER1_COMPA_vect)
{
    input_resume();
    if (state == IDLE)
        return;
    // A match of an old setting, or an edge more than a timer period away: the interrupt will recur.
    int32_t left = (int32_t)(due - clock_low());
    if (left > (int32_t)(LEAD_TICKS + LEAD_TICKS / 2))
        return;
    uint8_t value = high ? PORTB & (uint8_t)~OUTPUTS : PORTB | OUTPUTS;
    bool late = left < 0;
    if (late)
        PORTB = value;
    else
        late = write_at((uint16_t)due, value);
    if (late && counts.late_edges != UINT16_MAX)
        ++counts.late_edges;
    high = !high;
    if (high) {
        if (pulse == 0) {
            struct event *e = events_new();
            if (e) {
                e->kind = current.kind;
                e->code = current.data;
                e->ticks = current.start;
            }
            if (current.kind == EVENT_MARK)
                ++counts.marks;
            else
                ++counts.syncs;
        }
        due = rise + width_us() * TICKS_PER_US;
        bits_left <<= 1;
    } else if (++pulse < PULSES_PER_TRAIN) {
        rise += PULSE_PERIOD_US * TICKS_PER_US;
        due = rise;
    } else if (waiting) {
        waiting = false;
        current = next;
        begin();
        return;
    } else {
        state = IDLE;
        return;
    }
    OCR1A = (uint16_t)due - (uint16_t)LEAD_TICKS;
}

// The remainder of data * x^11 by the generator over GF(2), masked.
static uint16_t check_bits(uint32_t data)
{
    uint16_t rest = 0;
    for (uint32_t bit = 1UL << (DATA_BITS - 1); bit; bit >>= 1) {
        bool one = (rest >> (CHECK_BITS - 1)) & 1;
        if (data & bit)
            one = !one;
        rest = (rest << 1) & ((1 << CHECK_BITS) - 1);
        if (one)
            rest ^= GENERATOR;
    }
    return rest ^ CHECK_MASK;
}

static struct train train_of(uint8_t kind, uint32_t data)
{
    return (struct train){.kind = kind, .data = data, .bits = data << CHECK_BITS | check_bits(data)};
}

// The earliest whole microsecond at which a train may begin.
static uint64_t earliest(void)
{
    uint64_t t = clock_now() + START_LEAD_TICKS;
    if (t < free_at)
        t = free_at;
    return (t + TICKS_PER_US - 1) & ~(uint64_t)(TICKS_PER_US - 1);
}

void train_setup(void)
{
    PORTB &= (uint8_t)~OUTPUTS;
    DDRB |= OUTPUTS;
    // Always on: without a train it runs once per timer period and does nothing.
    TIMSK1 |= _BV(OCIE1A);
}

bool train_mark(uint32_t data, uint64_t *start)
{
    struct train t = train_of(EVENT_MARK, data);
    bool taken = false;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        if (state == IDLE) {
            current = t;
            *start = current.start = earliest();
            begin();
            taken = true;
        } else if (current.kind == EVENT_SYNC && !waiting) {
            next = t;
            *start = next.start = free_at;
            waiting = true;
            taken = true;
        }
    }
    return taken;
}

bool train_sync(uint32_t count)
{
    struct train t = train_of(EVENT_SYNC, SYNC_CODE << PRESS_BITS | (count & ((1UL << PRESS_BITS) - 1)));
    bool taken = false;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        if (state == IDLE) {
            current = t;
            current.start = earliest();
            begin();
            taken = true;
        }
    }
    return taken;
}

bool train_under_way(void)
{
    return state != IDLE;
}

uint8_t train_self_test(void)
{
    uint8_t flags = 0;
    bool before = PINB & _BV(PIN_INPUT);
    PORTB |= OUTPUTS;
    _delay_us(100);
    uint8_t up = PINB;
    PORTB &= (uint8_t)~OUTPUTS;
    _delay_us(100);
    uint8_t down = PINB;
    if ((up & OUTPUTS) == OUTPUTS)
        flags |= SELF_TEST_ROSE;
    if ((down & OUTPUTS) == 0)
        flags |= SELF_TEST_FELL;
    if (!before && (up & _BV(PIN_INPUT)) && !(down & _BV(PIN_INPUT)))
        flags |= SELF_TEST_INPUT_FOLLOWED;
    return flags;
}

void train_count(struct train_counts *out)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { *out = counts; }
}
