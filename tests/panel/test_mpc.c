/* The ROE-200 and the switches of the MPC-200, from [M] page 1, tables 1 to 4, and PROTOCOL.md, "Hand controls". An MP-225 has
 * microsteps of 0.0625 um and runs at 3,000 um/s: 48,000 microsteps a second. 1,000 um are 16,000 microsteps, 333,334 us. */
#include "bench.h"

#include <math.h>

#define UM 16u
#define MP225_UM 0.0625

static const double pi = 3.14159265358979323846;

/* Chosen [P]: microsteps a detent in modes 1 to 9; mode 0 begins with 64. */
static const uint32_t steps_of_mode[10] = {64, 256, 128, 64, 32, 16, 8, 4, 2, 1};

static void begin_with_mode(uint8_t mode)
{
    bench_begin(DR_MPC);
    b.drives[0].mode = mode;
    b.drives[1].mode = mode;
}

/* -- Moves ------------------------------------------------------------------------------------------------------------ */

static void home_goes_to_0_along_the_diagonal_without_a_cr(void)
{
    bench_begin(DR_MPC);
    bench_place(16000, 16000, 16000);
    bench_press(DR_BUTTON_HOME); /* at once, unlike a TRIO's (chosen) */
    TEST_ASSERT_EQUAL(DR_OP_MPC_HOME, bench_look().moving);
    bench_release(DR_BUTTON_HOME);
    bench_wait(333334); /* 29 degrees: Z loses 16,000 x 15,886 / 28,660 */
    bench_expect_at(0, 16000, 16000 - 8868);
    bench_wait(333334 - 1);
    TEST_ASSERT_TRUE(bench_moves());
    bench_wait(1);
    TEST_ASSERT_FALSE(bench_moves());
    bench_expect_nothing();
    bench_expect_answer_at(0, 0, 0);
}

static void home_held_is_home(void)
{
    bench_begin(DR_MPC);
    bench_place(16000, 0, 0);
    bench_hold(DR_BUTTON_HOME, 10 * S);
    TEST_ASSERT_EQUAL(0, bench_beeps());
    bench_expect_at(0, 0, 0);
}

static void work_goes_as_the_hosts_y_does(void)
{
    bench_begin(DR_MPC);
    bench_place(16000, 16000, 16000);
    bench_tap(DR_BUTTON_WORK); /* none is stored */
    TEST_ASSERT_FALSE(bench_moves());
    bench_expect_note(DR_NOTE_NO_WORK);
    bench_press(DR_BUTTON_STOP);
    bench_press(DR_BUTTON_WORK);
    bench_release(DR_BUTTON_WORK);
    bench_release(DR_BUTTON_STOP);
    bench_turn(DR_KNOB_X, 5);
    bench_tap(DR_BUTTON_WORK); /* not at home */
    TEST_ASSERT_FALSE(bench_moves());
    bench_expect_note(DR_NOTE_NOT_AT_HOME);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    bench_press(DR_BUTTON_WORK);
    bench_wait(2 * S - 1); /* a press acts on release, because it may become a hold */
    bench_release(DR_BUTTON_WORK);
    TEST_ASSERT_EQUAL(DR_OP_MPC_WORK, bench_look().moving);
    bench_wait(333334);
    bench_expect_at(0, 16000, 16000 - 8868);
    bench_wait_until_idle();
    bench_expect_at(16000, 16000, 16000);
    bench_expect_nothing();
}

static void a_home_by_hand_lets_the_host_say_y_and_a_knob_forbids_it(void)
{
    begin_with_mode(5);
    b.drives[0].work_steps[DR_X] = 160;
    b.drives[0].work_is_set = true;
    bench_tap(DR_BUTTON_HOME);
    bench_host("Y", 1);
    bench_wait_until_idle();
    bench_expect_bytes("\r", 1);
    bench_expect_at(160, 0, 0);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    bench_turn(DR_KNOB_X, -1); /* at its end: no motion */
    TEST_ASSERT_TRUE(b.drives[0].at_home);
    bench_turn(DR_KNOB_X, 1);
    bench_host("Y", 1);
    bench_wait_until_idle();
    bench_expect_bytes("\r", 1);
    bench_expect_at(16, 0, 0);
}

static void calibrate_is_by_firmware_the_centre_or_a_calibration(void)
{
    bench_set_up(DR_MPC);
    b.c.firmware = 0x0103;
    bench_start();
    bench_tap(DR_BUTTON_CALIBRATE);
    TEST_ASSERT_EQUAL(DR_OP_MPC_CENTRE, bench_look().moving);
    bench_wait_until_idle();
    bench_expect_at(200000, 200000, 200000);
    bench_begin(DR_MPC);
    bench_place(16000, 16000, 16000);
    bench_tap(DR_BUTTON_CALIBRATE);
    TEST_ASSERT_EQUAL(DR_OP_MPC_CALIBRATE, bench_look().moving);
    bench_wait_until_idle();
    bench_expect_at(0, 0, 0);
    bench_expect_nothing();
    TEST_ASSERT_EQUAL(DR_CALIBRATED, b.drives[0].calibration);
}

/* -- STOP/SET ---------------------------------------------------------------------------------------------------------- */

