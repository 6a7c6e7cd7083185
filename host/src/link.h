/* link: the two built-in links, and what they share. Not installed. */
#ifndef DRYRIG_LINK_H
#define DRYRIG_LINK_H

#include "dryrig/dryrig.h"

#define WRITE_LIMIT_MS 2000 /* for the 14 bytes of the longest command to leave, 2.4 ms at 57600 baud */

/* A serial port, by libserialport. */
int link_serial_open(dryrig_link *out, const char *path, unsigned baud, char *why, size_t room);
/* A PTY, which libserialport refuses: it has no modem lines and is not listed in /sys/class/tty. */
int link_pty_open(dryrig_link *out, const char *path, unsigned baud, char *why, size_t room);

/* What to wait for with poll(), for who reads and writes without link->read and link->write. -1: not one of these
 * links. */
int link_descriptor(const dryrig_link *link);
int link_pty_descriptor(const dryrig_link *link);
int link_serial_descriptor(const dryrig_link *link);

/* The clock of both. */
uint64_t link_now_us(void *context);
void link_sleep_us(void *context, uint32_t span_us);

/* Takes an open port for this program alone among those that ask. 0, or PORT_BUSY. */
int link_lock(int fd);
/* Explains that `path` is in use, and by whom. Returns PORT_BUSY. */
int link_busy(const char *path, char *why, size_t room);

#endif
