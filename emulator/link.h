/* link: the stable name of a port: a symbolic link to /dev/pts/N, whose N changes with every start.
 *
 * Whose link is it? A program (an emulator, a guard) holds a lock on the link's name for as long as it lives: a socket of
 * Linux's abstract namespace, which leaves nothing behind, even after kill -9 (a lock file would). With the lock in hand, what
 * stands at that path belongs to no program that lives. It is a stale one of ours, and may be replaced, when it leads to a /dev/pts/N that
 * does not exist or that was made after the link: a number that was given to somebody else since. Anything else is
 * somebody's and stays, another program's link to its own living terminal as well.
 *
 * Thread-safety: functions of their arguments only. */
#ifndef LINK_H
#define LINK_H

#include <stddef.h>

/* Makes the link. Returns the lock, a descriptor to be kept open until link_remove(). -1: why[] says what is in the way and
 * what to do; nothing was changed. */
int link_make(const char *link_path, const char *pts_path, char *why, size_t room);
/* The lock alone, on any path: a descriptor that holds it as long as it is open. -1: errno is EADDRINUSE where somebody has
 * it. */
int link_lock_name(const char *path);
/* Removes it, if it still leads to this port. */
void link_remove(const char *link_path, const char *pts_path, int lock);

#endif
