#include "dr_motion.h"

static uint32_t way_steps(const dr_leg *leg, uint8_t axis)
{
    const uint32_t from = leg->from[axis], to = leg->to[axis];
    return from < to ? to - from : from - to;
}

static uint32_t longest_way_steps(const dr_leg *leg)
{
    uint32_t longest = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (way_steps(leg, axis) > longest)
            longest = way_steps(leg, axis);
    return longest;
}

/* Rounded up: an axis is never at its target too early. */
static dr_us way_lasts_us(uint32_t steps, uint8_t quanta_per_step, uint32_t speed_quanta_per_s)
{
    const uint64_t quanta_us = (uint64_t)steps * quanta_per_step * DR_US_PER_S;
    return (dr_us)((quanta_us + speed_quanta_per_s - 1u) / speed_quanta_per_s);
}

static dr_leg leg_between(const uint32_t from[DR_AXES], const uint32_t to[DR_AXES])
{
    dr_leg leg;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        leg.from[axis] = from[axis];
        leg.to[axis] = to[axis];
        leg.lasts_us[axis] = 0;
    }
    return leg;
}

dr_leg dr_leg_straight(const uint32_t from[DR_AXES], const uint32_t to[DR_AXES], uint8_t quanta_per_step,
                       uint32_t speed_quanta_per_s)
{
    dr_leg leg = leg_between(from, to);
    const dr_us lasts_us = way_lasts_us(longest_way_steps(&leg), quanta_per_step, speed_quanta_per_s);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        leg.lasts_us[axis] = way_steps(&leg, axis) > 0 ? lasts_us : 0;
    return leg;
}

dr_leg dr_leg_each(const uint32_t from[DR_AXES], const uint32_t to[DR_AXES], uint8_t quanta_per_step,
                   uint32_t speed_quanta_per_s)
{
    dr_leg leg = leg_between(from, to);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        leg.lasts_us[axis] = way_lasts_us(way_steps(&leg, axis), quanta_per_step, speed_quanta_per_s);
    return leg;
}

dr_us dr_leg_lasts_us(const dr_leg *leg)
{
    dr_us lasts_us = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (leg->lasts_us[axis] > lasts_us)
            lasts_us = leg->lasts_us[axis];
    return lasts_us;
}

void dr_leg_at(const dr_leg *leg, dr_us elapsed_us, uint32_t steps[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        if (elapsed_us >= leg->lasts_us[axis]) {
            steps[axis] = leg->to[axis];
            continue;
        }
        const uint32_t done = (uint32_t)((uint64_t)way_steps(leg, axis) * elapsed_us / leg->lasts_us[axis]);
        steps[axis] = leg->from[axis] < leg->to[axis] ? leg->from[axis] + done : leg->from[axis] - done;
    }
}

static uint64_t longest_way_quanta(const dr_leg *leg, uint8_t quanta_per_step)
{
    return (uint64_t)longest_way_steps(leg) * quanta_per_step;
}

uint32_t dr_leg_microns(const dr_leg *leg, uint8_t quanta_per_step)
{
    return (uint32_t)(longest_way_quanta(leg, quanta_per_step) / DR_QUANTA_PER_UM);
}

dr_us dr_leg_micron_at_us(const dr_leg *leg, uint8_t quanta_per_step, uint32_t k)
{
    const uint64_t way = longest_way_quanta(leg, quanta_per_step);
    /* There is a k-th micron, so there is a way. NOLINTNEXTLINE(clang-analyzer-core.DivideZero) */
    return (dr_us)(((uint64_t)k * DR_QUANTA_PER_UM * dr_leg_lasts_us(leg) + way - 1u) / way);
}

uint32_t dr_leg_microns_by(const dr_leg *leg, uint8_t quanta_per_step, dr_us elapsed_us)
{
    const dr_us lasts_us = dr_leg_lasts_us(leg);
    if (elapsed_us >= lasts_us)
        return dr_leg_microns(leg, quanta_per_step);
    return (uint32_t)(longest_way_quanta(leg, quanta_per_step) * elapsed_us / ((uint64_t)DR_QUANTA_PER_UM * lasts_us));
}

void dr_diagonal_corner(dr_diagonal along, uint32_t steps[DR_AXES])
{
    const uint64_t x_sin = (uint64_t)steps[DR_X] * along.sin, z_cos = (uint64_t)steps[DR_Z] * along.cos;
    if (x_sin <= z_cos) {
        steps[DR_Z] -= (uint32_t)(x_sin / along.cos);
        steps[DR_X] = 0;
    } else {
        steps[DR_X] -= (uint32_t)(z_cos / along.sin);
        steps[DR_Z] = 0;
    }
}
