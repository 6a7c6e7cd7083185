#define _GNU_SOURCE /* accept4, flock */
#include "control.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#define OUT_MAX (1024u * 1024u)
#define WAITING 16

static void drop(control_client *who)
{
    (void)close(who->fd);
    free(who->out);
    *who = (control_client){.fd = -1};
}

/* -- The socket -------------------------------------------------------------------------------------------------------- */

static bool set_address(struct sockaddr_un *address, const char *path)
{
    *address = (struct sockaddr_un){.sun_family = AF_UNIX};
    const size_t length = strlen(path);
    if (length == 0 || length >= sizeof address->sun_path)
        return false;
    memcpy(address->sun_path, path, length + 1);
    return true;
}

/* Does nobody answer at it any more? */
static bool is_left_over(const struct sockaddr_un *address, char *why, size_t room)
{
    struct stat is;
    if (lstat(address->sun_path, &is) != 0 || !S_ISSOCK(is.st_mode)) {
        (void)snprintf(why, room, "%s exists and is no socket; it stays. Choose another path", address->sun_path);
        return false;
    }
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const bool answers = fd >= 0 && connect(fd, (const struct sockaddr *)address, sizeof *address) == 0;
    const int error = errno;
    if (fd >= 0)
        (void)close(fd);
    if (!answers && error == ECONNREFUSED)
        return true;
    (void)snprintf(why, room, "%s is in use: another program has it. Stop it, or choose another path",
                   address->sun_path);
    return false;
}

static bool bind_private(int fd, const struct sockaddr_un *address)
{
    const mode_t before = umask(0177); /* 0600 from its first moment on */
    const bool bound = bind(fd, (const struct sockaddr *)address, sizeof *address) == 0;
    const int error = errno;
    (void)umask(before);
    errno = error;
    return bound;
}

static bool make_socket(control *c, const struct sockaddr_un *address, char *why, size_t room)
{
    bool bound = bind_private(c->fd, address);
    if (!bound && errno == EADDRINUSE) {
        if (!is_left_over(address, why, room))
            return false;
        c->replaced = true;
        bound = unlink(address->sun_path) == 0 && bind_private(c->fd, address);
    }
    if (bound && listen(c->fd, WAITING) == 0)
        return true;
    (void)snprintf(why, room, "%s: %s", address->sun_path, strerror(errno));
    if (bound)
        (void)unlink(address->sun_path);
    return false;
}

/* Two programs that start at once must not take a left-over socket from each other. Where there is no lock, goes on without. */
static int lock_directory(const char *path)
{
    char directory[PATH_MAX];
    (void)snprintf(directory, sizeof directory, "%s", path);
    char *const slash = strrchr(directory, '/');
    if (slash != NULL)
        slash[slash == directory] = '\0';
    const int fd = open(slash == NULL ? "." : directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0)
        (void)flock(fd, LOCK_EX);
    return fd;
}

bool control_open(control *c, const char *path, char *why, size_t room)
{
    struct sockaddr_un address;
    memset(c, 0, sizeof *c);
    for (unsigned i = 0; i < CONTROL_CLIENTS; i++)
        c->clients[i].fd = -1;
    c->fd = -1;
    if (path == NULL)
        return true;
    if (!set_address(&address, path)) {
        (void)snprintf(why, room, "a path of 1 to %zu characters is needed", sizeof address.sun_path - 1);
        return false;
    }
    c->fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (c->fd < 0) {
        (void)snprintf(why, room, "%s: %s", path, strerror(errno));
        return false;
    }
    const int lock = lock_directory(path);
    const bool made = make_socket(c, &address, why, room);
    if (lock >= 0)
        (void)close(lock);
    if (made)
        c->path = path;
    else
        (void)close(c->fd);
    c->fd = made ? c->fd : -1;
    return made;
}

void control_close(control *c)
{
    for (unsigned i = 0; i < CONTROL_CLIENTS; i++)
        if (c->clients[i].fd >= 0)
            drop(&c->clients[i]);
    if (c->fd < 0)
        return;
    (void)unlink(c->path);
    (void)close(c->fd);
    c->fd = -1;
}

