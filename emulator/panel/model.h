/* model: what an emulator has told about one of its controllers: its display, its devices, where they have been, and what
 * went over its wire. It is fed the lines of the control channel, one after the other; whoever draws reads it.
 *
 * Lengths are microsteps, as on the wire; quanta_per_step of a device turns them into microns.
 * Thread-safety: one thread at a time per model. */
#ifndef MODEL_H
#define MODEL_H

#include "dr_device.h" /* dr_kind, dr_stage */

#include <stdint.h>

#define MODEL_LOG 64u
#define MODEL_TEXT 160u
#define MODEL_PATH 256u
#define MODEL_NAME 64u

typedef enum { MODEL_DARK, MODEL_PLAIN, MODEL_GREEN, MODEL_BLUE, MODEL_RED, MODEL_COLOURS } model_colour;

typedef struct {
    char name[MODEL_NAME]; /* "MP-845"; "none" */
    bool is_there;
    dr_stage stage;
    uint32_t at_steps[DR_AXES], work_steps[DR_AXES];
    bool work_is_set;
    /* where it has been: a ring of corners, the newest last */
    uint32_t path_steps[MODEL_PATH][DR_AXES];
    unsigned path_first, path_count;
    bool is_on_leg; /* and where that ends */
    uint32_t leg_to_steps[DR_AXES];
} model_device;

typedef enum { MODEL_FROM_HOST, MODEL_TO_HOST, MODEL_HAPPENED } model_side;

typedef struct {
    uint64_t when_us;
    model_side side;
    char gathers[8]; /* the newest of its kind stands for all in a row: "stream", "placed"; else "" */
    char hex[48];    /* bytes, "" when it is none */
    char text[MODEL_TEXT];
} model_entry;

typedef struct {
    /* `state` */
    char name[MODEL_NAME]; /* of the controller; "": the first one that is told of */
    unsigned controllers;  /* of the rig */
    bool is_known;         /* `state` and `panel` have been answered */
    dr_kind kind;
    char firmware[16], port[256], state[16], clock[8];
    bool is_open;          /* a host has its port open */
    bool waits_for_client; /* and the clock stands until one has opened a port */
    uint64_t now_us;
    unsigned active; /* index of the active device */
    unsigned angle_deg;
    uint32_t home_steps[DR_AXES]; /* TRIO */
    model_device devices[DR_PORTS];
    unsigned device_count;

    /* `panel` */
    bool is_shown;
    model_colour colour;
    char text[256]; /* of the display, up to four lines */
    bool is_locked, is_relative, led_diagonal, moves, sets_angle;
    unsigned mode; /* SPEED of a TRIO */
    unsigned beeps;
    char down[128]; /* buttons that are down, each with a space before and behind: " home work " */

    /* events */
    model_entry log[MODEL_LOG]; /* a ring */
    unsigned log_first, log_count;
} model;

void model_init(model *m, const char *name);
/* Another controller of the rig, or the same one again, as nothing was known of it. */
void model_choose(model *m, const char *name);

typedef enum {
    MODEL_NOTHING, /* no line of the control channel */
    MODEL_EVENT,
    MODEL_STATE,
    MODEL_PANEL,
    MODEL_DONE,   /* an order was carried out */
    MODEL_REFUSED /* why[] tells */
} model_line;

/* Takes a line in. next[], if not NULL, becomes the name of the controller that follows this one in a `state` of the rig. */
model_line model_take(model *m, const char *line, char why[MODEL_TEXT], char next[MODEL_NAME]);

/* Tells those who look at the log something of one's own. */
void model_say(model *m, const char *text);

double model_um(const model_device *d, uint32_t steps);
const model_device *model_active(const model *m);
/* The n-th newest entry of the log, 0 the newest; NULL: so many there are not. */
const model_entry *model_entry_at(const model *m, unsigned n);
/* The position answer of the wire ('c', 'C') as it would be now, in hexadecimal. */
void model_position_answer(const model *m, char out[64]);

#endif
