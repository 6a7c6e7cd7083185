/* The TRIO ROE, from [T] page 1, tables 1 and 2, and PROTOCOL.md, "Hand controls". An MP-845 has microsteps of 0.09375 um;
 * everything but 'S' runs at 5,000 um/s: 53,333 1/3 microsteps a second. 1,000 um are 10,667 microsteps and 200,007 us. */
#include "bench.h"

#include <math.h>

#define MP845_UM 0.09375
#define MP285_UM 0.125
#define START 10667u
#define LEG 200007u

static const double pi = 3.14159265358979323846;

/* -- HOME and WORK --------------------------------------------------------------------------------------------------- */

static void home_goes_home_without_a_cr(void)
{
    bench_begin(DR_TRIO);
    bench_press(DR_BUTTON_HOME);
    bench_wait(100 * MS);
    bench_expect_at(START, START, START); /* a press acts on release */
    TEST_ASSERT_FALSE(bench_moves());
    bench_release(DR_BUTTON_HOME);
    TEST_ASSERT_EQUAL(DR_OP_TRIO_HOME, bench_look().moving);
    bench_wait(LEG); /* 30 degrees: Z has precedence over X, Y is last [T page 1] */
    bench_expect_at(START, START, 0);
    bench_wait(LEG);
    bench_expect_at(0, START, 0);
    bench_wait(LEG - 1);
    TEST_ASSERT_TRUE(bench_moves());
    bench_wait(1);
    TEST_ASSERT_FALSE(bench_moves());
    bench_expect_nothing();
    bench_expect_answer_at(0, 0, 0); /* a hand move while the host is idle changes the next answer */
}

static void work_needs_a_stored_position_and_goes_in_work_order(void)
{
    bench_begin(DR_TRIO);
    bench_tap(DR_BUTTON_WORK);
    TEST_ASSERT_FALSE(bench_moves());
    bench_expect_note(DR_NOTE_NO_WORK); /* whoever reads the trace sees why */
    bench_hold(DR_BUTTON_WORK, 3 * S);
    bench_place(0, 0, 0);
    bench_tap(DR_BUTTON_WORK);
    bench_wait(LEG); /* Y first, then Z, then X [T page 1] */
    bench_expect_at(0, START, 0);
    bench_wait(LEG);
    bench_expect_at(0, START, START);
    bench_wait(LEG);
    bench_expect_at(START, START, START);
    TEST_ASSERT_FALSE(bench_moves());
    bench_expect_nothing();
}

/* Where a move from `from` to 0 on each axis is after so long: Z, X, Y in turn. */
static void path_home(uint32_t from, uint32_t leg_us, uint32_t elapsed_us, uint32_t steps[3])
{
    static const unsigned order[3] = {2, 0, 1};
    for (unsigned leg = 0; leg < 3; leg++) {
        const uint64_t begins = (uint64_t)leg * leg_us;
        const uint64_t in_leg = elapsed_us < begins ? 0 : elapsed_us - begins > leg_us ? leg_us : elapsed_us - begins;
        steps[order[leg]] = from - (uint32_t)(from * in_leg / leg_us);
    }
}

static void a_pause_at_any_microsecond_loses_and_gains_no_step(void)
{
    enum { FROM = 16, LEG_US = 300 }; /* 16 steps of 6/64 um at 320,000/64 um/s */
    for (uint32_t paused_at = 0; paused_at < 3 * LEG_US; paused_at++) {
        const uint32_t resumed_at = paused_at * 7 % 911 + 1; /* the pause, then as long as one likes */
        uint32_t at[3];
        bench_begin(DR_TRIO);
        bench_place(FROM, FROM, FROM);
        bench_press(DR_BUTTON_HOME);
        bench_release(DR_BUTTON_HOME);
        bench_wait(paused_at);
        bench_press(DR_BUTTON_HOME);
        bench_release(DR_BUTTON_HOME);
        TEST_ASSERT_TRUE(bench_look().is_paused);
        path_home(FROM, LEG_US, paused_at, at);
        bench_expect_at(at[0], at[1], at[2]);
        bench_wait(resumed_at);
        bench_expect_at(at[0], at[1], at[2]);
        bench_press(DR_BUTTON_HOME);
        bench_release(DR_BUTTON_HOME);
        TEST_ASSERT_FALSE(bench_look().is_paused);
        for (uint32_t more = paused_at; more <= 3 * LEG_US; more += 97) {
            path_home(FROM, LEG_US, more, at);
            bench_expect_at(at[0], at[1], at[2]);
            if (more + 97 <= 3 * LEG_US)
                bench_wait(97);
        }
        bench_wait_until_idle();
        bench_expect_at(0, 0, 0);
        TEST_ASSERT_EQUAL_UINT32(3 * LEG_US + resumed_at, bench_us());
    }
}

static void pauses_of_a_move_add_up(void)
{
    bench_begin(DR_TRIO);
    bench_press(DR_BUTTON_HOME);
    bench_release(DR_BUTTON_HOME);
    for (unsigned i = 0; i < 20; i++) {
        bench_wait(10 * MS + i);
        bench_tap(DR_BUTTON_HOME); /* pauses 1 ms later */
        bench_wait(999 * MS);
        bench_tap(DR_BUTTON_HOME);
    }
    bench_wait_until_idle();
    TEST_ASSERT_EQUAL_UINT32(3 * LEG + 20 * S, bench_us());
    bench_expect_at(0, 0, 0);
}

static void a_pause_may_outlast_the_clock(void)
{
    dr_us when;
    bench_begin(DR_TRIO);
    bench_host("h", 1);
    bench_wait(50 * MS);
    bench_tap(DR_BUTTON_HOME);
    for (unsigned i = 0; i < 5; i++) {
        TEST_ASSERT_FALSE(dr_panel_due(&b.p, &when)); /* nothing to wake up for */
        TEST_ASSERT_FALSE(dr_controller_due(&b.c, &when));
        bench_wait(1800 * S); /* 2.5 hours in all; the clock wraps after 1.2 */
    }
    bench_expect_nothing();
    bench_tap(DR_BUTTON_HOME);
    bench_wait(3 * LEG - 51 * MS - 1);
    bench_expect_nothing();
    bench_wait(1);
    bench_expect_bytes("\r", 1);
    bench_expect_at(0, 0, 0);
}

