/* Time is an argument: whoever comes when, in whatever steps, finds the same moves and the same bytes. */
#include "scenario.h"

#include <stdlib.h>
#include <string.h>

/* -- Stopped at every microsecond ------------------------------------------------------------------------------------- */

static uint32_t on_the_way(uint32_t from, uint32_t to, uint64_t elapsed, uint64_t lasts)
{
    if (elapsed >= lasts) {
        return to;
    }
    return to >= from ? from + (uint32_t)((to - from) * elapsed / lasts)
                      : from - (uint32_t)((from - to) * elapsed / lasts);
}

static void a_trio_line_stops_at_every_microsecond(void)
{
    /* X 24 steps up, Y 10 down, Z 1 up at 5,000 um/s: 600 us */
    for (uint32_t t = 0; t <= 600; t++) {
        trio_at(1000, 1000, 1000);
        send_line(15, 1024, 990, 1001);
        sim_run_to(&rig, t);
        send_code(3);
        if (t == 600) {
            expect_cr(600);
        }
        expect_cr(t);
        sim_run(&rig, 5000);
        expect_at(0, on_the_way(1000, 1024, t, 600), on_the_way(1000, 990, t, 600), on_the_way(1000, 1001, t, 600));
        expect_idle();
    }
}

static void mpc_moves_stop_at_every_microsecond(void)
{
    static const char codes[] = "MSHN";
    for (unsigned i = 0; i < 4; i++) {
        /* X 30 steps, Y 20, Z 10; M and H at 3,000 um/s, S at 1,300; diagonal 10: 10 Z is 18 X (18.04) */
        const uint32_t x = 625, leg1 = takes_us(18, 4, 3000), leg2 = takes_us(20, 4, 3000), x2 = takes_us(12, 4, 3000);
        const uint32_t lasts = codes[i] == 'M'   ? x
                               : codes[i] == 'S' ? takes_us(30, 4, 1300)
                               : codes[i] == 'H' ? leg1 + leg2
                                                 : leg1 + leg2 + 2 * 83334;
        for (uint32_t t = 0; t <= (codes[i] == 'N' ? 1000 : lasts); t++) {
            mpc_at(30, 20, 10);
            if (codes[i] == 'M') {
                send_point('M', 0, 0, 0);
            } else if (codes[i] == 'S') {
                send_line(15, 0, 0, 0);
            } else {
                send_code(codes[i]);
            }
            sim_run_to(&rig, t);
            send_code(3);
            if (t == lasts) {
                expect_cr(t);
            }
            expect_cr(t);
            sim_run(&rig, 200000);
            expect_idle();
            if (codes[i] == 'M') {
                expect_at(0, on_the_way(30, 0, t, x), on_the_way(20, 0, t, leg2),
                          on_the_way(10, 0, t, takes_us(10, 4, 3000)));
            } else if (codes[i] == 'S') {
                expect_at(0, on_the_way(30, 0, t, lasts), on_the_way(20, 0, t, lasts), on_the_way(10, 0, t, lasts));
            } else if (t < leg1) {
                expect_at(0, on_the_way(30, 12, t, leg1), 20, on_the_way(10, 0, t, leg1));
            } else {
                expect_at(0, on_the_way(12, 0, t - leg1, x2), on_the_way(20, 0, t - leg1, leg2), 0);
            }
        }
    }
}

/* -- Steps of time ---------------------------------------------------------------------------------------------------- */

static uint64_t seed;

static uint32_t any(uint32_t below)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)((seed >> 32) % below);
}

/* A session: what the host sends and when, some of it too early. */
static void play(dr_kind kind, uint64_t session, bool fidget)
{
    static const char trio[] = "cchwHWSSxyzAR\x03\x03\r!", mpc[] = "CCKUIHYNMMSSSSFOOL\x03\x03\r!";
    for (unsigned turn = 0; turn < 12; turn++) {
        seed = session * 1000 + turn;
        const char *codes = kind == DR_TRIO ? trio : mpc;
        uint8_t frame[DR_FRAME_MAX] = {(uint8_t)codes[any((uint32_t)strlen(codes))]};
        dr_command row;
        const size_t args = dr_command_find(kind, rig.c.firmware, frame[0], &row) ? row.args : 0;
        for (size_t k = 1; k <= args; k++) {
            frame[k] = args == 1 ? (uint8_t)(1 + any(4)) : args == 13 && k == 1 ? (uint8_t)(12 + any(4)) : 0;
        }
        for (size_t k = args == 13 ? 2 : 1; k < args && k + 1 < sizeof frame; k += 4) {
            frame[k] = (uint8_t)any(256);
            frame[k + 1] = (uint8_t)any(3);
        }
        sim_push(&rig, frame, 1 + args);
        sim_pump(&rig);
        const uint64_t until = rig.now_us + any(4) * any(40000);
        uint64_t fidgets = session + turn;
        while (fidget && rig.now_us < until) { /* somebody comes at instants that mean nothing */
            fidgets = fidgets * UINT64_C(6364136223846793005) + 1;
            const uint64_t step = 1 + (fidgets >> 33) % 5000;
            sim_run_to(&rig, rig.now_us + step < until ? rig.now_us + step : until);
            uint32_t at[DR_AXES];
            dr_controller_position(&rig.c, 0, sim_clock(&rig), at);
        }
        sim_run_to(&rig, until);
    }
    sim_run_out(&rig);
}

