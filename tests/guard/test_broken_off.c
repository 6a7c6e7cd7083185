/* What is broken off, and what is remembered of it. The test is the controller. */
#include "bench.h"

void setUp(void) {}
void tearDown(void) {}

static void trio_says(uint32_t x) { device_at(x, 40000, 40000, 30); }

static void mpc_says(uint8_t drive, uint32_t x) { device_at_drive(drive, x, 80000, 80000); }

static void armed(dr_kind kind, uint16_t facts)
{
    bench_proved_by_hand(kind, facts);
    bench_arm_by_hand(device_at_home);
}

static void rest_at(void (*says)(void))
{
    run_us(100000);
    says();
    run_us(100000);
    says();
}

static void says_41000(void) { trio_says(41000); }
static void says_81000(void) { mpc_says(1, 81000); }

static void a_stop_within_a_line_keeps_its_target_possible(void)
{
    armed(DR_MPC, 0);
    host_line(15, 84000, 80000, 80000);
    run_us(2000);
    device_at_home();
    run_us(12000); /* in the pause behind the second byte */
    host_code(3);
    run_us(30000);
    expect_state(DR_GUARD_STOPPING);
    TEST_ASSERT_EQUAL(1, wire_stops());
    device_says("\r", 1);
    rest_at(says_81000);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    TEST_ASSERT_EQUAL(84000 * 4, rig.guard.scene.old[0].target_q.max_q[DR_X]);
}

static void a_stop_within_a_setting_breaks_no_motion_off(void)
{
    armed(DR_TRIO, 0);
    run_us(1000);
    host_value('A', 45);
    TEST_ASSERT_EQUAL(1, rig.guard.out_at); /* its first byte is on the line */
    stop_input(true);
    run_us(1000);
    device_says("\r\r", 2);
    rest_at(device_at_home);
    expect_state(DR_GUARD_STOPPED);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
}

static void a_motion_that_cannot_be_stopped_and_is_late_is_looked_for(void)
{
    armed(DR_TRIO, 0);
    host_axis('x', 40800); /* 100 um: 30 ms and 2 s */
    run_us(2000);
    device_at_home();
    run_us(2050000);
    expect_state(DR_GUARD_STOPPING);
    TEST_ASSERT_FALSE(status().buzzer); /* nobody has asked for a stop */
    run_us(400000);
    says_41000();
    run_us(100000);
    says_41000();
    expect_fault(DR_FAULT_NO_CR);
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    TEST_ASSERT_EQUAL(41000, rig.guard.scene.old[0].at_steps[DR_X]);
}

static void a_cable_pulled_in_a_stop_ends_it(void)
{
    armed(DR_TRIO, 0);
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    device_at_home();
    run_us(150000);
    host_code(3);
    run_us(1000);
    cables(true, false);
    expect_fault(DR_FAULT_NO_DEVICE);
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    TEST_ASSERT_FALSE(rig.guard.scene.frame_lost); /* that takes a calibration */
    run_us(400000);
    TEST_ASSERT_EQUAL(1, wire_stops()); /* repeated for nobody */
    host_code('c');
    expect_refused(DR_REASON_NOT_ARMED); /* there is nobody who has proved to be the controller */
}

static void the_end_of_another_drives_way_is_no_end(void)
{
    armed(DR_MPC, 0);
    host_point('M', 84000, 80000, 80000);
    run_us(2000);
    device_at_home();
    run_us(100000);
    device_says("\r", 1);
    run_us(2000);
    mpc_says(2, 84000); /* somebody has chosen the other drive by hand; by chance it stands where the first should be */
    run_us(100000);
    mpc_says(2, 84000);
    expect_fault(DR_FAULT_WRONG_END);
    expect_silence();
}

/* ^C comes within a streamed position; the controller sends no more of it. */
static void a_streamed_position_that_is_cut_off_swallows_no_cr(void)
{
    armed(DR_MPC, DR_RIG_MAY_STREAM);
    host_line(15, 84000, 80000, 80000);
    run_us(2000);
    device_at_home();
    run_us(100000);
    expect_state(DR_GUARD_MOVING_S);
    device_says("\xFF\xFF\xFF\x40", 4);
    host_code(3);
    run_us(1000);
    device_says("\r", 1);
    rest_at(says_81000);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_EQUAL(1, wire_stops());
    expect_heard("\xFF\xFF\xFF\x40\r", 5);
}

