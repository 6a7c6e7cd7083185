/* When exactly: every span that the guard keeps, to the microsecond, told by when it is due. The test is the controller. */
#include "bench.h"

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

static void due_in(uint32_t us)
{
    dr_us when;
    TEST_ASSERT_TRUE_MESSAGE(dr_guard_due(&rig.guard, &when), "nothing is due");
    TEST_ASSERT_EQUAL_UINT32(us, when - guard_clock());
}

static void says_at(uint32_t x) { device_at(x, 40000, 40000, 30); }

/* A TRIO whose identity is proved; nothing is due but that the place becomes stale, 20 s after the reading. */
static void proved(void)
{
    bench_trio();
    rig.by_hand = true;
    bench_start();
    due_in(1000000);
    run_us(1000000);
    says_at(40000);
    expect_state(DR_GUARD_DISARMED);
    due_in(20000000);
}

static void armed(void)
{
    proved();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    due_in(2000);
    run_us(2000);
    says_at(40000);
    due_in(100000);
    run_us(100000);
    says_at(40000);
    expect_state(DR_GUARD_IDLE);
}

/* Runs until this many bytes have left for the controller. */
static void run_until_sent(uint32_t count)
{
    for (unsigned i = 0; i < 100000 && rig.wire_count < count; i++)
        run_us(1);
    TEST_ASSERT_EQUAL(count, rig.wire_count);
}

/* A line to `x` whose last byte has just left. */
static void moving_to(uint32_t x, unsigned level)
{
    armed();
    host_line(level, x, 40000, 40000);
    due_in(2000);
    run_us(2000);
    says_at(40000);
    due_in(2000);
    const uint32_t before = rig.wire_count;
    run_us(2000);
    run_until_sent(before + 14);
    expect_state(DR_GUARD_MOVING_S);
    TEST_ASSERT_EQUAL(0, rig.guard.running >> DR_TIMER_SEND & 1);
}

static void a_silent_controller_is_asked_ten_times_in_pauses_that_grow(void)
{
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_us(1000000);
    for (uint32_t attempt = 1; attempt <= 10; attempt++) {
        TEST_ASSERT_EQUAL(attempt, rig.wire_count);
        due_in(2000000);
        run_us(2000000);
        expect_fault(DR_FAULT_DEVICE_SILENT);
        if (attempt < 10) {
            due_in(attempt * 1000000);
            run_us(attempt * 1000000);
        }
    }
    dr_us when;
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
}

static void a_reply_may_pause_for_100_ms_and_is_asked_for_again_after_100_ms_of_quiet(void)
{
    proved();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_us(2000);
    due_in(2000000);
    run_us(1999999);
    device_says("abc", 1);
    due_in(100000);
    run_us(99999);
    device_says("b", 1);
    due_in(100000);
    run_us(100000); /* nonsense: too short */
    due_in(100000);
    run_us(60000);
    device_says("c", 1);
    due_in(100000);
    const uint32_t before = rig.wire_count;
    run_us(100000);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
    says_at(40000);
    due_in(100000);
}

static void each_reading_has_two_tries(void)
{
    proved();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_us(2000);
    for (unsigned reading = 0; reading < 2; reading++) {
        device_says("nonsense......", 14);
        expect_fault(DR_FAULT_NONE);
        run_us(100000);
        says_at(40000);
        run_us(100000);
    }
    expect_state(DR_GUARD_IDLE);
}

static void a_motion_that_is_taken_back_leaves_nothing_due(void)
{
    armed();
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    says_at(40000);
    run_us(500);
    host_code(3);
    due_in(49500); /* but a token for motions */
}

static void a_byte_within_the_gap_before_a_query_begins_it_anew(void)
{
    proved();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_us(1500);
    device_says("x", 1);
    due_in(2000);
    run_us(2000);
    says_at(40000);
    run_us(50000);
    device_says("x", 1); /* 50 ms before the second reading: that is long enough */
    due_in(50000);
    run_us(48500);
    device_says("x", 1);
    due_in(2000);
}

