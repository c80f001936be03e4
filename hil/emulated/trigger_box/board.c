// The board around the trigger box's firmware: an ATmega328P of libsimavr whose UART is a pseudo-terminal and whose pins
// are a Unix socket.
//
//   board FIRMWARE.elf PORT SOCKET [--free] [--ppm X] [--serial TEXT]
//
// PORT becomes a symbolic link to the pseudo-terminal, SOCKET a listening socket of lines; the README tells what they
// say. The board keeps pace with the host's monotonic clock, or runs as fast as it can with --free; --ppm makes its
// clock fast or slow. It ends when its standard input does.
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <pty.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/un.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#define FREQUENCY 16000000UL
// The host is looked at once each slice of emulated time: 200 us.
#define SLICE 3200
#define CONTROL_SLICES 5
#define FIRST_PIN 0
#define LAST_PIN 3
#define INPUT_PIN 0
#define MAX_CLIENTS 8

static avr_t *avr;
static const char *port_path, *socket_path;
static bool free_running;
static double cycles_per_ns;
static int64_t start_ns;

static void die(const char *what)
{
    fprintf(stderr, "board: %s: %s\n", what, strerror(errno));
    exit(1);
}

// ---------------------------------------------------------------------------------------------------------- time

static int64_t host_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static avr_cycle_count_t cycle_at(int64_t ns)
{
    return (avr_cycle_count_t)((double)(ns - start_ns) * cycles_per_ns);
}

static int64_t ns_at(avr_cycle_count_t cycle)
{
    return start_ns + (int64_t)((double)cycle / cycles_per_ns);
}

static void sleep_until(int64_t ns)
{
    struct timespec t = {.tv_sec = ns / 1000000000, .tv_nsec = ns % 1000000000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) == EINTR)
        ;
}

// --------------------------------------------------------------------------------------------------------- noise

// Chances per byte, in parts per million.
static struct {
    uint64_t state;
    uint32_t flip, drop, insert;
} noise;
static struct {
    unsigned long flipped, dropped, inserted;
} noise_done;

static uint64_t noise_next(void)
{
    // splitmix64 (Steele, Lea, Flood 2014)
    uint64_t z = noise.state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
}

static bool strikes(uint32_t ppm)
{
    return ppm && noise_next() % 1000000 < ppm;
}

// Passes one byte through the noise; up to two bytes come out.
static int spoil(uint8_t byte, uint8_t out[2])
{
    int n = 0;
    if (strikes(noise.insert)) {
        out[n++] = (uint8_t)noise_next();
        ++noise_done.inserted;
    }
    if (strikes(noise.drop)) {
        ++noise_done.dropped;
        return n;
    }
    if (strikes(noise.flip)) {
        byte ^= (uint8_t)(1u << noise_next() % 8);
        ++noise_done.flipped;
    }
    out[n++] = byte;
    return n;
}

// ---------------------------------------------------------------------------------------------------------- UART

static int master = -1; // -1: unplugged
static bool uart_full;
static avr_irq_t *uart_input;

// Bytes on their way to the box, each with the cycle before which it must not arrive.
#define QUEUE 4096 // a power of two
static struct {
    avr_cycle_count_t due;
    uint8_t byte;
} queue[QUEUE];
static unsigned queue_head, queue_tail;

static void plug_port(void)
{
    int slave;
    char name[256], link[4096];
    struct termios t;
    if (openpty(&master, &slave, name, NULL, NULL))
        die("openpty");
    tcgetattr(slave, &t);
    cfmakeraw(&t);
    tcsetattr(slave, TCSANOW, &t);
    close(slave);
    fcntl(master, F_SETFL, O_NONBLOCK);
    snprintf(link, sizeof link, "%s.new", port_path);
    unlink(link);
    if (symlink(name, link) || rename(link, port_path))
        die(port_path);
}

static void unplug_port(void)
{
    unlink(port_path);
    if (master >= 0)
        close(master);
    master = -1;
    queue_head = queue_tail = 0;
}

