/* The TRIO in virtual time: [T table 6, notes 11-13, page 1, table 1] and PROTOCOL.md. MP-285: a step takes 25 us. */
#include "scenario.h"

static void factory_settings(void)
{
    prepare(DR_TRIO);
    start();
    send_code('c');
    expect_trio_position(0, 10667, 10667, 10667, 30); /* MP-845 at 1,000 um */
    send_code('C');
    expect_trio_position(0, 10667, 10667, 10667, 30);
    TEST_ASSERT_EQUAL_HEX16(0x312, rig.c.firmware);
    TEST_ASSERT_TRUE(rig.c.calibrates_at_power_on); /* rear switch 6 ON */
    TEST_ASSERT_TRUE(rig.drives[0].y_moves_home);   /* rear switch 5 ON */
    TEST_ASSERT_FALSE(rig.drives[0].work_is_set);
    static const uint32_t zero[3] = {0, 0, 0};
    TEST_ASSERT_EQUAL_UINT32_ARRAY(zero, rig.c.home_steps, 3);
    expect_idle();
}

/* From 800, 1600, 2400 to 0, 0, 0 X takes 20 ms, Y 40 ms, Z 60 ms. Which of X and Z goes first: */
static void check_home_order(unsigned angle)
{
    const uint64_t t = rig.now_us;
    if (angle < 45) { /* Z has precedence */
        sim_run_to(&rig, t + 60000);
        expect_at(0, 800, 1600, 0);
        sim_run_to(&rig, t + 80000);
        expect_at(0, 0, 1600, 0);
    } else if (angle > 45) { /* X has precedence */
        sim_run_to(&rig, t + 20000);
        expect_at(0, 0, 1600, 2400);
        sim_run_to(&rig, t + 80000);
        expect_at(0, 0, 1600, 0);
    } else { /* together */
        sim_run_to(&rig, t + 20000);
        expect_at(0, 0, 1600, 1600);
        sim_run_to(&rig, t + 60000);
        expect_at(0, 0, 1600, 0);
    }
    const uint64_t y_begins = rig.now_us;
    sim_run_to(&rig, y_begins + 20000);
    expect_at(0, 0, 800, 0);
    expect_nothing();
    sim_run_to(&rig, y_begins + 40000);
    expect_cr(y_begins + 40000);
    expect_at(0, 0, 0, 0);
    expect_idle();
}

/* From 0, 0, 0 to 800, 1600, 2400. */
static void check_work_order(unsigned angle)
{
    const uint64_t t = rig.now_us;
    sim_run_to(&rig, t + 40000);
    expect_at(0, 0, 1600, 0);
    if (angle < 45) {
        sim_run_to(&rig, t + 100000);
        expect_at(0, 0, 1600, 2400);
        sim_run_to(&rig, t + 119999);
    } else if (angle > 45) {
        sim_run_to(&rig, t + 60000);
        expect_at(0, 800, 1600, 0);
        sim_run_to(&rig, t + 119999);
    } else {
        sim_run_to(&rig, t + 60000);
        expect_at(0, 800, 1600, 800);
        sim_run_to(&rig, t + 99999);
    }
    expect_nothing();
    sim_run(&rig, 1);
    expect_cr(t + (angle == 45 ? 100000 : 120000));
    expect_at(0, 800, 1600, 2400);
    expect_idle();
}

static void home_and_work_order_follow_the_angle(void)
{
    for (unsigned angle = 1; angle <= 89; angle++) {
        trio_at(800, 1600, 2400);
        rig.drives[0].work_is_set = true;
        rig.drives[0].work_steps[0] = 800;
        rig.drives[0].work_steps[1] = 1600;
        rig.drives[0].work_steps[2] = 2400;
        send_value('A', angle);
        expect_cr(0);
        send_code('h');
        check_home_order(angle);
        send_code('w');
        check_work_order(angle);
        send_point('H', 0, 0, 0);
        check_home_order(angle);
        send_point('W', 800, 1600, 2400);
        check_work_order(angle);
    }
}

static void moves_to_a_given_position_store_nothing(void)
{
    trio_at(0, 0, 0);
    send_point('H', 80, 80, 80);
    sim_run_out(&rig);
    expect_cr(6000);
    send_point('W', 160, 160, 160);
    sim_run_out(&rig);
    expect_cr(12000);
    send_code('w'); /* still none stored */
    expect_cr(12000);
    (void)expect_note(DR_NOTE_NO_WORK);
    expect_at(0, 160, 160, 160);
    send_code('h');
    sim_run_out(&rig);
    expect_cr(24000);
    expect_at(0, 0, 0, 0);
    expect_idle();
}

