/* Unit tests of the core that run on the smallest target too: 16-bit int, constants in flash, two kilobytes for all of
 * it. What they expect is computed here in another way than the core does it, or typed from the manuals. */
#include "rig.h"
#include "target.h"

#include "unity.h"

static rig r;

void setUp(void) {}
void tearDown(void) {}

/* [T tables 4, 5; M tables 6, 7]: the rows as they come out of flash. */
static void stages_come_out_of_flash_as_they_went_in(void)
{
    static const struct {
        uint8_t id, quanta;
        uint16_t um_per_s;
        uint32_t x, y, z;
    } rows[] = {{DR_STAGE_TRIO_MP845, 6, 5000, 266667, 266667, 266667},
                {DR_STAGE_TRIO_MP865, 6, 5000, 533333, 133333, 266667},
                {DR_STAGE_MPC_MP225, 4, 3000, 400000, 400000, 400000},
                {DR_STAGE_MPC_MP865, 3, 3000, 1066667, 266667, 533333},
                {DR_STAGE_MPC_MT800, 5, 5000, 281600, 281600, 281600}};
    for (uint8_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        dr_stage stage;
        TEST_ASSERT_TRUE(dr_stage_get((dr_stage_id)rows[i].id, &stage));
        TEST_ASSERT_EQUAL_UINT8(rows[i].quanta, stage.quanta_per_step);
        TEST_ASSERT_EQUAL_UINT16(rows[i].um_per_s, stage.full_speed_um_per_s);
        TEST_ASSERT_EQUAL_UINT32(rows[i].x, stage.travel_steps[DR_X]);
        TEST_ASSERT_EQUAL_UINT32(rows[i].y, stage.travel_steps[DR_Y]);
        TEST_ASSERT_EQUAL_UINT32(rows[i].z, stage.travel_steps[DR_Z]);
    }
}

static void commands_come_out_of_flash_as_they_went_in(void)
{
    dr_command command;
    uint16_t known = 0;
    for (uint16_t code = 0; code < 256; code++)
        known = (uint16_t)(known + (dr_command_find(DR_TRIO, DR_FIRMWARE_TRIO, (uint8_t)code, &command) ? 1u : 0u));
    TEST_ASSERT_EQUAL_UINT16(16, known);
    TEST_ASSERT_TRUE(dr_command_find(DR_MPC, 0x0321, 'S', &command));
    TEST_ASSERT_EQUAL_UINT8(13, command.args);
    TEST_ASSERT_EQUAL_HEX16(0x0300, command.since);
    TEST_ASSERT_FALSE(dr_command_find(DR_MPC, 0x0299, 'S', &command));
}

static void speeds_need_more_than_16_bits(void)
{
    TEST_ASSERT_EQUAL_UINT32(320000, dr_speed_quanta_per_s(DR_STAGE_TRIO_MP845, 15)); /* 5,000 um/s */
    TEST_ASSERT_EQUAL_UINT32(83200, dr_speed_quanta_per_s(DR_STAGE_MPC_MP225, 15));   /* 1,300 um/s */
    TEST_ASSERT_EQUAL_UINT32(192000, dr_speed_quanta_per_s(DR_STAGE_MPC_MP225, DR_SPEED_FULL));
    TEST_ASSERT_EQUAL_UINT32(2767ul * 64, dr_measured_quanta_per_s(15));
}

static uint32_t seed = 1;
static uint32_t chance(uint32_t below)
{
    seed = seed * UINT32_C(1664525) + UINT32_C(1013904223);
    return (uint32_t)((uint64_t)seed * below >> 32);
}

/* floor(a * b / c) by long division, bit by bit. */
static uint32_t scaled(uint32_t a, uint32_t b, uint32_t c)
{
    uint64_t rest = 0;
    uint32_t quotient = 0;
    for (int8_t bit = 31; bit >= 0; bit--) {
        rest = 2 * rest + ((a >> bit & 1u) != 0 ? b : 0u);
        quotient *= 2u;
        for (; rest >= c; rest -= c) /* at most twice, b < c */
            quotient++;
    }
    return quotient;
}

static void positions_on_the_way_are_exact(void)
{
    for (uint8_t i = 0; i < 100; i++) {
        const uint32_t from[DR_AXES] = {chance(1066668), chance(266668), chance(533334)};
        const uint32_t to[DR_AXES] = {chance(1066668), chance(266668), chance(533334)};
        const dr_leg leg = dr_leg_straight(from, to, 3, 5200u * (1u + chance(16)));
        const dr_us lasts_us = dr_leg_lasts_us(&leg), at_us = chance(lasts_us);
        uint32_t steps[DR_AXES];
        dr_leg_at(&leg, at_us, steps);
        for (uint8_t axis = 0; axis < DR_AXES; axis++) {
            const uint32_t way = from[axis] < to[axis] ? to[axis] - from[axis] : from[axis] - to[axis];
            const uint32_t done = scaled(way, at_us, lasts_us);
            TEST_ASSERT_EQUAL_UINT32(from[axis] < to[axis] ? from[axis] + done : from[axis] - done, steps[axis]);
        }
    }
}

static uint8_t heard[32];
static uint8_t heard_count;
static dr_us heard_at;
static void hear(dr_us when, uint8_t byte)
{
    heard[heard_count++ % sizeof heard] = byte;
    heard_at = when;
}

static void the_clock_wraps_in_the_middle_of_a_move(void)
{
    r.told = hear;
    for (dr_us before_us = 0; before_us < 700000; before_us += 23456) {
        rig_begin(&r, DR_TRIO, 0u - before_us);
        heard_count = 0;
        rig_send(&r, "H\0\0\0\0\0\0\0\0\0\0\0", 12);
        const dr_us began = r.now;
        rig_send(&r, "", 1); /* the last byte is a 0 */
        rig_run_us(&r, 700000);
        TEST_ASSERT_EQUAL_UINT8(1, heard_count);
        TEST_ASSERT_EQUAL_HEX8(0x0D, heard[0]);
        /* 10,667 steps of 6/64 um at 5,000 um/s, three axes one after the other, each rounded up. */
        TEST_ASSERT_EQUAL_UINT32(3ul * 200007, heard_at - began);
    }
}

static void an_idle_controller_does_not_see_time_go_by(void)
{
    rig_begin(&r, DR_MPC, 77);
    const dr_controller before = r.controller;
    dr_us when;
    TEST_ASSERT_FALSE(dr_controller_due(&r.controller, &when));
    for (uint8_t i = 0; i < 50; i++) {
        uint8_t byte;
        r.now += UINT32_C(2000000000);
        TEST_ASSERT_EQUAL(0, dr_controller_pull(&r.controller, r.now, &byte, 1));
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &r.controller, sizeof before);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(stages_come_out_of_flash_as_they_went_in);
    RUN_TEST(commands_come_out_of_flash_as_they_went_in);
    RUN_TEST(speeds_need_more_than_16_bits);
    RUN_TEST(positions_on_the_way_are_exact);
    RUN_TEST(the_clock_wraps_in_the_middle_of_a_move);
    RUN_TEST(an_idle_controller_does_not_see_time_go_by);
    return UNITY_END();
}
