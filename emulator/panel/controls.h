/* controls: which key works which control of a panel, and what the emulator is told then.
 *
 * Thread-safety: constant tables. */
#ifndef CONTROLS_H
#define CONTROLS_H

#include "model.h" /* what is known of the controller */

#include "dr_device.h" /* dr_kind */

/* A button. Its capital letter holds it. */
typedef struct {
    char key;
    const char *label;      /* as on the box */
    const char *name;       /* in the control language */
    const char *held;       /* what a hold does, in a word; NULL: nothing else */
    const char *held_order; /* lines of the control language */
} control_button;

/* A knob or a selector, one way. */
typedef struct {
    int key;          /* as ncurses names it */
    const char *name; /* in the control language */
    int way;          /* 1 clockwise, -1 */
    bool is_selector; /* one click a key, however far the knobs are turned by one */
} control_knob;

/* Both end with a key of 0. */
const control_button *controls_buttons(dr_kind kind);
const control_knob *controls_knobs(dr_kind kind);
/* How a panel is used: lines of up to 78 characters, NULL behind the last. */
const char *const *controls_help(dr_kind kind);

typedef enum { CONTROL_PRESSED, CONTROL_HELD, CONTROL_TURNED } control_use;

/* Why a control will do nothing as things are, and what helps; NULL: it will do something. Only a hint: what happens is
 * decided by the emulator, whose state may be newer. */
const char *controls_hint(const model *m, const char *name, control_use use);

#endif
