/* step_rig: a running dryrig-emu whose time moves only when the host library waits. Bytes go through its pseudo-terminal, time
 * through its control channel: every time limit of the library is the one that it has with a real controller, nothing sleeps,
 * and the same scenario gives the same bytes at the same microseconds on every machine. */
#ifndef STEP_RIG_H
#define STEP_RIG_H

#include "dryrig/dryrig.h"

#include <cjson/cJSON.h>
#include <stdio.h>
#include <sys/types.h>

typedef struct {
    pid_t pid;
    char directory[64], link[80], socket[80];
    int control;
    FILE *answers;            /* of the control channel */
    uint64_t now_us, told_us; /* what the library's clock shows, and the emulator's: it may lag while it is idle */
    bool is_idle;             /* nothing comes from it by itself */

    /* This line is said before the library writes for the `before_write`th time from now. 0: never */
    unsigned before_write;
    char line[128];
} step_rig;

/* Starts `emulator`; what is wrong ends the test. `options`: more of its options, up to a NULL. */
void step_rig_start(step_rig *rig, const char *emulator, const char *controller, const char *const *options);
/* Ends it. It has left nothing behind, and its exit status is 0. */
void step_rig_stop(step_rig *rig);

/* A line of dryrig-control(7), and its answer, which is the caller's. */
cJSON *step_rig_ask(step_rig *rig, const char *line);
/* The same; a refusal ends the test. */
void step_rig_do(step_rig *rig, const char *format, ...) __attribute__((format(printf, 2, 3)));
void step_rig_advance(step_rig *rig, uint64_t us);
/* Where the active device is: `key` is position_steps or tip_steps. */
void step_rig_steps(step_rig *rig, const char *key, int32_t steps[DRYRIG_AXES]);

/* The port, as dryrig_link_open() opens it, with the rig's clock. Returns its result. */
int step_rig_link(step_rig *rig, dryrig_link *out, unsigned baud);

#endif
