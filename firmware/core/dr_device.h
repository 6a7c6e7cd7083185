/* dr_device: what the two instruments are. Constant tables, no behaviour.
 *
 * Sources, cited at each entry: [T] TRIO MP-245A quick reference rev. 3.16k2, [M] MPC-325 quick reference rev. 3.21K,
 * [O] other manuals of the maker, [P] PROTOCOL.md of this project, where the manuals contradict each other or themselves.
 *
 * Units: lengths are whole quanta of 1/64 um or the instrument's own microsteps; times are whole microseconds.
 * Thread-safety: everything here is constant; any thread may call any function. */
#ifndef DR_DEVICE_H
#define DR_DEVICE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Instants and spans in microseconds. Instants wrap after 71 minutes: compare them with dr_us_before() only, and never
 * keep one for longer than a move lasts. */
typedef uint32_t dr_us;

/* Is instant a before instant b? Right while they are less than 2^31 us (35 minutes) apart. */
static inline bool dr_us_before(dr_us a, dr_us b) { return (uint32_t)(a - b) > UINT32_C(0x7FFFFFFF); }

#define DR_AXES 3u
enum { DR_X, DR_Y, DR_Z };

#define DR_PORTS 4u          /* manipulators on one MPC-200, daisy chain included [M table 9, 'U'] */
#define DR_QUANTA_PER_UM 64u /* every microstep and every speed of both manuals is a whole number of quanta */
#define DR_US_PER_S UINT32_C(1000000)

typedef enum { DR_TRIO, DR_MPC } dr_kind; /* TRIO MP-245A; MPC-200 (the controller of the MPC-325) */

/* Firmware versions are binary-coded decimals, as 'K' sends them [M note 15]: 0x0321 is 3.21. */
#define DR_FIRMWARE_FIRST 0x0100u
#define DR_FIRMWARE_LAST 0x9999u
#define DR_FIRMWARE_TRIO 0x0312u /* the version that [T] describes, on its title page */
#define DR_FIRMWARE_MPC 0x0321u  /* the version that [M] describes, on its title page */

/* The serial line: 8 data bits, no parity, 1 stop bit [T table 3, M table 5]. */
#define DR_BAUD_TRIO UINT32_C(57600)
#define DR_BAUD_MPC UINT32_C(128000)
#define DR_BITS_PER_BYTE 10u

#define DR_CR 0x0Du /* the task-complete indicator [T note 1, M note 1] */
#define DR_LF 0x0Au
#define DR_INTERRUPT 0x03u     /* ^C [T table 6, M table 9] */
#define DR_NO_SUCH_DRIVE 0x45u /* 'E', the answer of 'I' for a drive that is not there [M table 9] */

/* -- Commands ------------------------------------------------------------------------------------------------------ */

typedef enum {
    DR_OP_NONE,
    DR_OP_TRIO_POSITION,
    DR_OP_TRIO_HOME,    /* to the stored home position */
    DR_OP_TRIO_WORK,    /* to the stored work position */
    DR_OP_TRIO_HOME_TO, /* to a given position in home order; stores nothing */
    DR_OP_TRIO_WORK_TO, /* to a given position in work order; stores nothing */
    DR_OP_TRIO_LINE,
    DR_OP_TRIO_X,
    DR_OP_TRIO_Y,
    DR_OP_TRIO_Z,
    DR_OP_TRIO_ANGLE,
    DR_OP_TRIO_RECALIBRATE,
    DR_OP_TRIO_INTERRUPT,
    DR_OP_MPC_COUNT,  /* how many drives are connected */
    DR_OP_MPC_DRIVES, /* how many and which drives are connected */
    DR_OP_MPC_ACTIVE, /* active drive and, from 3.00, firmware version */
    DR_OP_MPC_POSITION,
    DR_OP_MPC_SELECT,
    DR_OP_MPC_HOME,
    DR_OP_MPC_WORK,
    DR_OP_MPC_CENTRE,
    DR_OP_MPC_CALIBRATE,
    DR_OP_MPC_MOVE,
    DR_OP_MPC_LINE,
    DR_OP_MPC_INTERRUPT,
    DR_OP_MPC_STREAM_OFF,
    DR_OP_MPC_STREAM_ON,
    DR_OP_MPC_MODE,
    DR_OPS
} dr_op;

/* What follows the command byte. The value is the number of bytes, the only place where it is written. */
typedef enum {
    DR_ARGS_NONE = 0,
    DR_ARGS_BYTE = 1,   /* a drive, an angle or a mode */
    DR_ARGS_AXIS = 4,   /* one coordinate */
    DR_ARGS_POINT = 12, /* X, Y, Z */
    DR_ARGS_LINE = 13   /* speed level, X, Y, Z */
} dr_args;

/* What a command is, for whoever has to judge it (trace, guard, host). */
enum {
    DR_IS_QUERY = 1u << 0,   /* changes nothing */
    DR_IS_SETTING = 1u << 1, /* changes a setting, moves nothing */
    DR_IS_MOTION = 1u << 2,
    DR_IS_STOPPABLE = 1u << 3, /* a motion that ^C stops */
    DR_IS_TARGETED = 1u << 4,  /* a motion whose target is in the frame */
    DR_IS_INTERRUPT = 1u << 5
};

