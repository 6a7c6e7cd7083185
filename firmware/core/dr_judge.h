/* dr_judge: may this command reach the controller? Pure decisions of the limits, the place of the tip and the frame.
 *
 * The guard asks it before every motion; programs ask it to explain a configuration. Every check of a motion takes the
 * whole way that the controller may take, not its end. Thread-safety: functions of their arguments only. */
#ifndef DR_JUDGE_H
#define DR_JUDGE_H

#include "dr_limits.h"
#include "dr_wire.h" /* dr_command, dr_request */

#ifdef __cplusplus
extern "C" {
#endif

/* From the guard's query until the motion begins, a knob may move the tip: the query, up to DR_ANSWER_US of the wait for its
 * answer, the gap on the wire and the frame, and on an MPC-200 the pause within 'S'. The margin has room for that, and for
 * what it takes longer (dr_scene.waited_us); the guard keeps to it. */
#define DR_WINDOW_US 10000
#define DR_WINDOW_MPC_LINE_US 50000
#define DR_ANSWER_US 3000       /* 15 bytes of a TRIO take 2,604 us */
#define DR_WAITED_MAX_US 100000 /* a reading that is older is taken again */

/* Why something was refused, or dropped. `limit` and `measured` of a verdict are in the units given here. */
typedef enum {
    DR_REASON_NONE, /* allowed */
    /* found by dr_judge_frame(): what the frame alone tells */
    DR_REASON_RANGE,       /* target beyond the travel of every drive, or "negative"; microsteps; axis */
    DR_REASON_LEVEL,       /* speed level above 15 */
    DR_REASON_AMBIGUOUS,   /* 'X', 'Y', 'Z' of a TRIO: its manual gives two meanings; send lower case */
    DR_REASON_ANGLE_VALUE, /* 'A' beyond the angles of the limits; degrees */
    DR_REASON_MODE_VALUE,  /* 'L' above 9 or coarser than mode_min */
    DR_REASON_DRIVE_VALUE, /* 'I' for a drive that may not be moved; number from 1 */
    DR_REASON_STREAM,      /* 'O' without DR_RIG_MAY_STREAM */
    /* found by dr_judge_motion() */
    DR_REASON_DRIVE,       /* the controller's active drive is not the one that the host chose; numbers from 1 */
    DR_REASON_ANGLE,       /* the TRIO stands at 0 or 90 degrees, where an axis fails to move; degrees */
    DR_REASON_FRAME_LOST,  /* a calibration was broken off: coordinates mean nothing until a whole one */
    DR_REASON_CALIBRATE,   /* calibration without DR_RIG_MAY_CALIBRATE and a person's leave */
    DR_REASON_HIDDEN,      /* a motion to a place that only the controller knows, in a box that is not all travel */
    DR_REASON_LIMIT,       /* leaves the travel box; quanta; axis */
    DR_REASON_ESCAPE,      /* the tip is in a forbidden place and this is no way out; item: obstacle, or axis */
    DR_REASON_KEEP_OUT,    /* the way touches an obstacle; item */
    DR_REASON_OLD_TARGET,  /* the move that ^C broke off, if resumed, could touch an obstacle; item */
    DR_REASON_STEP,        /* displacement above max_move_q; quanta; axis, or DR_AXES: Euclidean */
    DR_REASON_UNSTOPPABLE, /* would last too long for a motion that cannot be stopped; ms */
    DR_REASON_SPEED,       /* faster than allowed where it goes; quanta/s */
    DR_REASON_LATERAL,     /* sideways below surface + clearance; quanta; axis */
    DR_REASON_APPROACH,    /* in tissue: not along the approach line */
    /* found by dr_guard */
    DR_REASON_UNKNOWN,     /* no command of this controller begins so */
    DR_REASON_RESYNC,      /* after a refusal of a frame's shape, until the host has paused for 50 ms */
    DR_REASON_TORN,        /* a frame was not finished in time */
    DR_REASON_BUSY,        /* something is under way */
    DR_REASON_NOT_ARMED,   /* locked, disarmed, stopped or in fault */
    DR_REASON_CANCELLED,   /* a stop came first */
    DR_REASON_RATE,        /* more than 20 motions in a second */
    DR_REASON_NO_POSITION, /* the controller did not tell a believable position */
    DR_REASON_DAMAGED,     /* limits or state in memory are not what they were */
    DR_REASONS
} dr_reason;

typedef struct {
    uint8_t reason; /* dr_reason */
    uint8_t axis;   /* DR_X..DR_Z, or DR_AXES: not about one axis */
    uint8_t item;   /* index of an obstacle, or DR_NO_ITEM */
    int64_t measured, limit;
} dr_verdict;
#define DR_NO_ITEM 0xFFu

/* A move that ^C broke off: the controller may resume it instead of the next motion. */
typedef struct {
    bool is_open;
    uint32_t at_steps[DR_AXES]; /* at rest here since */
    dr_box target_q;            /* on its way to within here */
} dr_old_move;

/* What the guard knows when a motion is asked for. */
typedef struct {
    uint32_t start_steps[DR_AXES]; /* from a query a moment ago */
    uint32_t waited_us;            /* for it, beyond the window: 0..DR_WAITED_MAX_US */
    uint8_t drive;                 /* index of the drive that the controller says is active (TRIO: 0) */
    uint8_t chosen;                /* index of the drive that the host chose */
    uint8_t angle_deg;             /* TRIO */
    bool may_calibrate;            /* a person allows it now */
    bool in_tissue;                /* a person says so */
    bool frame_lost;               /* a calibration was broken off */
    dr_old_move old[DR_PORTS];     /* by drive */
} dr_scene;

/* Where a motion may take the tip. */
typedef struct {
    dr_box swept[2]; /* hull of each stage */
    uint8_t stages;  /* 1 or 2 */
    bool straight;   /* stage 1 keeps to the line, not to the hull only */
    dr_segment line; /* from start to target, where the target is one point */
    dr_box target_q; /* where it ends; one point, or all that is possible */
} dr_path;

/* A whole frame by itself. In any state; a refusal other than of 'I' means that the host's bytes are not to be trusted. */
dr_verdict dr_judge_frame(const dr_limits *limits, const dr_command *command, const dr_request *request);
/* A motion that dr_judge_frame() allowed. */
dr_verdict dr_judge_motion(const dr_limits *limits, const dr_scene *scene, const dr_command *command,
                           const dr_request *request);
/* The way that dr_judge_motion() checks. scene->drive is one that may be moved. */
dr_path dr_judge_path(const dr_limits *limits, const dr_scene *scene, const dr_command *command,
                      const dr_request *request);
/* By how much ways of this command are grown: margin, and what a knob may do before the motion begins. */
int32_t dr_judge_margin_q(const dr_limits *limits, const dr_scene *scene, const dr_command *command);
/* Is the tip in the box and clear of obstacles? Else why not (DR_REASON_LIMIT, _KEEP_OUT, or _DRIVE). */
dr_verdict dr_judge_place(const dr_limits *limits, uint8_t drive, const uint32_t steps[DR_AXES]);
/* The speed to reckon with: the faster (fastest) or slower (!fastest) of the documented and the measured; quanta/s. */
uint32_t dr_judge_speed(const dr_limits *limits, uint8_t drive, uint8_t level, bool fastest);

#ifdef __cplusplus
}
#endif
#endif
