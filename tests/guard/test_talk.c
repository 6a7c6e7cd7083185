/* The conversation on both sides, byte by byte: what is an answer to what, what is not, and in which order it is logged.
 * The test is the controller. */
#include "bench.h"

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

static void trio_says(uint32_t x) { device_at(x, 40000, 40000, 30); }

static void armed(dr_kind kind, uint16_t facts)
{
    bench_proved_by_hand(kind, facts);
    bench_arm_by_hand(device_at_home);
}

static void x_moves(void)
{
    armed(DR_TRIO, 0);
    host_axis('x', 40800);
    run_us(2000);
    device_at_home();
    run_us(6000);
    expect_state(DR_GUARD_MOVING_U);
}

static void line_moves(void)
{
    armed(DR_TRIO, 0);
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    device_at_home();
    run_us(10000);
    expect_state(DR_GUARD_MOVING_S);
}

static uint32_t sequence_of(dr_event event)
{
    const dr_record *record = last_record(event);
    TEST_ASSERT_NOT_NULL(record);
    return record->sequence;
}

/* -- The controller ------------------------------------------------------------------------------------------------------ */

static void a_reply_that_comes_in_the_pause_between_two_tries_proves_nothing(void)
{
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_us(1000000 + 2000000 + 500000); /* asked, no answer, half of the pause */
    trio_says(40000);
    expect_state(DR_GUARD_LOCKED);
    TEST_ASSERT_EQUAL(14, status().quarantined_bytes);
    expect_fault(DR_FAULT_DEVICE_SILENT); /* nor is noise a fault while nobody has proved who it is */
    device_says("0123456789abcdefghij", 20);
    expect_fault(DR_FAULT_DEVICE_SILENT);
}

static void a_controller_that_is_silent_while_arming_refuses_nothing(void)
{
    bench_proved_by_hand(DR_TRIO, 0);
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_us(2002000);
    expect_fault(DR_FAULT_DEVICE_SILENT);
    TEST_ASSERT_EQUAL(0, status().refused);
}

static void the_log_keeps_to_the_order_of_the_line(void)
{
    armed(DR_TRIO, 0);
    host_code(0x99);
    run_us(20000);
    device_says("xyz", 3);
    run_us(30000);
    host_code('c');
    TEST_ASSERT_TRUE(sequence_of(DR_EVENT_QUARANTINED) < sequence_of(DR_EVENT_ALLOWED));
    TEST_ASSERT_TRUE(sequence_of(DR_EVENT_DROPPED) < sequence_of(DR_EVENT_ALLOWED));
    run_us(500);
    trio_says(40000);
    TEST_ASSERT_TRUE(sequence_of(DR_EVENT_ALLOWED) < sequence_of(DR_EVENT_REPLY));
    host_axis('x', 40800);
    run_us(1000);
    device_says("pq", 2); /* before the query has left */
    run_us(3000);
    device_says("nonsense......", 14);
    TEST_ASSERT_TRUE(sequence_of(DR_EVENT_QUARANTINED) < sequence_of(DR_EVENT_IMPLAUSIBLE));
    TEST_ASSERT_EQUAL_HEX8('p', last_record(DR_EVENT_QUARANTINED)->bytes[0]);
    armed(DR_TRIO, 0);
    line_hangs();
    host_code('c');
    device_says("?", 1); /* before the host's query has left */
    line_goes_on();
    run_us(500);
    device_at_home();
    TEST_ASSERT_TRUE(sequence_of(DR_EVENT_QUARANTINED) < sequence_of(DR_EVENT_REPLY));
    line_moves();
    for (unsigned i = 0; i < 16; i++) /* one more than is passed on */
        host_code(3);
    host_code('c');
    expect_refused(DR_REASON_BUSY);
    TEST_ASSERT_TRUE(sequence_of(DR_EVENT_DROPPED) < sequence_of(DR_EVENT_REFUSED));
}

static void nonsense_for_the_host_is_looked_into_before_anything_else_may_be_asked(void)
{
    armed(DR_TRIO, 0);
    host_code('c');
    run_us(500);
    device_says("nonsense......", 14);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_EQUAL(40000, status().position_steps[DR_X]);
    host_code('c');
    expect_refused(DR_REASON_BUSY);
    run_us(100000);
    trio_says(40100);
    TEST_ASSERT_EQUAL(40100, status().position_steps[DR_X]);
    expect_fault(DR_FAULT_NONE);
}

static void noise_is_more_than_sixteen_bytes_in_one_second(void)
{
    bench_proved_by_hand(DR_TRIO, 0);
    for (unsigned i = 0; i < 40; i++) {
        device_says("x", 1);
        run_us(600000);
    }
    expect_fault(DR_FAULT_NONE);
    TEST_ASSERT_EQUAL(40, status().quarantined_bytes);
}

