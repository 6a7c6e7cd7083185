/* Where motions end, and what follows from it. The test is the controller. */
#include "bench.h"

void setUp(void) {}
void tearDown(void) {}

static dr_us guard_clock(void) { return (dr_us)(rig.clock_at_start + rig.now); }

static void trio_says(uint32_t x) { device_at(x, 40000, 40000, 30); }

static void mpc_says(uint32_t x) { device_at_drive(1, x, 80000, 80000); }

static void says(uint32_t x)
{
    if (rig.limits.kind == DR_TRIO)
        trio_says(x);
    else
        mpc_says(x);
}

static void trio(uint16_t facts)
{
    bench_proved_by_hand(DR_TRIO, facts);
    bench_arm_by_hand(device_at_home);
}

static void mpc(void)
{
    bench_mpc();
    bench_start_by_hand(device_at_home);
    bench_arm_by_hand(device_at_home);
}

/* The motion that was asked for is read for, and leaves. */
static void leaves(uint32_t from)
{
    run_us(2000);
    says(from);
    run_us(6000);
    TEST_ASSERT_TRUE(status().state == DR_GUARD_MOVING_S || status().state == DR_GUARD_MOVING_U);
}

/* On its way to 40800; its CR has come, and two readings agree. */
static void x_ends_at(uint32_t at)
{
    trio(0);
    host_axis('x', 40800);
    leaves(40000);
    run_us(20000);
    device_says("\r", 1);
    run_us(2000);
    trio_says(at);
    run_us(100000);
    trio_says(at);
    expect_fault(DR_FAULT_WRONG_END);
}

static void a_motion_that_has_not_moved_has_not_ended(void)
{
    x_ends_at(40000);
    expect_silence();
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open); /* its target stays possible */
    TEST_ASSERT_EQUAL(40800 * 8, rig.guard.scene.old[0].target_q.min_q[DR_X]);
}

static void the_place_of_a_wrong_end_is_known(void)
{
    x_ends_at(40400);
    TEST_ASSERT_EQUAL(40400, status().position_steps[DR_X]);
}

static void a_cr_while_it_still_moves_is_a_fault_at_once(void)
{
    trio(0);
    host_line(15, 48000, 40000, 40000);
    leaves(40000);
    device_says("\r", 1);
    run_us(2000);
    trio_says(41000);
    run_us(100000);
    expect_fault(DR_FAULT_NONE);
    trio_says(42000);
    expect_fault(DR_FAULT_EARLY_CR);
    expect_state(DR_GUARD_STOPPING);
}

static void without_y_only_homing_may_end(void)
{
    trio(DR_RIG_Y_LOCKED_OUT);
    host_line(15, 40080, 40400, 40000);
    leaves(40000);
    run_us(20000);
    device_says("\r", 1);
    run_us(2000);
    trio_says(40080);
    run_us(100000);
    trio_says(40080);
    expect_fault(DR_FAULT_WRONG_END);
}

static uint8_t active;
static void active_says_home(void) { device_at_drive(active + 1u, 80000, 80000, 80000); }

/* [M table 3]: switch 8 of a drive leaves its Y out of homing, and no other's. */
static void each_drive_has_a_switch_of_its_own_for_y(void)
{
    for (active = 0; active < 2; active++)
        for (uint8_t locked_out = 0; locked_out < 2; locked_out++) {
            bench_mpc();
            rig.limits.rig |= DR_RIG_HOME_IS_ZERO;
            rig.limits.rig |= (uint16_t)(DR_RIG_Y_LOCKED_OUT << locked_out);
            rig.limits.drives[active].box_q = (dr_box){{0, 0, 0}, {UM(25000), UM(25000), UM(25000)}};
            rig.limits.drives[active].max_move_q = (uint32_t)DR_FAR_Q;
            bench_start_by_hand(active_says_home);
            bench_arm_by_hand(active_says_home);
            host_code('H');
            run_us(2000);
            active_says_home();
            run_us(6000);
            expect_state(DR_GUARD_MOVING_S);
            device_says("\r", 1);
            run_us(2000);
            device_at_drive(active + 1u, 0, 80000, 0);
            run_us(100000);
            if (active == locked_out) {
                expect_state(DR_GUARD_IDLE);
                expect_cr();
            } else {
                device_at_drive(active + 1u, 0, 80000, 0);
                expect_fault(DR_FAULT_WRONG_END);
            }
        }
}

