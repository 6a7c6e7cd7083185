/* What the rows of the fault matrix leave out: rare orders of events, each as a scenario of its own. */
#include "bench.h"

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

static void link_is(bool host, bool device)
{
    dr_guard_link(&rig.guard, guard_clock(), host, device);
    run_us(1);
}

static void says_at(uint32_t x, uint32_t y, uint32_t z) { device_at(x, y, z, 30); }

/* The test as a TRIO that stands at 40000 on each axis, up to IDLE. */
static void by_hand_idle(void)
{
    bench_trio();
    bench_start_by_hand(device_at_home);
    bench_arm_by_hand(device_at_home);
}

/* On with a line to 44000: its CR is awaited. */
static void by_hand_moving(void)
{
    by_hand_idle();
    host_line(15, 44000, 40000, 40000);
    run_ms(3);
    says_at(40000, 40000, 40000);
    run_ms(6);
    expect_state(DR_GUARD_MOVING_S);
}

static void rest_is_proved_at(uint32_t x)
{
    run_ms(105);
    says_at(x, 40000, 40000);
    run_ms(105);
    says_at(x, 40000, 40000);
}

/* -- Stops ------------------------------------------------------------------------------------------------------------ */

static void a_stop_during_a_hosts_query(void)
{
    by_hand_idle();
    host_code('c');
    run_ms(1);
    device_says("abcde", 5);
    stop_input(true);
    device_says("\r\r\r\r\r\r\r\r\r\r", 10); /* 9 of the query's reply, and the one of ^C */
    rest_is_proved_at(40000);
    expect_state(DR_GUARD_STOPPED);
    expect_heard("abcde", 5);
    expect_silence();
}

static void a_controller_that_answers_ctrl_c_and_moves_on(void)
{
    by_hand_moving();
    host_code(3);
    run_ms(1);
    device_says("\r", 1);
    for (uint32_t i = 0; i < 4; i++) {
        run_ms(105);
        says_at(41000 + 10 * i, 40000, 40000);
    }
    TEST_ASSERT_EQUAL(3, wire_stops()); /* asked again while the readings differ */
    run_ms(105);
    says_at(41030, 40000, 40000);
    expect_state(DR_GUARD_IDLE);
    expect_cr();
    expect_silence();
}

static void a_stop_with_the_end_already_reached_leaves_no_old_target(void)
{
    by_hand_moving();
    device_says("\r", 1);
    input(DR_INPUT_KEY, false); /* while the end is being verified */
    expect_state(DR_GUARD_STOPPING);
    device_says("\r", 1);
    rest_is_proved_at(44000);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
    expect_silence();
}

static void the_key_off_before_the_frame_has_left(void)
{
    by_hand_idle();
    host_line(15, 44000, 40000, 40000);
    run_ms(3);
    says_at(40000, 40000, 40000);
    run_ms(1); /* in the gap before the frame */
    expect_state(DR_GUARD_CHECKING);
    input(DR_INPUT_KEY, false);
    device_says("\r", 1);
    rest_is_proved_at(40000);
    expect_state(DR_GUARD_DISARMED);
    expect_refused(DR_REASON_CANCELLED);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
    for (uint32_t i = 0; i < rig.wire_count; i++)
        TEST_ASSERT_NOT_EQUAL('S', rig.wire[i]);
}

static void a_stop_that_a_silent_controller_answers_at_rest(void)
{
    by_hand_idle();
    stop_input(true);
    run_ms(4000);
    expect_fault(DR_FAULT_DEVICE_SILENT);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
}

static void a_calibration_stopped_on_a_controller_that_falls_silent(void)
{
    for (int how = 0; how < 2; how++) {
        bench_mpc();
        rig.limits.rig |= DR_RIG_MAY_CALIBRATE;
        bench_start();
        bench_arm();
        rig.watch_tip = false;
        input(DR_INPUT_MAY_CALIBRATE, true);
        host_code('N');
        run_ms(100);
        expect_state(DR_GUARD_MOVING_S);
        rig.by_hand = true;
        if (how == 0) {
            host_code(3);
            run_ms(4000);
            expect_fault(DR_FAULT_DEVICE_SILENT);
        } else {
            link_is(true, false);
            expect_state(DR_GUARD_LOCKED);
        }
        TEST_ASSERT_TRUE(rig.guard.scene.frame_lost);
        TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    }
}

static void a_motion_that_cannot_be_stopped_and_never_ends(void)
{
    by_hand_idle();
    host_axis('x', 44000);
    run_ms(3);
    says_at(40000, 40000, 40000);
    run_ms(10);
    expect_state(DR_GUARD_MOVING_U);
    run_ms(2200);
    expect_state(DR_GUARD_STOPPING); /* the deadline: ^C, then a query */
    run_ms(420);
    says_at(44000, 40000, 40000);
    run_ms(105);
    says_at(44000, 40000, 40000);
    expect_fault(DR_FAULT_NO_CR);

    by_hand_idle();
    host_axis('x', 44000);
    run_ms(3);
    says_at(40000, 40000, 40000);
    run_ms(10);
    stop_input(true);
    run_ms(2200); /* its CR never comes: a query tells */
    says_at(42000, 40000, 40000);
    run_ms(105);
    says_at(42000, 40000, 40000);
    expect_fault(DR_FAULT_UNSTOPPABLE);
    TEST_ASSERT_FALSE(status().buzzer);
}

static void noise_in_a_motion_that_cannot_be_stopped(void)
{
    by_hand_idle();
    host_axis('x', 44000);
    run_ms(3);
    says_at(40000, 40000, 40000);
    run_ms(10);
    device_says("?????????????????", 17);
    expect_state(DR_GUARD_STOPPING);
    device_says("?", 1);
    device_says("\r", 1);
    rest_is_proved_at(44000);
    expect_fault(DR_FAULT_DEVICE_NOISE);
    TEST_ASSERT_EQUAL(1, wire_stops());
}