static void stop_ends_a_hosts_move_with_its_one_cr(void)
{
    bench_begin(DR_MPC);
    bench_host_point('M', -1, 48000, 0, 24000);
    bench_wait(100 * MS);
    bench_expect_nothing();
    bench_press(DR_BUTTON_STOP); /* on the way down */
    TEST_ASSERT_EQUAL_UINT32(100 * MS, b.got_at[0]);
    TEST_ASSERT_TRUE(b.stopped[0]);
    bench_wait(S);
    bench_release(DR_BUTTON_STOP);
    bench_expect_bytes("\r", 1);
    bench_expect_at(4800, 0, 4800);
    bench_host("C", 1);
    TEST_ASSERT_FALSE(b.stopped[0]);
    b.count = 0;
    bench_tap(DR_BUTTON_STOP); /* nothing moves */
    bench_expect_nothing();
}

static void stop_ends_every_move_of_the_host(void)
{
    static const char moves[] = "HYNMS";
    for (const char *m = moves; *m != 0; m++) {
        bench_begin(DR_MPC);
        b.drives[0].work_is_set = true;
        b.drives[0].work_steps[DR_X] = 48000;
        if (*m == 'Y')
            b.drives[0].at_home = true;
        else
            b.drives[0].position_steps[DR_X] = 48000;
        if (*m == 'M' || *m == 'S')
            bench_host_point(*m, *m == 'S' ? 15 : -1, 0, 0, 0);
        else
            bench_host(m, 1);
        bench_wait(10 * MS);
        bench_tap(DR_BUTTON_STOP);
        TEST_ASSERT_TRUE(b.stopped[0]);
        bench_expect_bytes("\r", 1);
        TEST_ASSERT_FALSE(bench_moves());
        TEST_ASSERT_FALSE(b.drives[0].at_home);
        TEST_ASSERT_EQUAL(*m == 'N' ? DR_UNCALIBRATED : DR_CALIBRATED, b.drives[0].calibration);
        bench_wait_until_idle();
        bench_expect_nothing();
    }
}

static void the_answer_to_an_interrupt_is_not_that_of_stop(void)
{
    bool first;
    bench_begin(DR_MPC);
    bench_host_point('M', -1, 48000, 0, 0);
    bench_wait(10 * MS);
    bench_host("\x03", 1);
    bench_expect_bytes("\r", 1);
    TEST_ASSERT_FALSE(b.stopped[0]);
    bench_host_point('M', -1, 48000, 0, 0);
    (void)dr_panel_press(&b.p, b.clock, DR_BUTTON_STOP);
    dr_controller_push(&b.c, b.clock, (const uint8_t *)"\x03", 1); /* and both */
    TEST_ASSERT_TRUE(dr_controller_answers_stop(&b.c));
    TEST_ASSERT_EQUAL(DR_OP_MPC_MOVE, dr_controller_answering(&b.c, &first));
    bench_wait(0);
    bench_expect_bytes("\r\r", 2);
    TEST_ASSERT_TRUE(b.stopped[0]);
    TEST_ASSERT_FALSE(b.stopped[1]);
}

static void stop_ends_a_stream_at_a_whole_frame(void)
{
    uint8_t bytes[32];
    bench_begin(DR_MPC);
    bench_host("O", 1);
    b.count = 0;
    bench_host_point('S', 15, 16000, 0, 0); /* 1,300 um/s: a frame every 769 us */
    bench_wait(5 * 769 + 10);
    TEST_ASSERT_EQUAL_size_t(5 * 12, b.count);
    b.count = 0;
    b.clock += 769;
    dr_panel_settle(&b.p, b.clock);
    TEST_ASSERT_EQUAL_size_t(5, dr_controller_pull(&b.c, b.clock, bytes, 5));
    (void)dr_panel_press(&b.p, b.clock, DR_BUTTON_STOP);
    TEST_ASSERT_EQUAL_size_t(8, dr_controller_ready(&b.c));
    for (size_t i = 5; i < 13; i++) {
        TEST_ASSERT_EQUAL(i == 12, dr_controller_answers_stop(&b.c));
        TEST_ASSERT_EQUAL_size_t(1, dr_controller_pull(&b.c, b.clock, &bytes[i], 1));
    }
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\xFF\xFF\xFF\x60\x00\x00\x00\x00\x00\x00\x00\x00\r", bytes, 13); /* 6 um */
    TEST_ASSERT_FALSE(dr_controller_answers_stop(&b.c));
}

static void stop_ends_a_hand_move_without_a_cr(void)
{
    bench_begin(DR_MPC);
    bench_place(48000, 0, 0);
    bench_press(DR_BUTTON_HOME);
    bench_wait(250 * MS);
    bench_tap(DR_BUTTON_STOP);
    bench_expect_at(36000, 0, 0);
    bench_wait_until_idle();
    bench_expect_at(36000, 0, 0);
    bench_expect_nothing();
}

static void a_command_that_waits_follows_the_stop(void)
{
    bench_begin(DR_MPC);
    bench_host_point('M', -1, 48000, 0, 0);
    bench_host("K", 1);
    bench_wait(10 * MS);
    bench_tap(DR_BUTTON_STOP);
    bench_expect_bytes("\r\x01\x21\x03\r", 5);
}