static void a_jump_is_a_fault_only_where_it_matters(void)
{
    bench_proved_by_hand(DR_TRIO, 0);
    host_code('c');
    run_us(500);
    trio_says(50000);
    expect_fault(DR_FAULT_NONE); /* disarmed: a person may do what they like */
    armed(DR_TRIO, 0);
    host_code('c');
    run_us(500);
    trio_says(50000);
    expect_fault(DR_FAULT_POSITION_JUMP);
}

static void replies_are_kept_as_long_as_a_reply_can_be(void)
{
    armed(DR_TRIO, 0);
    const uint32_t before = status().forwarded;
    host_value('A', 45);
    run_us(1000);
    device_says("\r", 1);
    TEST_ASSERT_EQUAL(1, last_record(DR_EVENT_REPLY)->count);
    TEST_ASSERT_EQUAL(before + 1, status().forwarded);
    for (unsigned i = 0; i < 20; i++)
        host_code(3);
    run_us(5000);
    device_says("\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r", 20);
    TEST_ASSERT_EQUAL(14, last_record(DR_EVENT_REPLY)->count);
    TEST_ASSERT_EQUAL(DR_OP_TRIO_INTERRUPT, last_record(DR_EVENT_REPLY)->op);
}

static void streamed_bytes_are_no_cr_and_noise_is_no_stream(void)
{
    armed(DR_MPC, DR_RIG_MAY_STREAM);
    device_says("\xFF\r\r", 3); /* nothing moves: noise */
    TEST_ASSERT_EQUAL(3, status().quarantined_bytes);
    expect_silence();
    host_line(15, 84000, 80000, 80000);
    run_us(2000);
    device_at_home();
    run_us(60000);
    host_code(3);
    run_us(500);
    device_says("\xFF\xFF\xFF\r\r\r\r\r\r\r\r\r", 12);
    TEST_ASSERT_EQUAL(0, rig.guard.stop_crs);
    device_says("\r", 1);
    TEST_ASSERT_EQUAL(1, rig.guard.stop_crs);
}

static void any_number_of_crs_is_one_answer(void)
{
    line_moves();
    host_code(3);
    run_us(500);
    for (unsigned i = 0; i < 300; i++)
        device_says("\r", 1);
    TEST_ASSERT_EQUAL(255, rig.guard.stop_crs);
    run_us(100000);
    trio_says(41000);
    run_us(100000);
    trio_says(41000);
    expect_cr();
    expect_silence();
}

static void the_end_of_what_could_not_be_stopped_begins_the_proof_of_rest(void)
{
    x_moves();
    stop_input(true);
    run_us(10000);
    device_says("\r", 1);
    TEST_ASSERT_EQUAL_UINT32(1000000, rig.guard.at[DR_TIMER_PROOF] - guard_clock());
    x_moves();
    const dr_us ends = rig.guard.at[DR_TIMER_TASK];
    const uint32_t before = rig.wire_count;
    stop_input(true);
    run_us((uint64_t)(ends - guard_clock()) - 1);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count); /* ^C */
    run_us(1);                                     /* it never told its end: asked where it is */
    TEST_ASSERT_EQUAL(before + 2, rig.wire_count);
    trio_says(40800);
    run_us(100000);
    trio_says(40800);
    TEST_ASSERT_FALSE(status().buzzer);
}

/* The proof of rest had begun at the deadline, without a second in which it could fail: a fault it is already. */
static void a_cr_behind_the_deadline_begins_nothing(void)
{
    x_moves();
    stop_input(true);
    run_us((uint64_t)(rig.guard.at[DR_TIMER_TASK] - guard_clock()));
    trio_says(40200);
    device_says("\r", 1);
    run_us(100000);
    trio_says(40400);
    TEST_ASSERT_EQUAL_UINT32(500000, rig.guard.at[DR_TIMER_READ] - guard_clock());
    TEST_ASSERT_EQUAL(0, rig.guard.running >> DR_TIMER_PROOF & 1);
}

static void behind_the_cr_there_is_no_deadline(void)
{
    line_moves();
    device_says("\r", 1);
    TEST_ASSERT_EQUAL(0, rig.guard.running >> DR_TIMER_TASK & 1);
}