static void home_pauses_a_hosts_h_whose_cr_comes_when_it_ends(void)
{
    bench_begin(DR_TRIO);
    bench_host("h", 1);
    bench_wait(99 * MS);
    bench_tap(DR_BUTTON_HOME);
    bench_wait(10 * S);
    bench_host("\x03", 1); /* paused is still moving: ^C does not stop h, and a query waits */
    bench_host("C", 1);
    bench_expect_nothing();
    TEST_ASSERT_EQUAL(DR_OP_TRIO_HOME, bench_look().moving);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    TEST_ASSERT_EQUAL_size_t(15, b.count);
    TEST_ASSERT_EQUAL_HEX8(0x0D, b.got[0]);
    TEST_ASSERT_EQUAL_UINT32(3 * LEG + 10 * S + MS, b.got_at[0]); /* and the 1 ms of the second tap */
}

static void work_pauses_a_hosts_w(void)
{
    bench_begin(DR_TRIO);
    b.drives[0].work_is_set = true;
    bench_host("w", 1);
    bench_wait(50 * MS);
    bench_tap(DR_BUTTON_HOME); /* not its own move */
    TEST_ASSERT_FALSE(bench_look().is_paused);
    bench_tap(DR_BUTTON_WORK);
    TEST_ASSERT_TRUE(bench_look().is_paused);
    bench_tap(DR_BUTTON_HOME);
    TEST_ASSERT_TRUE(bench_look().is_paused);
    bench_wait(S);
    bench_tap(DR_BUTTON_WORK);
    bench_wait_until_idle();
    bench_expect_bytes("\r", 1);
    bench_expect_at(0, 0, 0);
}

static void home_and_work_leave_other_moves_alone(void)
{
    static const char *const moves[] = {"x", "y", "z", "H", "W", "S", "R"};
    for (size_t i = 0; i < sizeof moves / sizeof moves[0]; i++) {
        const char m = moves[i][0];
        bench_begin(DR_TRIO);
        if (m == 'x' || m == 'y' || m == 'z')
            bench_host((const char[5]){m, 0, 0, 0, 0}, 5);
        else if (m == 'R')
            bench_host("R", 1);
        else
            bench_host_point(m, m == 'S' ? 15 : -1, 0, 0, 0);
        bench_wait(MS);
        const uint8_t op = bench_look().moving;
        TEST_ASSERT_NOT_EQUAL(DR_OP_NONE, op);
        const dr_controller before = b.c;
        bench_tap(DR_BUTTON_HOME);
        bench_tap(DR_BUTTON_WORK);
        TEST_ASSERT_EQUAL(op, bench_look().moving);
        TEST_ASSERT_FALSE(bench_look().is_paused);
        TEST_ASSERT_EQUAL_UINT32(before.leg_began, b.c.leg_began);
        bench_wait_until_idle();
        bench_expect_bytes("\r", 1);
    }
}

static void host_commands_during_a_hand_move_wait_for_its_end(void)
{
    bench_begin(DR_TRIO);
    bench_press(DR_BUTTON_HOME);
    bench_release(DR_BUTTON_HOME);
    bench_wait(100 * MS);
    bench_host("C", 1);
    bench_expect_nothing();
    bench_wait_until_idle();
    TEST_ASSERT_EQUAL_size_t(14, b.count); /* no CR of the hand move, then the answer, of 0,0,0 */
    TEST_ASSERT_EACH_EQUAL_HEX8(0, b.got, 12);
    TEST_ASSERT_EQUAL_UINT32(3 * LEG, b.got_at[0]);
}

static void a_command_that_waits_starts_when_the_hand_move_ends_whoever_comes_then(void)
{
    bench_begin(DR_TRIO);
    bench_press(DR_BUTTON_HOME);
    bench_release(DR_BUTTON_HOME);
    bench_wait(100 * MS);
    bench_host("x\xAB\x29\x00\x00", 5);      /* 10,667 */
    b.clock += 3 * LEG - 100 * MS + LEG / 2; /* nobody comes when it ends */
    bench_expect_at(5333, 0, 0);
    b.clock += LEG - LEG / 2 - 1;
    bench_wait(0);
    bench_expect_nothing();
    bench_wait(1);
    bench_expect_bytes("\r", 1);
}

/* -- Holds ------------------------------------------------------------------------------------------------------------ */

static void a_hold_acts_at_3_s_to_the_microsecond(void)
{
    bench_begin(DR_TRIO);
    bench_press(DR_BUTTON_HOME);
    bench_wait(3 * S - 1);
    TEST_ASSERT_EQUAL(0, bench_beeps());
    TEST_ASSERT_EQUAL_UINT32(0, b.c.home_steps[DR_X]);
    bench_wait(1);
    TEST_ASSERT_EQUAL(1, bench_beeps());
    TEST_ASSERT_EQUAL_UINT32(START, b.c.home_steps[DR_X]);
    bench_release(DR_BUTTON_HOME); /* the hold was all */
    TEST_ASSERT_FALSE(bench_moves());
}

static void a_press_just_short_of_3_s_is_a_press(void)
{
    bench_begin(DR_TRIO);
    bench_hold(DR_BUTTON_HOME, 3 * S - 1);
    TEST_ASSERT_TRUE(bench_moves());
    TEST_ASSERT_EQUAL(0, bench_beeps());
    bench_begin(DR_TRIO);
    bench_hold(DR_BUTTON_HOME, 3 * S);
    TEST_ASSERT_FALSE(bench_moves());
    TEST_ASSERT_EQUAL(1, bench_beeps());
}

static void home_held_stores_home(void)
{
    bench_begin(DR_TRIO);
    bench_place(1, 2, 3);
    bench_hold(DR_BUTTON_HOME, 4 * S);
    bench_place(500, 500, 500);
    bench_host("h", 1);
    bench_wait_until_idle();
    bench_expect_bytes("\r", 1);
    bench_expect_at(1, 2, 3);
    TEST_ASSERT_EQUAL(1, bench_beeps());
}

static void work_held_stores_work(void)
{
    bench_begin(DR_TRIO);
    bench_place(1, 2, 3);
    bench_hold(DR_BUTTON_WORK, 4 * S);
    bench_place(500, 500, 500);
    bench_host("w", 1);
    bench_wait_until_idle();
    bench_expect_bytes("\r", 1);
    bench_expect_at(1, 2, 3);
    TEST_ASSERT_EQUAL(1, bench_beeps());
}

