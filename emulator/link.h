/* link: the stable name of a port: a symbolic link to /dev/pts/N, whose N changes with every start.
 *
 * Whose link is it? A link of ours is made after its port and leads to it for as long as the emulator lives. So it is stale,
 * and may be replaced, when it leads to a /dev/pts/N that does not exist or that was made after the link (a number that was
 * given to somebody else since). Anything else at that path is somebody's and stays. This leaves nothing behind, no lock
 * file, even after kill -9. Two emulators that start at once are kept apart by a lock on the directory, for that moment.
 *
 * Thread-safety: functions of their arguments only. */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>
#include <stddef.h>

/* Makes the link. False: why[] says what is in the way and what to do; nothing was changed. */
bool link_make(const char *link_path, const char *pts_path, char *why, size_t room);
/* Removes it, if it still leads to this port. */
void link_remove(const char *link_path, const char *pts_path);

#endif
