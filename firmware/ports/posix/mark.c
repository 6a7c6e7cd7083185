#define _GNU_SOURCE /* flock */
#include "mark.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define SET '1'
#define CLEAR '0'
#define EVERYBODY 0666
#define TRIES 10 /* the guard before may be removing it */

/* The directory, then "dryrig-guard" and the absolute path of the port with dots for its slashes. */
static bool set_path(mark *m, const char *directory, const char *port)
{
    char here[sizeof m->path] = "";
    if (*port != '/' && getcwd(here, sizeof here) == NULL)
        return false;
    const int length =
        snprintf(m->path, sizeof m->path, "%s/dryrig-guard%s%s%s", directory, here, *port == '/' ? "" : "/", port);
    if (length < 0 || (size_t)length >= sizeof m->path) {
        errno = ENAMETOOLONG;
        return false;
    }
    for (char *at = m->path + strlen(directory) + 1; *at != '\0'; at++)
        if (*at == '/')
            *at = '.';
    return true;
}

/* Not with O_CREAT alone: in a directory of everybody's the kernel refuses that for another user's file. */
static int open_file(const char *path)
{
    const int flags = O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
    int fd = open(path, flags);
    if (fd < 0 && errno == ENOENT) {
        fd = open(path, flags | O_CREAT | O_EXCL, EVERYBODY);
        if (fd >= 0)
            (void)fchmod(fd, EVERYBODY); /* whatever the umask says */
    }
    return fd;
}

/* 0, or an errno. EAGAIN: it is another file by now, or has just been made by somebody. */
static int take(mark *m)
{
    struct stat is, there;
    char byte = CLEAR;
    m->fd = open_file(m->path);
    int error = m->fd >= 0 ? 0 : errno == EEXIST ? EAGAIN : errno;
    if (error == 0 && flock(m->fd, LOCK_EX | LOCK_NB) != 0)
        error = EBUSY;
    if (error == 0 && (fstat(m->fd, &is) != 0 || !S_ISREG(is.st_mode)))
        error = EINVAL;
    if (error == 0 && (lstat(m->path, &there) != 0 || there.st_ino != is.st_ino || there.st_dev != is.st_dev))
        error = EAGAIN;
    if (error == 0 && pread(m->fd, &byte, 1, 0) < 0)
        error = errno;
    m->is_set = byte == SET;
    if (error == 0 && !m->is_set && pwrite(m->fd, &byte, 1, 0) != 1) /* now, while an error can be told */
        error = errno;
    if (error != 0 && m->fd >= 0)
        (void)close(m->fd);
    return error;
}

bool mark_open(mark *m, const char *port, char *why, size_t room)
{
    const char *const wanted = getenv("DRYRIG_LOCK_DIR");
    const char *const places[] = {wanted != NULL ? wanted : "/run/lock",
                                  wanted != NULL ? NULL : getenv("XDG_RUNTIME_DIR")};
    int error = 0;
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        if (places[i] == NULL)
            continue;
        error = set_path(m, places[i], port) ? EAGAIN : errno;
        for (unsigned n = 0; n < TRIES && error == EAGAIN; n++)
            error = take(m);
        if (error == 0)
            return true;
        if (error == EBUSY)
            break;
    }
    m->fd = -1;
    if (error == EBUSY)
        (void)snprintf(why, room, "%s is in use by another guard, which waits for it", port);
    else
        (void)snprintf(why, room,
                       "%s: %s. A guard notes there what the next one must know if it is killed; "
                       "DRYRIG_LOCK_DIR names another directory",
                       m->path, strerror(error));
    return false;
}

bool mark_set(mark *m, bool on)
{
    const char byte = on ? SET : CLEAR;
    if (m->is_set == on)
        return true;
    if (pwrite(m->fd, &byte, 1, 0) != 1)
        return false;
    m->is_set = on;
    return true;
}

void mark_close(mark *m)
{
    if (!m->is_set)
        (void)unlink(m->path); /* of another user: it stays, clear */
    (void)close(m->fd);
    m->fd = -1;
}
