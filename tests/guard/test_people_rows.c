/* What people, cables and the guard's own machine may do: rows 58 to 78 of the fault matrix; row 64 is test_stop.c. */
#include "bench.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

static void link_is(bool host, bool device)
{
    dr_guard_link(&rig.guard, guard_clock(), host, device);
    run_us(1);
}

/* -- Knobs ------------------------------------------------------------------------------------------------------------ */

static void row_58_a_knob_turned_between_commands(void)
{
    bench_trio();
    rig.limits.rig = 0; /* knobs are not locked */
    keep_out(5200, 5600, 4000, 6000, 5400, 6000);
    bench_start();
    bench_arm();
    host_line(15, 46000, 40000, 40000); /* 750 um, below the obstacle */
    run_ms(400);
    expect_cr();
    run_ms(21000);
    place_tip(0, 46000, 40000, 46000); /* by knob: beside it now */
    host_line(15, 40000, 40000, 46000);
    run_ms(400);
    expect_refused(DR_REASON_KEEP_OUT);
    expect_silence();
    expect_tip(0, 46000, 40000, 46000);
}

static void row_59_a_knob_turned_between_the_query_and_the_motion(void)
{
    bench_trio();
    bench_start();
    bench_arm();
    host_line(15, 44000, 40000, 40000);
    run_until_state(DR_GUARD_CHECKING, 1);
    run_us(5500); /* the reading is in, the frame is not yet whole */
    place_tip(0, 40000, 40400, 40000);
    run_ms(400);
    expect_cr(); /* the target is the target; the margin covers the way */
    expect_tip(0, 44000, 40000, 40000);
    bench_armed_trio();
    host_axis('x', 44000);
    run_us(6500);
    place_tip(0, 40000, 40400, 40000); /* Y is not what the motion should have left it at */
    run_ms(400);
    expect_fault(DR_FAULT_WRONG_END);
    expect_silence();
}

/* What an answer tells was true when it was asked for, at the earliest. 200 um beside an obstacle, with a margin of 50 um and
 * a knob of 5 mm/s: 30 ms are enough to be in its way. */
static void row_59_an_answer_is_as_old_as_its_query(void)
{
    static const struct {
        unsigned after_ms;
        bool knobs_locked;
        char then; /* A: allowed, R: refused, C: asked again */
    } answers[] = {{1, false, 'A'},   {19, false, 'A'},   {23, false, 'R'}, {40, false, 'R'},
                   {104, false, 'C'}, {1500, false, 'C'}, {1500, true, 'A'}};
    for (size_t i = 0; i < sizeof answers / sizeof *answers; i++) {
        bench_trio();
        rig.limits.rig = answers[i].knobs_locked ? DR_RIG_KNOBS_LOCKED : 0;
        (void)keep_out(5300, 5400, 5200, 5600, 4000, 6000);
        bench_start();
        bench_arm();
        rig.by_hand = true;
        const uint32_t before = rig.wire_count;
        host_line(15, 44000, 40000, 40000);
        for (unsigned us = 0; us < 10000 && rig.wire_count == before; us += 50)
            run_us(50);
        run_ms(answers[i].after_ms);
        device_at_home();
        run_ms(10);
        switch (answers[i].then) {
        case 'A':
            TEST_ASSERT_EQUAL('S', rig.wire[before + 1]);
            break;
        case 'R':
            expect_refused(DR_REASON_KEEP_OUT);
            TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
            break;
        default:
            TEST_ASSERT_EQUAL(before + 2, rig.wire_count);
            TEST_ASSERT_EQUAL('c', rig.wire[before + 1]);
            expect_state(DR_GUARD_CHECKING);
            device_at_home();
            run_ms(10);
            TEST_ASSERT_EQUAL('S', rig.wire[before + 2]);
            break;
        }
    }
}

/* In the pause within an 'S' a suspended guard comes late. The frame cannot be taken back: it goes on where all that a knob
 * can have done by now leaves the way clear, else ^C follows at its heels. 350 um beside an obstacle. */
