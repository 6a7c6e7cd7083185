/* bridge: dryrig-guard at work: the guard between a host's pseudo-terminal and the controller's port.
 *
 *     a host program <-> pty <-> dr_guard <-> device <-> the controller
 *                                  ^  |
 *                        orders <--+  +--> journal, recording
 *
 * Thread-safety: one bridge a process. */
#ifndef BRIDGE_H
#define BRIDGE_H

#include "control.h"
#include "device.h"
#include "journal.h"
#include "mark.h"
#include "pty.h"
#include "recording.h"
#include "rig.h"

#include "dr_guard.h"

#define BRIDGE_RING 256u

typedef struct {
    const char *port, *config;
    const char *link, *control, *log, *record; /* NULL: without */
} bridge_options;

typedef enum { ORDER_NONE, ORDER_ARM, ORDER_CLEAR } order_kind;

typedef struct {
    const bridge_options *options;
    rig rig;
    dr_guard guard;
    dr_record ring[BRIDGE_RING];
    pty host;
    device device;
    control control;
    journal journal;
    recording recording; /* of the controller's line */
    mark mark;           /* for the next guard, if this one is killed */
    bool mark_lost;      /* it could not be written; somebody was told */
    uint32_t unanswered; /* bytes to the controller since its last, while locked */

    uint64_t epoch_us, now_us;     /* of the monotonic clock; since then, when the present event came */
    uint64_t next_try_us;          /* to open the device again */
    uint64_t next_check_us;        /* of memory, while not disarmed */
    uint64_t mark_due_us;          /* to look whether the line has sent a frame's last byte; 0: not now */
    char device_says[RIG_WHY_MAX]; /* why the device is not there */
    bool other_said;               /* that it is one that must not be used */
    int inotify, signals;
    bool log_said;

    order_kind order; /* that takes time */
    bool order_pressed;
    uint64_t order_until_us;
    uint64_t calibrate_until_us; /* 0: not allowed */
    bool surface_said;           /* a person has said whether the tip is in tissue */
    bool was_armed;
    bool host_left;            /* since the last event: somebody has closed the host's port */
    const char *disarmed_says; /* why it is not armed any more; NULL: it has not been, or its state says it */

    dr_guard_status shown; /* what followers were told last */
    bool shown_any, said_any;
    uint8_t said_state, said_fault; /* what stderr was told last */
    uint64_t refusals_quiet_us;     /* until then stderr hears of no more of them */
    uint32_t refusals_left_out;     /* meanwhile */
} bridge;

/* Runs until a signal. Returns the program's exit status. */
int bridge_run(bridge *b, const bridge_options *options);

/* -- For orders.c ------------------------------------------------------------------------------------------------------ */

dr_us bridge_now(const bridge *b);
/* After every call to the guard: what has to leave leaves, the records are kept. */
void bridge_pump(bridge *b);

/* An order of the second channel. context: the bridge. */
void orders_take(void *context, control_client *who, const char *said);
/* Goes on with an order that takes time; call it after every event. False: nothing to wait for by itself. */
bool orders_due(const bridge *b, uint64_t *when_us);
void orders_continue(bridge *b);
/* Tells followers, and people at stderr, what has changed. */
void orders_tell(bridge *b);
/* What they were to be told later. */
void orders_end(bridge *b);

#endif