static void stop_and_work_store_the_work_position(void)
{
    bench_begin(DR_MPC);
    bench_place(1, 2, 3);
    bench_press(DR_BUTTON_STOP);
    bench_wait(5 * S);
    bench_press(DR_BUTTON_WORK);
    TEST_ASSERT_EQUAL(1, bench_beeps());
    TEST_ASSERT_TRUE(b.drives[0].work_is_set);
    TEST_ASSERT_EQUAL_UINT32(3, b.drives[0].work_steps[DR_Z]);
    bench_wait(5 * S); /* WORK POS. has done its task: no lock */
    bench_release(DR_BUTTON_STOP);
    bench_release(DR_BUTTON_WORK);
    TEST_ASSERT_FALSE(bench_look().is_locked);
    TEST_ASSERT_FALSE(bench_moves());
    TEST_ASSERT_FALSE(b.drives[1].work_is_set);
}

static void stop_and_work_in_mid_move_store_where_it_stopped(void)
{
    bench_begin(DR_MPC);
    bench_host_point('M', -1, 48000, 0, 0);
    bench_wait(100 * MS);
    bench_press(DR_BUTTON_STOP);
    bench_press(DR_BUTTON_WORK);
    TEST_ASSERT_EQUAL_UINT32(4800, b.drives[0].work_steps[DR_X]);
    bench_expect_bytes("\r", 1);
}

static void stop_frees_a_move_that_never_answers(void)
{
    bench_set_up(DR_MPC);
    b.c.quirks = DR_QUIRK_ENDLESS_NEGATIVE;
    bench_start();
    bench_host_point('M', -1, 0xFFFFFFFF, 0, 0);
    bench_wait_until_idle();
    bench_expect_nothing();
    TEST_ASSERT_TRUE(bench_moves());
    bench_tap(DR_BUTTON_STOP);
    bench_expect_bytes("\r", 1);
    bench_expect_answer_at(0, 0, 0);
}

static void only_stop_works_during_moves(void)
{
    bench_begin(DR_MPC);
    bench_place(400000, 0, 0);
    bench_host_point('S', 0, 0, 0, 0);
    bench_wait(10 * MS);
    const uint8_t op = bench_look().moving;
    bench_tap(DR_BUTTON_HOME);
    bench_tap(DR_BUTTON_WORK);
    bench_tap(DR_BUTTON_DIAGONAL);
    bench_tap(DR_BUTTON_CALIBRATE);
    bench_hold(DR_BUTTON_WORK, 3 * S);
    for (dr_knob knob = DR_KNOB_X; knob < DR_KNOBS; knob++)
        if (knob != DR_KNOB_D)
            bench_turn(knob, 3);
    const dr_look look = bench_look();
    TEST_ASSERT_EQUAL(op, look.moving);
    TEST_ASSERT_FALSE(look.is_locked || look.is_diagonal);
    TEST_ASSERT_EQUAL(0, look.speed);
    TEST_ASSERT_EQUAL(1, look.drive);
    bench_tap(DR_BUTTON_STOP);
    TEST_ASSERT_FALSE(bench_moves());
    bench_expect_bytes("\r", 1);
}

static void home_by_hand_drops_a_move_that_an_interrupt_paused(void)
{
    bench_set_up(DR_MPC);
    b.c.quirks = DR_QUIRK_PAUSE_ON_STOP;
    bench_start();
    bench_host_point('M', -1, 48000, 0, 0);
    bench_wait(100 * MS);
    bench_host("\x03", 1);
    bench_expect_bytes("\r", 1);
    bench_tap(DR_BUTTON_WORK); /* does nothing, changes nothing */
    TEST_ASSERT_TRUE(b.c.move_is_paused);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    bench_expect_at(0, 0, 0);
    bench_host_point('M', -1, 160, 0, 0);
    bench_wait_until_idle();
    bench_expect_at(160, 0, 0);
    bench_expect_bytes("\r", 1);
}

/* -- Lock -------------------------------------------------------------------------------------------------------------- */

static void work_held_2_s_locks_and_unlocks(void)
{
    bench_begin(DR_MPC);
    bench_press(DR_BUTTON_WORK);
    bench_wait(2 * S - 1);
    TEST_ASSERT_FALSE(bench_look().is_locked);
    bench_wait(1);
    TEST_ASSERT_TRUE(bench_look().is_locked);
    TEST_ASSERT_EQUAL(1, bench_beeps());
    bench_release(DR_BUTTON_WORK);
    bench_hold(DR_BUTTON_WORK, 2 * S - 1);
    TEST_ASSERT_TRUE(bench_look().is_locked);
    bench_hold(DR_BUTTON_WORK, 2 * S);
    TEST_ASSERT_FALSE(bench_look().is_locked);
}

static void lock_stops_hands_but_not_the_host_nor_stop(void)
{
    bench_begin(DR_MPC);
    b.drives[0].work_is_set = true;
    bench_place(160, 160, 160);
    bench_hold(DR_BUTTON_WORK, 2 * S);
    bench_tap(DR_BUTTON_HOME);
    bench_tap(DR_BUTTON_WORK);
    bench_tap(DR_BUTTON_CALIBRATE);
    bench_tap(DR_BUTTON_DIAGONAL);
    bench_turn(DR_KNOB_X, 1);
    bench_turn(DR_KNOB_Y, 1);
    bench_turn(DR_KNOB_Z, 1);
    bench_turn(DR_KNOB_MODE, 1);
    bench_press(DR_BUTTON_STOP);
    bench_tap(DR_BUTTON_WORK);
    bench_release(DR_BUTTON_STOP);
    bench_expect_at(160, 160, 160);
    TEST_ASSERT_FALSE(bench_moves() || bench_look().is_diagonal);
    TEST_ASSERT_EQUAL(0, bench_look().speed);
    TEST_ASSERT_EQUAL_UINT32(0, b.drives[0].work_steps[DR_X]);
    bench_host_point('M', -1, 48160, 160, 160);
    bench_wait(500 * MS);
    bench_tap(DR_BUTTON_STOP);
    bench_expect_bytes("\r", 1);
    bench_expect_at(24160, 160, 160);
}