static void row_59_a_guard_that_is_late_in_the_pause_within_s(void)
{
    static const struct {
        unsigned late_ms;
        bool knobs_locked, obstacle, stops;
    } pauses[] = {{0, false, true, false},    {40, false, true, false},   {60, false, true, true},
                  {60, false, false, false},  {100, false, false, false}, {150, false, false, true},
                  {5000, false, false, true}, {5000, true, true, false}};
    for (size_t i = 0; i < sizeof pauses / sizeof *pauses; i++) {
        bench_mpc();
        rig.limits.rig = pauses[i].knobs_locked ? DR_RIG_KNOBS_LOCKED : 0;
        if (pauses[i].obstacle)
            (void)keep_out(5100, 5400, 5350, 5600, 4000, 6000);
        bench_start();
        bench_arm();
        const uint32_t before = rig.wire_count;
        host_line(15, 88000, 80000, 80000);
        for (unsigned us = 0; us < 20000 && rig.guard.out_at < 2; us += 50)
            run_us(50);
        TEST_ASSERT_EQUAL(2, rig.guard.out_at);
        rig.now += 1000 * pauses[i].late_ms;
        run_ms(4000);
        TEST_ASSERT_EQUAL('S', rig.wire[before + 1]);
        expect_state(DR_GUARD_IDLE);
        expect_fault(DR_FAULT_NONE);
        if (!pauses[i].stops) {
            expect_cr();
            expect_tip(0, 88000, 80000, 80000);
            continue;
        }
        TEST_ASSERT_EQUAL_HEX8(0x03, rig.wire[before + 1 + 14]);
        TEST_ASSERT_UINT32_WITHIN(1000, (uint32_t)rig.wire_at[before + 14], (uint32_t)rig.wire_at[before + 15]);
        TEST_ASSERT_EQUAL(DR_STOP_LATE, last_record(DR_EVENT_STOP)->code);
        TEST_ASSERT_LESS_THAN(80000 + 10 * 16, rig.controller.drives[0].position_steps[DR_X]); /* 10 um */
        expect_silence();
    }
}

static void row_60_another_drive_by_hand_during_the_move(void)
{
    bench_armed_mpc();
    host_point('M', 84000, 80000, 80000);
    run_ms(20);
    expect_state(DR_GUARD_MOVING_S);
    run_until_state(DR_GUARD_MOVING_S, 1);
    while (rig.controller.state == DR_STATE_MOVING)
        run_us(100);
    rig.controller.active = 1; /* MANIPULATOR pressed at the very end */
    run_ms(300);
    expect_fault(DR_FAULT_WRONG_END);
    expect_silence();
}

static void row_60_another_drive_by_hand_before_the_move(void)
{
    bench_armed_mpc();
    rig.controller.active = 1;
    host_point('M', 84000, 80000, 80000);
    run_ms(50);
    expect_refused(DR_REASON_DRIVE);
    expect_tip(0, 80000, 80000, 80000);
    expect_tip(1, 80000, 80000, 80000);
    host_value('I', 1);
    run_ms(10);
    expect_heard("\1\r", 2);
    host_point('M', 84000, 80000, 80000);
    run_ms(300);
    expect_tip(0, 84000, 80000, 80000);
}

static void row_63_a_changed_tip_disarms_until_it_is_confirmed(void)
{
    bench_armed_trio();
    press(DR_INPUT_TIP_CHANGED);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_TRUE(status().confirm_wanted);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_EQUAL(DR_NEEDS_TIP, status().needs);
    input(DR_INPUT_CONFIRM, true);
    TEST_ASSERT_EQUAL(0, status().needs);
    press(DR_INPUT_TIP_CHANGED);
    input(DR_INPUT_CONFIRM, false); /* letting go confirms nothing */
    TEST_ASSERT_EQUAL(DR_NEEDS_TIP, status().needs);
    press(DR_INPUT_CONFIRM);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_IDLE);
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    press(DR_INPUT_TIP_CHANGED); /* while it moves */
    run_ms(500);
    expect_state(DR_GUARD_DISARMED);
    expect_silence();
    TEST_ASSERT_EQUAL(DR_STATE_REST, rig.controller.state);
}