static void several_buttons_are_held_each_for_itself(void)
{
    bench_begin(DR_TRIO);
    bench_press(DR_BUTTON_HOME);
    bench_wait(S);
    bench_press(DR_BUTTON_WORK);
    bench_press(DR_BUTTON_HOME); /* it is down already */
    bench_wait(2 * S);
    TEST_ASSERT_EQUAL(1, bench_beeps());
    TEST_ASSERT_FALSE(b.drives[0].work_is_set);
    bench_release(DR_BUTTON_HOME);
    bench_release(DR_BUTTON_HOME); /* it is up already */
    bench_wait(S);
    TEST_ASSERT_EQUAL(2, bench_beeps());
    TEST_ASSERT_TRUE(b.drives[0].work_is_set);
}

static void holds_and_settings_are_dead_during_moves(void)
{
    static const dr_button buttons[] = {DR_BUTTON_HOME, DR_BUTTON_WORK, DR_BUTTON_PULSE, DR_BUTTON_RELATIVE,
                                        DR_BUTTON_SPEED};
    bench_begin(DR_TRIO);
    b.drives[0].position_steps[DR_X] = 266667;
    bench_host_point('S', 0, 0, 0, 0); /* 80 s */
    for (size_t i = 0; i < 5; i++) {
        bench_hold(buttons[i], 3 * S);
        bench_tap(buttons[i]);
    }
    const dr_look look = bench_look();
    TEST_ASSERT_EQUAL(DR_OP_TRIO_LINE, look.moving);
    TEST_ASSERT_FALSE(look.is_locked || look.is_relative || look.is_setting_angle);
    TEST_ASSERT_EQUAL(0, look.speed);
    TEST_ASSERT_EQUAL(0, look.beeps);
    TEST_ASSERT_EQUAL_UINT32(0, b.c.home_steps[DR_X]);
    TEST_ASSERT_FALSE(b.drives[0].work_is_set);
}

static void a_hold_that_becomes_long_enough_at_the_end_of_a_move_acts(void)
{
    bench_begin(DR_TRIO);
    bench_press(DR_BUTTON_WORK);
    bench_wait(3 * S - 3 * LEG);
    bench_host("h", 1);
    bench_wait(3 * LEG);
    TEST_ASSERT_TRUE(b.drives[0].work_is_set);
    TEST_ASSERT_EQUAL_UINT32(0, b.drives[0].work_steps[DR_Y]);
}

/* -- PULSE and ANGLE --------------------------------------------------------------------------------------------------- */

static void the_table_of_angles_is_sine_and_cosine(void)
{
    for (unsigned deg = 0; deg <= 90; deg++) {
        const dr_diagonal along = dr_angle_get((uint8_t)deg);
        TEST_ASSERT_EQUAL_UINT16(floor(32768.0 * sin(deg * pi / 180.0) + 0.5), along.sin);
        TEST_ASSERT_EQUAL_UINT16(floor(32768.0 * cos(deg * pi / 180.0) + 0.5), along.cos);
    }
    TEST_ASSERT_EQUAL_UINT16(32768, dr_angle_get(255).sin); /* beyond the range: the last */
}

static void pulse_advances_2_85_um_along_the_diagonal(void)
{
    static const struct {
        dr_stage_id stage;
        double um;
    } stages[] = {{DR_STAGE_TRIO_MP845, MP845_UM},
                  {DR_STAGE_TRIO_MP865, MP845_UM},
                  {DR_STAGE_TRIO_MP285, MP285_UM},
                  {DR_STAGE_TRIO_MP265, MP285_UM}};
    for (size_t i = 0; i < 4; i++)
        for (unsigned deg = 0; deg <= 90; deg++) {
            bench_set_up(DR_TRIO);
            b.drives[0].stage = (uint8_t)stages[i].stage;
            b.c.angle_deg = (uint8_t)deg;
            bench_start();
            bench_place(1000, 1000, 1000);
            bench_tap(DR_BUTTON_PULSE);
            const double x = 2.85 * cos(deg * pi / 180.0) / stages[i].um,
                         z = 2.85 * sin(deg * pi / 180.0) / stages[i].um;
            bench_expect_at(1000 + (uint32_t)floor(x + 0.5), 1000, 1000 + (uint32_t)floor(z + 0.5));
            bench_expect_nothing();
        }
}

static void pulse_at_30_degrees(void)
{
    bench_begin(DR_TRIO);
    for (unsigned i = 1; i <= 100; i++) {
        bench_tap(DR_BUTTON_PULSE);
        bench_expect_at(START + 26 * i, START, START + 15 * i); /* [P] */
    }
    b.drives[0].stage = DR_STAGE_TRIO_MP285;
    bench_place(0, 0, 0);
    bench_tap(DR_BUTTON_PULSE);
    bench_expect_at(20, 0, 11);
}

static void a_pulse_needs_room_on_both_axes(void)
{
    bench_begin(DR_TRIO);
    bench_place(266667 - 26, 7, 266667 - 15);
    bench_tap(DR_BUTTON_PULSE);
    bench_expect_at(266667, 7, 266667);
    bench_place(266667 - 25, 7, 0);
    bench_tap(DR_BUTTON_PULSE);
    bench_expect_at(266667 - 25, 7, 0);
    bench_place(0, 7, 266667 - 14);
    bench_tap(DR_BUTTON_PULSE);
    bench_expect_at(0, 7, 266667 - 14);
}

static void pulse_held_lets_knob_d_set_the_angle_for_10_s(void)
{
    bench_begin(DR_TRIO);
    bench_press(DR_BUTTON_PULSE);
    bench_wait(3 * S - 1);
    TEST_ASSERT_FALSE(bench_look().is_setting_angle);
    bench_wait(1);
    TEST_ASSERT_TRUE(bench_look().is_setting_angle);
    TEST_ASSERT_EQUAL(1, bench_beeps());
    bench_release(DR_BUTTON_PULSE);
    bench_turn(DR_KNOB_D, 15);
    TEST_ASSERT_EQUAL(45, bench_look().angle);
    bench_expect_at(START, START, START);
    bench_turn(DR_KNOB_X, 1); /* the other knobs stay what they are */
    bench_expect_at(START + 64, START, START);
    bench_wait(10 * S - 1);
    bench_turn(DR_KNOB_D, -1);
    TEST_ASSERT_EQUAL(44, bench_look().angle);
    bench_wait(1);
    TEST_ASSERT_FALSE(bench_look().is_setting_angle);
    bench_turn(DR_KNOB_D, 1);
    TEST_ASSERT_EQUAL(44, bench_look().angle);
    bench_expect_at(START + 64 + 46, START, START + 44); /* 64 cos 44, 64 sin 44 */
}

