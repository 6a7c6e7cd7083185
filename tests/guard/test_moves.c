/* The guard in front of an emulated controller: what is allowed passes, byte for byte; what is not, does not. */
#include "bench.h"

void setUp(void) {}
void tearDown(void) {}

static void a_trio_line_passes_and_its_cr_comes_when_it_is_there(void)
{
    bench_armed_trio();
    host_line(15, 44000, 40000, 40000); /* 500 um */
    run_ms(300);
    expect_tip(0, 44000, 40000, 40000);
    expect_cr();
    expect_silence();
    expect_state(DR_GUARD_IDLE);
}

static void an_mpc_move_passes(void)
{
    bench_armed_mpc();
    host_point('M', 88000, 80000, 72000);
    run_ms(400);
    expect_tip(0, 88000, 80000, 72000);
    expect_cr();
    expect_silence();
}

static void an_mpc_line_is_paused_as_the_controller_needs_it(void)
{
    bench_mpc();
    rig.controller.quirks = DR_QUIRK_S_NEEDS_PAUSE;
    bench_start();
    bench_arm();
    host_line(15, 84000, 80000, 80000);
    run_ms(1000);
    expect_tip(0, 84000, 80000, 80000);
    expect_cr();
}

static void queries_pass_byte_by_byte_in_any_quiet_state(void)
{
    bench_trio();
    bench_start();
    host_code('c');
    run_ms(10);
    const uint8_t reply[] = {0x40, 0x9C, 0, 0, 0x40, 0x9C, 0, 0, 0x40, 0x9C, 0, 0, 30, 0x0D};
    expect_heard(reply, sizeof reply);
    expect_silence();
}

static void a_stop_in_mid_move_ends_it_with_one_cr(void)
{
    bench_armed_trio();
    host_line(0, 48000, 40000, 40000);
    run_ms(100);
    expect_state(DR_GUARD_MOVING_S);
    host_code(3);
    expect_state(DR_GUARD_STOPPING);
    run_ms(400);
    expect_state(DR_GUARD_IDLE);
    expect_cr();
    expect_silence();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_trio_line_passes_and_its_cr_comes_when_it_is_there);
    RUN_TEST(an_mpc_move_passes);
    RUN_TEST(an_mpc_line_is_paused_as_the_controller_needs_it);
    RUN_TEST(queries_pass_byte_by_byte_in_any_quiet_state);
    RUN_TEST(a_stop_in_mid_move_ends_it_with_one_cr);
    return UNITY_END();
}