static void uart_sent(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)param;
    uint8_t out[2];
    int n = spoil((uint8_t)value, out);
    // Nobody there, or nobody reading: lost, as on a real line.
    if (master >= 0 && n && write(master, out, n) < 0)
        return;
}

static void uart_ready(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)value, (void)param;
    uart_full = false;
}

static void uart_stop(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)param;
    uart_full = value;
}

static void take_bytes(void)
{
    uint8_t bytes[256], out[2];
    if (master < 0 || queue_head - queue_tail > QUEUE - 2 * sizeof bytes)
        return;
    ssize_t got = read(master, bytes, sizeof bytes);
    // Not before the host sent it: the emulation may lag behind.
    avr_cycle_count_t due = free_running ? avr->cycle : cycle_at(host_ns());
    for (ssize_t i = 0; i < got; ++i) {
        int n = spoil(bytes[i], out);
        for (int k = 0; k < n; ++k, ++queue_head) {
            queue[queue_head % QUEUE].byte = out[k];
            queue[queue_head % QUEUE].due = due;
        }
    }
}

static void give_bytes(void)
{
    while (queue_tail != queue_head && !uart_full && queue[queue_tail % QUEUE].due <= avr->cycle)
        avr_raise_irq(uart_input, queue[queue_tail++ % QUEUE].byte);
}

// ------------------------------------------------------------------------------------------------------- control

static struct client {
    int fd;
    bool wants_edges, wants_times;
    char in[256];
    size_t in_length;
    char out[65536];
    size_t out_length;
} clients[MAX_CLIENTS];
static int listener;

static void leave(struct client *c)
{
    close(c->fd);
    c->fd = -1;
}

static void flush_client(struct client *c)
{
    size_t done = 0;
    while (c->fd >= 0 && done < c->out_length) {
        ssize_t n = send(c->fd, c->out + done, c->out_length - done, MSG_NOSIGNAL);
        if (n > 0)
            done += (size_t)n;
        else if (n < 0 && errno != EINTR)
            leave(c); // gone, or it has read nothing for seconds
    }
    c->out_length = 0;
}

__attribute__((format(printf, 2, 3))) static void tell(struct client *c, const char *format, ...)
{
    if (c->fd < 0)
        return;
    if (c->out_length + 256 > sizeof c->out)
        flush_client(c);
    va_list args;
    va_start(args, format);
    c->out_length += (size_t)vsnprintf(c->out + c->out_length, 256, format, args);
    va_end(args);
}

static void tell_edge(int pin, int level)
{
    for (struct client *c = clients; c < clients + MAX_CLIENTS; ++c)
        if (c->fd >= 0 && c->wants_edges)
            tell(c, "edge %llu %d %d\n", (unsigned long long)avr->cycle, pin, level);
}

// No later edge comes before this cycle.
static void tell_time(avr_cycle_count_t cycle)
{
    for (struct client *c = clients; c < clients + MAX_CLIENTS; ++c)
        if (c->fd >= 0 && c->wants_times)
            tell(c, "at %llu\n", (unsigned long long)cycle);
}

// ---------------------------------------------------------------------------------------------------------- pins

static avr_irq_t *pins[LAST_PIN + 1];
static int levels[LAST_PIN + 1];

// The spare output wired to the input, through something slow: cycles of delay, 0 for no wire.
static avr_cycle_count_t loop_delay;
static void plan(avr_cycle_count_t cycle, int level);

static void pin_changed(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    int pin = (int)(intptr_t)param, level = value & 1;
    if (levels[pin] != level) {
        levels[pin] = level;
        tell_edge(pin, level);
        if (pin == LAST_PIN && loop_delay)
            plan(avr->cycle + loop_delay, level);
    }
}

static void drive_input(int level)
{
    // simavr applies the pull of an input at each write to its port.
    avr_ioport_external_t external = {.name = 'B', .mask = 1 << INPUT_PIN, .value = level << INPUT_PIN};
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('B'), &external);
    avr_raise_irq(pins[INPUT_PIN], level);
}

// Levels that the input will take.
#define PLANNED 4096
static struct {
    avr_cycle_count_t cycle;
    int level;
} planned[PLANNED];
static unsigned planned_head, planned_tail;

