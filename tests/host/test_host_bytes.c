/* The host library against a script: exactly these bytes go out, with these pauses, and these come back. The bytes are
 * typed from the manuals ([T] table 6, [M] table 9), not from the code. */
#include "dryrig/dryrig.h"

#include <stdio.h>
#include <string.h>
#include <unity.h>

/* -- A link that is a script, in virtual time ---------------------------------------------------------------------- */

#define ANY 0xFFFFu /* an answer of any length may follow */

typedef struct {
    const char *sent; /* bytes that the host must send, */
    size_t sent_count;
    const char *answer; /* and what comes back, */
    size_t answer_count;
    uint32_t after_us; /* so much later */
} line;

#define LINE(sent, answer, after_us)                                                                                   \
    {                                                                                                                  \
        sent, sizeof(sent) - 1, answer, sizeof(answer) - 1, after_us                                                   \
    }

static struct {
    const line *lines;
    size_t count, at, sent_at;
    uint64_t now_us, quiet_us, answer_us, paused_us;
    const char *answer;
    size_t answer_count;
    unsigned purges, closes, writes;
    bool purged, babbles;
    bool has_second;
    uint64_t stopped_us, after_stop_us; /* from ^C to the next command */
    uint32_t second_us;                 /* after the answer to ^C comes another CR, so much later; 0: none */
} script;

static int script_read(void *context, void *bytes, size_t room, uint32_t timeout_us)
{
    (void)context;
    if (script.answer_count > 0 && script.answer_us <= script.now_us + timeout_us) {
        script.now_us = script.answer_us > script.now_us ? script.answer_us : script.now_us;
        const size_t count = script.answer_count < room ? script.answer_count : room;
        memcpy(bytes, script.answer, count);
        script.answer += count;
        script.answer_count -= count;
        script.quiet_us = script.now_us;
        if (script.has_second && script.answer_count == 0) {
            script.has_second = false;
            script.answer = "\x0D";
            script.answer_count = 1;
            script.answer_us = script.now_us + script.second_us;
        }
        return (int)count;
    }
    script.now_us += script.babbles && timeout_us > 10000 ? 10000 : timeout_us;
    if (script.babbles)
        *(char *)bytes = 'x';
    return script.babbles;
}

static int script_write(void *context, const void *bytes, size_t count)
{
    (void)context;
    script.writes++;
    TEST_ASSERT_LESS_THAN_size_t_MESSAGE(script.count, script.at, "more was sent than the script has");
    const line *l = &script.lines[script.at];
    const uint64_t pause_us = script.now_us - script.quiet_us;
    TEST_ASSERT_LESS_OR_EQUAL_size_t(l->sent_count - script.sent_at, count);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(l->sent + script.sent_at, bytes, count);
    if (script.stopped_us != 0 && script.after_stop_us == 0)
        script.after_stop_us = script.now_us - script.stopped_us;
    if (l->sent[0] == 0x03)
        script.stopped_us = script.now_us;
    if (l->sent[0] == 0x03)
        TEST_ASSERT_FALSE_MESSAGE(script.purged, "^C must not throw away what the move has said");
    else if (script.sent_at == 0) {
        TEST_ASSERT_TRUE_MESSAGE(script.purged, "buffers are purged before every command [T note 3, M note 3]");
        TEST_ASSERT_TRUE_MESSAGE(script.writes == 1 || pause_us >= 2000, "2 ms between commands [T note 2, M note 2]");
    } else
        script.paused_us = pause_us;
    script.purged = false;
    script.sent_at += count;
    script.quiet_us = script.now_us;
    if (script.sent_at == l->sent_count) {
        script.answer = l->answer;
        script.answer_count = l->answer_count;
        script.answer_us = script.now_us + l->after_us;
        script.sent_at = 0;
        script.at++;
        script.has_second = l->sent[0] == 0x03 && script.second_us != 0;
    }
    return 0;
}

