/* When the guard's memory is sealed: whenever nothing is in the middle of anything. test_flips shows what the seal finds. */
#include "bench.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

/* One byte for the controller, if there is one, as a port does it: when it is on its way, is there more? */
static bool pull(void)
{
    uint8_t byte;
    if (dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1) == 0)
        return false;
    (void)dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 0);
    return true;
}

static void push(const char *bytes, size_t count)
{
    dr_guard_push_device(&rig.guard, guard_clock(), (const uint8_t *)bytes, count);
}

static void host(const char *bytes, size_t count)
{
    dr_guard_push_host(&rig.guard, guard_clock(), (const uint8_t *)bytes, count);
}

static void later(uint64_t us)
{
    rig.now += us;
    (void)dr_guard_pull_device(&rig.guard, guard_clock(), &(uint8_t){0}, 0);
}

#define SEALED() TEST_ASSERT_TRUE(rig.guard.sealed)
#define OPEN() TEST_ASSERT_FALSE(rig.guard.sealed)

/* 40,000 on each axis, 30 degrees. */
static const char at_home[] = "\x40\x9C\0\0\x40\x9C\0\0\x40\x9C\0\0\x1E\r";
static const char line[] = "S\x0F\xE0\xAB\0\0\x40\x9C\0\0\x40\x9C\0\0"; /* to 44,000 on X */
static const char at_home_mpc[] = "\x01\x80\x38\x01\0\x80\x38\x01\0\x80\x38\x01\0\r";
static const char line_mpc[] = "S\x0F\x20\x48\x01\0\x80\x38\x01\0\x80\x38\x01\0"; /* to 84,000 on X */

static void started(void)
{
    bench_trio();
    rig.by_hand = true;
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
    dr_guard_start(&rig.guard, guard_clock(), DR_START_POWER_ON);
    dr_guard_link(&rig.guard, guard_clock(), true, true);
    SEALED();
    later(1000000);
}

static void read_at_home(void)
{
    OPEN(); /* a query is to be pulled */
    TEST_ASSERT_TRUE(pull());
    SEALED(); /* the answer may take long */
    for (size_t i = 0; i < 13; i++) {
        push(at_home + i, 1);
        OPEN();
    }
    push(at_home + 13, 1);
    SEALED();
}

static void armed(void)
{
    started();
    read_at_home();
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_KEY, true);
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_ARM, true);
    SEALED();
    later(2000);
    read_at_home();
    later(100000);
    read_at_home();
    expect_state(DR_GUARD_IDLE);
}

static void a_reading_is_sealed_before_it_and_behind_it(void)
{
    started();
    read_at_home();
    expect_state(DR_GUARD_DISARMED);
}

static void a_query_of_the_host_is_sealed_until_its_answer_comes(void)
{
    started();
    read_at_home();
    host("c", 1);
    OPEN();
    TEST_ASSERT_TRUE(pull());
    SEALED();
    for (size_t i = 0; i < 13; i++) {
        uint8_t byte;
        push(at_home + i, 1);
        OPEN();
        TEST_ASSERT_EQUAL(1, dr_guard_pull_host(&rig.guard, guard_clock(), &byte, 1));
        OPEN();
    }
    push(at_home + 13, 1);
    SEALED();
    uint8_t byte;
    TEST_ASSERT_EQUAL(1, dr_guard_pull_host(&rig.guard, guard_clock(), &byte, 1));
    SEALED();
    TEST_ASSERT_EQUAL(0, dr_guard_pull_host(&rig.guard, guard_clock(), &byte, 1));
    SEALED();
}

static void a_motion_is_open_while_its_bytes_are_on_their_way(void)
{
    armed();
    for (size_t i = 0; i < 13; i++) {
        host(line + i, 1);
        OPEN();
    }
    host(line + 13, 1);
    SEALED();
    later(2000);
    read_at_home();
    later(2000);
    for (size_t i = 0; i < 14; i++) {
        OPEN();
        TEST_ASSERT_TRUE(pull());
    }
    SEALED();
    push("\xFF", 1); /* noise, or a position that is streamed: not worth the time */
    OPEN();
    uint8_t byte;
    TEST_ASSERT_EQUAL(0, dr_guard_pull_host(&rig.guard, guard_clock(), &byte, 1));
    OPEN(); /* nor is being asked when nothing is due */
    later(1);
    SEALED(); /* but by who asks for bytes to send */
    push("\r", 1);
    SEALED();
    later(2000);
    OPEN();
}

