/* hands: the emulator with a panel of real buttons and knobs. In place of dr_emulator_begin() and dr_emulator_step(), on a
 * board whose inputs (port.h) are wired as follows; what is not wired is not there. docs/boards.md has the pins.
 *
 *     input    TRIO          MPC-200 and ROE-200
 *     0        HOME          HOME
 *     1        WORK          WORK POS.
 *     2        PULSE         STOP/SET
 *     3        RELATIVE      NORM/DIAG
 *     4        SPEED         CENTER (CALIBRATE)
 *     5        mains switch  MANIPULATOR, the next one       the mains switch is a button here: off, and on again
 *     6, 7     knob X        knob X                          contacts A, B of an encoder
 *     8, 9     knob Y        knob Y
 *     10, 11   knob Z        knob Z
 *     12, 13   knob D        MANIPULATOR
 *     14, 15   -             MODE
 *
 * Output 0 is high for 0.1 s where the controller beeps: a buzzer. Output 1 is high, an LED, while a TRIO's screen is red, or
 * an ROE-200's LED of NORM/DIAG is on.
 *
 * How long a button must be held, and everything else, is said by dr_panel. */
#ifndef DR_HANDS_H
#define DR_HANDS_H

#include "dr_panel.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Inputs by number, for boards whose pins are chosen elsewhere (arduino/). A knob has this one and the next. */
enum {
    DR_HANDS_HOME = 0,
    DR_HANDS_WORK = 1,
    DR_HANDS_PULSE = 2,
    DR_HANDS_STOP = 2,
    DR_HANDS_RELATIVE = 3,
    DR_HANDS_DIAGONAL = 3,
    DR_HANDS_SPEED = 4,
    DR_HANDS_CALIBRATE = 4,
    DR_HANDS_MAINS = 5,
    DR_HANDS_MANIPULATOR = 5,
    DR_HANDS_KNOB_X = 6,
    DR_HANDS_KNOB_Y = 8,
    DR_HANDS_KNOB_Z = 10,
    DR_HANDS_KNOB_D = 12,
    DR_HANDS_KNOB_MANIPULATOR = 12,
    DR_HANDS_KNOB_MODE = 14
};

#define DR_BEEP_US UINT32_C(100000)

void dr_hands_begin(void);
void dr_hands_step(void);
const dr_panel *dr_hands_panel(void);

#ifdef __cplusplus
}
#endif
#endif