static void a_frame_may_pause_for_100_ms_and_take_300_ms(void)
{
    proved();
    for (unsigned i = 0; i < 3; i++) {
        host_code('S');
        due_in(100000);
        run_us(99999);
    }
    due_in(1);
    host_code('S');
    due_in(3); /* 300 ms since the first byte */
    run_us(3);
    due_in(50000); /* resync: until the host has paused for 50 ms */
    run_us(49999);
    TEST_ASSERT_EQUAL(4, status().dropped_bytes);
    host_code('c');
    due_in(50000);
    run_us(50000);
    host_code('c');
    TEST_ASSERT_EQUAL(5, status().dropped_bytes);
    due_in(2000000); /* the query that was passed on must be answered in time */
    device_says("0123456789ab", 12);
    due_in(100000);
}

static void a_motion_has_one_and_a_half_times_its_way_and_2_s(void)
{
    moving_to(48000, 15); /* 1,000 um at 5 mm/s: 200 ms */
    TEST_ASSERT_EQUAL_UINT32(2300000, rig.guard.at[DR_TIMER_TASK] - guard_clock());
    TEST_ASSERT_EQUAL_UINT32(100000,
                             rig.guard.at[DR_TIMER_LINE] - guard_clock()); /* so long a cable may tear the frame */
    run_us(100000);
    due_in(2200000);
    run_us(2199999);
    TEST_ASSERT_EQUAL(0, wire_stops());
    run_us(1);
    TEST_ASSERT_EQUAL(1, wire_stops());
    moving_to(40800, 0); /* 100 um at 1/16 of 5 mm/s: 320 ms */
    TEST_ASSERT_EQUAL_UINT32(2480000, rig.guard.at[DR_TIMER_TASK] - guard_clock());
}

static void a_cable_may_tear_a_frame_until_100_ms_behind_it(void)
{
    moving_to(48000, 15);
    run_us(99999);
    cables(true, false);
    expect_fault(DR_FAULT_TORN);
    moving_to(48000, 15);
    run_us(100000);
    cables(true, false);
    expect_fault(DR_FAULT_NO_DEVICE);
    proved(); /* the shortest frame that can be torn has two bytes */
    host_value('A', 45);
    run_until_sent(3);
    cables(true, false);
    expect_fault(DR_FAULT_TORN);
}

/* An MPC-200's line pauses behind its second byte; a stop that comes then has to wait, and what it waits for begins then. */
static void a_stop_within_a_line_begins_when_the_line_has_left(void)
{
    bench_mpc();
    bench_start_by_hand(device_at_home);
    bench_arm_by_hand(device_at_home);
    host_line(15, 84000, 80000, 80000);
    run_us(2000);
    device_at_home();
    run_us(2000);
    const uint32_t before = rig.wire_count;
    run_us(10000);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
    host_code(3);
    expect_state(DR_GUARD_STOPPING);
    run_us(24000); /* 35 ms behind the second byte */
    run_until_sent(before + 13);
    TEST_ASSERT_EQUAL_UINT32(100000, rig.guard.at[DR_TIMER_TASK] - guard_clock());
    TEST_ASSERT_EQUAL_UINT32(150000, rig.guard.at[DR_TIMER_REPEAT] - guard_clock());
    TEST_ASSERT_EQUAL_UINT32(1000000, rig.guard.at[DR_TIMER_PROOF] - guard_clock());
    run_us(100);
    TEST_ASSERT_EQUAL(1, wire_stops());
}

static void the_end_is_read_2_ms_behind_its_cr(void)
{
    moving_to(48000, 15);
    run_us(200000);
    device_says("\r", 1);
    due_in(2000);
    run_us(2000);
    says_at(47000); /* not there: read again, 100 ms later */
    due_in(100000);
    run_us(100000);
    says_at(47000);
    expect_fault(DR_FAULT_WRONG_END);
}

