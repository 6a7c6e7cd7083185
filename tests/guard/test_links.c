/* Cables, the host's port and the key: what each change ends, and what it leaves alone. The test is the controller. */
#include "bench.h"

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

static void says(uint32_t x) { device_at(x, 40000, 40000, 30); }

static void nothing_is_due(void)
{
    dr_us when;
    TEST_ASSERT_FALSE(dr_guard_due(&rig.guard, &when));
}

static void begun(uint16_t facts, dr_host_loss loss)
{
    bench_trio();
    rig.by_hand = true;
    rig.limits.rig = (uint16_t)(DR_RIG_KNOBS_LOCKED | facts);
    rig.limits.host_loss = (uint8_t)loss;
    keep_out(10000, 11000, 0, 25000, 0, 25000);
    bench_start();
}

static void armed(uint16_t facts, dr_host_loss loss)
{
    begun(facts, loss);
    run_us(1000000);
    says(40000);
    bench_arm_by_hand(device_at_home);
}

static void line_is_read_for(void)
{
    host_line(15, 48000, 40000, 40000);
    run_us(2000);
    says(40000);
}

static void a_cable_pulled_at_rest_or_within_a_setting_breaks_no_motion_off(void)
{
    armed(0, DR_HOST_LOSS_STOP);
    run_us(1000);
    host_value('A', 45);
    TEST_ASSERT_EQUAL(1, rig.guard.out_at);
    cables(true, false);
    expect_fault(DR_FAULT_TORN);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
    armed(0, DR_HOST_LOSS_STOP);
    line_is_read_for();
    run_us(10000);
    host_code(3);
    run_us(1000);
    device_says("\r", 1);
    run_us(100000);
    says(48000); /* it was there before ^C came */
    run_us(100000);
    says(48000);
    expect_state(DR_GUARD_IDLE);
    cables(true, false);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
    armed(0, DR_HOST_LOSS_STOP);
    line_is_read_for(); /* allowed; nothing of it has left */
    cables(true, false);
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);
    TEST_ASSERT_EQUAL(0, rig.guard.running >> DR_TIMER_SEND & 1);
}

static void a_host_that_goes_leaves_no_half_of_anything(void)
{
    armed(0, DR_HOST_LOSS_STOP);
    host_bytes("S\1\2", 3);
    cables(false, true);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_EQUAL(0, rig.guard.running >> DR_TIMER_FRAME & 1);
    cables(true, true);
    const uint32_t before = rig.wire_count;
    host_code('c'); /* a query, not the rest of a line */
    run_us(500);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
}

static void a_host_that_goes_takes_what_it_has_not_read_along(void)
{
    armed(0, DR_HOST_LOSS_STOP);
    host_code('c');
    run_us(500);
    dr_guard_push_device(&rig.guard, guard_clock(), (const uint8_t *)"abc", 3);
    dr_guard_link(&rig.guard, guard_clock(), false, true);
    dr_guard_link(&rig.guard, guard_clock(), true, true);
    TEST_ASSERT_EQUAL(0, dr_guard_pull_host(&rig.guard, guard_clock(), (uint8_t[8]){0}, 8));
}

static void a_rig_that_stays_armed_does_so_within_a_query(void)
{
    armed(DR_RIG_STAYS_ARMED, DR_HOST_LOSS_STOP);
    host_code('c');
    cables(false, true);
    run_us(500);
    says(40000);
    expect_state(DR_GUARD_IDLE);
}

static void a_motion_may_finish_without_its_host_from_its_first_byte_on(void)
{
    armed(0, DR_HOST_LOSS_FINISH);
    line_is_read_for();
    const uint32_t before = rig.wire_count;
    for (unsigned i = 0; i < 4000 && rig.wire_count == before; i++)
        run_us(1);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
    cables(false, true);
    expect_state(DR_GUARD_MOVING_S);
    run_us(100000);
    TEST_ASSERT_EQUAL(0, wire_stops());
    device_says("\r", 1);
    run_us(2000);
    says(48000);
    expect_state(DR_GUARD_DISARMED);
    armed(0, DR_HOST_LOSS_FINISH);
    line_is_read_for(); /* not begun: it will not */
    cables(false, true);
    expect_refused(DR_REASON_CANCELLED);
    run_us(500);
    TEST_ASSERT_EQUAL(1, wire_stops());
}

static void a_motion_whose_end_is_being_looked_for_may_finish_too(void)
{
    armed(0, DR_HOST_LOSS_FINISH);
    line_is_read_for();
    run_us(10000);
    device_says("\r", 1);
    line_hangs();
    run_us(2000); /* the query for its end is there, and waits for the line */
    cables(false, true);
    line_goes_on();
    run_us(500);
    says(48000);
    expect_state(DR_GUARD_DISARMED);
    TEST_ASSERT_EQUAL(0, wire_stops());
    TEST_ASSERT_NOT_NULL(last_record(DR_EVENT_ENDED));
}

static void who_has_gone_cannot_go_again(void)
{
    armed(0, DR_HOST_LOSS_FINISH);
    line_is_read_for();
    run_us(200000);
    cables(false, true);
    cables(false, false);
    expect_fault(DR_FAULT_NO_DEVICE);
    TEST_ASSERT_NULL(last_record(DR_EVENT_STOP)); /* the host had gone before, and its motion was to finish */
    input(DR_INPUT_STOP, true);
    run_us(50000);
    expect_fault(DR_FAULT_STOP_WIRING);
    cables(true, false);
    expect_fault(DR_FAULT_STOP_WIRING); /* the controller had gone before, too */
}

