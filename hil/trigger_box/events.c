// A ring of numbered events: filled by interrupts, emptied by what the host acknowledges.
#include "events.h"

#include <stddef.h>
#include <util/atomic.h>

#define CAPACITY 64 // a power of two
#define FOR_TRAINS 16 // reserved for trains, not for input edges

static struct event ring[CAPACITY];
static uint32_t oldest; // number of the first kept event
static uint8_t first;   // its index
static uint8_t kept;
static uint16_t dropped;

struct event *events_new_input(void)
{
    return kept < CAPACITY - FOR_TRAINS ? &ring[(uint8_t)(first + kept++) % CAPACITY] : NULL;
}

struct event *events_new(void)
{
    if (kept == CAPACITY) {
        if (dropped != UINT16_MAX)
            ++dropped;
        return NULL;
    }
    return &ring[(uint8_t)(first + kept++) % CAPACITY];
}

uint32_t events_next(void)
{
    uint32_t n;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { n = oldest + kept; }
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
        uint32_t n = before - oldest;
        if (n <= kept) {
            oldest = before;
            first += (uint8_t)n;
            kept -= (uint8_t)n;
        }
    }
}

void events_get(uint32_t number, struct event *out)
{
    // A stored event is not modified any more, so interrupts may run.
    *out = ring[(uint8_t)(first + (uint8_t)(number - oldest)) % CAPACITY];
}

uint16_t events_dropped(void)
{
    uint16_t n;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { n = dropped; }
    return n;
}
