/* instrument: the paced line, quirks of bytes and running in steps, in virtual time. Byte times are worked out by hand from
 * the baud rates of [T table 3] and [M table 5]: 10 bits at 57,600 baud are 173.6111 us, at 128,000 baud 78.125 us. */
#include "instrument.h"

#include "unity.h"

#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))
#define LOG_MAX 40000u

/* -- A bench: an instrument, and a log of each byte that has left and when ---------------------------------------------- */

typedef struct {
    uint64_t when_us;
    uint8_t byte;
} sent;

typedef struct {
    instrument ins;
    dr_drive drives[DR_PORTS];
    sent log[LOG_MAX]; /* the first of them */
    size_t logged;
    uint64_t start_us;
    uint64_t digest; /* of all bytes and when they left since the start */
} bench;

static bench b, other;

void setUp(void) {}
void tearDown(void) {}

static void set_up(bench *w, dr_kind kind, bool is_paced, uint64_t start_us)
{
    memset(w, 0, sizeof *w);
    dr_drive_init(&w->drives[0], kind == DR_TRIO ? DR_STAGE_TRIO_MP845 : DR_STAGE_MPC_MP225);
    dr_controller_init(&w->ins.controller, kind, w->drives, 1);
    w->ins.is_paced = is_paced;
    w->start_us = start_us;
    instrument_start(&w->ins, start_us);
}

static void run_to(bench *w, uint64_t until_us)
{
    uint8_t bytes[64];
    size_t count;
    while (instrument_run(&w->ins, until_us, bytes, sizeof bytes, &count))
        for (size_t i = 0; i < count; i++, w->logged++) {
            w->digest = (w->digest ^ (w->ins.now_us - w->start_us) << 8 ^ bytes[i]) * UINT64_C(0x9E3779B97F4A7C15);
            w->digest ^= w->digest >> 29;
            if (w->logged < LOG_MAX)
                w->log[w->logged] = (sent){w->ins.now_us, bytes[i]};
        }
    TEST_ASSERT_EQUAL_UINT64(until_us, w->ins.now_us);
}

static void say_after_pause(bench *w, uint32_t pause_us, const void *bytes, size_t count)
{
    TEST_ASSERT_EQUAL_UINT64(count, instrument_take(&w->ins, pause_us, bytes, count));
}

static void say(bench *w, const void *bytes, size_t count) { say_after_pause(w, 0, bytes, count); }

/* A frame of a command with a point in microsteps behind `head`. */
static size_t frame_of(uint8_t *frame, const char *head, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t point[DR_AXES] = {x, y, z};
    size_t at = strlen(head);
    memcpy(frame, head, at);
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        for (unsigned byte = 0; byte < 4; byte++)
            frame[at++] = (uint8_t)(point[axis] >> 8 * byte);
    return at;
}

static void check_sent(const bench *w, size_t at, uint64_t when_us, uint8_t byte)
{
    TEST_ASSERT_LESS_THAN(w->logged, at);
    TEST_ASSERT_EQUAL_UINT64(when_us, w->log[at].when_us);
    TEST_ASSERT_EQUAL_HEX8(byte, w->log[at].byte);
}

/* -- The line ---------------------------------------------------------------------------------------------------------- */

static void a_trio_reply_takes_14_byte_times_and_does_not_drift(void)
{
    set_up(&b, DR_TRIO, true, 0);
    say(&b, "c", 1);
    run_to(&b, 1000000);
    TEST_ASSERT_EQUAL(14, b.logged);
    const uint64_t arrived = 174; /* 173.61, rounded up */
    static const uint64_t through[] = {174, 348, 521, 695, 869, 1042, 1216, 1389, 1563, 1737, 1910, 2084, 2257, 2431};
    for (size_t i = 0; i < 14; i++)
        TEST_ASSERT_EQUAL_UINT64(arrived + through[i], b.log[i].when_us);
    check_sent(&b, 12, arrived + through[12], 30); /* the angle */
    check_sent(&b, 13, arrived + through[13], 0x0D);
}

