/* late: how long this program was ready to run and had no processor. What it measured of others meanwhile is that much less
 * exact.
 *
 * Thread-safety: for the first thread of a program alone. */
#ifndef LATE_H
#define LATE_H

#include <stdint.h>

/* In microseconds since it began. 0 where the kernel does not count it. */
uint64_t late_us(void);

#endif
