#define _GNU_SOURCE /* realpath */
#include "device.h"

#include "link.h" /* of the host library: link_descriptor() */

#include <libserialport.h>
#include <linux/serial.h>

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <unistd.h>

/* Is the converter the one that the configuration names? */
static bool is_converter(const device *d, const dr_limits *limits, char *why, size_t room)
{
    char wanted[DR_SERIAL_MAX + 1u] = "", path[PATH_MAX];
    struct sp_port *port = NULL;
    memcpy(wanted, limits->serial, DR_SERIAL_MAX);
    if (wanted[0] == '\0')
        return true;
    const bool is_known = realpath(d->path, path) != NULL && sp_get_port_by_name(path, &port) == SP_OK;
    const char *const serial = is_known ? sp_get_port_usb_serial(port) : NULL;
    const bool is_it = serial != NULL && strcmp(serial, wanted) == 0;
    if (!is_it)
        (void)snprintf(why, room, "%.200s: the converter's serial number is %.40s, the configuration is for %s",
                       d->path, serial != NULL ? serial : "not known", wanted);
    if (is_known)
        sp_free_port(port);
    return is_it;
}

/* An FTDI converter keeps what it has received for 16 ms, unless asked not to. Where that is impossible, it stays so. */
static void hurry(int fd)
{
    struct serial_struct line;
    if (ioctl(fd, TIOCGSERIAL, &line) != 0)
        return;
    line.flags |= (int)ASYNC_LOW_LATENCY;
    (void)ioctl(fd, TIOCSSERIAL, &line);
}

int device_open(device *d, const dr_limits *limits, char *why, size_t room)
{
    d->fd = -1;
    const int result =
        dryrig_link_open(&d->link, d->path, limits->kind == DR_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC, why, room);
    if (result != DRYRIG_OK)
        return result;
    if (!is_converter(d, limits, why, room)) {
        d->link.close(d->link.context);
        return DRYRIG_ERR_NO_PORT;
    }
    d->fd = link_descriptor(&d->link);
    (void)d->link.purge(d->link.context);
    hurry(d->fd);
    return DRYRIG_OK;
}

void device_close(device *d)
{
    if (d->fd >= 0)
        d->link.close(d->link.context);
    d->fd = -1;
}

ssize_t device_read(device *d, uint8_t *bytes, size_t room)
{
    const ssize_t count = read(d->fd, bytes, room);
    if (count < 0 && (errno == EAGAIN || errno == EINTR))
        return 0;
    return count == 0 ? -1 : count; /* it was readable: 0 is the end of the other side */
}

bool device_write(device *d, const uint8_t *bytes, size_t count)
{
    ssize_t written;
    do
        written = write(d->fd, bytes, count);
    while (written < 0 && errno == EINTR); /* no signal is caught: once at most */
    return written >= 0 && (size_t)written == count;
}

bool device_is_sent(const device *d)
{
    int left = 0;
    return d->fd < 0 || ioctl(d->fd, TIOCOUTQ, &left) != 0 || left == 0;
}