static void lock_belongs_to_its_drive(void)
{
    bench_begin(DR_MPC);
    bench_hold(DR_BUTTON_WORK, 2 * S);
    bench_turn(DR_KNOB_MANIPULATOR, 1); /* the other drives can be reached */
    TEST_ASSERT_EQUAL(2, bench_look().drive);
    TEST_ASSERT_FALSE(bench_look().is_locked);
    bench_turn(DR_KNOB_Y, 1);
    bench_expect_at(0, 64, 0);
    bench_host("I\x01", 2);
    TEST_ASSERT_TRUE(bench_look().is_locked);
}

/* -- MANIPULATOR and MODE ---------------------------------------------------------------------------------------------- */

static void manipulator_selects_what_is_connected(void)
{
    bench_set_up(DR_MPC);
    b.drives[2].stage = DR_STAGE_NONE;
    b.drives[3].stage = DR_STAGE_MPC_MP285;
    bench_start();
    static const struct {
        int clicks;
        char drive;
    } turns[] = {{1, 2}, {1, 4}, {1, 1}, {-1, 4}, {-1, 2}, {-1, 1}, {2, 4}, {3, 4}, {1000, 1}, {-30001, 4}, {0, 4}};
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++) { /* ROE-200 switch 3 is OFF: cyclical */
        bench_turn(DR_KNOB_MANIPULATOR, turns[i].clicks);
        TEST_ASSERT_EQUAL(turns[i].drive, bench_look().drive);
        bench_host("K", 1);
        const char k[] = {turns[i].drive, 0x21, 0x03, '\r'};
        bench_expect_bytes(k, 4);
    }
    bench_host_point('M', -1, 160, 0, 0); /* and that drive moves */
    bench_wait_until_idle();
    TEST_ASSERT_EQUAL_UINT32(160, b.drives[3].position_steps[DR_X]);
    TEST_ASSERT_EQUAL_UINT32(0, b.drives[0].position_steps[DR_X]);
}

static void manipulator_stops_at_its_ends_when_not_cyclical(void)
{
    bench_begin(DR_MPC);
    b.drives[2].stage = DR_STAGE_MPC_MP225;
    bench_switch(DR_SWITCHES_ROE, 0, 3, true);
    bench_turn(DR_KNOB_MANIPULATOR, -1); /* still cyclical: switches are read at power-up */
    TEST_ASSERT_EQUAL(3, bench_look().drive);
    bench_power_cycle();
    TEST_ASSERT_EQUAL(1, bench_look().drive);
    static const struct {
        int clicks;
        uint8_t drive;
    } turns[] = {{-1, 1}, {1, 2}, {5, 3}, {1, 3}, {-1, 2}, {-7, 1}};
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++) {
        bench_turn(DR_KNOB_MANIPULATOR, turns[i].clicks);
        TEST_ASSERT_EQUAL(turns[i].drive, bench_look().drive);
    }
}

static void another_drive_drops_a_move_that_an_interrupt_paused(void)
{
    bench_set_up(DR_MPC);
    b.c.quirks = DR_QUIRK_PAUSE_ON_STOP;
    bench_start();
    bench_host_point('M', -1, 48000, 0, 0);
    bench_wait(100 * MS);
    bench_host("\x03", 1);
    bench_turn(DR_KNOB_MANIPULATOR, 2); /* there and back */
    TEST_ASSERT_TRUE(b.c.move_is_paused);
    TEST_ASSERT_TRUE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_SELECT, 0)); /* the same one */
    TEST_ASSERT_TRUE(b.c.move_is_paused);
    bench_turn(DR_KNOB_MANIPULATOR, 1);
    TEST_ASSERT_FALSE(b.c.move_is_paused);
}

static void mode_is_selected_for_each_drive(void)
{
    bench_begin(DR_MPC);
    bench_turn(DR_KNOB_MODE, -1); /* stops at its ends (chosen) */
    TEST_ASSERT_EQUAL(0, bench_look().speed);
    for (uint8_t mode = 1; mode <= 9; mode++) {
        bench_turn(DR_KNOB_MODE, 1);
        TEST_ASSERT_EQUAL(mode, bench_look().speed);
    }
    bench_turn(DR_KNOB_MODE, 1);
    TEST_ASSERT_EQUAL(9, bench_look().speed);
    bench_turn(DR_KNOB_MODE, -2);
    TEST_ASSERT_EQUAL(7, bench_look().speed);
    bench_turn(DR_KNOB_MANIPULATOR, 1);
    TEST_ASSERT_EQUAL(0, bench_look().speed);
    bench_host("L\x03", 2);
    bench_expect_bytes("\r", 1);
    TEST_ASSERT_EQUAL(3, bench_look().speed); /* the host's mode is the ROE's */
    bench_turn(DR_KNOB_MANIPULATOR, 1);
    TEST_ASSERT_EQUAL(7, bench_look().speed);
    bench_turn(DR_KNOB_MODE, 30000);
    TEST_ASSERT_EQUAL(9, bench_look().speed);
    bench_turn(DR_KNOB_MODE, -30000);
    TEST_ASSERT_EQUAL(0, bench_look().speed);
}

