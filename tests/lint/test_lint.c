/* lint: every rule with a program that breaks it and one that nearly does, in virtual time. The rules are those of the
 * manuals: [T] notes 2, 5, 12, 13; [M] table 9, notes 1 to 5, 14, 16; PROTOCOL.md where they say nothing. */
#include "bench.h"

#include "unity.h"

#include <string.h>

#define ALL UINT32_MAX

static lint l;
static bench b;

void setUp(void) { lint_open(&l); }
void tearDown(void) { lint_close(&l); }

static void start(dr_kind kind)
{
    bench_start(&b, kind, kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC, &l.base);
}

static void ask(const char *text) { bench_ask(&b, text, strlen(text)); }

static void move_to(const char *head, uint32_t x, uint32_t y, uint32_t z)
{
    uint8_t frame[DR_FRAME_MAX];
    bench_ask(&b, frame, bench_frame(frame, head, strlen(head), x, y, z));
}

static void say_move(const char *head, uint32_t x, uint32_t y, uint32_t z)
{
    uint8_t frame[DR_FRAME_MAX];
    bench_say(&b, frame, bench_frame(frame, head, strlen(head), x, y, z));
}

/* That rule, so often, and no other. */
static void found(lint_rule rule, unsigned times)
{
    for (unsigned i = 0; i < LINT_RULES; i++)
        TEST_ASSERT_EQUAL_MESSAGE(i == rule ? times : 0, l.counts[i], lint_words_of((lint_rule)i)->name);
    TEST_ASSERT_EQUAL(times, l.finding_count);
}

static void found_nothing(void)
{
    for (unsigned i = 0; i < LINT_RULES; i++)
        TEST_ASSERT_EQUAL_MESSAGE(0, l.counts[i], lint_words_of((lint_rule)i)->name);
}

/* -- 1 ----------------------------------------------------------------------------------------------------------------- */

static void a_command_during_a_move_is_early(void)
{
    start(DR_MPC);
    bench_wait_us(&b, 5000);
    say_move("M", 16000, 0, 0);
    bench_wait_us(&b, 5000);
    bench_say(&b, "H", 1);
    found(LINT_EARLY_COMMAND, 1);
    TEST_ASSERT_EQUAL_UINT64(10000, l.findings[0].when_us);
    TEST_ASSERT_EQUAL(1, l.findings[0].count);
    TEST_ASSERT_EQUAL_HEX8('H', l.findings[0].bytes[0]);
    TEST_ASSERT_EQUAL_STRING("move was not yet answered", l.findings[0].text);
}

static void two_commands_in_one_write_are_one_too_many(void)
{
    start(DR_MPC);
    ask("KC");
    found(LINT_EARLY_COMMAND, 1);
}

static void a_command_while_the_answer_is_on_the_line_is_early(void)
{
    start(DR_TRIO);
    b.ins.is_paced = true;
    instrument_start(&b.ins, 0);
    bench_wait_us(&b, 0);
    bench_say(&b, "c", 1);
    bench_wait_us(&b, 2000); /* 174 us there, 2,431 us back */
    bench_read(&b, ALL);
    bench_say(&b, "h", 1);
    found(LINT_EARLY_COMMAND, 1);
}

static void a_command_2_ms_after_the_cr_is_not_early(void)
{
    start(DR_MPC);
    say_move("M", 16000, 0, 0);
    bench_wait_us(&b, 333334); /* 1,000 um at 3,000 um/s */
    TEST_ASSERT_EQUAL(1, b.unread);
    bench_read(&b, ALL);
    bench_wait_us(&b, 2000);
    bench_say(&b, "C", 1);
    found_nothing();
}

static void an_interrupt_may_come_at_any_time(void)
{
    start(DR_MPC);
    say_move("M", 16000, 0, 0);
    bench_wait_us(&b, 1);
    bench_say(&b, "\x03", 1);
    bench_read(&b, ALL);
    ask("C");
    found_nothing();
}

static void fillers_and_waking_bytes_are_nobodys_business(void)
{
    start(DR_TRIO);
    bench_say(&b, "\xEE", 1);
    ask("c\r");
    ask("\x22"
        "c");
    found_nothing();
}

static void a_move_begun_by_hand_is_not_the_hosts_fault(void)
{
    start(DR_MPC);
    move_to("M", 16000, 0, 0);
    TEST_ASSERT_TRUE(dr_controller_apply(&b.ins.controller, (dr_us)b.ins.now_us, DR_EFFECT_HOME, 0));
    bench_wait_us(&b, 3000);
    bench_say(&b, "C", 1);
    bench_wait_us(&b, 500000);
    found_nothing();
}

/* -- 2 ----------------------------------------------------------------------------------------------------------------- */

static void less_than_2_ms_after_an_answer_is_hurried(void)
{
    start(DR_MPC);
    bench_say(&b, "K", 1);
    bench_read(&b, ALL);
    bench_wait_us(&b, 1999);
    bench_say(&b, "C", 1);
    found(LINT_HURRIED_COMMAND, 1);
    TEST_ASSERT_EQUAL_STRING("1.9 ms after the answer to active", l.findings[0].text);
}

static void exactly_2_ms_after_an_answer_is_not(void)
{
    start(DR_MPC);
    bench_say(&b, "K", 1);
    bench_read(&b, ALL);
    bench_wait_us(&b, 2000);
    bench_say(&b, "C", 1);
    found_nothing();
}

/* The controller's clock may stand or leap: the pause is the host's. */
static void the_pause_is_judged_in_real_time(void)
{
    start(DR_MPC);
    bench_say(&b, "K", 1);
    bench_read(&b, ALL);
    bench_sleep_real_us(&b, 2000);
    bench_say(&b, "C", 1);
    found_nothing();
}

/* -- 3 ----------------------------------------------------------------------------------------------------------------- */