/* On a small machine the seal takes a fifth of the time that a stop has: it is made by who asks for bytes and finds nothing. */
static void the_seal_waits_until_nothing_is_to_do(void)
{
    uint8_t bytes[2];
    const char *const what[] = {"\x03", "c"};
    for (size_t i = 0; i < 2; i++) {
        armed();
        host(what[i], 1);
        TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), bytes, 1 + i));
        OPEN(); /* it is not on its way yet */
        TEST_ASSERT_EQUAL(0, dr_guard_pull_device(&rig.guard, guard_clock(), bytes, 1 + i));
        SEALED();
    }
    armed();
    later(rig.limits.arm_idle_s * UINT64_C(1000000));
    expect_state(DR_GUARD_DISARMED);
    OPEN(); /* something was due */
    later(0);
    SEALED();
}

static void a_stop_is_open_until_it_has_left(void)
{
    armed();
    host("\x03", 1);
    OPEN();
    TEST_ASSERT_TRUE(pull());
    SEALED();
    push("\r", 1);
    SEALED();
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_STOP, true);
    OPEN();
    TEST_ASSERT_TRUE(pull());
    SEALED();
}

static void a_self_check_is_a_call_as_any(void)
{
    armed();
    rig.guard.sealed = 0;
    TEST_ASSERT_TRUE(dr_guard_self_check(&rig.guard, guard_clock()));
    SEALED();
}

/* What is logged about a change of the state is there when the call that changed it returns, with its own instant. */
static bool logs_state(uint8_t before, uint8_t after, dr_us when)
{
    dr_record record;
    bool found = false;
    while (dr_guard_pull_log(&rig.guard, &record))
        found = found || (record.event == DR_EVENT_STATE && record.before == before && record.after == after &&
                          record.when == when);
    return found;
}

static void a_change_of_the_state_is_logged_by_the_call_that_makes_it(void)
{
    armed();
    host(line, 13);
    (void)logs_state(0, 0, 0);
    rig.now += 7;
    host(line + 13, 1);
    TEST_ASSERT_TRUE(logs_state(DR_GUARD_IDLE, DR_GUARD_CHECKING, guard_clock()));
    later(2000);
    read_at_home();
    later(2000);
    TEST_ASSERT_TRUE(pull());
    TEST_ASSERT_TRUE(logs_state(DR_GUARD_CHECKING, DR_GUARD_MOVING_S, guard_clock()));
    while (pull())
        ;
    push("\r", 1);
    later(2000);
    TEST_ASSERT_TRUE(pull());
    push(at_home, 4);
    push("\xE0\xAB\0\0\x40\x9C\0\0\x40\x9C\0\0\x1E\r", 10);
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_STOP, true);
    TEST_ASSERT_TRUE(logs_state(DR_GUARD_MOVING_S, DR_GUARD_STOPPING, guard_clock()));
}

static void what_a_late_caller_finds_is_logged_with_the_instant_when_it_was_due(void)
{
    armed();
    const dr_us due = guard_clock() + rig.limits.arm_idle_s * DR_US_PER_S;
    (void)logs_state(0, 0, 0);
    later(1000000000); /* 1,000 s: 100 too late */
    TEST_ASSERT_TRUE(logs_state(DR_GUARD_IDLE, DR_GUARD_DISARMED, due));
}

/* -- What is left when the seal is broken ------------------------------------------------------------------------------- */

/* As it is now, but for one bit of a counter that decides nothing; and what the guard makes of it. */
static void break_seal_at(bool torn, uint8_t *byte)
{
    dr_guard_push_host(&rig.guard, guard_clock(), NULL, 0);
    SEALED();
    *byte = (uint8_t)(*byte == 0);
    expect_state(DR_GUARD_LOCKED); /* at once, by who only looks */
    expect_fault(DR_FAULT_DAMAGED);
    TEST_ASSERT_EQUAL(DR_NEEDS_LIMITS, status().needs);
    TEST_ASSERT_FALSE(dr_guard_self_check(&rig.guard, guard_clock()));
    expect_state(DR_GUARD_LOCKED);
    expect_fault(DR_FAULT_DAMAGED);
    TEST_ASSERT_EQUAL(torn, status().confirm_wanted);
    TEST_ASSERT_EQUAL(DR_REASON_NONE, status().last_refusal.reason);
    TEST_ASSERT_EQUAL(DR_AXES, status().last_refusal.axis);
    TEST_ASSERT_EQUAL(DR_NO_ITEM, status().last_refusal.item);
    uint8_t bytes[20];
    TEST_ASSERT_EQUAL(torn ? 0 : 1, dr_guard_pull_device(&rig.guard, guard_clock(), bytes, sizeof bytes));
    if (!torn)
        TEST_ASSERT_EQUAL_HEX8(0x03, bytes[0]);
    later(0);
    SEALED();
    expect_state(DR_GUARD_LOCKED);
    host("\x03", 1); /* ^C passes, unless it might complete a frame */
    TEST_ASSERT_EQUAL(torn ? 0 : 1, dr_guard_pull_device(&rig.guard, guard_clock(), bytes, sizeof bytes));
}