static void roe_switch_1_off_leaves_modes_0_and_5(void)
{
    bench_begin(DR_MPC);
    bench_switch(DR_SWITCHES_ROE, 0, 1, false);
    bench_turn(DR_KNOB_MODE, 1);
    TEST_ASSERT_EQUAL(1, bench_look().speed);
    bench_power_cycle();
    static const struct {
        int clicks;
        uint8_t mode;
    } turns[] = {{1, 5}, {1, 5}, {-1, 0}, {-3, 0}, {4, 5}};
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++) {
        bench_turn(DR_KNOB_MODE, turns[i].clicks);
        TEST_ASSERT_EQUAL(turns[i].mode, bench_look().speed);
    }
    bench_host("L\x08", 2); /* limits the selector, not the host */
    TEST_ASSERT_EQUAL(8, bench_look().speed);
    bench_turn(DR_KNOB_MODE, -1);
    TEST_ASSERT_EQUAL(0, bench_look().speed);
}

/* -- Knobs ------------------------------------------------------------------------------------------------------------- */

static void each_mode_halves_the_step_of_the_one_before(void)
{
    for (uint8_t mode = 0; mode <= 9; mode++)
        for (unsigned axis = 0; axis < 3; axis++) {
            uint32_t at[3] = {5000, 5000, 5000};
            begin_with_mode(mode);
            bench_place(5000, 5000, 5000);
            bench_turn((dr_knob)axis, 3);
            at[axis] += 3 * steps_of_mode[mode];
            bench_expect_at(at[0], at[1], at[2]);
            bench_turn((dr_knob)axis, -32768);
            at[axis] = mode == 9 || mode == 8 ? at[axis] : 0;
            if (at[axis] > 0) /* fine modes do not get there in one call */
                at[axis] = at[axis] > 32768 * steps_of_mode[mode] ? at[axis] - 32768 * steps_of_mode[mode] : 0;
            bench_expect_at(at[0], at[1], at[2]);
        }
}

/* Chosen: faster than 50, 100, 200 detents a second doubles the step once, twice, three times. */
static void mode_0_accelerates(void)
{
    static const struct {
        dr_us apart;
        uint32_t steps;
    } turns[] = {{100 * MS, 64}, {20000, 64}, {19999, 128}, {10000, 128},
                 {9999, 256},    {5000, 256}, {4999, 512},  {0, 512}};
    for (size_t i = 0; i < sizeof turns / sizeof turns[0]; i++)
        for (uint8_t mode = 0; mode < 2; mode++) {
            begin_with_mode(mode);
            bench_turn(DR_KNOB_Z, 1);
            bench_wait(turns[i].apart);
            bench_turn(DR_KNOB_Z, 1);
            bench_expect_at(0, 0, mode == 0 ? 64 + turns[i].steps : 512);
        }
    begin_with_mode(0);
    bench_turn(DR_KNOB_Z, 120); /* who knows how fast: slowly */
    bench_expect_at(0, 0, 120 * 64);
    bench_wait(S);
    bench_turn(DR_KNOB_Z, 120);
    bench_expect_at(0, 0, 240 * 64);
    dr_us when;
    TEST_ASSERT_TRUE(dr_panel_due(&b.p, &when));
    bench_wait_until_idle();
    TEST_ASSERT_FALSE(dr_panel_due(&b.p, &when)); /* no instant is kept */
}

static void switches_5_to_7_off_turn_the_knobs_round_at_power_up(void)
{
    for (uint8_t drive = 0; drive < 2; drive++)
        for (uint8_t number = 5; number <= 7; number++) {
            begin_with_mode(5);
            TEST_ASSERT_TRUE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_REAR, drive, number)); /* normal [M table 3] */
            bench_switch(DR_SWITCHES_REAR, drive, number, false);
            bench_turn((dr_knob)(number - 5), 1);
            TEST_ASSERT_EQUAL_UINT32(16, b.drives[0].position_steps[number - 5]);
            bench_power_cycle();
            for (uint8_t active = 0; active < 2; active++) {
                b.drives[active].mode = 5;
                for (uint8_t axis = 0; axis < 3; axis++) {
                    const bool reversed = active == drive && axis == number - 5;
                    bench_place(1000, 1000, 1000);
                    bench_turn((dr_knob)axis, 10);
                    TEST_ASSERT_EQUAL_UINT32(reversed ? 840 : 1160, b.drives[active].position_steps[axis]);
                }
                bench_turn(DR_KNOB_MANIPULATOR, 1);
            }
        }
}

/* -- NORM/DIAG --------------------------------------------------------------------------------------------------------- */

static void diagonal_turns_z_into_the_diagonal(void)
{
    begin_with_mode(5);
    bench_place(16000, 16000, 16000);
    bench_tap(DR_BUTTON_DIAGONAL);
    TEST_ASSERT_TRUE(bench_look().is_diagonal);
    bench_turn(DR_KNOB_Z, 10); /* 160 steps: x 28,660 / 32,768 and x 15,886 / 32,768 */
    bench_expect_at(16140, 16000, 16078);
    bench_turn(DR_KNOB_X, 1); /* X and Y stay live */
    bench_turn(DR_KNOB_Y, -1);
    bench_expect_at(16156, 15984, 16078);
    bench_turn(DR_KNOB_X, -1);
    bench_turn(DR_KNOB_Z, -10);
    bench_expect_at(16000, 15984, 16000);
    bench_tap(DR_BUTTON_DIAGONAL);
    TEST_ASSERT_FALSE(bench_look().is_diagonal || bench_look().has_along);
    bench_turn(DR_KNOB_Z, 10);
    bench_expect_at(16000, 15984, 16160);
    bench_expect_nothing();
}