static void a_small_move_that_the_controller_ignores_has_no_cr(void)
{
    mpc();
    host_point('M', 84000, 80000, 80000);
    leaves(80000);
    run_us(100000);
    device_says("\r", 1);
    run_us(2000);
    mpc_says(84000);
    expect_cr(); /* this one had */
    host_point('M', 84005, 80000, 80000);
    leaves(84000);
    run_us(100000);
    mpc_says(84000);
    expect_state(DR_GUARD_IDLE);
    expect_silence();
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open); /* nothing was broken off */
}

static void the_end_of_a_motion_forgets_what_was_broken_off_on_every_drive(void)
{
    mpc();
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        rig.guard.scene.old[drive] = (dr_old_move){
            true, {80000, 80000, 80000}, {{80000 * 4, 80000 * 4, 80000 * 4}, {80000 * 4, 80000 * 4, 80000 * 4}}};
    rig.guard.sealed = 0;
    host_point('M', 84000, 80000, 80000);
    leaves(80000);
    run_us(100000);
    device_says("\r", 1);
    run_us(2000);
    mpc_says(84000);
    expect_cr();
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        TEST_ASSERT_FALSE(rig.guard.scene.old[drive].is_open);
}

static void a_token_comes_back_50_ms_behind_the_first_motion(void)
{
    trio(0);
    host_axis('x', 40008);
    run_us(2000);
    trio_says(40000);
    const dr_us back = rig.guard.at[DR_TIMER_RATE];
    TEST_ASSERT_EQUAL_UINT32(50000, back - guard_clock());
    run_us(6000);
    device_says("\r", 1);
    run_us(2000);
    trio_says(40008);
    host_axis('x', 40016);
    run_us(2000);
    trio_says(40008);
    expect_state(DR_GUARD_CHECKING);
    TEST_ASSERT_EQUAL_UINT32(back, rig.guard.at[DR_TIMER_RATE]);
}

static void a_short_way_of_a_trio_is_no_small_move(void)
{
    trio(0);
    host_axis('x', 40005);
    run_us(2000);
    trio_says(40000);
    const uint32_t before = rig.wire_count;
    for (unsigned i = 0; i < 5000 && rig.wire_count < before + 5; i++)
        run_us(1);
    TEST_ASSERT_EQUAL_UINT32(2000187, rig.guard.at[DR_TIMER_TASK] - guard_clock()); /* 0.625 um at 5 mm/s */
    trio(0);
    host_line(15, 40005, 40000, 40000);
    leaves(40000);
    TEST_ASSERT_FALSE(rig.guard.small);
}

static void beside_0(void) { device_at_drive(1, 10, 10, 10); }

/* The frame names no target, so nobody can say that the way is short. */
static void homing_is_never_a_small_move(void)
{
    bench_mpc();
    rig.limits.drives[0].box_q = (dr_box){{0, 0, 0}, {UM(25000), UM(25000), UM(25000)}};
    rig.limits.drives[0].max_move_q = (uint32_t)DR_FAR_Q;
    bench_start_by_hand(beside_0);
    bench_arm_by_hand(beside_0);
    host_code('H');
    run_us(2000);
    beside_0();
    run_us(2500);
    expect_state(DR_GUARD_MOVING_S);
    TEST_ASSERT_FALSE(rig.guard.small);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_motion_that_has_not_moved_has_not_ended);
    RUN_TEST(the_place_of_a_wrong_end_is_known);
    RUN_TEST(a_cr_while_it_still_moves_is_a_fault_at_once);
    RUN_TEST(without_y_only_homing_may_end);
    RUN_TEST(a_small_move_that_the_controller_ignores_has_no_cr);
    RUN_TEST(the_end_of_a_motion_forgets_what_was_broken_off_on_every_drive);
    RUN_TEST(a_token_comes_back_50_ms_behind_the_first_motion);
    RUN_TEST(a_short_way_of_a_trio_is_no_small_move);
    RUN_TEST(homing_is_never_a_small_move);
    RUN_TEST(each_drive_has_a_switch_of_its_own_for_y);
    return UNITY_END();
}