/* -- Stop --------------------------------------------------------------------------------------------------------------- */

static void row_65_arming_needs_a_fresh_edge_and_no_stop(void)
{
    bench_trio();
    input(DR_INPUT_ARM, true); /* held at power-up; the guard begins without inputs, the caller tells them */
    bench_start();
    input(DR_INPUT_ARM, true);
    input(DR_INPUT_KEY, true);
    run_ms(300);
    expect_state(DR_GUARD_DISARMED);
    input(DR_INPUT_ARM, false);
    stop_input(true);
    run_ms(400);
    input(DR_INPUT_ARM, true);
    run_ms(300);
    expect_state(DR_GUARD_STOPPED);
    input(DR_INPUT_ARM, false);
    stop_input(false);
    clear_fault(); /* still within the 20 ms of bouncing contacts */
    expect_state(DR_GUARD_STOPPED);
    run_ms(21);
    clear_fault();
    expect_state(DR_GUARD_DISARMED);
    for (int i = 0; i < 7; i++) { /* a bouncing key disarms, never arms */
        input(DR_INPUT_KEY, false);
        input(DR_INPUT_KEY, true);
    }
    run_ms(200);
    expect_state(DR_GUARD_DISARMED);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_IDLE);
}

static void row_65_a_stop_while_arming(void)
{
    bench_trio();
    bench_start();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_ms(50);
    stop_input(true);
    run_ms(600);
    expect_state(DR_GUARD_STOPPED);
}

static void row_65_the_key_off_while_arming(void)
{
    bench_trio();
    bench_start();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_ms(50);
    input(DR_INPUT_KEY, false);
    run_ms(600);
    expect_state(DR_GUARD_DISARMED);
}

static void row_66_contacts_that_disagree(void)
{
    for (int contact = 0; contact < 2; contact++) {
        const dr_input one = contact == 0 ? DR_INPUT_STOP : DR_INPUT_STOP_2;
        bench_armed_trio();
        input(one, true);
        expect_state(DR_GUARD_STOPPING); /* either stops at once */
        run_ms(49);
        expect_fault(DR_FAULT_NONE);
        run_ms(2);
        expect_fault(DR_FAULT_STOP_WIRING);
        run_ms(500);
        input(one, false);
        run_ms(100);
        expect_fault(DR_FAULT_STOP_WIRING);
        clear_fault();
        expect_state(DR_GUARD_DISARMED);
    }
}

static void a_bouncing_stop_contact_keeps_the_stop(void)
{
    bench_armed_trio();
    stop_input(true);
    run_ms(500);
    for (int i = 0; i < 10; i++) {
        stop_input(false);
        run_ms(15);
        stop_input(true);
        run_ms(15);
    }
    clear_fault();
    expect_state(DR_GUARD_STOPPED);
    TEST_ASSERT_EQUAL(1, wire_stops());
}

static void row_67_a_released_stop_moves_and_arms_nothing(void)
{
    bench_armed_mpc();
    host_line(0, 84000, 80000, 80000);
    run_ms(200);
    stop_input(true);
    run_ms(600);
    const uint32_t wire = rig.wire_count;
    stop_input(false);
    run_ms(5000);
    expect_state(DR_GUARD_STOPPED);
    TEST_ASSERT_EQUAL(wire, rig.wire_count);
    host_line(0, 84000, 80000, 80000);
    run_ms(100);
    expect_refused(DR_REASON_NOT_ARMED);
    TEST_ASSERT_EQUAL(wire, rig.wire_count);
    expect_silence();
}

