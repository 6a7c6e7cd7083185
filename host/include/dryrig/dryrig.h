/* dryrig: drives a TRIO MP-245A or an MPC-200 micromanipulator controller, real or emulated, over a serial port.
 *
 * This header is the manual. A whole program:
 *
 *     dryrig_options options = dryrig_defaults(DRYRIG_MPC);
 *     options.port = "/dev/ttyUSB0";
 *     options.stage[0] = "MP-225";
 *     dryrig *d;
 *     char why[DRYRIG_WHY_MAX];
 *     if (dryrig_open(&d, &options, why, sizeof why) != DRYRIG_OK) {
 *         fprintf(stderr, "%s\n", why);
 *         return 1;
 *     }
 *     const double target_um[DRYRIG_AXES] = {1000, 2000, 500};
 *     dryrig_position end;
 *     if (dryrig_move_um(d, target_um, DRYRIG_ORDER_AUTO, &end) != DRYRIG_OK)
 *         fprintf(stderr, "%s\n", dryrig_why(d));
 *     dryrig_close(d);
 *
 * Sources cited below: [T] TRIO MP-245A quick reference rev. 3.16k2; [M] MPC-325 quick reference rev. 3.21K (the
 * MPC-200 is its controller); [P] PROTOCOL.md of this project, where the manuals contradict each other or themselves.
 *
 * UNITS are in the names: _um microns, _steps microsteps of the stage, _us microseconds, _ms milliseconds, _deg
 * degrees. Coordinates are absolute, from the beginning of travel [T note 6, M note 6]: 0 to the travel of the stage.
 *
 * RESULTS. Functions return DRYRIG_OK (0) or a negative dryrig_error; dryrig_why() then says in a sentence what
 * happened, with its numbers. Nothing prints, nothing is global.
 *
 * WHAT IS PROMISED. An answer is handed out only when it cannot be another one: of the documented length, ended by CR,
 * followed by silence, and, for queries, given twice alike. A move has succeeded only when the controller has said so
 * and then stands where it should. After anything else the library is in doubt, and gets back in step before it sends
 * the next command (see dryrig_resync()). No coordinate that is negative or beyond the travel is ever sent.
 *
 * BLOCKING. Every function returns after a bounded time: queries and settings after a few times answer_ms; motions
 * after margin times what distance and speed give, plus grace_ms [T note 10, M note 10].
 *
 * THREADS. One thread at a time per handle; handles are independent of each other. dryrig_interrupt() and
 * dryrig_clear_interrupt() may be called from any thread, and from a signal handler, until dryrig_close(). */
#ifndef DRYRIG_H
#define DRYRIG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define DRYRIG_API __attribute__((visibility("default")))
#else
#define DRYRIG_API
#endif

#define DRYRIG_AXES 3
enum { DRYRIG_X, DRYRIG_Y, DRYRIG_Z };

#define DRYRIG_DRIVES 4  /* manipulators on one MPC-200, numbered 1 to 4, daisy chain included [M table 9, 'U'] */
#define DRYRIG_SPEEDS 16 /* speed levels of a straight line, 0 slowest to 15 [T note 11, M note 12] */
#define DRYRIG_MODES 10  /* ROE modes 0 coarsest to 9 finest [M table 9, 'L'] */
#define DRYRIG_ANGLE_MAX_DEG 90 /* [T note 13] */

typedef enum { DRYRIG_TRIO = 1, DRYRIG_MPC = 2 } dryrig_controller; /* TRIO MP-245A; MPC-200 */

typedef struct dryrig dryrig; /* one controller at one port */

/* -- Errors and whose fault they are ------------------------------------------------------------------------------- */

