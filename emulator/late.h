/* late: how long this program was ready to run and had no processor. What it measured of others meanwhile is that much less
 * exact.
 *
 * Thread-safety: for the first thread of a program alone. */
#ifndef LATE_H
#define LATE_H

#include <stdint.h>

/* In microseconds since it began, as far as the kernel counts it, and what was added. */
uint64_t late_us(void);
/* It has waited for something else so long: for a disk. */
void late_add(uint64_t span_us);

#endif