static void break_seal(bool torn) { break_seal_at(torn, (uint8_t *)&rig.guard.forwarded); }

static void damage_is_answered_by_one_ctrl_c(void)
{
    started();
    read_at_home();
    break_seal(false);
    armed();
    break_seal(false);
    armed();
    host(line, 14);
    later(2000);
    read_at_home();
    later(2000);
    while (pull())
        ;
    expect_state(DR_GUARD_MOVING_S);
    break_seal(false);
}

/* An MPC-200's line, 2 ms behind its query: 'S' and the speed have left. */
static void mpc_line_has_begun(uint16_t facts)
{
    bench_mpc();
    rig.by_hand = true;
    rig.limits.rig = facts;
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
    dr_guard_start(&rig.guard, guard_clock(), DR_START_POWER_ON);
    dr_guard_link(&rig.guard, guard_clock(), true, true);
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_KEY, true);
    static const uint32_t reading_after_us[] = {1000000, 2000, 100000, 2000};
    for (size_t i = 0; i < 4; i++) {
        if (i == 1)
            dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_ARM, true);
        if (i == 3)
            host(line_mpc, 14);
        later(reading_after_us[i]);
        TEST_ASSERT_TRUE(pull());
        push(at_home_mpc, 14);
    }
    later(2000);
    TEST_ASSERT_TRUE(pull());
    TEST_ASSERT_TRUE(pull());
    TEST_ASSERT_FALSE(pull()); /* the pause behind 'S' and the speed */
    SEALED();
}

static void damage_within_a_frame_is_answered_by_silence(void)
{
    armed();
    host(line, 14);
    later(2000);
    read_at_home(); /* allowed, and waits for its turn: who knows what of it was pulled */
    break_seal(true);
    mpc_line_has_begun(DR_RIG_KNOBS_LOCKED);
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_STOP, true); /* waits for the frame */
    expect_state(DR_GUARD_STOPPING);
    rig.guard.stops_out = 0; /* else it is open */
    rig.guard.sealed = 0;
    break_seal(true);
}

/* A torn frame is written down twice: the bit that is flipped may be one of the two. */
static void damage_forgets_no_torn_frame(void)
{
    for (unsigned i = 0; i < 3; i++) {
        started();
        read_at_home();
        rig.guard.torn = 1;
        rig.guard.sealed = 0;
        dr_guard_push_host(&rig.guard, guard_clock(), NULL, 0); /* found: as unplugged */
        expect_fault(DR_FAULT_TORN);
        break_seal_at(true, i == 0 ? &rig.guard.torn : i == 1 ? &rig.guard.fault : (uint8_t *)&rig.guard.forwarded);
    }
}

/* -- Readings that are too old --------------------------------------------------------------------------------------------- */

/* A knob moves the tip from the reading until the motion begins; the margin reckons with 10 ms, of which 2.5 are the frame. */
static void a_motion_leaves_in_time_or_is_read_for_again(void)
{
    for (uint32_t late_us = 7500; late_us <= 7501; late_us++) {
        armed();
        rig.limits.rig = 0; /* the knobs are free */
        limits_changed();
        host(line, 14);
        later(2000);
        read_at_home();
        later(late_us);
        uint8_t byte;
        rig.guard.sealed = 0;
        if (late_us == 7500) {
            TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1));
            TEST_ASSERT_EQUAL('S', byte);
        } else {
            (void)dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1);
            expect_state(DR_GUARD_CHECKING);
        }
    }
}

