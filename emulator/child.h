/* child: the command of `dryrig-emu run`: the emulator lives as long as it does, and ends as it did.
 *
 * Thread-safety: one thread, one child. */
#ifndef CHILD_H
#define CHILD_H

#include <signal.h>
#include <stdbool.h>
#include <sys/types.h>

/* Starts it with the signals that it would have without us. Returns its process number; 0: *exit_status is what
 * `dryrig-emu` should end with (126 it cannot be executed, 127 it is not there), and stderr says why. */
pid_t child_start(char **command, const sigset_t *mask, int *exit_status);
/* Has it ended? Then *exit_status is its own, or 128+N where signal N ended it. */
bool child_has_ended(pid_t child, int *exit_status);

#endif