static void knob_d_sets_1_to_89_degrees(void)
{
    bench_begin(DR_TRIO);
    bench_hold(DR_BUTTON_PULSE, 3 * S);
    bench_turn(DR_KNOB_D, -30000);
    TEST_ASSERT_EQUAL(1, bench_look().angle);
    bench_turn(DR_KNOB_D, -1);
    TEST_ASSERT_EQUAL(1, bench_look().angle);
    bench_turn(DR_KNOB_D, 30000);
    TEST_ASSERT_EQUAL(89, bench_look().angle);
    bench_host("A\x5A", 2); /* the host may say 90 */
    TEST_ASSERT_EQUAL(90, bench_look().angle);
    bench_turn(DR_KNOB_D, 1);
    TEST_ASSERT_EQUAL(89, bench_look().angle);
    bench_expect_at(START, START, START);
}

static void an_angle_set_by_hand_orders_the_hosts_next_move(void)
{
    bench_begin(DR_TRIO);
    bench_hold(DR_BUTTON_PULSE, 3 * S);
    bench_turn(DR_KNOB_D, 30);
    bench_host("C", 1);
    TEST_ASSERT_EQUAL(60, b.got[12]);
    b.count = 0;
    bench_host("h", 1);
    bench_wait(LEG); /* above 45 degrees X has precedence [T page 1] */
    bench_expect_at(0, START, START);
}

/* -- RELATIVE --------------------------------------------------------------------------------------------------------- */

static void relative_toggles_what_the_screen_counts_from(void)
{
    bench_begin(DR_TRIO);
    TEST_ASSERT_EQUAL(DR_SCREEN_GREEN, bench_look().screen);
    bench_hold(DR_BUTTON_RELATIVE, 3 * S); /* sets the origin, no more [T page 1] */
    TEST_ASSERT_EQUAL(1, bench_beeps());
    TEST_ASSERT_EQUAL(DR_SCREEN_GREEN, bench_look().screen);
    TEST_ASSERT_EQUAL_INT32(64002, bench_look().quanta[DR_X]); /* 10,667 x 6 */
    bench_tap(DR_BUTTON_RELATIVE);
    TEST_ASSERT_EQUAL(DR_SCREEN_BLUE, bench_look().screen);
    bench_turn(DR_KNOB_X, -2);
    bench_turn(DR_KNOB_Y, 1);
    const dr_look look = bench_look();
    TEST_ASSERT_TRUE(look.is_relative && look.has_along);
    TEST_ASSERT_EQUAL_INT32(-768, look.quanta[DR_X]); /* -128 steps of 6/64 um: -12 um */
    TEST_ASSERT_EQUAL_INT32(384, look.quanta[DR_Y]);
    TEST_ASSERT_EQUAL_INT32(0, look.quanta[DR_Z]);
    TEST_ASSERT_EQUAL_INT32(-665, look.along_quanta);       /* -768 cos 30 */
    bench_expect_answer_at(START - 128, START + 64, START); /* the wire stays absolute */
    bench_tap(DR_BUTTON_RELATIVE);
    TEST_ASSERT_EQUAL(DR_SCREEN_GREEN, bench_look().screen);
    TEST_ASSERT_EQUAL_INT32((10667 - 128) * 6, bench_look().quanta[DR_X]);
    TEST_ASSERT_EQUAL_INT32(floor(((10667 - 128) * 6 * 28378.0 + 64002 * 16384.0) / 32768), bench_look().along_quanta);
}

/* -- SPEED and LOCK ---------------------------------------------------------------------------------------------------- */

static void speed_cycles_through_four_knob_steps(void)
{
    static const uint32_t steps[] = {64, 16, 4, 1};
    bench_begin(DR_TRIO);
    for (unsigned i = 0; i < 8; i++) {
        bench_place(1000, 1000, 1000);
        TEST_ASSERT_EQUAL(i % 4, bench_look().speed);
        bench_turn(DR_KNOB_Y, 3);
        bench_expect_at(1000, 1000 + 3 * steps[i % 4], 1000);
        bench_tap(DR_BUTTON_SPEED);
    }
    bench_tap(DR_BUTTON_SPEED);
    bench_place(START, START, START);
    bench_host("h", 1); /* and never changes the host's moves */
    bench_wait(3 * LEG);
    bench_expect_bytes("\r", 1);
}

static void lock_disables_the_knobs_only(void)
{
    bench_begin(DR_TRIO);
    bench_hold(DR_BUTTON_SPEED, 3 * S);
    TEST_ASSERT_TRUE(bench_look().is_locked);
    TEST_ASSERT_EQUAL(DR_SCREEN_RED, bench_look().screen);
    TEST_ASSERT_EQUAL(1, bench_beeps());
    TEST_ASSERT_EQUAL(0, bench_look().speed);
    for (dr_knob knob = DR_KNOB_X; knob <= DR_KNOB_D; knob++)
        bench_turn(knob, 10);
    bench_expect_at(START, START, START);
    bench_tap(DR_BUTTON_PULSE);
    bench_expect_at(START + 26, START, START + 15);
    bench_host_point('H', -1, 0, 0, 0); /* host moves run */
    bench_wait_until_idle();
    bench_expect_bytes("\r", 1);
    bench_expect_at(0, 0, 0);
    TEST_ASSERT_EQUAL(DR_SCREEN_RED, bench_look().screen);
    bench_hold(DR_BUTTON_PULSE, 3 * S);
    bench_turn(DR_KNOB_D, 5); /* knob D is a knob */
    TEST_ASSERT_EQUAL(30, bench_look().angle);
    bench_hold(DR_BUTTON_SPEED, 3 * S);
    TEST_ASSERT_FALSE(bench_look().is_locked);
    bench_turn(DR_KNOB_X, 1);
    bench_expect_at(64, 0, 0);
}

/* -- Knobs ------------------------------------------------------------------------------------------------------------ */

static void knobs_move_their_axis_and_stop_at_its_ends(void)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        uint32_t at[3] = {START, START, START};
        bench_begin(DR_TRIO);
        bench_turn((dr_knob)axis, 2);
        at[axis] += 128;
        bench_expect_at(at[0], at[1], at[2]);
        bench_turn((dr_knob)axis, -1);
        at[axis] -= 64;
        bench_expect_at(at[0], at[1], at[2]);
        bench_turn((dr_knob)axis, -32768);
        at[axis] = 0;
        bench_expect_at(at[0], at[1], at[2]);
        bench_turn((dr_knob)axis, 32767);
        at[axis] = 266667;
        bench_expect_at(at[0], at[1], at[2]);
        bench_turn((dr_knob)axis, 0);
        bench_expect_answer_at(at[0], at[1], at[2]);
    }
}

