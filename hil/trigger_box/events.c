// A ring of numbered events: filled by interrupts, emptied by what the host acknowledges.
#include "events.h"

#include <util/atomic.h>

#define CAPACITY 64 // a power of two

static struct event ring[CAPACITY];
static uint32_t oldest;
static uint32_t next;
static uint16_t dropped;

void events_push(uint8_t kind, uint32_t code, uint64_t ticks)
{
    if (next - oldest == CAPACITY) {
        if (dropped != UINT16_MAX)
            ++dropped;
        return;
    }
    struct event *e = &ring[(uint8_t)next % CAPACITY];
    e->kind = kind;
    e->code = code;
    e->ticks = ticks;
    ++next;
}

uint32_t events_next(void)
{
    uint32_t n;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { n = next; }
    return n;
}

uint32_t events_oldest(void)
{
    return oldest;
}

void events_forget(uint32_t before)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        if (before - oldest <= next - oldest)
            oldest = before;
    }
}

void events_get(uint32_t number, struct event *out)
{
    // A kept event is written no more, so that interrupts may run.
    *out = ring[(uint8_t)number % CAPACITY];
}

uint16_t events_dropped(void)
{
    uint16_t n;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { n = dropped; }
    return n;
}