static void an_mpc_reply_takes_14_byte_times(void)
{
    set_up(&b, DR_MPC, true, 5);
    say(&b, "C", 1);
    run_to(&b, 1000000);
    TEST_ASSERT_EQUAL(14, b.logged);
    check_sent(&b, 0, 5 + 79 + 79, 1);
    check_sent(&b, 7, 5 + 79 + 625, 0);
    check_sent(&b, 13, 5 + 79 + 1094, 0x0D);
}

static void a_move_begins_when_its_last_byte_has_arrived(void)
{
    uint8_t frame[DR_FRAME_MAX];
    set_up(&b, DR_MPC, true, 0);
    say(&b, frame, frame_of(frame, "M", 48000, 0, 0)); /* 3,000 um at 3 mm/s: one second */
    run_to(&b, 3000000);
    TEST_ASSERT_EQUAL(1, b.logged);
    check_sent(&b, 0, 1016 + 1000000 + 79, 0x0D); /* 13 bytes are 1,015.625 us */
}

static void bytes_of_one_busy_period_are_counted_from_its_start(void)
{
    set_up(&b, DR_MPC, true, 0);
    say(&b, "\xEE", 1);
    run_to(&b, 79); /* the instant at which it is through */
    say(&b, "\x03", 1);
    run_to(&b, 1000);
    check_sent(&b, 0, 157 + 79, 0x0D); /* 156.25, not 79 + 79 = 158 */
    say(&b, "\x03", 1);                /* a new period */
    run_to(&b, 2000);
    check_sent(&b, 1, 1000 + 79 + 79, 0x0D);
}

static void replies_that_wait_leave_without_a_gap(void)
{
    set_up(&b, DR_MPC, true, 0);
    say(&b, "CC", 2); /* the second arrives while the first is being answered */
    run_to(&b, 10000);
    TEST_ASSERT_EQUAL(28, b.logged);
    check_sent(&b, 13, 79 + 1094, 0x0D);
    check_sent(&b, 27, 79 + 2188, 0x0D); /* 28 x 78.125 = 2,187.5 */
}

static void an_unpaced_line_takes_no_time(void)
{
    set_up(&b, DR_MPC, false, 77);
    say(&b, "CU", 2);
    run_to(&b, 77);
    TEST_ASSERT_EQUAL(20, b.logged);
    for (size_t i = 0; i < 20; i++)
        TEST_ASSERT_EQUAL_UINT64(77, b.log[i].when_us);
}

static void an_unpaced_line_loses_no_command_of_a_burst(void)
{
    set_up(&b, DR_MPC, false, 0);
    for (unsigned i = 0; i < 10; i++) {
        say(&b, "CCCCCCCCCCCCCCCCCCCC", 20);
        run_to(&b, i);
    }
    TEST_ASSERT_EQUAL(10 * 20 * 14, b.logged);
    TEST_ASSERT_EQUAL(0, b.ins.controller.lost_bytes);
}

static void the_line_takes_no_more_than_it_has_room_for(void)
{
    static const uint8_t many[INSTRUMENT_LINE_MAX + 1] = {0};
    set_up(&b, DR_MPC, true, 0);
    TEST_ASSERT_EQUAL(INSTRUMENT_LINE_MAX, instrument_room(&b.ins));
    TEST_ASSERT_EQUAL(INSTRUMENT_LINE_MAX, instrument_take(&b.ins, 0, many, sizeof many));
    TEST_ASSERT_EQUAL(0, instrument_room(&b.ins));
    TEST_ASSERT_EQUAL(0, instrument_take(&b.ins, 0, many, sizeof many));
    run_to(&b, 782); /* ten bytes: 781.25 us */
    TEST_ASSERT_EQUAL(10, instrument_room(&b.ins));
    run_to(&b, 20000); /* 256 bytes: 20,000 us */
    TEST_ASSERT_EQUAL(INSTRUMENT_LINE_MAX, b.ins.controller.unknown_bytes);
}