/* A proof that was given up is begun anew by the key, or by the cable. */
static void a_second_contact_begins_no_proof(void)
{
    begun(0, DR_HOST_LOSS_STOP);
    run_us(200000000); /* asked ten times, in vain */
    input(DR_INPUT_STOP, true);
    run_us(5000000);
    expect_state(DR_GUARD_LOCKED);
    const uint32_t before = rig.wire_count;
    input(DR_INPUT_STOP_2, true);
    run_us(5000000);
    TEST_ASSERT_EQUAL(before, rig.wire_count);
    TEST_ASSERT_EQUAL(0, status().needs & DR_NEEDS_REST);
}

static void a_host_that_goes_clears_no_fault(void)
{
    armed(0, DR_HOST_LOSS_FINISH);
    device_says("0123456789abcdefg", 17);
    expect_state(DR_GUARD_FAULT);
    cables(false, true);
    expect_state(DR_GUARD_FAULT);
}

static void the_devices_cable_is_not_the_hosts(void)
{
    armed(0, DR_HOST_LOSS_STOP);
    host_bytes("x\1\2", 3);
    cables(true, false);
    host_bytes("\0\0", 2); /* the host goes on, and is told no */
    TEST_ASSERT_EQUAL(1, status().refused);
    expect_refused(DR_REASON_NOT_ARMED);
    TEST_ASSERT_EQUAL(1, last_record(DR_EVENT_LINK)->code);
    cables(false, false);
    TEST_ASSERT_EQUAL(0, last_record(DR_EVENT_LINK)->code);
    const uint32_t records = rig.log_count;
    cables(false, false);
    TEST_ASSERT_EQUAL(records, rig.log_count); /* nothing has changed */
}

static void another_cable_may_bring_another_controller(void)
{
    static const uint8_t at_home[] = {1, 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x0D};
    bench_mpc();
    rig.by_hand = true;
    bench_start();
    run_us(1000000);
    device_says(at_home, 14);
    host_code('K');
    run_us(500);
    device_says("\1\x19\3\r", 4); /* 3.19 where the limits are for 3.21 */
    expect_fault(DR_FAULT_IDENTITY);
    const uint32_t before = rig.wire_count;
    input(DR_INPUT_KEY, true);
    run_us(5000000);
    TEST_ASSERT_EQUAL(before, rig.wire_count); /* the key does not help */
    cables(true, false);
    cables(true, true);
    run_us(60000000 * 2);
    expect_fault(DR_FAULT_DEVICE_SILENT); /* asked, ten times, in vain */
    input(DR_INPUT_KEY, false);
    input(DR_INPUT_KEY, true); /* once more */
    run_us(1000000);
    device_says(at_home, 14);
    expect_state(DR_GUARD_DISARMED);
}

static void the_key_begins_no_second_proof(void)
{
    dr_us when;
    begun(0, DR_HOST_LOSS_STOP);
    run_us(400000);
    input(DR_INPUT_KEY, true);
    TEST_ASSERT_TRUE(dr_guard_due(&rig.guard, &when));
    TEST_ASSERT_EQUAL_UINT32(600000, when - guard_clock());
    run_us(600000);
    static const uint8_t both[] = {1, 0x9C, 0, 0, 0, 0x9C, 0, 0, 0, 0x9C, 0, 0, 0, 0x0D};
    device_says(both, sizeof both);
    input(DR_INPUT_KEY, false);
    input(DR_INPUT_KEY, true); /* who it is only CONFIRM can tell */
    TEST_ASSERT_TRUE(status().confirm_wanted);
    press(DR_INPUT_CONFIRM);
    expect_state(DR_GUARD_DISARMED);
}

static void without_limits_the_key_proves_nothing(void)
{
    bench_trio();
    dr_guard_init(&rig.guard, NULL, rig.ring, 64);
    dr_guard_start(&rig.guard, guard_clock(), DR_START_POWER_ON);
    dr_guard_link(&rig.guard, guard_clock(), true, true);
    dr_guard_input(&rig.guard, guard_clock(), DR_INPUT_KEY, true);
    nothing_is_due();
    expect_fault(DR_FAULT_LIMITS);
}

static void a_stop_wants_to_be_cleared(void)
{
    armed(0, DR_HOST_LOSS_STOP);
    stop_input(true);
    run_us(1000);
    device_says("\r", 1);
    run_us(100000);
    says(40000);
    run_us(100000);
    says(40000);
    stop_input(false);
    run_us(20000);
    expect_state(DR_GUARD_STOPPED);
    TEST_ASSERT_EQUAL(DR_NEEDS_CLEAR, status().needs);
    clear_fault();
    TEST_ASSERT_EQUAL(0, status().needs);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_cable_pulled_at_rest_or_within_a_setting_breaks_no_motion_off);
    RUN_TEST(a_host_that_goes_leaves_no_half_of_anything);
    RUN_TEST(a_host_that_goes_takes_what_it_has_not_read_along);
    RUN_TEST(a_rig_that_stays_armed_does_so_within_a_query);
    RUN_TEST(a_motion_may_finish_without_its_host_from_its_first_byte_on);
    RUN_TEST(a_host_that_goes_clears_no_fault);
    RUN_TEST(the_devices_cable_is_not_the_hosts);
    RUN_TEST(another_cable_may_bring_another_controller);
    RUN_TEST(the_key_begins_no_second_proof);
    RUN_TEST(without_limits_the_key_proves_nothing);
    RUN_TEST(a_stop_wants_to_be_cleared);
    RUN_TEST(a_motion_whose_end_is_being_looked_for_may_finish_too);
    RUN_TEST(who_has_gone_cannot_go_again);
    RUN_TEST(a_second_contact_begins_no_proof);
    return UNITY_END();
}