static void knobs_are_dead_during_moves(void)
{
    bench_begin(DR_TRIO);
    bench_host("h", 1);
    bench_wait(10 * MS);
    for (dr_knob knob = DR_KNOB_X; knob <= DR_KNOB_D; knob++)
        bench_turn(knob, 100);
    bench_tap(DR_BUTTON_HOME);
    for (dr_knob knob = DR_KNOB_X; knob <= DR_KNOB_D; knob++)
        bench_turn(knob, 100);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    bench_expect_at(0, 0, 0);
}

static void knob_d_goes_along_the_angle_however_it_is_cut(void)
{
    for (unsigned deg = 1; deg < 90; deg++) {
        const dr_diagonal along = dr_angle_get((uint8_t)deg);
        bench_set_up(DR_TRIO);
        b.c.angle_deg = (uint8_t)deg;
        bench_start();
        bench_tap(DR_BUTTON_SPEED);
        bench_tap(DR_BUTTON_SPEED);
        bench_tap(DR_BUTTON_SPEED); /* one microstep a detent */
        for (unsigned i = 1; i <= 1000; i++) {
            bench_turn(DR_KNOB_D, 1);
            bench_expect_at(START + (i * along.cos + 16384u) / 32768u, START,
                            START + (i * along.sin + 16384u) / 32768u);
        }
        bench_turn(DR_KNOB_D, -1400);
        bench_turn(DR_KNOB_D, 150);
        bench_turn(DR_KNOB_D, 250);
        bench_expect_at(START, START, START); /* turned back is back */
    }
}

static void knob_d_at_30_degrees_moves_x_more(void)
{
    bench_begin(DR_TRIO);
    bench_turn(DR_KNOB_D, 10); /* 640 steps */
    bench_expect_at(START + 554, START, START + 320);
    TEST_ASSERT_EQUAL_INT32(floor(((10667 + 554) * 6 * 28378.0 + (10667 + 320) * 6 * 16384.0) / 32768),
                            bench_look().along_quanta);
}

static void at_0_degrees_z_and_at_90_x_stands_still(void)
{
    bench_begin(DR_TRIO);
    bench_host("A\x00", 2);
    bench_turn(DR_KNOB_D, 10);
    bench_expect_at(START + 640, START, START);
    bench_tap(DR_BUTTON_PULSE);
    bench_expect_at(START + 640 + 30, START, START); /* 2.85 um / 0.09375 um = 30.4 */
    bench_host("A\x5A", 2);
    bench_turn(DR_KNOB_D, -10);
    bench_expect_at(START + 670, START, START - 640);
    bench_turn(DR_KNOB_D, -1000);
    bench_expect_at(START + 670, START, 0);
}

static void knob_d_stops_where_an_axis_meets_its_end(void)
{
    bench_begin(DR_TRIO);
    bench_place(266667 - 866, 5, 1000); /* 1,000 steps along 30 degrees: X 866.03, Z 500.00 */
    bench_turn(DR_KNOB_D, 1000);
    bench_expect_at(266667, 5, 1500);
    bench_turn(DR_KNOB_D, 1);
    bench_expect_at(266667, 5, 1500);
    for (unsigned i = 0; i < 3; i++) /* the same, step by step */
        bench_tap(DR_BUTTON_SPEED);
    bench_place(300, 5, 10);
    bench_turn(DR_KNOB_D, -1000);
    uint32_t bulk[3];
    dr_controller_position(&b.c, 0, b.clock, bulk);
    TEST_ASSERT_EQUAL_UINT32(0, bulk[DR_Z]);
    TEST_ASSERT_UINT32_WITHIN(1, 300 - 18, bulk[DR_X]); /* 10.5 / tan 30 */
    bench_begin(DR_TRIO);
    bench_place(266667 - 866, 5, 1000);
    for (unsigned i = 0; i < 3; i++)
        bench_tap(DR_BUTTON_SPEED);
    for (unsigned i = 0; i < 1100; i++)
        bench_turn(DR_KNOB_D, 1);
    bench_expect_at(266667, 5, 1500);
}

/* Chosen: faster than 50, 100, 200 detents a second doubles the step once, twice, three times. */
static void non_linear_knobs_go_farther_when_turned_fast(void)
{
    static const struct {
        dr_us apart;
        uint32_t steps;
    } turns[] = {{100 * MS, 64}, {20000, 64}, {19999, 128}, {10000, 128},
                 {9999, 256},    {5000, 256}, {4999, 512},  {1, 512}};
    bench_begin(DR_TRIO);
    bench_turn(DR_KNOB_X, 1);
    bench_wait(MS);
    bench_turn(DR_KNOB_X, 1); /* linear, as it comes from the factory */
    bench_expect_at(START + 128, START, START);
    bench_switch(DR_SWITCHES_INTERNAL, 0, 4, true);
    bench_wait(MS);
    bench_turn(DR_KNOB_X, 1); /* not before the next power-up */
    bench_expect_at(START + 192, START, START);
    bench_power_cycle();
    bench_wait_until_idle();
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++) {
        bench_place(1000, 1000, 1000);
        bench_wait(S);
        bench_turn(DR_KNOB_X, 1);
        bench_expect_at(1064, 1000, 1000);
        bench_wait(turns[i].apart);
        bench_turn(DR_KNOB_X, 1);
        bench_expect_at(1064 + turns[i].steps, 1000, 1000);
        bench_turn(DR_KNOB_Y, 1); /* each knob for itself */
        bench_expect_at(1064 + turns[i].steps, 1064, 1000);
    }
    bench_place(1000, 1000, 1000);
    bench_wait(S);
    bench_turn(DR_KNOB_X, 1);
    bench_wait(30 * MS);
    bench_turn(DR_KNOB_X, 4); /* 7.5 ms each */
    bench_expect_at(1064 + 4 * 256, 1000, 1000);
    bench_wait(4294 * S); /* a wrap of the clock, nearly: long ago, not just now */
    bench_turn(DR_KNOB_X, 1);
    bench_expect_at(1064 + 4 * 256 + 64, 1000, 1000);
}

/* -- Switches and power ----------------------------------------------------------------------------------------------- */

