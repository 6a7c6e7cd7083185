/* A PTY, by the kernel's own terminal interface: it takes any baud rate as a number (128000 is no constant of termios),
 * so that whoever looks at the other end can tell that it is right. It has no effect on the pace. */
#define _GNU_SOURCE /* O_CLOEXEC, ppoll */

#include "link.h"

#include <asm/termbits.h> /* struct termios2, in place of termios.h */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

static int fd_of(void *context) { return *(const int *)context; }

/* 1: ready; 0: not in time, or a signal came; or LINK. */
static int wait_for(int fd, short events, uint32_t timeout_us)
{
    struct pollfd wait = {fd, events, 0};
    const struct timespec limit = {(time_t)(timeout_us / 1000000u), (long)(timeout_us % 1000000u) * 1000};
    const int ready = ppoll(&wait, 1, &limit, NULL);
    if (ready < 0)
        return errno == EINTR ? 0 : DRYRIG_ERR_LINK;
    return ready;
}

static int pty_read(void *context, void *bytes, size_t room, uint32_t timeout_us)
{
    const int ready = wait_for(fd_of(context), POLLIN, timeout_us);
    if (ready <= 0)
        return ready;
    const ssize_t count = read(fd_of(context), bytes, room < 4096u ? room : 4096u);
    if (count > 0)
        return (int)count;
    /* Raw, so 0 is the end of the other side, as EIO is. */
    return count < 0 && (errno == EAGAIN || errno == EINTR) ? 0 : DRYRIG_ERR_LINK;
}

static int pty_write(void *context, const void *bytes, size_t count)
{
    const uint8_t *next = bytes;
    const uint64_t end_us = link_now_us(NULL) + WRITE_LIMIT_MS * 1000u;
    while (count > 0) {
        const ssize_t written = write(fd_of(context), next, count);
        if (written < 0 && errno != EAGAIN && errno != EINTR)
            return DRYRIG_ERR_LINK;
        if (written > 0) {
            next += written;
            count -= (size_t)written;
        } else if (link_now_us(NULL) >= end_us || wait_for(fd_of(context), POLLOUT, 10000) < 0)
            return DRYRIG_ERR_LINK;
    }
    return 0;
}

static int pty_purge(void *context) { return ioctl(fd_of(context), TCFLSH, TCIFLUSH) == 0 ? 0 : DRYRIG_ERR_LINK; }

static void pty_close(void *context)
{
    (void)close(fd_of(context));
    free(context);
}

int link_pty_descriptor(const dryrig_link *link) { return link->close == pty_close ? fd_of(link->context) : -1; }

static int set_raw(int fd, unsigned baud)
{
    struct termios2 line;
    if (ioctl(fd, TCGETS2, &line) != 0)
        return -1;
    line.c_iflag = 0;
    line.c_oflag = 0;
    line.c_lflag = 0;
    line.c_cflag = CS8 | CREAD | CLOCAL | BOTHER;
    line.c_ispeed = line.c_ospeed = baud;
    line.c_cc[VMIN] = 1;
    line.c_cc[VTIME] = 0;
    return ioctl(fd, TCSETS2, &line);
}

int link_pty_open(dryrig_link *out, const char *path, unsigned baud, char *why, size_t room)
{
    const int fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0) {
        if (errno == EBUSY)
            return link_busy(path, why, room);
        (void)snprintf(why, room, "%.200s: %s", path,
                       errno == EIO ? "nothing is behind this PTY any more" : strerror(errno));
        return DRYRIG_ERR_PORT;
    }
    int result = link_lock(fd);
    if (result == DRYRIG_ERR_PORT_BUSY)
        result = link_busy(path, why, room);
    else if (set_raw(fd, baud) != 0) {
        (void)snprintf(why, room, "%.200s: cannot set the line: %s", path, strerror(errno));
        result = DRYRIG_ERR_PORT;
    }
    int *context = result == DRYRIG_OK ? malloc(sizeof *context) : NULL;
    if (context == NULL) {
        (void)close(fd);
        return result < 0 ? result : DRYRIG_ERR_MEMORY;
    }
    *context = fd;
    *out = (dryrig_link){context, pty_read, pty_write, pty_purge, link_now_us, link_sleep_us, pty_close};
    return DRYRIG_OK;
}