static void more_ctrl_c_than_anybody_sends(void)
{
    by_hand_moving();
    for (int i = 0; i < 40; i++)
        host_code(3);
    TEST_ASSERT_LESS_OR_EQUAL(16, rig.guard.stop_owed);
    run_ms(4000);                 /* the proof of rest has failed */
    for (int i = 0; i < 300; i++) /* nothing of it is pulled */
        dr_guard_push_host(&rig.guard, guard_clock(), (const uint8_t *)"\3", 1);
    TEST_ASSERT_LESS_OR_EQUAL(15, rig.guard.stops_out);

    by_hand_moving();
    host_code(3);
    for (int i = 0; i < 300; i++)
        device_says("\r", 1);
    rest_is_proved_at(42000);
    expect_cr();
    expect_silence();

    by_hand_moving();
    host_code(3);
    run_ms(100);
    for (int i = 0; i < 20; i++) {
        run_ms(100);
        says_at(41000 + 10 * (uint32_t)i, 40000, 40000); /* it does not come to rest */
    }
    expect_fault(DR_FAULT_UNSTOPPABLE);
    for (int i = 0; i < 300; i++)
        dr_guard_push_host(&rig.guard, guard_clock(), (const uint8_t *)"\3", 1); /* now they pass again */
    TEST_ASSERT_EQUAL(255, rig.guard.stop_owed);

    by_hand_idle();
    for (int i = 0; i < 300; i++)
        dr_guard_push_host(&rig.guard, guard_clock(), (const uint8_t *)"\3", 1);
    TEST_ASSERT_EQUAL(255, rig.guard.reply_want);
    run_ms(3000);
    expect_state(DR_GUARD_IDLE);
}

static void a_stop_while_identity_is_being_proved(void)
{
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_ms(500);
    stop_input(true);
    device_says("\r", 1);
    rest_is_proved_at(40000);
    expect_state(DR_GUARD_LOCKED);
    run_ms(1001); /* the proof begins again */
    says_at(40000, 40000, 40000);
    expect_state(DR_GUARD_STOPPED);
    bench_trio();
    bench_start();
    link_is(true, false);
    stop_input(true);
    expect_state(DR_GUARD_LOCKED);
    input(DR_INPUT_STOP_2, false);
    run_ms(60);
    expect_state(DR_GUARD_LOCKED);
    expect_fault(DR_FAULT_STOP_WIRING);
}

static void a_stop_at_another_firmware_begins_no_proof(void)
{
    bench_mpc();
    bench_start();
    rig.controller.firmware = 0x0320;
    host_code('K');
    run_ms(10);
    stop_input(true);
    run_ms(3000);
    expect_state(DR_GUARD_LOCKED);
    expect_fault(DR_FAULT_IDENTITY);
}

static void two_targets_that_were_broken_off_are_both_kept(void)
{
    by_hand_moving(); /* to 44000 */
    host_code(3);
    device_says("\r", 1);
    rest_is_proved_at(42000);
    host_line(15, 41000, 47000, 40000);
    run_ms(3);
    says_at(42000, 40000, 40000);
    run_ms(6);
    host_code(3);
    device_says("\r", 1);
    rest_is_proved_at(41900);
    const dr_box *old = &rig.guard.scene.old[0].target_q;
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    TEST_ASSERT_EQUAL(41000 * 8, old->min_q[DR_X]);
    TEST_ASSERT_EQUAL(44000 * 8, old->max_q[DR_X]);
    TEST_ASSERT_EQUAL(40000 * 8, old->min_q[DR_Y]);
    TEST_ASSERT_EQUAL(47000 * 8, old->max_q[DR_Y]);
}

static void a_wrong_end_that_is_not_the_old_target(void)
{
    by_hand_moving();
    host_code(3);
    device_says("\r", 1);
    rest_is_proved_at(42000);
    host_line(15, 41000, 40000, 40000);
    run_ms(3);
    says_at(42000, 40000, 40000);
    run_ms(6);
    device_says("\r", 1);
    run_ms(3);
    says_at(41500, 40000, 40000);
    run_ms(105);
    says_at(41500, 40000, 40000);
    expect_fault(DR_FAULT_WRONG_END);
    TEST_ASSERT_EQUAL(1, wire_stops());
}

/* -- Readings and quiet ------------------------------------------------------------------------------------------------- */

static void a_byte_in_the_gap_before_the_guards_query_waits_longer(void)
{
    by_hand_idle();
    host_line(15, 44000, 40000, 40000);
    run_us(1500);
    device_says("?", 1);
    run_us(1500);
    TEST_ASSERT_NOT_EQUAL('c', rig.wire[rig.wire_count - 1] == 'c' && rig.wire_at[rig.wire_count - 1] + 1600 > rig.now
                                   ? 'c'
                                   : 0); /* 2 ms after that byte, not after the frame */
    run_us(700);
    TEST_ASSERT_EQUAL('c', rig.wire[rig.wire_count - 1]);
}

static void quiet_before_the_second_try_begins_anew_with_each_byte(void)
{
    by_hand_idle();
    host_line(15, 44000, 40000, 40000);
    run_ms(3);
    device_says("nonsense", 8);
    run_ms(101); /* too short: nonsense */
    const uint32_t wire = rig.wire_count;
    for (int i = 0; i < 5; i++) {
        run_ms(90);
        device_says("?", 1);
    }
    TEST_ASSERT_EQUAL(wire, rig.wire_count);
    run_ms(101);
    TEST_ASSERT_EQUAL(wire + 1, rig.wire_count);
    says_at(40000, 40000, 40000);
    run_ms(6);
    expect_state(DR_GUARD_MOVING_S);
}

static void bytes_that_come_before_the_query_has_left_are_no_answer(void)
{
    by_hand_idle();
    dr_guard_push_host(&rig.guard, guard_clock(), (const uint8_t *)"c", 1); /* not pulled */
    dr_guard_push_device(&rig.guard, guard_clock(), (const uint8_t *)"?", 1);
    TEST_ASSERT_EQUAL(1, status().quarantined_bytes);
    run_ms(1);
    says_at(40000, 40000, 40000);
    TEST_ASSERT_EQUAL(14, rig.heard_count - rig.heard_taken);

    uint8_t frame[14];
    put_line_frame(frame, 15, 44000, 40000, 40000);
    dr_guard_push_host(&rig.guard, guard_clock(), frame, 14);
    rig.now += 3000;
    dr_guard_push_device(&rig.guard, guard_clock(), (const uint8_t *)"?", 1); /* the guard's own query, not pulled */
    TEST_ASSERT_EQUAL(2, status().quarantined_bytes);
}