static void an_s_in_one_burst_lacks_its_pause(void)
{
    start(DR_MPC);
    ask("F");
    bench_line(&b, 15, 16000, 0, 0, 0);
    found(LINT_NO_PAUSE_IN_S, 1);
    TEST_ASSERT_EQUAL(14, l.findings[0].count);
}

static void an_s_with_19_999_ms_of_pause_lacks_some(void)
{
    start(DR_MPC);
    ask("F");
    bench_line(&b, 15, 16000, 0, 0, 19999);
    found(LINT_NO_PAUSE_IN_S, 1);
}

static void an_s_with_20_ms_of_pause_is_taken(void)
{
    start(DR_MPC);
    ask("F");
    bench_line(&b, 15, 16000, 0, 0, 20000);
    found_nothing();
}

static void pauses_on_both_sides_of_the_speed_add_up(void)
{
    uint8_t frame[DR_FRAME_MAX];
    const size_t count = bench_frame(frame, "S\x0F", 2, 16000, 0, 0);
    start(DR_MPC);
    ask("F");
    bench_wait_us(&b, 3000);
    bench_say(&b, frame, 1);
    bench_wait_us(&b, 12000);
    bench_say(&b, frame + 1, 1);
    bench_wait_us(&b, 12000);
    bench_say(&b, frame + 2, count - 2);
    found_nothing();
}

/* An emulator that had no processor for 20 ms cannot tell two writes from one. */
static void an_emulator_that_was_late_does_not_judge_pauses(void)
{
    start(DR_MPC);
    ask("F");
    bench_wait_us(&b, 3000);
    b.late_us = 20000;
    bench_line(&b, 15, 16000, 0, 0, 0);
    found_nothing();
    b.late_us = 2000;
    bench_say(&b, "C", 1);
    found_nothing();
}

static void an_emulator_that_was_a_little_late_does(void)
{
    start(DR_MPC);
    ask("F");
    b.late_us = 19999;
    bench_line(&b, 15, 16000, 0, 0, 0);
    found(LINT_NO_PAUSE_IN_S, 1);
}

static void an_s_of_a_trio_has_no_pause(void)
{
    start(DR_TRIO);
    bench_line(&b, 15, 0, 0, 0, 0);
    found_nothing();
}

/* -- 4 and 5 ----------------------------------------------------------------------------------------------------------- */

static void one_step_beyond_the_travel_is_beyond(void)
{
    start(DR_MPC);
    move_to("M", 400001, 0, 0);
    found(LINT_BEYOND_TRAVEL, 1);
    TEST_ASSERT_EQUAL_STRING("X is 400001; it must be 0 to 400000", l.findings[0].text);
}

static void a_negative_target_is_beyond(void)
{
    start(DR_TRIO);
    move_to("H", 0, 0xFFFFFFFFu, 0);
    found(LINT_BEYOND_TRAVEL, 1);
    TEST_ASSERT_EQUAL_STRING("Y is 4294967295, that is -1; it must be 0 to 266667", l.findings[0].text);
}

static void the_ends_of_travel_are_not_beyond(void)
{
    start(DR_MPC);
    move_to("M", 400000, 400000, 400000);
    move_to("M", 0, 0, 0);
    found_nothing();
}

static void a_one_axis_move_is_judged_by_its_own_axis(void)
{
    start(DR_TRIO);
    bench_ask(&b, "y\xAC\x11\x04\x00", 5); /* 266,668 */
    found(LINT_BEYOND_TRAVEL, 1);
}

static void coordinates_most_significant_byte_first_look_swapped(void)
{
    start(DR_MPC);
    bench_ask(&b, "M\x00\x00\x3E\x80\x00\x00\x00\x00\x00\x00\x7D\x00", 13); /* 16,000, 0, 32,000 */
    found(LINT_SWAPPED_BYTES, 1);
    TEST_ASSERT_EQUAL_STRING("X is 2151546880; with its bytes swapped 16000, and the travel is 400000",
                             l.findings[0].text);
}

static void beyond_the_travel_both_ways_round_is_not_swapped(void)
{
    start(DR_MPC);
    bench_ask(&b, "M\x00\x00\x3E\x80\xFF\xFF\xFF\xFF\x00\x00\x7D\x00", 13);
    found(LINT_BEYOND_TRAVEL, 1);
}

/* -- 6 and 7 ----------------------------------------------------------------------------------------------------------- */

static void who_waits_and_gives_up_too_early_has_a_short_time_limit(void)
{
    start(DR_MPC);
    say_move("M", 160000, 0, 0); /* 3.3 s */
    bench_wait_us(&b, 1000000);
    bench_say(&b, "M", 1);
    say_move("", 0, 0, 0);
    found(LINT_SHORT_TIME_LIMIT, 1);
    TEST_ASSERT_EQUAL_STRING("1000 ms after move, whose CR had not come", l.findings[0].text);
}

static void who_gives_up_and_interrupts_has_done_right(void)
{
    start(DR_MPC);
    say_move("M", 160000, 0, 0);
    bench_wait_us(&b, 1000000);
    bench_say(&b, "\x03", 1);
    bench_read(&b, ALL);
    ask("C");
    found_nothing();
}

/* M, and ^C when its CR is already there; then one CR is read, as behind a move that ^C has stopped. */
static void stop_a_move_that_is_over(bool runs_ahead)
{
    start(DR_MPC);
    l.runs_ahead = runs_ahead ? "--clock jump" : NULL;
    say_move("M", 16000, 0, 0);
    bench_wait_us(&b, 333334);
    TEST_ASSERT_EQUAL(1, b.unread);
    bench_sleep_real_us(&b, 100000);
    bench_say(&b, "\x03", 1);
    TEST_ASSERT_EQUAL(2, b.unread);
    bench_read(&b, 1);
}

static void ask_for_one_byte_behind(const char *text)
{
    bench_wait_us(&b, 3000);
    bench_say(&b, text, strlen(text));
    bench_read(&b, b.unread - 1u);
}

