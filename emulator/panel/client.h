/* client: the panel's end of an emulator's control channel: lines out, lines in. Nothing blocks but client_open().
 *
 * Thread-safety: one thread at a time per client. */
#ifndef CLIENT_H
#define CLIENT_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    int fd;
    char *in, *out;
    size_t in_at, in_count, in_room; /* in_at: the first byte that has not been handed out */
    size_t out_count;
} client;

/* False: why[] says what is in the way. */
bool client_open(client *c, const char *path, char *why, size_t room);
void client_close(client *c);
/* Sends a line. False: no memory. */
bool client_say(client *c, const char *line);
/* Sends what the emulator has not taken yet. True: it has taken all. */
bool client_flush(client *c);
/* Takes in what is there. False: the emulator has ended, or has hung up. */
bool client_read(client *c);
/* The next whole line, or NULL. It is valid until the next client_read(). */
const char *client_next(client *c);

#endif