static void a_byte_in_the_pause_within_s_is_put_aside(void)
{
    bench_mpc();
    bench_start();
    bench_arm();
    host_line(15, 84000, 80000, 80000);
    run_ms(20);
    TEST_ASSERT_EQUAL(2, rig.guard.out_at);
    device_says("?", 1);
    run_ms(500);
    expect_cr();
    expect_tip(0, 84000, 80000, 80000);
}

static void noise_in_the_pause_within_s_stops_what_it_begins(void)
{
    bench_armed_mpc();
    host_line(15, 84000, 80000, 80000);
    run_ms(20);
    device_says("?????????????????", 17);
    run_ms(600);
    expect_fault(DR_FAULT_DEVICE_NOISE);
    TEST_ASSERT_EQUAL(DR_STATE_REST, rig.controller.state);
    TEST_ASSERT_UINT32_WITHIN(8, 80000, rig.drives[0].position_steps[0]);
    expect_silence();
}

static void a_frame_that_nobody_pulls_on_is_never_overwritten(void)
{
    uint8_t byte;
    bench_mpc();
    bench_start();
    rig.to_device_busy = true; /* the line hangs */
    rig.to_device_at = UINT64_MAX;
    host_value('I', 2);
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1));
    TEST_ASSERT_EQUAL('I', byte);
    rig.now += 5000000;
    TEST_ASSERT_EQUAL(0, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 0));
    host_code('C');
    expect_refused(DR_REASON_BUSY);
    stop_input(true);
    rig.now += 500000;
    TEST_ASSERT_EQUAL(0, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 0));
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1));
    TEST_ASSERT_EQUAL(2, byte); /* the frame first, whole */
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1));
    TEST_ASSERT_EQUAL(3, byte);
}

static void a_flood_from_the_controller_while_locked_is_counted_only(void)
{
    bench_trio();
    rig.by_hand = true;
    bench_start();
    for (int i = 0; i < 300; i++)
        device_says("?", 1);
    run_ms(1000);
    TEST_ASSERT_EQUAL(300, status().quarantined_bytes);
    TEST_ASSERT_EQUAL(255, last_record(DR_EVENT_QUARANTINED)->count);
}

static void noise_after_the_fault_changes_nothing(void)
{
    by_hand_idle();
    for (int i = 0; i < 40; i++)
        device_says("?", 1);
    expect_fault(DR_FAULT_DEVICE_NOISE);
    TEST_ASSERT_EQUAL(40, status().quarantined_bytes);
}

static void a_fault_takes_back_what_has_not_begun_to_leave_and_lets_queries_pass(void)
{
    by_hand_idle();
    line_hangs();
    host_value('A', 45); /* waits for the line */
    device_says("?????????????????", 17);
    expect_fault(DR_FAULT_DEVICE_NOISE);
    const uint32_t before = rig.wire_count;
    line_goes_on();
    run_ms(10);
    TEST_ASSERT_EQUAL(before, rig.wire_count); /* settings do not pass in FAULT */
    line_hangs();
    host_code('c');
    device_says("?", 1); /* more noise in the same second is no second fault, and takes nothing back */
    line_goes_on();
    run_us(500);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
    says_at(40000, 40000, 40000);
    TEST_ASSERT_EQUAL(14, rig.heard_count - rig.heard_taken);
}

/* -- Identity -------------------------------------------------------------------------------------------------------------- */

static void a_trio_at_0_degrees_is_told_by_its_axes(void)
{
    static const uint32_t axes[][3] = {{40005, 0, 0}, {0x9C01, 0x9C40, 0}, {0x9C02, 0x9C00, 0x9C40}};
    for (size_t i = 0; i < 3; i++) { /* not a drive; X, or Y, of an MPC-200 beyond any travel */
        bench_trio();
        rig.by_hand = true;
        bench_start();
        run_ms(1001);
        device_at(axes[i][0], axes[i][1], axes[i][2], 0);
        expect_state(DR_GUARD_DISARMED);
    }
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_ms(1001);
    device_at(0x9C03, 0x9C00, 0x9C00, 30); /* all fits but the angle */
    expect_state(DR_GUARD_DISARMED);
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_ms(1001);
    device_at(0x9C03, 0x9C00, 0x9C00, 0);
    expect_state(DR_GUARD_LOCKED);
    clear_fault(); /* is no confirmation */
    expect_state(DR_GUARD_LOCKED);
    stop_input(true);
    stop_input(false);
    device_says("\r", 1);
    run_ms(105);
    device_at(0x9C03, 0x9C00, 0x9C00, 0);
    run_ms(105);
    device_at(0x9C03, 0x9C00, 0x9C00, 0);
    run_ms(1001);
    device_at(0x9C03, 0x9C00, 0x9C00, 0);
    stop_input(true);
    press(DR_INPUT_CONFIRM);
    TEST_ASSERT_TRUE(status().state == DR_GUARD_STOPPED || status().state == DR_GUARD_STOPPING);
}

static void a_drive_that_may_not_be_moved_can_be_active(void)
{
    bench_mpc();
    rig.limits.drives[0].stage = DR_STAGE_NONE;
    bench_start();
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_INSIDE) != 0);
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_DISARMED);
    input(DR_INPUT_ESCAPE, true);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_IDLE);
    host_point('M', 81000, 80000, 80000);
    run_ms(50);
    expect_refused(DR_REASON_DRIVE);
    host_value('I', 2);
    run_ms(10);
    host_point('M', 81000, 80000, 80000);
    run_ms(200);
    expect_tip(1, 81000, 80000, 80000);
}

/* Nobody knows the stage of a drive that may not be moved: it may be as far out as the longest of the others, and 500 um. */
static void where_a_drive_that_may_not_be_moved_can_be(void)
{
    for (uint8_t longest = 0; longest < 2; longest++)
        for (uint32_t beyond = 0; beyond < 2; beyond++) {
            bench_mpc();
            TEST_ASSERT_TRUE(
                dr_limits_init_drive(&rig.limits, (uint8_t)(1u - longest), DR_STAGE_MPC_MT800)); /* 22 mm */
            rig.by_hand = true;
            bench_start();
            run_ms(1001);
            const uint32_t x = 25500 * 16 + beyond;
            const uint8_t reply[14] = {3, (uint8_t)x, (uint8_t)(x >> 8), (uint8_t)(x >> 16), 0, 1, 0, 0, 0, 1, 0, 0,
                                       0, 0x0D};
            device_says(reply, 14);
            expect_state(beyond == 0 ? DR_GUARD_DISARMED : DR_GUARD_LOCKED);
        }
}