static void a_stop_that_a_jumping_clock_makes_late_is_not_the_hosts_fault(void)
{
    stop_a_move_that_is_over(true);
    ask_for_one_byte_behind("C");
    ask_for_one_byte_behind("K");
    bench_tell(&b, OBSERVED_CLOSED);
    found_nothing();
    TEST_ASSERT_EQUAL(1, l.late_stops);
}

/* It reads so soon that nothing is left by the time one looks. */
static void a_late_stop_of_a_quick_host(void)
{
    start(DR_MPC);
    l.runs_ahead = "--speedup";
    say_move("M", 16000, 0, 0);
    bench_wait_us(&b, 333334);
    bench_read(&b, 1);
    b.has_read_behind = true;
    bench_say(&b, "\x03", 1);
    bench_wait_us(&b, 3000);
    bench_read(&b, 1);
    b.has_read_behind = true;
    bench_say(&b, "C", 1);
    bench_read(&b, 13);
    bench_tell(&b, OBSERVED_CLOSED);
    found_nothing();
    TEST_ASSERT_EQUAL(1, l.late_stops);
}

static void a_late_stop_excuses_until_all_is_read(void)
{
    stop_a_move_that_is_over(true);
    bench_read(&b, ALL); /* it knows of the second CR */
    ask_for_one_byte_behind("C");
    bench_wait_us(&b, 3000);
    bench_say(&b, "K", 1);
    found(LINT_THIRTEEN_BYTES, 1);
    TEST_ASSERT_EQUAL(0, l.late_stops);
}

static void a_late_stop_excuses_for_one_opening(void)
{
    stop_a_move_that_is_over(true);
    bench_tell(&b, OBSERVED_CLOSED);
    TEST_ASSERT_EQUAL(1, l.late_stops);
    bench_tell(&b, OBSERVED_OPENED);
    ask_for_one_byte_behind("C");
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_THIRTEEN_BYTES, 1);
}

static void a_late_stop_is_the_hosts_where_time_goes(void)
{
    stop_a_move_that_is_over(false);
    ask_for_one_byte_behind("C");
    found(LINT_UNREAD_REPLY, 1);
}

static void a_stop_behind_a_query_that_was_left_unread_excuses_nothing(void)
{
    start(DR_MPC);
    l.runs_ahead = "--speedup";
    bench_say(&b, "K", 1);
    bench_wait_us(&b, 3000);
    bench_say(&b, "\x03", 1);
    bench_read(&b, 1);
    ask_for_one_byte_behind("C");
    found(LINT_UNREAD_REPLY, 1);
}

static void a_cr_that_is_not_read_is_left(void)
{
    start(DR_MPC);
    say_move("M", 16000, 0, 0);
    bench_wait_us(&b, 1000000); /* its CR has come at 333 ms */
    bench_say(&b, "C", 1);
    found(LINT_UNREAD_REPLY, 1);
    TEST_ASSERT_EQUAL_STRING("1 byte was unread, the last answer was that to move", l.findings[0].text);
}

static void closing_with_an_answer_in_the_port_leaves_it(void)
{
    start(DR_MPC);
    bench_say(&b, "K", 1);
    bench_read(&b, 3);
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_UNREAD_REPLY, 1);
}

static void closing_before_the_answer_leaves_it(void)
{
    start(DR_MPC);
    say_move("M", 16000, 0, 0);
    bench_tell(&b, OBSERVED_END);
    found(LINT_UNREAD_REPLY, 1);
}

static void closing_before_an_answer_that_nobody_can_get_leaves_it(void)
{
    start(DR_MPC);
    bench_say(&b, "K", 1);
    bench_tell(&b, OBSERVED_LOST);
    bench_read(&b, ALL);
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_UNREAD_REPLY, 1);
    TEST_ASSERT_EQUAL_STRING("the port was closed before active was answered", l.findings[0].text);
}

static void closing_when_all_is_read_leaves_nothing(void)
{
    start(DR_MPC);
    ask("K");
    bench_tell(&b, OBSERVED_CLOSED);
    bench_tell(&b, OBSERVED_OPENED);
    bench_tell(&b, OBSERVED_CLOSED);
    bench_tell(&b, OBSERVED_END);
    found_nothing();
}

static void an_interrupt_may_leave_streamed_positions_unread(void)
{
    start(DR_MPC);
    ask("O");
    bench_wait_us(&b, 3000);
    bench_say(&b, "S\x0F", 2);
    bench_wait_us(&b, 30000);
    say_move("", 16000, 0, 0);
    bench_wait_us(&b, 20000);
    TEST_ASSERT_GREATER_THAN(12, b.unread);
    bench_say(&b, "\x03", 1);
    bench_read(&b, ALL);
    ask("C");
    found_nothing();
}

static void what_follows_a_fault_is_not_judged(void)
{
    start(DR_MPC);
    bench_say(&b, "K", 1);
    bench_tell(&b, OBSERVED_FAULT);
    bench_wait_us(&b, 3000);
    bench_say(&b, "C", 1);
    bench_read(&b, ALL);
    found_nothing();
}

/* The CR of the first answer comes long after the host has given up, asked again, and again, and left. */
static void what_a_fault_has_made_late_is_not_judged_until_it_comes(void)
{
    start(DR_MPC);
    say_move("M", 16000, 0, 0); /* stands for what is late: the host could know nothing of a move */
    bench_tell(&b, OBSERVED_FAULT);
    for (unsigned i = 0; i < 2; i++) {
        bench_wait_us(&b, 110000);
        bench_say(&b, "C", 1);
    }
    bench_tell(&b, OBSERVED_CLOSED);
    found_nothing();
}

