/* avr_board: runs the image of an AVR board, instruction by instruction (libsimavr), and gives its line to others.
 *
 *     avr_board [--usb] [--flat-out] [--memory FILE] [--link PATH] MCU IMAGE.elf
 *         The line is a pseudo-terminal; prints "ready PATH" and runs until SIGTERM or SIGINT, no faster than time goes by
 *         (--flat-out: as fast as it can). --usb: the line is the USB port of an ATmega32U4, enumerated here as a computer
 *         does it; otherwise UART 0.
 *     avr_board [--usb] [--memory FILE] --script FILE MCU IMAGE.elf
 *         The line is a script, in the board's own time: a line "US HEX..." sends these bytes from that microsecond on, at
 *         the rate the board has set; "US low PIN..." connects these pins of the chip to ground from then on, "US open
 *         PIN..." no longer; "US stop" ends the run, "US off" cuts the power there. Prints "US HEX" for each byte that the
 *         board sends: the moment it is whole on the line. The same run gives the same output, to the cycle.
 *     avr_board --controller trio|mpc ...
 *         A board that is a bridge: UART 1 goes to an emulated controller (avr_controller.h). In a script "US hang" lets the
 *         program stand still for 0.2 s, "US flip HEX..." flips a bit in RAM, where these bytes are found first. "US sweep UNTIL
 *         STEP WHAT", where WHAT is bytes or "open PIN...", lets WHAT happen at each instant from US to UNTIL, STEP apart, each
 *         time to a copy of the board, and prints "INSTANT ^C after US" for the first ^C that the copy sends to the
 *         controller ("never": within 50 ms none). To the board itself nothing happens.
 *     avr_board --program MCU IMAGE.elf
 *         Runs a program to its end (sleep without interrupts); prints what it writes to UART 0; exits with its GPIOR0.
 *
 * --low PIN...: these pins of the chip are connected to ground from the start; D2E4 is bit 2 of port D and bit 4 of port E.
 * --watch PIN...: in a script's run, prints "US PIN LEVEL" for each change of these pins, which the board drives.
 * --memory FILE: the EEPROM, read at the start, written at the end. At the end says on stderr how deep the stack was. */
#define _DEFAULT_SOURCE /* openpty, cfmakeraw */
#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "avr_controller.h"

#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/avr_usb.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_interrupts.h>
#include <simavr/sim_irq.h>

#define HZ 16000000u
#define SLICE_CYCLES 8000u  /* 0.5 ms between looks at the outside */
#define FRAME_CYCLES 16000u /* a USB frame, 1 ms */
#define SCRIPT_LINE 4096u

static avr_t *avr;
static bool ended;
static unsigned deepest_sp = 0xFFFF;
static volatile sig_atomic_t stopped;

static void stop(int number)
{
    (void)number;
    stopped = 1;
}

static void fail(const char *what)
{
    (void)fprintf(stderr, "avr_board: %s%s%s\n", what, errno != 0 ? ": " : "", errno != 0 ? strerror(errno) : "");
    exit(2);
}

/* -- A queue of bytes ---------------------------------------------------------------------------------------------- */

typedef struct {
    uint8_t bytes[65536];
    size_t first, count;
} queue;

static void put(queue *q, uint8_t byte)
{
    if (q->count == sizeof q->bytes) {
        errno = 0;
        fail("a queue is full");
    }
    q->bytes[(q->first + q->count++) % sizeof q->bytes] = byte;
}

static uint8_t take(queue *q)
{
    const uint8_t byte = q->bytes[q->first];
    q->first = (q->first + 1) % sizeof q->bytes;
    q->count--;
    return byte;
}

static queue to_board, from_board;
static bool is_scripted;

static void board_sends(uint8_t byte)
{
    if (is_scripted)
        (void)printf("%llu %02x\n", (unsigned long long)(avr->cycle / CYCLES_PER_US), byte);
    else
        put(&from_board, byte);
}

/* -- UART 0 -------------------------------------------------------------------------------------------------------- */

static avr_irq_t *uart_input;
static bool uart_takes = true;

static void uart_push(void)
{
    while (uart_takes && to_board.count > 0)
        avr_raise_irq(uart_input, take(&to_board));
}

static void uart_output(avr_irq_t *irq, uint32_t value, void *unused)
{
    (void)irq;
    (void)unused;
    board_sends((uint8_t)value);
}