typedef enum {
    DRYRIG_OK = 0,

    /* the caller's: nothing was sent */
    DRYRIG_ERR_ARGUMENT = -1,    /* a bug: a null pointer, an impossible option, a call from within a callback */
    DRYRIG_ERR_NO_STAGE = -2,    /* microns, but the stage of the active drive was not said; or no stage of that name */
    DRYRIG_ERR_RANGE = -3,       /* a target, speed, angle, drive or mode that the controller does not have */
    DRYRIG_ERR_UNSUPPORTED = -4, /* this controller, or its firmware, has no such command */

    /* the computer's */
    DRYRIG_ERR_MEMORY = -10,
    DRYRIG_ERR_NO_PORT = -11,   /* there is no such port */
    DRYRIG_ERR_PORT_BUSY = -12, /* another program has it */
    DRYRIG_ERR_PORT = -13,      /* the system does not let us use it: permission, not a serial port, driver */

    /* the line's or the controller's */
    DRYRIG_ERR_LINK = -20,        /* the port failed while in use: unplugged, or the emulator ended */
    DRYRIG_ERR_TIMEOUT = -21,     /* no answer in time */
    DRYRIG_ERR_GARBLED = -22,     /* an answer, but not a documented one */
    DRYRIG_ERR_OUT_OF_STEP = -23, /* could not get back in step; see dryrig_resync() */
    DRYRIG_ERR_REFUSED = -24,     /* the controller says no (an absent drive, an angle not taken), or a guard does */
    DRYRIG_ERR_STOOD_STILL = -25, /* the controller answered a move, or ignored it, and nothing moved */
    DRYRIG_ERR_ELSEWHERE = -26,   /* the move ended, but not at its target */
    DRYRIG_ERR_CHANGING = -27,    /* the position is not the same twice: a knob is turned, or something moves */

    /* a person's */
    DRYRIG_ERR_INTERRUPTED = -30, /* by dryrig_interrupt() */
    DRYRIG_ERR_STOPPED = -31,     /* by STOP on the ROE */
    DRYRIG_ERR_OTHER_DRIVE = -32, /* the active drive is not the one that was selected here: changed on the ROE */
    DRYRIG_ERR_CANNOT_STOP = -33 /* the present motion has no interrupt (TRIO: all but the straight line [T note 12]) */
} dryrig_error;

typedef enum {
    DRYRIG_FAULT_NONE,
    DRYRIG_FAULT_CALLER,     /* correct the program or the target */
    DRYRIG_FAULT_COMPUTER,   /* correct the computer's set-up */
    DRYRIG_FAULT_CONTROLLER, /* look at the cable, the controller, the stage */
    DRYRIG_FAULT_PERSON      /* somebody wanted this */
} dryrig_fault;

/* A short, constant English text; never NULL. */
DRYRIG_API const char *dryrig_strerror(int error);
/* The name as above, without its prefix: "timeout", "no-stage". For logs and programs; never NULL. */
DRYRIG_API const char *dryrig_error_name(int error);
DRYRIG_API dryrig_fault dryrig_fault_of(int error);

/* -- Links: how bytes get to the controller ------------------------------------------------------------------------ */

/* Functions of a link return a count (0 and up) or a negative dryrig_error. The clock is part of the link, so that a
 * test can run in virtual time. Two links are built in; dryrig_link_open() opens the right one. */
typedef struct {
    void *context; /* handed to every function */
    /* Waits up to timeout_us for a byte at least, takes what there is up to room. 0: none came; may come early. */
    int (*read)(void *context, void *bytes, size_t room, uint32_t timeout_us);
    /* Sends all bytes and returns when they have left the computer. 0, or an error. */
    int (*write)(void *context, const void *bytes, size_t count);
    /* Forgets everything received and not yet read [T note 3, M note 3]. 0, or an error. */
    int (*purge)(void *context);
    /* A clock that never goes back. */
    uint64_t (*now_us)(void *context);
    void (*sleep_us)(void *context, uint32_t span_us);
    void (*close)(void *context);
} dryrig_link;

#define DRYRIG_WHY_MAX 512 /* room for every explanation */

/* Opens a serial port (libserialport), or a PTY such as the emulator's (by itself: libserialport cannot), for this
 * program alone; 8 data bits, no parity, 1 stop bit, no flow control [T table 3, M table 5]. `port` is a path; links to
 * the device are followed. For programs that wrap a link, as a recorder does; dryrig_open() does it by itself.
 * Errors: NO_PORT (`why` lists the serial ports that there are), PORT_BUSY (`why` names the program that has it), PORT,
 * MEMORY, ARGUMENT. */
DRYRIG_API int dryrig_link_open(dryrig_link *out, const char *port, unsigned baud, char *why, size_t room);

/* Calls `each` for each serial port of this machine. PTYs are not among them. Errors: MEMORY, PORT. */
DRYRIG_API int dryrig_list_ports(void (*each)(void *context, const char *path, const char *description), void *context);