static void diagonal_shows_relative_coordinates_and_a_fourth(void)
{
    begin_with_mode(5);
    bench_place(16000, 16000, 16000);
    TEST_ASSERT_EQUAL_INT32(64000, bench_look().quanta[DR_X]);
    bench_tap(DR_BUTTON_DIAGONAL);
    dr_look look = bench_look();
    TEST_ASSERT_TRUE(look.is_relative && look.has_along);
    TEST_ASSERT_EACH_EQUAL_INT32(0, look.quanta, 3); /* from 0,0,0 */
    TEST_ASSERT_EQUAL_INT32(0, look.along_quanta);
    bench_turn(DR_KNOB_Z, 100); /* 1,600 steps: X 1,399.4, Z 775.7 */
    bench_turn(DR_KNOB_Y, -2);
    look = bench_look();
    TEST_ASSERT_EQUAL_INT32(1399 * 4, look.quanta[DR_X]);
    TEST_ASSERT_EQUAL_INT32(-32 * 4, look.quanta[DR_Y]);
    TEST_ASSERT_EQUAL_INT32(776 * 4, look.quanta[DR_Z]);
    TEST_ASSERT_INT32_WITHIN(4, 1600 * 4, look.along_quanta);
    bench_expect_answer_at(17399, 15968, 16776); /* the wire stays absolute */
    bench_tap(DR_BUTTON_DIAGONAL);
    TEST_ASSERT_EQUAL_INT32(17399 * 4, bench_look().quanta[DR_X]);
    bench_tap(DR_BUTTON_DIAGONAL); /* from 0,0,0 again */
    TEST_ASSERT_EACH_EQUAL_INT32(0, bench_look().quanta, 3);
}

static void roe_switch_2_off_forbids_relative_coordinates_only(void)
{
    begin_with_mode(5);
    bench_switch(DR_SWITCHES_ROE, 0, 2, false);
    bench_power_cycle();
    b.drives[0].mode = 5;
    bench_place(16000, 16000, 16000);
    bench_tap(DR_BUTTON_DIAGONAL);
    bench_turn(DR_KNOB_Z, 100);
    const dr_look look = bench_look();
    TEST_ASSERT_TRUE(look.is_diagonal && look.has_along);
    TEST_ASSERT_FALSE(look.is_relative);
    TEST_ASSERT_EQUAL_INT32(17399 * 4, look.quanta[DR_X]);
    TEST_ASSERT_INT32_WITHIN(4, 1600 * 4, look.along_quanta);
}

static void each_drive_has_its_own_diagonal_mode_and_origin(void)
{
    begin_with_mode(5);
    bench_place(1600, 0, 0);
    bench_tap(DR_BUTTON_DIAGONAL);
    bench_turn(DR_KNOB_X, 1);
    bench_turn(DR_KNOB_MANIPULATOR, 1);
    TEST_ASSERT_FALSE(bench_look().is_diagonal);
    bench_place(3200, 0, 0);
    bench_tap(DR_BUTTON_DIAGONAL);
    bench_turn(DR_KNOB_X, 2);
    TEST_ASSERT_EQUAL_INT32(32 * 4, bench_look().quanta[DR_X]);
    bench_turn(DR_KNOB_MANIPULATOR, 1);
    TEST_ASSERT_TRUE(bench_look().is_diagonal);
    TEST_ASSERT_EQUAL_INT32(16 * 4, bench_look().quanta[DR_X]);
}

/* [M table 2], by switches 1 to 4: degrees against the horizontal; "more" steep is 90 minus the printed angle. */
static const uint8_t steepness_deg[16] = {79, 76, 69, 63, 61, 55, 51, 45, 39, 35, 29, 27, 21, 14, 11, 7};

static void switches_1_to_4_set_the_angle_at_power_up(void)
{
    for (uint8_t value = 0; value < 16; value++) {
        begin_with_mode(9);
        for (uint8_t number = 1; number <= 4; number++) {
            TEST_ASSERT_EQUAL(number % 2 == 0, dr_panel_switch_is_on(&b.p, DR_SWITCHES_REAR, 0, number)); /* 0,1,0,1 */
            bench_switch(DR_SWITCHES_REAR, 0, number, (value >> (number - 1) & 1) != 0);
        }
        TEST_ASSERT_EQUAL(10, bench_look().angle);
        bench_power_cycle();
        TEST_ASSERT_EQUAL(value, bench_look().angle);
        TEST_ASSERT_EQUAL(10, b.drives[1].diagonal); /* each device has its own */
        b.drives[0].mode = 6;
        bench_tap(DR_BUTTON_DIAGONAL);
        bench_turn(DR_KNOB_Z, 1000);
        const double rad = steepness_deg[value] * pi / 180.0;
        bench_expect_at((uint32_t)floor(8000 * cos(rad) + 0.5), 0, (uint32_t)floor(8000 * sin(rad) + 0.5));
    }
}