static void nothing_is_due_while_nothing_happens(void)
{
    uint64_t when;
    set_up(&b, DR_MPC, true, 0);
    TEST_ASSERT_FALSE(instrument_due(&b.ins, &when));
    run_to(&b, UINT64_C(1) << 40);
    TEST_ASSERT_FALSE(instrument_due(&b.ins, &when));
    say(&b, "\x03", 1);
    TEST_ASSERT_TRUE(instrument_due(&b.ins, &when));
    TEST_ASSERT_EQUAL_UINT64((UINT64_C(1) << 40) + 79, when);
}

static void what_was_leaving_when_the_power_went_does_not_leave(void)
{
    set_up(&b, DR_MPC, true, 0);
    say(&b, "C", 1);
    run_to(&b, 79 + 500); /* 6 of 14 bytes */
    TEST_ASSERT_EQUAL(6, b.logged);
    const dr_hand off = {.what = DR_HAND_POWER_OFF}, on = {.what = DR_HAND_POWER_ON};
    TEST_ASSERT_TRUE(dr_controller_poke(&b.ins.controller, (dr_us)b.ins.now_us, &off));
    run_to(&b, 5000);
    TEST_ASSERT_EQUAL(6, b.logged);
    TEST_ASSERT_TRUE(dr_controller_poke(&b.ins.controller, (dr_us)b.ins.now_us, &on));
    say(&b, "\x03", 1);
    run_to(&b, 6000);
    check_sent(&b, 6, 5000 + 79 + 79, 0x0D);
}

/* -- Streaming --------------------------------------------------------------------------------------------------------- */

static uint32_t streamed_x(const bench *w, size_t at)
{
    return w->log[at + 3].byte | (uint32_t)w->log[at + 4].byte << 8 | (uint32_t)w->log[at + 5].byte << 16;
}

static void stream(bench *w, uint8_t level, uint32_t x_steps)
{
    uint8_t frame[DR_FRAME_MAX];
    say(w, "O", 1);
    run_to(w, w->ins.now_us + 10000);
    (void)frame_of(frame, "S?", x_steps, 0, 0);
    frame[1] = level;
    say_after_pause(w, 30000, frame, sizeof frame);
}

static void unpaced_microns_fall_where_arithmetic_puts_them(void)
{
    set_up(&b, DR_MPC, false, 0);
    stream(&b, 15, 16000); /* 1,000 um at 1,300 um/s: 769,231 us */
    run_to(&b, 2000000);
    TEST_ASSERT_EQUAL(1 + 1000 * 12 + 1, b.logged);
    for (uint64_t k = 1; k <= 1000; k++) {
        const size_t at = 1 + (size_t)(k - 1) * 12;
        TEST_ASSERT_EQUAL_UINT64(10000 + (k * 769231 + 999) / 1000, b.log[at].when_us);
        TEST_ASSERT_EQUAL_HEX8(0xFF, b.log[at].byte);
        TEST_ASSERT_EQUAL_UINT64(
            k * 16, streamed_x(&b, at)); /* rounded up in time: the micron is reached, not passed by a step */
    }
    check_sent(&b, 12001, 10000 + 769231, 0x0D);
}