#define DR_FRAME_MAX 14u    /* the longest command: 'S', speed, X, Y, Z */
#define DR_REPLY_MAX 14u    /* the longest reply: three coordinates, one more byte, CR */
#define DR_STREAM_FRAME 12u /* FF FF FF, then X, Y, Z of 24 bits each [M note 16] */

typedef struct {
    uint8_t code;          /* the command byte */
    uint8_t op;            /* dr_op */
    uint8_t args;          /* dr_args: bytes after the command byte */
    uint8_t reply;         /* bytes of the reply, the CR included (none at all where no drive is connected) */
    uint8_t is;            /* DR_IS_* */
    uint16_t since, until; /* first and last firmware version that knows it */
} dr_command;

/* The command that starts with this byte. False: this firmware does not know the byte. */
bool dr_command_find(dr_kind kind, uint16_t firmware, uint8_t code, dr_command *out);
/* The command byte that a host should send for an operation. False: this firmware has no such operation. */
bool dr_command_for(dr_kind kind, uint16_t firmware, dr_op op, dr_command *out);
/* All rows of a controller's table in turn. False: there is no row of that index. */
bool dr_command_row(dr_kind kind, uint8_t index, dr_command *out);

/* -- Stages: what can be connected --------------------------------------------------------------------------------- */

typedef enum {
    DR_STAGE_NONE,       /* an empty port */
    DR_STAGE_TRIO_MP845, /* also MP-245 with adapter */
    DR_STAGE_TRIO_MP865,
    DR_STAGE_TRIO_MP285, /* also 3DMS, MT-78, MOM, SOM */
    DR_STAGE_TRIO_MP265,
    DR_STAGE_MPC_MP225,
    DR_STAGE_MPC_MP285, /* also 3DMS, MPC-78, SOM */
    DR_STAGE_MPC_MP265,
    DR_STAGE_MPC_MP845, /* also MP-245 and MPC-x8 */
    DR_STAGE_MPC_MP865,
    DR_STAGE_MPC_MT800, /* MT-8x0 */
    DR_STAGE_MPC_MOM,
    DR_STAGES
} dr_stage_id;

typedef struct {
    uint8_t kind; /* dr_kind of the controller it is for */
    uint8_t quanta_per_step;
    uint16_t full_speed_um_per_s;
    uint16_t since;                 /* first firmware version that drives it */
    uint32_t travel_steps[DR_AXES]; /* the last microstep of each axis; the first is 0 */
} dr_stage;

/* False: no such stage, or DR_STAGE_NONE. */
bool dr_stage_get(dr_stage_id id, dr_stage *out);

typedef enum {
    DR_FIT_YES,
    DR_FIT_OTHER_CONTROLLER,
    DR_FIT_FIRMWARE_TOO_OLD, /* older than the stage's `since` */
    DR_FIT_FIRMWARE_EXACTLY, /* MOM: 3.13 or 3.16 only [M table 7] */
    DR_FIT_PORT              /* MOM: ports 1 and 3 only, port A of each controller [M table 7] */
} dr_fit;

/* Can this stage be connected to this port (1 to 4) of this controller? */
dr_fit dr_stage_fits(dr_stage_id id, dr_kind kind, uint16_t firmware, uint8_t port);

/* The microstep nearest to a length of at most 2^26 - 1 um, which is more than any travel. */
uint32_t dr_um_to_steps(uint32_t um, uint8_t quanta_per_step);

/* -- Speeds -------------------------------------------------------------------------------------------------------- */

#define DR_SPEED_LEVELS 16u
#define DR_SPEED_FULL DR_SPEED_LEVELS /* as a level: the speed of every motion but 'S' */

/* Speed in quanta per second of a straight-line level 0..15 or of DR_SPEED_FULL. [T table 7, M note 12, table 8] */
uint32_t dr_speed_quanta_per_s(dr_stage_id id, uint8_t level);
/* What one real MPC-200 was measured to do (quirk measured-speeds, [P]). */
uint32_t dr_measured_quanta_per_s(uint8_t level);

/* -- Angles -------------------------------------------------------------------------------------------------------- */

#define DR_ANGLE_MAX_DEG 90u     /* [T note 13] */
#define DR_ANGLE_DEFAULT_DEG 30u /* factory default [T note 13] */
#define DR_DIAGONALS 16u         /* MPC-200 switches 1-4 as a number, switch 1 the lowest bit [M table 2] */
#define DR_DIAGONAL_DEFAULT 10u  /* 29 degrees, less steep than 45: switches 0,1,0,1 */

/* Direction of a diagonal: X moves by cos where Z moves by sin, both times 32768. */
typedef struct {
    uint16_t cos, sin;
} dr_diagonal;
dr_diagonal dr_diagonal_get(uint8_t value);
/* The same for an angle of a TRIO, 0 to 90 degrees: its D axis [T page 1, P]. */
dr_diagonal dr_angle_get(uint8_t angle_deg);

#ifdef __cplusplus
}
#endif
#endif