static void check_steps(dr_kind kind, uint32_t byte_us)
{
    for (uint64_t session = 1; session <= 60; session++) {
        if (kind == DR_TRIO) {
            trio_at(100, 100, 100);
        } else {
            mpc_at(100, 100, 100);
        }
        rig.byte_us = byte_us;
        play(kind, session, false);
        sim_byte *want = rig.out;
        const size_t count = rig.count;
        rig.out = NULL;
        rig.count = rig.room = rig.seen = 0;
        if (kind == DR_TRIO) {
            trio_at(100, 100, 100);
        } else {
            mpc_at(100, 100, 100);
        }
        rig.byte_us = byte_us;
        play(kind, session, true);
        TEST_ASSERT_EQUAL(count, rig.count);
        for (size_t k = 0; k < count; k++) {
            TEST_ASSERT_EQUAL_UINT64(want[k].at_us, rig.out[k].at_us);
            TEST_ASSERT_EQUAL_HEX8(want[k].byte, rig.out[k].byte);
        }
        TEST_ASSERT_TRUE(count > 0);
        free(want);
    }
}

static void more_visits_change_nothing(void)
{
    check_steps(DR_TRIO, 0);
    check_steps(DR_TRIO, 174);
    check_steps(DR_MPC, 0);
    check_steps(DR_MPC, 78);
}

static void one_jump_over_everything_finds_the_same_moves(void)
{
    trio_at(800, 1600, 2400);
    send_code('h');
    sim_jump(&rig, 2000000); /* three legs and the CR are long over */
    send_code('c');
    TEST_ASSERT_EQUAL(15, rig.count);
    expect_cr(2000000);
    expect_trio_position(2000000, 0, 0, 0, 30);
    expect_idle();

    mpc_at(1600, 1600, 1600);
    sim_push(&rig, (const uint8_t *)"HKNC",
             4); /* nobody comes: the kept ones begin when the reply before them has left */
    sim_jump(&rig, 60000000);
    sim_pump(&rig);
    expect_cr(60000000);
    static const uint8_t k[] = {1, 0x21, 3, 0x0D};
    expect(60000000, k, 4);
    expect_nothing(); /* 'N' has begun only now */
    sim_jump(&rig, 2 * 83334);
    sim_pump(&rig);
    expect_cr(60000000 + 2 * 83334);
    expect_mpc_position(60000000 + 2 * 83334, 1, 0, 0, 0);
    expect_idle();
}

static void a_late_caller_gets_the_newest_streamed_position_only(void)
{
    mpc_at(0, 0, 0);
    send_code('O');
    expect_cr(0);
    send_line(15, 16 * 100, 0, 0); /* 100 um, a micron every 769.2 us */
    const uint64_t us = takes_us(1600, 4, 1300);
    sim_jump(&rig, 10000); /* micron 13 is reached, at 10,000 us exactly */
    sim_pump(&rig);
    const uint64_t k = 10000 * 100 / us;
    expect_stream(10000, (uint32_t)(1600 * ((k * us + 99) / 100) / us), 0, 0);
    expect_nothing();
    sim_jump(&rig, 1000000);
    sim_pump(&rig);
    expect_stream(1010000, 1600, 0, 0);
    expect_cr(1010000);
    expect_idle();
}

/* -- Pieces ----------------------------------------------------------------------------------------------------------- */