static int script_purge(void *context)
{
    (void)context;
    script.purges++;
    script.purged = true;
    if (script.answer_us <= script.now_us)
        script.answer_count = 0;
    return 0;
}

static uint64_t script_now(void *context)
{
    (void)context;
    return script.now_us;
}

static void script_sleep(void *context, uint32_t span_us)
{
    (void)context;
    script.now_us += span_us;
}

static void script_close(void *context)
{
    (void)context;
    script.closes++;
}

static const dryrig_link script_link = {NULL,       script_read,  script_write, script_purge,
                                        script_now, script_sleep, script_close};

static dryrig *d;

void setUp(void) {}
void tearDown(void)
{
    dryrig_close(d);
    d = NULL;
}

static dryrig *open_script(dryrig_controller controller, const char *stage, const line *lines, size_t count)
{
    dryrig_options options = dryrig_defaults(controller);
    char why[DRYRIG_WHY_MAX];
    options.link = &script_link;
    options.stage[0] = options.stage[1] = stage;
    if (controller == DRYRIG_TRIO)
        options.stage[1] = NULL;
    memset(&script, 0, sizeof script);
    script.lines = lines;
    script.count = count;
    d = NULL;
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRYRIG_OK, dryrig_open(&d, &options, why, sizeof why), why);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(0, script.writes, "opening sends nothing");
    return d;
}

#define OPEN(controller, stage, lines) open_script(controller, stage, lines, sizeof(lines) / sizeof(lines)[0])
#define OK(call)                                                                                                       \
    do {                                                                                                               \
        const int result_ = (call);                                                                                    \
        TEST_ASSERT_EQUAL_INT_MESSAGE(DRYRIG_OK, result_, dryrig_why(d));                                              \
    } while (0)
#define FAILS(error, call) TEST_ASSERT_EQUAL_STRING(dryrig_error_name(error), dryrig_error_name(call))
static void check_played(void) { TEST_ASSERT_EQUAL_size_t_MESSAGE(script.count, script.at, "the script is not over"); }

/* -- What goes over the line --------------------------------------------------------------------------------------- */

/* Positions as answers. MPC: drive 1; TRIO: 30 degrees. Least significant byte first. */
#define M_AT_0 "\x01\0\0\0\0\0\0\0\0\0\0\0\0\x0D"
#define M_AT_1 "\x01\x10\0\0\0\x20\0\0\0\x30\0\0\0\x0D" /* 1, 2, 3 um at 16 steps/um */
#define T_AT_0 "\0\0\0\0\0\0\0\0\0\0\0\0\x1E\x0D"
#define T_AT_1 "\x2A\xAA\0\0\x55\x55\x01\0\x80\0\0\0\x1E\x0D" /* 43562, 87381, 128 */

#define IN_STEP(at) LINE("C", at, 1300), LINE("C", at, 1300)
#define T_IN_STEP(at) LINE("c", at, 2600), LINE("c", at, 2600)
#define ASKED(at) LINE("C", at, 1300), LINE("C", at, 1300) /* each query, twice */
#define T_ASKED(at) LINE("c", at, 2600), LINE("c", at, 2600)

static void mpc_move(void)
{
    static const line lines[] = {IN_STEP(M_AT_0), ASKED(M_AT_0), LINE("M\x10\0\0\0\x20\0\0\0\x30\0\0\0", "\x0D", 20000),
                                 ASKED(M_AT_1)};
    const double um[3] = {1, 2, 3};
    dryrig_position p;
    OPEN(DRYRIG_MPC, "MP-225", lines);
    OK(dryrig_move_um(d, um, DRYRIG_ORDER_AUTO, &p));
    TEST_ASSERT_EQUAL_INT32(48, p.steps[DRYRIG_Z]);
    check_played();
}

