#define _GNU_SOURCE /* posix_openpt, cfmakeraw, ptsname_r, TIOCNXCL */
#include "pty.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

static const char *give_up(pty *p, const char *what)
{
    const int why = errno;
    pty_close(p);
    errno = why;
    return what;
}

static bool make_raw(pty *p)
{
    if (tcgetattr(p->host_fd, &p->raw) != 0)
        return false;
    cfmakeraw(&p->raw);
    p->raw.c_cflag |= CLOCAL | CREAD;
    p->raw.c_cc[VMIN] = 1;
    p->raw.c_cc[VTIME] = 0;
    return tcsetattr(p->host_fd, TCSANOW, &p->raw) == 0;
}

/* The directory's events keep those of the port apart, see pty.h. */
static bool watch(pty *p, int inotify_fd)
{
    char directory[sizeof p->path];
    memcpy(directory, p->path, sizeof directory);
    *strrchr(directory, '/') = '\0';
    p->watch = inotify_add_watch(inotify_fd, p->path, IN_OPEN | IN_CLOSE);
    return p->watch >= 0 && inotify_add_watch(inotify_fd, directory, IN_OPEN | IN_CLOSE) >= 0;
}

const char *pty_open(pty *p, int inotify_fd)
{
    memset(p, 0, sizeof *p);
    p->host_fd = -1;
    p->fd = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
    if (p->fd < 0)
        return "no pseudo-terminal to be had";
    if (grantpt(p->fd) != 0 || unlockpt(p->fd) != 0 || ptsname_r(p->fd, p->path, sizeof p->path) != 0)
        return give_up(p, "the pseudo-terminal cannot be used");
    p->host_fd = open(p->path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (p->host_fd < 0)
        return give_up(p, "the pseudo-terminal cannot be opened by its path (is /dev/pts mounted?)");
    if (!make_raw(p))
        return give_up(p, "the pseudo-terminal cannot be made raw");
    if (!watch(p, inotify_fd))
        return give_up(p, "the pseudo-terminal cannot be watched");
    return NULL;
}

void pty_close(pty *p)
{
    if (p->host_fd >= 0)
        (void)close(p->host_fd);
    if (p->fd >= 0)
        (void)close(p->fd);
    p->fd = p->host_fd = -1;
}

void pty_hint(pty *p, uint32_t inotify_mask)
{
    if ((inotify_mask & IN_OPEN) != 0)
        p->opens++;
    if ((inotify_mask & IN_CLOSE) != 0 && p->opens > 0 && --p->opens == 0)
        p->was_left = true;
}

void pty_look(pty *p)
{
    if (!p->was_left)
        return;
    p->was_left = false;
    /* What is on its way to a host that has gone: what waits here, what the kernel carries, what it holds to be read. */
    p->waiting_count = 0;
    (void)tcflush(p->fd, TCOFLUSH);
    (void)tcflush(p->host_fd, TCIFLUSH);
    (void)tcflow(p->host_fd, TCOON);
    (void)ioctl(p->host_fd, TIOCNXCL);
    if (p->opens == 0) /* the next one may be there already, and have settings of its own */
        (void)tcsetattr(p->host_fd, TCSANOW, &p->raw);
}

size_t pty_read(pty *p, uint8_t *bytes, size_t room)
{
    const ssize_t count = read(p->fd, bytes, room); /* an error: nothing there */
    return count > 0 ? (size_t)count : 0;
}

bool pty_put(pty *p, const uint8_t *bytes, size_t count)
{
    if (p->opens == 0)
        return false;
    if (count > sizeof p->waiting - p->waiting_count)
        (void)pty_flush(p);
    if (count > sizeof p->waiting - p->waiting_count) {
        p->lost_bytes += count;
        return false;
    }
    memcpy(p->waiting + p->waiting_count, bytes, count);
    p->waiting_count += count;
    return true;
}

bool pty_flush(pty *p)
{
    while (p->waiting_count > 0) { /* until the kernel takes no more: only then will it say when it does again */
        const ssize_t count = write(p->fd, p->waiting, p->waiting_count);
        if (count <= 0)
            return false;
        p->waiting_count -= (size_t)count;
        memmove(p->waiting, p->waiting + count, p->waiting_count);
    }
    return true;
}
