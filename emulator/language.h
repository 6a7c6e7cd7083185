/* language: what can be told to a running emulator, on its control channel, with --do and in rig files: a line of words, and
 * a JSON object for an answer. dryrig-control.7 defines it.
 *
 * The verbs stand in tables; a new one is a row in a table, and a new table is one more in `tables` of language.c.
 * Thread-safety: one thread. */
#ifndef LANGUAGE_H
#define LANGUAGE_H

#include "engine.h" /* stations, clock */
#include "setup.h"  /* WHY_ROOM, quirks */
#include "trace.h"  /* trace on, trace off */

#include <cjson/cJSON.h>

#define LANGUAGE_WORDS 24u
#define LANGUAGE_LINE 512u

typedef struct language language;

/* A line that is being carried out. */
typedef struct {
    language *l;
    station *s;                            /* the controller it is about; NULL: none was named, and there are several */
    const char *words[LANGUAGE_WORDS + 1]; /* NULL behind the last */
    unsigned at;                           /* the word that is looked at */
    cJSON *answer;
    bool follows;  /* the asker wants to be told what happens from now on */
    bool is_check; /* it is read, and not carried out */
    bool is_later; /* it stands behind `at`, `in`, `after` or `on` */
    bool was_read; /* to its end, and nothing is wrong with it as it stands there */
    bool has_usage;
    char why[WHY_ROOM];
} telling;

typedef struct {
    const char *name;              /* the first word */
    const char *usage;             /* what follows it */
    const char *help;              /* one line */
    bool needs_one;                /* it is about one controller */
    bool (*carry_out)(telling *t); /* t->at is behind the verb. False: t->why says what was expected */
} verb;

struct language {
    engine *e;
    trace *trace; /* NULL: none */
    struct trigger *triggers;
    unsigned depth; /* in a line that another line, or time, has made */
};

/* Carries out a line. {"ok":true, ...} or {"ok":false,"why":"..."}; the caller deletes it. *follows may be NULL. */
cJSON *language_do(language *l, const char *line, bool *follows);
/* The same, for who only wants to know whether it could be done. False: why[] tells what was expected. */
bool language_done(language *l, const char *line, char why[WHY_ROOM]);
/* Could a line be carried out? What the controllers are by then counts for nothing: 'power on' is right while it is on. False:
 * why[] says what was expected, at the character of that number (from 1). */
bool language_check(language *l, const char *line, char why[WHY_ROOM], unsigned *column);
/* Takes what waits for its time or its command back. */
void language_close(language *l);

/* -- For verbs ----------------------------------------------------------------------------------------------------------- */

/* The next word, or NULL; or "", for who reads it as a value. */
const char *telling_next(telling *t);
const char *telling_word(telling *t);
/* Is the next word this one? Then it is taken. */
bool telling_take(telling *t, const char *word);
/* The line has been read, and nothing may follow. False also where it is only to be checked. So a verb first reads all of its
 * words, then comes this, then what depends on how things are, then it acts. */
bool telling_ends(telling *t);
/* t->why, and false. */
__attribute__((format(printf, 2, 3))) bool telling_wrong(telling *t, const char *format, ...);
/* What a value's reader says of a word: why begins with "expected" where there is none ("", or NULL). */
bool telling_about(telling *t, const char *word, const char *why);
/* The next word as a time. */
bool telling_time(telling *t, uint64_t *us);
/* The next word as a command of the controller: 'S', '^C' or its name. */
bool telling_command(telling *t, dr_op *op);
/* Lets the rest of the line be carried out later, at an instant of the controllers' clock. */
bool telling_later(telling *t, uint64_t when_us, const char *line, bool is_passive);

/* Tables. */
extern const verb verbs_rig[];   /* clock, power, plugs, settings; the last has no name */
extern const verb verbs_fault[]; /* what goes wrong */
extern const verb verbs_hands[]; /* buttons, knobs, switches, the display */
/* Forgets the buttons that are down. */
void verbs_hands_close(engine *e);

#endif