/* simavr's receiver has 64 bytes and says when it takes more; what comes regardless is lost. */
static void uart_flow(avr_irq_t *irq, uint32_t value, void *takes)
{
    (void)irq;
    (void)value;
    uart_takes = takes != NULL;
}

static void uart_begin(void)
{
    static char yes;
    uint32_t flags = 0;
    if (avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags) != 0)
        fail("this MCU has no UART 0");
    uart_input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), uart_output, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), uart_flow, &yes);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), uart_flow, NULL);
}

/* -- USB of the ATmega32U4 ----------------------------------------------------------------------------------------- */

enum { UDCON = 0xE0, UDINT = 0xE1, UDIEN = 0xE2, SOFI = 1 << 2, DETACH = 1 << 0, USB_GENERAL_VECTOR = 10 };
static bool is_usb, is_attached, is_open;
static avr_cycle_count_t next_frame = FRAME_CYCLES;
static uint8_t endpoint_in, endpoint_out;

static void usb_attach(avr_irq_t *irq, uint32_t value, void *unused)
{
    (void)irq;
    (void)unused;
    is_attached = value != 0;
}

/* The start of a frame: simavr 1.6 leaves it out, and Arduino's core sends what it has by it. */
static void usb_frame(void)
{
    if (!is_attached || (avr->data[UDCON] & DETACH) != 0)
        return;
    avr->data[UDINT] |= SOFI;
    if ((avr->data[UDIEN] & SOFI) == 0)
        return;
    for (int i = 0; i < avr->interrupts.vector_count; i++)
        if (avr->interrupts.vector[i]->vector == USB_GENERAL_VECTOR)
            avr_raise_interrupt(avr, avr->interrupts.vector[i]);
}

/* -- Running ------------------------------------------------------------------------------------------------------- */

static void run_until(avr_cycle_count_t end)
{
    while (avr->cycle < end && !ended) {
        if (is_usb && avr->cycle >= next_frame) {
            next_frame += FRAME_CYCLES;
            usb_frame();
        }
        const int state = avr_run(avr);
        const unsigned sp = (unsigned)(avr->data[R_SPL] | avr->data[R_SPH] << 8);
        if (sp < deepest_sp && sp > 0x100 && avr->cycle > 1000) /* the start-up code sets it in two steps */
            deepest_sp = sp;
        ended = state == cpu_Done || state == cpu_Crashed;
    }
}

static void run(avr_cycle_count_t cycles) { run_until(avr->cycle + cycles); }

/* -- USB: what a computer does ------------------------------------------------------------------------------------- */

/* NOLINTNEXTLINE(readability-non-const-parameter): a packet is read or written there */
static int transfer(uint32_t what, uint8_t endpoint, uint8_t *bytes, uint32_t *count)
{
    for (int i = 0; i < 400 && !ended; i++) {
        struct avr_io_usb packet = {endpoint, *count, bytes};
        const int result = avr_ioctl(avr, what, &packet);
        if (result != AVR_IOCTL_USB_NAK) {
            *count = packet.sz;
            return result;
        }
        run(400);
    }
    return -1;
}

/* A control transfer. Returns how many bytes there were, or ends the program: this board's USB does not work. */
static uint32_t control(uint8_t type, uint8_t request, uint16_t value, uint16_t index, uint8_t *data, uint16_t length)
{
    uint8_t setup[8] = {type,
                        request,
                        (uint8_t)value,
                        (uint8_t)(value >> 8),
                        (uint8_t)index,
                        (uint8_t)(index >> 8),
                        (uint8_t)length,
                        (uint8_t)(length >> 8)};
    uint32_t count = sizeof setup, got = 0, none = 0;
    const bool is_in = (type & 0x80) != 0;
    errno = 0;
    if (transfer(AVR_IOCTL_USB_SETUP, 0, setup, &count) != 0)
        fail("USB: a set-up packet was refused");
    run(1600);
    for (count = 64; got < length && count == 64; got += count) {
        count = length - got < 64 && !is_in ? length - got : 64;
        if (transfer(is_in ? AVR_IOCTL_USB_READ : AVR_IOCTL_USB_WRITE, 0, data + got, &count) != 0)
            fail("USB: a control transfer failed");
        run(800);
    }
    uint8_t empty[64];
    (void)transfer(is_in ? AVR_IOCTL_USB_WRITE : AVR_IOCTL_USB_READ, 0, empty, &none);
    run(1600);
    return got;
}

