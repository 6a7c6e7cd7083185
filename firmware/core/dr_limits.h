/* dr_limits: what a guard enforces on one rig, as a fixed binary that is checked as a whole before it is used.
 *
 * A program compiles it from text; a microcontroller loads it. Lengths are whole quanta of 1/64 um in the coordinates
 * that the drive's own position query tells: whoever compiles rounds limits inwards and obstacles outwards.
 * Errors of the image or of its content are the author's of the configuration; they say which item.
 * Thread-safety: functions of their arguments only. */
#ifndef DR_LIMITS_H
#define DR_LIMITS_H

#include "dr_geometry.h" /* dr_box, dr_half */

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DR_OBSTACLES_MAX 32u
#define DR_SERIAL_MAX 16u
#define DR_REST_STEPS 2u            /* two readings this close are the same place */
#define DR_LATERAL_TOLERANCE_Q 128  /* 2 um: what rounding to microsteps may put off a line */
#define DR_ESCAPE_MAX_Q 64000       /* 1 mm: the longest move out of a forbidden place */
#define DR_PLAUSIBLE_BEYOND_Q 32000 /* 500 um: how far beyond its travel a drive may tell to be */
#define DR_CALIBRATED_TO_Q 64000    /* 1,000 um: where a TRIO's calibration ends on each axis [O] */
#define DR_ARM_IDLE_MAX_S 2000u     /* instants are told apart up to 35 minutes */
#define DR_UNSTOPPABLE_MAX_MS 60000u

/* A direction along an axis: the way out of an obstacle, the side of a surface. */
typedef enum { DR_TO_NONE, DR_TO_LESS_X, DR_TO_MORE_X, DR_TO_LESS_Y, DR_TO_MORE_Y, DR_TO_LESS_Z, DR_TO_MORE_Z } dr_to;
/* The axis of a direction that is not DR_TO_NONE, and whether coordinates grow that way. */
static inline uint8_t dr_to_axis(uint8_t to) { return (uint8_t)((to - 1u) / 2u); }
static inline bool dr_to_more(uint8_t to) { return to % 2u == 0; }

typedef struct {
    uint8_t stage;             /* dr_stage_id; DR_STAGE_NONE: this port is not to be moved */
    uint8_t fast_level;        /* highest speed above the surface: 0..15, DR_SPEED_FULL: any motion's */
    uint8_t slow_level;        /* the same where a motion touches what is below the surface */
    uint8_t retract;           /* dr_to: away from the specimen; DR_TO_NONE: there is no surface */
    dr_box box_q;              /* where the tip may be; the faces too */
    uint32_t max_move_q;       /* longest displacement, on each axis and Euclidean */
    int32_t surface_q;         /* on the axis of `retract`; below is the other side of it, itself included */
    uint32_t clearance_q;      /* how far above the surface lateral moves begin */
    int16_t approach[DR_AXES]; /* the line to the specimen (either sense); with a surface only */
} dr_drive_limits;

typedef enum { DR_SHAPE_BOX = 1, DR_SHAPE_HALF = 2 } dr_shape;

typedef struct {
    uint8_t shape;  /* dr_shape */
    uint8_t drive;  /* index of the drive in whose coordinates it is */
    uint8_t exit;   /* dr_to: a box's way out for a tip that is within; NONE: by hand only */
    dr_box box_q;   /* DR_SHAPE_BOX */
    dr_half half_q; /* DR_SHAPE_HALF: its way out is along the normal */
} dr_obstacle;

typedef enum { DR_REFUSE_SILENT, DR_REFUSE_E } dr_refusal; /* what the host gets for a refused motion */
typedef enum { DR_HOST_LOSS_STOP, DR_HOST_LOSS_FINISH } dr_host_loss;

enum {
    DR_RIG_CALIBRATES_AT_POWER_ON = 1u << 1, /* TRIO external switch 6 ON: power moves every axis */
    DR_RIG_KNOBS_LOCKED = 1u << 2,           /* nobody turns a knob while programs move */
    DR_RIG_PATHS_UNKNOWN = 1u << 3,          /* believe no documented path: 'S' too may be anywhere in the hull */
    DR_RIG_HOME_IS_ZERO = 1u << 4,           /* MPC: 'H' goes to 0,0,0 and nowhere else */
    DR_RIG_MAY_CALIBRATE = 1u << 5,          /* 'R' and 'N', while a person allows it */
    DR_RIG_MAY_STREAM = 1u << 6,             /* 'O' */
    DR_RIG_HAS_CUT = 1u << 7,                /* a relay in the controller's supply */
    DR_RIG_STAYS_ARMED = 1u << 12,           /* when the host closes its port at rest, for arm_idle_s at most */
    /* Y may stay out of homing: external switch 5 of a TRIO [T table 1] is OFF, or switch 8 of an MPC-200's first drive
     * [M table 3]; << drive for its other drives. */
    DR_RIG_Y_LOCKED_OUT = 1u << 8
};

typedef struct {
    uint8_t kind; /* dr_kind */
    uint8_t obstacle_count;
    uint8_t refusal, host_loss;           /* dr_refusal, dr_host_loss */
    uint16_t firmware;                    /* binary-coded decimal: decides which commands there are and how long */
    uint16_t rig;                         /* DR_RIG_* */
    uint32_t revision;                    /* only ever increases */
    uint8_t serial[DR_SERIAL_MAX];        /* of the USB converter, padded with 0; all 0: any. For programs */
    uint8_t angle_min_deg, angle_max_deg; /* TRIO: what 'A' may set, within 1..89 */
    uint8_t mode_min;                     /* MPC: the coarsest knob mode that 'L' may choose, 0..9 */
    uint16_t unstoppable_ms;              /* longest motion that ^C does not stop */
    uint16_t arm_idle_s;                  /* disarmed after so long without an accepted motion */
    int32_t margin_q;                     /* around every way */
    int32_t knob_q_per_s;                 /* how fast a person can move the tip by knob */
    int32_t beyond_zero_q;                /* how far below 0 a calibration goes */
    dr_drive_limits drives[DR_PORTS];     /* TRIO: the first only */
    dr_obstacle obstacles[DR_OBSTACLES_MAX];
} dr_limits;

