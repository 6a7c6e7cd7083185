/* mark: what the next guard of a port must know if this one is killed: the controller may hold half a frame.
 *
 * One byte in a file named after the port, in $DRYRIG_LOCK_DIR, or else /run/lock, or else $XDG_RUNTIME_DIR. The kernel keeps
 * what was written when a process is killed; it does not when the computer loses its power, and then the core's count of
 * unanswered bytes is what is left (dr_guard_out.c). The file is locked while a guard runs, and removed at the end unless it
 * is set. Everybody may write it: another user's guard has to know, too.
 * Thread-safety: one thread at a time per mark. */
#ifndef MARK_H
#define MARK_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    char path[256];
    int fd;
    bool is_set; /* after mark_open(): it was left over */
} mark;

/* port: as it was given. False: why[] says what to do, and nothing was left. */
bool mark_open(mark *m, const char *port, char *why, size_t room);
/* At once, and cheap where nothing changes. False: it could not be written (errno). */
bool mark_set(mark *m, bool on);
void mark_close(mark *m);

#endif
