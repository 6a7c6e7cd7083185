/* mark: what the next guard of a port must know if this one is killed: the controller may hold half a frame.
 *
 * One byte in a file named after the port, in $DRYRIG_LOCK_DIR, or else /run/lock, or else $XDG_RUNTIME_DIR. The kernel keeps
 * what was written when a process is killed; it does not when the computer loses its power, and then the core's count of
 * unanswered bytes is what is left (dr_guard_out.c). The file is locked while a guard runs, and removed at the end unless it
 * is set. Everybody may write it: another user's guard has to know, too.
 *
 * Where the port's name is a link, as /dev/serial/by-id/... to /dev/ttyUSB0, there are two of them, one after each name: the
 * next guard knows by either. The number of a pseudo-terminal names nothing, it is somebody else's tomorrow: there the last
 * name before it counts.
 * Thread-safety: one thread at a time per mark. */
#ifndef MARK_H
#define MARK_H

#include <stdbool.h>
#include <stddef.h>

#define MARK_NAME_MAX 256u

typedef struct {
    char name[MARK_NAME_MAX]; /* of the port, absolute */
    char path[MARK_NAME_MAX]; /* of the file */
    int fd;                   /* -1: none */
    bool is_set;
} mark_file;

typedef struct {
    mark_file given, device; /* after the port's name, and after what it leads to */
    bool is_set;             /* after mark_open(): one of them was left over */
} mark;

/* port: as it was given. False: why[] says what to do, and nothing was left. */
bool mark_open(mark *m, const char *port, char *why, size_t room);
/* The port has been opened once more, and may be another device by now. False: this one must not be used, why[] says why. */
bool mark_follow(mark *m, const char *port, char *why, size_t room);
/* At once, and cheap where nothing changes. False: it could not be written (errno). */
bool mark_set(mark *m, bool on);
void mark_close(mark *m);

#endif