/* -- Opening ------------------------------------------------------------------------------------------------------- */

/* Always begin with dryrig_defaults(). */
typedef struct {
    dryrig_controller controller;
    const char *port;        /* a serial port or a PTY; not used with `link` */
    const dryrig_link *link; /* NULL: open `port`. Copied; closed by dryrig_close(), and if dryrig_open() fails */
    unsigned baud;           /* 57600 [T table 3], 128000 [M table 5]; some MPC-200 run at 125000 [P] */
    /* What is connected, by the manuals' names ("MP-845", as on the label); needed for microns and for the exact
     * travel. TRIO: stage[0]. MPC: stage[N - 1] is drive N's. NULL: not known, steps only. dryrig_stage_names() lists
     * them. */
    const char *stage[DRYRIG_DRIVES];
    unsigned firmware;  /* binary-coded decimal, 0x0321 is 3.21; 0: ask (MPC), 3.12 (TRIO: it has no query) */
    double margin;      /* a motion may last so many times what it should; 1 and up; 3 */
    unsigned grace_ms;  /* and so much longer; 2000 */
    unsigned answer_ms; /* time limit of a query's or a setting's answer; 1000 */
    bool ask_once;      /* believe a query's first answer: half the time, no protection from a flipped bit */
    bool is_fast;       /* believe a CR however early: for an emulator whose clock runs faster than real time */
} dryrig_options;

DRYRIG_API dryrig_options dryrig_defaults(dryrig_controller controller);

/* Opens and sends nothing yet: the first command gets in step first (about 0.1 s). On an error *out is NULL and `why`
 * (may be NULL when room is 0; DRYRIG_WHY_MAX is always enough) says what was wrong and what to do.
 * Errors: those of dryrig_link_open(), NO_STAGE, ARGUMENT. */
DRYRIG_API int dryrig_open(dryrig **out, const dryrig_options *options, char *why, size_t room);
/* Moves nothing and stops nothing. NULL is allowed. */
DRYRIG_API void dryrig_close(dryrig *d);
/* What the last function that failed on this handle has to say; valid until the next call. Never NULL. */
DRYRIG_API const char *dryrig_why(const dryrig *d);
/* All names of stages of a controller in one line. Works like snprintf. */
DRYRIG_API size_t dryrig_stage_names(dryrig_controller controller, char *out, size_t room);

/* -- Queries ------------------------------------------------------------------------------------------------------- */

typedef struct {
    int32_t steps[DRYRIG_AXES];
    double um[DRYRIG_AXES]; /* exact; only with has_um */
    bool has_um;            /* the stage is known */
    int drive;              /* MPC: the active drive; 0: TRIO, or a firmware that does not tell [P, position-13] */
    int angle_deg;          /* TRIO; -1: MPC */
} dryrig_position;

/* Where the active drive stands. [T 'c', M 'C'] Errors: CHANGING (*out is then the last answer), line errors. */
DRYRIG_API int dryrig_get_position(dryrig *d, dryrig_position *out);

typedef struct {
    dryrig_controller controller;
    unsigned firmware;             /* binary-coded decimal; MPC below 3.00 tells none: 0. TRIO: as in the options */
    int drive;                     /* MPC: the active one */
    int drives;                    /* MPC: how many are connected */
    bool connected[DRYRIG_DRIVES]; /* MPC from 3.00; TRIO and older MPC: false */
} dryrig_info;

/* What the controller says of itself. A TRIO says nothing: nothing is asked of it. [M 'K', 'U', 'A'] */
DRYRIG_API int dryrig_get_info(dryrig *d, dryrig_info *out);

typedef struct {
    const char *name;                  /* as the manuals print it */
    double um_per_step;                /* [T table 4, M table 6] */
    int32_t travel_steps[DRYRIG_AXES]; /* the last step of each axis [T table 5, M table 7, P] */
    double full_speed_um_per_s;        /* of each axis, in all motions but the straight line [T note 11, M table 8] */
    double line_um_per_s; /* of a straight line at level 0; level s: (s + 1) times that [T note 11, M note 12] */
} dryrig_stage;