static void switches_1_to_4_turn_the_knobs_round_at_power_up(void)
{
    for (uint8_t number = 1; number <= 4; number++) {
        const dr_knob knob = (dr_knob)(number - 1);
        bench_begin(DR_TRIO);
        b.c.angle_deg = 45;
        bench_switch(DR_SWITCHES_REAR, 0, 6, false); /* keeps the position */
        bench_switch(DR_SWITCHES_REAR, 0, number, true);
        bench_turn(knob, 10);
        uint32_t to[3] = {START, START, START};
        if (knob == DR_KNOB_D)
            to[DR_X] = to[DR_Z] = START + 453; /* 640 cos 45 = 452.5, rounded up */
        else
            to[knob] = START + 640;
        bench_expect_at(to[0], to[1], to[2]);
        bench_power_cycle();
        bench_place(START, START, START);
        bench_turn(knob, -10);
        bench_expect_at(to[0], to[1], to[2]);
        for (dr_knob other = DR_KNOB_X; other <= DR_KNOB_Z; other++)
            if (other != knob) {
                bench_place(START, START, START);
                bench_turn(other, 1);
                uint32_t at[3] = {START, START, START};
                at[other] += 64;
                bench_expect_at(at[0], at[1], at[2]);
            }
    }
}

static void switch_5_off_locks_y_out_of_homing(void)
{
    bench_begin(DR_TRIO);
    TEST_ASSERT_TRUE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_REAR, 0, 5)); /* factory: disabled [T table 1] */
    bench_switch(DR_SWITCHES_REAR, 0, 6, false);
    bench_switch(DR_SWITCHES_REAR, 0, 5, false);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    bench_expect_at(0, 0, 0); /* not before the next power-up */
    bench_power_cycle();
    bench_place(START, START, START);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    bench_expect_at(0, START, 0);
    bench_place(START, START, START);
    bench_host("h", 1);
    bench_wait_until_idle();
    bench_expect_at(0, START, 0);
    bench_expect_bytes("\r", 1);
}

static void switch_6_calibrates_at_power_up(void)
{
    bench_begin(DR_TRIO);
    TEST_ASSERT_TRUE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_REAR, 0, 6)); /* factory [T table 1] */
    bench_place(5, 6, 7);
    bench_power_cycle();
    TEST_ASSERT_EQUAL(DR_OP_TRIO_RECALIBRATE, bench_look().moving);
    bench_tap(DR_BUTTON_HOME); /* dead during moves */
    bench_wait_until_idle();
    bench_expect_at(START, START, START);
    bench_switch(DR_SWITCHES_REAR, 0, 6, false);
    bench_place(5, 6, 7);
    bench_power_cycle();
    TEST_ASSERT_FALSE(bench_moves());
    bench_expect_at(5, 6, 7);
    bench_expect_nothing();
}

static void internal_switch_2_follows_the_stage(void)
{
    bench_begin(DR_TRIO);
    TEST_ASSERT_FALSE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_INTERNAL, 0, 2));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_INTERNAL, 0, 2, true));
    bench_switch(DR_SWITCHES_INTERNAL, 0, 2, false);
    b.drives[0].stage = DR_STAGE_TRIO_MP285;
    TEST_ASSERT_TRUE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_INTERNAL, 0, 2));
    bench_switch(DR_SWITCHES_INTERNAL, 0, 2, true);
    b.drives[0].stage = DR_STAGE_TRIO_MP265;
    TEST_ASSERT_TRUE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_INTERNAL, 0, 2));
    b.drives[0].stage = DR_STAGE_NONE;
    TEST_ASSERT_FALSE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_INTERNAL, 0, 2));
}

static void reserved_switches_are_state_only(void)
{
    bench_begin(DR_TRIO);
    for (uint8_t number = 1; number <= 3; number = (uint8_t)(number + 2)) {
        TEST_ASSERT_FALSE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_INTERNAL, 0, number));
        bench_switch(DR_SWITCHES_INTERNAL, 0, number, true);
        bench_switch(DR_SWITCHES_INTERNAL, 0, number, false);
    }
}

static void switches_begin_where_the_settings_say(void)
{
    bench_set_up(DR_TRIO);
    b.drives[0].y_moves_home = false;
    b.c.calibrates_at_power_on = false;
    bench_start();
    for (uint8_t number = 1; number <= 6; number++)
        TEST_ASSERT_FALSE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_REAR, 0, number));
}

static void what_the_panel_keeps_over_power_off(void)
{
    bench_begin(DR_TRIO);
    bench_switch(DR_SWITCHES_REAR, 0, 6, false);
    bench_place(7, 8, 9);
    bench_hold(DR_BUTTON_HOME, 3 * S);
    bench_hold(DR_BUTTON_WORK, 3 * S);
    bench_hold(DR_BUTTON_RELATIVE, 3 * S);
    bench_tap(DR_BUTTON_RELATIVE);
    bench_tap(DR_BUTTON_SPEED);
    bench_hold(DR_BUTTON_SPEED, 3 * S);
    bench_hold(DR_BUTTON_PULSE, 3 * S);
    dr_panel_power(&b.p, b.clock, false);
    dr_panel_power(&b.p, b.clock, false);
    TEST_ASSERT_EQUAL(DR_SCREEN_DARK, bench_look().screen);
    dr_panel_power(&b.p, b.clock, true);
    dr_panel_power(&b.p, b.clock, true);
    const dr_look look = bench_look();
    TEST_ASSERT_EQUAL(DR_SCREEN_GREEN, look.screen);
    TEST_ASSERT_FALSE(look.is_locked || look.is_relative || look.is_setting_angle);
    TEST_ASSERT_EQUAL(0, look.speed);
    TEST_ASSERT_EQUAL(30, look.angle);
    TEST_ASSERT_EQUAL_UINT32(8, b.c.home_steps[DR_Y]); /* [P]: home, work and angle are kept */
    TEST_ASSERT_EQUAL_UINT32(9, b.drives[0].work_steps[DR_Z]);
    bench_tap(DR_BUTTON_RELATIVE);
    TEST_ASSERT_EQUAL_INT32(7 * 6, bench_look().quanta[DR_X]); /* the relative origin is not (chosen) */
}

static void a_press_across_power_does_nothing(void)
{
    bench_begin(DR_TRIO);
    bench_switch(DR_SWITCHES_REAR, 0, 6, false);
    bench_press(DR_BUTTON_HOME);
    bench_power_cycle();
    bench_wait(4 * S);
    bench_release(DR_BUTTON_HOME);
    dr_panel_power(&b.p, b.clock, false);
    bench_press(DR_BUTTON_WORK);
    bench_turn(DR_KNOB_X, 5);
    dr_panel_power(&b.p, b.clock, true);
    bench_wait(4 * S);
    bench_release(DR_BUTTON_WORK);
    TEST_ASSERT_FALSE(bench_moves());
    TEST_ASSERT_EQUAL(0, bench_beeps());
    bench_expect_at(START, START, START);
    bench_tap(DR_BUTTON_HOME); /* and afterwards it does */
    TEST_ASSERT_TRUE(bench_moves());
}

