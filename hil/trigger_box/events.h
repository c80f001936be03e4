// What happened and the host has not yet acknowledged: trains that started, edges of the input.
#pragma once
#include <stdint.h>

struct event {
    uint8_t kind;
    uint32_t code; // the press of a mark with its kind above bit 17, the count of a sync train, 0
    uint64_t ticks;
};

// Appends an event, or counts it as dropped when the memory is full. Interrupts are off.
void events_push(uint8_t kind, uint32_t code, uint64_t ticks);

// Number of the event that will come next; the first since reset is 0.
uint32_t events_next(void);

// Number of the oldest event that is still kept.
uint32_t events_oldest(void);

// Forgets all events before number `before`.
void events_forget(uint32_t before);

// Copies event number `number`, which must be kept.
void events_get(uint32_t number, struct event *out);

// Events that found the memory full, since reset.
uint16_t events_dropped(void);
