/* options: the command line of dryrig-emu, checked and turned into what it stands for. */
#ifndef OPTIONS_H
#define OPTIONS_H

#include "engine.h" /* clock_mode */
#include "rig.h"    /* the controllers */

#define SPEEDUP_MAX 1000u
#define OPTIONS_DO_MAX 64u

typedef enum {
    TASK_EMULATE, /* one controller, or those of a rig file */
    TASK_RUN,     /* the same, for as long as a command runs */
    TASK_PANEL,   /* the same, for as long as its panel is in the terminal */
    TASK_CHECK,   /* is this rig file right? */
    TASK_REPLAY,  /* does a controller still answer as in this recording? */
    TASK_PLAYBACK /* does a host still ask as in this recording? */
} task;

typedef struct {
    task task;
    rig rig;
    const char *rig_file; /* NULL: one controller */
    char **command;       /* TASK_RUN: its words, NULL at the end */
    clock_mode clock;
    unsigned speedup;                   /* 1 to SPEEDUP_MAX */
    const char *trace;                  /* NULL: none; "-": stderr */
    const char *lint_json, *lint_junit; /* files for the same; NULL: none */
    const char *record;                 /* where the bytes of the line go; NULL: nowhere */
    const char *replay;                 /* TASK_REPLAY, TASK_PLAYBACK: the recording */
    const char *replay_port;            /* TASK_REPLAY: what it is played to; NULL: the described controllers */
    const char *playback_link;          /* TASK_PLAYBACK: the port's stable name; NULL: none */
    const char *control;                /* NULL: none */
    const char *scenario;               /* a file of what is done; NULL: none */
    const char *dos[OPTIONS_DO_MAX];
    unsigned do_count;
    uint64_t seed;
    bool waits_for_client;
    bool lints;          /* tells at the end which rules the host has broken */
    bool is_strict;      /* TASK_RUN: findings turn the command's exit status 0 into 3 */
    bool may_move;       /* TASK_REPLAY at a port */
    bool seed_is_chosen; /* by the program */
} options;

/* Ends the program after --help or --version (exit status 0), or when something is wrong (2, and stderr says what is allowed). */
options options_read(int argc, char **argv);

#endif