static void a_paced_stream_fills_the_line_and_skips_what_does_not_fit(void)
{
    set_up(&b, DR_MPC, true, 0);
    stream(&b, 15, 16000);
    run_to(&b, 2000000);
    /* The line carries a frame in 937.5 us; a micron takes 769.231 us. The first leaves from 10,000 + 1,094 + 770 on. */
    const uint64_t first = 10000 + 1094 + 770;
    const size_t frames = (b.logged - 2) / 12;
    TEST_ASSERT_EQUAL(0, (b.logged - 2) % 12);
    for (size_t i = 0; i < frames; i++) {
        const size_t at = 1 + i * 12;
        const uint64_t begins_2 = 2 * first + i * 1875; /* in half microseconds */
        TEST_ASSERT_EQUAL_UINT64((begins_2 + 1875 + 1) / 2, b.log[at + 11].when_us);
        /* Composed when the one before had left: the newest whole micron then. */
        const uint64_t composed = i == 0 ? first : b.log[at - 1].when_us;
        const uint64_t micron = (composed - 10000 - 1094) * 1000 / 769231;
        TEST_ASSERT_EQUAL_UINT64(micron, streamed_x(&b, at) / 16);
    }
    TEST_ASSERT_EQUAL_HEX8(0x0D, b.log[b.logged - 1].byte);
    /* The CR is not delayed beyond one frame. */
    TEST_ASSERT_LESS_OR_EQUAL_UINT64(10000 + 1094 + 769231 + 938 + 79, b.log[b.logged - 1].when_us);
}

/* -- Quirks of bytes --------------------------------------------------------------------------------------------------- */

static void position_13_leaves_the_drive_out(void)
{
    for (unsigned paced = 0; paced < 2; paced++) {
        set_up(&b, DR_MPC, paced == 1, 0);
        b.drives[0].position_steps[DR_X] = 0x01020304;
        b.ins.quirks = INSTRUMENT_POSITION_13;
        say(&b, "CKC", 3);
        run_to(&b, 100000);
        TEST_ASSERT_EQUAL(13 + 4 + 13, b.logged);
        TEST_ASSERT_EQUAL_HEX8(0x04, b.log[0].byte);
        TEST_ASSERT_EQUAL_HEX8(0x0D, b.log[12].byte);
        TEST_ASSERT_EQUAL_HEX8(0x01, b.log[13].byte); /* 'K' keeps its drive */
        TEST_ASSERT_EQUAL_HEX8(0x04, b.log[17].byte);
        if (paced == 1)
            TEST_ASSERT_EQUAL_UINT64(79 + 1016, b.log[12].when_us); /* 13 byte times */
    }
}

static void stop_says_i_puts_an_i_before_the_cr(void)
{
    uint8_t frame[DR_FRAME_MAX];
    for (unsigned paced = 0; paced < 2; paced++) {
        set_up(&b, DR_MPC, paced == 1, 0);
        b.ins.quirks = INSTRUMENT_STOP_SAYS_I;
        say(&b, "\x03\x03", 2);
        run_to(&b, 10000);
        say(&b, frame, frame_of(frame, "M", 48000, 0, 0));
        run_to(&b, 500000);
        say(&b, "\x03", 1);
        run_to(&b, 2000000);
        say(&b, "K", 1);
        run_to(&b, 3000000);
        static const uint8_t expected[] = {'I', 0x0D, 'I', 0x0D, 'I', 0x0D, 1, 0x21, 0x03, 0x0D};
        TEST_ASSERT_EQUAL(sizeof expected, b.logged);
        for (size_t i = 0; i < sizeof expected; i++)
            TEST_ASSERT_EQUAL_HEX8(expected[i], b.log[i].byte);
    }
}