static void without_limits_what_the_controller_says_is_counted_only(void)
{
    bench_trio();
    dr_guard_init(&rig.guard, NULL, rig.ring, 64);
    dr_guard_start(&rig.guard, guard_clock(), DR_START_POWER_ON);
    dr_guard_link(&rig.guard, guard_clock(), true, true);
    dr_guard_push_device(&rig.guard, guard_clock(), (const uint8_t *)"0123456789abcdefghij", 20);
    TEST_ASSERT_EQUAL(20, status().quarantined_bytes);
    expect_fault(DR_FAULT_LIMITS);
    dr_us when;
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
    uint8_t bytes[4];
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_STOP, true); /* a stop passes, whatever is missing */
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_STOP_2, true);
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), bytes, 4));
    TEST_ASSERT_EQUAL_HEX8(0x03, bytes[0]);
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when)); /* and nothing follows: rest cannot be proved */
}

/* -- The host ---------------------------------------------------------------------------------------------------------------- */

static void ctrl_c_at_rest_teaches_nothing_about_the_place(void)
{
    armed(DR_TRIO, 0);
    host_code('c');
    run_us(500);
    trio_says(40000);
    host_code(3);
    run_us(500);
    device_says("\r", 1);
    TEST_ASSERT_EQUAL(40000, status().position_steps[DR_X]);
    expect_state(DR_GUARD_IDLE);
    host_code(3); /* this one stays without an answer */
    run_us(2000000);
    TEST_ASSERT_NOT_NULL(last_record(DR_EVENT_NO_REPLY));
    TEST_ASSERT_EQUAL(0, status().needs & DR_NEEDS_REST);
}

/* A TRIO's reply ends with its angle, which is 0 as often as not: no number of a drive. */
static void a_query_chooses_no_drive(void)
{
    armed(DR_TRIO, 0);
    host_code('c');
    run_us(500);
    device_at(40000, 40000, 40000, 0);
    host_axis('x', 40080);
    for (unsigned reading = 0; reading < 2; reading++) { /* another angle is news: read twice */
        run_us(4000);
        device_at_home();
    }
    run_us(6000);
    expect_state(DR_GUARD_MOVING_U);
}

static void a_query_that_nobody_pulled_in_2_s_is_taken_back(void)
{
    armed(DR_TRIO, 0);
    const uint32_t before = rig.wire_count;
    line_hangs();
    host_code('c');
    run_us(2000000);
    TEST_ASSERT_NOT_NULL(last_record(DR_EVENT_NO_REPLY));
    line_goes_on();
    run_us(1000000);
    TEST_ASSERT_EQUAL(before, rig.wire_count); /* its answer would be nobody's */
}

static void a_host_may_ask_a_controller_that_fits_both(void)
{
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_us(1000000);
    static const uint8_t both[] = {1, 0x9C, 0, 0, 0, 0x9C, 0, 0, 0, 0x9C, 0, 0, 0, 0x0D};
    device_says(both, sizeof both);
    run_us(1000);
    const uint32_t before = rig.wire_count;
    host_code('c');
    run_us(500);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
}

static void behind_a_shape_that_is_wrong_the_host_must_pause(void)
{
    bench_proved_by_hand(DR_TRIO, 0);
    host_value('A', 90);
    expect_refused(DR_REASON_ANGLE_VALUE);
    host_code('c');
    TEST_ASSERT_EQUAL(1, status().dropped_bytes);
    run_us(50000);
    const uint32_t before = rig.wire_count;
    host_code('c');
    run_us(500);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
}

static void limits_that_are_damaged_refuse_the_next_motion(void)
{
    armed(DR_TRIO, 0);
    rig.limits.margin_q ^= 1;
    host_axis('x', 40008);
    expect_refused(DR_REASON_DAMAGED);
    expect_fault(DR_FAULT_DAMAGED);
    expect_state(DR_GUARD_LOCKED);
}

static void a_stop_within_a_frame_is_part_of_the_frame_too(void)
{
    line_moves();
    host_line(3, 40000, 40000, 40000); /* speed level 3 is 0x03 */
    expect_state(DR_GUARD_STOPPING);
    expect_refused(DR_REASON_BUSY);
    TEST_ASSERT_EQUAL(1, status().refused);
    TEST_ASSERT_EQUAL(0, status().dropped_bytes);
    TEST_ASSERT_EQUAL(14, last_record(DR_EVENT_REFUSED)->count);
}

static void filler_between_frames_is_counted(void)
{
    bench_proved_by_hand(DR_TRIO, 0);
    host_bytes("\r\n\0\xF0\xFF", 5);
    TEST_ASSERT_EQUAL(5, status().dropped_bytes);
}

/* -- People -------------------------------------------------------------------------------------------------------------------- */

