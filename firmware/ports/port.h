/* port: the whole hardware of a board, as the emulator needs it. A board is these functions and a main(); PORTING.md is
 * the procedure, template/ the smallest one that runs.
 *
 * Nothing here waits, but dr_port_wait(). All of it is called from one place, the loop of emulator_main.c, never from an
 * interrupt, and after dr_port_begin(). There are no errors: what a line loses is lost, as on a real one. */
#ifndef DR_PORT_H
#define DR_PORT_H

#include "dr_device.h" /* dr_us */

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* -- Start --------------------------------------------------------------------------------------------------------- */

/* Straps: pins that are read once, at the start. A board without them returns 0: all as built. */
enum {
    DR_STRAP_OTHER = 1u << 0,  /* the other controller than the one the image was built for */
    DR_STRAP_STAGES = 3u << 1, /* which stages, see emulator_main.c */
    DR_STRAP_KEEP = 1u << 3    /* TRIO: external switch 6 is "None": no calibration at power-on, positions are kept */
};
#define DR_STRAP_STAGES_SHIFT 1u

/* Makes ready what is needed before the line: clock, pins, memory. Returns the straps that are closed. */
uint8_t dr_port_begin(void);

/* Opens the line to the host: 8 data bits, no parity, 1 stop bit. On USB the host's own setting is of no consequence. */
void dr_port_open(uint32_t baud);

/* -- Time ---------------------------------------------------------------------------------------------------------- */

/* Microseconds since any moment. Never goes back, wraps from 2^32-1 to 0 and at no other value; may advance in jumps of
 * up to 20 us. */
dr_us dr_port_now_us(void);

/* Sleeps until `until`, or for ever without one. Returns earlier when a byte has arrived or when
 * the line takes more bytes, and whenever it likes, at least once a minute. Must not oversleep by more than 50 us. */
void dr_port_wait(bool has_end, dr_us until);

/* False: dr_port_wait() does nothing at all, and is not called. When something will happen next is then not computed
 * either, which takes an AVR a quarter of a streamed frame's time. */
bool dr_port_waits(void);

/* -- The line ------------------------------------------------------------------------------------------------------ */

/* Takes up to `room` bytes that have arrived, oldest first; 0: none. None may be lost at the line's full rate while the
 * loop is away for 4 ms: an interrupt and 64 bytes of memory, or a USB endpoint that holds the host off. */
size_t dr_port_read(uint8_t *bytes, size_t room);

/* How many bytes dr_port_write() takes now. A line with memory of its own must not let more than about 8 bytes wait there:
 * a position grows old in it. */
size_t dr_port_room(void);

/* Sends bytes, at most dr_port_room() of them. Where nobody listens they are lost. */
void dr_port_write(const uint8_t *bytes, size_t count);

/* True: the line carries bytes at its own rate, as a UART does. False: it is faster (USB, a simulator's UART), and
 * emulator_main.c keeps the controller's pace. */
bool dr_port_has_pace(void);

/* -- Inputs and outputs: what a bit means is said by the program that uses them (hands.h) ------------------------------ */

#define DR_PORT_INPUTS 16u

/* Which inputs are closed, that is connected to ground, at this moment; input 0 is bit 0. With all their bounce. 0: the
 * board has none. A board that sleeps is woken to look at them. */
uint16_t dr_port_inputs(void);

/* Makes each output high whose bit is set, the others low. Until the first call none is driven. */
void dr_port_outputs(uint8_t high);

/* -- Memory that survives power-off -------------------------------------------------------------------------------- */

#define DR_PORT_SLOT_BYTES 100u

/* How many slots of DR_PORT_SLOT_BYTES there are; 0: the board has no such memory. The more, the longer it lasts: they
 * are written in turn. */
uint16_t dr_port_slots(void);

/* Reads the first `count` bytes of a slot. */
void dr_port_slot_read(uint16_t slot, uint8_t *bytes, size_t count);

/* Writes the first `count` bytes of a slot, a piece each call: true when all are written; false: call again with the same
 * arguments. Other slots keep what they hold, save that a memory which is erased in sectors may, on the first slot of
 * a sector, lose that sector's other slots; then it has two sectors at least. */
bool dr_port_slot_write(uint16_t slot, const uint8_t *bytes, size_t count);

#ifdef __cplusplus
}
#endif
#endif
