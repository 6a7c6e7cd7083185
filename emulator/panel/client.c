#define _GNU_SOURCE /* SOCK_CLOEXEC */
#include "client.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define READ_ROOM 65536u

bool client_open(client *c, const char *path, char *why, size_t room)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    memset(c, 0, sizeof *c);
    c->fd = -1;
    if (strlen(path) >= sizeof address.sun_path) {
        (void)snprintf(why, room, "a socket's path has up to %zu characters", sizeof address.sun_path - 1);
        return false;
    }
    memcpy(address.sun_path, path, strlen(path) + 1);
    c->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (c->fd >= 0 && connect(c->fd, (const struct sockaddr *)&address, sizeof address) == 0 &&
        fcntl(c->fd, F_SETFL, O_NONBLOCK) == 0)
        return true;
    (void)snprintf(why, room, "%s%s", strerror(errno),
                   errno == ENOENT || errno == ECONNREFUSED ? ". Does dryrig-emu run with --control there?" : "");
    client_close(c);
    return false;
}

void client_close(client *c)
{
    if (c->fd >= 0)
        (void)close(c->fd);
    c->fd = -1;
    free(c->in);
    free(c->out);
    c->in = c->out = NULL;
}

bool client_say(client *c, const char *line)
{
    const size_t length = strlen(line);
    char *const out = realloc(c->out, c->out_count + length + 1);
    if (out == NULL)
        return false;
    c->out = out;
    memcpy(out + c->out_count, line, length);
    out[c->out_count + length] = '\n';
    c->out_count += length + 1;
    (void)client_flush(c);
    return true;
}

bool client_flush(client *c)
{
    ssize_t count;
    while (c->out_count > 0 && (count = send(c->fd, c->out, c->out_count, MSG_NOSIGNAL)) > 0) {
        c->out_count -= (size_t)count;
        memmove(c->out, c->out + count, c->out_count);
    }
    return c->out_count == 0;
}

bool client_read(client *c)
{
    if (c->in != NULL)
        memmove(c->in, c->in + c->in_at, c->in_count - c->in_at);
    c->in_count -= c->in_at;
    c->in_at = 0;
    if (c->in_room - c->in_count < READ_ROOM) {
        char *const in = realloc(c->in, c->in_room + 2 * READ_ROOM);
        if (in == NULL)
            return false;
        c->in = in;
        c->in_room += 2 * READ_ROOM;
    }
    const ssize_t count = recv(c->fd, c->in + c->in_count, READ_ROOM, 0);
    if (count > 0)
        c->in_count += (size_t)count;
    return count > 0 || (count < 0 && (errno == EAGAIN || errno == EINTR));
}

const char *client_next(client *c)
{
    char *const line = c->in == NULL ? NULL : c->in + c->in_at;
    char *const end = line == NULL ? NULL : memchr(line, '\n', c->in_count - c->in_at);
    if (end == NULL)
        return NULL;
    *end = '\0';
    c->in_at = (size_t)(end + 1 - c->in);
    return line;
}
