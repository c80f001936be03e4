// Frames over the UART: zero-delimited (COBS), each with a CRC-32.
#pragma once
#include <stdbool.h>
#include <stdint.h>

void link_setup(void);

// Takes the next good frame, if one has come: its body and the length of it; 0 when there is none. The body stays
// valid until the next call.
uint8_t link_receive(const uint8_t **body);

// True while there are bytes not yet processed by `link_receive`.
bool link_pending(void);

// Sends a frame. Blocks while the send buffer is full.
void link_send(const uint8_t *body, uint8_t length);

// Damaged frames since reset.
struct link_counts {
    uint16_t bad_checksums;
    uint16_t bad_frames; // too short, too long, or no COBS
    uint16_t overruns;   // bytes lost because they were not read in time
};
void link_count(struct link_counts *out);
