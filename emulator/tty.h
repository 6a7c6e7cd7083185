/* tty: the rate that a terminal is set to, as a number. Half of the rates that serial ports are used with, 128,000 baud
 * among them, have no name that termios.h knows.
 * Thread-safety: a function of its argument only. */
#ifndef TTY_H
#define TTY_H

#include <stdint.h>

/* 0: it cannot be told. */
uint32_t tty_baud(int fd);

#endif