static void mode_9_in_diagonal_mode_makes_impulses(void)
{
    for (uint8_t value = 0; value < 16; value++) {
        const double rad = steepness_deg[value] * pi / 180.0;
        const uint32_t x = (uint32_t)floor(2.85 * cos(rad) / MP225_UM + 0.5);
        const uint32_t z = (uint32_t)floor(2.85 * sin(rad) / MP225_UM + 0.5);
        begin_with_mode(9);
        b.drives[0].diagonal = value;
        bench_tap(DR_BUTTON_DIAGONAL);
        bench_turn(DR_KNOB_Z, 1); /* 2.85 um each, as a TRIO's PULSE (chosen) */
        bench_expect_at(x, 0, z);
        bench_turn(DR_KNOB_Z, 9);
        bench_expect_at(10 * x, 0, 10 * z);
        bench_turn(DR_KNOB_Z, -4);
        bench_expect_at(6 * x, 0, 6 * z);
        bench_turn(DR_KNOB_Z, -100); /* whole impulses only, as long as there is room */
        bench_expect_at(0, 0, 0);
        bench_turn(DR_KNOB_X, 1);
        bench_expect_at(1, 0, 0);
    }
    begin_with_mode(9);
    bench_tap(DR_BUTTON_DIAGONAL);
    bench_place(400000 - 100, 0, 400000 - 100);
    bench_turn(DR_KNOB_Z, 100);
    bench_expect_at(400000 - 100 + 80, 0, 400000 - 100 + 44); /* 40 and 22 each */
}

/* -- Other switches ---------------------------------------------------------------------------------------------------- */

static void switch_8_off_keeps_y_where_it_is(void)
{
    bench_begin(DR_MPC);
    bench_switch(DR_SWITCHES_REAR, 0, 8, false);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    TEST_ASSERT_TRUE(b.drives[0].y_moves_home); /* not before the next power-up */
    bench_power_cycle();
    bench_place(160, 160, 160);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    bench_expect_at(0, 160, 0);
    bench_turn(DR_KNOB_MANIPULATOR, 1);
    bench_place(160, 160, 160);
    bench_tap(DR_BUTTON_HOME);
    bench_wait_until_idle();
    bench_expect_at(0, 0, 0);
}

static void right_angle_and_reserved_switches_are_state_only(void)
{
    bench_begin(DR_MPC);
    for (uint8_t drive = 0; drive < DR_PORTS; drive++) {
        TEST_ASSERT_FALSE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_RIGHT, drive, 1)); /* normal [M table 4] */
        bench_switch(DR_SWITCHES_RIGHT, drive, 1, true);
    }
    TEST_ASSERT_TRUE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_ROE, 0, 4));
    bench_switch(DR_SWITCHES_ROE, 0, 4, false);
    bench_power_cycle();
    TEST_ASSERT_TRUE(dr_panel_switch_is_on(&b.p, DR_SWITCHES_RIGHT, 3, 1));
    bench_turn(DR_KNOB_X, 1);
    bench_expect_at(64, 0, 0);
}

static void switches_begin_where_the_settings_say(void)
{
    bench_set_up(DR_MPC);
    b.drives[1].diagonal = 6;
    b.drives[1].y_moves_home = false;
    bench_start();
    static const bool first[8] = {0, 1, 0, 1, 1, 1, 1, 1}, second[8] = {0, 1, 1, 0, 1, 1, 1, 0};
    for (uint8_t i = 0; i < 8; i++) {
        TEST_ASSERT_EQUAL(first[i], dr_panel_switch_is_on(&b.p, DR_SWITCHES_REAR, 0, (uint8_t)(i + 1)));
        TEST_ASSERT_EQUAL(second[i], dr_panel_switch_is_on(&b.p, DR_SWITCHES_REAR, 1, (uint8_t)(i + 1)));
    }
    static const bool roe[4] = {1, 1, 0, 1};
    for (uint8_t i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL(roe[i], dr_panel_switch_is_on(&b.p, DR_SWITCHES_ROE, 0, (uint8_t)(i + 1)));
}

static void an_mpc_has_its_own_controls_only(void)
{
    static const dr_button others[] = {DR_BUTTON_PULSE, DR_BUTTON_RELATIVE, DR_BUTTON_SPEED, DR_BUTTONS};
    bench_begin(DR_MPC);
    for (size_t i = 0; i < 4; i++) {
        TEST_ASSERT_FALSE(dr_panel_press(&b.p, b.clock, others[i]));
        TEST_ASSERT_FALSE(dr_panel_release(&b.p, b.clock, others[i]));
    }
    TEST_ASSERT_FALSE(dr_panel_turn(&b.p, b.clock, DR_KNOB_D, 1));
    TEST_ASSERT_FALSE(dr_panel_turn(&b.p, b.clock, DR_KNOBS, 1));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_INTERNAL, 0, 1, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_REAR, 0, 9, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_REAR, 4, 1, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_RIGHT, 4, 1, true));
    TEST_ASSERT_FALSE(dr_panel_switch(&b.p, DR_SWITCHES_ROE, 0, 5, true));
}

static void effects_of_the_other_controller_are_refused(void)
{
    bench_begin(DR_MPC);
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_ANGLE, 30));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_STORE_HOME, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_MODE, 10));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_SELECT, 2));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_SELECT, 4));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_STOP, 0));
    TEST_ASSERT_TRUE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_HOME, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_PAUSE, 0));
    TEST_ASSERT_FALSE(dr_controller_apply(&b.c, b.clock, DR_EFFECT_RESUME, 0));
}

/* -- Display ----------------------------------------------------------------------------------------------------------- */