static void what_comes_when_nothing_is_late_any_more_is_judged(void)
{
    start(DR_MPC);
    say_move("M", 16000, 0, 0);
    bench_tell(&b, OBSERVED_FAULT);
    bench_wait_us(&b, 110000);
    bench_say(&b, "C", 1);
    bench_wait_us(&b, 1000000);
    bench_read(&b, 14);
    bench_say(&b, "C", 1); /* excused for the last time */
    bench_wait_us(&b, 3000);
    bench_read(&b, 14);
    bench_say(&b, "K", 1);
    found(LINT_UNREAD_REPLY, 1);
}

static void a_controller_that_a_fault_has_wedged_hears_nothing(void)
{
    start(DR_MPC);
    bench_say(&b, "K", 1);
    bench_read(&b, ALL);
    b.ins.faults.is_wedged = true;
    bench_tell(&b, OBSERVED_FAULT);
    for (unsigned i = 0; i < 3; i++) {
        bench_wait_us(&b, 1000000);
        bench_say(&b, "C", 1);
    }
    bench_tell(&b, OBSERVED_CLOSED);
    found_nothing();
}

/* -- 8 and 9 ----------------------------------------------------------------------------------------------------------- */

static void a_command_of_the_other_controller_is_wrong(void)
{
    start(DR_MPC);
    move_to("W", 16000, 0, 0);
    found(LINT_WRONG_COMMAND, 1);
    TEST_ASSERT_EQUAL_STRING("'W' is work-to of the TRIO MP-245A; this is the MPC-200", l.findings[0].text);
}

static void a_command_of_another_firmware_is_wrong(void)
{
    bench_start(&b, DR_MPC, 0x0295, &l.base);
    ask("U");
    found(LINT_WRONG_COMMAND, 1);
    TEST_ASSERT_EQUAL_STRING("'U' (drives) came with firmware 3.00; this is 2.95", l.findings[0].text);
}

static void a_command_that_went_is_wrong(void)
{
    start(DR_MPC);
    ask("A");
    found(LINT_WRONG_COMMAND, 1);
    TEST_ASSERT_EQUAL_STRING("'A' (count) went after firmware 2.99; this is 3.21", l.findings[0].text);
}

static void a_command_of_this_firmware_is_right(void)
{
    bench_start(&b, DR_MPC, 0x0295, &l.base);
    ask("A");
    ask("K");
    found_nothing();
}

static void upper_case_axes_of_a_trio_are_named(void)
{
    start(DR_TRIO);
    bench_ask(&b, "Z\x00\x00\x00\x00", 5);
    bench_ask(&b, "\x5B", 1);
    found(LINT_UPPER_CASE_AXIS, 2);
    TEST_ASSERT_EQUAL_STRING("5A is 'Z' and moves Z", l.findings[0].text);
    TEST_ASSERT_EQUAL_STRING("5B is printed for 'Y' and is none of the commands", l.findings[1].text);
}

static void lower_case_axes_and_an_upper_case_c_are_right(void)
{
    start(DR_TRIO);
    bench_ask(&b, "z\x00\x00\x00\x00", 5);
    ask("C");
    found_nothing();
}

/* -- 10 to 14 ---------------------------------------------------------------------------------------------------------- */

static void angles_of_0_and_90_and_above_are_named(void)
{
    start(DR_TRIO);
    bench_ask(&b, "A\x00", 2);
    bench_ask(&b, "A\x5A", 2);
    bench_ask(&b, "A\x5B", 2);
    found(LINT_ANGLE_EXTREME, 3);
    TEST_ASSERT_EQUAL_STRING("at 0 degrees the Z axis does not move", l.findings[0].text);
    TEST_ASSERT_EQUAL_STRING("at 90 degrees the X axis does not move", l.findings[1].text);
}

static void angles_of_1_and_89_are_right(void)
{
    start(DR_TRIO);
    bench_ask(&b, "A\x01", 2);
    bench_ask(&b, "A\x59", 2);
    found_nothing();
}

static void work_needs_a_home_before_it(void)
{
    start(DR_MPC);
    b.drives[0].work_is_set = true;
    b.drives[0].work_steps[DR_X] = 16000;
    ask("H");
    move_to("M", 160, 0, 0);
    ask("Y");
    found(LINT_WORK_WITHOUT_HOME, 1);
}

static void work_right_after_home_is_right(void)
{
    start(DR_MPC);
    b.drives[0].work_is_set = true;
    b.drives[0].work_steps[DR_X] = 16000;
    ask("H");
    ask("C");
    ask("Y");
    found_nothing();
    TEST_ASSERT_EQUAL_UINT32(16000, b.drives[0].position_steps[DR_X]);
}

static void work_needs_a_work_position(void)
{
    start(DR_MPC);
    ask("H");
    ask("Y");
    found(LINT_NO_WORK_POSITION, 1);
}

static void work_of_a_trio_needs_a_work_position_too(void)
{
    start(DR_TRIO);
    ask("w");
    found(LINT_NO_WORK_POSITION, 1);
}

static void work_of_a_trio_with_a_work_position_is_right(void)
{
    start(DR_TRIO);
    b.drives[0].work_is_set = true;
    ask("w");
    found_nothing();
}

static void a_move_of_15_steps_is_small(void)
{
    start(DR_MPC);
    move_to("M", 15, 15, 15);
    found(LINT_SMALL_MOVE, 1);
    TEST_ASSERT_EQUAL_STRING("the longest way is 15 microsteps", l.findings[0].text);
}

static void a_line_to_where_it_stands_is_small(void)
{
    start(DR_MPC);
    ask("F");
    bench_line(&b, 3, 0, 0, 0, 30000);
    found(LINT_SMALL_MOVE, 1);
}

static void a_move_of_16_steps_on_one_axis_is_not_small(void)
{
    start(DR_MPC);
    move_to("M", 0, 16, 0);
    move_to("M", 0, 0, 0);
    found_nothing();
}

