/* dr_wire: bytes <-> requests and replies, both directions. The only file that knows byte order and framing.
 *
 * Coordinates travel least significant byte first [P]; a control byte counts at a frame boundary only, because 0x03 and
 * 0x0D are ordinary bytes of a coordinate.
 * Errors: false or 0 and nothing else; who is to blame is the sender of the bytes, or, when encoding, the caller.
 * Thread-safety: functions of their arguments only. */
#ifndef DR_WIRE_H
#define DR_WIRE_H

#include "dr_device.h" /* dr_command, dr_op */

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* -- Requests ------------------------------------------------------------------------------------------------------ */

typedef struct {
    uint8_t op;              /* dr_op */
    uint8_t value;           /* speed level, drive, angle (degrees) or mode; 0 where the command has none */
    uint32_t steps[DR_AXES]; /* target; an axis command fills its own axis only */
} dr_request;

/* The axis of a one-axis command, DR_AXES for any other. */
uint8_t dr_wire_axis(dr_op op);

/* Writes the frame of a request (at most DR_FRAME_MAX bytes). Returns its length; 0: this firmware has no such command. */
size_t dr_wire_put_request(dr_kind kind, uint16_t firmware, const dr_request *request, uint8_t *bytes);
/* Reads a whole frame of `command`. */
dr_request dr_wire_get_request(const dr_command *command, const uint8_t *bytes);

/* Cuts a host's bytes into frames, one byte at a time.
 * Invariant: have == 0 and want == 0, or 0 < have < want <= DR_FRAME_MAX; bytes[0..have) are the frame so far. */
typedef struct {
    uint8_t bytes[DR_FRAME_MAX];
    uint8_t have, want;
} dr_framer;

typedef enum {
    DR_FRAMED_PART,   /* taken; the frame is not whole yet */
    DR_FRAMED_WHOLE,  /* bytes[0..want) is a frame; the next byte starts a new one */
    DR_FRAMED_FILLER, /* CR or LF between frames: swallowed */
    DR_FRAMED_UNKNOWN /* no command of this controller and firmware: dropped */
} dr_framed;

void dr_framer_reset(dr_framer *framer);
/* After DR_FRAMED_WHOLE *command is the frame's row and framer->bytes the frame, until the next call. */
dr_framed dr_framer_push(dr_framer *framer, dr_kind kind, uint16_t firmware, uint8_t byte, dr_command *command);

/* -- Replies ------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint8_t value;     /* drive or 'E' (MPC), angle in degrees (TRIO), number of drives */
    uint8_t connected; /* DR_OP_MPC_DRIVES: bit 0 is port 1 */
    uint16_t firmware; /* DR_OP_MPC_ACTIVE from 3.00 */
    uint32_t steps[DR_AXES];
} dr_reply;

/* Writes the reply to `command` (at most DR_REPLY_MAX bytes) and returns its length, command->reply. */
size_t dr_wire_put_reply(const dr_command *command, const dr_reply *reply, uint8_t *bytes);
/* Reads a reply. False: not of that length, not ended by CR, or a value that no controller sends there. */
bool dr_wire_get_reply(const dr_command *command, const uint8_t *bytes, size_t count, dr_reply *out);

/* One frame of streamed positions (DR_STREAM_FRAME bytes) [M note 16]. */
void dr_wire_put_stream(const uint32_t steps[DR_AXES], uint8_t *bytes);
/* False: it does not begin with the signature FF FF FF. */
bool dr_wire_get_stream(const uint8_t *bytes, uint32_t steps[DR_AXES]);

#ifdef __cplusplus
}
#endif
#endif