static void a_host_that_has_stopped_already_is_told_apart(void)
{
    armed(DR_TRIO, 0);
    host_code('c');
    run_us(500);
    device_says("abc", 3);
    run_us(2000000); /* the rest never comes */
    TEST_ASSERT_NOT_NULL(last_record(DR_EVENT_NO_REPLY));
    host_code(3);
    run_us(500);
    stop_input(true); /* behind the host's ^C, whose CR comes first */
    device_says("\r", 1);
    TEST_ASSERT_EQUAL(0, rig.guard.stop_crs);
    device_says("\r", 1);
    TEST_ASSERT_EQUAL(1, rig.guard.stop_crs);
}

static void an_old_reply_that_never_came_hides_no_cr(void)
{
    armed(DR_TRIO, 0);
    host_code('c');
    run_us(500);
    device_says("abc", 3);
    run_us(2000000);
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    device_at_home();
    run_us(10000);
    host_code(3);
    run_us(1000);
    device_says("\r", 1);
    run_us(300000);
    TEST_ASSERT_EQUAL(1, wire_stops());
    expect_heard("abc", 3);
}

static void a_stop_refuses_only_what_was_waiting(void)
{
    armed(DR_TRIO, 0);
    stop_input(true);
    TEST_ASSERT_EQUAL(0, status().refused);
    armed(DR_MPC, 0);
    host_line(15, 84000, 80000, 80000);
    run_us(2000);
    device_at_home();
    run_us(12000);
    stop_input(true); /* within the frame: it has begun */
    TEST_ASSERT_EQUAL(0, status().refused);
    armed(DR_TRIO, 0);
    host_line(15, 48000, 40000, 40000);
    stop_input(true);
    TEST_ASSERT_EQUAL(1, status().refused);
    expect_refused(DR_REASON_CANCELLED);
}

static void a_stop_of_what_cannot_be_stopped_waits_for_its_own_end(void)
{
    armed(DR_TRIO, 0);
    host_axis('x', 40800);
    run_us(2000);
    device_at_home();
    run_us(5000);
    const dr_us ends = rig.guard.at[DR_TIMER_TASK];
    stop_input(true);
    TEST_ASSERT_TRUE(status().buzzer);
    device_says("n", 1); /* whatever that is, it is not the end */
    TEST_ASSERT_EQUAL_UINT32(ends, rig.guard.at[DR_TIMER_TASK]);
    device_says("\r", 1);
    TEST_ASSERT_NOT_EQUAL(ends, rig.guard.at[DR_TIMER_TASK]);
}

static void each_stop_counts_its_own_crs(void)
{
    armed(DR_TRIO, 0);
    for (unsigned round = 0; round < 2; round++) {
        host_line(15, 48000, 40000, 40000);
        run_us(2000);
        device_at_home();
        run_us(10000);
        host_code(3);
        run_us(1000);
        if (round == 0)
            device_says("\r\r", 2);
        else
            run_us(300000); /* this time the controller says nothing */
        rest_at(device_at_home);
        expect_state(DR_GUARD_IDLE);
    }
    expect_cr();
    expect_silence();
}

static void ctrl_c_is_sent_three_times_whatever_it_is_that_asks_for_it(void)
{
    armed(DR_TRIO, 0);
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    device_at_home();
    run_us(10000);
    host_code(3);
    run_us(151000);
    TEST_ASSERT_EQUAL(2, wire_stops()); /* no CR in 150 ms */
    device_says("\r", 1);
    for (uint32_t i = 0; i < 5; i++) {
        run_us(100000);
        trio_says(41000 + 10 * i); /* still moving */
    }
    TEST_ASSERT_EQUAL(3, wire_stops());
}

static void a_fault_says_why_it_stops(void)
{
    armed(DR_TRIO, 0);
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    device_at_home();
    run_us(10000);
    device_says("0123456789abcdefg", 17);
    TEST_ASSERT_EQUAL(DR_STOP_NOISE, last_record(DR_EVENT_STOP)->code);
    armed(DR_TRIO, 0);
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    device_at_home();
    run_us(10000);
    device_says("\r", 1);
    run_us(2002000); /* and no position */
    TEST_ASSERT_EQUAL(DR_STOP_DEADLINE, last_record(DR_EVENT_STOP)->code);
}

static void a_fault_at_rest_breaks_nothing_off(void)
{
    armed(DR_TRIO, 0);
    host_line(15, 41000, 40000, 40000);
    run_us(2000);
    device_at_home();
    run_us(10000);
    host_code(3); /* too late: it is there already */
    run_us(1000);
    device_says("\r", 1);
    rest_at(says_41000);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
    device_says("0123456789abcdefg", 17);
    expect_fault(DR_FAULT_DEVICE_NOISE);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
}

