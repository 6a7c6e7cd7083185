/* values: what people write for numbers, points and times, in options, rig files and on the control channel.
 *
 * Each function is false for what it cannot take; then why[] says what was expected, and the result is untouched.
 * Thread-safety: functions of their arguments only. */
#ifndef VALUES_H
#define VALUES_H

#include "dr_device.h" /* dr_stage_id */

#include <stddef.h>

#define WHY_ROOM 640u

/* A whole number from `least` to `most`. */
bool values_number(const char *text, unsigned least, unsigned most, unsigned *number, char why[WHY_ROOM]);
/* X,Y,Z within the travel of a stage: in microsteps, or in microns with "um" behind each number or behind the last. */
bool values_point(const char *text, dr_stage_id id, uint32_t steps[DR_AXES], char why[WHY_ROOM]);
/* How steep the diagonal is: "29", "29less", "29more" [M table 2]; as the number that the switches 1-4 make. */
bool values_diagonal(const char *text, uint8_t *diagonal, char why[WHY_ROOM]);
/* A time: "250ms", "2s", "1.5s", "80us", "3min"; up to 1,000 hours. */
bool values_time_us(const char *text, uint64_t *us, char why[WHY_ROOM]);
/* A share: "0.01", "1%"; in millionths, 0 to 1,000,000. */
bool values_millionths(const char *text, uint32_t *millionths, char why[WHY_ROOM]);

#endif
