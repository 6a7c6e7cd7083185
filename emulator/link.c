#define _GNU_SOURCE /* flock, struct stat's nanoseconds */
#include "link.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
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

/* Is what stands at link_path a link of ours whose emulator is gone? If not, why[] says what it is. */
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
    (void)snprintf(why, room,
                   "%s leads to %s, which is in use: another emulator has this link. Stop it, or choose another path",
                   link_path, target);
    return false;
}

/* Keeps others from making links in the same directory meanwhile. Where that is impossible, goes on without. */
static int lock_directory(const char *link_path)
{
    char directory[PATH_MAX];
    const char *const slash = strrchr(link_path, '/');
    const size_t length = slash == NULL ? 0 : (size_t)(slash - link_path);
    if (length >= sizeof directory)
        return -1;
    memcpy(directory, link_path, length);
    directory[length] = '\0';
    const int fd = open(slash == NULL ? "." : length == 0 ? "/" : directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (fd >= 0)
        (void)flock(fd, LOCK_EX);
    return fd;
}

static void unlock_directory(int fd)
{
    if (fd >= 0)
        (void)close(fd);
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

bool link_make(const char *link_path, const char *pts_path, char *why, size_t room)
{
    const int lock = lock_directory(link_path);
    const bool made = make_locked(link_path, pts_path, why, room);
    unlock_directory(lock);
    return made;
}

void link_remove(const char *link_path, const char *pts_path)
{
    char target[PATH_MAX];
    const int lock = lock_directory(link_path);
    if (target_of(link_path, target) && strcmp(target, pts_path) == 0)
        (void)unlink(link_path);
    unlock_directory(lock);
}
