/* The last microstep of what the guard believes about the place, on every axis. The test is the controller: a TRIO with an
 * MP-285 (8 steps/um, 8 quanta/step), an MPC-200 with an MP-225 (16 steps/um) and an MP-845 (3 quanta/step). */
#include "bench.h"

void setUp(void) {}
void tearDown(void) {}

static const uint32_t home[DR_AXES] = {40000, 40000, 40000};

static void says(const uint32_t steps[DR_AXES]) { device_at(steps[0], steps[1], steps[2], 30); }

static void says_off(uint8_t axis, uint32_t steps)
{
    uint32_t at[DR_AXES] = {40000, 40000, 40000};
    at[axis] = steps;
    says(at);
}

static void begun(void)
{
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_us(1000000);
}

static void armed_with(uint16_t facts)
{
    bench_trio();
    rig.limits.rig = facts;
    bench_start_by_hand(device_at_home);
    bench_arm_by_hand(device_at_home);
}

static void a_reading_may_be_500_um_beyond_the_travel(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        begun();
        says_off(axis, 200000 + 4000);
        expect_state(DR_GUARD_DISARMED);
        begun();
        says_off(axis, 200000 + 4001);
        expect_state(DR_GUARD_LOCKED);
        run_us(100000); /* asked again */
        says_off(axis, 200000 + 4001);
        expect_fault(DR_FAULT_IDENTITY);
    }
}

static void mpc_says(uint8_t drive, uint8_t axis, uint32_t steps)
{
    uint32_t at[DR_AXES] = {80000, 80000, 80000};
    at[axis] = steps;
    device_at_drive(drive, at[0], at[1], at[2]);
}

static void second_drive_at_home(void) { device_at_drive(2, 80000, 80000, 80000); }

static void beyond_the_travel_of_the_drive_that_speaks(void)
{
    static const struct {
        uint8_t drive;
        uint32_t steps;
        bool plausible;
    } readings[] = {{1, 400000 + 8000, true}, {1, 400000 + 8001, false}, {2, 543999, true}, {2, 544000, false}};
    for (size_t i = 0; i < sizeof readings / sizeof readings[0]; i++)
        for (uint8_t axis = 0; axis < DR_AXES; axis++) {
            bench_mpc();
            rig.by_hand = true;
            TEST_ASSERT_TRUE(dr_limits_init_drive(&rig.limits, 1, DR_STAGE_MPC_MP845));
            bench_start();
            run_us(1000000);
            mpc_says(readings[i].drive, axis, readings[i].steps);
            expect_state(readings[i].plausible ? DR_GUARD_DISARMED : DR_GUARD_LOCKED);
        }
}

static void two_readings_agree_within_2_microsteps(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        for (int32_t off = -3; off <= 3; off++) {
            begun();
            says(home);
            input(DR_INPUT_KEY, true);
            press(DR_INPUT_ARM);
            run_us(2000);
            says(home);
            run_us(100000);
            says_off(axis, (uint32_t)(40000 + off));
            const bool agree = off >= -2 && off <= 2;
            expect_state(agree ? DR_GUARD_IDLE : DR_GUARD_DISARMED);
            TEST_ASSERT_EQUAL(!agree, (status().needs & DR_NEEDS_STEADY) != 0);
        }
}

/* Asks for a motion of 10 um on another axis; the reading before it says this. */
static void read_before_a_motion(uint8_t axis, uint32_t steps)
{
    host_axis(axis == DR_X ? 'y' : 'x', 40080);
    run_us(2000);
    says_off(axis, steps);
}

static void with_knobs_locked_the_tip_stays_within_20_um(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        for (int side = -1; side <= 1; side += 2) {
            armed_with(DR_RIG_KNOBS_LOCKED);
            read_before_a_motion(axis, (uint32_t)(40000 + side * 160));
            expect_state(DR_GUARD_CHECKING); /* allowed: its turn comes in 2 ms */
            armed_with(DR_RIG_KNOBS_LOCKED);
            read_before_a_motion(axis, (uint32_t)(40000 + side * 161));
            expect_fault(DR_FAULT_POSITION_JUMP);
            expect_refused(DR_REASON_NO_POSITION);
        }
}

static void a_knob_may_have_moved_it_by_5_mm_a_second_and_for_20_s(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        armed_with(0);
        run_us(498000); /* and 2 ms until the reading: 2,500 um */
        read_before_a_motion(axis, 40000 + 20000 + 160);
        expect_state(DR_GUARD_CHECKING);
        armed_with(0);
        run_us(498000);
        read_before_a_motion(axis, 40000 + 20000 + 161);
        expect_fault(DR_FAULT_POSITION_JUMP);
    }
    armed_with(0);
    rig.limits.knob_q_per_s = 1;
    limits_changed();
    run_us(19997999);
    read_before_a_motion(DR_Z, 50000);
    expect_fault(DR_FAULT_POSITION_JUMP);
    armed_with(0);
    rig.limits.knob_q_per_s = 1;
    limits_changed();
    run_us(19998000); /* now the reading is too old to say anything */
    read_before_a_motion(DR_Z, 50000);
    expect_state(DR_GUARD_CHECKING);
}