static void a_trio_answers_small_moves(void)
{
    start(DR_TRIO);
    move_to("H", 10667, 10667, 10668);
    found_nothing();
}

static void a_query_during_a_move_is_named(void)
{
    start(DR_MPC);
    say_move("M", 160000, 0, 0);
    bench_wait_us(&b, 1000000); /* long enough for a time limit, too; but programs that show progress ask like this */
    bench_say(&b, "C", 1);
    found(LINT_QUERY_IN_MOVE, 1);
    TEST_ASSERT_EQUAL_STRING("during move", l.findings[0].text);
}

static void an_s_without_f_or_o_assumes_streaming_once(void)
{
    start(DR_MPC);
    bench_line(&b, 15, 1600, 0, 0, 30000);
    bench_line(&b, 15, 0, 0, 0, 30000);
    found(LINT_STREAMING_ASSUMED, 1);
}

static void f_or_o_is_good_for_one_opening(void)
{
    start(DR_MPC);
    ask("F");
    bench_line(&b, 15, 1600, 0, 0, 30000);
    found_nothing();
    bench_tell(&b, OBSERVED_CLOSED);
    bench_tell(&b, OBSERVED_OPENED);
    bench_line(&b, 15, 0, 0, 0, 30000);
    found(LINT_STREAMING_ASSUMED, 1);
}

/* -- 15 to 19 ---------------------------------------------------------------------------------------------------------- */

static void another_baud_rate_is_wrong(void)
{
    start(DR_TRIO);
    bench_tty(&b, 9600);
    found(LINT_WRONG_BAUD, 1);
    TEST_ASSERT_EQUAL_STRING("9600 baud; the TRIO MP-245A has 57600", l.findings[0].text);
}

static void the_controllers_baud_rates_are_right(void)
{
    start(DR_TRIO);
    bench_tty(&b, 57600);
    found_nothing();
    lint_close(&l);
    lint_open(&l);
    start(DR_MPC);
    bench_tty(&b, 128000);
    bench_tty(&b, 125000);
    found_nothing();
}

static void a_program_that_reads_13_bytes_of_14_is_named(void)
{
    start(DR_MPC);
    bench_say(&b, "C", 1);
    bench_read(&b, 13);
    bench_wait_us(&b, 3000);
    bench_say(&b, "K", 1);
    found(LINT_THIRTEEN_BYTES, 1);
}

/* The host asks, so quick that by the time one looks it has read what it had left of older answers, and reads so many bytes in
 * all. Returns how many it leaves. */
static uint32_t ask_quickly(const char *code, uint32_t left, uint32_t count)
{
    bench_wait_us(&b, 3000);
    bench_read(&b, ALL);
    b.has_read_behind = left > 0;
    bench_say(&b, code, 1);
    left += b.unread - count;
    bench_read(&b, b.unread - left);
    return left;
}

static void a_program_that_reads_13_bytes_again_and_again_is_named_each_time(void)
{
    start(DR_MPC);
    for (unsigned i = 0; i < 4; i++) {
        bench_wait_us(&b, 3000);
        bench_say(&b, "C", 1);
        bench_read(&b, 13);
    }
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_THIRTEEN_BYTES, 4);
    TEST_ASSERT_EQUAL_STRING("1 byte of the position was still unread", l.findings[0].text);
    TEST_ASSERT_EQUAL_STRING("3 bytes were unread, 1 of each position", l.findings[2].text);
    TEST_ASSERT_EQUAL_STRING("the port was closed with 4 bytes unread, 1 of each position", l.findings[3].text);
}

static void a_quick_program_that_reads_13_bytes_is_named_when_it_leaves(void)
{
    uint32_t left = 0;
    start(DR_MPC);
    for (unsigned i = 0; i < 4; i++)
        left = ask_quickly("C", left, 13);
    found(LINT_UNREAD_REPLY, 3); /* nobody knows how much it was */
    TEST_ASSERT_EQUAL(4, b.unread);
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_THIRTEEN_BYTES, 4);
}

static void a_quick_program_that_reads_13_bytes_is_named_when_it_is_slow_once(void)
{
    uint32_t left = 0;
    start(DR_MPC);
    for (unsigned i = 0; i < 3; i++) {
        left = ask_quickly("C", left, 13);
        left = ask_quickly("K", left, 4);
        left = ask_quickly("U", left, 6);
    }
    TEST_ASSERT_EQUAL(3, left);
    bench_wait_us(&b, 3000);
    bench_say(&b, "K", 1);
    found(LINT_THIRTEEN_BYTES, 9);
    TEST_ASSERT_EQUAL_STRING("3 bytes were unread, 1 of each position", l.findings[8].text);
}

static void a_quick_program_that_leaves_something_else_is_not_said_to_read_13_bytes(void)
{
    uint32_t left = 0;
    start(DR_MPC);
    for (unsigned i = 0; i < 3; i++)
        left = ask_quickly("C", left, 12);
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_UNREAD_REPLY, 3);
}

static void a_cr_that_a_quick_program_leaves_is_none_of_a_position(void)
{
    uint32_t left;
    start(DR_MPC);
    left = ask_quickly("F", 0, 0);
    left = ask_quickly("C", left, 14);
    left = ask_quickly("K", left, 4);
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_UNREAD_REPLY, 3);
    TEST_ASSERT_EQUAL(1, left);
}

static void a_cr_that_is_left_before_a_position_is_none_of_it(void)
{
    start(DR_MPC);
    bench_say(&b, "F", 1);
    bench_wait_us(&b, 3000);
    bench_say(&b, "C", 1);
    bench_read(&b, 14);
    bench_wait_us(&b, 3000);
    bench_say(&b, "K", 1);
    found(LINT_UNREAD_REPLY, 2);
}