static void what_a_reply_to_i_and_k_must_be(void)
{
    bench_armed_mpc();
    rig.by_hand = true;
    host_value('I', 2);
    run_ms(1);
    device_says("E\r", 2);
    TEST_ASSERT_EQUAL(0, rig.guard.scene.chosen);
    host_value('I', 2);
    run_ms(1);
    device_says("\1\r", 2);
    TEST_ASSERT_EQUAL(0, rig.guard.scene.chosen);
    host_value('I', 2);
    run_ms(1);
    device_says("\2?", 2);
    TEST_ASSERT_EQUAL(0, rig.guard.scene.chosen);
    host_value('I', 2);
    run_ms(1);
    device_says("\2\r", 2);
    TEST_ASSERT_EQUAL(1, rig.guard.scene.chosen);
    host_code('K');
    run_ms(1);
    device_says("\x07\x21\x03\r", 4); /* no such drive: not believed, and no reason to lock */
    expect_state(DR_GUARD_IDLE);
}

static void old_firmware_has_shorter_replies(void)
{
    bench_mpc();
    rig.limits.firmware = rig.controller.firmware = 0x0103;
    bench_start();
    bench_arm();
    host_code('K');
    run_ms(10);
    expect_heard("\1\r", 2);
    host_value('I', 7);
    run_ms(70);
    expect_silence(); /* below 1.06 there is no 'E' */
    host_value('I', 2);
    run_ms(10);
    expect_cr();
    TEST_ASSERT_EQUAL(1, rig.guard.scene.chosen);
    host_code('N'); /* centre, to 1.03: as a calibration */
    run_ms(50);
    expect_refused(DR_REASON_CALIBRATE);
}

static void the_centre_of_old_firmware_with_leave(void)
{
    bench_mpc();
    rig.limits.firmware = rig.controller.firmware = 0x0103;
    rig.limits.rig |= DR_RIG_MAY_CALIBRATE;
    bench_start();
    bench_arm();
    input(DR_INPUT_MAY_CALIBRATE, true);
    host_code('N');
    run_ms(4000);
    expect_cr();
    expect_tip(0, 200000, 200000, 200000);
}

static void a_streaming_move_that_is_stopped(void)
{
    bench_mpc();
    rig.limits.rig |= DR_RIG_MAY_STREAM;
    bench_start();
    bench_arm();
    host_code('O');
    run_ms(10);
    expect_cr();
    host_line(15, 88000, 80000, 80000);
    run_ms(100);
    host_code(3);
    run_ms(600);
    expect_state(DR_GUARD_IDLE);
    const uint32_t heard = rig.heard_count - rig.heard_taken;
    TEST_ASSERT_EQUAL(1, heard % 12); /* whole frames, and one CR */
    TEST_ASSERT_EQUAL('\r', rig.heard[rig.heard_count - 1]);
}

/* -- The rest ----------------------------------------------------------------------------------------------------------------- */

static void y_locked_out_of_homing_ends_at_two_places(void)
{
    bench_trio();
    rig.limits.rig |= DR_RIG_Y_LOCKED_OUT;
    bench_start();
    bench_arm();
    rig.by_hand = true;
    rig.wire_taken = rig.wire_count;
    host_point('H', 40800, 40800, 40000);
    run_ms(3);
    says_at(40000, 40000, 40000);
    run_ms(6);
    device_says("\r", 1);
    run_ms(3);
    says_at(40800, 40000, 40000); /* Y stayed */
    expect_cr();
    host_point('H', 40000, 40800, 40000);
    run_ms(3);
    says_at(40800, 40000, 40000);
    run_ms(6);
    device_says("\r", 1);
    run_ms(3);
    says_at(40500, 40000, 40000); /* X is not there */
    run_ms(105);
    says_at(40500, 40000, 40000);
    expect_fault(DR_FAULT_WRONG_END);

    bench_armed_trio(); /* not locked out */
    rig.by_hand = true;
    host_point('H', 40800, 40800, 40000);
    run_ms(3);
    says_at(40000, 40000, 40000);
    run_ms(6);
    device_says("\r", 1);
    run_ms(3);
    says_at(40800, 40000, 40000);
    run_ms(105);
    says_at(40800, 40000, 40000);
    expect_fault(DR_FAULT_WRONG_END);
}

static void a_small_move_that_ends_elsewhere(void)
{
    bench_mpc();
    rig.controller.quirks = DR_QUIRK_SMALL_MOVE_SILENT;
    bench_start();
    bench_arm();
    host_point('M', 80010, 80000, 80000);
    run_ms(20);
    place_tip(0, 80100, 80000, 80000);
    run_ms(400);
    expect_fault(DR_FAULT_WRONG_END);
}

static void a_frame_that_begins_while_something_is_under_way_is_dropped_whole(void)
{
    uint8_t frame[14];
    bench_armed_trio();
    put_line_frame(frame, 15, 40800, 40000, 40000);
    host_code('c');
    host_bytes(frame, 7);
    run_ms(20); /* the query has been answered meanwhile */
    host_bytes(frame + 7, 7);
    run_ms(200);
    expect_refused(DR_REASON_BUSY);
    expect_tip(0, 40000, 40000, 40000);
}

static void keys_and_links_that_change_nothing(void)
{
    bench_trio();
    bench_start();
    dr_guard_link(&rig.guard, guard_clock(), true, true);
    expect_state(DR_GUARD_DISARMED);
    link_is(false, true);
    link_is(true, false);
    input(DR_INPUT_KEY, true); /* nobody there */
    expect_state(DR_GUARD_LOCKED);
    run_ms(3000);
    expect_fault(DR_FAULT_NO_DEVICE);
    link_is(true, true);
    clear_fault(); /* the proof is already under way */
    run_ms(1100);
    expect_state(DR_GUARD_DISARMED);
    input(DR_INPUT_LOG_FAILED, true);
    input(DR_INPUT_LOG_FAILED, false);
    TEST_ASSERT_EQUAL(0, status().needs);
    stop_input(true);
    clear_fault(); /* while it is stopping */
    run_ms(600);
    expect_state(DR_GUARD_STOPPED);
}