static void usb_line_state(bool open)
{
    if (open == is_open)
        return;
    (void)control(0x21, 0x22, open ? 3 : 0, 0, NULL, 0); /* SET_CONTROL_LINE_STATE: DTR and RTS */
    is_open = open;
}

static void usb_begin(void)
{
    uint8_t bytes[512], coding[7] = {0x00, 0xE1, 0, 0, 0, 0, 8}; /* 57600 8N1 */
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_USB_GETIRQ(), USB_IRQ_ATTACH), usb_attach, NULL);
    run(FRAME_CYCLES * 100u);
    errno = 0;
    if (!is_attached)
        fail("USB: the board did not attach");
    (void)avr_ioctl(avr, AVR_IOCTL_USB_RESET, NULL);
    run(FRAME_CYCLES * 10u);
    (void)control(0x80, 6, 0x0100, 0, bytes, 18);       /* device descriptor */
    (void)control(0x00, 5, 5, 0, NULL, 0);              /* SET_ADDRESS */
    (void)control(0x80, 6, 0x0302, 0x0409, bytes, 255); /* product string, UTF-16 */
    (void)fputs("avr_board: USB product: ", stderr);
    for (int i = 2; i < bytes[0]; i += 2)
        (void)fputc(bytes[i], stderr);
    (void)fputc('\n', stderr);
    (void)control(0x80, 6, 0x0200, 0, bytes, 9); /* configuration: its length first */
    const uint16_t length = (uint16_t)(bytes[2] | bytes[3] << 8);
    const uint32_t got = control(0x80, 6, 0x0200, 0, bytes, length < sizeof bytes ? length : (uint16_t)sizeof bytes);
    for (uint32_t i = 0; i + 3 < got && bytes[i] > 0; i += bytes[i])
        if (bytes[i + 1] == 5 && (bytes[i + 3] & 3) == 2) { /* a bulk endpoint */
            if ((bytes[i + 2] & 0x80) != 0)
                endpoint_in = bytes[i + 2];
            else
                endpoint_out = bytes[i + 2];
        }
    if (endpoint_in == 0 || endpoint_out == 0)
        fail("USB: no serial port in the configuration");
    (void)control(0x00, 9, 1, 0, NULL, 0);                  /* SET_CONFIGURATION */
    (void)control(0x21, 0x20, 0, 0, coding, sizeof coding); /* SET_LINE_CODING */
}

/* Up to one packet each way. */
static void usb_exchange(void)
{
    static uint8_t packet[64];
    static uint32_t waiting;
    while (waiting < sizeof packet && to_board.count > 0)
        packet[waiting++] = take(&to_board);
    if (waiting > 0) {
        struct avr_io_usb out = {endpoint_out, waiting, packet};
        if (avr_ioctl(avr, AVR_IOCTL_USB_WRITE, &out) == 0)
            waiting = 0;
    }
    uint8_t bytes[64];
    struct avr_io_usb in = {endpoint_in, sizeof bytes, bytes};
    if (avr_ioctl(avr, AVR_IOCTL_USB_READ, &in) == 0)
        for (uint32_t i = 0; i < in.sz; i++)
            board_sends(bytes[i]);
}

static void exchange(void)
{
    if (is_usb)
        usb_exchange();
    else
        uart_push();
    avr_controller_exchange();
}

/* -- The line as a pseudo-terminal --------------------------------------------------------------------------------- */

