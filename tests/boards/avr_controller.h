/* avr_controller: an emulated controller on UART 1 of a simulated board, in the board's own time and at its line's pace; and what
 * a board that is a bridge says on UART 2, its log. In a script's run prints
 *
 *     US >HEX     a byte to the controller is whole on the line
 *     US <HEX     a byte of the controller
 *     US #HEX...  a line of the log
 *     US tip X Y Z     where the first drive is at the end, microsteps */
#ifndef AVR_CONTROLLER_H
#define AVR_CONTROLLER_H

#include <simavr/sim_avr.h>

#include <stdbool.h>

#define CYCLES_PER_US 16u

/* kind: "trio" (an MP-845, switch 6 "None") or "mpc" (two MP-225). False: neither. */
bool avr_controller_begin(avr_t *avr, const char *kind, bool prints);
/* What is due by now; at least every 125 us. */
void avr_controller_exchange(void);
void avr_controller_end(void);

#endif