static void a_caller_who_comes_late_is_due_again_at_once(void)
{
    dr_us when;
    uint8_t byte;
    bench_trio();
    rig.by_hand = true;
    rig.to_device_busy = true; /* nobody pulls */
    rig.to_device_at = UINT64_MAX;
    bench_start();
    rig.now += 1500000000; /* 25 minutes of a proof that gets no answer: more events than one call settles */
    TEST_ASSERT_EQUAL(0, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 0));
    TEST_ASSERT_TRUE(dr_guard_due(&rig.guard, &when));
    TEST_ASSERT_TRUE(dr_us_before(when, guard_clock()));
    for (int i = 0; i < 10; i++)
        (void)dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 0);
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
    expect_fault(DR_FAULT_DEVICE_SILENT);
}

static void after_a_reset_ctrl_c_waits_for_the_controller(void)
{
    bench_trio();
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
    dr_guard_start(&rig.guard, guard_clock(), DR_START_AFTER_RESET);
    dr_controller_start(&rig.controller, guard_clock());
    link_is(true, false);
    TEST_ASSERT_EQUAL(0, rig.wire_count);
    link_is(true, true);
    run_ms(1);
    TEST_ASSERT_EQUAL(1, wire_stops());
    link_is(true, false);
    link_is(true, true);
    run_ms(1200);
    TEST_ASSERT_EQUAL(1, wire_stops());
    expect_state(DR_GUARD_DISARMED);
}

static void the_controller_unplugged_at_every_stage_of_a_motion(void)
{
    static const unsigned after_ms[] = {1, 4, 20, 100,
                                        100}; /* checking; allowed; in the pause within 'S'; moving; stopping */
    for (int stage = 0; stage < 5; stage++) {
        bench_armed_mpc();
        host_line(15, 84000, 80000, 80000);
        run_ms(after_ms[stage]);
        if (stage == 4) {
            host_code(3);
            run_ms(10);
        }
        link_is(true, false);
        expect_state(DR_GUARD_LOCKED);
        TEST_ASSERT_EQUAL(stage > 1, rig.guard.scene.old[0].is_open);
    }
    by_hand_moving();
    device_says("\r", 1);
    link_is(true, false);
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    by_hand_idle();
    stop_input(true);
    link_is(true, false);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
    bench_armed_trio(); /* a host that is lost, and nothing to finish */
    rig.limits.host_loss = DR_HOST_LOSS_FINISH;
    input(DR_INPUT_KEY, false);
    link_is(false, true);
    expect_state(DR_GUARD_DISARMED);
}

static void a_cut_needs_its_confirmation_after_the_fault_is_cleared(void)
{
    by_hand_moving();
    rig.limits.rig |= DR_RIG_HAS_CUT | DR_RIG_CALIBRATES_AT_POWER_ON;
    limits_changed();
    keep_out(20000, 20001, 20000, 20001, 20000, 20001);
    limits_changed();
    host_code(3);
    run_ms(1200);
    expect_fault(DR_FAULT_UNSTOPPABLE);
    TEST_ASSERT_TRUE(status().cut);
    press(DR_INPUT_CONFIRM); /* too early */
    TEST_ASSERT_TRUE(status().cut);
    TEST_ASSERT_FALSE(status().confirm_wanted);
    run_ms(4000);
    clear_fault();
    TEST_ASSERT_TRUE(status().confirm_wanted);
    press(DR_INPUT_CONFIRM);
    TEST_ASSERT_FALSE(status().cut);
    TEST_ASSERT_FALSE(status().confirm_wanted);
}

static void a_wiring_alarm_outlives_the_key(void)
{
    bench_armed_trio();
    input(DR_INPUT_STOP, true);
    run_ms(600);
    rig.guard.stop_latched = false;
    rig.guard.sealed = false;
    clear_fault();
    expect_state(DR_GUARD_FAULT);
}

static void codes_beside_the_axes(void)
{
    dr_command command;
    bench_trio();
    TEST_ASSERT_TRUE(dr_command_find(DR_TRIO, DR_FIRMWARE_TRIO, 'x', &command));
    command.code = 'A'; /* no controller has it so: an axis below 'X' is not ambiguous */
    const dr_request request = {command.op, 0, {40000, 0, 0}};
    TEST_ASSERT_EQUAL(DR_REASON_NONE, dr_judge_frame(&rig.limits, &command, &request).reason);
}

/* A move that was too short for the controller to notice has not taken the place of the one that ^C broke off. */
static void an_ignored_move_forgets_no_old_target(void)
{
    bench_mpc();
    rig.controller.quirks = DR_QUIRK_SMALL_MOVE_SILENT;
    bench_start();
    bench_arm();
    host_line(4, 96000, 80000, 80000);
    run_ms(200);
    host_code(3);
    run_ms(600);
    expect_cr();
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    uint32_t at[DR_AXES];
    dr_controller_position(&rig.controller, 0, guard_clock(), at);
    host_point('M', at[0] + 8, at[1], at[2]);
    run_ms(600);
    expect_state(DR_GUARD_IDLE);
    expect_silence();
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    host_point('M', at[0] + 80, at[1], at[2]);
    run_ms(600);
    expect_cr();
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
}

/* The drive of a motion is the one that the host chose, before ARM was pressed too. */
static void the_hosts_choice_of_a_drive_outlives_arming(void)
{
    bench_mpc();
    bench_start();
    host_value('I', 2);
    run_ms(10);
    expect_heard("\2\r", 2);
    rig.controller.active = 0; /* MANIPULATOR */
    bench_arm();
    host_point('M', 81000, 80000, 80000);
    run_ms(100);
    expect_refused(DR_REASON_DRIVE);
    expect_tip(0, 80000, 80000, 80000);

    cables(false, true); /* another host, which has chosen nothing: the drive that is active when ARM is pressed */
    cables(true, true);
    press(DR_INPUT_ARM);
    run_ms(150);
    host_point('M', 81000, 80000, 80000);
    run_ms(300);
    expect_cr();
    expect_tip(0, 81000, 80000, 80000);
}

/* The guard has given the last byte away, the converter has not: as much of the frame may be lost with the cable. */
static void a_cable_pulled_right_behind_a_frame_may_have_torn_it(void)
{
    for (unsigned ms = 0; ms < 120; ms++) {
        bench_armed_trio();
        host_line(0, 41600, 40000, 40000);
        while (rig.motions == 0)
            run_us(100);
        run_ms(ms);
        cables(true, false);
        if (ms <= 99)
            expect_fault(DR_FAULT_TORN);
        if (ms >= 101)
            expect_fault(DR_FAULT_NO_DEVICE);
        expect_state(DR_GUARD_LOCKED);
    }
    bench_armed_trio(); /* what is one byte long cannot be torn */
    host_code('c');
    run_us(300);
    cables(true, false);
    expect_fault(DR_FAULT_NO_DEVICE);
}