static void mpc_line_with_its_pause(void)
{
    static const line lines[] = {IN_STEP(M_AT_0),
                                 LINE("K", "\x01\x21\x03\x0D", 500),
                                 LINE("K", "\x01\x21\x03\x0D", 500),
                                 ASKED(M_AT_0),
                                 LINE("F", "\x0D", 200),
                                 LINE("S\x07\x10\0\0\0\x20\0\0\0\x30\0\0\0", "\x0D", 20000),
                                 ASKED(M_AT_1)};
    const double um[3] = {1, 2, 3};
    OPEN(DRYRIG_MPC, "MP-225", lines);
    OK(dryrig_line_um(d, um, 7, false, NULL));
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(30000, script.paused_us); /* [M table 9, 'S': 30ms] */
    check_played();
}

static void mpc_stream(void)
{
    static const line lines[] = {
        IN_STEP(M_AT_0),
        LINE("K", "\x01\x21\x03\x0D", 500),
        LINE("K", "\x01\x21\x03\x0D", 500),
        ASKED(M_AT_0),
        LINE("O", "\x0D", 200),
        LINE("S\0\x10\0\0\0\x20\0\0\0\x30\0\0\0",
             "\xFF\xFF\xFF\x05\0\0\x0B\0\0\x10\0\0\xFF\xFF\xFF\x0B\0\0\x0D\0\0\x20\0\0" /* a Y of 0x0D: no end */
             "\xFF\xFF\xFF\x10\0\0\x20\0\0\x30\0\0\x0D",
             20000),
        ASKED(M_AT_1)};
    const int32_t steps[3] = {16, 32, 48};
    OPEN(DRYRIG_MPC, "MP-225", lines);
    OK(dryrig_line_steps(d, steps, 0, true, NULL));
    check_played();
}

static void mpc_home_work_calibrate(void)
{
    static const line lines[] = {IN_STEP(M_AT_1),
                                 ASKED(M_AT_1),
                                 LINE("H", "\x0D", 20000),
                                 ASKED(M_AT_0),
                                 ASKED(M_AT_0),
                                 LINE("Y", "\x0D", 20000),
                                 ASKED(M_AT_1),
                                 LINE("K", "\x01\x21\x03\x0D", 500),
                                 LINE("K", "\x01\x21\x03\x0D", 500),
                                 ASKED(M_AT_1),
                                 LINE("N", "\x0D", 20000),
                                 ASKED(M_AT_0)};
    OPEN(DRYRIG_MPC, "MP-225", lines);
    OK(dryrig_home(d, NULL));
    OK(dryrig_work(d, NULL));
    OK(dryrig_calibrate(d, NULL));
    check_played();
}

static void mpc_select_mode_info(void)
{
    static const line lines[] = {
        IN_STEP(M_AT_0),
        LINE("I\x02", "\x02\x0D", 300),
        LINE("K", "\x02\x21\x03\x0D", 500),
        LINE("K", "\x02\x21\x03\x0D", 500),
        LINE("L\x09", "\x0D", 300),
        LINE("K", "\x02\x15\x03\x0D", 500), /* 3.15 is 0x15 0x03 [M note 15] */
        LINE("K", "\x02\x15\x03\x0D", 500),
        LINE("K", "\x02\x15\x03\x0D", 500),
        LINE("K", "\x02\x15\x03\x0D", 500),
        LINE("U", "\x03\x01\x01\0\x01\x0D", 500),
        LINE("U", "\x03\x01\x01\0\x01\x0D", 500),
    };
    dryrig_info info;
    OPEN(DRYRIG_MPC, "MP-225", lines);
    OK(dryrig_select(d, 2));
    OK(dryrig_set_mode(d, 9));
    OK(dryrig_get_info(d, &info));
    TEST_ASSERT_EQUAL_HEX(0x0315, info.firmware);
    TEST_ASSERT_EQUAL_INT(3, info.drives);
    TEST_ASSERT_TRUE(info.connected[0] && info.connected[1] && !info.connected[2] && info.connected[3]);
    check_played();
}