static void row_68_nothing_that_the_host_sends_clears_a_fault(void)
{
    bench_armed_trio();
    for (int i = 0; i < 17; i++)
        device_says("?", 1);
    expect_state(DR_GUARD_FAULT);
    for (int byte = 0; byte < 256; byte++) {
        dr_command command;
        uint8_t frame[14] = {(uint8_t)byte, 20};
        const size_t length =
            dr_command_find(DR_TRIO, DR_FIRMWARE_TRIO, (uint8_t)byte, &command) ? 1u + command.args : 1u;
        host_bytes(frame, length);
        run_ms(60);
        expect_state(DR_GUARD_FAULT);
        expect_fault(DR_FAULT_DEVICE_NOISE);
    }
    for (uint32_t i = 0; i < rig.wire_count; i++)
        TEST_ASSERT_TRUE(rig.wire[i] == 'c' || rig.wire[i] == 'C' || rig.wire[i] == 3);
}

static void row_69_disarmed_after_900_s_without_a_motion(void)
{
    bench_armed_trio();
    run_ms(600000);
    host_line(15, 40800, 40000, 40000);
    run_ms(899900);
    expect_state(DR_GUARD_IDLE);
    expect_cr();
    run_ms(200);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_EQUAL(20, rig.guard.tokens);
    host_line(15, 41600, 40000, 40000);
    run_ms(100);
    expect_refused(DR_REASON_NOT_ARMED);
}

static void a_long_motion_is_not_idleness(void)
{
    bench_trio();
    rig.limits.arm_idle_s = 1;
    bench_start();
    bench_arm();
    host_line(0, 44000, 40000, 40000); /* 1.6 s */
    run_ms(2000);
    expect_cr();
    expect_state(DR_GUARD_IDLE);
    run_ms(1000);
    expect_state(DR_GUARD_DISARMED);
}

/* -- Arming -------------------------------------------------------------------------------------------------------------------- */

static void arming_outside_needs_escape(void)
{
    bench_trio();
    rig.watch_tip = false;
    rig.drives[0].position_steps[DR_X] = 0;
    bench_start();
    TEST_ASSERT_EQUAL(DR_NEEDS_KEY | DR_NEEDS_INSIDE, status().needs);
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_DISARMED);
    input(DR_INPUT_ESCAPE, true);
    TEST_ASSERT_TRUE(status().escape);
    TEST_ASSERT_EQUAL(0, status().needs);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_IDLE);
    host_axis('x', 8000);
    run_ms(50);
    expect_refused(DR_REASON_ESCAPE);
    host_line(15, 8000, 40000, 40000);
    run_ms(500);
    expect_cr();
    input(DR_INPUT_ESCAPE, false);
    host_line(15, 8100, 40000, 40000);
    run_ms(100);
    expect_cr();
}

static void a_tip_that_moves_while_arming_is_unsteady(void)
{
    bench_trio();
    bench_start();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_ms(50);
    place_tip(0, 40003, 40000, 40000);
    run_ms(100);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_EQUAL(DR_NEEDS_STEADY, status().needs);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_IDLE);
}

static void what_is_missing_is_told(void)
{
    bench_trio();
    rig.by_hand = true;
    bench_start();
    TEST_ASSERT_EQUAL(DR_NEEDS_KEY | DR_NEEDS_IDENTITY | DR_NEEDS_REST, status().needs);
    input(DR_INPUT_LOG_FAILED, true);
    stop_input(true);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_LOG) != 0);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_STOP_RELEASED) != 0);
    link_is(true, false);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_DEVICE) != 0);
}

static void in_tissue_and_calibration_are_levels_of_a_person(void)
{
    bench_trio();
    rig.limits.drives[0].retract = DR_TO_MORE_Z;
    rig.limits.drives[0].surface_q = UM(8000);
    rig.limits.drives[0].clearance_q = (uint32_t)UM(500);
    rig.limits.drives[0].approach[DR_Z] = 1;
    bench_start();
    bench_arm();
    input(DR_INPUT_IN_TISSUE, true);
    input(DR_INPUT_MAY_CALIBRATE, true);
    TEST_ASSERT_TRUE(status().in_tissue);
    TEST_ASSERT_TRUE(status().may_calibrate);
    host_line(15, 41000, 40000, 40000);
    run_ms(50);
    expect_refused(DR_REASON_APPROACH);
    TEST_ASSERT_EQUAL(DR_OP_TRIO_LINE, status().last_op);
    host_line(15, 40000, 40000, 41000);
    run_ms(200);
    expect_cr();
}

