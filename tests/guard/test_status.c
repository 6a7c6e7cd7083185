/* What the guard tells of itself: from its first moment on, for every reason to want a CONFIRM, and of the place. */
#include "bench.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

static void says_at(uint32_t x, uint8_t angle) { device_at(x, 40000, 40000, angle); }

static void proved(bool with_obstacle)
{
    bench_trio();
    rig.by_hand = true;
    if (with_obstacle)
        keep_out(10000, 11000, 0, 25000, 0, 25000);
    bench_start();
    run_us(1000000);
    says_at(40000, 30);
    expect_state(DR_GUARD_DISARMED);
}

static dr_record started(const dr_limits *limits, dr_start how)
{
    dr_record record;
    dr_guard_init(&rig.guard, limits, rig.ring, 64);
    dr_guard_start(&rig.guard, 5, how);
    TEST_ASSERT_TRUE(dr_guard_pull_log(&rig.guard, &record));
    TEST_ASSERT_FALSE(dr_guard_pull_log(&rig.guard, &(dr_record){.sequence = 0}));
    return record;
}

static void the_first_record_names_the_limits_and_how_it_began(void)
{
    bench_trio();
    rig.limits.revision = 77;
    for (uint8_t how = DR_START_POWER_ON; how <= DR_START_MID_FRAME; how++) {
        const dr_record record = started(&rig.limits, (dr_start)how);
        TEST_ASSERT_EQUAL(DR_EVENT_START, record.event);
        TEST_ASSERT_EQUAL(5, record.when);
        TEST_ASSERT_EQUAL(how, record.code);
        TEST_ASSERT_EQUAL_HEX32(dr_limits_crc(&rig.limits), record.position_steps[0]);
        TEST_ASSERT_EQUAL(77, record.position_steps[1]);
        TEST_ASSERT_EQUAL(0, record.position_steps[2]);
        expect_state(DR_GUARD_LOCKED);
        expect_fault(how == DR_START_MID_FRAME ? DR_FAULT_TORN : DR_FAULT_NO_DEVICE);
        TEST_ASSERT_EQUAL(how == DR_START_MID_FRAME || rig.limits.obstacle_count == 0, status().confirm_wanted);
        TEST_ASSERT_EQUAL(DR_REASON_NONE, status().last_refusal.reason);
        TEST_ASSERT_EQUAL(DR_AXES, status().last_refusal.axis);
        TEST_ASSERT_EQUAL(DR_NO_ITEM, status().last_refusal.item);
        TEST_ASSERT_EQUAL_INT64(0, status().last_refusal.measured);
        TEST_ASSERT_EQUAL_INT64(0, status().last_refusal.limit);
    }
    const dr_record record = started(NULL, DR_START_POWER_ON);
    for (uint8_t i = 0; i < DR_AXES; i++)
        TEST_ASSERT_EQUAL(0, record.position_steps[i]);
    expect_fault(DR_FAULT_LIMITS);
    TEST_ASSERT_FALSE(status().confirm_wanted);
}

static void a_confirm_is_wanted_where_nothing_is_kept_out_until_it_comes(void)
{
    proved(false);
    TEST_ASSERT_TRUE(status().confirm_wanted);
    press(DR_INPUT_CONFIRM);
    TEST_ASSERT_FALSE(status().confirm_wanted);
    proved(true);
    TEST_ASSERT_FALSE(status().confirm_wanted);
}

static void a_confirm_is_wanted_for_a_changed_tip(void)
{
    proved(true);
    press(DR_INPUT_TIP_CHANGED);
    TEST_ASSERT_TRUE(status().confirm_wanted);
    press(DR_INPUT_CONFIRM);
    TEST_ASSERT_FALSE(status().confirm_wanted);
}

static void a_confirm_is_wanted_where_the_reply_fits_both_controllers(void)
{
    bench_trio();
    rig.by_hand = true;
    keep_out(10000, 11000, 0, 25000, 0, 25000);
    bench_start();
    run_us(1000000);
    static const uint8_t both[] = {1, 0x9C, 0, 0, 0, 0x9C, 0, 0, 0, 0x9C, 0, 0, 0, 0x0D};
    device_says(both, sizeof both);
    expect_state(DR_GUARD_LOCKED);
    TEST_ASSERT_TRUE(status().confirm_wanted);
    press(DR_INPUT_CONFIRM);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_FALSE(status().confirm_wanted);
}

