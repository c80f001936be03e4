// Frames over the UART: zero-delimited (COBS), each with a CRC-32.
#pragma once
#include <stdbool.h>
#include <stdint.h>

void link_setup(void);

// Takes the next good frame, if one has come: its body and the length of it; 0 when there is none. The body stays
// valid until the next call.
uint8_t link_receive(const uint8_t **body);

// Are there bytes that `link_receive` has not seen?
bool link_pending(void);

// Sends a frame. Waits while the line's memory is full.
void link_send(const uint8_t *body, uint8_t length);

// Frames that were spoiled on the way, since reset.
struct link_counts {
    uint16_t bad_checksums;
    uint16_t bad_frames; // too short, too long, or no COBS
    uint16_t overruns;   // bytes lost because nobody took them in time
};
void link_count(struct link_counts *out);