static void one_axis_commands_move_one_axis(void)
{
    static const char codes[] = "xXyYzZ";
    for (unsigned i = 0; i < 6; i++) {
        trio_at(1000, 1000, 1000);
        send_axis(codes[i], 1040);
        sim_run_to(&rig, 500);
        const unsigned axis = i / 2;
        expect_at(0, axis == 0 ? 1020 : 1000, axis == 1 ? 1020 : 1000, axis == 2 ? 1020 : 1000);
        sim_run_to(&rig, 999);
        expect_nothing();
        sim_run_to(&rig, 1000);
        expect_cr(1000);
        expect_at(0, axis == 0 ? 1040 : 1000, axis == 1 ? 1040 : 1000, axis == 2 ? 1040 : 1000);
        expect_idle();
    }
}

static void lines_run_at_sixteen_speeds(void)
{
    /* 1 mm at [T table 7]'s mm/s times 10,000 */
    static const uint32_t speed[16] = {3125,  6250,  9375,  12500, 15625, 18750, 21875, 25000,
                                       28125, 31250, 34375, 37500, 40625, 43750, 46875, 50000};
    for (unsigned level = 0; level < 256; level++) {
        trio_at(0, 8000, 0);
        send_line(level, 8000, 4000, 800);
        const uint32_t s = speed[level & 15];
        const uint64_t us = (UINT64_C(10000000000) + s - 1) / s;
        sim_run_to(&rig, us / 2);
        expect_at(0, (uint32_t)(8000 * (us / 2) / us), (uint32_t)(8000 - 4000 * (us / 2) / us),
                  (uint32_t)(800 * (us / 2) / us));
        sim_run_to(&rig, us - 1);
        expect_nothing();
        sim_run_to(&rig, us);
        expect_cr(us);
        expect_at(0, 8000, 4000, 800);
        expect_idle();
        if (level > 15) {
            TEST_ASSERT_EQUAL_UINT32(level & 15, expect_note(DR_NOTE_SPEED_CUT).value);
        } else {
            expect_no_note(DR_NOTE_SPEED_CUT);
        }
    }
}

static void angles_from_0_to_90_are_accepted(void)
{
    trio_at(0, 0, 0);
    unsigned set = 30;
    for (unsigned angle = 0; angle < 256; angle++) {
        send_value('A', angle);
        expect_cr(0);
        set = angle <= 90 ? angle : set;
        send_code('c');
        expect_trio_position(0, 0, 0, 0, set);
        if (angle > 90) {
            TEST_ASSERT_EQUAL_UINT32(angle, expect_note(DR_NOTE_BAD_VALUE).value);
        } else {
            expect_no_note(DR_NOTE_BAD_VALUE);
        }
    }
    expect_idle();
}

static void at_0_z_stands_and_at_90_x(void)
{
    for (unsigned angle = 0; angle <= 90; angle += 90) {
        const bool x_stands = angle == 90, z_stands = angle == 0;
        trio_at(80, 80, 80);
        rig.drives[0].work_is_set = true; /* 0, 0, 0 */
        send_value('A', angle);
        expect_cr(0);
        uint64_t t = 0;
        send_axis('x', 120);
        t += x_stands ? 0 : 1000;
        sim_run_to(&rig, t);
        expect_cr(t);
        send_axis('z', 120);
        t += z_stands ? 0 : 1000;
        sim_run_to(&rig, t);
        expect_cr(t);
        expect_at(0, x_stands ? 80 : 120, 80, z_stands ? 80 : 120);
        TEST_ASSERT_EQUAL_UINT32(x_stands ? DR_X : DR_Z, expect_note(DR_NOTE_AXIS_STANDS).value);

        send_line(15, 160, 100, 160); /* 40 steps: what stands does not count for the longest way either */
        t += 1000;
        sim_run_to(&rig, t - 1);
        expect_nothing();
        sim_run_to(&rig, t);
        expect_cr(t);
        expect_at(0, x_stands ? 80 : 160, 100, z_stands ? 80 : 160);

        send_line(15, x_stands ? 4000 : 160, 100, z_stands ? 4000 : 160);
        expect_cr(t);

        send_point('H', 200, 140, 200);
        t += 2000;
        sim_run_to(&rig, t);
        expect_cr(t);
        expect_at(0, x_stands ? 80 : 200, 140, z_stands ? 80 : 200);

        send_point('W', 120, 180, 120);
        t += 1000;
        sim_run_to(&rig, t);
        expect_at(0, x_stands ? 80 : 200, 180, z_stands ? 80 : 200);
        t += 2000;
        sim_run_to(&rig, t);
        expect_cr(t);
        expect_at(0, x_stands ? 80 : 120, 180, z_stands ? 80 : 120);

        send_code('w');
        t += (180 + 120) * 25;
        sim_run_to(&rig, t);
        expect_cr(t);
        expect_at(0, x_stands ? 80 : 0, 0, z_stands ? 80 : 0);

        send_code('h');
        expect_cr(t);
        expect_at(0, x_stands ? 80 : 0, 0, z_stands ? 80 : 0);
        expect_idle();

        send_code('R'); /* recalibration moves all axes at any angle */
        t += 80 * 25 + 200000;
        sim_run_to(&rig, t);
        expect_cr(t);
        expect_at(0, 8000, 8000, 8000);
        expect_idle();
    }
}

