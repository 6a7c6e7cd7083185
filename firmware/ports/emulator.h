/* emulator: the emulated controller on a board. A board's main() calls dr_emulator_begin() once and then dr_emulator_step()
 * for ever; everything else it needs to provide is in port.h. A board with buttons calls dr_hands_begin() and dr_hands_step()
 * of hands.h instead. */
#ifndef DR_EMULATOR_H
#define DR_EMULATOR_H

#include "dr_controller.h" /* dr_controller, for whoever wants to look at it */

#ifdef __cplusplus
extern "C" {
#endif

/* Switches the controller on, as its power switch does: what it kept is there, and a TRIO calibrates unless told not to. */
void dr_emulator_begin(void);
/* What there is to do now, and then dr_port_wait(). */
void dr_emulator_step(void);
const dr_controller *dr_emulator_controller(void);

/* -- The same in pieces, for hands.c ------------------------------------------------------------------------------- */

/* All of dr_emulator_begin() but the power switch. */
dr_controller *dr_emulator_prepare(void);
/* dr_emulator_step() at this instant, which waits for no longer than that; 0: as long as there is nothing to do. */
void dr_emulator_step_at(dr_us now, dr_us longest_us);
/* Something that is kept without power may have changed. */
void dr_emulator_touch(dr_us now);

#ifdef __cplusplus
}
#endif
#endif
