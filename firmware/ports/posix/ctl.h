/* ctl: gives orders to a running guard: `dryrig-guard ctl SOCKET ORDER`. */
#ifndef CTL_H
#define CTL_H

#include <stdbool.h>

#define CTL_NOT_DONE 4 /* exit status: the guard said no */

/* Sends the order and prints the answers, in words or (is_json) as they come. follows: until the guard ends.
 * Returns an exit status: 0 done, 1 nobody answers, CTL_NOT_DONE. */
int ctl_run(const char *path, const char *order, bool follows, bool is_json);

#endif