static avr_cycle_count_t planned_due(avr_t *a, avr_cycle_count_t when, void *param)
{
    (void)when, (void)param;
    while (planned_tail != planned_head && planned[planned_tail % PLANNED].cycle <= a->cycle)
        drive_input(planned[planned_tail++ % PLANNED].level);
    return planned_tail == planned_head ? 0 : planned[planned_tail % PLANNED].cycle;
}

static void arm_planned(void)
{
    if (planned_tail == planned_head)
        return;
    avr_cycle_count_t due = planned[planned_tail % PLANNED].cycle;
    avr_cycle_timer_register(avr, due > avr->cycle ? due - avr->cycle : 1, planned_due, NULL);
}

static bool plan_is_full(void)
{
    return planned_head - planned_tail == PLANNED;
}

static void plan(avr_cycle_count_t cycle, int level)
{
    if (plan_is_full())
        return;
    planned[planned_head % PLANNED].cycle = cycle;
    planned[planned_head++ % PLANNED].level = level;
    arm_planned();
}

// --------------------------------------------------------------------------------------------------------- power

enum { NO_RESET, RESET_POWER, RESET_BROWN_OUT, RESET_BUTTON };
static int wanted_reset;
static bool powered = true;

static avr_cycle_count_t look_around(avr_t *a, avr_cycle_count_t when, void *param);

static void outputs_fall(void)
{
    for (int pin = FIRST_PIN; pin <= LAST_PIN; ++pin)
        if (pin != INPUT_PIN)
            avr_raise_irq(pins[pin], 0); // an output without a driver is pulled low
}

// What a reset takes from the board around the processor.
static void start_over(void)
{
    queue_tail = queue_head;
    uart_full = false;
    drive_input(levels[INPUT_PIN]);
    avr_cycle_timer_register(avr, SLICE, look_around, NULL);
    arm_planned();
}

static void reset(int cause)
{
    outputs_fall();
    avr_reset(avr);
    if (cause == RESET_POWER)
        avr_regbit_set(avr, avr->reset_flags.porf);
    else if (cause == RESET_BROWN_OUT)
        avr_regbit_set(avr, avr->reset_flags.borf);
    else
        avr_regbit_set(avr, avr->reset_flags.extrf);
    start_over();
}

// A firmware that hangs: the instruction that comes next is a jump to itself until the next reset.
static bool wanted_hang;
static bool hung;
static avr_flashaddr_t hung_at;
static uint8_t hung_instruction[2];

static void hang(void)
{
    static const uint8_t jump_to_itself[2] = {0xff, 0xcf};
    hung = true;
    hung_at = avr->pc;
    memcpy(hung_instruction, avr->flash + hung_at, 2);
    memcpy(avr->flash + hung_at, jump_to_itself, 2);
}

static void mend(void)
{
    if (hung)
        memcpy(avr->flash + hung_at, hung_instruction, 2);
    hung = false;
}

// ------------------------------------------------------------------------------------------------------ commands