static void who_clears_the_buffer_leaves_nothing_to_be_counted(void)
{
    uint32_t left;
    start(DR_MPC);
    left = ask_quickly("C", 0, 13);
    left = ask_quickly("C", left, 13);
    bench_read(&b, ALL);
    ask_quickly("C", 0, 13);
    bench_tell(&b, OBSERVED_CLOSED);
    TEST_ASSERT_EQUAL(2, left);
    TEST_ASSERT_EQUAL(1, l.counts[LINT_UNREAD_REPLY]);
    TEST_ASSERT_EQUAL(1, l.counts[LINT_THIRTEEN_BYTES]);
    TEST_ASSERT_EQUAL(LINT_UNREAD_REPLY, l.findings[0].rule);
}

/* What is left behind ^C is of the move, and so is what is left behind the position. */
static void a_byte_that_is_left_behind_a_stop_is_none_of_a_position(void)
{
    stop_a_move_that_is_over(false);
    bench_read(&b, ALL);
    b.has_read_behind = true;
    bench_wait_us(&b, 3000);
    bench_say(&b, "C", 1);
    bench_read(&b, 13);
    bench_tell(&b, OBSERVED_CLOSED);
    TEST_ASSERT_EQUAL(0, l.counts[LINT_THIRTEEN_BYTES]);
    TEST_ASSERT_EQUAL(2, l.counts[LINT_UNREAD_REPLY]);
}

/* Byte 13 has left 174 + 2,257 us after the question, byte 14 leaves at 174 + 2,431 us [T table 3]. */
static void a_program_that_goes_on_when_the_13th_byte_is_there_is_named(void)
{
    start(DR_TRIO);
    b.ins.is_paced = true;
    instrument_start(&b.ins, 0);
    bench_wait_us(&b, 0);
    bench_say(&b, "c", 1);
    bench_wait_us(&b, 174 + 2257);
    TEST_ASSERT_EQUAL(13, b.unread);
    bench_read(&b, ALL);
    bench_say(&b, "h", 1);
    found(LINT_THIRTEEN_BYTES, 1);
}

/* It has 1 byte of the first answer and 12 of the second, and two are on the line when it leaves. */
static void a_program_that_leaves_while_the_rest_is_on_the_line_is_named(void)
{
    start(DR_TRIO);
    b.ins.is_paced = true;
    instrument_start(&b.ins, 0);
    bench_say(&b, "c", 1);
    bench_wait_us(&b, 10000);
    bench_read(&b, 13);
    bench_say(&b, "c", 1);
    bench_wait_us(&b, 174 + 2084);
    TEST_ASSERT_EQUAL(1 + 12, b.unread);
    bench_read(&b, 13);
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_THIRTEEN_BYTES, 2);
    TEST_ASSERT_EQUAL_STRING("the port was closed with 2 bytes unread, 1 of each position", l.findings[1].text);
}

static void a_program_that_goes_on_when_the_12th_byte_is_there_is_early(void)
{
    start(DR_TRIO);
    b.ins.is_paced = true;
    instrument_start(&b.ins, 0);
    bench_wait_us(&b, 0);
    bench_say(&b, "c", 1);
    bench_wait_us(&b, 174 + 2084);
    TEST_ASSERT_EQUAL(12, b.unread);
    bench_read(&b, ALL);
    bench_say(&b, "h", 1);
    found(LINT_EARLY_COMMAND, 1);
}

static void a_program_that_reads_12_bytes_of_14_leaves_2_unread(void)
{
    start(DR_TRIO);
    bench_say(&b, "c", 1);
    bench_read(&b, 12);
    bench_wait_us(&b, 3000);
    bench_say(&b, "h", 1);
    found(LINT_UNREAD_REPLY, 1);
}

/* So quick that nothing is unread any more when its command is taken in. */
static void a_program_that_reads_the_rest_behind_its_next_command_is_named(void)
{
    start(DR_MPC);
    ask("C");
    bench_wait_us(&b, 3000);
    b.has_read_behind = true;
    bench_say(&b, "K", 1);
    bench_read(&b, ALL);
    found(LINT_UNREAD_REPLY, 1);
    TEST_ASSERT_EQUAL_STRING("the last of the answer to position was read behind this", l.findings[0].text);
    ask("K");
    found(LINT_UNREAD_REPLY, 1);
}

static void the_rest_that_is_read_within_the_next_command_is_named(void)
{
    uint8_t frame[DR_FRAME_MAX];
    start(DR_MPC);
    ask("F");
    const size_t count = bench_frame(frame, "S\x0F", 2, 1600, 0, 0);
    bench_wait_us(&b, 3000);
    bench_say(&b, frame, 2);
    bench_wait_us(&b, 30000);
    b.has_read_behind = true;
    bench_say(&b, frame + 2, count - 2);
    found(LINT_UNREAD_REPLY, 1);
}

static void a_program_that_ends_with_a_byte_of_the_position_unread_is_named(void)
{
    start(DR_TRIO);
    bench_say(&b, "c", 1);
    bench_read(&b, 13);
    bench_tell(&b, OBSERVED_CLOSED);
    found(LINT_THIRTEEN_BYTES, 1);
}

static void a_speed_of_16_is_too_high(void)
{
    start(DR_TRIO);
    bench_line(&b, 16, 0, 0, 0, 0);
    found(LINT_SPEED_TOO_HIGH, 1);
}

static void a_speed_of_15_is_not(void)
{
    start(DR_TRIO);
    bench_line(&b, 15, 0, 0, 0, 0);
    found_nothing();
}

static void digits_are_no_drives_and_10_is_no_mode(void)
{
    start(DR_MPC);
    bench_ask(&b, "I1", 2);
    bench_ask(&b, "L\x0B", 2);
    found(LINT_VALUE_OUT_OF_RANGE, 2);
}

/* Who asks for drive 3 may want to know whether there is one. */
static void asking_for_a_drive_that_is_not_there_is_right(void)
{
    start(DR_MPC);
    bench_ask(&b, "I\x03", 2);
    bench_ask(&b, "L\x09", 2);
    found_nothing();
}

