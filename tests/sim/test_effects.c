/* What the buttons of the panels ask of a controller: PROTOCOL.md, "Hand controls", and dr_controller.h. */
#include "scenario.h"

static bool apply(dr_effect effect, unsigned value)
{
    const bool done = dr_controller_apply(&rig.c, sim_clock(&rig), effect, (uint8_t)value);
    sim_pump(&rig);
    return done;
}

/* -- TRIO ------------------------------------------------------------------------------------------------------------- */

static void home_and_work_buttons_move_without_a_cr(void)
{
    trio_at(40, 80, 120);
    TEST_ASSERT_FALSE(apply(DR_EFFECT_WORK, 0)); /* none is stored */
    TEST_ASSERT_TRUE(apply(DR_EFFECT_STORE_WORK, 0));
    TEST_ASSERT_TRUE(apply(DR_EFFECT_HOME, 0)); /* Z 3,000, X 1,000, Y 2,000 us */
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state);
    sim_run_to(&rig, 3000);
    expect_at(0, 40, 80, 0);
    send_code('c'); /* waits */
    sim_run_out(&rig);
    expect_trio_position(6000, 0, 0, 0, 30);
    expect_idle();
    TEST_ASSERT_TRUE(apply(DR_EFFECT_WORK, 0));
    sim_run_to(&rig, 8000);
    expect_at(0, 0, 80, 0); /* Y first */
    sim_run_out(&rig);
    expect_at(0, 40, 80, 120);
    expect_idle();
    TEST_ASSERT_TRUE(apply(DR_EFFECT_STORE_HOME, 0));
    send_point('W', 0, 0, 0);
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    send_code('h');
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    expect_at(0, 40, 80, 120);
    expect_idle();
}

static void the_lock_out_holds_for_the_home_button_too(void)
{
    trio_at(40, 80, 120);
    rig.drives[0].y_moves_home = false;
    TEST_ASSERT_TRUE(apply(DR_EFFECT_HOME, 0));
    sim_run_out(&rig);
    expect_at(0, 0, 80, 0);
    expect_idle();
}

static void a_pause_at_any_instant_gains_and_loses_nothing(void)
{
    /* 'h' from 8, 16, 24 at 30 degrees: Z 600, X 200, Y 400 us */
    for (unsigned at = 0; at < 1200; at++) {
        trio_at(8, 16, 24);
        send_code('h');
        sim_run_to(&rig, at);
        uint32_t here[DR_AXES];
        dr_controller_position(&rig.c, 0, sim_clock(&rig), here);
        TEST_ASSERT_TRUE(apply(DR_EFFECT_PAUSE, 0));
        TEST_ASSERT_EQUAL(DR_STATE_PAUSED, rig.c.state);
        dr_us when;
        TEST_ASSERT_FALSE(dr_controller_due(&rig.c, &when));
        TEST_ASSERT_FALSE(apply(DR_EFFECT_PAUSE, 0));
        const uint64_t pause = UINT64_C(1000003) * (at % 7 + 1) * (at % 5 == 0 ? 3600 : 1); /* up to seven hours */
        sim_jump(&rig, pause);
        sim_pump(&rig);
        expect_at(0, here[0], here[1], here[2]);
        expect_nothing();
        TEST_ASSERT_TRUE(apply(DR_EFFECT_RESUME, 0));
        expect_at(0, here[0], here[1], here[2]);
        sim_run_to(&rig, pause + 600);
        if (at < 600) {
            expect_at(0, 8, 16, 0);
        }
        sim_run_to(&rig, pause + 1199);
        expect_nothing();
        sim_run(&rig, 1);
        expect_cr(pause + 1200); /* of the host's own command, at its end */
        expect_at(0, 0, 0, 0);
        expect_idle();
    }
}

static void paused_still_counts_as_moving(void)
{
    trio_at(80, 80, 80);
    send_code('h');
    sim_run(&rig, 1000);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_PAUSE, 0));
    send_string("c\x03");
    (void)expect_note(DR_NOTE_STOP_IGNORED);
    sim_run(&rig, 1000000);
    expect_nothing();
    TEST_ASSERT_EQUAL(1, rig.c.kept_commands);
    TEST_ASSERT_FALSE(apply(DR_EFFECT_HOME, 0));
    TEST_ASSERT_FALSE(apply(DR_EFFECT_ANGLE, 45));
    TEST_ASSERT_FALSE(apply(DR_EFFECT_STORE_HOME, 0));
    TEST_ASSERT_FALSE(place(0, 1, 1, 1));
    TEST_ASSERT_TRUE(power(false)); /* only power ends it otherwise; the axes stay where they are */
    expect_at(0, 80, 80, 40);
    sim_run(&rig, 1000);
    rig.c.calibrates_at_power_on = false;
    TEST_ASSERT_TRUE(power(true));
    expect_idle();
    expect_at(0, 80, 80, 40);
    send_code('c');
    expect_trio_position(rig.now_us, 80, 80, 40, 30);
    TEST_ASSERT_FALSE(apply(DR_EFFECT_RESUME, 0)); /* forgotten */
    TEST_ASSERT_FALSE(apply(DR_EFFECT_PAUSE, 0));  /* nothing moves */
    expect_idle();
}