static void obstacle_beside_the_line(int32_t away_q)
{
    const uint8_t item = keep_out(4000, 6000, 5500, 5600, 4000, 6000);
    rig.limits.obstacles[item].box_q.min_q[DR_Y] = UM(5000) + away_q;
    limits_changed();
}

/* Its own bytes take time, for which the margin has room: they are not looked at as if each began the motion. The margin is
 * 50 um and 5 mm/s for 10 ms, or 50 ms; a microsecond more and the obstacle would be in the way. */
static void a_frame_that_left_in_time_is_not_late_while_it_leaves(void)
{
    armed();
    rig.limits.rig = 0;
    limits_changed();
    host(line, 14);
    later(2000);
    read_at_home();
    obstacle_beside_the_line(UM(100) + 1);
    later(7500);
    for (size_t i = 0; i < 14; i++) {
        TEST_ASSERT_TRUE(pull());
        later(174);
    }
    expect_state(DR_GUARD_MOVING_S);
    mpc_line_has_begun(0);
    obstacle_beside_the_line(UM(300) + 1);
    later(45500);
    for (size_t i = 2; i < 14; i++) {
        TEST_ASSERT_TRUE(pull());
        later(79);
    }
    expect_state(DR_GUARD_MOVING_S);
}

static void an_s_may_come_out_of_its_pause_100_ms_late(void)
{
    for (uint32_t late_us = 100000; late_us <= 100001; late_us++) {
        mpc_line_has_begun(0);
        later(45500 + late_us);
        TEST_ASSERT_TRUE(pull());
        expect_state(late_us == 100000 ? DR_GUARD_MOVING_S : DR_GUARD_STOPPING);
    }
}

static void where_the_knobs_are_locked_no_reading_is_too_old(void)
{
    uint8_t byte;
    armed();
    host(line, 14);
    later(2000);
    read_at_home();
    later(5000000);
    rig.guard.sealed = 0;
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1));
    TEST_ASSERT_EQUAL('S', byte);
}

static void a_motion_that_is_late_again_and_again_is_refused(void)
{
    armed();
    rig.limits.rig = 0;
    limits_changed();
    host(line, 14);
    later(2000);
    for (unsigned late = 0; late <= 20; late++) {
        expect_state(DR_GUARD_CHECKING);
        (void)pull();
        push(at_home, 14);
        later(9000);
        (void)dr_guard_pull_device(&rig.guard, guard_clock(), &(uint8_t){0}, 1);
        later(0);
    }
    expect_state(DR_GUARD_IDLE);
    expect_refused(DR_REASON_NO_POSITION);
}

/* A query that nobody has pulled was not asked: what the controller says then is no answer to it. */
static void a_query_that_was_not_pulled_leaves_nothing_to_skip(void)
{
    armed();
    host(line, 14);
    later(2000); /* the query is there, and nobody takes it */
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_STOP, true);
    TEST_ASSERT_TRUE(pull());
    push("\r", 1);
    TEST_ASSERT_EQUAL(1, rig.guard.stop_crs);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_reading_is_sealed_before_it_and_behind_it);
    RUN_TEST(a_query_of_the_host_is_sealed_until_its_answer_comes);
    RUN_TEST(a_motion_is_open_while_its_bytes_are_on_their_way);
    RUN_TEST(the_seal_waits_until_nothing_is_to_do);
    RUN_TEST(a_stop_is_open_until_it_has_left);
    RUN_TEST(a_self_check_is_a_call_as_any);
    RUN_TEST(a_change_of_the_state_is_logged_by_the_call_that_makes_it);
    RUN_TEST(what_a_late_caller_finds_is_logged_with_the_instant_when_it_was_due);
    RUN_TEST(damage_is_answered_by_one_ctrl_c);
    RUN_TEST(damage_within_a_frame_is_answered_by_silence);
    RUN_TEST(damage_forgets_no_torn_frame);
    RUN_TEST(a_motion_leaves_in_time_or_is_read_for_again);
    RUN_TEST(a_frame_that_left_in_time_is_not_late_while_it_leaves);
    RUN_TEST(an_s_may_come_out_of_its_pause_100_ms_late);
    RUN_TEST(where_the_knobs_are_locked_no_reading_is_too_old);
    RUN_TEST(a_motion_that_is_late_again_and_again_is_refused);
    RUN_TEST(a_query_that_was_not_pulled_leaves_nothing_to_skip);
    return UNITY_END();
}