static void obey(struct client *c, char *line)
{
    unsigned long long cycle;
    unsigned seed, flip, drop, insert;
    int level;
    char word[16];
    if (!strcmp(line, "subscribe")) {
        c->wants_edges = true;
    } else if (!strcmp(line, "times")) {
        c->wants_times = true;
    } else if (!strcmp(line, "cycle")) {
        ; // the answer tells it
    } else if (!strcmp(line, "clock")) {
        tell(c, "clock %lld %.17g %s\n", (long long)start_ns, cycles_per_ns, free_running ? "free" : "paced");
        return;
    } else if (sscanf(line, "input %d %llu", &level, &cycle) == 2 && (level == 0 || level == 1)) {
        bool in_order = planned_head == planned_tail || planned[(planned_head - 1) % PLANNED].cycle < cycle;
        if (plan_is_full() || !in_order) {
            tell(c, "error too many planned edges, or not in order: %s\n", line);
            return;
        }
        plan(cycle, level);
    } else if (sscanf(line, "input %d", &level) == 1 && (level == 0 || level == 1)) {
        drive_input(level);
    } else if (sscanf(line, "loop %llu", &cycle) == 1) {
        loop_delay = cycle;
        drive_input(cycle ? levels[LAST_PIN] : 1);
    } else if (sscanf(line, "noise %u %u %u %u", &seed, &flip, &drop, &insert) == 4) {
        noise.state = seed;
        noise.flip = flip;
        noise.drop = drop;
        noise.insert = insert;
        tell(c, "ok %llu flipped %lu dropped %lu inserted %lu\n", (unsigned long long)avr->cycle, noise_done.flipped,
             noise_done.dropped, noise_done.inserted);
        return;
    } else if (!strcmp(line, "unplug") && powered) {
        unplug_port();
        powered = false;
        outputs_fall();
    } else if (!strcmp(line, "plug") && !powered) {
        plug_port();
        powered = true;
        wanted_reset = RESET_POWER;
    } else if (sscanf(line, "reset %15s", word) == 1 && !strcmp(word, "brown-out")) {
        wanted_reset = RESET_BROWN_OUT;
    } else if (sscanf(line, "reset %15s", word) == 1 && !strcmp(word, "button")) {
        wanted_reset = RESET_BUTTON;
    } else if (!strcmp(line, "hang") && powered && !hung) {
        wanted_hang = true;
    } else {
        tell(c, "error not understood: %s\n", line);
        return;
    }
    tell(c, "ok %llu\n", (unsigned long long)avr->cycle);
}

static void listen_to_clients(void)
{
    int fd = accept(listener, NULL, NULL);
    if (fd >= 0) {
        struct client *c = clients;
        while (c < clients + MAX_CLIENTS && c->fd >= 0)
            ++c;
        if (c == clients + MAX_CLIENTS) {
            close(fd);
        } else {
            struct timeval patience = {.tv_sec = 5};
            setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
            *c = (struct client){.fd = fd};
        }
    }
    for (struct client *c = clients; c < clients + MAX_CLIENTS; ++c) {
        if (c->fd < 0)
            continue;
        ssize_t n = recv(c->fd, c->in + c->in_length, sizeof c->in - 1 - c->in_length, MSG_DONTWAIT);
        if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) {
            leave(c);
            continue;
        }
        if (n > 0)
            c->in_length += (size_t)n;
        c->in[c->in_length] = 0;
        for (char *end; (end = strchr(c->in, '\n'));) {
            *end = 0;
            obey(c, c->in);
            c->in_length -= (size_t)(end + 1 - c->in);
            memmove(c->in, end + 1, c->in_length + 1);
        }
        if (c->in_length == sizeof c->in - 1)
            leave(c); // a line without end
        else
            flush_client(c);
    }
    char byte;
    if (read(STDIN_FILENO, &byte, 1) == 0) {
        unlink(port_path);
        unlink(socket_path);
        exit(0);
    }
}

// Once each slice: keep pace, exchange bytes, listen.
static avr_cycle_count_t look_around(avr_t *a, avr_cycle_count_t when, void *param)
{
    (void)param;
    static unsigned slices;
    if (!free_running) {
        // The slice to come is over on the host's clock before it begins here: the box is never ahead.
        int64_t end = ns_at(when + SLICE);
        if (host_ns() < end)
            sleep_until(end);
    }
    take_bytes();
    give_bytes();
    if (++slices % CONTROL_SLICES == 0) {
        listen_to_clients();
        tell_time(a->cycle);
    }
    for (struct client *c = clients; c < clients + MAX_CLIENTS; ++c)
        if (c->fd >= 0 && c->out_length)
            flush_client(c);
    return when + SLICE;
}

static void no_sleep(avr_t *a, avr_cycle_count_t how_long)
{
    (void)a, (void)how_long;
}

// --------------------------------------------------------------------------------------------------------- start

// The layout of `struct stored` in the firmware's store.c.
static void set_serial(const char *serial)
{
    uint8_t image[19];
    memset(image, 0xff, sizeof image);
    size_t length = strlen(serial);
    if (length == 0 || length > 16) {
        fprintf(stderr, "board: expected a serial number of 1 to 16 characters, found \"%s\"\n", serial);
        exit(2);
    }
    image[2] = (uint8_t)length;
    memcpy(image + 3, serial, length);
    avr_eeprom_desc_t desc = {.ee = image, .offset = 0, .size = sizeof image};
    avr_ioctl(avr, AVR_IOCTL_EEPROM_SET, &desc);
}