static void rest_is_proved_by_two_readings_in_quiet_and_ctrl_c_is_repeated_until_a_cr(void)
{
    moving_to(48000, 15);
    run_us(100000);
    const dr_us idle = rig.guard.at[DR_TIMER_IDLE];
    host_code(3);
    TEST_ASSERT_EQUAL_UINT32(1000000, rig.guard.at[DR_TIMER_PROOF] - guard_clock());
    due_in(100000);
    run_us(100000);
    due_in(50000); /* quiet, but no CR: ^C goes again at 150 ms, and at 300 ms */
    run_us(49999);
    TEST_ASSERT_EQUAL(1, wire_stops());
    run_us(1);
    TEST_ASSERT_EQUAL(2, wire_stops());
    run_us(100000);
    due_in(50000);
    run_us(50000);
    TEST_ASSERT_EQUAL(3, wire_stops());
    due_in(100000); /* and that was the last */
    run_us(60000);
    device_says("x", 1);
    due_in(100000);
    run_us(100000);
    says_at(41000);
    due_in(100000);
    run_us(100000);
    says_at(41000);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_EQUAL(3, wire_stops());
    TEST_ASSERT_EQUAL_UINT32(idle,
                             rig.guard.at[DR_TIMER_IDLE]); /* none of this was a motion: 900 s count from the last */
}

static void rest_that_is_not_proved_in_1_s_is_a_fault_and_is_asked_for_every_500_ms(void)
{
    moving_to(48000, 15);
    run_us(100000);
    host_code(3);
    device_says("\r", 1);
    run_us(100000);
    for (uint32_t i = 0; i < 8; i++) {
        says_at(41000 + 100 * i);
        due_in(100000);
        run_us(100000);
    }
    says_at(42000);
    due_in(100000);
    run_us(99999);
    TEST_ASSERT_FALSE(status().buzzer);
    run_us(1); /* 1 s after ^C */
    TEST_ASSERT_TRUE(status().buzzer);
    expect_fault(DR_FAULT_UNSTOPPABLE);
    says_at(43000);
    due_in(500000);
    run_us(500000);
    says_at(43000);
    TEST_ASSERT_FALSE(status().buzzer);
}

static void idleness_disarms_and_does_nothing_to_a_fault(void)
{
    armed();
    run_us(899999999);
    expect_state(DR_GUARD_IDLE);
    run_us(1);
    expect_state(DR_GUARD_DISARMED);
    armed();
    device_says("0123456789abcdefg", 17);
    expect_state(DR_GUARD_FAULT);
    run_us(1000000000);
    expect_state(DR_GUARD_FAULT);
    expect_fault(DR_FAULT_DEVICE_NOISE);
}

static void a_motion_that_cannot_be_stopped_is_one_from_its_first_byte(void)
{
    armed();
    host_axis('x', 40800);
    run_us(2000);
    says_at(40000);
    run_us(1999);
    expect_state(DR_GUARD_CHECKING);
    const uint32_t before = rig.wire_count;
    run_until_sent(before + 1);
    expect_state(DR_GUARD_MOVING_U);
    run_until_sent(before + 5);
    expect_state(DR_GUARD_MOVING_U);
}

static void tokens_for_motions_come_back_every_50_ms(void)
{
    armed();
    rig.guard.tokens = 18; /* as if two motions had just begun */
    rig.guard.sealed = 0;
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    says_at(40000);
    TEST_ASSERT_EQUAL(17, rig.guard.tokens);
    for (uint8_t tokens = 17; tokens < 20; tokens++) {
        TEST_ASSERT_EQUAL_UINT32(50000, rig.guard.at[DR_TIMER_RATE] - guard_clock());
        run_us(49999);
        TEST_ASSERT_EQUAL(tokens, rig.guard.tokens);
        run_us(1);
        TEST_ASSERT_EQUAL(tokens + 1, rig.guard.tokens);
    }
    TEST_ASSERT_EQUAL(0, rig.guard.running >> DR_TIMER_RATE & 1);
}