static void a_motion_ends_within_2_microsteps_of_its_target(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        for (int32_t off = -3; off <= 3; off++) {
            armed_with(DR_RIG_KNOBS_LOCKED);
            host_axis(axis == DR_X ? 'y' : 'x', 40080);
            run_us(2000);
            says(home);
            run_us(20000);
            device_says("\r", 1);
            run_us(2000);
            uint32_t end[DR_AXES] = {40080, 40000, 40000};
            if (axis == DR_X)
                end[DR_X] = 40000, end[DR_Y] = 40080;
            end[axis] = (uint32_t)((int32_t)end[axis] + off);
            says(end);
            if (off >= -2 && off <= 2) {
                expect_state(DR_GUARD_IDLE);
                expect_cr();
            } else {
                run_us(100000);
                says(end);
                expect_fault(DR_FAULT_WRONG_END);
                expect_silence();
            }
        }
}

static void knobs_that_are_locked_stay_locked_however_long_it_takes(void)
{
    armed_with(DR_RIG_KNOBS_LOCKED);
    run_us(60000000);
    read_before_a_motion(DR_Z, 40000 + 161);
    expect_fault(DR_FAULT_POSITION_JUMP);
}

/* Both drives of an MPC-200, the second with 3 quanta a microstep: 426 of them are 1,278 quanta, 20 um are 1,280. */
static void each_drive_is_held_against_its_own_place(void)
{
    for (uint32_t jump = 426; jump <= 427; jump++) {
        bench_mpc();
        TEST_ASSERT_TRUE(dr_limits_init_drive(&rig.limits, 1, DR_STAGE_MPC_MP845));
        bench_start_by_hand(second_drive_at_home);
        bench_arm_by_hand(second_drive_at_home);
        host_point('M', 80000, 80100, 80000);
        run_us(2000);
        mpc_says(2, DR_Z, 80000 + jump);
        expect_fault(jump == 426 ? DR_FAULT_NONE : DR_FAULT_POSITION_JUMP);
        expect_state(jump == 426 ? DR_GUARD_CHECKING : DR_GUARD_FAULT);
    }
    bench_mpc(); /* another drive, chosen by hand, is anywhere: no jump, but not the one that the host meant */
    bench_start_by_hand(device_at_home);
    bench_arm_by_hand(device_at_home);
    host_point('M', 80000, 80100, 80000);
    run_us(2000);
    mpc_says(2, DR_X, 90000); /* which is news: read twice */
    run_us(4000);
    mpc_says(2, DR_X, 90000);
    expect_fault(DR_FAULT_NONE);
    expect_refused(DR_REASON_DRIVE);
}

/* Read as an MPC-200's, the lowest byte of Y is the highest of X, and so on; beyond 2^24 microsteps no MPC-200 goes. */
static void a_trio_at_0_degrees_is_no_mpc_where_an_axis_would_be_too_long(void)
{
    static const struct {
        uint32_t y, z;
        uint8_t angle;
        dr_guard_state state;
    } readings[] = {{0, 0, 0, DR_GUARD_LOCKED},
                    {1, 0, 0, DR_GUARD_DISARMED},
                    {0, 1, 0, DR_GUARD_DISARMED},
                    {0, 0, 1, DR_GUARD_DISARMED}};
    for (size_t i = 0; i < sizeof readings / sizeof readings[0]; i++) {
        begun();
        device_at(1, readings[i].y, readings[i].z, readings[i].angle);
        expect_state(readings[i].state);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_reading_may_be_500_um_beyond_the_travel);
    RUN_TEST(beyond_the_travel_of_the_drive_that_speaks);
    RUN_TEST(two_readings_agree_within_2_microsteps);
    RUN_TEST(with_knobs_locked_the_tip_stays_within_20_um);
    RUN_TEST(a_knob_may_have_moved_it_by_5_mm_a_second_and_for_20_s);
    RUN_TEST(a_motion_ends_within_2_microsteps_of_its_target);
    RUN_TEST(knobs_that_are_locked_stay_locked_however_long_it_takes);
    RUN_TEST(each_drive_is_held_against_its_own_place);
    RUN_TEST(a_trio_at_0_degrees_is_no_mpc_where_an_axis_would_be_too_long);
    return UNITY_END();
}
