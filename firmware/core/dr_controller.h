/* dr_controller: the emulated controller. Bytes are pushed in and pulled out; time is an argument.
 *
 * Nothing blocks, calls out, allocates or asks a clock. The caller owns every struct. Between calls the controller is a
 * value: copy it, and the copy goes on alike (but for the drives and notes it points to).
 *
 *     push    the host's bytes have arrived             pull   bytes for the host have left
 *     due     when something will happen by itself      poke   what hands do to the box: power, plugs, knobs
 *                                                       apply  what the buttons of its panel ask for (dr_panel.h)
 *
 * `now` never goes back. Every call first settles what was due by `now`, in order of time. A caller that comes at each
 * due instant gets every byte at its exact time; one that comes later finds the same moves and replies, but of streamed
 * positions only the newest, as on a line that was busy.
 *
 * "Left" is the caller's to define, and that paces the line: the next kept command starts, and the next streamed frame is
 * made, in the pull that takes the last byte of the one before.
 *
 * Line faults are counters, not return codes. Thread-safety: one thread at a time per controller. */
#ifndef DR_CONTROLLER_H
#define DR_CONTROLLER_H

#include "dr_device.h" /* dr_kind, dr_stage_id, dr_us */
#include "dr_motion.h" /* dr_leg */
#include "dr_wire.h"   /* dr_framer */

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* -- What is set up before the controller is switched on ------------------------------------------------------------- */

/* Behaviour of real units that the manuals do not promise [P, quirks]. A set of bits. Those that only change the bytes of
 * replies (position-13, stop-says-i, nul-heartbeat) are not here: they belong to a layer around the core. */
enum {
    DR_QUIRK_SMALL_MOVE_SILENT = 1u << 0,  /* MPC: a move of under 16 steps on each axis is ignored, without a CR */
    DR_QUIRK_S_NEEDS_PAUSE = 1u << 1,      /* MPC: an 'S' with under 20 ms of pause in all wedges it */
    DR_QUIRK_MEASURED_SPEEDS = 1u << 2,    /* MPC: the speeds that were measured, not the documented ones */
    DR_QUIRK_BOOT_SECOND = 1u << 3,        /* deaf for one second after power-on */
    DR_QUIRK_STREAM_AT_POWER_UP = 1u << 4, /* MPC: streaming is on from the start */
    DR_QUIRK_ENDLESS_NEGATIVE = 1u << 5,   /* a target above 0x7FFFFFFF runs the axis to 0 and never answers */
    DR_QUIRK_PAUSE_ON_STOP = 1u << 6,      /* ^C only pauses: the next move command resumes the old move */
    DR_QUIRK_QUERY_WEDGES = 1u << 7        /* a position query during a move wedges it */
};
#define DR_PAUSE_IN_LINE_US 20000u /* less than this in all, and DR_QUIRK_S_NEEDS_PAUSE strikes */

/* How far a drive's coordinates can be trusted [P]: a calibration that did not end spoils them until a power cycle and a
 * whole calibration. */
typedef enum { DR_CALIBRATED, DR_UNCALIBRATED, DR_UNCALIBRATED_CYCLED } dr_calibration;

/* One manipulator at one port. All of it but the mode and at_home outlives power-off. */
typedef struct {
    uint32_t position_steps[DR_AXES]; /* at rest; during a move: where the present leg began */
    uint32_t work_steps[DR_AXES];
    uint8_t stage;       /* dr_stage_id; DR_STAGE_NONE: nothing is connected */
    uint8_t calibration; /* dr_calibration */
    uint8_t diagonal;    /* MPC-200 switches 1-4 as a number 0..15 [M table 2] */
    uint8_t mode;        /* ROE mode 0..9 (MPC) */
    bool work_is_set;
    bool y_moves_home; /* MPC-200 switch 8 ON; TRIO external switch 5 ON: Y takes part in 'H' and 'Y', in 'h' */
    bool at_home;      /* MPC: the last completed motion was a Home */
} dr_drive;

