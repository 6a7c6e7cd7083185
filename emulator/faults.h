/* faults: what goes wrong on real rigs, on demand: on the line in both directions, with the axes, with the controller.
 *
 * A rule names a fault and says when it strikes: at the next opportunity or the next N, always, by chance, for one command
 * only, between two instants. Opportunities: an answer (or a streamed frame) begins; a byte of the host arrives; a command
 * of the host begins, or is whole; a leg of a move begins, or a move. Chance comes from a number that the owner seeds: the same seed and the same
 * bytes at the same instants give the same faults.
 *
 * No OS calls and no clock; the caller owns the struct. The instrument asks, see instrument.c.
 * Thread-safety: one thread at a time per instrument. */
#ifndef FAULTS_H
#define FAULTS_H

#include "dr_controller.h"

typedef enum {
    FAULT_DROP_BYTE,      /* one byte of an answer, by chance, is lost */
    FAULT_DELAY_BYTE,     /* ... comes late */
    FAULT_DUPLICATE_BYTE, /* ... comes twice */
    FAULT_CORRUPT_BYTE,   /* ... comes with one bit changed */
    FAULT_DROP_CR,        /* the last byte of an answer is lost */
    FAULT_LATE_CR,
    FAULT_STRAY_BYTES,       /* two bytes of chance before an answer */
    FAULT_SLOW_ANSWER,       /* the whole answer comes late */
    FAULT_SHORT_FRAME,       /* a streamed frame lacks its last bytes, 1 to 11 by chance */
    FAULT_TORN_FRAME,        /* a streamed frame pauses in its middle */
    FAULT_LOSE_HOST_BYTE,    /* a byte of the host never arrives */
    FAULT_IGNORE_STOP,       /* ^C never arrives */
    FAULT_WEDGE,             /* deaf and mute from this command on, until the power goes */
    FAULT_STALL_AXIS,        /* an axis gets half of its way only, and nobody is told */
    FAULT_SLIP_AXIS,         /* an axis' position counts, its tip stays */
    FAULT_SLOW_MOTION,       /* a move lasts longer */
    FAULT_POWER_LOSS,        /* half way through a leg the power goes, for a while */
    FAULT_POWER_LOSS_FORGET, /* ... and the positions with it */
    FAULT_USB_UNPLUG,        /* the host's cable comes out when a command has arrived, for a while */
    FAULTS
} fault_id;

typedef enum {
    FAULT_OF_ANSWER,
    FAULT_OF_FRAME,
    FAULT_OF_HOST_BYTE,
    FAULT_OF_STOP,
    FAULT_OF_COMMAND,
    FAULT_OF_LEG,
    FAULT_OF_MOVE
} fault_chance;

typedef struct {
    const char *name;
    const char *meaning;
    uint32_t delay_us; /* 0: it does not take a time; else how late, or for how long, where nothing is said */
    uint8_t strikes;   /* fault_chance: what it strikes */
    bool takes_axis;
    uint8_t times; /* 0: it does not take a factor; else how many times as long, where nothing is said */
} fault_words;

#define FAULT_RULES 32u
#define FAULT_ALWAYS UINT32_MAX
#define FAULT_SURE 1000000u
#define FAULT_BYTES_MAX 3u /* that leave in the place of one */

typedef struct {
    uint8_t id; /* fault_id */
    uint8_t op; /* dr_op: only for this command; DR_OP_NONE: any */
    uint8_t axis;
    uint8_t times;              /* as long */
    uint32_t left;              /* how often it still strikes; FAULT_ALWAYS */
    uint32_t chance_millionths; /* FAULT_SURE */
    uint64_t from_us, until_us; /* between these instants; UINT64_MAX: no end */
    uint64_t delay_us;
} fault_rule;

typedef struct {
    fault_rule rules[FAULT_RULES];
    uint64_t random; /* where chance stands; never 0 */
    uint32_t struck; /* bits 1 << fault_id: since somebody looked */
    uint8_t count;
    bool has_chanced; /* chance has had a say */
    bool is_wedged;

    /* what has been settled for the answer that is leaving */
    bool is_answering;
    uint8_t at, length; /* the byte that comes next, of so many */
    uint8_t drop_from, drop_to, twice_at, corrupt_at, corrupt_bit, late_at, stray_count; /* UINT8_MAX: no byte */
    bool power_forgets;
    uint64_t late_us;

    /* plugs */
    uint64_t power_off_us, power_on_us; /* when the power goes, and comes back; 0: it does not */
    uint64_t without_power_us;
    uint64_t
        unplug_us; /* the USB plug is out for so long: for the instrument's owner to do, and to clear; 0: it is not */

    /* the move and the leg that were seen last */
    dr_us leg_began;
    uint32_t slip_from_steps;
    bool was_moving;
    uint8_t move_op, move_drive, leg_number;
    uint8_t slow_times; /* this move lasts so many times as long; 0: as ever */
    bool slips;         /* its slip_axis of slip_drive does, from slip_from_steps */
    uint8_t slip_axis, slip_drive;
    int64_t slipped_steps[DR_PORTS][DR_AXES]; /* how far positions are ahead of tips */
    bool has_slipped;
} faults;

const fault_words *faults_words(fault_id id);
bool faults_find(const char *name, fault_id *id);

void faults_init(faults *f, uint64_t seed);
/* False: there is no room for more rules. */
bool faults_add(faults *f, const fault_rule *rule);
/* All rules of a fault; FAULTS: every one. A controller that hangs goes on hanging. */
void faults_remove(faults *f, fault_id id);

/* -- For the instrument -------------------------------------------------------------------------------------------------- */

static inline bool faults_any(const faults *f)
{
    return f->count > 0 || f->is_answering || f->is_wedged || f->slips || f->has_slipped || f->slow_times > 0 ||
           f->power_off_us > 0 || f->power_on_us > 0;
}

/* A byte of an answer is about to get onto the line. Returns until when it waits; now_us or before: it does not. */
uint64_t faults_hold_us(faults *f, uint64_t now_us, const dr_controller *c);
/* The byte is through. Returns how many bytes the host gets for it, at out[]. */
uint8_t faults_byte(faults *f, uint8_t byte, uint8_t out[FAULT_BYTES_MAX]);
/* A byte of the host is through. False: the controller does not get it. */
bool faults_host_byte(faults *f, uint64_t now_us, const dr_controller *c, uint8_t byte);
/* The controller has been called: a leg may have begun or ended, the power may have gone. Also before a rule is added: it is
 * for what begins later. */
void faults_look(faults *f, uint64_t now_us, dr_controller *c);
/* When the mains switch has to be worked next, and how. False: not, as things are. */
bool faults_power_due(const faults *f, uint64_t *when_us, bool *on);
/* It is off now, and positions are lost: they will count from 0 where the tips stand, and cannot be trusted. */
void faults_forget_positions(faults *f, dr_controller *c);
/* How far the position of an axis, as it is now, is ahead of the tip. */
int64_t faults_slipped_steps(const faults *f, const dr_controller *c, uint8_t drive, uint8_t axis, dr_us now);

#endif
