/* lint: which rules of the protocol a host program breaks, with the exact bytes and the time.
 *
 * An observer (observe.h) of any number of stations. A command is judged as the host wrote it, not as it arrived: what the
 * host had been answered and had read by then decides. Nothing is judged that the host could not know: moves begun by hand,
 * a controller without power or one that hangs, what follows a fault, and what follows a ^C that came late because the
 * controller's clock runs ahead.
 *
 * The rules, their numbers and their names stay: a report of today can be compared with one of next year.
 *
 * No OS calls and no clock; memory for findings is the lint's own. Thread-safety: one thread at a time per lint. */
#ifndef LINT_H
#define LINT_H

#include "observe.h" /* what it looks at */

#define LINT_PAUSE_US 2000u     /* between a reply and the next command [T note 2, M note 2] */
#define LINT_GAVE_UP_US 100000u /* a host that waited for so long did wait; one that did not, never meant to (chosen) */
#define LINT_FINDINGS_MAX 10000u /* that are kept; more are counted */
#define LINT_TEXT 200u

typedef enum {
    LINT_EARLY_COMMAND,
    LINT_HURRIED_COMMAND,
    LINT_NO_PAUSE_IN_S,
    LINT_BEYOND_TRAVEL,
    LINT_SWAPPED_BYTES,
    LINT_SHORT_TIME_LIMIT,
    LINT_UNREAD_REPLY,
    LINT_WRONG_COMMAND,
    LINT_UPPER_CASE_AXIS,
    LINT_ANGLE_EXTREME,
    LINT_WORK_WITHOUT_HOME,
    LINT_SMALL_MOVE,
    LINT_QUERY_IN_MOVE,
    LINT_STREAMING_ASSUMED,
    LINT_WRONG_BAUD,
    LINT_THIRTEEN_BYTES,
    LINT_NO_WORK_POSITION,
    LINT_SPEED_TOO_HIGH,
    LINT_VALUE_OUT_OF_RANGE,
    LINT_RULES
} lint_rule;

typedef struct {
    const char *name;    /* "early-command" */
    const char *breach;  /* what the program did, in one sentence */
    const char *source;  /* the manual's paragraph */
    const char *instead; /* what a program should do */
} lint_words;

/* The number of a rule as it is printed: 1 and up. */
static inline unsigned lint_number(lint_rule rule) { return (unsigned)rule + 1u; }
const lint_words *lint_words_of(lint_rule rule);

typedef struct {
    lint_rule rule;
    uint16_t station;            /* index into stations[] */
    uint64_t when_us;            /* of the controller's clock */
    uint8_t bytes[DR_FRAME_MAX]; /* the command; none where it is not about one */
    uint8_t count;
    char text[LINT_TEXT]; /* what makes this one a breach, in numbers */
} lint_finding;

/* What a host has left unread of older answers, as of its last command. Where it was so quick that this had been read before it
 * could be counted, it is supposed to read 13 bytes of each position and everything else to the end: the next time that there
 * is something to be counted tells whether that was so. */
typedef struct {
    bool is_known; /* counted, or supposed */
    uint32_t bytes;
    unsigned supposed;  /* findings since it was counted */
    unsigned first;     /* the first of them, if it is kept */
    unsigned positions; /* among the commands since then */
} lint_left;

/* What it knows of one station. */
typedef struct {
    const instrument *ins;
    char name[64];
    dr_kind kind;
    uint16_t firmware;
    dr_framer framer;  /* the host's bytes as written */
    uint64_t began_ns; /* the command in the framer: when its first byte was written */
    uint32_t late_us;  /* what may be missing of the pauses within it and before it: the emulator was late */
    uint32_t pause_us; /* within it */
    uint32_t unread;   /* when it began */
    bool read_behind;  /* something that should have been read before it */
    lint_left left;
    uint64_t command_ns; /* the last whole command; 0: none yet */
    uint64_t reply_ns;   /* the end of the last reply; 0: none since the last command */
    dr_op last;          /* the last command */
    unsigned in_flight;  /* commands that are on the line to the controller */
    bool reply_is_leaving;
    bool lost_reply;     /* to the last command, or a part of it: it could not be put into the port */
    bool said_streaming; /* 'F' or 'O' since the port was opened or the power came on */
    bool told_streaming; /* rule 14 once for each such time */
    bool is_excused; /* a fault has struck since the last command, or before, and what it has made late has not come */
    bool stopped_late; /* runs_ahead: a move was over before its ^C, and not all has been read since */
    bool told_late_stop;
    bool is_open;
} lint_station;

typedef struct {
    observer base;
    const char
        *runs_ahead; /* set by the owner behind lint_open(): the option by which moves end sooner than a host can stop
                             * them; NULL: none */
    lint_station *stations;
    unsigned station_count;
    lint_finding *findings; /* in order of time */
    unsigned finding_count, finding_room;
    unsigned long counts[LINT_RULES]; /* of all, kept or not */
    bool lacks_memory;                /* some are counted only */
    unsigned long late_stops;         /* that hosts have not noticed: what followed was not judged */
} lint;

void lint_open(lint *l);
void lint_close(lint *l);
unsigned long lint_total(const lint *l);

#endif