static void only_home_and_work_can_be_paused(void)
{
    static const char codes[] = "xSR";
    for (unsigned i = 0; i < 3; i++) {
        trio_at(80, 80, 80);
        if (codes[i] == 'x') {
            send_axis('x', 0);
        } else if (codes[i] == 'S') {
            send_line(15, 0, 0, 0);
        } else {
            send_code('R');
        }
        sim_run(&rig, 100);
        TEST_ASSERT_FALSE(apply(DR_EFFECT_PAUSE, 0));
        TEST_ASSERT_FALSE(apply(DR_EFFECT_RESUME, 0));
        TEST_ASSERT_FALSE(apply(DR_EFFECT_HOME, 0)); /* other buttons are dead during moves */
        TEST_ASSERT_FALSE(apply(DR_EFFECT_STORE_WORK, 0));
        sim_run_out(&rig);
        expect_cr(i < 2 ? 2000 : 206000);
        expect_idle();
    }
    trio_at(80, 80, 80);
    rig.drives[0].work_is_set = true;
    send_code('w');
    sim_run(&rig, 100);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_PAUSE, 0));
    sim_run(&rig, 500);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_RESUME, 0));
    sim_run_out(&rig);
    expect_cr(6500);
    expect_idle();
}

static void the_knob_sets_the_angle(void)
{
    trio_at(0, 0, 0);
    for (unsigned angle = 0; angle < 256; angle++) {
        const uint8_t before = rig.c.angle_deg;
        TEST_ASSERT_EQUAL(angle <= 90, apply(DR_EFFECT_ANGLE, angle));
        TEST_ASSERT_EQUAL(angle <= 90 ? angle : before, rig.c.angle_deg);
    }
    send_code('c');
    expect_trio_position(0, 0, 0, 0, 90);
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_FALSE(apply(DR_EFFECT_ANGLE, 45));
    TEST_ASSERT_FALSE(apply(DR_EFFECT_HOME, 0));
}

/* -- MPC-200 ---------------------------------------------------------------------------------------------------------- */

static void stop_ends_any_move_with_its_one_cr(void)
{
    static const char codes[] = "MSHN";
    for (unsigned i = 0; i < 4; i++) {
        mpc_at(1600, 1600, 1600);
        TEST_ASSERT_FALSE(apply(DR_EFFECT_STOP, 0)); /* nothing moves */
        TEST_ASSERT_FALSE(dr_controller_answers_stop(&rig.c));
        if (codes[i] == 'M') {
            send_point('M', 0, 0, 0);
        } else if (codes[i] == 'S') {
            send_line(15, 0, 0, 0);
        } else {
            send_code(codes[i]);
        }
        sim_run(&rig, 1000);
        uint32_t at[DR_AXES];
        dr_controller_position(&rig.c, 0, sim_clock(&rig), at);
        TEST_ASSERT_TRUE(dr_controller_apply(&rig.c, sim_clock(&rig), DR_EFFECT_STOP, 0));
        TEST_ASSERT_EQUAL(1, dr_controller_ready(&rig.c));
        TEST_ASSERT_TRUE(dr_controller_answers_stop(&rig.c));
        bool first = false;
        TEST_ASSERT_NOT_EQUAL(DR_OP_NONE, dr_controller_answering(&rig.c, &first));
        TEST_ASSERT_NOT_EQUAL(DR_OP_MPC_INTERRUPT, dr_controller_answering(&rig.c, &first));
        sim_pump(&rig);
        expect_cr(1000);
        TEST_ASSERT_FALSE(dr_controller_answers_stop(&rig.c));
        sim_run(&rig, 1000000);
        expect_at(0, at[0], at[1], at[2]);
        expect_idle();
        TEST_ASSERT_EQUAL(codes[i] == 'N' ? DR_UNCALIBRATED : DR_CALIBRATED, rig.drives[0].calibration);
        send_code(3);
        TEST_ASSERT_FALSE(dr_controller_answers_stop(&rig.c));
        expect_cr(rig.now_us);
    }
    mpc_at(1600, 1600, 1600); /* a move that hands began has no CR */
    TEST_ASSERT_TRUE(apply(DR_EFFECT_HOME, 0));
    sim_run(&rig, 1000);
    TEST_ASSERT_FALSE(apply(DR_EFFECT_HOME, 0)); /* only STOP works during moves */
    TEST_ASSERT_FALSE(apply(DR_EFFECT_SELECT, 1));
    TEST_ASSERT_FALSE(apply(DR_EFFECT_MODE, 1));
    TEST_ASSERT_TRUE(apply(DR_EFFECT_STOP, 0));
    sim_run(&rig, 1000000);
    expect_idle();
    TEST_ASSERT_TRUE(apply(DR_EFFECT_HOME, 0));
    sim_run(&rig, 1000);
    send_code(3); /* the host's ^C stops it too, and that is answered */
    expect_cr(rig.now_us);
    expect_idle();
}