/* -- The bridge itself ------------------------------------------------------------------------------------------------------------- */

static void row_72_every_flipped_bit_of_the_limits_is_found_before_the_next_motion(void)
{
    const size_t size = offsetof(dr_limits, obstacles) + sizeof(dr_obstacle);
    uint32_t found = 0, harmless = 0;
    for (size_t bit = 0; bit < size * 8; bit++) {
        bench_trio();
        keep_out(9000, 9100, 9000, 9100, 9000, 9100);
        bench_start();
        bench_arm();
        const uint32_t crc = dr_limits_crc(&rig.limits);
        ((uint8_t *)&rig.limits)[bit / 8] ^= (uint8_t)(1u << bit % 8);
        if (dr_limits_crc(&rig.limits) == crc) { /* padding */
            harmless++;
            continue;
        }
        rig.watch_tip = false; /* its own limits are damaged too */
        const dr_limits damaged = rig.limits;
        static const uint8_t to_41000[] = {'S', 15, 0x28, 0xA0, 0, 0, 0x40, 0x9C, 0, 0, 0x40, 0x9C, 0, 0};
        dr_guard_push_host(&rig.guard, guard_clock(), to_41000,
                           14); /* past the monitors, which use the limits as well */
        for (int i = 0; i < 40; i++) {
            uint8_t byte;
            rig.now += 500;
            while (dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1) == 1) {
                TEST_ASSERT_TRUE(byte == 'c' || byte == 'C' || byte == 3);
                dr_controller_push(&rig.controller, guard_clock(), &byte, 1);
            }
            while (dr_controller_pull(&rig.controller, guard_clock(), &byte, 1) == 1)
                dr_guard_push_device(&rig.guard, guard_clock(), &byte, 1);
        }
        TEST_ASSERT_EQUAL_MEMORY(&damaged, &rig.limits, sizeof damaged);
        TEST_ASSERT_EQUAL(0, status().forwarded);
        expect_tip(0, 40000, 40000, 40000);
        TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, guard_clock()));
        found++;
    }
    TEST_ASSERT_GREATER_THAN(1000, found);
    TEST_ASSERT_LESS_THAN(300, harmless);
}

static void row_72_a_flipped_bit_of_the_mode_is_found(void)
{
    for (unsigned bit = 0; bit < 8; bit++) {
        bench_armed_trio();
        rig.guard.mode ^= (uint8_t)(1u << bit);
        host_line(15, 40800, 40000, 40000);
        run_ms(100);
        expect_state(DR_GUARD_LOCKED);
        expect_fault(DR_FAULT_DAMAGED);
        expect_tip(0, 40000, 40000, 40000);
        host_code('c');
        host_code(3); /* all that still passes */
        run_ms(10);
        TEST_ASSERT_EQUAL(3, rig.wire[rig.wire_count - 1]);
        TEST_ASSERT_EQUAL(DR_NEEDS_LIMITS, status().needs);
        clear_fault();
        stop_input(true);
        run_ms(100);
        link_is(false, false);
        link_is(true, true);
        run_ms(2000);
        expect_state(DR_GUARD_LOCKED);
        expect_fault(DR_FAULT_DAMAGED);
    }
}

static void damage_found_in_mid_move_stops(void)
{
    bench_armed_trio();
    TEST_ASSERT_TRUE(dr_guard_self_check(&rig.guard, guard_clock()));
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    rig.limits.margin_q++;
    TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, guard_clock()));
    run_ms(10);
    TEST_ASSERT_EQUAL(DR_STATE_REST, rig.controller.state);
    expect_state(DR_GUARD_LOCKED);
}

