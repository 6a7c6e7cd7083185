/* desk: where the emulator is told what to do while it runs: the control channel (a Unix socket); and those who subscribe
 * to what happens.
 *
 * Thread-safety: one thread. */
#ifndef DESK_H
#define DESK_H

#include "control.h"  /* the socket */
#include "language.h" /* what can be said */

typedef struct {
    source base;
    observer observer; /* on behalf of all who subscribe */
    language language;
    control control;
    observer_link *links; /* one for each station */
    bool has_followers;
} desk;

/* path NULL: no socket. False: why[] says what is in the way; nothing was changed. */
bool desk_open(desk *d, engine *e, trace *t, const char *path, char *why, size_t room);
void desk_close(desk *d);

/* `dryrig-emu ctl PATH WORD...`: sends the words as one line and prints the answer, or the error on stderr. Returns an exit
 * status: 0 done, 1 not. */
int desk_ctl(const char *path, char **words);

#endif