static double seconds(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static void serve(const char *link_path, bool flat_out)
{
    int master, slave;
    char name[128];
    struct termios raw;
    if (openpty(&master, &slave, name, NULL, NULL) != 0 || tcgetattr(slave, &raw) != 0)
        fail("no pseudo-terminal");
    cfmakeraw(&raw);
    if (tcsetattr(slave, TCSANOW, &raw) != 0 || fcntl(master, F_SETFL, O_NONBLOCK) != 0)
        fail(name);
    if (link_path != NULL && ((void)unlink(link_path), symlink(name, link_path) != 0))
        fail(link_path);
    if (is_usb)
        usb_line_state(true);
    (void)printf("ready %s\n", link_path != NULL ? link_path : name);
    (void)fflush(stdout);

    const double began = seconds();
    const avr_cycle_count_t first = avr->cycle;
    while (!stopped && !ended) {
        uint8_t bytes[256];
        run(is_usb ? FRAME_CYCLES / 8u : SLICE_CYCLES);
        if (to_board.count == 0) {
            const ssize_t count = read(master, bytes, sizeof bytes);
            for (ssize_t i = 0; i < count; i++)
                put(&to_board, bytes[i]);
        }
        exchange();
        while (from_board.count > 0 && write(master, &from_board.bytes[from_board.first], 1) == 1)
            (void)take(&from_board);
        const double ahead = (double)(avr->cycle - first) / HZ - (seconds() - began);
        if (ahead > 0 && !flat_out)
            (void)poll(NULL, 0, (int)(ahead * 1000.0) + 1);
    }
    if (link_path != NULL)
        (void)unlink(link_path);
    (void)close(slave);
    (void)close(master);
}

/* -- Pins ------------------------------------------------------------------------------------------------------------ */

static uint8_t grounded[128]; /* by the port's letter */
static char nothing[] = "", *watched = nothing;

/* Connects the pins that are named there to ground, or leaves them to their pull-ups. */
static void connect_pins(const char *pins, bool to_ground)
{
    while (*pins == ' ')
        pins++;
    for (; pins[0] >= 'A' && pins[0] <= 'L' && pins[1] >= '0' && pins[1] <= '7'; pins += 2) {
        const uint32_t port = (uint8_t)pins[0], bit = (uint8_t)(pins[1] - '0');
        const uint8_t mask = (uint8_t)(1u << bit);
        grounded[port] = (uint8_t)(to_ground ? grounded[port] | mask : grounded[port] & ~mask);
        avr_ioport_external_t ground = {.name = port & 0x7F, .mask = grounded[port], .value = 0};
        (void)avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), &ground);
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), (int)bit), to_ground ? 0 : 1);
    }
    errno = 0;
    if (*pins != '\0' && *pins != '\n')
        fail("a pin is a port's letter and a bit, such as D2");
}

static void pin_changes(avr_irq_t *irq, uint32_t value, void *name)
{
    if (irq->value != value)
        (void)printf("%llu %.2s %u\n", (unsigned long long)(avr->cycle / CYCLES_PER_US), (const char *)name,
                     value & 1u);
}

static void watch_pins(void)
{
    for (char *pins = watched; pins[0] != '\0' && pins[1] != '\0'; pins += 2) {
        const uint32_t port = (uint8_t)pins[0];
        avr_irq_t *pin = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), pins[1] - '0');
        avr_irq_register_notify(pin, pin_changes, pins);
    }
}

/* simavr forgets the pull-ups at a reset. */
static void pull_up_pins(void)
{
    for (char port = 'A'; port <= 'L'; port++)
        for (char bit = '0'; bit <= '7'; bit++) {
            const char name[] = {port, bit, '\0'};
            const uint32_t letter = (uint8_t)port;
            avr_irq_t *const irq = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(letter), bit - '0');
            if (irq != NULL && strstr(watched, name) == NULL && (grounded[(uint8_t)port] >> (bit - '0') & 1) == 0) {
                avr_raise_irq(irq, 0);
                avr_raise_irq(irq, 1);
            }
        }
}

/* -- The line as a script ------------------------------------------------------------------------------------------ */

static void play_until(avr_cycle_count_t when)
{
    while (avr->cycle < when && !ended) {
        run_until(avr->cycle + FRAME_CYCLES / 8u < when ? avr->cycle + FRAME_CYCLES / 8u : when);
        exchange();
    }
}

/* The instruction that comes next jumps to itself for a while. */
static void hang(void)
{
    uint8_t was[2], *const next = avr->flash + avr->pc;
    memcpy(was, next, sizeof was);
    const avr_flashaddr_t at = avr->pc;
    const avr_cycle_count_t end = avr->cycle + HZ / 5u;
    memcpy(next, "\xFF\xCF", sizeof was);
    while (avr->pc == at && avr->cycle < end)
        play_until(avr->cycle + 1);
    pull_up_pins();
    play_until(end);
    memcpy(next, was, sizeof was);
}

static size_t read_bytes(const char *text, uint8_t *bytes, size_t room)
{
    size_t count = 0;
    for (char *next; count < room; text = next) {
        const unsigned long byte = strtoul(text, &next, 16);
        if (next == text)
            break;
        bytes[count++] = (uint8_t)byte;
    }
    return count;
}

