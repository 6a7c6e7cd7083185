/* reads: when the host reads its end of a pseudo-terminal, and when it writes: in which order, as inotify tells it, not how much.
 * So a program that takes what an older answer left in the port together with the next one is seen, however quick it is.
 *
 * Nothing wakes up for it: it is looked at when bytes of the host have come. Equal events in a row are one, so few wait.
 * Thread-safety: one thread at a time per descriptor. */
#ifndef READS_H
#define READS_H

#include <stdbool.h>

/* Looks on at the host's end of a port. Returns a descriptor; -1: it cannot, which is what reads_look() takes as well. */
int reads_open(const char *path);
/* Bytes of the host have just been taken in, and it has nothing to read. Has it read something between these bytes, or those
 * before, and now, that was there already when it wrote them? `was_sent`: something has been sent since it was last asked. */
bool reads_look(int fd, bool was_sent);

#endif