static void stop_ends_a_stream_at_a_whole_frame(void)
{
    mpc_at(0, 0, 0);
    send_code('O');
    expect_cr(0);
    rig.byte_us = 78;
    sim_run_to(&rig, 78);
    send_line(15, 160, 0, 0);
    sim_run(&rig, 1000); /* the first micron is leaving since 770 */
    TEST_ASSERT_TRUE(apply(DR_EFFECT_STOP, 0));
    sim_run_out(&rig);
    TEST_ASSERT_EQUAL(1 + 12 + 1, rig.count);
    TEST_ASSERT_EQUAL_HEX8(0x0D, rig.out[13].byte);
    rig.seen = rig.count;
    expect_idle();
}

static void work_button_needs_a_home_before_it(void)
{
    mpc_at(160, 0, 0);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_STORE_WORK, 0));
    TEST_ASSERT_TRUE(rig.drives[0].work_is_set);
    TEST_ASSERT_FALSE(apply(DR_EFFECT_WORK, 0)); /* not at home */
    TEST_ASSERT_TRUE(apply(DR_EFFECT_HOME, 0));
    sim_run_out(&rig);
    expect_at(0, 0, 0, 0);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_WORK, 0));
    sim_run_out(&rig);
    expect_at(0, 160, 0, 0);
    expect_idle();
    send_code('H'); /* the host's Home counts for the button, and the button's for the host */
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_WORK, 0));
    sim_run_out(&rig);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_HOME, 0));
    sim_run_out(&rig);
    send_code('Y');
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    expect_at(0, 160, 0, 0);
    expect_idle();
}

static void the_centre_button_calibrates_or_centres(void)
{
    mpc_at(0, 0, 0);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_CALIBRATE, 0));
    sim_run_to(&rig, 2 * 83334 - 1);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state);
    sim_run(&rig, 1);
    expect_idle();
    prepare(DR_MPC);
    rig.c.firmware = 0x103;
    start();
    TEST_ASSERT_TRUE(apply(DR_EFFECT_CALIBRATE, 0));
    sim_run_out(&rig);
    expect_at(0, 200000, 200000, 200000);
    expect_idle();
}

static void the_selector_and_the_mode_button(void)
{
    prepare(DR_MPC);
    dr_drive_init(&rig.drives[3], DR_STAGE_MPC_MP285);
    start();
    for (unsigned drive = 0; drive < 256; drive++) {
        const bool there = drive == 0 || drive == 1 || drive == 3;
        const uint8_t before = rig.c.active;
        TEST_ASSERT_EQUAL(there, apply(DR_EFFECT_SELECT, drive));
        TEST_ASSERT_EQUAL(there ? drive : before, rig.c.active);
    }
    send_code('C');
    expect_mpc_position(0, 4, 0, 0, 0);
    for (unsigned mode = 0; mode < 256; mode++) {
        TEST_ASSERT_EQUAL(mode <= 9, apply(DR_EFFECT_MODE, mode));
        TEST_ASSERT_EQUAL(mode <= 9 ? mode : 9, rig.drives[3].mode);
    }
    TEST_ASSERT_EQUAL(0, rig.drives[0].mode); /* each drive has its own */
    expect_idle();
}

/* -- Neither ---------------------------------------------------------------------------------------------------------- */

