/* terminal: whether one can be drawn on, and putting it back where a program that drew on it can no longer do so itself.
 *
 * Thread-safety: one thread. */
#ifndef TERMINAL_H
#define TERMINAL_H

#include <stdbool.h>
#include <termios.h>

typedef struct {
    bool is_kept;
    struct termios settings;
} terminal;

/* Is there a terminal at stdout, of a kind that is known (TERM) and has a cursor that can be moved? */
bool terminal_is_known(void);
/* Keeps how the terminal at stdin is set. */
void terminal_keep(terminal *t);
/* Sets it as it was, and takes it back from the program that drew on it: the usual screen, the cursor, plain letters. */
void terminal_restore(const terminal *t);

#endif