static void without_valid_limits_only_ctrl_c_passes(void)
{
    for (int which = 0; which < 2; which++) {
        bench_trio();
        rig.limits.margin_q = -1;
        dr_guard_init(&rig.guard, which == 0 ? NULL : &rig.limits, rig.ring, 64);
        dr_guard_start(&rig.guard, guard_clock(), DR_START_POWER_ON);
        dr_controller_start(&rig.controller, guard_clock());
        link_is(true, true);
        expect_state(DR_GUARD_LOCKED);
        expect_fault(DR_FAULT_LIMITS);
        TEST_ASSERT_EQUAL(DR_NEEDS_LIMITS, status().needs);
        host_bytes("cCSHxA\3", 7);
        run_ms(2000);
        TEST_ASSERT_EQUAL(1, rig.wire_count);
        TEST_ASSERT_EQUAL(3, rig.wire[0]);
        expect_silence();
        TEST_ASSERT_EQUAL(1, status().quarantined_bytes); /* the answer to ^C */
        TEST_ASSERT_EQUAL(6, status().dropped_bytes);
        TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, guard_clock()));
    }
}

static void row_74_after_a_reset_in_mid_move_ctrl_c_goes_first(void)
{
    bench_armed_mpc();
    host_line(0, 84000, 80000, 80000);
    run_ms(200);
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64); /* a watchdog's reset */
    rig.crc = rig.next_sequence = 0;
    rig.frames_refused = 0;
    rig.state = DR_GUARD_LOCKED;
    dr_guard_start(&rig.guard, guard_clock(), DR_START_AFTER_RESET);
    const uint32_t wire = rig.wire_count;
    link_is(true, true);
    run_ms(5);
    TEST_ASSERT_EQUAL(wire + 1, rig.wire_count);
    TEST_ASSERT_EQUAL(3, rig.wire[wire]);
    TEST_ASSERT_EQUAL(DR_STATE_REST, rig.controller.state);
    expect_state(DR_GUARD_LOCKED);
    run_ms(1200);
    expect_state(DR_GUARD_DISARMED);
    expect_silence();
}

static void row_76_clocks_that_wrap_or_jump(void)
{
    for (uint32_t before = 0; before < 400000; before += 20000) { /* the wrap falls on every phase */
        bench_trio();
        rig.clock_at_start = 0u - 1400000u + before;
        bench_start();
        bench_arm();
        host_line(15, 41600, 40000, 40000);
        run_ms(300);
        expect_cr();
        expect_state(DR_GUARD_IDLE);
    }
    bench_armed_trio();
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    rig.clock_at_start += 60000000u; /* a minute in no time: every deadline has passed */
    run_ms(100);
    TEST_ASSERT_TRUE(wire_stops() >= 1);
    expect_silence();
}

static void row_77_the_host_is_lost_while_it_moves(void)
{
    bench_armed_trio();
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    link_is(false, true);
    expect_state(DR_GUARD_STOPPING);
    run_ms(500);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_EQUAL(DR_STATE_REST, rig.controller.state);
    link_is(true, true);
    expect_state(DR_GUARD_DISARMED);
    expect_silence();

    bench_trio();
    rig.limits.host_loss = DR_HOST_LOSS_FINISH;
    bench_start();
    bench_arm();
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    link_is(false, true);
    run_ms(3000);
    expect_state(DR_GUARD_DISARMED);
    expect_tip(0, 44000, 40000, 40000);
    TEST_ASSERT_EQUAL(0, wire_stops());

    bench_trio();
    rig.limits.host_loss = DR_HOST_LOSS_FINISH;
    bench_start();
    bench_arm();
    host_line(0, 44000, 40000, 40000);
    run_ms(1); /* not begun yet */
    link_is(false, true);
    run_ms(1000);
    expect_tip(0, 40000, 40000, 40000);
    expect_state(DR_GUARD_DISARMED);

    bench_armed_trio(); /* at rest */
    link_is(false, true);
    expect_state(DR_GUARD_DISARMED);
}

