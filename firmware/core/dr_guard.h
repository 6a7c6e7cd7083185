/* dr_guard: stands between a host and a real controller and lets only safe commands through.
 *
 * Three rules without exception:
 *   a command reaches the controller whole and unchanged, or not at all (bytes are re-timed, never edited);
 *   the guard itself sends only position queries and ^C, never a motion;
 *   what the host sends can only make things safer; only a person's inputs can make them less safe.
 *
 * Same shape as dr_controller, with two sides. Nothing blocks, calls out, allocates or asks a clock.
 *
 *     push_host    the host's bytes have arrived       pull_device   bytes for the controller leave
 *     push_device  the controller's bytes have arrived pull_host     bytes for the host leave
 *     due          when something happens by itself    input, link   what people and cables do
 *
 * After every call pull both sides and the log, at once: a stop is there to be pulled when the call that caused it
 * returns. "Pulled" is "on the wire": a frame that nobody has begun to pull is withdrawn by a stop, one that has been
 * begun is finished and the stop follows it. `now` never goes back.
 * Refusals are no errors: they are counted, logged and told in dr_guard_status, and the host gets silence (or 'E').
 * Thread-safety: one thread at a time per guard. */
#ifndef DR_GUARD_H
#define DR_GUARD_H

#include "dr_judge.h" /* dr_limits, dr_verdict, dr_scene, dr_path */
#include "dr_log.h"   /* dr_record */