static void lock_out_keeps_y_out_of_home_only(void)
{
    trio_at(40, 40, 40);
    rig.drives[0].y_moves_home = false; /* external switch 5 OFF */
    rig.drives[0].work_is_set = true;
    send_code('h');
    sim_run_out(&rig);
    expect_cr(2000);
    expect_at(0, 0, 40, 0);
    send_code('w');
    sim_run_out(&rig);
    expect_cr(3000);
    expect_at(0, 0, 0, 0);
    send_point('W', 40, 40, 40);
    sim_run_out(&rig);
    expect_cr(6000);
    send_point('H', 0, 0, 0);
    sim_run_out(&rig);
    expect_cr(9000);
    expect_at(0, 0, 0, 0);
    send_axis('y', 80);
    sim_run_out(&rig);
    expect_cr(11000);
    send_code('R');
    sim_run_to(&rig, 13000);
    expect_at(0, 0, 0, 0);
    sim_run_out(&rig);
    expect_cr(213000);
    expect_at(0, 8000, 8000, 8000);
}

static void recalibration(void)
{
    static const unsigned angles[] = {0, 30, 45, 60, 90};
    for (unsigned i = 0; i < 5; i++) {
        trio_at(800, 1600, 2400);
        rig.c.home_steps[0] = 4000; /* it is the beginning of travel that counts, not the home position */
        send_value('A', angles[i]);
        expect_cr(0);
        send_code('R');
        sim_run_to(&rig, 20000);
        expect_at(0, angles[i] < 45 ? 800 : 0, 1600, angles[i] < 45 ? 1600 : angles[i] == 45 ? 1600 : 2400);
        const uint64_t y_begins = angles[i] == 45 ? 60000 : 80000;
        sim_run_to(&rig, y_begins);
        expect_at(0, 0, 1600, 0);
        sim_run_to(&rig, y_begins + 40000);
        expect_at(0, 0, 0, 0);
        sim_run_to(&rig, y_begins + 40000 + 100000); /* then out, all axes together */
        expect_at(0, 4000, 4000, 4000);
        sim_run_to(&rig, y_begins + 40000 + 199999);
        expect_nothing();
        sim_run(&rig, 1);
        expect_cr(y_begins + 240000);
        expect_at(0, 8000, 8000, 8000);
        expect_idle();
    }
}

static void recalibration_came_with_2_62(void)
{
    prepare(DR_TRIO);
    rig.c.firmware = 0x261;
    start();
    send_code('R');
    expect_idle();
    TEST_ASSERT_EQUAL(1, rig.c.unknown_bytes);
    TEST_ASSERT_EQUAL_HEX8('R', expect_note(DR_NOTE_UNKNOWN).bytes[0]);
    prepare(DR_TRIO);
    rig.c.firmware = 0x262;
    start();
    send_code('R');
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state);
}

static void interrupt_stops_lines_only(void)
{
    trio_at(0, 0, 0);
    send_line(15, 400, 200, 0);
    sim_run_to(&rig, 5012);
    send_code(3);
    expect_cr(5012);
    expect_at(0, 200, 100, 0);
    sim_run(&rig, 1000000);
    expect_idle();
    expect_at(0, 200, 100, 0);
    TEST_ASSERT_EQUAL_UINT32(200, expect_note(DR_NOTE_STOPPED).steps[0]);
    send_code(3); /* nothing moves: one CR */
    expect_cr(1005012);
    expect_idle();

    for (unsigned i = 0; i < 8; i++) {
        trio_at(80, 80, 80);
        rig.drives[0].work_is_set = true;
        static const char codes[] = "hwHWxyzR";
        switch (codes[i]) {
        case 'H':
        case 'W':
            send_point(codes[i], 0, 0, 0);
            break;
        case 'x':
        case 'y':
        case 'z':
            send_axis(codes[i], 0);
            break;
        default:
            send_code(codes[i]);
        }
        const uint64_t lasts = codes[i] == 'R' ? 206000 : i >= 4 ? 2000 : 6000;
        for (unsigned k = 0; k < 3; k++) {
            sim_run(&rig, 100);
            send_code(3);
            (void)expect_note(DR_NOTE_STOP_IGNORED);
            expect_nothing();
        }
        sim_run_to(&rig, lasts);
        expect_cr(lasts);
        sim_run_out(&rig);
        expect_idle();
        TEST_ASSERT_EQUAL(0, rig.c.kept_commands); /* it was dropped, not kept */
    }
}