static void a_second_stop_forgets_nothing_of_the_first(void)
{
    line_moves();
    host_code(3);
    run_us(500);
    stop_input(true);
    device_says("\r", 1);
    run_us(100000);
    trio_says(41000);
    run_us(100000);
    trio_says(41000);
    expect_state(DR_GUARD_STOPPED);
    TEST_ASSERT_EQUAL(1, wire_stops());
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
}

static void arming_is_for_the_disarmed_and_by_a_fresh_press(void)
{
    armed(DR_TRIO, 0);
    const uint32_t before = rig.wire_count;
    press(DR_INPUT_ARM);
    run_us(10000);
    TEST_ASSERT_EQUAL(before, rig.wire_count);
    expect_state(DR_GUARD_IDLE);
    bench_proved_by_hand(DR_TRIO, 0);
    input(DR_INPUT_ARM, true);
    input(DR_INPUT_KEY, true);
    const uint32_t sent = rig.wire_count;
    input(DR_INPUT_ARM, false);
    run_us(10000);
    TEST_ASSERT_EQUAL(sent, rig.wire_count);
}

static void a_changed_tip_is_told_by_the_press(void)
{
    bench_proved_by_hand(DR_TRIO, 0);
    input(DR_INPUT_TIP_CHANGED, true);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_TIP) != 0);
    press(DR_INPUT_CONFIRM);
    TEST_ASSERT_FALSE((status().needs & DR_NEEDS_TIP) != 0);
    input(DR_INPUT_TIP_CHANGED, false); /* letting go changes no tip */
    TEST_ASSERT_FALSE((status().needs & DR_NEEDS_TIP) != 0);
    press(DR_INPUT_TIP_CHANGED);
    press(DR_INPUT_LOG_FAILED); /* only CONFIRM confirms */
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_TIP) != 0);
}

static void a_fault_that_is_cleared_is_gone(void)
{
    armed(DR_TRIO, 0);
    device_says("0123456789abcdefg", 17);
    expect_fault(DR_FAULT_DEVICE_NOISE);
    clear_fault();
    expect_fault(DR_FAULT_NONE);
    TEST_ASSERT_FALSE(status().buzzer);
}

static void the_key_silences_the_buzzer_where_nothing_can_be_proved_any_more(void)
{
    line_moves();
    host_code(3);
    run_us(4000000); /* rest not proved in 1 s; then no answer at all */
    expect_fault(DR_FAULT_DEVICE_SILENT);
    TEST_ASSERT_TRUE(status().buzzer);
    clear_fault();
    TEST_ASSERT_FALSE(status().buzzer);
    expect_state(DR_GUARD_DISARMED);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_reply_that_comes_in_the_pause_between_two_tries_proves_nothing);
    RUN_TEST(a_controller_that_is_silent_while_arming_refuses_nothing);
    RUN_TEST(the_log_keeps_to_the_order_of_the_line);
    RUN_TEST(nonsense_for_the_host_is_looked_into_before_anything_else_may_be_asked);
    RUN_TEST(noise_is_more_than_sixteen_bytes_in_one_second);
    RUN_TEST(a_jump_is_a_fault_only_where_it_matters);
    RUN_TEST(replies_are_kept_as_long_as_a_reply_can_be);
    RUN_TEST(streamed_bytes_are_no_cr_and_noise_is_no_stream);
    RUN_TEST(any_number_of_crs_is_one_answer);
    RUN_TEST(the_end_of_what_could_not_be_stopped_begins_the_proof_of_rest);
    RUN_TEST(behind_the_cr_there_is_no_deadline);
    RUN_TEST(without_limits_what_the_controller_says_is_counted_only);
    RUN_TEST(ctrl_c_at_rest_teaches_nothing_about_the_place);
    RUN_TEST(a_host_may_ask_a_controller_that_fits_both);
    RUN_TEST(behind_a_shape_that_is_wrong_the_host_must_pause);
    RUN_TEST(limits_that_are_damaged_refuse_the_next_motion);
    RUN_TEST(a_stop_within_a_frame_is_part_of_the_frame_too);
    RUN_TEST(filler_between_frames_is_counted);
    RUN_TEST(a_second_stop_forgets_nothing_of_the_first);
    RUN_TEST(arming_is_for_the_disarmed_and_by_a_fresh_press);
    RUN_TEST(a_changed_tip_is_told_by_the_press);
    RUN_TEST(a_fault_that_is_cleared_is_gone);
    RUN_TEST(a_query_chooses_no_drive);
    RUN_TEST(a_query_that_nobody_pulled_in_2_s_is_taken_back);
    RUN_TEST(a_cr_behind_the_deadline_begins_nothing);
    RUN_TEST(the_key_silences_the_buzzer_where_nothing_can_be_proved_any_more);
    return UNITY_END();
}