/* A stage by its name. Errors: NO_STAGE. */
DRYRIG_API int dryrig_get_stage(dryrig_controller controller, const char *name, dryrig_stage *out);

/* Microns to the nearest microstep of the stage of `drive` (MPC; 0 on a TRIO), and back. The target must lie in the
 * travel. Errors: NO_STAGE, RANGE, ARGUMENT. Nothing is sent. */
DRYRIG_API int dryrig_um_to_steps(dryrig *d, int drive, const double um[DRYRIG_AXES], int32_t steps[DRYRIG_AXES]);
DRYRIG_API int dryrig_steps_to_um(dryrig *d, int drive, const int32_t steps[DRYRIG_AXES], double um[DRYRIG_AXES]);

/* -- Motions -------------------------------------------------------------------------------------------------------- *
 *
 * All block until the motion is over. Each asks for the position first, checks the target, moves, and asks again when
 * the controller has said that it is done. *end (may be NULL) is where it stands then: set on DRYRIG_OK, INTERRUPTED,
 * STOPPED, STOOD_STILL and ELSEWHERE, and on TIMEOUT when the motion could be stopped (it was, and this is where); all
 * zero, with drive -1, on every other result.
 *
 * Where the position is the target already, nothing is sent. Some MPC-200 ignore moves of under 16 microsteps on all
 * axes and answer nothing [P, small-move-silent]: then the result is STOOD_STILL.
 * The active drive of an MPC can be changed on the ROE. A motion goes only to the drive that was last selected here,
 * or, before that, was the first seen here; otherwise: OTHER_DRIVE.
 * A TRIO whose angle is set to 0 or 90 degrees does not move Z or X [T note 13]: the result is ELSEWHERE or
 * STOOD_STILL.
 *
 * Errors of all: RANGE, UNSUPPORTED, INTERRUPTED, STOPPED, OTHER_DRIVE, STOOD_STILL, ELSEWHERE, CHANGING, line errors;
 * with microns NO_STAGE as well. */

typedef enum {
    /* MPC: all axes at once. TRIO: work order when Z grows (going in), home order otherwise (coming out) */
    DRYRIG_ORDER_AUTO,
    DRYRIG_ORDER_HOME, /* TRIO: X and Z first, as the angle demands, Y last [T 'H'] */
    DRYRIG_ORDER_WORK  /* TRIO: Y first, then X and Z [T 'W'] */
} dryrig_order;

/* To a position at full speed. [M 'M'; T 'H', 'W'] */
DRYRIG_API int dryrig_move_um(dryrig *d, const double target_um[DRYRIG_AXES], dryrig_order order, dryrig_position *end);
DRYRIG_API int dryrig_move_steps(dryrig *d, const int32_t target_steps[DRYRIG_AXES], dryrig_order order,
                                 dryrig_position *end);

/* To a position in a straight line at speed level 0 to 15; MPC from firmware 3.00 [T, M 'S']. With `stream` the
 * callback of dryrig_watch() gets the position at every micron (MPC only [M 'O', note 16]; UNSUPPORTED on a TRIO). */
DRYRIG_API int dryrig_line_um(dryrig *d, const double target_um[DRYRIG_AXES], int speed_level, bool stream,
                              dryrig_position *end);
DRYRIG_API int dryrig_line_steps(dryrig *d, const int32_t target_steps[DRYRIG_AXES], int speed_level, bool stream,
                                 dryrig_position *end);

/* One axis (DRYRIG_X, DRYRIG_Y, DRYRIG_Z) to a coordinate; the others stay. [T 'x', 'y', 'z'; MPC: 'M' with the others
 * as they are] */
DRYRIG_API int dryrig_axis_um(dryrig *d, int axis, double target_um, dryrig_position *end);
DRYRIG_API int dryrig_axis_steps(dryrig *d, int axis, int32_t target_steps, dryrig_position *end);

/* Home: TRIO: to the position that its HOME button stores; MPC: to 0,0,0 [P]. [T 'h', M 'H'] */
DRYRIG_API int dryrig_home(dryrig *d, dryrig_position *end);
/* To the stored work position. An MPC goes there only right after a Home [P]: otherwise STOOD_STILL. On a TRIO standing
 * still is success: it may be there already. [T 'w', M 'Y'] */
