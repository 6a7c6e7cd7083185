/* The quirks that live in the core: PROTOCOL.md, section 4. Each is shown on, and that it is off by default. */
#include "scenario.h"

static void mpc_with(uint16_t quirks, uint32_t x, uint32_t y, uint32_t z)
{
    prepare(DR_MPC);
    rig.c.quirks = quirks;
    rig.drives[0].position_steps[0] = x;
    rig.drives[0].position_steps[1] = y;
    rig.drives[0].position_steps[2] = z;
    start();
}

static void trio_with(uint16_t quirks, uint32_t x, uint32_t y, uint32_t z)
{
    prepare(DR_TRIO);
    dr_drive_init(&rig.drives[0], DR_STAGE_TRIO_MP285);
    rig.c.quirks = quirks;
    rig.drives[0].position_steps[0] = x;
    rig.drives[0].position_steps[1] = y;
    rig.drives[0].position_steps[2] = z;
    start();
}

static void power_cycle(void)
{
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_TRUE(power(true));
}

static void none_is_on_by_default(void)
{
    for (int kind = 0; kind < 2; kind++) {
        prepare((dr_kind)kind);
        TEST_ASSERT_EQUAL_HEX16(0, rig.c.quirks);
    }
}

static void small_moves_are_silent(void)
{
    for (unsigned on = 0; on < 2; on++) {
        mpc_with(on ? DR_QUIRK_SMALL_MOVE_SILENT : 0, 100, 100, 100);
        send_point('M', 115, 85, 100); /* 15 steps at most */
        sim_run(&rig, 1000000);
        expect_at(0, on ? 100 : 115, on ? 100 : 85, 100);
        on ? expect_nothing() : expect_cr(takes_us(15, 4, 3000));
        send_line(15, 100, 100, 100);
        sim_run(&rig, 1000000);
        on ? expect_nothing() : expect_cr(1000000 + takes_us(15, 4, 1300));
        expect_at(0, 100, 100, 100);
        if (on) {
            (void)expect_note(DR_NOTE_SMALL_MOVE);
        }
        const uint64_t t = rig.now_us;
        send_point('M', 100, 116, 100); /* 16 steps are enough */
        sim_run(&rig, 1000000);
        expect_cr(t + takes_us(16, 4, 3000));
        send_code('H'); /* only 'M' and 'S' are meant: home comes from anywhere */
        sim_run_out(&rig);
        expect_cr(rig.now_us);
        expect_idle();
    }
    mpc_with(DR_QUIRK_SMALL_MOVE_SILENT, 100, 100, 100); /* the next kept command does not wait for its CR */
    send_string("C");
    rig.seen = rig.count;
    sim_push(&rig, (const uint8_t *)"CM\x64\0\0\0\x64\0\0\0\x64\0\0\0K", 15);
    sim_pump(&rig);
    TEST_ASSERT_EQUAL(rig.seen + 14 + 4, rig.count);
    trio_with(DR_QUIRK_SMALL_MOVE_SILENT, 100, 100, 100); /* not on a TRIO */
    send_axis('x', 101);
    sim_run_out(&rig);
    expect_cr(25);
    expect_idle();
}

/* 'S' of 16 steps in X, with pauses after the letter and after the speed byte. */
static void line_with_pauses(uint32_t after_letter, uint32_t after_speed)
{
    static const uint8_t rest[12] = {16};
    send_code('S');
    if (after_letter > 0) {
        dr_controller_paused(&rig.c, after_letter);
    }
    send_code(15);
    if (after_speed > 0) {
        dr_controller_paused(&rig.c, after_speed);
    }
    send(rest, 12);
}