static void the_display_tells_that_nothing_is_connected(void)
{
    bench_begin(DR_MPC);
    for (uint8_t drive = 0; drive < 2; drive++)
        TEST_ASSERT_TRUE(dr_controller_poke(&b.c, b.clock, &(dr_hand){.what = DR_HAND_CONNECT, .drive = drive}));
    TEST_ASSERT_EQUAL(DR_SCREEN_PLAIN, bench_look().screen);
    TEST_ASSERT_EQUAL(0, bench_look().drive); /* NO MANIPULATOR CONNECTED [M table 9] */
    bench_tap(DR_BUTTON_HOME);
    bench_tap(DR_BUTTON_STOP);
    bench_tap(DR_BUTTON_WORK);
    bench_hold(DR_BUTTON_WORK, 3 * S);
    bench_turn(DR_KNOB_MANIPULATOR, 1);
    bench_turn(DR_KNOB_MODE, 1);
    bench_turn(DR_KNOB_X, 1);
    TEST_ASSERT_FALSE(bench_moves() || bench_look().is_locked);
    TEST_ASSERT_EQUAL(0, bench_beeps());
    bench_expect_nothing();
}

static void the_display_follows_a_move(void)
{
    bench_begin(DR_MPC);
    bench_host_point('M', -1, 48000, 0, 0);
    bench_wait(250 * MS);
    const dr_look look = bench_look();
    TEST_ASSERT_EQUAL(DR_OP_MPC_MOVE, look.moving);
    TEST_ASSERT_EQUAL_INT32(12000 * 4, look.quanta[DR_X]);
    TEST_ASSERT_EQUAL(DR_SCREEN_PLAIN, look.screen);
    dr_panel_power(&b.p, b.clock, false);
    TEST_ASSERT_EQUAL(DR_SCREEN_DARK, bench_look().screen);
    TEST_ASSERT_FALSE(bench_moves());
}

static void power_off_forgets_locks_and_diagonals(void)
{
    bench_begin(DR_MPC);
    bench_tap(DR_BUTTON_DIAGONAL);
    bench_hold(DR_BUTTON_WORK, 2 * S);
    bench_power_cycle();
    TEST_ASSERT_FALSE(bench_look().is_locked || bench_look().is_diagonal);
}

static void unplugging_during_a_hand_move_strands_nothing(void)
{
    bench_begin(DR_MPC);
    bench_place(48000, 0, 0);
    bench_tap(DR_BUTTON_HOME);
    TEST_ASSERT_TRUE(dr_controller_poke(&b.c, b.clock, &(dr_hand){.what = DR_HAND_CONNECT, .drive = 0}));
    TEST_ASSERT_FALSE(bench_moves());
    bench_host("K", 1);
    bench_expect_bytes("\x02\x21\x03\r", 4);
}

int main(void)
{
    UNITY_BEGIN();
    RUN(home_goes_to_0_along_the_diagonal_without_a_cr);
    RUN(home_held_is_home);
    RUN(work_goes_as_the_hosts_y_does);
    RUN(a_home_by_hand_lets_the_host_say_y_and_a_knob_forbids_it);
    RUN(calibrate_is_by_firmware_the_centre_or_a_calibration);
    RUN(stop_ends_a_hosts_move_with_its_one_cr);
    RUN(stop_ends_every_move_of_the_host);
    RUN(the_answer_to_an_interrupt_is_not_that_of_stop);
    RUN(stop_ends_a_stream_at_a_whole_frame);
    RUN(stop_ends_a_hand_move_without_a_cr);
    RUN(a_command_that_waits_follows_the_stop);
    RUN(stop_and_work_store_the_work_position);
    RUN(stop_and_work_in_mid_move_store_where_it_stopped);
    RUN(stop_frees_a_move_that_never_answers);
    RUN(only_stop_works_during_moves);
    RUN(home_by_hand_drops_a_move_that_an_interrupt_paused);
    RUN(work_held_2_s_locks_and_unlocks);
    RUN(lock_stops_hands_but_not_the_host_nor_stop);
    RUN(lock_belongs_to_its_drive);
    RUN(manipulator_selects_what_is_connected);
    RUN(manipulator_stops_at_its_ends_when_not_cyclical);
    RUN(another_drive_drops_a_move_that_an_interrupt_paused);
    RUN(mode_is_selected_for_each_drive);
    RUN(roe_switch_1_off_leaves_modes_0_and_5);
    RUN(each_mode_halves_the_step_of_the_one_before);
    RUN(mode_0_accelerates);
    RUN(switches_5_to_7_off_turn_the_knobs_round_at_power_up);
    RUN(diagonal_turns_z_into_the_diagonal);
    RUN(diagonal_shows_relative_coordinates_and_a_fourth);
    RUN(roe_switch_2_off_forbids_relative_coordinates_only);
    RUN(each_drive_has_its_own_diagonal_mode_and_origin);
    RUN(switches_1_to_4_set_the_angle_at_power_up);
    RUN(mode_9_in_diagonal_mode_makes_impulses);
    RUN(switch_8_off_keeps_y_where_it_is);
    RUN(right_angle_and_reserved_switches_are_state_only);
    RUN(switches_begin_where_the_settings_say);
    RUN(an_mpc_has_its_own_controls_only);
    RUN(effects_of_the_other_controller_are_refused);
    RUN(the_display_tells_that_nothing_is_connected);
    RUN(the_display_follows_a_move);
    RUN(power_off_forgets_locks_and_diagonals);
    RUN(unplugging_during_a_hand_move_strands_nothing);
    return UNITY_END();
}