#ifdef __cplusplus
extern "C" {
#endif

/* -- What the guard tells ------------------------------------------------------------------------------------------- */

typedef enum {
    DR_GUARD_LOCKED,   /* no valid limits, or the controller has not proved to be the one they are for */
    DR_GUARD_DISARMED, /* queries and safe settings pass */
    DR_GUARD_IDLE,     /* armed: motions are checked and pass */
    DR_GUARD_CHECKING, /* a motion waits for the position, or for its turn on the wire */
    DR_GUARD_MOVING_S, /* a motion that ^C stops is under way, or its end is being verified */
    DR_GUARD_MOVING_U, /* a motion that ^C does not stop */
    DR_GUARD_STOPPING, /* ^C was sent; not yet proved at rest */
    DR_GUARD_FAULT,    /* latched: stop released, cause gone, key off and on; then arm anew */
    DR_GUARD_STOPPED   /* the same, by the stop input */
} dr_guard_state;

typedef enum {
    DR_FAULT_NONE,
    DR_FAULT_LIMITS,           /* locks: no valid limits */
    DR_FAULT_IDENTITY,         /* locks: not the controller or firmware that the limits are for */
    DR_FAULT_NO_DEVICE,        /* locks: the cable or the converter is gone; proof starts when it is back */
    DR_FAULT_DEVICE_SILENT,    /* it does not answer a position query; at the start: locks */
    DR_FAULT_NO_CR,            /* a move never told its end; the tip is at rest at a known place */
    DR_FAULT_EARLY_CR,         /* it told the end while it still moved */
    DR_FAULT_WRONG_END,        /* it came to rest elsewhere */
    DR_FAULT_RESUMED_OLD_MOVE, /* it went on with the move that ^C had broken off */
    DR_FAULT_IMPLAUSIBLE,      /* two position replies running that cannot be */
    DR_FAULT_POSITION_JUMP,    /* the tip is where no knob can have put it: power cycle, calibration, lost steps */
    DR_FAULT_DEVICE_NOISE,     /* more than 16 bytes in a second that nobody asked for */
    DR_FAULT_UNSTOPPABLE,      /* a stop was asked for and the tip could not be proved at rest in 1 s */
    DR_FAULT_FRAME_LOST,       /* a calibration was broken off: only a calibration may move anything */
    DR_FAULT_STOP_WIRING,      /* the two stop contacts disagree for more than 50 ms */
    DR_FAULT_DAMAGED, /* limits or state in memory are not what they were (a flipped bit): restart the guard. Where it was the
                       * state, the log is no more */
    DR_FAULT_TORN, /* locks: the controller may hold half a frame, whose rest it takes from any byte that comes: the
                    * cable or the guard went within one, or an MPC-200 has not answered 11 bytes. Cycle its power,
                    * then CONFIRM */
    DR_FAULTS
} dr_fault;

/* What is missing for arming: a set of bits, none when an ARM press will do. */
enum {
    DR_NEEDS_LIMITS = 1u << 0,   /* valid limits */
    DR_NEEDS_IDENTITY = 1u << 1, /* proof, or CONFIRM where the reply fits both controllers */
    DR_NEEDS_INSIDE = 1u << 2, /* the tip within the box and clear, or ESCAPE (as of the last reading; told at rest) */
    DR_NEEDS_STOP_RELEASED = 1u << 3,
    DR_NEEDS_DEVICE = 1u << 4, /* the device link up */
    DR_NEEDS_LOG = 1u << 5,    /* a log that works */
    DR_NEEDS_KEY = 1u << 6,
    DR_NEEDS_CLEAR = 1u << 7,  /* a fault or stop is latched: key off and on */
    DR_NEEDS_TIP = 1u << 8,    /* the tip was changed: CONFIRM */
    DR_NEEDS_REST = 1u << 9,   /* something is under way */
    DR_NEEDS_STEADY = 1u << 10 /* the last ARM found two readings that differ */
};

typedef struct {
    uint8_t state;       /* dr_guard_state */
    uint8_t fault;       /* dr_fault that is latched or locks */
    uint16_t needs;      /* DR_NEEDS_* */
    bool confirm_wanted; /* identity is ambiguous, tip changed, no obstacles, a cut, a torn frame: CONFIRM */
    bool in_tissue, escape, may_calibrate;
    bool buzzer;              /* a stop was asked for and something may still move */
    bool cut;                 /* open the relay in the controller's supply (DR_RIG_HAS_CUT) */
    bool position_known;      /* position_steps: at rest, at the last reading */
    uint8_t drive, angle_deg; /*     of this drive (index), at this angle (TRIO) */
    uint32_t position_steps[DR_AXES];
    uint8_t last_op; /* dr_op that was refused last, and why */
    dr_verdict last_refusal;
    uint32_t forwarded, refused, dropped_bytes, quarantined_bytes; /* since start; they wrap */
    uint32_t log_missed;                                           /* records that were overwritten unread */
} dr_guard_status;

/* -- Log ------------------------------------------------------------------------------------------------------------ */

typedef enum {
    DR_EVENT_START,       /* position[0] = dr_limits_crc, position[1] = revision; code = dr_start */
    DR_EVENT_STATE,       /* the state changed; code = dr_fault */
    DR_EVENT_ALLOWED,     /* host frame -> controller: bytes; code = 1: again, the one before did not leave */
    DR_EVENT_REFUSED,     /* host frame refused: bytes, code = dr_reason, axis, item; position = where the tip was */
    DR_EVENT_DROPPED,     /* host bytes that were no frame: the first bytes; code = dr_reason; count = how many */
    DR_EVENT_REPLY,       /* controller -> host, as much as fits: bytes, code = dr_op */
    DR_EVENT_READING,     /* the guard's own query was answered: position, item = drive or angle */
    DR_EVENT_IMPLAUSIBLE, /* it was answered by nonsense: bytes */
    DR_EVENT_QUARANTINED, /* controller bytes that nobody asked for: bytes; count = how many */
    DR_EVENT_STOP,        /* ^C -> controller; code = dr_stop_cause */
    DR_EVENT_ENDED, /* a motion ended where it should: position, item = drive, code = dr_op; bytes: its CR, if it came */
    DR_EVENT_NO_REPLY, /* a host's query or setting stayed unanswered; code = dr_op */
    DR_EVENT_INPUT,    /* code = dr_input, item = on */
    DR_EVENT_LINK      /* code: bit 0 host open, bit 1 device present */
} dr_event;

typedef enum {
    DR_STOP_HOST,
    DR_STOP_INPUT,
    DR_STOP_HOST_LOST,
    DR_STOP_KEY,
    DR_STOP_DEADLINE,
    DR_STOP_EARLY_CR,
    DR_STOP_AGAIN,
    DR_STOP_AFTER_RESET,
    DR_STOP_NOISE,
    DR_STOP_LATE /* in the pause within 'S': its reading is too old by now */
} dr_stop_cause;

/* -- The guard ------------------------------------------------------------------------------------------------------ */

typedef enum {
    DR_INPUT_STOP,          /* level: stop contact open, or button down; the first of two channels */
    DR_INPUT_STOP_2,        /* level: the second channel; who has one sets both */
    DR_INPUT_KEY,           /* level: off disarms; off and on clears a fault or stop whose cause is gone */
    DR_INPUT_ARM,           /* press: off -> on is the edge */
    DR_INPUT_MAY_CALIBRATE, /* level: held while a calibration may start */
    DR_INPUT_IN_TISSUE,     /* level: only moves along the approach line; the caller keeps it over power-off */
    DR_INPUT_ESCAPE,        /* level: arming with the tip in a forbidden place, to move it out */
    DR_INPUT_TIP_CHANGED,   /* press: disarms until CONFIRM */
    DR_INPUT_CONFIRM,       /* press: identity, changed tip, no obstacles: a person has looked */
    DR_INPUT_LOG_FAILED,    /* level: the log cannot be kept; disarms */
    DR_INPUTS
} dr_input;

/* Instants at which the guard acts by itself. */
enum {
    DR_TIMER_FRAME,   /* the host's frame is not finished in time */
    DR_TIMER_RESYNC,  /* the host has paused */
    DR_TIMER_TASK,    /* see dr_task */
    DR_TIMER_READ,    /* the guard's own query: its turn, its deadline, quiet before the second try */
    DR_TIMER_SEND,    /* the pause before a motion frame, or within 'S' */
    DR_TIMER_PROOF,   /* rest not proved in time */
    DR_TIMER_REPEAT,  /* ^C again */
    DR_TIMER_IDLE,    /* armed without a motion */
    DR_TIMER_RATE,    /* one more motion may start */
    DR_TIMER_NOISE,   /* a second of bytes that nobody asked for is over */
    DR_TIMER_STALE,   /* a knob may have gone anywhere since the last reading */
    DR_TIMER_WIRING,  /* the stop contacts disagree */
    DR_TIMER_RELEASE, /* the stop contacts have stopped bouncing */
    DR_TIMER_LINE,    /* what left last is off the line, whatever converters kept */
    DR_TIMERS
};

#define DR_HOST_OUT_MAX 64u

typedef struct {
    /* everything here belongs to dr_guard; others ask dr_guard_get_status() */
    const dr_limits *limits;                /* NULL: none, or no longer trusted */
    uint32_t limits_crc, limits_memory_crc; /* of what they say; of the bytes that they are, which is faster */
    dr_log log;
    uint8_t mode, fault, shown_state;
    uint16_t inputs; /* bit per dr_input */
    bool host_open, device_present;
    bool plugged;        /* the device's cable, while it counts as not present */
    uint8_t torn;        /* half a frame is in the controller (no bool: it is looked at after damage, too) */
    bool after_reset;    /* a ^C goes first when the device is there */
    bool proved;         /* it is the controller of the limits */
    bool other_firmware; /* it said so itself */
    bool ambiguous;      /* it may be: CONFIRM decides */
    bool host_chose;     /* a drive, by 'I' */
    bool confirmed, tip_changed, unsteady, wiring_alarm, stop_latched, cut, buzzer;

    dr_us at[DR_TIMERS];
    uint16_t running; /* bit per timer */

    dr_framer framer; /* the host's frame that is arriving */
    dr_us frame_began;
    bool resync, tainted; /* tainted: a byte of the frame came while something was under way */
    uint8_t dropped[DR_RECORD_TEXT], dropped_count, dropped_reason; /* host bytes that were no frame, for one record */

    uint8_t task;       /* dr_task of dr_guard.c: what is under way on the device's side */
    dr_command command; /* that is pending, under way or passed on */
    dr_request request;
    uint8_t frame[DR_FRAME_MAX];
    uint8_t reply[DR_REPLY_MAX], reply_have, reply_want; /* to a command that was passed on */
    uint8_t stream_left;                                 /* bytes to come of a streamed position */
    uint8_t attempts;                                    /* at the proof of identity */

    uint8_t read_phase; /* of the guard's own position query */
    dr_us asked_at;     /* it left */
    uint8_t read[DR_REPLY_MAX], read_have;
    bool read_again;
    bool has_first; /* first_steps holds the first of two readings that must agree */
    uint32_t first_steps[DR_AXES];

    uint8_t out[DR_FRAME_MAX], out_at, out_count; /* to the device: one frame or query */
    uint8_t out_ready;                            /* how many bytes of it may leave by now */
    uint8_t stops_out;                            /* ^C that wait to leave */
    uint8_t unanswered;                           /* bytes since its last, to an MPC-200 that is not proved */
    uint8_t to_host[DR_HOST_OUT_MAX], to_host_first, to_host_count;

    uint8_t stop_owed, stop_crs;  /* CRs that the host's own ^C may have; CRs that came */
    uint8_t stop_sent, stop_skip; /* ^C sent; reply bytes that come before their answer */
    uint8_t stop_fault;           /* dr_fault once rest is proved */
    bool stop_broke_off;          /* a motion: its target stays possible */
    bool stop_waits;              /* for the end of a motion that cannot be stopped */

    dr_path path; /* of the motion under way */
    uint8_t path_drive;
    bool end_told, small; /* the motion's CR is there; so short that it may never come */
    bool counted;         /* as a motion that was allowed */
    uint8_t late;         /* how often it was read again: too old when it should have left, or doubted */
    bool doubted;         /* its place was news: two readings were asked for */
    uint8_t tokens;       /* motions that may start now */
    uint8_t noise, quarantined[DR_RECORD_TEXT], quarantined_count;

    dr_scene scene; /* what is known of the place */
    bool position_known;
    dr_us position_at; /* while DR_TIMER_STALE runs */

    uint8_t last_op;
    dr_verdict last_refusal;
    uint32_t forwarded, refused, dropped_bytes, quarantined_bytes;

    uint8_t word_end[3]; /* 0: completes the last word where the struct is packed by bytes */
    uint32_t seal;       /* over all of the above, while nothing is arriving or leaving */
    uint8_t sealed;
} dr_guard;

/* A guard of these limits, which stay the caller's and must not change; NULL or limits that dr_limits_check() refuses:
 * LOCKED for good. ring: memory of the log, at least one record; NULL or size 0: never arms. */
void dr_guard_init(dr_guard *g, const dr_limits *limits, dr_record *ring, uint16_t size);

/* What ended the time before. */
typedef enum {
    DR_START_POWER_ON,    /* nothing that is known of: nothing was under way */
    DR_START_AFTER_RESET, /* a watchdog, a brown-out, a kill: something may move. The first byte is a ^C */
    DR_START_MID_FRAME /* the same, while a frame left (dr_guard_is_mid_frame): the controller may hold half of it, and
                          * any byte might complete it. DR_FAULT_TORN: nothing is sent until CONFIRM */
} dr_start;
/* Power is on. Call dr_guard_link() next; the proof of identity begins 1 s after the device is present. */
void dr_guard_start(dr_guard *g, dr_us now, dr_start how);

void dr_guard_push_host(dr_guard *g, dr_us now, const uint8_t *bytes, size_t count);
void dr_guard_push_device(dr_guard *g, dr_us now, const uint8_t *bytes, size_t count);
/* Bytes that leave now; how many, 0 when there are none yet. */
size_t dr_guard_pull_device(dr_guard *g, dr_us now, uint8_t *bytes, size_t room);
size_t dr_guard_pull_host(dr_guard *g, dr_us now, uint8_t *bytes, size_t room);
/* A frame of more than one byte has been begun and not yet pulled to its end, or DR_FAULT_TORN waits for CONFIRM. Who may
 * be reset at any moment asks after each byte, before it goes to the line, and after each link or input; and keeps the
 * answer where a reset does not reach, until this says no and the line has sent its last byte: for dr_guard_start(). */
bool dr_guard_is_mid_frame(const dr_guard *g);
/* When something will happen by itself (a byte that must wait before it can be pulled counts). False: never, as things
 * are. At that instant call any function with that `now`, dr_guard_pull_device() for one. */
bool dr_guard_due(const dr_guard *g, dr_us *when);

/* What a person does. Never call it for anything that came over the host's wire. */
void dr_guard_input(dr_guard *g, dr_us now, dr_input what, bool on);
/* Cables: may be called with nothing changed. device_present false -> true: the identity is proved anew (after
 * DR_FAULT_TORN: from CONFIRM on; until then nothing leaves for the device, ^C neither). The caller looks
 * at the converter's serial number itself: another one than the limits' is a device that is not present. */
void dr_guard_link(dr_guard *g, dr_us now, bool host_open, bool device_present);
/* A byte was lost on the line from the host (overrun, framing or parity error): the frame is dropped. */
void dr_guard_host_line_error(dr_guard *g, dr_us now);
/* Do the limits and the state in memory hold what they should? Once a second, say; before every motion it is done anyway. */
bool dr_guard_self_check(dr_guard *g, dr_us now);

void dr_guard_get_status(const dr_guard *g, dr_guard_status *out);
/* The oldest record, in order. False: there is none. */
bool dr_guard_pull_log(dr_guard *g, dr_record *out);

#ifdef __cplusplus
}
#endif
#endif
