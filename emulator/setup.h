/* setup: one controller as somebody asked for it, by options or in a rig file: what was written, and what that stands for.
 *
 * Thread-safety: functions of their arguments only. */
#ifndef SETUP_H
#define SETUP_H

#include "instrument.h" /* dr_controller, dr_drive */
#include "kept.h"       /* what was kept of it */
#include "values.h"     /* WHY_ROOM */

#include "dr_words.h" /* dr_quirk_id */

/* What was written. NULL: nothing was. It is understood when all of it is known: what fits depends on the controller and its
 * firmware. */
typedef struct {
    const char *controller, *firmware, *home, *angle, *quirks, *pace;
    const char *state; /* the file of what was kept; what is not written here stands there */
    const char *devices[DR_PORTS], *positions[DR_PORTS], *works[DR_PORTS];
    unsigned device_count, position_count, work_count;
} setup_text;

typedef struct {
    dr_kind kind;
    uint16_t firmware; /* binary-coded decimal */
    dr_drive drives[DR_PORTS];
    uint8_t drive_count;          /* ports: 1 on a TRIO, DR_PORTS on an MPC-200 */
    uint32_t home_steps[DR_AXES]; /* TRIO */
    uint8_t angle_deg;            /* TRIO */
    uint16_t quirks;              /* DR_QUIRK_* */
    uint8_t byte_quirks;          /* INSTRUMENT_* */
    uint16_t quirk_ids;           /* the same, by name: bit 1 << dr_quirk_id */
    bool is_paced;
    const char *state; /* where it is kept; NULL: nowhere */
    bool was_kept;     /* there is such a file, and this is what stands in it */
    kept_state kept;
} setup;

/* What is wrong with a text: which one it is ("device", the second: index 1), how it reads, and what was expected. */
typedef struct {
    const char *what;
    unsigned index;
    const char *text;
    char why[WHY_ROOM];
} setup_problem;

/* False: *problem tells. */
bool setup_read(const setup_text *text, bool is_paced_by_default, setup *out, setup_problem *problem);
/* An instrument of this kind, not yet started. Its drives are drives[], DR_PORTS of them. */
void setup_apply(const setup *s, instrument *ins, dr_drive *drives);
/* ... and when it has been started. */
void setup_started(const setup *s, instrument *ins);

/* A quirk by its name, on or off. False: why[] tells what was expected. */
bool setup_has_quirk(const instrument *ins, dr_quirk_id id);
bool setup_knows_quirk(const instrument *ins, const char *name, char why[WHY_ROOM]);
bool setup_quirk(instrument *ins, const char *name, bool on, char why[WHY_ROOM]);

#endif