static void limits_that_are_damaged_stop_what_is_under_way_and_nothing_else(void)
{
    dr_us when;
    armed(DR_TRIO, 0);
    rig.limits.margin_q ^= 1;
    TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, (dr_us)(rig.clock_at_start + rig.now)));
    run_us(1000000);
    expect_fault(DR_FAULT_DAMAGED);
    TEST_ASSERT_EQUAL(0, wire_stops());
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
    armed(DR_TRIO, 0);
    host_line(15, 41000, 40000, 40000); /* a query waits for its turn */
    const uint32_t before = rig.wire_count;
    rig.limits.margin_q ^= 1;
    TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, (dr_us)(rig.clock_at_start + rig.now)));
    run_us(1000000);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
    TEST_ASSERT_EQUAL(1, wire_stops());
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
    armed(DR_TRIO, 0);
    line_hangs();
    host_value('A', 45); /* a setting of which nothing has left: it does not leave any more */
    host_bytes("S", 1);  /* half a frame of the host's: nobody waits for the rest */
    rig.limits.margin_q ^= 1;
    TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, (dr_us)(rig.clock_at_start + rig.now)));
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
    const uint32_t sent = rig.wire_count;
    line_goes_on();
    run_us(1000000);
    TEST_ASSERT_EQUAL(sent + 1, rig.wire_count);
    TEST_ASSERT_EQUAL(1, wire_stops());
    armed(DR_MPC, 0);
    host_line(15, 84000, 80000, 80000);
    run_us(2000);
    device_at_home();
    run_us(12000); /* within the frame: it has to be whole before ^C is heard */
    rig.limits.margin_q ^= 1;
    TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, (dr_us)(rig.clock_at_start + rig.now)));
    run_us(1000000);
    TEST_ASSERT_EQUAL(1, wire_stops());
    TEST_ASSERT_EQUAL_HEX8(0x03, rig.wire[rig.wire_count - 1]);
}

static void each_kind_of_calibration_takes_a_minute_and_loses_the_frame_when_it_is_cut_off(void)
{
    static const struct {
        uint8_t kind, code;
        uint16_t firmware;
    } kinds[] = {{DR_TRIO, 'R', DR_FIRMWARE_TRIO}, {DR_MPC, 'N', DR_FIRMWARE_MPC}, {DR_MPC, 'N', 0x0103}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++) {
        if (kinds[i].kind == DR_TRIO)
            bench_trio();
        else
            bench_mpc();
        rig.limits.firmware = rig.controller.firmware = kinds[i].firmware;
        rig.limits.rig |= DR_RIG_MAY_CALIBRATE;
        bench_start();
        bench_arm();
        rig.watch_tip = false; /* it goes beyond 0 */
        input(DR_INPUT_MAY_CALIBRATE, true);
        host_code(kinds[i].code);
        run_us(20000);
        TEST_ASSERT_UINT32_WITHIN(20000, 60000000, rig.guard.at[DR_TIMER_TASK] - (dr_us)(rig.clock_at_start + rig.now));
        run_us(200000);
        TEST_ASSERT_TRUE(status().state == DR_GUARD_MOVING_S || status().state == DR_GUARD_MOVING_U);
        cables(true, false);
        TEST_ASSERT_TRUE(rig.guard.scene.frame_lost);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_stop_within_a_line_keeps_its_target_possible);
    RUN_TEST(a_stop_within_a_setting_breaks_no_motion_off);
    RUN_TEST(a_motion_that_cannot_be_stopped_and_is_late_is_looked_for);
    RUN_TEST(a_cable_pulled_in_a_stop_ends_it);
    RUN_TEST(the_end_of_another_drives_way_is_no_end);
    RUN_TEST(a_streamed_position_that_is_cut_off_swallows_no_cr);
    RUN_TEST(a_host_that_has_stopped_already_is_told_apart);
    RUN_TEST(an_old_reply_that_never_came_hides_no_cr);
    RUN_TEST(a_stop_refuses_only_what_was_waiting);
    RUN_TEST(a_stop_of_what_cannot_be_stopped_waits_for_its_own_end);
    RUN_TEST(each_stop_counts_its_own_crs);
    RUN_TEST(ctrl_c_is_sent_three_times_whatever_it_is_that_asks_for_it);
    RUN_TEST(a_fault_says_why_it_stops);
    RUN_TEST(a_fault_at_rest_breaks_nothing_off);
    RUN_TEST(limits_that_are_damaged_stop_what_is_under_way_and_nothing_else);
    RUN_TEST(each_kind_of_calibration_takes_a_minute_and_loses_the_frame_when_it_is_cut_off);
    return UNITY_END();
}
