/* explain: what a configuration means, in words: `dryrig-guard check` and `dryrig-guard explain`.
 *
 * Thread-safety: one thread at a time per stream. */
#ifndef EXPLAIN_H
#define EXPLAIN_H

#include "rig.h"

#include <stdio.h>

/* Tells what the configuration allows and refuses, with warnings and its hash. */
void explain_rig(FILE *out, const rig *r, const char *path);

/* The place and the permissions under which a motion is judged. */
typedef struct {
    const char *from;  /* "X,Y,Z" in um; NULL: not needed for this motion */
    uint8_t drive;     /* index */
    uint8_t angle_deg; /* TRIO */
    bool may_calibrate;
    bool in_tissue;
} explain_scene;

typedef enum { EXPLAIN_ALLOWED, EXPLAIN_REFUSED, EXPLAIN_WRONG } explain_result;

/* Tells whether a command, as "line 1000 2000 500 speed 8", would pass, and by which rule not. WRONG: why[] says what was
 * not understood. */
explain_result explain_motion(FILE *out, const rig *r, const explain_scene *scene, const char *motion, char *why,
                              size_t room);

#endif