/* The host's setting is half out: it cannot have been answered yet. */
static void an_answer_is_awaited_2_s_at_a_time_while_the_line_hangs(void)
{
    armed();
    run_us(1000);
    host_value('A', 45);
    TEST_ASSERT_EQUAL(1, rig.guard.out_at);
    line_hangs();
    for (unsigned i = 0; i < 2; i++) {
        due_in(2000000);
        run_us(2000000);
    }
    TEST_ASSERT_NULL(last_record(DR_EVENT_NO_REPLY));
    line_goes_on();
    run_us(500);
    device_says("\r", 1);
    expect_cr();
    TEST_ASSERT_NULL(last_record(DR_EVENT_NO_REPLY));
}

/* What a knob can do meanwhile the margin grows by; what takes longer is asked for again. */
static void an_answer_may_come_100_ms_late(void)
{
    for (uint32_t took_us = 103000; took_us <= 103001; took_us++) { /* 3 ms are for its bytes */
        armed();
        rig.limits.rig = 0;
        limits_changed();
        run_us(1000);
        host_line(15, 48000, 40000, 40000);
        const uint32_t before = rig.wire_count;
        run_us(2000);
        TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
        run_us(took_us);
        says_at(40000);
        run_us(2000);
        TEST_ASSERT_EQUAL_HEX8(took_us == 103000 ? 'S' : 'c', rig.wire[before + 1]);
    }
}

/* The guard's own query comes behind the frame that is half out, and rest is proved once the line goes on. */
static void a_query_waits_2_ms_at_a_time_while_the_line_hangs(void)
{
    armed();
    run_us(1000);
    host_value('A', 45);
    TEST_ASSERT_EQUAL(1, rig.guard.out_at);
    line_hangs();
    const uint32_t before = rig.wire_count;
    stop_input(true);
    run_us(400000); /* ^C three times, and then the query would be due */
    due_in(2000);
    run_us(100000);
    due_in(2000);
    TEST_ASSERT_EQUAL(before, rig.wire_count);
    line_goes_on();
    run_until_sent(before + 5);
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\x2D\3\3\3c", rig.wire + before, 5);
    says_at(40000);
    run_us(100000);
    says_at(40000);
    expect_state(DR_GUARD_STOPPED);
    expect_fault(DR_FAULT_NONE);
}

static void behind_an_error_of_the_hosts_line_50_ms_are_enough(void)
{
    proved();
    host_code('S');
    run_us(30000);
    dr_guard_host_line_error(&rig.guard, guard_clock());
    due_in(50000);
    run_us(80000); /* 110 ms since the frame began: nothing is left of it that could be late */
    const uint32_t before = rig.wire_count;
    host_code('c');
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
    TEST_ASSERT_EQUAL(1, status().dropped_bytes);
}

/* -- Stops in the middle of something ------------------------------------------------------------------------------------- */

static void what_is_left_of_a_reading_is_no_answer_to_ctrl_c(void)
{
    armed();
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    device_says("abcde", 5);
    host_code(3);
    device_says("\r\r\r\r\r\r\r\r\r", 9);
    TEST_ASSERT_EQUAL(0, rig.guard.stop_crs);
    run_us(400000); /* and no CR of ^C: asked for three times */
    TEST_ASSERT_EQUAL(3, wire_stops());
    says_at(40000);
    run_us(100000);
    says_at(40000);
    expect_state(DR_GUARD_IDLE);
    expect_silence();
    proved(); /* of the host's own query as well */
    host_code('c');
    run_us(500);
    device_says("abc", 3);
    stop_input(true);
    device_says("\r\r\r\r\r\r\r\r\r\r\r", 11);
    TEST_ASSERT_EQUAL(0, rig.guard.stop_crs);
    device_says("\r", 1);
    TEST_ASSERT_EQUAL(1, rig.guard.stop_crs);
}

static void a_stop_while_the_end_is_verified_keeps_the_target_possible(void)
{
    moving_to(48000, 15);
    device_says("\r", 1);
    host_code(3);
    device_says("\r", 1);
    run_us(100000);
    says_at(47000);
    run_us(100000);
    says_at(47000);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    TEST_ASSERT_EQUAL(48000 * 8, rig.guard.scene.old[0].target_q.min_q[DR_X]);
    TEST_ASSERT_EQUAL(47000, rig.guard.scene.old[0].at_steps[DR_X]);
    expect_cr();
}