DRYRIG_API int dryrig_work(dryrig *d, dryrig_position *end);
/* Recalibrates (TRIO from 2.62 [T 'R'], MPC from 1.04 [M 'N']): runs to the beginning of travel. Take the electrode out
 * of the way first. An interrupted calibration leaves an MPC uncalibrated until a power cycle and a whole one [P]. */
DRYRIG_API int dryrig_calibrate(dryrig *d, dryrig_position *end);
/* To the middle of the travel; MPC up to 1.03 only, where 'N' means this: options.firmware must say so. [M 'N'] */
DRYRIG_API int dryrig_centre(dryrig *d, dryrig_position *end);

/* Stops what moves, whoever began it (MPC), or a straight line (TRIO), and says where it stands. For a motion under way
 * in another thread use dryrig_interrupt(). It also frees an MPC that waits for the rest of a command since a program
 * was killed while sending. Errors: CANNOT_STOP (a TRIO that is in another motion, or off), line errors. [^C] */
DRYRIG_API int dryrig_stop(dryrig *d, dryrig_position *end);

/* -- Interrupting and watching a motion ---------------------------------------------------------------------------- */

/* Stops the motion that another thread, or the code below this signal handler, waits for: within a few milliseconds it
 * sends ^C, and returns INTERRUPTED. Async-signal-safe; never blocks.
 * Between motions it is kept, so that a stop is never lost: the next motion returns INTERRUPTED at once and sends
 * nothing. Returns DRYRIG_OK, or CANNOT_STOP when the present motion cannot be stopped: it ends as planned, and the
 * next motion returns INTERRUPTED. */
DRYRIG_API int dryrig_interrupt(dryrig *d);
/* Forgets an interrupt that is kept. */
DRYRIG_API void dryrig_clear_interrupt(dryrig *d);

typedef struct {
    bool streamed; /* `position` is a streamed one; otherwise it is where the motion began */
    dryrig_position position;
    uint32_t elapsed_ms;  /* since the command was sent */
    uint32_t expected_ms; /* what distance and speed give; an upper bound where the path is not known */
} dryrig_motion;

/* The callback is called for each streamed position, and about ten times a second during a motion. It runs in the
 * thread that called the motion and may call dryrig_interrupt(), nothing else of this handle. NULL: none. */
DRYRIG_API void dryrig_watch(dryrig *d, void (*callback)(void *context, const dryrig_motion *motion), void *context);

/* -- Settings ------------------------------------------------------------------------------------------------------ */

/* TRIO: the angle of the rotary dovetail, 0 to 90 degrees; asked back. Errors: RANGE, UNSUPPORTED (MPC), REFUSED, line
 * errors. [T 'A'] */
DRYRIG_API int dryrig_set_angle(dryrig *d, int angle_deg);
/* MPC: makes drive 1 to 4 the active one; asked back. Errors: RANGE, UNSUPPORTED (TRIO), REFUSED (not connected), line
 * errors. [M 'I'] */
DRYRIG_API int dryrig_select(dryrig *d, int drive);
/* MPC: the ROE mode of the active drive, 0 to 9; cannot be asked back. Errors: RANGE, UNSUPPORTED (TRIO), line errors.
 * [M 'L'] */
DRYRIG_API int dryrig_set_mode(dryrig *d, int mode);

/* -- Getting back in step ------------------------------------------------------------------------------------------ */

/* After TIMEOUT, GARBLED and other surprises late bytes may still come: a move's CR, the rest of an answer. The next
 * function then waits for silence and asks for the position until two answers in a row are exact before it does its own
 * work. If a motion that can be stopped has not answered, ^C comes first: fifteen, 2 ms apart, so that also a command
 * that lost bytes on its way ends, and what it began is stopped at once.
 *
 * In one case a person must decide: a targeted TRIO motion other than the straight line has not answered. It may still
 * run; or the command lost a byte, and then the next byte sent completes it with a wild target that nothing can stop.
 * Until dryrig_resync() is called, every function returns OUT_OF_STEP. Before: look at the stage; if it stands still
 * short of its target, switch the controller off and on.
 *
 * Errors: OUT_OF_STEP, TIMEOUT, LINK. */
DRYRIG_API int dryrig_resync(dryrig *d);

#ifdef __cplusplus
}
#endif
#endif