/* -- Both sides of every rule -------------------------------------------------------------------------------------------- */

static void an_s_behind_an_o_assumes_nothing(void)
{
    start(DR_MPC);
    ask("O");
    bench_line(&b, 15, 1600, 0, 0, 30000);
    found_nothing();
}

/* A rule that is new must come with its two programs. */
static void every_rule_has_a_program_that_breaks_it_and_one_that_nearly_does(void)
{
    static void (*const programs[LINT_RULES][2])(void) = {
        [LINT_EARLY_COMMAND] = {a_command_during_a_move_is_early, a_command_2_ms_after_the_cr_is_not_early},
        [LINT_HURRIED_COMMAND] = {less_than_2_ms_after_an_answer_is_hurried, exactly_2_ms_after_an_answer_is_not},
        [LINT_NO_PAUSE_IN_S] = {an_s_with_19_999_ms_of_pause_lacks_some, an_s_with_20_ms_of_pause_is_taken},
        [LINT_BEYOND_TRAVEL] = {one_step_beyond_the_travel_is_beyond, the_ends_of_travel_are_not_beyond},
        [LINT_SWAPPED_BYTES] = {coordinates_most_significant_byte_first_look_swapped,
                                beyond_the_travel_both_ways_round_is_not_swapped},
        [LINT_SHORT_TIME_LIMIT] = {who_waits_and_gives_up_too_early_has_a_short_time_limit,
                                   who_gives_up_and_interrupts_has_done_right},
        [LINT_UNREAD_REPLY] = {a_cr_that_is_not_read_is_left, closing_when_all_is_read_leaves_nothing},
        [LINT_WRONG_COMMAND] = {a_command_of_another_firmware_is_wrong, a_command_of_this_firmware_is_right},
        [LINT_UPPER_CASE_AXIS] = {upper_case_axes_of_a_trio_are_named, lower_case_axes_and_an_upper_case_c_are_right},
        [LINT_ANGLE_EXTREME] = {angles_of_0_and_90_and_above_are_named, angles_of_1_and_89_are_right},
        [LINT_WORK_WITHOUT_HOME] = {work_needs_a_home_before_it, work_right_after_home_is_right},
        [LINT_SMALL_MOVE] = {a_move_of_15_steps_is_small, a_move_of_16_steps_on_one_axis_is_not_small},
        [LINT_QUERY_IN_MOVE] = {a_query_during_a_move_is_named, a_command_2_ms_after_the_cr_is_not_early},
        [LINT_STREAMING_ASSUMED] = {an_s_without_f_or_o_assumes_streaming_once, an_s_behind_an_o_assumes_nothing},
        [LINT_WRONG_BAUD] = {another_baud_rate_is_wrong, the_controllers_baud_rates_are_right},
        [LINT_THIRTEEN_BYTES] = {a_program_that_reads_13_bytes_of_14_is_named,
                                 a_program_that_reads_12_bytes_of_14_leaves_2_unread},
        [LINT_NO_WORK_POSITION] = {work_of_a_trio_needs_a_work_position_too,
                                   work_of_a_trio_with_a_work_position_is_right},
        [LINT_SPEED_TOO_HIGH] = {a_speed_of_16_is_too_high, a_speed_of_15_is_not},
        [LINT_VALUE_OUT_OF_RANGE] = {digits_are_no_drives_and_10_is_no_mode,
                                     asking_for_a_drive_that_is_not_there_is_right}};
    for (unsigned rule = 0; rule < LINT_RULES; rule++)
        for (unsigned nearly = 0; nearly < 2; nearly++) {
            const char *const name = lint_words_of((lint_rule)rule)->name;
            TEST_ASSERT_NOT_NULL_MESSAGE(programs[rule][nearly], name);
            tearDown();
            setUp();
            programs[rule][nearly]();
            TEST_ASSERT_EQUAL_MESSAGE(nearly == 0, l.counts[rule] > 0, name);
        }
}

/* -- Findings ---------------------------------------------------------------------------------------------------------- */

static void findings_beyond_the_bound_are_counted(void)
{
    start(DR_TRIO);
    for (unsigned i = 0; i < LINT_FINDINGS_MAX + 5000u; i++)
        bench_ask(&b, "A\x00", 2);
    TEST_ASSERT_EQUAL(LINT_FINDINGS_MAX + 5000u, lint_total(&l));
    TEST_ASSERT_EQUAL(LINT_FINDINGS_MAX, l.finding_count);
}