/* Careful defaults for a controller, without what only the owner knows: drives, boxes, obstacles, rig facts. */
void dr_limits_init(dr_limits *limits, dr_kind kind);
/* The defaults of one drive: the whole travel less 100 um, 5 mm a move, any speed, no surface. False: no such stage. */
bool dr_limits_init_drive(dr_limits *limits, uint8_t drive, dr_stage_id stage);

/* -- Does it make sense? --------------------------------------------------------------------------------------------- */

typedef enum {
    DR_LIMITS_GOOD,
    DR_LIMITS_SIZE,             /* image: not of the one right length */
    DR_LIMITS_MAGIC,            /* image: not a configuration */
    DR_LIMITS_VERSION,          /* image: of another format version */
    DR_LIMITS_CRC,              /* image: damaged */
    DR_LIMITS_KIND,             /* no such controller */
    DR_LIMITS_FIRMWARE,         /* not a binary-coded version from 1.00 */
    DR_LIMITS_RIG,              /* a fact or permission that this controller cannot have */
    DR_LIMITS_SERIAL,           /* not text padded with 0 */
    DR_LIMITS_CHOICE,           /* refusal or host_loss is none of its values */
    DR_LIMITS_ANGLES,           /* not 1 <= min <= max <= 89 */
    DR_LIMITS_MODE,             /* above 9 */
    DR_LIMITS_UNSTOPPABLE,      /* above DR_UNSTOPPABLE_MAX_MS */
    DR_LIMITS_ARM_IDLE,         /* 0 or above DR_ARM_IDLE_MAX_S */
    DR_LIMITS_MARGIN,           /* negative or above 10 mm */
    DR_LIMITS_KNOB,             /* negative or above 20 mm/s; or 0 and the knobs are not locked */
    DR_LIMITS_BEYOND_ZERO,      /* negative or above 10 mm */
    DR_LIMITS_NO_DRIVE,         /* no drive may be moved */
    DR_LIMITS_STAGE,            /* item = drive: not for this controller, firmware or port */
    DR_LIMITS_BOX,              /* item = drive, axis: min >= max */
    DR_LIMITS_BOX_OUTSIDE,      /* item = drive, axis: beyond the travel */
    DR_LIMITS_MAX_MOVE,         /* item = drive: 0 or above DR_FAR_Q */
    DR_LIMITS_SPEED,            /* item = drive: a level above DR_SPEED_FULL, or slow above fast */
    DR_LIMITS_SURFACE,          /* item = drive: retract is no direction, or the surface is not within the travel */
    DR_LIMITS_CLEARANCE,        /* item = drive: no room above surface + clearance within the box */
    DR_LIMITS_APPROACH,         /* item = drive, axis: a component above DR_NORMAL_MAX; or 0 along `retract` */
    DR_LIMITS_OBSTACLES,        /* more than DR_OBSTACLES_MAX */
    DR_LIMITS_SHAPE,            /* item = obstacle: no such shape */
    DR_LIMITS_OBSTACLE_DRIVE,   /* item = obstacle: for a drive that may not be moved */
    DR_LIMITS_OBSTACLE_BOX,     /* item = obstacle, axis: min > max, or beyond +-DR_FAR_Q */
    DR_LIMITS_OBSTACLE_NORMAL,  /* item = obstacle: 0,0,0, a component above DR_NORMAL_MAX, an absurd offset */
    DR_LIMITS_OBSTACLE_EXIT,    /* item = obstacle: no direction; or a half-space has one (it is its normal) */
    DR_LIMITS_OBSTACLE_OUTSIDE, /* item = obstacle: nowhere near the drive's travel: a slip of sign or unit */
    DR_LIMITS_NO_ROOM           /* item = drive: one obstacle leaves nothing of the box */
} dr_limits_error;

typedef struct {
    uint8_t error, item, axis;
} dr_limits_problem; /* dr_limits_error; item from 0; axis or DR_AXES */

/* The first problem. False: there is one. */
bool dr_limits_check(const dr_limits *limits, dr_limits_problem *problem);

/* -- The fixed binary: "DRLM", format version, body, CRC-32C over all of it; little-endian ------------------------------ */

#define DR_LIMITS_VERSION_NOW 1u
#define DR_LIMITS_IMAGE_BYTES 1555u /* a test holds it against what is written */

/* Writes the image (DR_LIMITS_IMAGE_BYTES). What is beyond obstacle_count is written as zeroes. */
void dr_limits_put(const dr_limits *limits, uint8_t *image);
/* Reads and checks an image. False: *out must not be used. */
bool dr_limits_get(const uint8_t *image, size_t size, dr_limits *out, dr_limits_problem *problem);
/* The CRC-32C that the image ends with: names a configuration, and tells whether memory still holds it. */
uint32_t dr_limits_crc(const dr_limits *limits);

/* CRC-32C (Castagnoli, reflected, RFC 3720). Start with 0, chain with the value of the bytes before. */
uint32_t dr_crc32c(uint32_t crc, const uint8_t *bytes, size_t count);

#ifdef __cplusplus
}
#endif
#endif