static void flip_bit(const char *text)
{
    uint8_t bytes[64];
    const size_t count = read_bytes(text, bytes, sizeof bytes);
    for (uint8_t *at = avr->data + avr->ioend + 1u; at + count <= avr->data + avr->ramend; at++)
        if (memcmp(at, bytes, count) == 0) {
            *at ^= 1u;
            return;
        }
    errno = 0;
    fail("RAM does not hold the bytes to flip");
}

static void send_to_board(const char *text)
{
    uint8_t bytes[SCRIPT_LINE / 2u];
    const size_t count = read_bytes(text, bytes, sizeof bytes);
    for (size_t i = 0; i < count; i++)
        put(&to_board, bytes[i]);
    exchange();
}

/* -- The same move, stopped at each of many instants ----------------------------------------------------------------- */

static avr_cycle_count_t asked; /* in a copy */

/* Past stdio, whose buffer holds what the copy has printed otherwise. */
static void tell_stop(const char *after, unsigned long long us)
{
    char text[64];
    const int length =
        snprintf(text, sizeof text, "%llu ^C %s %llu\n", (unsigned long long)(asked / CYCLES_PER_US), after, us);
    _exit(write(STDOUT_FILENO, text, (size_t)length) == length ? 0 : 2);
}

static void to_controller(avr_irq_t *irq, uint32_t byte, void *unused)
{
    (void)irq;
    (void)unused;
    if (asked != 0 && byte == 0x03)
        tell_stop("after", (avr->cycle - asked) / CYCLES_PER_US);
}

static void join_copy(void)
{
    int status;
    errno = 0;
    if (wait(&status) < 0 || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        fail("a copy of the board failed");
}

static void sweep(const char *text, avr_cycle_count_t from)
{
    enum { AT_ONCE = 2 };
    char *what;
    const avr_cycle_count_t until = strtoull(text, &what, 10) * CYCLES_PER_US,
                            step = strtoull(what, &what, 10) * CYCLES_PER_US;
    const char *const open = strstr(what, "open");
    unsigned copies = 0;
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('1'), UART_IRQ_OUTPUT), to_controller, NULL);
    for (avr_cycle_count_t when = from; step > 0 && when < until && !ended; when += step) {
        play_until(when);
        (void)fflush(stdout);
        if (copies == AT_ONCE)
            join_copy();
        else
            copies++;
        const pid_t copy = fork();
        if (copy < 0)
            fail("fork");
        if (copy > 0)
            continue;
        asked = avr->cycle;
        if (open != NULL)
            connect_pins(open + strlen("open"), false);
        else
            send_to_board(what);
        play_until(asked + HZ / 20u);
        tell_stop("never", 0);
    }
    for (; copies > 0; copies--)
        join_copy();
}

static void play(FILE *script)
{
    char line[SCRIPT_LINE];
    if (is_usb)
        usb_line_state(true);
    while (!ended && fgets(line, sizeof line, script) != NULL) {
        char *rest;
        const avr_cycle_count_t when = strtoull(line, &rest, 10) * CYCLES_PER_US;
        if (rest == line)
            continue; /* a comment */
        play_until(when);
        if (strstr(rest, "stop") != NULL || strstr(rest, "off") != NULL)
            return;
        const char *const instants = strstr(rest, "sweep");
        if (instants != NULL) {
            sweep(instants + strlen("sweep"), when);
            continue;
        }
        char *low = strstr(rest, "low"), *open = strstr(rest, "open");
        if (low != NULL || open != NULL) {
            connect_pins(low != NULL ? low + strlen("low") : open + strlen("open"), low != NULL);
            continue;
        }
        const char *const flip = strstr(rest, "flip");
        if (flip != NULL) {
            flip_bit(flip + strlen("flip"));
            continue;
        }
        if (strstr(rest, "hang") != NULL) {
            hang();
            continue;
        }
        send_to_board(rest);
    }
    errno = 0;
    fail("the script has no end: it lacks a line 'US stop'");
}

/* -- Start and end ------------------------------------------------------------------------------------------------- */

__attribute__((format(printf, 3, 0))) static void quiet(avr_t *of, const int level, const char *format,
                                                        va_list arguments)
{
    (void)of;
    if (level <= LOG_ERROR)
        (void)vfprintf(stderr, format, arguments);
}