static void open_socket(void)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(socket_path) >= sizeof address.sun_path) {
        fprintf(stderr, "board: the path of the socket is too long: %s\n", socket_path);
        exit(2);
    }
    strcpy(address.sun_path, socket_path);
    unlink(socket_path);
    listener = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (listener < 0 || bind(listener, (struct sockaddr *)&address, sizeof address) || listen(listener, MAX_CLIENTS))
        die(socket_path);
}

int main(int argc, char **argv)
{
    const char *serial = NULL;
    double ppm = 0;
    if (argc < 4) {
        fprintf(stderr, "usage: board FIRMWARE.elf PORT SOCKET [--free] [--ppm X] [--serial TEXT]\n");
        return 2;
    }
    port_path = argv[2];
    socket_path = argv[3];
    for (int i = 4; i < argc; ++i) {
        if (!strcmp(argv[i], "--free"))
            free_running = true;
        else if (!strcmp(argv[i], "--ppm") && i + 1 < argc)
            ppm = atof(argv[++i]);
        else if (!strcmp(argv[i], "--serial") && i + 1 < argc)
            serial = argv[++i];
        else {
            fprintf(stderr, "board: not understood: %s\n", argv[i]);
            return 2;
        }
    }
    signal(SIGPIPE, SIG_IGN);
    prctl(PR_SET_TIMERSLACK, 1UL);
    for (struct client *c = clients; c < clients + MAX_CLIENTS; ++c)
        c->fd = -1;

    elf_firmware_t firmware = {0};
    if (elf_read_firmware(argv[1], &firmware))
        die(argv[1]);
    avr = avr_make_mcu_by_name("atmega328p");
    if (!avr)
        die("atmega328p");
    avr_init(avr);
    firmware.frequency = FREQUENCY;
    avr_load_firmware(avr, &firmware);
    avr->sleep = no_sleep;
    if (serial)
        set_serial(serial);

    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(uint32_t)(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    uart_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), uart_sent, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), uart_ready, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), uart_stop, NULL);
    for (int pin = FIRST_PIN; pin <= LAST_PIN; ++pin) {
        pins[pin] = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), pin);
        avr_irq_register_notify(pins[pin], pin_changed, (void *)(intptr_t)pin);
    }

    fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    open_socket();
    plug_port();
    cycles_per_ns = FREQUENCY * 1e-9 * (1 + ppm * 1e-6);
    start_ns = host_ns();
    levels[INPUT_PIN] = 1; // an open contact under the box's pull-up
    reset(RESET_POWER);
    printf("ready\n");
    fflush(stdout);

    void (*const run)(avr_t *) = avr->run;
    for (;;) {
        if (!powered) {
            sleep_until(host_ns() + 1000000);
            listen_to_clients();
            if (!free_running)
                tell_time(cycle_at(host_ns()));
            for (struct client *c = clients; c < clients + MAX_CLIENTS; ++c)
                if (c->fd >= 0 && c->out_length)
                    flush_client(c);
            continue;
        }
        if (wanted_reset) {
            // Time went on while there was no power.
            avr_cycle_count_t now = free_running ? avr->cycle : cycle_at(host_ns());
            if (now > avr->cycle)
                avr->cycle = now;
            mend();
            reset(wanted_reset);
            wanted_reset = NO_RESET;
        }
        if (wanted_hang) {
            hang();
            wanted_hang = false;
        }
        // The watchdog struck: simavr will reset the processor instead of running it, and takes all timers with it.
        bool watchdog = avr->run != run;
        int state = avr_run(avr);
        if (watchdog) {
            mend();
            outputs_fall();
            start_over();
        }
        if (state == cpu_Done || state == cpu_Crashed) {
            fprintf(stderr, "board: the processor stopped at %#x\n", avr->pc);
            return 1;
        }
    }
}
