/* The hostile host: random and structured frames at all times, on random rigs with tight limits. The monitors of bench.h
 * see to it that the tip never enters an obstacle or leaves its box and that no refused motion is answered.
 * test_hostile [FRAMES [SEED]]: session n of a seed depends on both alone. From 1,000,000 frames on, all of the openings. */
#include "hostile.h"

#include <stdio.h>
#include <stdlib.h>

#define FRAMES_OF_A_SESSION 200u
#define FULL 1000000u

static unsigned long frames = 50000, seed = 1;

void setUp(void) {}
void tearDown(void) {}

static void nothing_unsafe_gets_through(void)
{
    unsigned long done = 0, forwarded = 0, refused = 0, motions = 0, latched = 0;
    for (unsigned long session = 0; done < frames; session++) {
        chance c = {NULL, 0, 0, seed * UINT64_C(1000003) + session};
        uint8_t state = DR_GUARD_LOCKED;
        for (unsigned i = 0; i < 8; i++)
            (void)any_below(&c, 2);
        hostile_begin(&c, false);
        for (unsigned i = 0; i < FRAMES_OF_A_SESSION; i++, done++) {
            hostile_act(&c);
            latched += status().state == DR_GUARD_FAULT && state != DR_GUARD_FAULT;
            state = status().state;
        }
        forwarded += status().forwarded;
        refused += status().refused;
        motions += rig.motions;
    }
    (void)printf("%lu frames: %lu commands passed, %lu of them motions; %lu refused; %lu faults\n", done, forwarded,
                 motions, refused, latched);
    TEST_ASSERT_TRUE(motions > frames / 100); /* it was allowed to move at all */
    TEST_ASSERT_TRUE(refused > frames / 100);
}

static void armed(int kind)
{
    if (kind == DR_TRIO)
        bench_armed_trio();
    else
        bench_armed_mpc();
}

static void expect_nothing_moved(int kind)
{
    const uint32_t at = kind == DR_TRIO ? 40000 : 80000;
    TEST_ASSERT_EQUAL(0, rig.motions);
    expect_tip(0, at, at, at);
}

/* No frame of two bytes moves anything, whatever bytes they are; nor do two frames of one. */
static void all_two_byte_openings(void)
{
    const uint32_t step = frames < FULL ? 17 : 1;
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++) {
        armed(kind);
        for (uint32_t pair = 0; pair < 65536; pair += step) {
            const uint8_t opening[2] = {(uint8_t)(pair >> 8), (uint8_t)pair};
            bench_forget();
            host_bytes(opening, 2);
            run_ms(400); /* cut off, and out of RESYNC */
            expect_nothing_moved(kind);
            TEST_ASSERT_TRUE(rig.guard.framer.have == 0 && !rig.guard.resync);
            if (rig.state == DR_GUARD_DISARMED) /* after 900 s without a motion */
                bench_arm();
            expect_state(DR_GUARD_IDLE);
        }
    }
}

/* A sound frame of a command: 50 um along each axis that it takes. */
static size_t sound_frame(int kind, const dr_command *command, uint8_t *frame)
{
    const uint32_t to = kind == DR_TRIO ? 40400 : 80800;
    switch (command->args) {
    case DR_ARGS_LINE:
        return put_line_frame(frame, 15, to, to, to);
    case DR_ARGS_POINT:
        return put_point_frame(frame, command->code, to, to, to);
    default: /* one coordinate, one byte: 1 is an angle, a drive and a mode; none */
        (void)put_point_frame(frame, command->code, command->args == DR_ARGS_BYTE ? 1 : to, 0, 0);
        return 1u + command->args;
    }
}

static void every_prefix_of_every_command_moves_nothing(void)
{
    dr_command command;
    uint8_t frame[DR_FRAME_MAX];
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++)
        for (uint8_t row = 0; dr_command_row((dr_kind)kind, row, &command); row++) {
            const size_t length = sound_frame(kind, &command, frame);
            armed(kind);
            for (size_t cut = 1; cut < length; cut++) {
                host_bytes(frame, cut);
                run_ms(400);
                expect_nothing_moved(kind);
                expect_state(DR_GUARD_IDLE);
            }
        }
}

/* The protocol has no check sum: a flipped bit may move the tip elsewhere, within the limits (M3) and as a whole (M1). */
static void every_flipped_bit_of_every_command_keeps_to_the_limits(void)
{
    dr_command command;
    uint8_t frame[DR_FRAME_MAX];
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++)
        for (uint8_t row = 0; dr_command_row((dr_kind)kind, row, &command); row++) {
            const size_t bits = 8 * sound_frame(kind, &command, frame);
            for (size_t bit = 0; bit < bits; bit++) {
                armed(kind);
                (void)sound_frame(kind, &command, frame);
                frame[bit / 8] = (uint8_t)(frame[bit / 8] ^ 1u << bit % 8);
                host_bytes(frame, bits / 8);
                run_ms(1500);
            }
        }
}

int main(int argc, char **argv)
{
    if (argc > 1)
        frames = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        seed = strtoul(argv[2], NULL, 10);
    UNITY_BEGIN();
    RUN_TEST(nothing_unsafe_gets_through);
    RUN_TEST(all_two_byte_openings);
    RUN_TEST(every_prefix_of_every_command_moves_nothing);
    RUN_TEST(every_flipped_bit_of_every_command_keeps_to_the_limits);
    return UNITY_END();
}