static void a_dark_controller_judges_nobody(void)
{
    start(DR_MPC);
    const dr_hand off = {.what = DR_HAND_POWER_OFF};
    dr_controller_poke(&b.ins.controller, (dr_us)b.ins.now_us, &off);
    bench_ask(&b, "CC", 2);
    bench_tell(&b, OBSERVED_CLOSED);
    found_nothing();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_command_during_a_move_is_early);
    RUN_TEST(two_commands_in_one_write_are_one_too_many);
    RUN_TEST(a_command_while_the_answer_is_on_the_line_is_early);
    RUN_TEST(a_command_2_ms_after_the_cr_is_not_early);
    RUN_TEST(an_interrupt_may_come_at_any_time);
    RUN_TEST(fillers_and_waking_bytes_are_nobodys_business);
    RUN_TEST(a_move_begun_by_hand_is_not_the_hosts_fault);
    RUN_TEST(less_than_2_ms_after_an_answer_is_hurried);
    RUN_TEST(exactly_2_ms_after_an_answer_is_not);
    RUN_TEST(the_pause_is_judged_in_real_time);
    RUN_TEST(an_s_in_one_burst_lacks_its_pause);
    RUN_TEST(an_s_with_19_999_ms_of_pause_lacks_some);
    RUN_TEST(an_s_with_20_ms_of_pause_is_taken);
    RUN_TEST(pauses_on_both_sides_of_the_speed_add_up);
    RUN_TEST(an_emulator_that_was_late_does_not_judge_pauses);
    RUN_TEST(an_emulator_that_was_a_little_late_does);
    RUN_TEST(an_s_of_a_trio_has_no_pause);
    RUN_TEST(one_step_beyond_the_travel_is_beyond);
    RUN_TEST(a_negative_target_is_beyond);
    RUN_TEST(the_ends_of_travel_are_not_beyond);
    RUN_TEST(a_one_axis_move_is_judged_by_its_own_axis);
    RUN_TEST(coordinates_most_significant_byte_first_look_swapped);
    RUN_TEST(beyond_the_travel_both_ways_round_is_not_swapped);
    RUN_TEST(who_waits_and_gives_up_too_early_has_a_short_time_limit);
    RUN_TEST(who_gives_up_and_interrupts_has_done_right);
    RUN_TEST(a_stop_that_a_jumping_clock_makes_late_is_not_the_hosts_fault);
    RUN_TEST(a_late_stop_of_a_quick_host);
    RUN_TEST(a_late_stop_excuses_until_all_is_read);
    RUN_TEST(a_late_stop_excuses_for_one_opening);
    RUN_TEST(a_late_stop_is_the_hosts_where_time_goes);
    RUN_TEST(a_stop_behind_a_query_that_was_left_unread_excuses_nothing);
    RUN_TEST(a_cr_that_is_not_read_is_left);
    RUN_TEST(closing_with_an_answer_in_the_port_leaves_it);
    RUN_TEST(closing_before_the_answer_leaves_it);
    RUN_TEST(closing_before_an_answer_that_nobody_can_get_leaves_it);
    RUN_TEST(closing_when_all_is_read_leaves_nothing);
    RUN_TEST(an_interrupt_may_leave_streamed_positions_unread);
    RUN_TEST(what_follows_a_fault_is_not_judged);
    RUN_TEST(what_a_fault_has_made_late_is_not_judged_until_it_comes);
    RUN_TEST(what_comes_when_nothing_is_late_any_more_is_judged);
    RUN_TEST(a_controller_that_a_fault_has_wedged_hears_nothing);
    RUN_TEST(a_command_of_the_other_controller_is_wrong);
    RUN_TEST(a_command_of_another_firmware_is_wrong);
    RUN_TEST(a_command_that_went_is_wrong);
    RUN_TEST(a_command_of_this_firmware_is_right);
    RUN_TEST(upper_case_axes_of_a_trio_are_named);
    RUN_TEST(lower_case_axes_and_an_upper_case_c_are_right);
    RUN_TEST(angles_of_0_and_90_and_above_are_named);
    RUN_TEST(angles_of_1_and_89_are_right);
    RUN_TEST(work_needs_a_home_before_it);
    RUN_TEST(work_right_after_home_is_right);
    RUN_TEST(work_needs_a_work_position);
    RUN_TEST(work_of_a_trio_needs_a_work_position_too);
    RUN_TEST(work_of_a_trio_with_a_work_position_is_right);
    RUN_TEST(a_move_of_15_steps_is_small);
    RUN_TEST(a_line_to_where_it_stands_is_small);
    RUN_TEST(a_move_of_16_steps_on_one_axis_is_not_small);
    RUN_TEST(a_trio_answers_small_moves);
    RUN_TEST(a_query_during_a_move_is_named);
    RUN_TEST(an_s_without_f_or_o_assumes_streaming_once);
    RUN_TEST(f_or_o_is_good_for_one_opening);
    RUN_TEST(another_baud_rate_is_wrong);
    RUN_TEST(the_controllers_baud_rates_are_right);
    RUN_TEST(a_program_that_reads_13_bytes_of_14_is_named);
    RUN_TEST(a_byte_that_is_left_behind_a_stop_is_none_of_a_position);
    RUN_TEST(a_program_that_leaves_while_the_rest_is_on_the_line_is_named);
    RUN_TEST(a_program_that_reads_13_bytes_again_and_again_is_named_each_time);
    RUN_TEST(a_quick_program_that_reads_13_bytes_is_named_when_it_leaves);
    RUN_TEST(a_quick_program_that_reads_13_bytes_is_named_when_it_is_slow_once);
    RUN_TEST(a_quick_program_that_leaves_something_else_is_not_said_to_read_13_bytes);
    RUN_TEST(a_cr_that_a_quick_program_leaves_is_none_of_a_position);
    RUN_TEST(a_cr_that_is_left_before_a_position_is_none_of_it);
    RUN_TEST(who_clears_the_buffer_leaves_nothing_to_be_counted);
    RUN_TEST(a_program_that_goes_on_when_the_13th_byte_is_there_is_named);
    RUN_TEST(a_program_that_goes_on_when_the_12th_byte_is_there_is_early);
    RUN_TEST(a_program_that_reads_12_bytes_of_14_leaves_2_unread);
    RUN_TEST(a_program_that_reads_the_rest_behind_its_next_command_is_named);
    RUN_TEST(the_rest_that_is_read_within_the_next_command_is_named);
    RUN_TEST(a_program_that_ends_with_a_byte_of_the_position_unread_is_named);
    RUN_TEST(a_speed_of_16_is_too_high);
    RUN_TEST(a_speed_of_15_is_not);
    RUN_TEST(digits_are_no_drives_and_10_is_no_mode);
    RUN_TEST(asking_for_a_drive_that_is_not_there_is_right);
    RUN_TEST(an_s_behind_an_o_assumes_nothing);
    RUN_TEST(every_rule_has_a_program_that_breaks_it_and_one_that_nearly_does);
    RUN_TEST(findings_beyond_the_bound_are_counted);
    RUN_TEST(a_dark_controller_judges_nobody);
    return UNITY_END();
}