static void row_77_a_motion_that_cannot_be_stopped_ends_when_the_host_is_lost(void)
{
    bench_armed_trio();
    host_axis('x', 44000);
    run_ms(30);
    link_is(false, true);
    expect_state(DR_GUARD_MOVING_U);
    run_ms(500);
    expect_state(DR_GUARD_DISARMED);
    expect_fault(DR_FAULT_NONE);
    TEST_ASSERT_EQUAL(0, wire_stops());
}

static void the_key_off_in_mid_move_stops(void)
{
    bench_armed_trio();
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    input(DR_INPUT_KEY, false);
    expect_state(DR_GUARD_STOPPING);
    run_ms(500);
    expect_state(DR_GUARD_DISARMED);
    expect_silence();
}

static void row_78_a_full_log_overwrites_the_oldest_a_failed_one_disarms(void)
{
    dr_record small[4], record;
    bench_trio();
    dr_controller_start(&rig.controller, guard_clock());
    dr_guard_init(&rig.guard, &rig.limits, small, 4);
    dr_guard_start(&rig.guard, guard_clock(), DR_START_POWER_ON);
    for (int i = 0; i < 10; i++)
        dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_ESCAPE, i % 2 == 0);
    TEST_ASSERT_EQUAL(7, status().log_missed);
    TEST_ASSERT_TRUE(dr_guard_pull_log(&rig.guard, &record));
    TEST_ASSERT_EQUAL(7, record.sequence);
    uint32_t crc = record.crc;
    while (dr_guard_pull_log(&rig.guard, &record)) {
        TEST_ASSERT_EQUAL_HEX32(dr_record_crc(crc, &record), record.crc);
        crc = record.crc;
    }
    TEST_ASSERT_EQUAL(10, record.sequence);

    dr_guard_init(&rig.guard, &rig.limits, NULL, 100);
    dr_guard_start(&rig.guard, guard_clock(), DR_START_POWER_ON);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_LOG) != 0);
    TEST_ASSERT_FALSE(dr_guard_pull_log(&rig.guard, &record));

    bench_armed_trio();
    input(DR_INPUT_LOG_FAILED, true);
    expect_state(DR_GUARD_DISARMED);
    press(DR_INPUT_ARM);
    run_ms(200);
    expect_state(DR_GUARD_DISARMED);
}

static void a_record_is_48_bytes_in_order(void)
{
    const dr_record record = {0x04030201,
                              0x08070605,
                              9,
                              10,
                              11,
                              12,
                              13,
                              14,
                              15,
                              16,
                              {17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32},
                              {0x24232221, 0x28272625, 0x2C2B2A29},
                              0x302F2E2D};
    uint8_t bytes[DR_RECORD_BYTES];
    dr_record_put(&record, bytes);
    for (size_t i = 0; i < DR_RECORD_BYTES; i++)
        TEST_ASSERT_EQUAL_HEX8(i + 1, bytes[i]);
    TEST_ASSERT_EQUAL_HEX32(dr_crc32c(5, bytes, 44), dr_record_crc(5, &record));
}

static void a_refusal_is_told_with_its_numbers(void)
{
    bench_armed_trio();
    host_line(15, 199999, 40000, 40000);
    run_ms(50);
    const dr_guard_status now = status();
    TEST_ASSERT_EQUAL(DR_REASON_LIMIT, now.last_refusal.reason);
    TEST_ASSERT_EQUAL(DR_X, now.last_refusal.axis);
    TEST_ASSERT_EQUAL_INT64(199999 * 8, now.last_refusal.measured);
    TEST_ASSERT_EQUAL_INT64(UM(24900), now.last_refusal.limit);
    const dr_record *record = last_record(DR_EVENT_REFUSED);
    TEST_ASSERT_EQUAL(DR_REASON_LIMIT, record->code);
    TEST_ASSERT_EQUAL(14, record->count);
    TEST_ASSERT_EQUAL('S', record->bytes[0]);
    TEST_ASSERT_EQUAL(40000, record->position_steps[DR_X]);
}

