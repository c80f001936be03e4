// Trains of pulses on the outputs, in the code of crates/model/src/pulse.rs.
#pragma once
#include <stdbool.h>
#include <stdint.h>

#define START_WIDTH_US 300UL
#define ONE_WIDTH_US 200UL
#define ZERO_WIDTH_US 100UL
#define PULSE_PERIOD_US 400UL
#define DATA_BITS 20
#define CHECK_BITS 11
#define PULSES_PER_TRAIN (1 + DATA_BITS + CHECK_BITS)
// A train and two periods of rest.
#define TRAIN_US ((PULSES_PER_TRAIN + 2) * PULSE_PERIOD_US)
#define PRESS_BITS 17
// x^11 + x^8 + x^7 + x^5 + x^4 + x^3 + x + 1 without its highest term, and what the check bits are XORed with.
#define GENERATOR 0x1bb
#define CHECK_MASK 0x7fd
#define SYNC_CODE 6UL

void train_setup(void);

// Starts the train of a mark (kind above bit 17, press below) as soon as the line is free and sets `*start` to the
// instant of its first rising edge. False while the train of another mark is under way or waits.
bool train_mark(uint32_t data, uint64_t *start);

// Starts the sync train number `count` unless any train is under way.
bool train_sync(uint32_t count);

// True while a train is running or waiting.
bool train_under_way(void);

// Raises and lowers the outputs once, 100 us long, without a train; flags of self_test_flag. The line must be free.
uint8_t train_self_test(void);

// Started trains, and edges late by more than a cycle, since reset.
struct train_counts {
    uint32_t marks;
    uint32_t syncs;
    uint16_t late_edges;
};
void train_count(struct train_counts *out);