static void each_controller_has_its_own_buttons(void)
{
    static const dr_effect trio_only[] = {DR_EFFECT_ANGLE, DR_EFFECT_STORE_HOME};
    static const dr_effect mpc_only[] = {DR_EFFECT_CALIBRATE, DR_EFFECT_SELECT, DR_EFFECT_MODE};
    mpc_at(0, 0, 0);
    for (unsigned i = 0; i < 2; i++) {
        TEST_ASSERT_FALSE(apply(trio_only[i], 1));
    }
    send_point('M', 1600, 0, 0);
    sim_run(&rig, 10);
    TEST_ASSERT_FALSE(apply(DR_EFFECT_PAUSE, 0));
    TEST_ASSERT_FALSE(apply(DR_EFFECT_RESUME, 0));
    trio_at(0, 0, 0);
    for (unsigned i = 0; i < 3; i++) {
        TEST_ASSERT_FALSE(apply(mpc_only[i], 0));
    }
    send_line(15, 1600, 0, 0);
    sim_run(&rig, 10);
    TEST_ASSERT_FALSE(apply(DR_EFFECT_STOP, 0));
}

static void without_power_or_drive_no_button_works(void)
{
    for (int kind = 0; kind < 2; kind++) {
        for (int effect = DR_EFFECT_HOME; effect <= DR_EFFECT_STORE_WORK; effect++) {
            prepare((dr_kind)kind);
            start();
            TEST_ASSERT_TRUE(power(false));
            TEST_ASSERT_FALSE(apply((dr_effect)effect, 0));
            prepare(DR_MPC);
            dr_drive_init(&rig.drives[0], DR_STAGE_NONE);
            dr_drive_init(&rig.drives[1], DR_STAGE_NONE);
            start();
            TEST_ASSERT_FALSE(apply((dr_effect)effect, 0));
            expect_idle();
        }
    }
}

static void effects_are_noted(void)
{
    mpc_at(0, 0, 0);
    TEST_ASSERT_TRUE(apply(DR_EFFECT_MODE, 7));
    const dr_note note = expect_note(DR_NOTE_HAND);
    TEST_ASSERT_EQUAL_UINT32(DR_EFFECT_MODE, note.value);
    TEST_ASSERT_EQUAL(7, note.bytes[0]);
}

/* -- Rehearsing faults ------------------------------------------------------------------------------------------------- */

static void a_leg_is_spoilt_as_it_begins_and_not_later(void)
{
    mpc_at(0, 0, 0);
    TEST_ASSERT_FALSE(dr_controller_spoil_leg(&rig.c, sim_clock(&rig), DR_X, 2)); /* nothing moves */
    send_point('M', 400000, 0, 0);                                                /* 8.3 s */
    TEST_ASSERT_FALSE(dr_controller_spoil_leg(&rig.c, sim_clock(&rig), DR_X, 300));
    sim_run_out(&rig);
    expect_cr(takes_us(400000, 4, 3000));
    send_point('M', 400016, 32, 0); /* beyond: it stays */
    const uint64_t began_us = rig.now_us;
    TEST_ASSERT_FALSE(dr_controller_spoil_leg(&rig.c, sim_clock(&rig), DR_X, 0));
    TEST_ASSERT_TRUE(dr_controller_spoil_leg(&rig.c, sim_clock(&rig), DR_Y, 10));
    TEST_ASSERT_EQUAL_UINT32(16, rig.c.leg.to[DR_Y]);
    sim_run(&rig, 1);
    TEST_ASSERT_FALSE(dr_controller_spoil_leg(&rig.c, sim_clock(&rig), DR_X, 2));
    sim_run_out(&rig);
    expect_cr(began_us + 10 * takes_us(32, 4, 3000) / 2);
    expect_at(0, 400000, 16, 0);
    expect_idle();
}

static void tests(void)
{
    RUN_TEST(a_leg_is_spoilt_as_it_begins_and_not_later);
    RUN_TEST(home_and_work_buttons_move_without_a_cr);
    RUN_TEST(the_lock_out_holds_for_the_home_button_too);
    RUN_TEST(a_pause_at_any_instant_gains_and_loses_nothing);
    RUN_TEST(paused_still_counts_as_moving);
    RUN_TEST(only_home_and_work_can_be_paused);
    RUN_TEST(the_knob_sets_the_angle);
    RUN_TEST(stop_ends_any_move_with_its_one_cr);
    RUN_TEST(stop_ends_a_stream_at_a_whole_frame);
    RUN_TEST(work_button_needs_a_home_before_it);
    RUN_TEST(the_centre_button_calibrates_or_centres);
    RUN_TEST(the_selector_and_the_mode_button);
    RUN_TEST(each_controller_has_its_own_buttons);
    RUN_TEST(without_power_or_drive_no_button_works);
    RUN_TEST(effects_are_noted);
}

int main(void)
{
    UNITY_BEGIN();
    at_every_clock(tests);
    return UNITY_END();
}