static void the_panel_sleeps_during_the_boot_second(void)
{
    bench_set_up(DR_TRIO);
    b.c.quirks = DR_QUIRK_BOOT_SECOND;
    bench_start();
    bench_power_cycle();
    TEST_ASSERT_EQUAL(DR_SCREEN_DARK, bench_look().screen);
    bench_press(DR_BUTTON_HOME);
    bench_turn(DR_KNOB_X, 5);
    bench_wait(S);
    TEST_ASSERT_EQUAL(DR_SCREEN_RED, bench_look().screen);
    bench_wait_until_idle();
    bench_wait(4 * S);
    bench_release(DR_BUTTON_HOME);
    TEST_ASSERT_EQUAL(0, bench_beeps());
    bench_expect_at(START, START, START);
}

static void power_off_ends_a_pause(void)
{
    bench_begin(DR_TRIO);
    bench_switch(DR_SWITCHES_REAR, 0, 6, false);
    bench_host("h", 1);
    bench_wait(99 * MS);
    bench_tap(DR_BUTTON_HOME);
    bench_wait(S);
    bench_power_cycle();
    bench_expect_at(START, START, START - 5333); /* 100 ms at 53,333 1/3 steps/s */
    bench_expect_nothing();
}

/* -- What does not happen --------------------------------------------------------------------------------------------- */

static void nothing_works_without_a_stage(void)
{
    bench_begin(DR_TRIO);
    TEST_ASSERT_TRUE(dr_controller_poke(&b.c, b.clock, &(dr_hand){.what = DR_HAND_CONNECT, .stage = DR_STAGE_NONE}));
    for (dr_button button = DR_BUTTON_HOME; button <= DR_BUTTON_SPEED; button++) {
        bench_tap(button);
        bench_hold(button, 3 * S);
    }
    for (dr_knob knob = DR_KNOB_X; knob <= DR_KNOB_D; knob++)
        bench_turn(knob, 3);
    const dr_look look = bench_look();
    TEST_ASSERT_EQUAL(0, look.drive);
    TEST_ASSERT_EQUAL(0, look.beeps);
    TEST_ASSERT_FALSE(look.is_locked || look.is_relative);
}

static void unplugging_ends_a_hand_move_and_a_pause(void)
{
    bench_begin(DR_TRIO);
    bench_tap(DR_BUTTON_HOME);
    bench_wait(50 * MS);
    bench_tap(DR_BUTTON_HOME);
    TEST_ASSERT_TRUE(dr_controller_poke(&b.c, b.clock, &(dr_hand){.what = DR_HAND_CONNECT, .stage = DR_STAGE_NONE}));
    TEST_ASSERT_TRUE(
        dr_controller_poke(&b.c, b.clock, &(dr_hand){.what = DR_HAND_CONNECT, .stage = DR_STAGE_TRIO_MP845}));
    TEST_ASSERT_FALSE(bench_moves());                   /* no host waits for a CR, so nothing is stranded */
    bench_expect_answer_at(START, START, START - 2719); /* floor(10,667 x 51,000 / 200,007) */
}

static void a_wedged_controller_has_dead_controls(void)
{
    bench_set_up(DR_TRIO);
    b.c.quirks = DR_QUIRK_QUERY_WEDGES;
    bench_start();
    bench_host("h", 1);
    bench_wait(50 * MS);
    bench_tap(DR_BUTTON_HOME);
    bench_host("c", 1); /* during a move, paused or not */
    TEST_ASSERT_EQUAL(DR_STATE_WEDGED, b.c.state);
    bench_tap(DR_BUTTON_HOME);
    bench_tap(DR_BUTTON_WORK);
    bench_hold(DR_BUTTON_SPEED, 3 * S);
    bench_turn(DR_KNOB_X, 1);
    bench_expect_at(START, START, START - 2719);
    TEST_ASSERT_FALSE(bench_look().is_locked);
    bench_expect_nothing();
}

static void a_trio_has_its_own_controls_only(void)
{
    bench_begin(DR_TRIO);
    for (dr_button button = DR_BUTTON_STOP; button <= DR_BUTTONS; button++) {
        TEST_ASSERT_FALSE(dr_panel_press(&b.p, b.clock, button));
        TEST_ASSERT_FALSE(dr_panel_release(&b.p, b.clock, button));
    }
    for (dr_knob knob = DR_KNOB_MANIPULATOR; knob <= DR_KNOBS; knob++)
        TEST_ASSERT_FALSE(dr_panel_turn(&b.p, b.clock, knob, 1));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_REAR, 0, 0, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_REAR, 0, 7, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_REAR, 1, 1, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_INTERNAL, 0, 5, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_ROE, 0, 1, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_RIGHT, 0, 1, true));
    TEST_ASSERT_FALSE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_ROE, 0, 1));
}

static void effects_of_the_other_controller_are_refused(void)
{
    bench_begin(DR_TRIO);
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_CALIBRATE, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_SELECT, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_MODE, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_ANGLE, 91));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_PAUSE, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_RESUME, 0));
    TEST_ASSERT_TRUE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_HOME, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_STOP, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_HOME, 0));
}

/* -- The screen ------------------------------------------------------------------------------------------------------- */

static void the_screen_is_red_while_it_moves(void)
{
    bench_begin(DR_TRIO);
    TEST_ASSERT_EQUAL(DR_SCREEN_GREEN, bench_look().screen);
    bench_tap(DR_BUTTON_RELATIVE);
    TEST_ASSERT_EQUAL(DR_SCREEN_BLUE, bench_look().screen);
    bench_host("h", 1);
    TEST_ASSERT_EQUAL(DR_SCREEN_RED, bench_look().screen);
    bench_wait(50 * MS);
    bench_tap(DR_BUTTON_HOME);
    TEST_ASSERT_EQUAL(DR_SCREEN_RED, bench_look().screen);
    TEST_ASSERT_EQUAL_INT32((10667 - 2719) * 6, bench_look().quanta[DR_Z]); /* where it is at 51 ms */
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    TEST_ASSERT_EQUAL(DR_SCREEN_BLUE, bench_look().screen);
    TEST_ASSERT_EQUAL(1, bench_look().drive);
}