static void lines_need_a_pause(void)
{
    static const uint32_t pauses[][2] = {{20000, 0},     {0, 20000}, {10000, 10000}, {30000, 0}, {0, 30000},
                                         {40000, 40000}, {0, 0},     {19999, 0},     {0, 19999}, {10000, 9999}};
    for (unsigned on = 0; on < 2; on++) {
        for (unsigned i = 0; i < 10; i++) {
            mpc_with(on ? DR_QUIRK_S_NEEDS_PAUSE : 0, 0, 0, 0);
            dr_controller_paused(&rig.c, 50000); /* before the command: does not count */
            line_with_pauses(pauses[i][0], pauses[i][1]);
            sim_run(&rig, 1000000);
            if (!on || i < 6) {
                expect_cr(takes_us(16, 4, 1300));
                expect_at(0, 16, 0, 0);
                expect_idle();
            } else {
                expect_at(0, 0, 0, 0);
                send_string("CKU\x03H");
                sim_run(&rig, 10000000);
                expect_nothing(); /* silent ... */
                TEST_ASSERT_EQUAL(DR_STATE_WEDGED, rig.c.state);
                (void)expect_note(DR_NOTE_WEDGED);
                power_cycle(); /* ... until a power cycle */
                send_code('C');
                expect_mpc_position(rig.now_us, 1, 0, 0, 0);
                expect_idle();
            }
        }
    }
    mpc_with(DR_QUIRK_S_NEEDS_PAUSE, 0, 0, 0); /* it strikes during a move, too, and the pauses add up without a wrap */
    dr_controller_paused(&rig.c, UINT32_MAX);
    send_point('M', 1600, 0, 0);
    sim_run(&rig, 100);
    send_code('S');
    dr_controller_paused(&rig.c, UINT32_MAX);
    send_code(15);
    dr_controller_paused(&rig.c, UINT32_MAX);
    send((const uint8_t *)"\0\0\0\0\0\0\0\0\0\0\0\0", 12);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state);
    line_with_pauses(0, 0);
    TEST_ASSERT_EQUAL(DR_STATE_WEDGED, rig.c.state);
    sim_run(&rig, 1000000);
    expect_nothing();
    trio_with(DR_QUIRK_S_NEEDS_PAUSE, 0, 0, 0); /* a TRIO wants no pause inside */
    send_line(15, 16, 0, 0);
    sim_run_out(&rig);
    expect_cr(400);
}

static void speeds_can_be_the_measured_ones(void)
{
    static const uint32_t um_per_s[16] = {338, 361, 383, 412, 441,  478,  523,  573,
                                          638, 718, 815, 958, 1139, 1404, 1890, 2767};
    for (unsigned level = 0; level < 16; level++) {
        mpc_with(DR_QUIRK_MEASURED_SPEEDS, 0, 0, 0);
        send_line(level, 16000, 100, 0);
        sim_run_out(&rig);
        expect_cr(takes_us(16000, 4, um_per_s[level]));
    }
    mpc_with(DR_QUIRK_MEASURED_SPEEDS, 1600, 0, 0);
    send_point('M', 0, 0, 0);
    sim_run_out(&rig);
    const uint64_t t = takes_us(1600, 4, 4650);
    expect_cr(t);
    send_code('N');
    sim_run_out(&rig);
    expect_cr(t + 2 * 53764);                     /* 250 um at 4,650 um/s: 53,763.4 us */
    trio_with(DR_QUIRK_MEASURED_SPEEDS, 0, 0, 0); /* of an MPC-200 */
    send_line(0, 100, 0, 0);
    sim_run_out(&rig);
    expect_cr(40000);
}

static void the_first_second_can_be_deaf(void)
{
    mpc_with(DR_QUIRK_BOOT_SECOND, 0, 0, 0);
    send_code('C'); /* not at the start of a program: it has been on for a while */
    expect_mpc_position(0, 1, 0, 0, 0);
    power_cycle();
    TEST_ASSERT_EQUAL(DR_STATE_BOOTING, rig.c.state);
    dr_us when;
    TEST_ASSERT_TRUE(dr_controller_due(&rig.c, &when));
    TEST_ASSERT_EQUAL_UINT32(sim_clock(&rig) + 1000000, when);
    sim_run_to(&rig, 999999);
    send_string("CKM");
    sim_run(&rig, 1);
    expect_idle();
    send_code('C');
    expect_mpc_position(1000000, 1, 0, 0, 0);
    expect_idle();

    trio_with(DR_QUIRK_BOOT_SECOND, 0, 0, 0);
    power_cycle();
    sim_run_to(&rig, 999999);
    send_code('c');
    sim_run_to(&rig, 1000000);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state); /* then it calibrates */
    send_code('c');
    sim_run_out(&rig);
    expect_trio_position(1200000, 8000, 8000, 8000, 30);
    expect_idle();
    power_cycle();
    sim_run(&rig, 10);
    TEST_ASSERT_TRUE(power(false)); /* switched off again in between */
    sim_run(&rig, 5000000);
    TEST_ASSERT_EQUAL(DR_STATE_OFF, rig.c.state);
}