/* A drive as the emulator starts it: connected, calibrated, 1,000 um on each axis (TRIO) or 0,0,0 (MPC), no work position. */
void dr_drive_init(dr_drive *drive, dr_stage_id id);

/* -- The controller -------------------------------------------------------------------------------------------------- */

typedef enum {
    DR_STATE_OFF,     /* no power */
    DR_STATE_BOOTING, /* deaf: DR_QUIRK_BOOT_SECOND */
    DR_STATE_REST,
    DR_STATE_MOVING,
    DR_STATE_STRANDED, /* the move is over and its CR never comes: DR_QUIRK_ENDLESS_NEGATIVE, an unplugged drive */
    DR_STATE_WEDGED,   /* silent until a power cycle */
    DR_STATE_PAUSED    /* TRIO: its own button holds a move to home or work; still a move, but no time passes in it */
} dr_state;

#define DR_KEPT_MAX 64u /* bytes of commands that came too early [P] */

typedef struct dr_notes dr_notes;

typedef struct {
    /* set by the owner before dr_controller_start(), or while the power is off */
    dr_drive *drives; /* drive_count of them: 1 on a TRIO, up to DR_PORTS on an MPC-200 */
    uint8_t drive_count;
    uint8_t kind;                 /* dr_kind */
    uint16_t firmware;            /* binary-coded decimal */
    uint16_t quirks;              /* DR_QUIRK_*; may change at any time */
    uint8_t angle_deg;            /* TRIO: 0..90 */
    bool calibrates_at_power_on;  /* TRIO external switch 6 */
    uint32_t home_steps[DR_AXES]; /* TRIO */
    dr_notes *notes;              /* where events go; NULL: nowhere */

    /* to be read by anybody, written by dr_controller only */
    uint8_t state;                                     /* dr_state */
    uint8_t active;                                    /* index of the drive that commands act on */
    bool streaming;                                    /* 'O' */
    uint16_t unknown_bytes, lost_bytes, kept_commands; /* line faults; stop counting at 65,535 */

    uint8_t move_op;    /* dr_op of the move under way, or of the one that ^C paused */
    uint8_t move_leg;   /* which leg of it */
    uint8_t move_level; /* its speed: 0..15 or DR_SPEED_FULL */
    bool move_answers;  /* its end is told by a CR */
    bool move_is_endless;
    bool move_is_paused;             /* DR_QUIRK_PAUSE_ON_STOP: waits to be resumed */
    uint32_t move_to_steps[DR_AXES]; /* where it goes in the end */
    dr_leg leg;
    dr_us leg_began; /* in DR_STATE_BOOTING: when the boot began; in DR_STATE_PAUSED: a span, how
                                             * much of the leg is done */
    uint32_t microns_streamed;

    dr_framer framer;          /* the frame that is arriving */
    uint32_t pause_us;         /* what the host has paused within it */
    uint8_t kept[DR_KEPT_MAX]; /* whole frames that wait for their turn */
    uint8_t kept_bytes;

    uint8_t out[DR_REPLY_MAX]; /* the reply or streamed frame that is leaving */
    uint8_t out_at, out_bytes;
    uint8_t out_op;        /* dr_op that it answers; the top bit: STOP on the ROE ended that move */
    uint8_t interrupt_crs; /* answers to ^C that follow it */
} dr_controller;

/* A controller that the owner can still adjust, with power off: newest firmware of the manual, factory settings. */
void dr_controller_init(dr_controller *c, dr_kind kind, dr_drive *drives, uint8_t drive_count);
/* Begins as one that has been on for a while: at rest, calibrated, listening. */
void dr_controller_start(dr_controller *c, dr_us now);

