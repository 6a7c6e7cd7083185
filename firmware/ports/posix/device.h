/* device: the guard's end of the controller's line: a serial port, or the pseudo-terminal of an emulator.
 *
 * It opens ports as the host library does (the same code) and then reads and writes without ever waiting.
 * Thread-safety: one thread at a time per device. */
#ifndef DEVICE_H
#define DEVICE_H

#include "dr_limits.h"
#include "dryrig/dryrig.h" /* dryrig_link, DRYRIG_OK ... */

#include <sys/types.h>

typedef struct {
    const char *path;
    dryrig_link link;
    int fd; /* -1: not open. Readable, or hung up: device_read() */
} device;

/* Opens the port for the controller of these limits. A dryrig_error; DRYRIG_ERR_NO_PORT: there is none now, or its
 * converter has another serial number; why[] says more. */
int device_open(device *d, const dr_limits *limits, char *why, size_t room);
void device_close(device *d);

/* What has come; 0: nothing now; less than 0: the port is gone. */
ssize_t device_read(device *d, uint8_t *bytes, size_t room);
/* False: the port is gone, or takes no more: the rest of a frame may be lost. */
bool device_write(device *d, const uint8_t *bytes, size_t count);
/* Is it all off this computer? */
bool device_is_sent(const device *d);

#endif
