// The trigger box: executes the host's commands, sends periodic sync trains, disarms when the host is silent.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdbool.h>
#include <string.h>

#include "clock.h"
#include "events.h"
#include "input.h"
#include "link.h"
#include "pins.h"
#include "protocol.h"
#include "store.h"
#include "train.h"

// The watchdog stays on after a reset that it caused and would fire again in 15 ms: switch it off first, after the
// cause of the reset is saved.
static uint8_t reset_cause __attribute__((section(".noinit")));
void before_main(void) __attribute__((naked, used, section(".init3")));
void before_main(void)
{
    reset_cause = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

static uint16_t boot;

static bool armed;
static bool disarmed_by_silence;
static uint64_t silence_ticks; // 0: no timeout
static uint64_t heard;         // time of the last valid frame

static uint64_t sync_period; // 0: none
static uint64_t sync_due;
static uint32_t sync_count;

// The last executed mark: a repeated request gets the same reply without a second train.
static uint32_t mark_number;
static uint64_t mark_start;

// A reply under construction.
static uint8_t reply[MAX_BODY];
static uint8_t reply_length;

static void append(const void *bytes, uint8_t length)
{
    memcpy(reply + reply_length, bytes, length);
    reply_length += length;
}
static void append_8(uint8_t v) { append(&v, 1); }
static void append_16(uint16_t v) { append(&v, 2); }
static void append_32(uint32_t v) { append(&v, 4); }
static void append_64(uint64_t v) { append(&v, 8); }

// Numbers of a request, little-endian like the processor.
static uint16_t take_16(const uint8_t *p)
{
    uint16_t v;
    memcpy(&v, p, sizeof v);
    return v;
}
static uint32_t take_32(const uint8_t *p)
{
    uint32_t v;
    memcpy(&v, p, sizeof v);
    return v;
}

static void disarm(void)
{
    // A running train is completed; no new train starts.
    armed = false;
    sync_period = 0;
    PORTB &= (uint8_t)~_BV(PIN_ARMED);
}

static uint8_t hello(void)
{
    disarm();
    disarmed_by_silence = false;
    mark_number = 0;
    append_8(FIRMWARE_MAJOR);
    append_8(FIRMWARE_MINOR);
    append_8(FIRMWARE_PATCH);
    append_8(TICKS_PER_US);
    char serial[SERIAL_MAX];
    uint8_t length = store_serial(serial);
    append_8(length);
    append(serial, length);
    append_8(sizeof BOX_NAME - 1);
    append(BOX_NAME, sizeof BOX_NAME - 1);
    return RESULT_OK;
}

static uint8_t arm(const uint8_t *p, uint8_t n)
{
    if (n != 2)
        return RESULT_BAD_ARGUMENT;
    silence_ticks = (uint64_t)take_16(p) * TICKS_PER_MS;
    disarmed_by_silence = false;
    armed = true;
    PORTB |= _BV(PIN_ARMED);
    return RESULT_OK;
}

static uint8_t mark(const uint8_t *p, uint8_t n)
{
    if (n != 8)
        return RESULT_BAD_ARGUMENT;
    uint32_t number = take_32(p), data = take_32(p + 4), kind = data >> PRESS_BITS;
    if (number == mark_number && number != 0) {
        append_64(mark_start);
        return RESULT_OK;
    }
    if (number != mark_number + 1)
        return RESULT_OUT_OF_ORDER;
    if (kind == 0 || kind >= SYNC_CODE)
        return RESULT_BAD_ARGUMENT;
    if (!armed)
        return RESULT_NOT_ARMED;
    if (!train_mark(data, &mark_start))
        return RESULT_BUSY;
    mark_number = number;
    append_64(mark_start);
    return RESULT_OK;
}

static uint8_t sync(const uint8_t *p, uint8_t n)
{
    if (n != 6)
        return RESULT_BAD_ARGUMENT;
    uint16_t period_ms = take_16(p);
    if (period_ms != 0 && period_ms * 1000UL < 2 * TRAIN_US)
        return RESULT_BAD_ARGUMENT;
    if (period_ms != 0 && !armed)
        return RESULT_NOT_ARMED;
    sync_period = (uint64_t)period_ms * TICKS_PER_MS;
    sync_due = clock_now() + sync_period;
    sync_count = take_32(p + 2);
    return RESULT_OK;
}

static uint8_t events(const uint8_t *p, uint8_t n)
{
    if (n != 4)
        return RESULT_BAD_ARGUMENT;
    events_forget(take_32(p));
    uint32_t first = events_oldest(), next = events_next();
    append_16(events_dropped());
    append_32(next);
    append_32(first);
    uint8_t count = next - first < EVENTS_PER_REPLY ? (uint8_t)(next - first) : EVENTS_PER_REPLY;
    append_8(count);
    for (uint8_t i = 0; i < count; ++i) {
        struct event e;
        events_get(first + i, &e);
        append_32(e.code | (uint32_t)e.kind << 24);
        append_64(e.ticks);
    }
    return RESULT_OK;
}

static uint8_t flags_now(void)
{
    uint8_t flags = 0;
    if (armed)
        flags |= FLAG_ARMED;
    if (sync_period)
        flags |= FLAG_SYNC;
    if (train_under_way())
        flags |= FLAG_TRAIN;
    if (disarmed_by_silence)
        flags |= FLAG_DISARMED_BY_SILENCE;
    if (input_high())
        flags |= FLAG_INPUT_HIGH;
    return flags;
}

static uint8_t status(void)
{
    struct train_counts trains;
    struct input_counts inputs;
    struct link_counts link;
    train_count(&trains);
    input_count(&inputs);
    link_count(&link);
    append_8(reset_cause);
    append_32(trains.marks);
    append_32(trains.syncs);
    append_32(inputs.edges);
    append_16(trains.late_edges);
    append_16(inputs.glitches);
    append_16(events_dropped());
    append_16(link.bad_checksums);
    append_16(link.bad_frames);
    append_16(link.overruns);
    append_16(inputs.ignored);
    append_16(inputs.mutes);
    return RESULT_OK;
}

static uint8_t self_test(void)
{
    if (!armed)
        return RESULT_NOT_ARMED;
    if (train_under_way())
        return RESULT_BUSY;
    append_8(train_self_test());
    return RESULT_OK;
}

static uint8_t set_serial(const uint8_t *p, uint8_t n)
{
    if (armed)
        return RESULT_ARMED;
    if (n == 0 || n > SERIAL_MAX)
        return RESULT_BAD_ARGUMENT;
    for (uint8_t i = 0; i < n; ++i)
        if (p[i] <= ' ' || p[i] > '~')
            return RESULT_BAD_ARGUMENT;
    store_set_serial((const char *)p, n);
    return RESULT_OK;
}

static uint8_t carry_out(uint8_t command, const uint8_t *p, uint8_t n)
{
    switch (command) {
    case COMMAND_HELLO: return hello();
    case COMMAND_ARM: return arm(p, n);
    case COMMAND_DISARM: disarm(); return RESULT_OK;
    case COMMAND_MARK: return mark(p, n);
    case COMMAND_SYNC: return sync(p, n);
    case COMMAND_EVENTS: return events(p, n);
    case COMMAND_STATUS: return status();
    case COMMAND_SELF_TEST: return self_test();
    case COMMAND_TIME: return RESULT_OK;
    case COMMAND_SET_SERIAL: return set_serial(p, n);
    default: return RESULT_UNKNOWN_COMMAND;
    }
}

// A request: version, command, number (2), arguments. A reply: version, command | 0x80, number (2), result, flags, boot
// (2), clock (8), answers.
static void answer(const uint8_t *body, uint8_t length)
{
    enum { HEAD = 4, RESULT_AT = 4, FLAGS_AT = 5 };
    if (length < HEAD)
        return;
    uint64_t now = clock_now();
    heard = now;
    uint8_t version = body[0], command = body[1];
    reply_length = 0;
    append_8(PROTOCOL_VERSION);
    append_8(command | REPLY);
    append(body + 2, 2);
    append_8(RESULT_OK);
    append_8(0);
    append_16(boot);
    append_64(now);
    uint8_t head = reply_length;
    uint8_t result = RESULT_BAD_VERSION;
    if (version == PROTOCOL_VERSION || command == COMMAND_HELLO)
        result = carry_out(command, body + HEAD, length - HEAD);
    if (result != RESULT_OK)
        reply_length = head;
    reply[RESULT_AT] = result;
    reply[FLAGS_AT] = flags_now();
    link_send(reply, reply_length);
}

static void keep_schedule(void)
{
    uint64_t now = clock_now();
    if (armed && silence_ticks && now - heard > silence_ticks) {
        disarm();
        disarmed_by_silence = true;
    }
    if (sync_period && now >= sync_due && train_sync(sync_count)) {
        ++sync_count;
        sync_due += sync_period;
        if (sync_due <= now) // late by more than a period: skip the missed trains
            sync_due = now + sync_period;
    }
}

int main(void)
{
    DDRB |= _BV(PIN_ARMED);
    boot = store_count_boot();
    link_setup();
    clock_start();
    train_setup();
    input_setup();
    set_sleep_mode(SLEEP_MODE_IDLE);
    wdt_enable(WDTO_500MS);
    sei();
    for (;;) {
        wdt_reset();
        const uint8_t *body;
        uint8_t length = link_receive(&body);
        if (length)
            answer(body, length);
        keep_schedule();
        input_tend();
        // Until the next interrupt: a byte, an edge, or the clock's overflow after 4 ms at most. `sei` takes effect
        // after the instruction that follows it, so that no interrupt runs between the check and the sleep.
        cli();
        if (!link_pending()) {
            sleep_enable();
            sei();
            sleep_cpu();
            sleep_disable();
        }
        sei();
    }
}