static void power_up_calibrates(void)
{
    trio_at(800, 1600, 2400);
    TEST_ASSERT_TRUE(power(false));
    sim_run_to(&rig, 500);
    TEST_ASSERT_TRUE(power(true));
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state);
    send_code('c'); /* kept until it is over */
    send_code(3);   /* and not to be stopped */
    sim_run_to(&rig, 500 + 120000 + 200000 - 1);
    expect_nothing();
    sim_run_out(&rig);
    expect_trio_position(500 + 320000, 8000, 8000, 8000, 30); /* no CR of its own */
    expect_idle();
}

static void switch_6_off_keeps_the_positions(void)
{
    trio_at(800, 1600, 2400);
    rig.c.calibrates_at_power_on = false;
    send_value('A', 77);
    rig.c.home_steps[1] = 1640;
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_TRUE(power(true));
    expect_cr(0);
    send_code('c');
    expect_trio_position(0, 800, 1600, 2400, 77); /* the angle outlives power-off too [P] */
    send_code('h');
    sim_run_out(&rig);
    expect_cr(20000 + 60000 + 1000);
    expect_at(0, 0, 1640, 0); /* and the home position */
}

static void targets_are_clipped_to_the_travel(void)
{
    static const struct {
        dr_stage_id stage;
        uint32_t end[3];
    } stages[] = {
        {DR_STAGE_TRIO_MP845, {266667, 266667, 266667}},
        {DR_STAGE_TRIO_MP865, {533333, 133333, 266667}},
        {DR_STAGE_TRIO_MP285, {200000, 200000, 200000}},
        {DR_STAGE_TRIO_MP265, {200000, 100000, 200000}},
    };
    for (size_t i = 0; i < 4; i++) {
        for (unsigned axis = 0; axis < 3; axis++) {
            static const char codes[] = "xyz";
            const uint32_t *end = stages[i].end;
            prepare(DR_TRIO);
            dr_drive_init(&rig.drives[0], stages[i].stage);
            for (unsigned k = 0; k < 3; k++) {
                rig.drives[0].position_steps[k] = end[k] - 40;
            }
            start();
            send_axis(codes[axis], end[axis]);
            sim_run_out(&rig);
            expect_no_note(DR_NOTE_CLIPPED);
            const uint64_t t = rig.now_us;
            expect_cr(t);
            send_axis(codes[axis], end[axis] + 1);
            expect_cr(t); /* it is there already */
            TEST_ASSERT_EQUAL_UINT32(axis, expect_note(DR_NOTE_CLIPPED).value);
            send_line(15, UINT32_MAX, UINT32_MAX, UINT32_MAX); /* "negative" means the upper end */
            sim_run_out(&rig);
            expect_cr(2 * t);
            expect_at(0, end[0], end[1], end[2]);
            expect_idle();
        }
    }
}

static void a_move_of_no_length_answers_at_once(void)
{
    trio_at(40, 40, 40);
    send_axis('x', 40);
    expect_cr(0);
    send_line(0, 40, 40, 40);
    expect_cr(0);
    send_point('H', 40, 40, 40);
    expect_cr(0);
    expect_idle();
}

static void tests(void)
{
    RUN_TEST(factory_settings);
    RUN_TEST(home_and_work_order_follow_the_angle);
    RUN_TEST(moves_to_a_given_position_store_nothing);
    RUN_TEST(one_axis_commands_move_one_axis);
    RUN_TEST(lines_run_at_sixteen_speeds);
    RUN_TEST(angles_from_0_to_90_are_accepted);
    RUN_TEST(at_0_z_stands_and_at_90_x);
    RUN_TEST(lock_out_keeps_y_out_of_home_only);
    RUN_TEST(recalibration);
    RUN_TEST(recalibration_came_with_2_62);
    RUN_TEST(interrupt_stops_lines_only);
    RUN_TEST(power_up_calibrates);
    RUN_TEST(switch_6_off_keeps_the_positions);
    RUN_TEST(targets_are_clipped_to_the_travel);
    RUN_TEST(a_move_of_no_length_answers_at_once);
}

int main(void)
{
    UNITY_BEGIN();
    at_every_clock(tests);
    return UNITY_END();
}