/* STOP during a host's move: 'I' alone, and the move's CR never comes. What was kept behind the move is answered next. */
static void stop_says_i_puts_an_i_in_the_place_of_the_cr_that_the_stop_button_causes(void)
{
    uint8_t frame[DR_FRAME_MAX];
    for (unsigned quirky = 0; quirky < 2; quirky++)
        for (unsigned paced = 0; paced < 2; paced++) {
            set_up(&b, DR_MPC, paced == 1, 0);
            b.ins.quirks = quirky == 1 ? INSTRUMENT_STOP_SAYS_I : 0;
            say(&b, frame, frame_of(frame, "M", 48000, 0, 0));
            run_to(&b, 400000);
            say(&b, "K", 1);
            run_to(&b, 500000);
            TEST_ASSERT_TRUE(dr_panel_press(&b.ins.panel, instrument_now(&b.ins), DR_BUTTON_STOP));
            run_to(&b, 600000);
            check_sent(&b, 0, 500000 + paced * 79, quirky == 1 ? 'I' : 0x0D);
            check_sent(&b, 1, 500000 + paced * 157, 1); /* the line goes on without a gap */
            TEST_ASSERT_EQUAL(5, b.logged);
            TEST_ASSERT_TRUE(dr_panel_release(&b.ins.panel, instrument_now(&b.ins), DR_BUTTON_STOP));
            say(&b, "\x03", 1); /* and ^C is answered as ever */
            run_to(&b, 1000000);
            TEST_ASSERT_EQUAL(6 + quirky, b.logged);
            TEST_ASSERT_EQUAL_HEX8(0x0D, b.log[5 + quirky].byte);
        }
}

static void an_i_that_was_leaving_when_the_power_went_does_not_leave(void)
{
    set_up(&b, DR_MPC, true, 0);
    b.ins.quirks = INSTRUMENT_STOP_SAYS_I;
    say(&b, "\x03", 1);
    run_to(&b, 79 + 10);
    dr_panel_power(&b.ins.panel, instrument_now(&b.ins), false);
    run_to(&b, 5000);
    TEST_ASSERT_EQUAL(0, b.logged);
}

static void nul_heartbeat_beats_every_100_ms_of_an_m(void)
{
    uint8_t frame[DR_FRAME_MAX];
    set_up(&b, DR_MPC, true, 0);
    b.ins.quirks = INSTRUMENT_NUL_HEARTBEAT;
    say(&b, frame, frame_of(frame, "M", 14400, 0, 0)); /* 900 um at 3 mm/s: 300 ms */
    run_to(&b, 1000000);
    TEST_ASSERT_EQUAL(3, b.logged);
    check_sent(&b, 0, 1016 + 100000 + 79, 0x00);
    check_sent(&b, 1, 1016 + 200000 + 79, 0x00);
    check_sent(&b, 2, 1016 + 300000 + 79, 0x0D);
    say(&b, "H", 1);
    run_to(&b, 3000000);
    TEST_ASSERT_EQUAL(4, b.logged); /* no other move beats */
}

/* -- Hands -------------------------------------------------------------------------------------------------------------- */

/* [T page 1]: held for 3 s, WORK stores where it is; the hold acts at that instant whenever one looks. */
static void a_hold_acts_at_its_instant(void)
{
    uint64_t when;
    set_up(&b, DR_TRIO, true, 7);
    TEST_ASSERT_TRUE(dr_panel_press(&b.ins.panel, instrument_now(&b.ins), DR_BUTTON_WORK));
    TEST_ASSERT_TRUE(instrument_due(&b.ins, &when));
    TEST_ASSERT_EQUAL_UINT64(7 + 3000000, when);
    run_to(&b, when - 1);
    TEST_ASSERT_FALSE(b.drives[0].work_is_set);
    run_to(&b, when);
    TEST_ASSERT_TRUE(b.drives[0].work_is_set);
    TEST_ASSERT_FALSE(instrument_due(&b.ins, &when));
}

/* The switches begin where the setup says. */
static void the_panel_is_that_of_the_controller_that_was_set_up(void)
{
    set_up(&b, DR_MPC, true, 0);
    b.drives[0].diagonal = 5;
    b.drives[0].y_moves_home = true;
    instrument_start(&b.ins, 0);
    for (uint8_t number = 1; number <= 8; number++)
        TEST_ASSERT_EQUAL(number != 2 && number != 4, dr_panel_switch_is_on(&b.ins.panel, DR_SWITCHES_REAR, 0, number));
}

/* -- The host's pauses -------------------------------------------------------------------------------------------------- */