static void mpc_below_3(void)
{
    static const line lines[] = {IN_STEP(M_AT_0),
                                 LINE("I\x02", "\x0D", 300), /* 1 to 1.05: CR alone */
                                 LINE("K", "\x02\x0D", 300),
                                 LINE("K", "\x02\x0D", 300),
                                 LINE("K", "\x02\x0D", 300),
                                 LINE("K", "\x02\x0D", 300),
                                 LINE("K", "\x02\x0D", 300),
                                 LINE("K", "\x02\x0D", 300),
                                 LINE("A", "\x02\x0D", 300),
                                 LINE("A", "\x02\x0D", 300)};
    dryrig_info info;
    OPEN(DRYRIG_MPC, "MP-225", lines);
    OK(dryrig_select(d, 2));
    OK(dryrig_get_info(d, &info));
    TEST_ASSERT_EQUAL_HEX(0, info.firmware);
    TEST_ASSERT_EQUAL_INT(2, info.drives);
    check_played();
}

static void trio_commands(void)
{
    static const line lines[] = {
        T_IN_STEP(T_AT_0),
        T_ASKED(T_AT_0),
        LINE("W\x2A\xAA\0\0\x55\x55\x01\0\x80\0\0\0", "\x0D", 2000000), /* Z grows: Y first */
        T_ASKED(T_AT_1),
        T_ASKED(T_AT_1),
        LINE("H\0\0\0\0\0\0\0\0\0\0\0\0", "\x0D", 2000000), /* Z shrinks: Y last */
        T_ASKED(T_AT_0),
        T_ASKED(T_AT_0),
        LINE("S\x0F\x2A\xAA\0\0\x55\x55\x01\0\x80\0\0\0", "\x0D", 2000000),
        T_ASKED(T_AT_1),
        T_ASKED(T_AT_1),
        LINE("x\x0D\0\0\0", "\x0D", 1000000),
        T_ASKED("\x0D\0\0\0\x55\x55\x01\0\x80\0\0\0\x1E\x0D"),
        T_ASKED("\x0D\0\0\0\x55\x55\x01\0\x80\0\0\0\x1E\x0D"),
        LINE("y\x03\0\0\0", "\x0D", 1000000),
        T_ASKED("\x0D\0\0\0\x03\0\0\0\x80\0\0\0\x1E\x0D"),
        T_ASKED("\x0D\0\0\0\x03\0\0\0\x80\0\0\0\x1E\x0D"),
        LINE("z\x43\0\0\0", "\x0D", 10000),
        T_ASKED("\x0D\0\0\0\x03\0\0\0\x43\0\0\0\x1E\x0D"),
        T_ASKED("\x0D\0\0\0\x03\0\0\0\x43\0\0\0\x1E\x0D"),
        LINE("h", "\x0D", 10000),
        T_ASKED(T_AT_0),
        T_ASKED(T_AT_0),
        LINE("w", "\x0D", 10000),
        T_ASKED(T_AT_1),
        LINE("A\x1E", "\x0D", 300),
        T_ASKED(T_AT_1),
        T_ASKED(T_AT_1),
        LINE("R", "\x0D", 3000000),
        T_ASKED(T_AT_0),
    };
    const int32_t at_1[3] = {43562, 87381, 128}, at_0[3] = {0, 0, 0};
    OPEN(DRYRIG_TRIO, NULL, lines);
    OK(dryrig_move_steps(d, at_1, DRYRIG_ORDER_AUTO, NULL));
    OK(dryrig_move_steps(d, at_0, DRYRIG_ORDER_AUTO, NULL));
    OK(dryrig_line_steps(d, at_1, 15, false, NULL));
    OK(dryrig_axis_steps(d, DRYRIG_X, 13, NULL));
    OK(dryrig_axis_steps(d, DRYRIG_Y, 3, NULL));
    OK(dryrig_axis_steps(d, DRYRIG_Z, 0x43, NULL));
    OK(dryrig_home(d, NULL));
    OK(dryrig_work(d, NULL));
    OK(dryrig_set_angle(d, 30));
    OK(dryrig_calibrate(d, NULL));
    check_played();
}

/* -- What does not go over the line -------------------------------------------------------------------------------- */

