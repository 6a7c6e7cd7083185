/* kept: what a controller keeps while its emulator does not run, in a file (--state): where its stages stand, home, work,
 * angle, switches, and what hangs on its ports.
 *
 * The file is text in libconfig's language, with a version. It is written anew beside itself and put in its place by one
 * rename: a program that is killed at any instant leaves the old one or the new one. It is written when nothing moves and
 * something has changed, so a move that never ended leaves the place where it began.
 *
 * Thread-safety: one thread at a time per file. */
#ifndef KEPT_H
#define KEPT_H

#include "instrument.h" /* the controller and its panel */
#include "values.h"     /* WHY_ROOM */

typedef struct {
    uint32_t position_steps[DR_AXES], work_steps[DR_AXES];
    uint8_t stage; /* dr_stage_id; DR_STAGE_NONE: nothing is connected, and nothing else is kept but the switches */
    uint8_t calibration; /* dr_calibration */
    uint8_t rear, right; /* switches, bit 0 is number 1 */
    bool work_is_set;
} kept_drive;

typedef struct {
    dr_kind kind;
    kept_drive drives[DR_PORTS];  /* the first one alone of a TRIO */
    uint32_t home_steps[DR_AXES]; /* TRIO */
    uint8_t angle_deg;            /* TRIO */
    uint8_t inside;               /* switches: a TRIO's internal ones, those of a ROE-200 */
} kept_state;

/* Reads a file. False: it cannot be read, and why[] tells, where something is wrong in it with FILE:LINE:COLUMN. No file is
 * no error: *is_there tells. */
bool kept_read(const char *path, kept_state *out, bool *is_there, char why[WHY_ROOM]);

/* What an instrument would keep, if it were left as it is now. */
kept_state kept_of(const instrument *ins);
/* Sets the switches of one that has just been started. */
void kept_switches(const kept_state *k, instrument *ins);

/* -- The file of an instrument that runs ----------------------------------------------------------------------------------- */

typedef struct {
    char *path; /* NULL: none */
    int lock;
    bool has_begun, told;
    kept_state last; /* what is in the file */
} kept_file;

/* Takes the file for itself; it must still hold *expected (NULL: not be there). False: why[] tells. */
bool kept_open(kept_file *f, const char *path, const kept_state *expected, char why[WHY_ROOM]);
/* Writes it for the first time. False: why[] tells, and the file is as it was. */
bool kept_begin(kept_file *f, const instrument *ins, char why[WHY_ROOM]);
/* Writes what has changed, once nothing moves. What cannot be written is said on stderr, once; the file stays as it was. */
void kept_update(kept_file *f, const instrument *ins);
/* Writes what has changed, also in the middle of a move: it ends where it is. False: that could not be written. */
bool kept_close(kept_file *f, const instrument *ins);

#endif