static void a_pause_within_s_is_judged_on_the_hosts_clock(void)
{
    uint8_t frame[DR_FRAME_MAX];
    static const struct {
        uint32_t before_speed_us, before_point_us;
        bool is_answered;
    } cases[] = {{0, 0, false}, {19999, 0, false}, {20000, 0, true}, {0, 20000, true}, {10000, 10000, true}};
    (void)frame_of(frame, "S\x0F", 16, 0, 0);
    for (size_t i = 0; i < COUNT(cases); i++) {
        set_up(&b, DR_MPC, false, 0);
        b.ins.controller.quirks = DR_QUIRK_S_NEEDS_PAUSE;
        say_after_pause(&b, 1000000, frame, 1); /* a pause before the command is none within it */
        run_to(&b, 1);
        say_after_pause(&b, cases[i].before_speed_us, frame + 1, 1);
        run_to(&b, 2); /* whatever the controller's clock says */
        say_after_pause(&b, cases[i].before_point_us, frame + 2, 12);
        run_to(&b, 1000000);
        TEST_ASSERT_EQUAL(cases[i].is_answered ? 1 : 0, b.logged);
    }
}

/* -- Stepping ------------------------------------------------------------------------------------------------------------ */

static uint64_t seed;

static uint32_t any(uint32_t below)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)((seed >> 33) % below);
}

typedef enum { ONE_JUMP, AT_EACH_DUE, ANY_STEPS, STYLES } style;

static void go(bench *w, uint64_t until_us, style how)
{
    while (w->ins.now_us < until_us) {
        uint64_t next = until_us, due;
        if (how == AT_EACH_DUE && instrument_due(&w->ins, &due) && due < next)
            next = due;
        if (how == ANY_STEPS)
            next = w->ins.now_us + 1u + any(any(2) == 0 ? 100 : 60000);
        run_to(w, next < until_us ? next : until_us);
    }
}

/* Somebody at the panel, who does whatever he likes. */
static void play_hands(bench *w)
{
    dr_panel *const p = &w->ins.panel;
    const dr_us now = instrument_now(&w->ins);
    const uint32_t what = any(40), which = any(DR_BUTTONS);
    if (what < 12)
        (void)dr_panel_press(p, now, (dr_button)which);
    else if (what < 24)
        (void)dr_panel_release(p, now, (dr_button)which);
    else if (what < 28)
        (void)dr_panel_turn(p, now, (dr_knob)any(DR_KNOBS), (int16_t)((int)any(200) - 100));
    else if (what == 28)
        dr_panel_power(p, now, w->ins.controller.state == DR_STATE_OFF);
}

/* A host that says whatever it likes whenever it likes, mostly commands; and hands. The same for the same seed. */
static void play(bench *w, dr_kind kind, bool is_paced, uint64_t start_us, uint64_t story, style how)
{
    static const char *const heads[2] = {"cChwHWSxyzAR\x03", "CCKUHYNMSIFOL\x03"};
    seed = story;
    set_up(w, kind, is_paced, start_us);
    w->ins.quirks = (uint8_t)any(8);
    w->ins.controller.quirks = (uint16_t)(any(2) == 0 ? 0 : any(256));
    for (unsigned i = 0; i < 30; i++) {
        uint8_t bytes[40];
        size_t count = 0;
        const char head[] = {heads[kind][any((uint32_t)strlen(heads[kind]))], (char)(1u + any(15)), '\0'};
        const uint32_t most = any(3) == 0 ? 400000 : 2000;
        const uint32_t x = any(most), y = any(most), z = any(most);
        const uint32_t shape = any(8);
        if (shape == 0) { /* noise */
            count = any(20);
            for (size_t at = 0; at < count; at++)
                bytes[at] = (uint8_t)any(256);
        } else {
            count = frame_of(bytes, head, x, y, z);
            if (head[0] != 'S') {
                memmove(bytes + 1, bytes + 2, count - 2);
                count = shape == 1 ? 5 : shape < 4 ? 1 : 13;
            }
        }
        const uint32_t pause = any(4) == 0 ? 0 : any(40000);
        const uint64_t wait = any(3) == 0 ? any(200) : any(3000000);
        play_hands(w);
        const uint64_t kept = seed; /* how it steps must not change the story */
        (void)instrument_take(&w->ins, pause, bytes, count);
        go(w, w->ins.now_us + wait, how);
        seed = kept;
    }
    go(w, w->ins.now_us + 200000000, how);
}