static void damaged_limits_are_not_armed(void)
{
    bench_trio();
    bench_start();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    rig.limits.margin_q++;
    run_ms(150);
    expect_state(DR_GUARD_LOCKED);
    expect_fault(DR_FAULT_DAMAGED);
}

/* Where it was asked for: who closes the port at rest finds the guard armed when it comes back, for arm_idle_s at most. */
static void a_rig_may_stay_armed_between_two_hosts(void)
{
    bench_trio();
    rig.limits.rig |= DR_RIG_STAYS_ARMED;
    rig.limits.arm_idle_s = 10;
    bench_start();
    bench_arm();
    host_line(15, 40800, 40000, 40000);
    run_ms(200);
    expect_cr();
    cables(false, true);
    expect_state(DR_GUARD_IDLE);
    run_ms(5000);
    cables(true, true);
    host_line(15, 40000, 40000, 40000);
    run_ms(200);
    expect_cr();
    cables(false, true);
    run_ms(10100);
    expect_state(DR_GUARD_DISARMED);

    press(DR_INPUT_ARM); /* a host that is lost in mid-move is another matter */
    run_ms(150);
    cables(true, true);
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    cables(false, true);
    expect_state(DR_GUARD_STOPPING);
    run_ms(600);
    expect_state(DR_GUARD_DISARMED);
    press(DR_INPUT_ARM);
    run_ms(150);
    cables(true, true);
    host_axis('x', 41600);
    run_ms(20);
    expect_state(DR_GUARD_MOVING_U);
    cables(false, true);
    run_ms(600);
    expect_state(DR_GUARD_DISARMED);
}

/* Whichever side is asked: what is due has happened. */
static void who_asks_for_the_hosts_bytes_settles_what_is_due(void)
{
    uint8_t byte;
    bench_trio();
    rig.limits.arm_idle_s = 1;
    bench_start();
    bench_arm();
    rig.now += 2000000;
    TEST_ASSERT_EQUAL(0, dr_guard_pull_host(&rig.guard, guard_clock(), &byte, 1));
    expect_state(DR_GUARD_DISARMED);
}

/* -- What a model checker found ------------------------------------------------------------------------------------------- */

static dr_us clock_after_us(uint32_t us)
{
    rig.now += us;
    return guard_clock();
}

/* A setting that is half out when noise ends its task: what the host sends next must not take its place in out[]. */
static void half_a_setting_is_not_overwritten(void)
{
    uint8_t byte, query = 'C';
    bench_armed_trio();
    rig.framer.have = rig.framer.want = 0;
    const uint8_t angle[] = {'A', 30}, noise[20] = {'?'};
    dr_guard_push_host(&rig.guard, guard_clock(), angle, 2);
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1));
    TEST_ASSERT_EQUAL('A', byte);
    dr_guard_push_device(&rig.guard, clock_after_us(100), noise, sizeof noise);
    expect_fault(DR_FAULT_DEVICE_NOISE);
    dr_guard_push_host(&rig.guard, clock_after_us(100), &query, 1);
    expect_refused(DR_REASON_BUSY);
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, clock_after_us(100), &byte, 1));
    TEST_ASSERT_EQUAL(30, byte);
    TEST_ASSERT_EQUAL(0, dr_guard_pull_device(&rig.guard, clock_after_us(100), &byte, 1));
    dr_guard_push_host(&rig.guard, clock_after_us(100), &query, 1);
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, clock_after_us(100), &byte, 1));
    TEST_ASSERT_EQUAL('C', byte);
}

/* Damaged limits found in the pause within 'S': its rest and then the ^C must still leave. */
static void damage_in_the_pause_within_s_finishes_the_frame_and_stops(void)
{
    bench_armed_mpc();
    host_line(15, 81600, 80000, 80000);
    run_ms(15);
    TEST_ASSERT_TRUE(dr_guard_is_mid_frame(&rig.guard));
    rig.limits.margin_q++;
    TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, guard_clock()));
    const uint32_t stops = wire_stops();
    run_ms(100);
    TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
    TEST_ASSERT_EQUAL(stops + 1, wire_stops());
    TEST_ASSERT_EQUAL(DR_STATE_REST, rig.controller.state);
    host_code(3);
    run_ms(10);
    TEST_ASSERT_EQUAL(stops + 2, wire_stops());
}

/* A TRIO that calibrates when its power comes back, which was cut for a stop: everything is over but for the CONFIRM. */
static void cut_off(void)
{
    bench_trio();
    rig.limits.rig |= DR_RIG_HAS_CUT | DR_RIG_CALIBRATES_AT_POWER_ON;
    bench_start();
    bench_arm();
    host_axis('x', 41600);
    run_ms(20);
    stop_input(true);
    run_ms(2000);
    stop_input(false);
    run_ms(30);
    clear_fault();
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_TRUE(status().cut);
}

/* The power comes back while a setting of the host's waits to leave, or is half out: it is forgotten. */
static void power_that_comes_back_finds_nothing_on_its_way(void)
{
    for (unsigned half_out = 0; half_out < 2; half_out++) {
        uint8_t byte;
        const uint8_t angle[] = {'A', 30};
        cut_off();
        dr_guard_push_host(&rig.guard, guard_clock(), angle, 2);
        TEST_ASSERT_EQUAL(half_out, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, half_out));
        dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_CONFIRM, true);
        expect_state(DR_GUARD_LOCKED);
        TEST_ASSERT_EQUAL(0, dr_guard_pull_device(&rig.guard, clock_after_us(1000), &byte, 1));
        run_ms(1200);
        expect_state(DR_GUARD_DISARMED);
    }
}

/* An answer to ARM, before the controller is ready, proves nothing. */
static void power_that_comes_back_ends_an_arming(void)
{
    cut_off();
    press(DR_INPUT_ARM);
    run_ms(1);
    press(DR_INPUT_CONFIRM);
    const uint32_t before = rig.wire_count;
    run_ms(999);
    TEST_ASSERT_EQUAL(before, rig.wire_count);
    expect_state(DR_GUARD_LOCKED);
    run_ms(100);
    expect_state(DR_GUARD_DISARMED);
}

