/* dr_motion: where is it at time t? Pure functions of integers: nothing ticks, nothing adds up, nothing drifts.
 *
 * A leg is one piece of a move in which each axis runs from a start to a target at constant speed. Moves of several legs
 * (home and work order, calibration) are strung together by whoever knows the order.
 * Lengths are microsteps, spans microseconds since the leg began. Thread-safety: functions of their arguments only. */
#ifndef DR_MOTION_H
#define DR_MOTION_H

#include "dr_device.h" /* dr_us, DR_AXES */

#ifdef __cplusplus
extern "C" {
#endif

typedef struct {
    uint32_t from[DR_AXES], to[DR_AXES];
    dr_us lasts_us[DR_AXES]; /* each axis is there after so long; 0: it stands still */
} dr_leg;

/* A straight line: all axes start and end together; the axis with the longest way has the given speed. */
dr_leg dr_leg_straight(const uint32_t from[DR_AXES], const uint32_t to[DR_AXES], uint8_t quanta_per_step,
                       uint32_t speed_quanta_per_s);
/* Each axis for itself: it runs at the given speed and stops when it is there. */
dr_leg dr_leg_each(const uint32_t from[DR_AXES], const uint32_t to[DR_AXES], uint8_t quanta_per_step,
                   uint32_t speed_quanta_per_s);

/* How long the leg lasts: a way of s steps takes ceil(s * quanta * 10^6 / speed) us; the slowest axis counts. */
dr_us dr_leg_lasts_us(const dr_leg *leg);
/* Where each axis is: from +- floor(steps * elapsed / duration), and at the target ever after. */
void dr_leg_at(const dr_leg *leg, dr_us elapsed_us, uint32_t steps[DR_AXES]);

/* -- Whole microns on the way of a straight leg, for streamed positions [M note 16] ---------------------------------- */

/* How many there are: floor(longest way in um). The start does not count. */
uint32_t dr_leg_microns(const dr_leg *leg, uint8_t quanta_per_step);
/* When the k-th is reached, 1 <= k <= dr_leg_microns(): ceil(k * duration / longest way in um). */
dr_us dr_leg_micron_at_us(const dr_leg *leg, uint8_t quanta_per_step, uint32_t k);
/* How many have been reached by then. */
uint32_t dr_leg_microns_by(const dr_leg *leg, uint8_t quanta_per_step, dr_us elapsed_us);

/* -- The Home path of an MPC-200 [P] ---------------------------------------------------------------------------------- */

/* Where a point's way home along the diagonal ends: at X = 0 or Z = 0, whichever comes first. Y stays. */
void dr_diagonal_corner(dr_diagonal along, uint32_t steps[DR_AXES]);

#ifdef __cplusplus
}
#endif
#endif
