// Events that the host has not yet acknowledged: started trains and input edges.
#pragma once
#include <stdint.h>

struct event {
    uint8_t kind;
    uint32_t code; // the 20 data bits of a train, 0 for an edge
    uint64_t ticks;
};

// A place for the next event, which is counted in already, or a null pointer when the memory is full: then the event is
// counted as dropped. Interrupts are off until the place is filled.
struct event *events_new(void);

// The same for an edge of the input, which leaves places to trains: a null pointer while only those are free, and nothing is
// counted.
struct event *events_new_input(void);

// Number of the next event; the first since reset is 0.
uint32_t events_next(void);

// Number of the oldest stored event.
uint32_t events_oldest(void);

// Discards all stored events before number `before`.
void events_forget(uint32_t before);

// Copies event number `number`, which must be stored.
void events_get(uint32_t number, struct event *out);

// Events dropped because the memory was full, since reset.
uint16_t events_dropped(void);