/* The cut was asked for before the cable was plugged in anew. The rest of the line has nobody left to wait for it. */
static void power_that_comes_back_finds_no_line_in_its_pause(void)
{
    bench_mpc();
    rig.limits.rig |= DR_RIG_HAS_CUT;
    rig.limits.host_loss = DR_HOST_LOSS_FINISH;
    bench_start();
    bench_arm();
    rig.guard.cut = true;
    rig.guard.sealed = 0;
    host_line(15, 84000, 80000, 80000);
    run_ms(12);
    TEST_ASSERT_EQUAL(2, rig.guard.out_at);
    cables(false, true);
    rig.framer.have = rig.framer.want = 0; /* M1: half a frame that somebody has switched off is none */
    press(DR_INPUT_CONFIRM);
    TEST_ASSERT_FALSE(status().cut);
    TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
    TEST_ASSERT_EQUAL(0, rig.guard.running >> DR_TIMER_SEND & 1);
    const uint32_t before = rig.wire_count;
    run_ms(999);
    TEST_ASSERT_EQUAL(before, rig.wire_count);
}

/* Only what has begun may finish without its host. */
static void a_motion_that_has_not_begun_does_not_begin_without_its_host(void)
{
    bench_trio();
    rig.limits.host_loss = DR_HOST_LOSS_FINISH;
    bench_start();
    bench_arm();
    host_line(15, 44000, 40000, 40000);
    while (rig.guard.out_count < 14)
        run_us(50);
    TEST_ASSERT_EQUAL(0, rig.guard.out_at);
    cables(false, true);
    run_ms(1000);
    TEST_ASSERT_EQUAL(0, rig.motions);
    expect_refused(DR_REASON_CANCELLED);
    expect_state(DR_GUARD_DISARMED);
    expect_tip(0, 40000, 40000, 40000);
}

/* A person confirms what has been read, not what is about to be. */
static void a_proof_under_way_is_not_confirmed(void)
{
    static const uint8_t zero[14] = {1, 0, 0, 0, 0, 0, 0,
                                     0, 0, 0, 0, 0, 0, 0x0D}; /* a TRIO at 0 degrees, or an MPC-200 */
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_ms(1001);
    device_says(zero, 14);
    TEST_ASSERT_TRUE(status().confirm_wanted);
    stop_input(true);
    run_ms(20);
    device_says("\r", 1);
    run_ms(101);
    device_says(zero, 14);
    run_ms(101);
    device_says(zero, 14); /* at rest: the proof begins anew */
    expect_state(DR_GUARD_LOCKED);
    stop_input(false);
    run_ms(30);
    press(DR_INPUT_CONFIRM);
    expect_state(DR_GUARD_LOCKED);
    input(DR_INPUT_STOP, true); /* one contact: a fault of the wiring in a while */
    run_ms(20);
    device_says("\r", 1);
    run_ms(100);
    expect_fault(DR_FAULT_STOP_WIRING);
    TEST_ASSERT_TRUE(status().state == DR_GUARD_LOCKED || status().state == DR_GUARD_STOPPING);
}

/* The answer to a host that has gone is not for the next one, whose first answer it would seem to be. */
static void what_comes_for_a_host_that_has_gone_is_not_kept(void)
{
    for (unsigned stays_armed = 0; stays_armed < 2; stays_armed++) {
        bench_trio();
        rig.limits.rig |= stays_armed == 1 ? DR_RIG_STAYS_ARMED : 0;
        bench_start();
        bench_arm();
        host_code('c');
        run_us(400);
        cables(false, true);
        rig.heard_taken = rig.heard_count; /* the first of 14 bytes has come in time */
        run_ms(10);
        cables(true, true);
        expect_silence();
        host_code('c');
        run_ms(10);
        TEST_ASSERT_EQUAL(14, rig.heard_count - rig.heard_taken);
    }
}

/* A motion that is read for twice, because the first answer was a byte too long, is one motion. */
static void a_motion_that_is_read_for_twice_costs_one_token(void)
{
    bench_armed_trio();
    rig.by_hand = true;
    rig.guard.tokens = 1;
    rig.guard.sealed = 0;
    host_line(15, 40800, 40000, 40000);
    run_ms(3);
    says_at(40000, 40000, 40000);
    device_says("\r", 1);
    run_ms(103);
    says_at(40000, 40000, 40000);
    TEST_ASSERT_EQUAL(2, rig.guard.tokens); /* the one is gone, and two came back in 100 ms */
    TEST_ASSERT_EQUAL(1, status().forwarded);
    TEST_ASSERT_EQUAL(1, last_record(DR_EVENT_ALLOWED)->code);
    run_ms(20);
    TEST_ASSERT_EQUAL(1, rig.motions);

    bench_armed_trio(); /* and none if nothing believable comes */
    rig.by_hand = true;
    host_line(15, 40800, 40000, 40000);
    run_ms(3);
    for (int times = 0; times < 2; times++) {
        says_at(40000, 40000, 40000);
        device_says("\r", 1);
        run_ms(103);
    }
    expect_fault(DR_FAULT_IMPLAUSIBLE);
    TEST_ASSERT_EQUAL(0, status().forwarded);
    TEST_ASSERT_EQUAL(0, rig.motions);
}

/* A program that is suspended between the reading and the motion: a knob may have gone anywhere. */
static void row_59_a_reading_that_is_too_old_is_taken_again(void)
{
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++)
        for (unsigned late_ms = 1; late_ms <= 21; late_ms += 5) {
            if (kind == DR_TRIO)
                bench_trio();
            else
                bench_mpc();
            rig.limits.rig = 0;
            bench_start();
            bench_arm();
            const uint32_t at = kind == DR_TRIO ? 40000 : 80000;
            host_line(15, at + 800, at, at);
            while (rig.guard.out_count < 14)
                run_us(50);
            const uint32_t queries = rig.wire_count;
            rig.now +=
                1000 * late_ms; /* to 7.5 ms after the query it may begin; to 12.5 ms with the pause within 'S' */
            run_ms(300);
            expect_cr();
            expect_tip(0, at + 800, at, at);
            const bool again = late_ms > (kind == DR_TRIO ? 4 : 11);
            TEST_ASSERT_EQUAL(again ? 'C' : 'S', rig.wire[queries] == 'c' ? 'C' : rig.wire[queries]);
            TEST_ASSERT_EQUAL(again, last_record(DR_EVENT_ALLOWED)->code);
            TEST_ASSERT_EQUAL(1, status().forwarded);
        }
    bench_trio(); /* always late */
    rig.limits.rig = 0;
    bench_start();
    bench_arm();
    host_line(15, 40800, 40000, 40000);
    for (int i = 0; i < 100 && status().refused == 0; i++) {
        for (int steps = 0; rig.guard.out_count < 14 && steps < 1000; steps++)
            run_us(50);
        rig.now += 20000;
        run_us(50);
    }
    expect_refused(DR_REASON_NO_POSITION);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_EQUAL(0, status().forwarded);
    TEST_ASSERT_EQUAL(0, rig.motions);
    run_ms(2000);
    TEST_ASSERT_TRUE(rig.guard.tokens <= 20);
}