static void fifteen_ctrl_c_running_are_passed_on_and_no_more(void)
{
    moving_to(48000, 15);
    run_us(100000);
    for (unsigned i = 0; i < 20; i++) {
        host_code(3);
        run_us(200);
    }
    TEST_ASSERT_EQUAL(15, wire_stops());
    TEST_ASSERT_EQUAL(5, status().dropped_bytes);
}

/* How long a motion of an MPC-200 may last, in us, once it has left. */
static uint32_t lasts(int code, uint8_t level, uint32_t y, uint16_t facts)
{
    static const uint8_t at_home[] = {1, 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x0D};
    bench_mpc();
    rig.by_hand = true;
    rig.limits.rig = (uint16_t)(DR_RIG_KNOBS_LOCKED | facts);
    bench_start();
    input(DR_INPUT_MAY_CALIBRATE, true);
    input(DR_INPUT_KEY, true);
    run_us(1000000);
    device_says(at_home, 14);
    press(DR_INPUT_ARM);
    run_us(2000);
    device_says(at_home, 14);
    run_us(100000);
    device_says(at_home, 14);
    if (code == 'N')
        host_code('N');
    else if (code == 'S')
        host_line(level, 80000, y, 80000);
    else
        host_point(code, 80000, y, 80000);
    run_us(2000);
    device_says(at_home, 14);
    const uint32_t before = rig.wire_count;
    run_until_sent(before + (code == 'N' ? 1 : code == 'S' ? 14 : 13));
    return rig.guard.at[DR_TIMER_TASK] - guard_clock();
}

static void small_moves_calibrations_and_slow_lines_have_their_own_spans(void)
{
    TEST_ASSERT_EQUAL_UINT32(100000, lasts('M', 0, 80015, 0)); /* may be ignored: 15 microsteps */
    const uint32_t before = rig.wire_count;
    run_us(99999);
    TEST_ASSERT_EQUAL(before, rig.wire_count);
    run_us(1); /* at once: asked where it is */
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
    TEST_ASSERT_EQUAL_UINT32(100000, lasts('S', 15, 80000 - 15, 0));
    TEST_ASSERT_EQUAL_UINT32(2000000 + 500, lasts('M', 0, 80016, 0));     /* 1 um at 3 mm/s */
    TEST_ASSERT_EQUAL_UINT32(2000000 + 1846153, lasts('S', 0, 81600, 0)); /* 100 um at 81.25 um/s */
    TEST_ASSERT_EQUAL_UINT32(60000000, lasts('N', 0, 0, DR_RIG_MAY_CALIBRATE));
}

static void noise_is_counted_by_the_second(void)
{
    proved();
    device_says("0123456789abcdef", 16);
    due_in(1000000);
    expect_fault(DR_FAULT_NONE);
    run_us(999999);
    expect_state(DR_GUARD_DISARMED);
    run_us(1);
    device_says("0123456789abcdef", 16);
    expect_fault(DR_FAULT_NONE);
    device_says("g", 1);
    expect_fault(DR_FAULT_DEVICE_NOISE);
}

static void stop_contacts_may_disagree_for_50_ms_and_bounce_for_20_ms(void)
{
    proved();
    input(DR_INPUT_STOP, true);
    run_us(49999);
    expect_fault(DR_FAULT_NONE);
    input(DR_INPUT_STOP_2, true);
    run_us(100000);
    expect_fault(DR_FAULT_NONE);
    stop_input(false);
    input(DR_INPUT_KEY, false);
    const uint16_t needs = status().needs;
    TEST_ASSERT_TRUE((needs & DR_NEEDS_STOP_RELEASED) != 0);
    TEST_ASSERT_EQUAL_UINT32(20000, rig.guard.at[DR_TIMER_RELEASE] - guard_clock());
    run_us(19999);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_STOP_RELEASED) != 0);
    run_us(1);
    TEST_ASSERT_FALSE((status().needs & DR_NEEDS_STOP_RELEASED) != 0);
    proved();
    input(DR_INPUT_STOP_2, true);
    run_us(50000);
    expect_fault(DR_FAULT_STOP_WIRING);
    input(DR_INPUT_STOP_2, false); /* a fault of the contacts lets nobody off the 20 ms */
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_STOP_RELEASED) != 0);
    run_us(19999);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_STOP_RELEASED) != 0);
    run_us(1);
    TEST_ASSERT_FALSE((status().needs & DR_NEEDS_STOP_RELEASED) != 0);
}