/* The host's bytes have arrived by now. Takes them all. */
void dr_controller_push(dr_controller *c, dr_us now, const uint8_t *bytes, size_t count);
/* The host made a pause of so long, on its own clock, before the bytes that are pushed next. Ports tell it so that the
 * pause within 'S' is judged on the host's time whatever the controller's clock does. */
void dr_controller_paused(dr_controller *c, uint32_t pause_us);
/* Bytes that leave for the host now. Returns how many, 0 when there are none yet. */
size_t dr_controller_pull(dr_controller *c, dr_us now, uint8_t *bytes, size_t room);
/* How many bytes wait to be pulled. */
size_t dr_controller_ready(const dr_controller *c);
/* Which command's answer the next byte to be pulled belongs to, and whether that byte is the answer's first. */
dr_op dr_controller_answering(const dr_controller *c, bool *first);
/* Whether the next byte to be pulled is the CR of a host's move that STOP on the ROE has ended (DR_EFFECT_STOP). It is that
 * move's one CR; a layer that plays the quirk stop-says-i sends 'I' in its place. */
bool dr_controller_answers_stop(const dr_controller *c);
/* When something will happen by itself: false: never, as things are; no instant is kept while nothing moves. Bytes that
 * wait to be pulled are not counted: whether they can leave is the caller's to know. */
bool dr_controller_due(const dr_controller *c, dr_us *when);

/* Where a drive (index, below drive_count) is now, to the microstep. */
void dr_controller_position(const dr_controller *c, uint8_t drive, dr_us now, uint32_t steps[DR_AXES]);

/* -- Hands ----------------------------------------------------------------------------------------------------------- */

typedef enum {
    DR_HAND_POWER_OFF,
    DR_HAND_POWER_ON,
    DR_HAND_CONNECT, /* plug `stage` into port `drive`; DR_STAGE_NONE: unplug what is there */
    DR_HAND_PLACE    /* turn the knobs until drive `drive` is at steps[] */
} dr_hand_kind;

typedef struct {
    uint8_t what;  /* dr_hand_kind */
    uint8_t drive; /* index */
    uint8_t stage; /* dr_stage_id */
    uint32_t steps[DR_AXES];
} dr_hand;

/* False: it cannot be done: the knobs are dead during moves and without power, the power is as asked for already, or the stage
 * does not fit there (dr_stage_fits). */
bool dr_controller_poke(dr_controller *c, dr_us now, const dr_hand *hand);

/* What the buttons of a controller's panel ask for, by dr_panel or by wired buttons. A move that is begun here has no CR. The
 * whole of it is one function that a build without panel does not link.
 *
 * A pause keeps how much of the leg is done, in whole microseconds, and going on moves the leg's beginning to that much
 * before now: the rest is the same function of time, so a pause at any instant, for any time, gains and loses no step. */
typedef enum {
    DR_EFFECT_HOME,
    DR_EFFECT_WORK,
    DR_EFFECT_CALIBRATE, /* MPC; up to firmware 1.03 it centres, as 'N' does [M table 9] */
    DR_EFFECT_PAUSE,     /* TRIO: a move to home or work, the host's 'h' and 'w' too */
    DR_EFFECT_RESUME,
    DR_EFFECT_STOP,       /* MPC: any move; a host's sends its one CR now, see dr_controller_answers_stop() */
    DR_EFFECT_SELECT,     /* MPC: value = drive (index) */
    DR_EFFECT_MODE,       /* MPC: value = 0..9, of the active drive */
    DR_EFFECT_ANGLE,      /* TRIO: value = 0..90 degrees */
    DR_EFFECT_STORE_HOME, /* TRIO: home is where it stands */
    DR_EFFECT_STORE_WORK  /* the active drive's work position is where it stands */
} dr_effect;

/* False: it cannot be done now. Pause and stop need a move, resume a paused one, everything else a controller at rest; a
 * move to the work position needs one that is stored and, on an MPC-200, a drive at home, as 'Y' does. */
bool dr_controller_apply(dr_controller *c, dr_us now, dr_effect effect, uint8_t value);

