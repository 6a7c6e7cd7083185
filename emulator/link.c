#define _GNU_SOURCE /* SOCK_CLOEXEC, struct stat's nanoseconds */
#include "link.h"

#include <errno.h>
#include <limits.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#define PTS "/dev/pts/"

/* Where it leads. False: it is no symbolic link. */
static bool target_of(const char *link_path, char target[PATH_MAX])
{
    const ssize_t length = readlink(link_path, target, PATH_MAX - 1);
    if (length < 0)
        return false;
    target[length] = '\0';
    return true;
}

static bool is_port(const char *path)
{
    const size_t prefix = sizeof PTS - 1;
    return strncmp(path, PTS, prefix) == 0 && path[prefix] != '\0' &&
           path[prefix + strspn(path + prefix, "0123456789")] == '\0';
}

static bool is_younger(const struct timespec *a, const struct timespec *b)
{
    return a->tv_sec > b->tv_sec || (a->tv_sec == b->tv_sec && a->tv_nsec > b->tv_nsec);
}

/* Is what stands at link_path a link of ours whose program is gone? If not, why[] says what it is. */
static bool is_stale(const char *link_path, const char *pts_path, char *why, size_t room)
{
    struct stat link_is, port_is;
    char target[PATH_MAX];
    if (lstat(link_path, &link_is) != 0) {
        (void)snprintf(why, room, "%s: %s", link_path, strerror(errno));
        return false;
    }
    if (!target_of(link_path, target)) {
        (void)snprintf(why, room, "%s exists and is a %s; it stays. Choose another path", link_path,
                       S_ISDIR(link_is.st_mode) ? "directory" : "file");
        return false;
    }
    if (!is_port(target)) {
        (void)snprintf(why, room, "%s is a link to %s and not ours; it stays. Choose another path", link_path, target);
        return false;
    }
    if (strcmp(target, pts_path) == 0 || stat(target, &port_is) != 0)
        return true;
    if (is_younger(&port_is.st_ctim, &link_is.st_mtim))
        return true;
    (void)snprintf(why, room, "%s leads to %s, which somebody uses; it stays. Choose another path", link_path, target);
    return false;
}

/* A number for a name of any length. */
static uint64_t digest(const char *name)
{
    uint64_t sum = UINT64_C(0xCBF29CE484222325); /* FNV-1a */
    for (; *name != '\0'; name++)
        sum = (sum ^ (unsigned char)*name) * UINT64_C(0x100000001B3);
    return sum;
}

/* The same name in the same directory has the same lock however its path is spelled. */
int link_lock_name(const char *link_path)
{
    char directory[PATH_MAX];
    struct stat is;
    const char *const slash = strrchr(link_path, '/');
    const char *const name = slash == NULL ? link_path : slash + 1;
    const int length = slash == NULL ? 0 : (int)(slash - link_path);
    (void)snprintf(directory, sizeof directory, "%.*s", length, link_path);
    if (stat(slash == NULL ? "." : length == 0 ? "/" : directory, &is) != 0)
        return -1;

    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const int text =
        snprintf(address.sun_path + 1, sizeof address.sun_path - 1, "dryrig-emu link %llx/%llx/%llx",
                 (unsigned long long)is.st_dev, (unsigned long long)is.st_ino, (unsigned long long)digest(name));
    const socklen_t size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1u + (size_t)text);
    const int lock = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (lock >= 0 && bind(lock, (const struct sockaddr *)&address, size) != 0) {
        const int reason = errno;
        (void)close(lock);
        errno = reason;
        return -1;
    }
    return lock;
}

static bool make_locked(const char *link_path, const char *pts_path, char *why, size_t room)
{
    if (symlink(pts_path, link_path) == 0)
        return true;
    if (errno == EEXIST) {
        if (!is_stale(link_path, pts_path, why, room))
            return false;
        if (unlink(link_path) == 0 && symlink(pts_path, link_path) == 0)
            return true;
    }
    (void)snprintf(why, room, "cannot make the link %s: %s", link_path, strerror(errno));
    return false;
}

int link_make(const char *link_path, const char *pts_path, char *why, size_t room)
{
    const int lock = link_lock_name(link_path);
    if (lock < 0 && errno == EADDRINUSE)
        (void)snprintf(why, room, "%s is in use by another program; stop that, or choose another path", link_path);
    else if (lock < 0)
        (void)snprintf(why, room, "cannot make the link %s: %s", link_path, strerror(errno));
    else if (make_locked(link_path, pts_path, why, room))
        return lock;
    if (lock >= 0)
        (void)close(lock);
    return -1;
}

void link_remove(const char *link_path, const char *pts_path, int lock)
{
    char target[PATH_MAX];
    if (target_of(link_path, target) && strcmp(target, pts_path) == 0)
        (void)unlink(link_path);
    (void)close(lock);
}