/* The log is in the order of the line: what came before a reading is told before it, and nothing is told twice. */
static void what_is_put_aside_is_logged_before_what_follows(void)
{
    uint32_t quarantined = 0, readings = 0;
    bench_armed_trio();
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    rig.log_count = 0;
    host_code(3);
    run_ms(3000);
    for (uint32_t i = 0; i < rig.log_count; i++) {
        quarantined += rig.log[i].event == DR_EVENT_QUARANTINED;
        readings += rig.log[i].event == DR_EVENT_READING;
        if (rig.log[i].event == DR_EVENT_QUARANTINED) {
            TEST_ASSERT_EQUAL(0, readings);
            TEST_ASSERT_EQUAL(1, rig.log[i].count);
            TEST_ASSERT_EQUAL_HEX8(DR_CR, rig.log[i].bytes[0]);
        }
    }
    TEST_ASSERT_EQUAL(1, quarantined);
    TEST_ASSERT_EQUAL(2, readings);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(who_asks_for_the_hosts_bytes_settles_what_is_due);
    RUN_TEST(what_is_put_aside_is_logged_before_what_follows);
    RUN_TEST(a_proof_under_way_is_not_confirmed);
    RUN_TEST(what_comes_for_a_host_that_has_gone_is_not_kept);
    RUN_TEST(a_motion_that_is_read_for_twice_costs_one_token);
    RUN_TEST(half_a_setting_is_not_overwritten);
    RUN_TEST(damage_in_the_pause_within_s_finishes_the_frame_and_stops);
    RUN_TEST(power_that_comes_back_finds_nothing_on_its_way);
    RUN_TEST(a_motion_that_has_not_begun_does_not_begin_without_its_host);
    RUN_TEST(row_59_a_reading_that_is_too_old_is_taken_again);
    RUN_TEST(an_ignored_move_forgets_no_old_target);
    RUN_TEST(the_hosts_choice_of_a_drive_outlives_arming);
    RUN_TEST(a_cable_pulled_right_behind_a_frame_may_have_torn_it);
    RUN_TEST(damaged_limits_are_not_armed);
    RUN_TEST(a_rig_may_stay_armed_between_two_hosts);
    RUN_TEST(a_stop_during_a_hosts_query);
    RUN_TEST(a_controller_that_answers_ctrl_c_and_moves_on);
    RUN_TEST(a_stop_with_the_end_already_reached_leaves_no_old_target);
    RUN_TEST(the_key_off_before_the_frame_has_left);
    RUN_TEST(a_stop_that_a_silent_controller_answers_at_rest);
    RUN_TEST(a_calibration_stopped_on_a_controller_that_falls_silent);
    RUN_TEST(a_motion_that_cannot_be_stopped_and_never_ends);
    RUN_TEST(noise_in_a_motion_that_cannot_be_stopped);
    RUN_TEST(more_ctrl_c_than_anybody_sends);
    RUN_TEST(a_stop_while_identity_is_being_proved);
    RUN_TEST(a_stop_at_another_firmware_begins_no_proof);
    RUN_TEST(two_targets_that_were_broken_off_are_both_kept);
    RUN_TEST(a_wrong_end_that_is_not_the_old_target);
    RUN_TEST(a_byte_in_the_gap_before_the_guards_query_waits_longer);
    RUN_TEST(quiet_before_the_second_try_begins_anew_with_each_byte);
    RUN_TEST(bytes_that_come_before_the_query_has_left_are_no_answer);
    RUN_TEST(a_byte_in_the_pause_within_s_is_put_aside);
    RUN_TEST(noise_in_the_pause_within_s_stops_what_it_begins);
    RUN_TEST(a_frame_that_nobody_pulls_on_is_never_overwritten);
    RUN_TEST(a_flood_from_the_controller_while_locked_is_counted_only);
    RUN_TEST(noise_after_the_fault_changes_nothing);
    RUN_TEST(a_trio_at_0_degrees_is_told_by_its_axes);
    RUN_TEST(a_drive_that_may_not_be_moved_can_be_active);
    RUN_TEST(where_a_drive_that_may_not_be_moved_can_be);
    RUN_TEST(what_a_reply_to_i_and_k_must_be);
    RUN_TEST(old_firmware_has_shorter_replies);
    RUN_TEST(the_centre_of_old_firmware_with_leave);
    RUN_TEST(a_streaming_move_that_is_stopped);
    RUN_TEST(y_locked_out_of_homing_ends_at_two_places);
    RUN_TEST(a_small_move_that_ends_elsewhere);
    RUN_TEST(a_frame_that_begins_while_something_is_under_way_is_dropped_whole);
    RUN_TEST(keys_and_links_that_change_nothing);
    RUN_TEST(a_caller_who_comes_late_is_due_again_at_once);
    RUN_TEST(after_a_reset_ctrl_c_waits_for_the_controller);
    RUN_TEST(the_controller_unplugged_at_every_stage_of_a_motion);
    RUN_TEST(a_cut_needs_its_confirmation_after_the_fault_is_cleared);
    RUN_TEST(a_wiring_alarm_outlives_the_key);
    RUN_TEST(codes_beside_the_axes);
    RUN_TEST(a_fault_takes_back_what_has_not_begun_to_leave_and_lets_queries_pass);
    RUN_TEST(power_that_comes_back_ends_an_arming);
    RUN_TEST(power_that_comes_back_finds_no_line_in_its_pause);
    return UNITY_END();
}