static void one_call_does_sixteen_things_that_are_due(void)
{
    uint8_t byte;
    bench_trio();
    rig.by_hand = true;
    rig.to_device_busy = true; /* nobody pulls: what is due piles up */
    rig.to_device_at = UINT64_MAX;
    bench_start();
    rig.now += 1500000000;
    (void)dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 0);
    /* A proof's TASK, READ and READ again are three things an attempt: five attempts, and the sixth's TASK. */
    TEST_ASSERT_EQUAL(10 - 5, rig.guard.attempts);
    TEST_ASSERT_EQUAL(1, rig.guard.running >> DR_TIMER_READ & 1);
    TEST_ASSERT_EQUAL_UINT32(rig.clock_at_start + 26000000, rig.guard.at[DR_TIMER_READ]); /* 1 + 3 + 4 + 5 + 6 + 7 s */
}

static void a_flipped_bit_among_the_timers_is_no_timer(void)
{
    dr_us when;
    bench_trio();
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
    for (unsigned bit = DR_TIMERS; bit < 16; bit++) {
        rig.guard.running = (uint16_t)(1u << bit);
        TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_silent_controller_is_asked_ten_times_in_pauses_that_grow);
    RUN_TEST(a_reply_may_pause_for_100_ms_and_is_asked_for_again_after_100_ms_of_quiet);
    RUN_TEST(each_reading_has_two_tries);
    RUN_TEST(a_motion_that_is_taken_back_leaves_nothing_due);
    RUN_TEST(a_byte_within_the_gap_before_a_query_begins_it_anew);
    RUN_TEST(a_frame_may_pause_for_100_ms_and_take_300_ms);
    RUN_TEST(a_motion_has_one_and_a_half_times_its_way_and_2_s);
    RUN_TEST(a_cable_may_tear_a_frame_until_100_ms_behind_it);
    RUN_TEST(a_stop_within_a_line_begins_when_the_line_has_left);
    RUN_TEST(the_end_is_read_2_ms_behind_its_cr);
    RUN_TEST(rest_is_proved_by_two_readings_in_quiet_and_ctrl_c_is_repeated_until_a_cr);
    RUN_TEST(rest_that_is_not_proved_in_1_s_is_a_fault_and_is_asked_for_every_500_ms);
    RUN_TEST(idleness_disarms_and_does_nothing_to_a_fault);
    RUN_TEST(a_motion_that_cannot_be_stopped_is_one_from_its_first_byte);
    RUN_TEST(tokens_for_motions_come_back_every_50_ms);
    RUN_TEST(what_is_left_of_a_reading_is_no_answer_to_ctrl_c);
    RUN_TEST(a_stop_while_the_end_is_verified_keeps_the_target_possible);
    RUN_TEST(fifteen_ctrl_c_running_are_passed_on_and_no_more);
    RUN_TEST(small_moves_calibrations_and_slow_lines_have_their_own_spans);
    RUN_TEST(noise_is_counted_by_the_second);
    RUN_TEST(stop_contacts_may_disagree_for_50_ms_and_bounce_for_20_ms);
    RUN_TEST(one_call_does_sixteen_things_that_are_due);
    RUN_TEST(a_flipped_bit_among_the_timers_is_no_timer);
    RUN_TEST(an_answer_is_awaited_2_s_at_a_time_while_the_line_hangs);
    RUN_TEST(an_answer_may_come_100_ms_late);
    RUN_TEST(a_query_waits_2_ms_at_a_time_while_the_line_hangs);
    RUN_TEST(behind_an_error_of_the_hosts_line_50_ms_are_enough);
    return UNITY_END();
}
