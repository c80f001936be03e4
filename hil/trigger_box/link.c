// The UART and the framing on it.
#include "link.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <util/atomic.h>

#include "protocol.h"

#define CHECKSUM 4
// COBS adds one byte to a body of at most 254.
#define MAX_FRAME (MAX_BODY + CHECKSUM + 1)

#define RING 128 // a power of two
static volatile uint8_t received[RING];
static volatile uint8_t received_head, received_tail;
static volatile uint8_t to_send[RING];
static volatile uint8_t to_send_head, to_send_tail;

static struct link_counts counts;

static void count(uint16_t *counter)
{
    if (*counter != UINT16_MAX)
        ++*counter;
}

ISR(USART_RX_vect)
{
    bool overrun = UCSR0A & _BV(DOR0);
    uint8_t byte = UDR0;
    uint8_t next = (uint8_t)(received_head + 1) % RING;
    if (next == received_tail)
        overrun = true;
    else {
        received[received_head] = byte;
        received_head = next;
    }
    if (overrun)
        count(&counts.overruns);
}

ISR(USART_UDRE_vect)
{
    if (to_send_head == to_send_tail) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
        return;
    }
    UDR0 = to_send[to_send_tail];
    to_send_tail = (uint8_t)(to_send_tail + 1) % RING;
}

void link_setup(void)
{
    UBRR0 = F_CPU / (16UL * BAUD_RATE) - 1;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

static void put(uint8_t byte)
{
    uint8_t next = (uint8_t)(to_send_head + 1) % RING;
    while (next == to_send_tail)
        ;
    to_send[to_send_head] = byte;
    to_send_head = next;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { UCSR0B |= _BV(UDRIE0); }
}

// CRC-32 (IEEE 802.3), half a byte at a time.
static uint32_t checksum(const uint8_t *data, uint8_t length)
{
    static const uint32_t table[16] PROGMEM = {
        0x00000000, 0x1db71064, 0x3b6e20c8, 0x26d930ac, 0x76dc4190, 0x6b6b51f4, 0x4db26158, 0x5005713c,
        0xedb88320, 0xf00f9344, 0xd6d6a3e8, 0xcb61b38c, 0x9b64c2b0, 0x86d3d2d4, 0xa00ae278, 0xbdbdf21c,
    };
    uint32_t crc = 0xffffffff;
    while (length--) {
        crc ^= *data++;
        crc = pgm_read_dword(&table[crc & 15]) ^ (crc >> 4);
        crc = pgm_read_dword(&table[crc & 15]) ^ (crc >> 4);
    }
    return ~crc;
}

void link_send(const uint8_t *body, uint8_t length)
{
    static uint8_t frame[MAX_BODY + CHECKSUM];
    uint8_t n = 0;
    while (n < length) {
        frame[n] = body[n];
        ++n;
    }
    uint32_t crc = checksum(body, length);
    for (uint8_t i = 0; i < CHECKSUM; ++i, crc >>= 8)
        frame[n++] = (uint8_t)crc;
    put(0);
    for (uint8_t begin = 0; begin <= n;) {
        uint8_t end = begin;
        while (end < n && frame[end] != 0)
            ++end;
        put(end - begin + 1);
        while (begin < end)
            put(frame[begin++]);
        begin = end + 1;
    }
    put(0);
}

// Decodes COBS in place. Returns the length of the content, or 0 if it is invalid.
static uint8_t unstuff(uint8_t *frame, uint8_t length)
{
    uint8_t out = 0;
    for (uint8_t in = 0; in < length;) {
        uint8_t code = frame[in++];
        if (code == 0 || code - 1 > length - in)
            return 0;
        for (uint8_t i = 1; i < code; ++i)
            frame[out++] = frame[in++];
        if (in < length)
            frame[out++] = 0;
    }
    return out;
}

bool link_pending(void)
{
    return received_tail != received_head;
}

uint8_t link_receive(const uint8_t **body)
{
    static uint8_t frame[MAX_FRAME];
    static uint8_t length;
    static bool too_long;
    while (received_tail != received_head) {
        uint8_t byte = received[received_tail];
        received_tail = (uint8_t)(received_tail + 1) % RING;
        if (byte != 0) {
            if (length == MAX_FRAME)
                too_long = true;
            else
                frame[length++] = byte;
            continue;
        }
        uint8_t taken = length;
        bool whole = !too_long;
        length = 0;
        too_long = false;
        if (taken == 0)
            continue; // two delimiters in a row: no frame between them
        uint8_t n = whole ? unstuff(frame, taken) : 0;
        if (n <= CHECKSUM) {
            count(&counts.bad_frames);
            continue;
        }
        n -= CHECKSUM;
        uint32_t crc = checksum(frame, n);
        bool good = true;
        for (uint8_t i = 0; i < CHECKSUM; ++i, crc >>= 8)
            good &= frame[n + i] == (uint8_t)crc;
        if (!good) {
            count(&counts.bad_checksums);
            continue;
        }
        *body = frame;
        return n;
    }
    return 0;
}

void link_count(struct link_counts *out)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { *out = counts; }
}
