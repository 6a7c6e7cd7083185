/* The smallest board: standard input and output of a process are the line, a file is the memory. It is compiled and
 * tested like every other; copy it, and put your chip's registers where this asks POSIX. Each comment says what a chip
 * does there. */
#define _POSIX_C_SOURCE 200809L /* the system's functions in a C99 build; a chip has none */
#include "emulator.h"
#include "port.h"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#define SLOTS 4
static int memory = -1;

/* A chip: set up clocks and pins, read the straps (pull-ups on, a pin that reads low is a strap that is closed). */
uint8_t dr_port_begin(void)
{
    const char *straps = getenv("STRAPS");
    const char *path = getenv("MEMORY");
    if (path != NULL)
        memory = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    return straps != NULL ? (uint8_t)strtoul(straps, NULL, 0) : 0;
}

/* A chip: set the UART's divisor, 8N1; switch the receive interrupt on, which puts bytes into a ring of 64 or more. */
void dr_port_open(uint32_t baud) { (void)baud; }

/* A chip: a free-running timer of 32 bits and 1 MHz, or ticks and a rest counted together. */
dr_us dr_port_now_us(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (dr_us)((uint64_t)now.tv_sec * DR_US_PER_S + (uint64_t)now.tv_nsec / 1000u);
}

/* A chip: set a timer's interrupt for `until` and sleep until any interrupt; or false here, and nothing there. */
bool dr_port_waits(void) { return true; }

void dr_port_wait(bool has_end, dr_us until)
{
    const dr_us now = dr_port_now_us();
    struct pollfd line = {.fd = STDIN_FILENO, .events = POLLIN};
    const int wait_ms = !has_end ? 60000 : dr_us_before(now, until) ? (int)((until - now) / 1000u) : 0;
    (void)poll(&line, 1, wait_ms);
}

/* A chip: take from the ring. */
size_t dr_port_read(uint8_t *bytes, size_t room)
{
    struct pollfd line = {.fd = STDIN_FILENO, .events = POLLIN};
    if (poll(&line, 1, 0) <= 0)
        return 0;
    const ssize_t count = read(STDIN_FILENO, bytes, room);
    if (count == 0 && dr_controller_ready(dr_emulator_controller()) == 0)
        exit(0); /* a process has an end, a board has none */
    return count > 0 ? (size_t)count : 0;
}

/* A chip with a UART: 1 when the transmit register is free. */
size_t dr_port_room(void) { return DR_REPLY_MAX; }

/* A chip: write the transmit register. */
void dr_port_write(const uint8_t *bytes, size_t count)
{
    if (count > 0 && write(STDOUT_FILENO, bytes, count) < 0)
        exit(1);
}

/* A chip with a UART: true. */
bool dr_port_has_pace(void) { return false; }

/* A chip: the levels of its input pins, inverted. */
uint16_t dr_port_inputs(void) { return 0; }

/* A chip: the levels of its output pins. */
void dr_port_outputs(uint8_t high) { (void)high; }

/* A chip: the EEPROM, or two sectors of flash. Without either return 0; the rest is never called then. */
uint16_t dr_port_slots(void) { return memory < 0 ? 0 : SLOTS; }

void dr_port_slot_read(uint16_t slot, uint8_t *bytes, size_t count)
{
    const ssize_t got = pread(memory, bytes, count, (off_t)slot * DR_PORT_SLOT_BYTES);
    for (size_t i = got > 0 ? (size_t)got : 0; i < count; i++)
        bytes[i] = 0xFF; /* what was never written */
}

/* A chip: write one byte and return false, as long as there is one left. */
bool dr_port_slot_write(uint16_t slot, const uint8_t *bytes, size_t count)
{
    return pwrite(memory, bytes, count, (off_t)slot * DR_PORT_SLOT_BYTES) != 0;
}

int main(void)
{
    dr_emulator_begin();
    for (;;)
        dr_emulator_step();
}