static void check_alike(const bench *one, const bench *two)
{
    for (size_t i = 0; i < one->logged && i < two->logged && i < LOG_MAX; i++) {
        TEST_ASSERT_EQUAL_UINT64(one->log[i].when_us - one->start_us, two->log[i].when_us - two->start_us);
        TEST_ASSERT_EQUAL_HEX8(one->log[i].byte, two->log[i].byte);
    }
    TEST_ASSERT_EQUAL(one->logged, two->logged);
    TEST_ASSERT_EQUAL_HEX64(one->digest, two->digest);
}

static void how_finely_one_steps_changes_nothing(void)
{
    for (uint64_t story = 1; story <= 40; story++)
        for (unsigned variant = 0; variant < 4; variant++) {
            const dr_kind kind = variant % 2 == 0 ? DR_TRIO : DR_MPC;
            play(&b, kind, variant < 2, 1000, story, ONE_JUMP);
            for (style how = AT_EACH_DUE; how < STYLES; how++) {
                play(&other, kind, variant < 2, 1000, story, how);
                check_alike(&b, &other);
            }
        }
}

static void nor_does_the_wrap_of_the_32_bit_clock(void)
{
    for (uint64_t story = 1; story <= 20; story++)
        for (unsigned variant = 0; variant < 4; variant++) {
            const dr_kind kind = variant % 2 == 0 ? DR_TRIO : DR_MPC;
            play(&b, kind, variant < 2, 1000, story, ONE_JUMP);
            const uint64_t wrap = UINT64_C(0x300000000);
            play(&other, kind, variant < 2, wrap - any(30) * UINT64_C(1000000) - any(1000000), story, ANY_STEPS);
            check_alike(&b, &other);
        }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_trio_reply_takes_14_byte_times_and_does_not_drift);
    RUN_TEST(an_mpc_reply_takes_14_byte_times);
    RUN_TEST(a_move_begins_when_its_last_byte_has_arrived);
    RUN_TEST(bytes_of_one_busy_period_are_counted_from_its_start);
    RUN_TEST(replies_that_wait_leave_without_a_gap);
    RUN_TEST(an_unpaced_line_takes_no_time);
    RUN_TEST(an_unpaced_line_loses_no_command_of_a_burst);
    RUN_TEST(the_line_takes_no_more_than_it_has_room_for);
    RUN_TEST(nothing_is_due_while_nothing_happens);
    RUN_TEST(what_was_leaving_when_the_power_went_does_not_leave);
    RUN_TEST(unpaced_microns_fall_where_arithmetic_puts_them);
    RUN_TEST(a_paced_stream_fills_the_line_and_skips_what_does_not_fit);
    RUN_TEST(position_13_leaves_the_drive_out);
    RUN_TEST(stop_says_i_puts_an_i_before_the_cr);
    RUN_TEST(stop_says_i_puts_an_i_in_the_place_of_the_cr_that_the_stop_button_causes);
    RUN_TEST(an_i_that_was_leaving_when_the_power_went_does_not_leave);
    RUN_TEST(nul_heartbeat_beats_every_100_ms_of_an_m);
    RUN_TEST(a_hold_acts_at_its_instant);
    RUN_TEST(the_panel_is_that_of_the_controller_that_was_set_up);
    RUN_TEST(a_pause_within_s_is_judged_on_the_hosts_clock);
    RUN_TEST(how_finely_one_steps_changes_nothing);
    RUN_TEST(nor_does_the_wrap_of_the_32_bit_clock);
    return UNITY_END();
}