static uint8_t eeprom[8192];

static void memory(const char *path, bool save)
{
    avr_eeprom_desc_t all = {.ee = eeprom, .offset = 0, .size = (uint32_t)(avr->e2end + 1)};
    FILE *file = fopen(path, save ? "wb" : "rb");
    if (file == NULL && !save && errno == ENOENT)
        return;
    if (file == NULL)
        fail(path);
    if (save) {
        (void)avr_ioctl(avr, AVR_IOCTL_EEPROM_GET, &all);
        if (fwrite(all.ee, 1, all.size, file) != all.size)
            fail(path);
    } else if (fread(eeprom, 1, all.size, file) == all.size) {
        (void)avr_ioctl(avr, AVR_IOCTL_EEPROM_SET, &all);
    }
    if (fclose(file) != 0)
        fail(path);
}

static void load(const char *mcu, const char *path)
{
    elf_firmware_t image;
    memset(&image, 0, sizeof image);
    avr_global_logger_set(quiet);
    avr = avr_make_mcu_by_name(mcu);
    errno = 0;
    if (avr == NULL)
        fail("no such MCU");
    if (elf_read_firmware(path, &image) != 0)
        fail(path);
    (void)avr_init(avr);
    avr_load_firmware(avr, &image);
    avr->frequency = HZ;
}

int main(int argc, char **argv)
{
    static const struct option options[] = {{"usb", no_argument, NULL, 'u'},
                                            {"flat-out", no_argument, NULL, 'f'},
                                            {"memory", required_argument, NULL, 'm'},
                                            {"link", required_argument, NULL, 'l'},
                                            {"script", required_argument, NULL, 's'},
                                            {"program", no_argument, NULL, 'p'},
                                            {"low", required_argument, NULL, 'g'},
                                            {"watch", required_argument, NULL, 'w'},
                                            {"controller", required_argument, NULL, 'c'},
                                            {NULL, 0, NULL, 0}};
    const char *low = "", *controller = NULL, *memory_path = NULL, *link_path = NULL, *script_path = NULL;
    bool flat_out = false, is_program = false;
    for (int option; (option = getopt_long(argc, argv, "", options, NULL)) != -1;)
        switch (option) {
        case 'u':
            is_usb = true;
            break;
        case 'f':
            flat_out = true;
            break;
        case 'm':
            memory_path = optarg;
            break;
        case 'l':
            link_path = optarg;
            break;
        case 's':
            script_path = optarg;
            break;
        case 'g':
            low = optarg;
            break;
        case 'w':
            watched = optarg;
            break;
        case 'c':
            controller = optarg;
            break;
        case 'p':
            is_program = true;
            break;
        default:
            return 2;
        }
    errno = 0;
    if (argc - optind != 2)
        fail("usage: avr_board [--usb] [--flat-out] [--memory FILE] [--link PATH] [--script FILE | --program] MCU "
             "IMAGE.elf");
    load(argv[optind], argv[optind + 1]);
    connect_pins(low, true);
    watch_pins();
    if (controller != NULL && !avr_controller_begin(avr, controller, script_path != NULL))
        fail("--controller trio or --controller mpc");
    if (memory_path != NULL)
        memory(memory_path, false);
    (void)signal(SIGTERM, stop);
    (void)signal(SIGINT, stop);
    if (is_usb)
        usb_begin();
    else
        uart_begin();

    if (is_program) {
        is_scripted = false;
        while (!ended && !stopped) {
            run(HZ / 10u);
            while (from_board.count > 0)
                (void)putchar(take(&from_board));
        }
    } else if (script_path != NULL) {
        is_scripted = true;
        FILE *script = strcmp(script_path, "-") == 0 ? stdin : fopen(script_path, "r");
        if (script == NULL)
            fail(script_path);
        play(script);
        (void)fclose(script);
    } else {
        serve(link_path, flat_out);
    }
    avr_controller_end();
    (void)fprintf(stderr, "avr_board: stack %u bytes, %llu cycles\n", avr->ramend - deepest_sp,
                  (unsigned long long)avr->cycle);
    if (memory_path != NULL)
        memory(memory_path, true);
    return avr->state == cpu_Crashed ? 3 : is_program ? avr->data[0x3E] : 0;
}
