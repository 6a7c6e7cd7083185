/* When the guard's memory is sealed: whenever nothing is in the middle of anything. test_flips shows what the seal finds. */
#include "bench.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

/* One byte for the controller, if there is one. */
static bool pull(void)
{
    uint8_t byte;
    return dr_guard_pull_device(&rig.guard, guard_clock(), &byte, 1) == 1;
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
    later(1);
    OPEN(); /* nor is being asked when nothing is due */
    uint8_t byte;
    TEST_ASSERT_EQUAL(0, dr_guard_pull_host(&rig.guard, guard_clock(), &byte, 1));
    OPEN();
    push("\r", 1);
    SEALED();
    later(2000);
    OPEN();
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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_reading_is_sealed_before_it_and_behind_it);
    RUN_TEST(a_query_of_the_host_is_sealed_until_its_answer_comes);
    RUN_TEST(a_motion_is_open_while_its_bytes_are_on_their_way);
    RUN_TEST(a_stop_is_open_until_it_has_left);
    RUN_TEST(a_change_of_the_state_is_logged_by_the_call_that_makes_it);
    RUN_TEST(what_a_late_caller_finds_is_logged_with_the_instant_when_it_was_due);
    return UNITY_END();
}
