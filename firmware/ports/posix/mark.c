#define _GNU_SOURCE /* flock, realpath */
#include "mark.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#define SET '1'
#define CLEAR '0'
#define EVERYBODY 0666
#define TRIES 10     /* the guard before may be removing it */
#define LINKS_MAX 40 /* as the kernel's */
#define PTS "/dev/pts/"

/* -- Names of a port --------------------------------------------------------------------------------------------------- */

/* Absolute; the links of the directory are followed where it is there, the name itself is not. */
static bool absolute(char out[PATH_MAX], const char *name)
{
    char directory[PATH_MAX], found[PATH_MAX], here[PATH_MAX] = "";
    const char *const slash = strrchr(name, '/');
    const int length = slash == NULL ? 0 : (int)(slash - name) + 1;
    if (length >= PATH_MAX || (name[0] != '/' && getcwd(here, sizeof here) == NULL))
        return false;
    (void)snprintf(directory, sizeof directory, "%.*s", length, name);
    const bool is_there = realpath(length == 0 ? "." : directory, found) != NULL;
    const int whole = is_there ? snprintf(out, PATH_MAX, "%s/%s", strcmp(found, "/") == 0 ? "" : found, name + length)
                               : snprintf(out, PATH_MAX, "%s%s%s", here, here[0] != '\0' ? "/" : "", name);
    return whole > 0 && whole < PATH_MAX;
}

/* What it leads to at the end, as far as names last. */
static bool follow(char out[PATH_MAX], const char *name)
{
    char target[PATH_MAX], next[2 * PATH_MAX];
    bool fits = absolute(out, name);
    for (unsigned n = 0; fits && n < LINKS_MAX; n++) {
        const ssize_t length = readlink(out, target, sizeof target - 1u);
        if (length < 0)
            break;
        target[length] = '\0';
        if (strncmp(target, PTS, sizeof PTS - 1u) == 0)
            break;
        const int before = target[0] == '/' ? 0 : (int)(strrchr(out, '/') - out) + 1;
        (void)snprintf(next, sizeof next, "%.*s%s", before, out, target);
        fits = absolute(out, next);
    }
    return fits;
}

static bool set_name(mark_file *m, bool (*find)(char *, const char *), const char *port)
{
    char name[PATH_MAX];
    const bool fits = find(name, port) && strlen(name) < sizeof m->name;
    m->fd = -1;
    m->is_set = false;
    m->name[0] = '\0';
    if (fits)
        memcpy(m->name, name, strlen(name) + 1u);
    return fits;
}

/* -- One file ---------------------------------------------------------------------------------------------------------- */

/* The directory, then "dryrig-guard" and the port's name with dots for its slashes. */
static bool set_path(mark_file *m, const char *directory)
{
    const int length = snprintf(m->path, sizeof m->path, "%s/dryrig-guard%s", directory, m->name);
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
static int take(mark_file *m)
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
    if (error == 0)
        return 0;
    if (m->fd >= 0)
        (void)close(m->fd);
    m->fd = -1;
    return error;
}

static bool open_one(mark_file *m, char *why, size_t room)
{
    const char *const wanted = getenv("DRYRIG_LOCK_DIR");
    const char *const places[] = {wanted != NULL ? wanted : "/run/lock",
                                  wanted != NULL ? NULL : getenv("XDG_RUNTIME_DIR")};
    int error = 0;
    for (size_t i = 0; i < sizeof places / sizeof places[0] && error != EBUSY; i++) {
        if (places[i] == NULL)
            continue;
        error = set_path(m, places[i]) ? EAGAIN : errno;
        for (unsigned n = 0; n < TRIES && error == EAGAIN; n++)
            error = take(m);
        if (error == 0)
            return true;
    }
    if (error == EBUSY)
        (void)snprintf(why, room, "%s is in use by another guard", m->name);
    else
        (void)snprintf(why, room,
                       "%s: %s. A guard notes there what the next one must know if it is killed; "
                       "DRYRIG_LOCK_DIR names another directory",
                       m->path, strerror(error));
    return false;
}

static bool put(mark_file *m, bool on)
{
    const char byte = on ? SET : CLEAR;
    if (m->fd < 0 || m->is_set == on)
        return true;
    if (pwrite(m->fd, &byte, 1, 0) != 1)
        return false;
    m->is_set = on;
    return true;
}

static void close_one(mark_file *m)
{
    if (m->fd < 0)
        return;
    if (!m->is_set)
        (void)unlink(m->path); /* of another user: it stays, clear */
    (void)close(m->fd);
    m->fd = -1;
}

/* -- Both -------------------------------------------------------------------------------------------------------------- */

/* The device's in place of the one of the device before. */
static bool take_device(mark *m, const char *port, char *why, size_t room)
{
    mark_file found;
    if (!set_name(&found, follow, port)) {
        (void)snprintf(why, room, "%s leads to a path that is too long", port);
        return false;
    }
    if (strcmp(found.name, m->device.name) == 0)
        return true;
    if (strcmp(found.name, m->given.name) != 0 && !open_one(&found, why, room))
        return false;
    (void)put(&m->device, false); /* whatever is there by now, it is not the controller of this guard */
    close_one(&m->device);
    m->device = found;
    return true;
}

bool mark_open(mark *m, const char *port, char *why, size_t room)
{
    m->device = (mark_file){.fd = -1};
    if (!set_name(&m->given, absolute, port)) {
        (void)snprintf(why, room, "%s: its path is too long", port);
        return false;
    }
    if (!open_one(&m->given, why, room))
        return false;
    m->is_set = m->given.is_set;
    if (!take_device(m, port, why, room)) {
        close_one(&m->given);
        return false;
    }
    m->is_set = m->is_set || m->device.is_set;
    return true;
}

bool mark_follow(mark *m, const char *port, char *why, size_t room)
{
    if (!take_device(m, port, why, room))
        return false;
    if (!m->device.is_set || m->is_set)
        return true;
    (void)snprintf(
        why, room,
        "%s is %s by now, whose last guard was killed within a command. Stop this guard, start it again, and see "
        "what it says",
        port, m->device.name);
    close_one(&m->device);
    m->device.name[0] = '\0'; /* it stays set; the next look finds it again */
    return false;
}

bool mark_set(mark *m, bool on)
{
    const bool given = put(&m->given, on), device = put(&m->device, on);
    if (given && device)
        m->is_set = on;
    return given && device;
}

void mark_close(mark *m)
{
    close_one(&m->given);
    close_one(&m->device);
}
