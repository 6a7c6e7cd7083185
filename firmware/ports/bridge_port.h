/* bridge_port: what a board provides besides port.h to be a bridge, the guard (dr_guard.h) between a host and a controller.
 * Its main() calls dr_bridge_begin() once and then dr_bridge_step() for ever. Of port.h it needs the clock, inputs and
 * outputs, wired as follows; docs/boards.md has the pins.
 *
 *     input    closed means
 *     0, 1     no stop: two contacts of one emergency-stop button, normally closed; an open wire is a stop
 *     2        key on
 *     3        ARM is pressed
 *     4        a calibration may start
 *     5        in tissue
 *     6        escape: arm with the tip in a forbidden place
 *     7        the tip was changed (press)
 *     8        CONFIRM (press)
 *
 *     output   high
 *     0        buzzer: a stop was asked for and something may still move
 *     1        lamp: lit when armed; else it flashes, see docs/boards.md
 *     2        relay in the controller's supply: a square wave while the supply may be on, made by each round of the loop, so
 *              that a charge pump lets the relay drop when the program stands still
 *
 * Nothing here waits. All of it is called from the loop of bridge_main.c, after dr_port_begin(). */
#ifndef DR_BRIDGE_PORT_H
#define DR_BRIDGE_PORT_H

#include "port.h"

#ifdef __cplusplus
extern "C" {
#endif

void dr_bridge_begin(void);
void dr_bridge_step(void);

/* -- Lines --------------------------------------------------------------------------------------------------------- */

typedef enum {
    DR_LINE_HOST,   /* to the programs */
    DR_LINE_DEVICE, /* to the controller; its transmitter is high from power-on through every reset: a pull-up */
    DR_LINE_LOG,    /* out only: what the guard does, for whoever listens. A board without: dr_port_line_room() is 0 */
    DR_LINES
} dr_line;

/* 8 data bits, no parity, 1 stop bit. */
void dr_port_line_open(dr_line line, uint32_t baud);
/* Takes up to `room` bytes that have arrived. Sets *lost when bytes were lost or damaged since the last call (overrun, framing
 * error); damaged ones are not among those returned. The loop may be away for 20 ms on an AVR while it judges a motion:
 * 256 bytes of memory. */
size_t dr_port_line_read(dr_line line, uint8_t *bytes, size_t room, bool *lost);
/* How many bytes dr_port_line_write() takes now. */
size_t dr_port_line_room(dr_line line);
void dr_port_line_write(dr_line line, const uint8_t *bytes, size_t count);
/* Has everything left, the last stop bit too? */
bool dr_port_line_is_sent(dr_line line);

/* Has a program opened the host's port? DTR: of USB, or of the converter on an input pin, low when open (9 on boards that have
 * the inputs above); to ground where nothing can tell. */
bool dr_port_host_is_open(void);

/* -- Configuration: what `dryrig-guard compile` writes, twice -------------------------------------------------------- */

#define DR_PORT_CONFIGURATIONS 2u
/* Reads one of them; a place that was never written has 0xFF. */
void dr_port_configuration(uint8_t which, uint8_t *image, size_t size);

/* -- When the program stands still ----------------------------------------------------------------------------------- */

/* RAM that neither a reset nor the start-up code changes. At power-on it holds anything. */
typedef struct {
    uint32_t alive; /* a number of bridge_main.c: the program has run since power-on */
    bool mid_frame; /* within a frame to the controller */
} dr_survivor;
volatile dr_survivor *dr_port_survivor(void);

/* From now on a reset, unless it is fed every 100 ms (or what comes nearest; a motion is judged in less). */
void dr_port_watchdog_start(void);
void dr_port_watchdog_feed(void);
/* Has the stack always ended above the variables? */
bool dr_port_stack_holds(void);

#ifdef __cplusplus
}
#endif
#endif