static void pieces_of_any_size_are_the_same(void)
{
    static const uint8_t session[] = {'O', 'S', 15, 64, 0, 0, 0, 3, 0, 0, 0,    13,  0,   0, 0,   'C', '\r', 'M', 3, 0,
                                      0,   0,   13, 0,  0, 0, 3, 0, 0, 0, 0xEE, 'K', 'I', 2, 'I', 9,   'U',  'L', 3, 3};
    size_t count = 0;
    for (size_t piece = 1; piece <= sizeof session; piece++) {
        for (unsigned pump = 0; pump < 2; pump++) {
            mpc_at(0, 0, 0);
            for (size_t k = 0; k < sizeof session; k += piece) {
                const size_t n = sizeof session - k < piece ? sizeof session - k : piece;
                sim_push(&rig, session + k, n);
                if (pump) {
                    uint8_t byte; /* settles, takes nothing */
                    TEST_ASSERT_EQUAL(0, dr_controller_pull(&rig.c, sim_clock(&rig), &byte, 0));
                }
            }
            sim_run_out(&rig);
            if (count == 0) {
                count = rig.count;
            }
            TEST_ASSERT_EQUAL(count, rig.count);
            TEST_ASSERT_EQUAL(1, rig.c.unknown_bytes);
            TEST_ASSERT_EQUAL(8, rig.c.kept_commands);
            expect_at(0, 3, 13, 3);
        }
    }
}

/* -- Idle ------------------------------------------------------------------------------------------------------------- */

static void a_month_of_idle_leaves_no_trace(void)
{
    static const uint64_t spans[] = {UINT64_C(0x7FFFFFFF), UINT64_C(0x80000000),  UINT64_C(0x80000001),
                                     UINT64_C(0xFFFFFFFF), UINT64_C(0x100000000), UINT64_C(30) * 24 * 3600 * 1000000};
    for (unsigned i = 0; i < sizeof spans / sizeof spans[0]; i++) {
        for (unsigned visited = 0; visited < 2; visited++) {
            mpc_at(0, 0, 0);
            send_code('O');
            expect_cr(0);
            send_line(15, 16, 0, 0);
            sim_run_out(&rig);
            rig.seen = rig.count;
            TEST_ASSERT_TRUE(rig.visits < 10);
            for (uint64_t gone = 0; gone < spans[i]; gone += UINT64_C(3600000000)) {
                const uint64_t rest = spans[i] - gone;
                sim_jump(&rig, rest < UINT64_C(3600000000) ? rest : UINT64_C(3600000000));
                if (visited) {
                    sim_pump(&rig);
                    expect_idle();
                }
            }
            dr_us when;
            TEST_ASSERT_FALSE(dr_controller_due(&rig.c, &when));
            expect_at(0, 16, 0, 0);
            const uint64_t t = rig.now_us;
            send_point('M', 0, 0, 0);
            sim_run_out(&rig);
            expect_cr(t + takes_us(16, 4, 3000));
            expect_idle();
        }
    }
}

static void the_longest_move_ends_in_time(void)
{
    prepare(DR_MPC);
    dr_drive_init(&rig.drives[0], DR_STAGE_MPC_MP865);
    start();
    send_line(0, 1066667, 266667, 533333); /* 50 mm at 81.25 um/s: ten minutes */
    sim_run_to(&rig, 615384807);
    expect_nothing();
    sim_run_out(&rig);
    expect_cr(615384808);
    expect_at(0, 1066667, 266667, 533333);
    TEST_ASSERT_TRUE(rig.visits < 10); /* nothing ticks */
}

static void a_copy_goes_on_alike(void)
{
    mpc_at(0, 0, 0);
    send_line(15, 1600, 800, 0);
    sim_run(&rig, 12345);
    send_string("CM1");
    dr_controller copy = rig.c;
    dr_drive drives[DR_PORTS];
    memcpy(drives, rig.drives, sizeof drives);
    copy.drives = drives;
    copy.notes = NULL;
    sim_run_out(&rig);
    uint8_t bytes[64];
    TEST_ASSERT_EQUAL(15, dr_controller_pull(&copy, sim_clock(&rig), bytes, sizeof bytes));
    for (size_t k = 0; k < 15; k++) {
        TEST_ASSERT_EQUAL_HEX8(rig.out[k].byte, bytes[k]);
    }
    TEST_ASSERT_EQUAL(2, copy.framer.have);
}

static void tests(void)
{
    RUN_TEST(a_trio_line_stops_at_every_microsecond);
    RUN_TEST(mpc_moves_stop_at_every_microsecond);
    RUN_TEST(more_visits_change_nothing);
    RUN_TEST(one_jump_over_everything_finds_the_same_moves);
    RUN_TEST(a_late_caller_gets_the_newest_streamed_position_only);
    RUN_TEST(pieces_of_any_size_are_the_same);
    RUN_TEST(a_month_of_idle_leaves_no_trace);
    RUN_TEST(the_longest_move_ends_in_time);
    RUN_TEST(a_copy_goes_on_alike);
}

int main(void)
{
    UNITY_BEGIN();
    at_every_clock(tests);
    return UNITY_END();
}