static void a_host_that_does_not_read_loses_bytes_and_nothing_else(void)
{
    bench_armed_trio();
    for (int i = 0; i < 8; i++) {
        static const uint8_t reply[14] = {0x40, 0x9C, 0, 0, 0x40, 0x9C, 0, 0, 0x40, 0x9C, 0, 0, 30, 0x0D};
        uint8_t byte;
        dr_guard_push_host(&rig.guard, guard_clock(), (const uint8_t *)"c", 1);
        TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1));
        dr_guard_push_device(&rig.guard, guard_clock(), reply, 14);
    }
    uint8_t all[200];
    TEST_ASSERT_EQUAL(DR_HOST_OUT_MAX, dr_guard_pull_host(&rig.guard, guard_clock(), all, sizeof all));
    expect_state(DR_GUARD_IDLE);
}

static void an_unknown_input_is_no_input(void)
{
    bench_trio();
    bench_start();
    const uint16_t before = rig.guard.inputs;
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUTS, true);
    TEST_ASSERT_EQUAL(before, rig.guard.inputs);
}

static void when_nothing_is_under_way_nothing_is_due(void)
{
    dr_us when;
    bench_trio();
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
    bench_start();
    run_ms(30000);
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(row_58_a_knob_turned_between_commands);
    RUN_TEST(row_59_a_knob_turned_between_the_query_and_the_motion);
    RUN_TEST(row_59_an_answer_is_as_old_as_its_query);
    RUN_TEST(row_59_a_guard_that_is_late_in_the_pause_within_s);
    RUN_TEST(row_60_another_drive_by_hand_during_the_move);
    RUN_TEST(row_60_another_drive_by_hand_before_the_move);
    RUN_TEST(row_63_a_changed_tip_disarms_until_it_is_confirmed);
    RUN_TEST(row_65_arming_needs_a_fresh_edge_and_no_stop);
    RUN_TEST(row_65_a_stop_while_arming);
    RUN_TEST(row_65_the_key_off_while_arming);
    RUN_TEST(row_66_contacts_that_disagree);
    RUN_TEST(a_bouncing_stop_contact_keeps_the_stop);
    RUN_TEST(row_67_a_released_stop_moves_and_arms_nothing);
    RUN_TEST(row_68_nothing_that_the_host_sends_clears_a_fault);
    RUN_TEST(row_69_disarmed_after_900_s_without_a_motion);
    RUN_TEST(a_long_motion_is_not_idleness);
    RUN_TEST(arming_outside_needs_escape);
    RUN_TEST(a_tip_that_moves_while_arming_is_unsteady);
    RUN_TEST(what_is_missing_is_told);
    RUN_TEST(in_tissue_and_calibration_are_levels_of_a_person);
    RUN_TEST(row_72_every_flipped_bit_of_the_limits_is_found_before_the_next_motion);
    RUN_TEST(row_72_a_flipped_bit_of_the_mode_is_found);
    RUN_TEST(damage_found_in_mid_move_stops);
    RUN_TEST(without_valid_limits_only_ctrl_c_passes);
    RUN_TEST(row_74_after_a_reset_in_mid_move_ctrl_c_goes_first);
    RUN_TEST(row_76_clocks_that_wrap_or_jump);
    RUN_TEST(row_77_the_host_is_lost_while_it_moves);
    RUN_TEST(row_77_a_motion_that_cannot_be_stopped_ends_when_the_host_is_lost);
    RUN_TEST(the_key_off_in_mid_move_stops);
    RUN_TEST(row_78_a_full_log_overwrites_the_oldest_a_failed_one_disarms);
    RUN_TEST(a_record_is_48_bytes_in_order);
    RUN_TEST(a_refusal_is_told_with_its_numbers);
    RUN_TEST(a_host_that_does_not_read_loses_bytes_and_nothing_else);
    RUN_TEST(an_unknown_input_is_no_input);
    RUN_TEST(when_nothing_is_under_way_nothing_is_due);
    return UNITY_END();
}