static void refused_targets_send_nothing(void)
{
    static const line none[] = {LINE("", "", 0)};
    const double bad_um[][3] = {{-0.001, 0, 0}, {0, -5, 0}, {0, 0, 25000.04}, {1e300, 0, 0}, {-1e300, 0, 0}};
    const int32_t bad_steps[][3] = {{-1, 0, 0}, {0, 400001, 0}, {0, 0, INT32_MAX}, {INT32_MIN, 0, 0}};
    const double zero = 0, nan_um[3] = {0, 0, zero / zero};
    dryrig_position p;
    OPEN(DRYRIG_MPC, "MP-225", none);
    for (size_t i = 0; i < sizeof bad_um / sizeof bad_um[0]; i++) {
        FAILS(DRYRIG_ERR_RANGE, dryrig_move_um(d, bad_um[i], DRYRIG_ORDER_AUTO, &p));
        FAILS(DRYRIG_ERR_RANGE, dryrig_line_um(d, bad_um[i], 3, false, &p));
    }
    for (size_t i = 0; i < sizeof bad_steps / sizeof bad_steps[0]; i++) {
        /* All four drives may differ, so what one stage could reach is refused only when the drive is known. */
        if (bad_steps[i][0] < 0 || bad_steps[i][2] > 1066667)
            FAILS(DRYRIG_ERR_RANGE, dryrig_move_steps(d, bad_steps[i], DRYRIG_ORDER_AUTO, &p));
    }
    FAILS(DRYRIG_ERR_RANGE, dryrig_move_um(d, nan_um, DRYRIG_ORDER_AUTO, &p));
    FAILS(DRYRIG_ERR_RANGE, dryrig_axis_um(d, DRYRIG_Y, -1, &p));
    FAILS(DRYRIG_ERR_RANGE, dryrig_line_um(d, bad_um[0], 16, false, &p));
    FAILS(DRYRIG_ERR_RANGE, dryrig_line_um(d, bad_um[0], -1, false, &p));
    FAILS(DRYRIG_ERR_RANGE, dryrig_select(d, 0));
    FAILS(DRYRIG_ERR_RANGE, dryrig_select(d, 5));
    FAILS(DRYRIG_ERR_RANGE, dryrig_set_mode(d, 10));
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_axis_steps(d, 3, 0, &p));
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_move_um(d, NULL, DRYRIG_ORDER_AUTO, &p));
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_get_position(d, NULL));
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_get_position(NULL, &p));
    TEST_ASSERT_EQUAL_UINT(0, script.writes);
    tearDown();
    OPEN(DRYRIG_TRIO, "MP-845", none);
    FAILS(DRYRIG_ERR_RANGE, dryrig_set_angle(d, 91));
    FAILS(DRYRIG_ERR_RANGE, dryrig_set_angle(d, -1));
    const int32_t beyond[3] = {266668, 0, 0};
    FAILS(DRYRIG_ERR_RANGE, dryrig_move_steps(d, beyond, DRYRIG_ORDER_AUTO, &p));
    TEST_ASSERT_EQUAL_UINT(0, script.writes);
    tearDown();
    const double um[3] = {1, 2, 3};
    OPEN(DRYRIG_TRIO, NULL, none);
    FAILS(DRYRIG_ERR_NO_STAGE, dryrig_move_um(d, um, DRYRIG_ORDER_AUTO, &p));
    TEST_ASSERT_NOT_NULL(strstr(dryrig_why(d), "MP-865")); /* lists them */
    TEST_ASSERT_EQUAL_UINT(0, script.writes);
}

static void the_travel_is_that_of_the_active_drive(void)
{
    static const line lines[] = {IN_STEP(M_AT_0), ASKED(M_AT_0)};
    const int32_t beyond[3] = {0, 200001, 0}; /* an MP-265: 12.5 mm in Y */
    dryrig_position p;
    OPEN(DRYRIG_MPC, "MP-265", lines);
    FAILS(DRYRIG_ERR_RANGE, dryrig_move_steps(d, beyond, DRYRIG_ORDER_AUTO, &p));
    TEST_ASSERT_EQUAL_INT(-1, p.drive);
    check_played();
    FAILS(DRYRIG_ERR_RANGE, dryrig_move_steps(d, beyond, DRYRIG_ORDER_AUTO, &p)); /* now without asking */
}

