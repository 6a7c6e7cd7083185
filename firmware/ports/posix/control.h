/* control: the second channel of the guard, and of the emulator: a Unix socket that only its owner may use. A line of text
 * comes in, a line of JSON goes out.
 *
 * Nobody is waited for: a client that does not read is dropped when too much has gathered for it. Nobody is kept out: where
 * every place is taken, who came first is dropped.
 * Whose socket is it? One that answers belongs to a program that runs; one that nobody answers is left over and is replaced.
 * Thread-safety: one thread at a time per control. */
#ifndef CONTROL_H
#define CONTROL_H

#include <poll.h>
#include <stdbool.h>
#include <stddef.h>

#define CONTROL_CLIENTS 8u
#define CONTROL_LINE_MAX 512u
#define CONTROL_FDS (CONTROL_CLIENTS + 1u)

typedef struct {
    int fd; /* -1: free */
    char line[CONTROL_LINE_MAX];
    size_t have;
    char *out; /* what it has not taken yet */
    size_t out_count;
    bool follows; /* wants to be told of changes */
    bool waits;   /* for the answer to an order that takes time */
} control_client;

typedef struct {
    const char *path; /* NULL: there is none */
    int fd;
    bool replaced; /* a socket was left over: its program was not ended in order */
    control_client clients[CONTROL_CLIENTS];
    unsigned gives_way; /* whose place is taken next when all are */
} control;

/* path NULL: without. False: why[] says what is in the way; nothing was changed. */
bool control_open(control *c, const char *path, char *why, size_t room);
/* Removes the socket. */
void control_close(control *c);

/* What to wait for: CONTROL_FDS entries, some of them empty. */
void control_watch(const control *c, struct pollfd *fds);
/* Takes who knocks and what was sent; calls `order` for each whole line. fds: as control_watch() left them, after poll(). */
void control_serve(control *c, const struct pollfd *fds,
                   void (*order)(void *context, control_client *who, const char *line), void *context);
/* Sends a line. */
void control_say(control_client *who, const char *line);

#endif