/* -- Rehearsing faults of the mechanics ------------------------------------------------------------------------------- */

/* The leg that begins now goes wrong: it lasts `times` times as long, and `axis` (DR_AXES: none) gets half of its way only
 * and is there in half of its time. Positions, streamed frames and ^C are those of the leg as it is then; its DR_NOTE_LEG
 * comes again. False: no leg begins now, `times` is 0, or the leg would last longer than INT32_MAX us; nothing changes. */
bool dr_controller_spoil_leg(dr_controller *c, dr_us now, uint8_t axis, uint16_t times);

/* -- Notes: what happened, in order, for traces and judges ------------------------------------------------------------ */

typedef enum {
    DR_NOTE_REQUEST,      /* a whole command has arrived: bytes */
    DR_NOTE_REPLY,        /* a reply is ready: bytes */
    DR_NOTE_STREAM,       /* a streamed frame is ready: bytes; value = its micron */
    DR_NOTE_FILLER,       /* CR or LF between commands: bytes[0] */
    DR_NOTE_UNKNOWN,      /* no command: bytes[0] */
    DR_NOTE_LOST,         /* more bytes than fit, or deaf: value = how many */
    DR_NOTE_KEPT,         /* a command came before the reply to the one before had left */
    DR_NOTE_STOP_IGNORED, /* TRIO: ^C during a move that it cannot stop */
    DR_NOTE_LEG,          /* a leg begins: value = how long it lasts (us), steps = where it ends */
    DR_NOTE_ARRIVED,      /* the move is over: steps = where */
    DR_NOTE_STOPPED,      /* ^C, power or plug ended the move: steps = where */
    DR_NOTE_RESUMED,      /* the old move goes on instead of the one that was asked for */
    DR_NOTE_STRANDED,     /* the move is over and its CR will not come */
    DR_NOTE_CLIPPED,      /* a target beyond the travel: value = axis */
    DR_NOTE_SPEED_CUT,    /* a speed level above 15: value = the level that counts */
    DR_NOTE_SMALL_MOVE,   /* ignored without a CR */
    DR_NOTE_AXIS_STANDS,  /* TRIO at 0 or 90 degrees: value = the axis that does not move */
    DR_NOTE_NO_WORK,      /* no work position is stored */
    DR_NOTE_NOT_AT_HOME,  /* MPC 'Y' when the last completed motion was no Home */
    DR_NOTE_BAD_VALUE,    /* angle, mode or drive out of range: value = it */
    DR_NOTE_NO_DRIVE,     /* MPC: nothing is connected, nothing is answered */
    DR_NOTE_WEDGED,
    DR_NOTE_POWER_OFF,
    DR_NOTE_POWER_ON,
    DR_NOTE_CONNECTED, /* value = dr_stage_id */
    DR_NOTE_HAND,      /* a button of the panel: value = dr_effect, bytes[0] = the effect's value */
    DR_NOTE_PLACED,    /* by hand: steps = where */
    DR_NOTE_STARTED    /* dr_controller_start() */
} dr_note_kind;

typedef struct {
    dr_us when;
    uint8_t what;  /* dr_note_kind */
    uint8_t op;    /* dr_op that it is about, or DR_OP_NONE */
    uint8_t drive; /* index */
    uint8_t count; /* of bytes */
    uint8_t bytes[DR_FRAME_MAX];
    uint32_t value;
    uint32_t steps[DR_AXES];
} dr_note;

/* A ring of the owner's memory; when it is full the oldest note gives way and is counted. */
struct dr_notes {
    dr_note *ring;
    uint16_t size, first, count;
    uint32_t missed;
};

void dr_notes_init(dr_notes *notes, dr_note *ring, uint16_t size);
/* The oldest note. False: there is none. */
bool dr_notes_take(dr_notes *notes, dr_note *out);

#ifdef __cplusplus
}
#endif
#endif