static void the_ends_of_travel_are_allowed(void)
{
    int32_t steps[3];
    const double um[3] = {25000, 12500, 25000}, zero[3] = {0, -0.0, 0};
    static const line none[] = {LINE("", "", 0)};
    OPEN(DRYRIG_MPC, "MP-265", none);
    OK(dryrig_um_to_steps(d, 1, um, steps));
    TEST_ASSERT_EQUAL_INT32(400000, steps[0]);
    TEST_ASSERT_EQUAL_INT32(200000, steps[1]);
    OK(dryrig_um_to_steps(d, 1, zero, steps));
    FAILS(DRYRIG_ERR_NO_STAGE, dryrig_um_to_steps(d, 4, um, steps));
    FAILS(DRYRIG_ERR_RANGE, dryrig_um_to_steps(d, 5, um, steps));
    tearDown();
    OPEN(DRYRIG_TRIO, "mp845", none); /* 25,000 um are 266,666.67 steps: the printed integer rounds up */
    const double end[3] = {25000, 25000, 25000};
    OK(dryrig_um_to_steps(d, 0, end, steps));
    TEST_ASSERT_EQUAL_INT32(266667, steps[0]);
    FAILS(DRYRIG_ERR_RANGE, dryrig_um_to_steps(d, 1, end, steps));
}

/* -- Surprises ----------------------------------------------------------------------------------------------------- */

/* The CR of a move that was given up comes when a new move has just begun: it is not taken for that one's. */
static void the_late_cr_of_an_older_move_is_not_the_new_one_s(void)
{
    static const line lines[] = {
        IN_STEP(M_AT_0),
        ASKED(M_AT_0),
        LINE("M\x10\x27\0\0\0\0\0\0\0\0\0\0", "\x0D\x0D", 1000), /* 208 ms are due */
        IN_STEP("\x01\x10\x27\0\0\0\0\0\0\0\0\0\0\x0D"),         /* two at once: doubt */
        ASKED("\x01\x10\x27\0\0\0\0\0\0\0\0\0\0\x0D"),
        ASKED("\x01\x10\x27\0\0\0\0\0\0\0\0\0\0\x0D"),
    };
    const int32_t target[3] = {10000, 0, 0};
    OPEN(DRYRIG_MPC, "MP-225", lines);
    const uint64_t began_us = script.now_us;
    OK(dryrig_move_steps(d, target, DRYRIG_ORDER_AUTO, NULL));
    TEST_ASSERT_GREATER_OR_EQUAL_UINT64(208334, script.now_us - began_us); /* an early CR is not believed */
}

/* Bytes that nobody asked for, between two commands: a late CR, STOP on the ROE ('I'). The next answer could be shifted by
 * more of them, so the line is looked into first. */
static void bytes_that_nobody_asked_for_raise_doubt(void)
{
    static const line lines[] = {IN_STEP(M_AT_0), ASKED(M_AT_0), IN_STEP(M_AT_0), ASKED(M_AT_0)};
    dryrig_position p;
    OPEN(DRYRIG_MPC, "MP-225", lines);
    OK(dryrig_get_position(d, &p));
    script.answer = "\x0D";
    script.answer_count = 1;
    script.answer_us = script.now_us;
    OK(dryrig_get_position(d, &p));
    check_played();
}

static void press_stop(void *context, const dryrig_motion *motion)
{
    (void)context;
    (void)motion;
    OK(dryrig_interrupt(d));
}

/* The move ended just before ^C came: its CR, and 16 ms later (a USB adapter holds it back) that of the idle ^C. Nothing is
 * asked in between. */
