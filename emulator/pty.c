#define _GNU_SOURCE /* posix_openpt, cfmakeraw, ptsname_r */
#include "pty.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <termios.h>
#include <unistd.h>

/* Drops what is on its way to the host: what waits here, what the kernel carries over, and what it holds to be read. The
 * last goes with setting the host's end, which Linux does through the emulator's end as well. */
static int discard(pty *p, const struct termios *settings)
{
    p->waiting_count = 0;
    (void)tcflush(p->fd, TCOFLUSH);
    return tcsetattr(p->fd, TCSAFLUSH, settings);
}

static const char *give_up(pty *p, const char *what)
{
    const int why = errno;
    pty_close(p);
    errno = why;
    return what;
}

const char *pty_open(pty *p, int inotify_fd)
{
    memset(p, 0, sizeof *p);
    p->watch = -1;
    p->fd = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK);
    if (p->fd < 0)
        return "no pseudo-terminal to be had";
    if (grantpt(p->fd) != 0 || unlockpt(p->fd) != 0 || ptsname_r(p->fd, p->path, sizeof p->path) != 0)
        return give_up(p, "the pseudo-terminal cannot be used");
    if (tcgetattr(p->fd, &p->raw) != 0)
        return give_up(p, "the pseudo-terminal cannot be made raw");
    cfmakeraw(&p->raw);
    p->raw.c_cflag |= CLOCAL | CREAD;
    p->raw.c_cc[VMIN] = 1;
    p->raw.c_cc[VTIME] = 0;
    if (discard(p, &p->raw) != 0)
        return give_up(p, "the pseudo-terminal cannot be made raw");
    /* The kernel says that nobody has it open only after somebody has had it open once. */
    const int host_end = open(p->path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (host_end < 0)
        return give_up(p, "the pseudo-terminal cannot be opened by its path (is /dev/pts mounted?)");
    (void)close(host_end);
    if (inotify_fd >= 0)
        p->watch = inotify_add_watch(inotify_fd, p->path, IN_OPEN | IN_CLOSE);
    return NULL;
}

void pty_close(pty *p)
{
    if (p->fd >= 0)
        (void)close(p->fd);
    p->fd = -1;
}

void pty_hint(pty *p, uint32_t inotify_mask)
{
    if ((inotify_mask & IN_OPEN) != 0)
        p->opens++;
    if ((inotify_mask & IN_CLOSE) != 0 && p->opens > 0 && --p->opens == 0) {
        /* The last one has gone. The next may be there already: its settings stay. */
        struct termios settings;
        if (tcgetattr(p->fd, &settings) == 0)
            (void)discard(p, &settings);
    }
}

void pty_look(pty *p)
{
    struct pollfd end = {.fd = p->fd};
    (void)poll(&end, 1, 0);
    p->is_open = (end.revents & POLLHUP) == 0;
    if (p->is_open)
        return;
    p->opens = 0;
    (void)discard(p, &p->raw);
}

size_t pty_read(pty *p, uint8_t *bytes, size_t room)
{
    const ssize_t count = read(p->fd, bytes, room); /* an error: nothing there, or nobody */
    return count > 0 ? (size_t)count : 0;
}

bool pty_put(pty *p, const uint8_t *bytes, size_t count)
{
    if (!p->is_open)
        pty_look(p);
    if (!p->is_open)
        return false;
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
    if (p->waiting_count == 0)
        return true;
    const ssize_t count = write(p->fd, p->waiting, p->waiting_count);
    if (count <= 0)
        return false;
    p->waiting_count -= (size_t)count;
    memmove(p->waiting, p->waiting + count, p->waiting_count);
    return p->waiting_count == 0;
}