static void a_move_that_never_answers_keeps_the_screen_red(void)
{
    bench_set_up(DR_TRIO);
    b.c.quirks = DR_QUIRK_ENDLESS_NEGATIVE;
    bench_start();
    bench_host("x\xFF\xFF\xFF\xFF", 5);
    bench_wait_until_idle();
    TEST_ASSERT_EQUAL(DR_STATE_STRANDED, b.c.state);
    TEST_ASSERT_EQUAL(DR_SCREEN_RED, bench_look().screen);
}

/* -- Time ------------------------------------------------------------------------------------------------------------- */

static void who_comes_late_finds_the_same(void)
{
    for (dr_us late = 0; late < 20 * S; late += 777777) {
        dr_look look[2];
        uint32_t at[2][3];
        for (unsigned i = 0; i < 2; i++) { /* at every due instant, then only at the end */
            bench_begin(DR_TRIO);
            bench_turn(DR_KNOB_X, 1);
            bench_host_point('H', -1, 0, 0, 0);
            bench_press(DR_BUTTON_WORK);
            bench_press(DR_BUTTON_PULSE);
            if (i == 0)
                bench_wait(late);
            else
                b.clock += late;
            look[i] = bench_look();
            for (unsigned axis = 0; axis < 3; axis++)
                at[i][axis] = b.drives[0].work_steps[axis];
        }
        TEST_ASSERT_EQUAL(late >= 3 * S && late < 13 * S, look[0].is_setting_angle);
        TEST_ASSERT_EQUAL(look[0].is_setting_angle, look[1].is_setting_angle);
        TEST_ASSERT_EQUAL(look[0].beeps, look[1].beeps);
        TEST_ASSERT_EQUAL_INT32_ARRAY(look[0].quanta, look[1].quanta, 3);
        TEST_ASSERT_EQUAL_UINT32_ARRAY(at[0], at[1], 3);
    }
}

static void every_effect_leaves_a_note(void)
{
    dr_note note;
    bench_begin(DR_TRIO);
    while (dr_notes_take(&b.notes, &note)) {}
    bench_tap(DR_BUTTON_HOME);
    TEST_ASSERT_TRUE(dr_notes_take(&b.notes, &note));
    TEST_ASSERT_EQUAL(DR_NOTE_HAND, note.what);
    TEST_ASSERT_EQUAL(DR_EFFECT_HOME, note.value);
    TEST_ASSERT_EQUAL_UINT32(b.clock, note.when);
    TEST_ASSERT_TRUE(dr_notes_take(&b.notes, &note));
    TEST_ASSERT_EQUAL(DR_NOTE_LEG, note.what);
    bench_wait_until_idle();
    bench_hold(DR_BUTTON_PULSE, 3 * S);
    while (dr_notes_take(&b.notes, &note)) {}
    bench_turn(DR_KNOB_D, 5);
    TEST_ASSERT_TRUE(dr_notes_take(&b.notes, &note));
    TEST_ASSERT_EQUAL(DR_EFFECT_ANGLE, note.value);
    TEST_ASSERT_EQUAL(35, note.bytes[0]);
    bench_turn(DR_KNOB_X, 5);
    TEST_ASSERT_TRUE(dr_notes_take(&b.notes, &note));
    TEST_ASSERT_EQUAL(DR_NOTE_PLACED, note.what);
    TEST_ASSERT_EQUAL_UINT32(320, note.steps[DR_X]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN(home_goes_home_without_a_cr);
    RUN(work_needs_a_stored_position_and_goes_in_work_order);
    RUN(a_pause_at_any_microsecond_loses_and_gains_no_step);
    RUN(pauses_of_a_move_add_up);
    RUN(a_pause_may_outlast_the_clock);
    RUN(home_pauses_a_hosts_h_whose_cr_comes_when_it_ends);
    RUN(work_pauses_a_hosts_w);
    RUN(home_and_work_leave_other_moves_alone);
    RUN(host_commands_during_a_hand_move_wait_for_its_end);
    RUN(a_command_that_waits_starts_when_the_hand_move_ends_whoever_comes_then);
    RUN(a_hold_acts_at_3_s_to_the_microsecond);
    RUN(a_press_just_short_of_3_s_is_a_press);
    RUN(home_held_stores_home);
    RUN(work_held_stores_work);
    RUN(several_buttons_are_held_each_for_itself);
    RUN(holds_and_settings_are_dead_during_moves);
    RUN(a_hold_that_becomes_long_enough_at_the_end_of_a_move_acts);
    RUN(the_table_of_angles_is_sine_and_cosine);
    RUN(pulse_advances_2_85_um_along_the_diagonal);
    RUN(pulse_at_30_degrees);
    RUN(a_pulse_needs_room_on_both_axes);
    RUN(pulse_held_lets_knob_d_set_the_angle_for_10_s);
    RUN(knob_d_sets_1_to_89_degrees);
    RUN(an_angle_set_by_hand_orders_the_hosts_next_move);
    RUN(relative_toggles_what_the_screen_counts_from);
    RUN(speed_cycles_through_four_knob_steps);
    RUN(lock_disables_the_knobs_only);
    RUN(knobs_move_their_axis_and_stop_at_its_ends);
    RUN(knobs_are_dead_during_moves);
    RUN(knob_d_goes_along_the_angle_however_it_is_cut);
    RUN(knob_d_at_30_degrees_moves_x_more);
    RUN(at_0_degrees_z_and_at_90_x_stands_still);
    RUN(knob_d_stops_where_an_axis_meets_its_end);
    RUN(non_linear_knobs_go_farther_when_turned_fast);
    RUN(switches_1_to_4_turn_the_knobs_round_at_power_up);
    RUN(switch_5_off_locks_y_out_of_homing);
    RUN(switch_6_calibrates_at_power_up);
    RUN(internal_switch_2_follows_the_stage);
    RUN(reserved_switches_are_state_only);
    RUN(switches_begin_where_the_settings_say);
    RUN(what_the_panel_keeps_over_power_off);
    RUN(a_press_across_power_does_nothing);
    RUN(the_panel_sleeps_during_the_boot_second);
    RUN(power_off_ends_a_pause);
    RUN(nothing_works_without_a_stage);
    RUN(unplugging_ends_a_hand_move_and_a_pause);
    RUN(a_wedged_controller_has_dead_controls);
    RUN(a_trio_has_its_own_controls_only);
    RUN(effects_of_the_other_controller_are_refused);
    RUN(the_screen_is_red_while_it_moves);
    RUN(a_move_that_never_answers_keeps_the_screen_red);
    RUN(who_comes_late_finds_the_same);
    RUN(every_effect_leaves_a_note);
    return UNITY_END();
}