static void two_crs_after_an_interrupt(void)
{
    static const line lines[] = {
        IN_STEP(M_AT_0),           ASKED(M_AT_0),           LINE("M\x10\x27\0\0\0\0\0\0\0\0\0\0", "", 0),
        LINE("\x03", "\x0D", 200), LINE("C", M_AT_1, 1300), LINE("C", M_AT_1, 1300),
        LINE("C", M_AT_1, 1300),   LINE("C", M_AT_1, 1300)};
    const int32_t target[3] = {10000, 0, 0};
    OPEN(DRYRIG_MPC, "MP-225", lines);
    script.second_us = 16000;
    dryrig_watch(d, press_stop, NULL);
    FAILS(DRYRIG_ERR_INTERRUPTED, dryrig_move_steps(d, target, DRYRIG_ORDER_AUTO, NULL));
    TEST_ASSERT_EQUAL_size_t(8, script.at); /* no more: it was never in doubt */
    TEST_ASSERT_GREATER_THAN_UINT64(16000, script.after_stop_us);
}

static void wrong_answers_are_refused_and_asked_again(void)
{
    static const line lines[] = {
        LINE("C", "\x0D" M_AT_0, 1300),                        /* a stray CR before */
        LINE("C", M_AT_0 "\x0D", 1300),                        /* and behind */
        LINE("C", "\x05\0\0\0\0\0\0\0\0\0\0\0\0\x0D", 1300),   /* drive 5 */
        LINE("C", "\x01\0\0\0\x01\0\0\0\0\0\0\0\0\x0D", 1300), /* 16 million steps */
        IN_STEP(M_AT_0),
        LINE("C", M_AT_0, 1300),
        LINE("C", M_AT_1, 1300),        /* not the same twice */
        LINE("C", M_AT_1 "\x0D", 1300), /* the last one is looked behind as well */
        IN_STEP(M_AT_1),
        LINE("C", M_AT_1, 1300),
    };
    dryrig_position p;
    OPEN(DRYRIG_MPC, "MP-225", lines);
    OK(dryrig_get_position(d, &p));
    TEST_ASSERT_EQUAL_INT32(16, p.steps[0]);
    check_played();
}

static void a_controller_that_keeps_talking(void)
{
    static const line none[] = {LINE("", "", 0)};
    dryrig_position p;
    OPEN(DRYRIG_MPC, "MP-225", none);
    script.babbles = true;
    FAILS(DRYRIG_ERR_OUT_OF_STEP, dryrig_get_position(d, &p));
    TEST_ASSERT_LESS_THAN_UINT64(4000000, script.now_us);
    TEST_ASSERT_EQUAL_UINT(0, script.writes);
}

static void ask_once_asks_once(void)
{
    static const line lines[] = {IN_STEP(M_AT_0), LINE("C", M_AT_1, 1300)};
    dryrig_options options = dryrig_defaults(DRYRIG_MPC);
    dryrig_position p;
    options.link = &script_link;
    options.ask_once = true;
    memset(&script, 0, sizeof script);
    script.lines = lines;
    script.count = sizeof lines / sizeof lines[0];
    OK(dryrig_open(&d, &options, NULL, 0));
    OK(dryrig_get_position(d, &p));
    TEST_ASSERT_EQUAL_INT32(32, p.steps[1]);
    TEST_ASSERT_FALSE(p.has_um);
    check_played();
}

/* -- Opening and errors -------------------------------------------------------------------------------------------- */