/* -- Clients ----------------------------------------------------------------------------------------------------------- */

static void flush(control_client *who)
{
    while (who->out_count > 0) {
        const ssize_t count = send(who->fd, who->out, who->out_count, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (count < 0 && (errno == EAGAIN || errno == EINTR))
            return;
        if (count <= 0) {
            drop(who);
            return;
        }
        who->out_count -= (size_t)count;
        memmove(who->out, who->out + count, who->out_count);
    }
}

void control_say(control_client *who, const char *line)
{
    const size_t length = strlen(line);
    if (who->fd < 0)
        return;
    char *const out = who->out_count + length + 1 > OUT_MAX ? NULL : realloc(who->out, who->out_count + length + 1);
    if (out == NULL) {
        drop(who);
        return;
    }
    who->out = out;
    memcpy(out + who->out_count, line, length);
    out[who->out_count + length] = '\n';
    who->out_count += length + 1;
    flush(who);
}

void control_watch(const control *c, struct pollfd *fds)
{
    fds[0] = (struct pollfd){c->fd, POLLIN, 0};
    for (unsigned i = 0; i < CONTROL_CLIENTS; i++)
        fds[i + 1] =
            (struct pollfd){c->clients[i].fd, (short)(POLLIN | (c->clients[i].out_count > 0 ? POLLOUT : 0)), 0};
}

/* Somebody may have come to say stop. Where every place is taken, who came first gives way. */
static void take_in(control *c)
{
    static const char full[] = "{\"ok\":false,\"why\":\"too many are connected\"}";
    const int fd = accept4(c->fd, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0)
        return;
    unsigned place = 0;
    while (place < CONTROL_CLIENTS && c->clients[place].fd >= 0)
        place++;
    if (place == CONTROL_CLIENTS) {
        place = c->gives_way;
        c->gives_way = (place + 1u) % CONTROL_CLIENTS;
        control_say(&c->clients[place], full);
        if (c->clients[place].fd >= 0)
            drop(&c->clients[place]);
    }
    c->clients[place] = (control_client){.fd = fd};
}

static void listen_to(control_client *who, void (*order)(void *, control_client *, const char *), void *context)
{
    const ssize_t count = recv(who->fd, who->line + who->have, sizeof who->line - 1 - who->have, MSG_DONTWAIT);
    if (count < 0 && (errno == EAGAIN || errno == EINTR))
        return;
    if (count < 0 || (count == 0 && who->have == 0)) {
        drop(who);
        return;
    }
    if (count == 0) /* the end ends a line, too: it may be a stop */
        who->line[who->have++] = '\n';
    who->have += (size_t)count;
    char *end;
    while (who->fd >= 0 && (end = memchr(who->line, '\n', who->have)) != NULL) {
        char line[CONTROL_LINE_MAX];
        const size_t length = (size_t)(end - who->line);
        memcpy(line, who->line, length);
        line[length] = '\0';
        who->have -= length + 1;
        memmove(who->line, end + 1, who->have);
        order(context, who, line);
    }
    if (who->fd >= 0 && who->have == sizeof who->line - 1) {
        control_say(who, "{\"ok\":false,\"why\":\"the line is too long\"}");
        if (who->fd >= 0)
            drop(who);
    }
}

void control_serve(control *c, const struct pollfd *fds, void (*order)(void *, control_client *, const char *),
                   void *context)
{
    for (unsigned i = 0; i < CONTROL_CLIENTS; i++) {
        control_client *const who = &c->clients[i];
        if (who->fd >= 0 && who->fd == fds[i + 1].fd && (fds[i + 1].revents & POLLOUT) != 0)
            flush(who);
        if (who->fd >= 0 && who->fd == fds[i + 1].fd && (fds[i + 1].revents & (POLLIN | POLLHUP | POLLERR)) != 0)
            listen_to(who, order, context);
    }
    if (c->fd >= 0 && (fds[0].revents & POLLIN) != 0)
        take_in(c);
}