static void streaming_can_be_on_from_the_start(void)
{
    mpc_with(DR_QUIRK_STREAM_AT_POWER_UP, 0, 0, 0);
    for (unsigned cycle = 0; cycle < 2; cycle++) {
        TEST_ASSERT_TRUE(rig.c.streaming);
        const uint64_t t = rig.now_us;
        send_line(15, cycle ? 0 : 16, 0, 0);
        sim_run_out(&rig);
        expect_stream(t + takes_us(16, 4, 1300), cycle ? 0 : 16, 0, 0);
        expect_cr(t + takes_us(16, 4, 1300));
        send_code('F');
        expect_cr(rig.now_us);
        TEST_ASSERT_FALSE(rig.c.streaming);
        power_cycle();
    }
    mpc_with(0, 0, 0, 0);
    send_code('O');
    expect_cr(0);
    power_cycle();
    TEST_ASSERT_FALSE(rig.c.streaming); /* off at power-up */
}

static void negative_targets_can_run_for_ever(void)
{
    for (unsigned i = 0; i < 2; i++) {
        mpc_with(DR_QUIRK_ENDLESS_NEGATIVE, 1600, 1600, 1600);
        if (i == 0) {
            send_point('M', UINT32_C(0x80000000), 1700, 1600);
        } else {
            send_line(15, UINT32_MAX, 1700, 1600);
        }
        sim_run(&rig, 100000000);
        expect_nothing();
        expect_at(0, 0, 1700, 1600);
        TEST_ASSERT_EQUAL(DR_STATE_STRANDED, rig.c.state);
        (void)expect_note(DR_NOTE_STRANDED);
        dr_us when;
        TEST_ASSERT_FALSE(dr_controller_due(&rig.c, &when));
        send_code('C'); /* it still believes that it moves */
        expect_nothing();
        send_code(3);
        expect_cr(rig.now_us);
        expect_mpc_position(rig.now_us, 1, 0, 1700, 1600);
        expect_idle();
        send_point('M', 0x7FFFFFFF, 1700, 1600); /* large, but not negative */
        sim_run_out(&rig);
        expect_cr(rig.now_us);
        expect_at(0, 400000, 1700, 1600);
        send_point('M', UINT32_MAX, UINT32_MAX, UINT32_MAX);
        sim_run(&rig, 1000);
        send_code(3); /* stopped on the way */
        expect_cr(rig.now_us);
        expect_idle();
        send_point('M', UINT32_MAX, UINT32_MAX, UINT32_MAX);
        sim_run(&rig, 100000000);
        expect_nothing();
        power_cycle();
        send_code('C');
        expect_mpc_position(rig.now_us, 1, 0, 0, 0);
        expect_idle();
    }
    trio_with(DR_QUIRK_ENDLESS_NEGATIVE, 40, 40, 40);
    rig.c.calibrates_at_power_on = false;
    send_axis('y', UINT32_MAX);
    sim_run(&rig, 500);
    send_code(3); /* it moves, and a TRIO stops 'S' only */
    sim_run(&rig, 1000000);
    expect_nothing();
    expect_at(0, 40, 0, 40);
    send_code(3); /* it only fails to answer */
    expect_cr(rig.now_us);
    expect_idle();
    send_point('H', UINT32_MAX, 80, 80);
    sim_run(&rig, 1000000);
    expect_nothing();
    expect_at(0, 0, 80, 80);
    power_cycle();
    send_code('c');
    expect_trio_position(rig.now_us, 0, 80, 80, 30);
    expect_idle();
}