static void impossible_options(void)
{
    char why[DRYRIG_WHY_MAX];
    dryrig_options options = dryrig_defaults((dryrig_controller)0);
    memset(&script, 0, sizeof script);
    options.link = &script_link;
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_open(&d, &options, why, sizeof why));
    TEST_ASSERT_NULL(d);
    TEST_ASSERT_EQUAL_UINT_MESSAGE(1, script.closes, "a failed start leaves nothing behind");
    options = dryrig_defaults(DRYRIG_MPC);
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_open(&d, &options, why, sizeof why));
    TEST_ASSERT_NOT_NULL(strstr(why, "no port"));
    options.link = &script_link;
    options.stage[3] = "MP-9";
    FAILS(DRYRIG_ERR_NO_STAGE, dryrig_open(&d, &options, why, sizeof why));
    TEST_ASSERT_NOT_NULL(strstr(why, "MP-865"));
    options.stage[3] = NULL;
    options.margin = 0.5;
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_open(&d, &options, NULL, 0));
    options.margin = 3;
    options.firmware = 0x031A;
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_open(&d, &options, why, 3));
    TEST_ASSERT_EQUAL_size_t(2, strlen(why)); /* cut to fit */
    FAILS(DRYRIG_ERR_ARGUMENT, dryrig_open(NULL, &options, why, sizeof why));
}

static void every_error_has_a_text_a_name_and_somebody_to_blame(void)
{
    for (int error = -40; error < 0; error++) {
        const bool known = strcmp(dryrig_error_name(error), "unknown") != 0;
        TEST_ASSERT_EQUAL(known, strcmp(dryrig_strerror(error), "unknown error") != 0);
        if (known) {
            TEST_ASSERT_TRUE(dryrig_fault_of(error) != DRYRIG_FAULT_NONE);
            for (int other = -40; other < error; other++) {
                TEST_ASSERT_TRUE(strcmp(dryrig_error_name(error), dryrig_error_name(other)) != 0 ||
                                 strcmp(dryrig_error_name(other), "unknown") == 0);
            }
        }
    }
    TEST_ASSERT_EQUAL_STRING("ok", dryrig_error_name(DRYRIG_OK));
    TEST_ASSERT_EQUAL(DRYRIG_FAULT_NONE, dryrig_fault_of(DRYRIG_OK));
}

static void stages_by_name(void)
{
    dryrig_stage stage;
    char names[DRYRIG_WHY_MAX];
    OK(dryrig_get_stage(DRYRIG_TRIO, "mp-845s/m", &stage));
    TEST_ASSERT_TRUE(stage.um_per_step == 0.09375); /* the same stage on the two controllers: a trap */
    OK(dryrig_get_stage(DRYRIG_MPC, "MP-845", &stage));
    TEST_ASSERT_TRUE(stage.um_per_step == 0.046875);
    TEST_ASSERT_TRUE(stage.line_um_per_s == 81.25 && stage.full_speed_um_per_s == 3000);
    TEST_ASSERT_EQUAL_INT32(533333, stage.travel_steps[DRYRIG_Y]);
    FAILS(DRYRIG_ERR_NO_STAGE, dryrig_get_stage(DRYRIG_TRIO, "MP-225", &stage));
    TEST_ASSERT_LESS_THAN_size_t(sizeof names, dryrig_stage_names(DRYRIG_MPC, names, sizeof names));
    TEST_ASSERT_NOT_NULL(strstr(names, "MOM"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(mpc_move);
    RUN_TEST(mpc_line_with_its_pause);
    RUN_TEST(mpc_stream);
    RUN_TEST(mpc_home_work_calibrate);
    RUN_TEST(mpc_select_mode_info);
    RUN_TEST(mpc_below_3);
    RUN_TEST(trio_commands);
    RUN_TEST(refused_targets_send_nothing);
    RUN_TEST(the_travel_is_that_of_the_active_drive);
    RUN_TEST(the_ends_of_travel_are_allowed);
    RUN_TEST(the_late_cr_of_an_older_move_is_not_the_new_one_s);
    RUN_TEST(bytes_that_nobody_asked_for_raise_doubt);
    RUN_TEST(two_crs_after_an_interrupt);
    RUN_TEST(wrong_answers_are_refused_and_asked_again);
    RUN_TEST(a_controller_that_keeps_talking);
    RUN_TEST(ask_once_asks_once);
    RUN_TEST(impossible_options);
    RUN_TEST(every_error_has_a_text_a_name_and_somebody_to_blame);
    RUN_TEST(stages_by_name);
    return UNITY_END();
}