static void drive_angle_and_place_are_those_of_the_last_reading(void)
{
    static const uint8_t second[] = {2, 0x80, 0x38, 1, 0, 0x81, 0x38, 1, 0, 0x82, 0x38, 1, 0, 0x0D};
    proved(true);
    host_code('c');
    run_us(500);
    says_at(41000, 77);
    TEST_ASSERT_EQUAL(77, status().angle_deg);
    TEST_ASSERT_EQUAL(41000, status().position_steps[DR_X]);
    TEST_ASSERT_TRUE(status().position_known);
    bench_mpc();
    rig.by_hand = true;
    bench_start();
    run_us(1000000);
    device_says(second, sizeof second);
    TEST_ASSERT_EQUAL(1, status().drive);
    TEST_ASSERT_EQUAL(80002, status().position_steps[DR_Z]);
}

static void a_place_outside_counts_when_it_is_known_and_nothing_is_under_way(void)
{
    bench_trio();
    rig.by_hand = true;
    rig.limits.drives[0].box_q.min_q[DR_X] = UM(5100);
    bench_start();
    run_us(1000000);
    TEST_ASSERT_FALSE((status().needs & DR_NEEDS_INSIDE) != 0);
    says_at(40000, 30);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_INSIDE) != 0);
    input(DR_INPUT_ESCAPE, true);
    TEST_ASSERT_FALSE((status().needs & DR_NEEDS_INSIDE) != 0);
    input(DR_INPUT_ESCAPE, false);
    host_code('c');
    TEST_ASSERT_FALSE((status().needs & DR_NEEDS_INSIDE) != 0); /* a reply is on its way */
    run_us(500);
    says_at(40000, 30);
    TEST_ASSERT_TRUE((status().needs & DR_NEEDS_INSIDE) != 0);
    cables(true, false);
    TEST_ASSERT_FALSE((status().needs & DR_NEEDS_INSIDE) != 0); /* nobody knows */
}

static void an_error_on_the_hosts_line_is_a_call_as_any(void)
{
    proved(true);
    host_bytes("S", 1);
    TEST_ASSERT_FALSE(rig.guard.sealed);
    dr_guard_host_line_error(&rig.guard, guard_clock());
    TEST_ASSERT_TRUE(rig.guard.sealed);
    TEST_ASSERT_EQUAL(1, status().dropped_bytes);
    rig.guard.forwarded ^= 2;
    dr_guard_host_line_error(&rig.guard, guard_clock());
    TEST_ASSERT_EQUAL(0, rig.guard.dropped_bytes); /* damage was found, and all was forgotten */
    expect_fault(DR_FAULT_DAMAGED);
}

static void reading_the_log_leaves_the_seal_as_it_was(void)
{
    dr_record record;
    proved(true);
    host_bytes("S", 1);
    rig.guard.sealed = 0;
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_IN_TISSUE, true); /* one record */
    TEST_ASSERT_FALSE(rig.guard.sealed);
    TEST_ASSERT_TRUE(dr_guard_pull_log(&rig.guard, &record));
    TEST_ASSERT_EQUAL(DR_EVENT_INPUT, record.event);
    TEST_ASSERT_FALSE(rig.guard.sealed);
    proved(true);
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_IN_TISSUE, true);
    TEST_ASSERT_TRUE(rig.guard.sealed);
    TEST_ASSERT_TRUE(dr_guard_pull_log(&rig.guard, &record));
    TEST_ASSERT_TRUE(rig.guard.sealed);
    expect_state(DR_GUARD_DISARMED);
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_IN_TISSUE, false);
    rig.guard.forwarded ^= 2; /* the log's place is not to be believed either */
    TEST_ASSERT_FALSE(dr_guard_pull_log(&rig.guard, &record));
    expect_fault(DR_FAULT_DAMAGED);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_first_record_names_the_limits_and_how_it_began);
    RUN_TEST(a_confirm_is_wanted_where_nothing_is_kept_out_until_it_comes);
    RUN_TEST(a_confirm_is_wanted_for_a_changed_tip);
    RUN_TEST(a_confirm_is_wanted_where_the_reply_fits_both_controllers);
    RUN_TEST(drive_angle_and_place_are_those_of_the_last_reading);
    RUN_TEST(a_place_outside_counts_when_it_is_known_and_nothing_is_under_way);
    RUN_TEST(an_error_on_the_hosts_line_is_a_call_as_any);
    RUN_TEST(reading_the_log_leaves_the_seal_as_it_was);
    return UNITY_END();
}
