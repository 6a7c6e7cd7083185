/* pty: the end of the line that a host program opens: a pseudo-terminal that behaves as a serial port does.
 *
 * - It is raw before anybody opens it and again after the last one has closed it: a plain open() and read() sees every byte
 *   value unchanged. A host may set it as it likes while it has it open.
 * - What has not been read when the last one closes it is gone, and what is sent while nobody has it open goes nowhere.
 *   What a host wrote before it closed was sent and arrives.
 * - A host that does not read holds nobody up: the kernel keeps some 17,000 bytes, pty a few more, and what comes then is
 *   lost and counted, piece by piece (a piece is what was given to pty_put() at once).
 *
 * Who is there? pty holds the host's end open itself, to look after it, and so the kernel never says that nobody has it
 * open; inotify does, which tells of every opening and closing. It melts equal events in a row into one, so the directory
 * is watched as well: its events come between those of the port, and none is lost.
 *
 * Thread-safety: one thread at a time per pty. */
#ifndef PTY_H
#define PTY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <termios.h>

#define PTY_WAITING_MAX 16384u

typedef struct {
    int fd;             /* the emulator's end; non-blocking */
    int host_fd;        /* the host's end, to look after it: never read, never written */
    int watch;          /* what inotify calls it */
    char path[32];      /* the host's end: /dev/pts/N */
    struct termios raw; /* how the host's end is while nobody has it open */
    unsigned opens;     /* how many have it open */
    bool was_left;      /* nobody had it open at some time since pty_look() */
    uint64_t lost_bytes;
    size_t waiting_count; /* bytes that the kernel has not taken yet */
    uint8_t waiting[PTY_WAITING_MAX];
} pty;

/* Opens one. NULL, or what could not be done (errno says why); then nothing is left open. */
const char *pty_open(pty *p, int inotify_fd);
void pty_close(pty *p);

/* The inotify descriptor has this to say about p->watch. After all that it has to say, pty_look() acts on it. */
void pty_hint(pty *p, uint32_t inotify_mask);
void pty_look(pty *p);

/* What the host has sent; 0: nothing now. */
size_t pty_read(pty *p, uint8_t *bytes, size_t room);
/* Bytes for the host; they go with the next pty_flush(). False: they are lost. */
bool pty_put(pty *p, const uint8_t *bytes, size_t count);
/* True: all has gone. False: the host reads too slowly; call again when p->fd is writable. */
bool pty_flush(pty *p);

#endif
