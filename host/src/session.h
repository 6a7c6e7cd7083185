/* session: what the parts of the library share. Not installed.
 *
 *     dryrig.c    the public functions: options, units, queries, settings
 *     motion.c    motions: time limits, waiting, streamed frames, arrival
 *     exchange.c  one command and its answer; doubt, and how to get back in step
 *     link*.c     ports */
#ifndef DRYRIG_SESSION_H
#define DRYRIG_SESSION_H

#include "dryrig/dryrig.h"

#include "dr_device.h" /* dr_kind, dr_stage_id */
#include "dr_wire.h"   /* dr_request, dr_reply */

#define MS_US UINT32_C(1000)
#define PAUSE_US (2u * MS_US)       /* between commands [T note 2, M note 2]; the line is listened to meanwhile */
#define LINE_PAUSE_US (30u * MS_US) /* in MPC 'S', behind the speed [M table 9, 'S'] */
#define GAP_US (100u * MS_US)       /* longest silence within an answer; USB adapters hold bytes back for up to 16 ms */
#define QUIET_US (30u * MS_US)      /* silence that proves that nothing more comes: more than such an adapter's 16 ms */
#define DRAIN_US (3000u * MS_US)    /* a controller that has not been silent by then keeps talking */
#define SLICE_US (2u * MS_US)       /* for how long an interrupt may go unseen */

/* Is the next answer on the line the answer to the next command? */
typedef enum {
    DOUBT_NONE,
    DOUBT_LATE,   /* bytes of older answers may come */
    DOUBT_MOVING, /* and a motion that ^C stops may be under way, or its command may wait for a lost byte */
    DOUBT_TORN    /* the same, but nothing can stop it: a person must decide (TRIO) */
} doubt;

struct dryrig {
    dryrig_link link;
    dr_kind kind;
    uint16_t firmware;
    bool firmware_is_known; /* told by the options or by the controller */
    bool firmware_is_old;   /* the controller told that it is below 3.00, not which */
    dr_stage_id stage[DR_PORTS];
    double margin;
    uint64_t grace_us;
    uint32_t answer_us;
    bool ask_once;
    bool is_fast;

    doubt doubt;
    uint64_t busy_us;       /* when the last byte went or came */
    uint8_t drive;          /* MPC: the active one, as last selected or seen; 0: not yet known */
    uint8_t position_bytes; /* MPC: 13 or 14, as learned; 0: not yet known */
    int streaming;          /* MPC: 1 on, 0 off, -1 not known */

    int interrupted, stoppable; /* atomic: dryrig_interrupt() */
    bool within;                /* a public function is under way */
    void (*callback)(void *context, const dryrig_motion *motion);
    void *callback_context;
    char why[DRYRIG_WHY_MAX];
};

/* -- exchange.c ---------------------------------------------------------------------------------------------------- */

/* One answer, whole and valid. */
typedef struct {
    uint8_t bytes[DR_REPLY_MAX];
    uint8_t count;
    dr_reply reply;
} answer;

/* Says why, for dryrig_why(), and returns `error`. */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
int fail(dryrig *d, int error, const char *format, ...);

uint64_t now_us(const dryrig *d);
/* link.read with its error explained. */
int hear(dryrig *d, uint8_t *bytes, size_t room, uint32_t timeout_us);
/* Listens until the line has been silent for quiet_us; GARBLED: it still talks after limit_us. */
int drain(dryrig *d, uint32_t quiet_us, uint32_t limit_us);
/* Sends a command, in step, 2 ms after the last byte, with purged buffers and the pause that belongs into it. */
int send(dryrig *d, const dr_request *request);
int send_interrupt(dryrig *d);
/* A command and its answer; commands that may be repeated only (queries and settings): gets in step, tries twice. */
int command(dryrig *d, const dr_request *request, answer *out);
/* A query, answered twice alike. */
int ask(dryrig *d, dr_op op, answer *out);
/* Where the active drive stands: two answers alike, at least spacing_us apart. */
int settle(dryrig *d, uint32_t spacing_us, dryrig_position *out);
/* Gets back in step. */
int resync(dryrig *d);
/* Sends ^C so many times, every 2 ms. A command that lost bytes takes ^C for data; the next ^C stops the motion that
 * begins then. CANNOT_STOP: no CR came back. */
int stop_everything(dryrig *d, size_t times);
#define STOPS_THAT_END_ALL (DR_FRAME_MAX + 1u)
/* MPC: makes sure that d->firmware is known, as far as the controller tells it. */
int need_firmware(dryrig *d);

/* -- dryrig.c ------------------------------------------------------------------------------------------------------ */

/* The stage of a drive (0 on a TRIO); DR_STAGE_NONE: not said. */
dr_stage_id stage_of(const dryrig *d, int drive);
dryrig_position to_position(const dryrig *d, const dr_reply *reply);
/* Refuses what no stage (DR_STAGE_NONE) or not this stage can reach. */
int check_target(dryrig *d, dr_stage_id id, const int32_t steps[DRYRIG_AXES]);
int convert_um(dryrig *d, dr_stage_id id, const double um[DRYRIG_AXES], int32_t steps[DRYRIG_AXES]);

/* Every public function that talks begins and ends with these: no calls from within a callback. */
int enter(dryrig *d);
int leave(dryrig *d, int result);

#endif