static void interrupt_can_be_a_pause(void)
{
    mpc_with(DR_QUIRK_PAUSE_ON_STOP, 0, 0, 0);
    send_point('M', 1600, 800, 0);
    sim_run_to(&rig, 10000);
    send_code(3);
    expect_cr(10000);
    expect_at(0, 480 - 1, 480 - 1, 0); /* floor(1600 * 10000 / 33334), floor(800 * 10000 / 16667) */
    sim_run(&rig, 1000000);
    expect_at(0, 479, 479, 0);
    TEST_ASSERT_TRUE(rig.c.move_is_paused);
    send_code('C'); /* queries go on */
    expect_mpc_position(1010000, 1, 479, 479, 0);
    send_line(0, 5, 5, 5); /* dropped: the old move goes on, at its own speeds */
    (void)expect_note(DR_NOTE_RESUMED);
    sim_run_out(&rig);
    expect_cr(1010000 + takes_us(1600 - 479, 4, 3000));
    expect_at(0, 1600, 800, 0);
    TEST_ASSERT_FALSE(rig.c.move_is_paused);
    expect_idle();
    const uint64_t t = rig.now_us;
    send_point('M', 1584, 800, 0); /* and the next one is itself again */
    sim_run_out(&rig);
    expect_cr(t + takes_us(16, 4, 3000));
    expect_at(0, 1584, 800, 0);

    trio_with(DR_QUIRK_PAUSE_ON_STOP, 0, 0, 0);
    rig.c.calibrates_at_power_on = false;
    send_line(15, 400, 0, 0);
    sim_run_to(&rig, 5000);
    send_code(3);
    expect_cr(5000);
    send_axis('y', 100);
    sim_run_out(&rig);
    expect_cr(10000);
    expect_at(0, 400, 0, 0);
    send_line(15, 0, 0, 0);
    sim_run(&rig, 5000);
    send_code(3);
    expect_cr(15000);
    power_cycle(); /* forgets it */
    send_axis('y', 40);
    sim_run_out(&rig);
    expect_cr(16000);
    expect_at(0, 200, 40, 0);
    expect_idle();
}

static void a_query_during_a_move_can_wedge(void)
{
    mpc_with(DR_QUIRK_QUERY_WEDGES, 0, 0, 0);
    send_code('C'); /* at rest it is harmless */
    expect_mpc_position(0, 1, 0, 0, 0);
    send_point('M', 1600, 0, 0);
    sim_run(&rig, 100);
    send_string("KU"); /* so are other queries */
    send_code('C');
    TEST_ASSERT_EQUAL(DR_STATE_WEDGED, rig.c.state);
    sim_run(&rig, 10000000);
    expect_at(0, 1600 * 100 / 33334, 0, 0); /* it stopped where it was */
    send_string("\x03KC");
    sim_run(&rig, 1000000);
    expect_nothing();
    power_cycle();
    send_code('K');
    TEST_ASSERT_EQUAL(rig.seen + 4, rig.count);

    trio_with(DR_QUIRK_QUERY_WEDGES, 0, 0, 0);
    send_axis('x', 400);
    sim_run(&rig, 100);
    send_code('c');
    sim_run(&rig, 1000000);
    expect_nothing();
    TEST_ASSERT_EQUAL(DR_STATE_WEDGED, rig.c.state);
}

static void quirks_can_change_at_any_time(void)
{
    mpc_with(0, 0, 0, 0);
    rig.c.quirks = DR_QUIRK_SMALL_MOVE_SILENT;
    send_point('M', 1, 1, 1);
    sim_run_out(&rig);
    expect_nothing();
    rig.c.quirks = 0;
    send_point('M', 1, 1, 1);
    sim_run_out(&rig);
    expect_cr(21);
}

static void tests(void)
{
    RUN_TEST(none_is_on_by_default);
    RUN_TEST(small_moves_are_silent);
    RUN_TEST(lines_need_a_pause);
    RUN_TEST(speeds_can_be_the_measured_ones);
    RUN_TEST(the_first_second_can_be_deaf);
    RUN_TEST(streaming_can_be_on_from_the_start);
    RUN_TEST(negative_targets_can_run_for_ever);
    RUN_TEST(interrupt_can_be_a_pause);
    RUN_TEST(a_query_during_a_move_can_wedge);
    RUN_TEST(quirks_can_change_at_any_time);
}

int main(void)
{
    UNITY_BEGIN();
    at_every_clock(tests);
    return UNITY_END();
}
