/* One flipped bit: in a frame of the host's on its way here (row 21), and in the guard's own memory (row 72). The monitors of
 * bench.h run under both.
 * test_flips [all]: every bit; without it a sample that is another one for each frame and state. */
#include "bench.h"

#include <stdio.h>
#include <string.h>

static bool all;
static bench saved;

void setUp(void) {}
void tearDown(void) {}

typedef enum {
    AT_LOCKED,
    AT_DISARMED,
    AT_IDLE,
    AT_CHECKING,
    AT_SENDING,  /* allowed, before its first byte */
    AT_PAUSE,    /* within the 'S' of an MPC-200 */
    AT_MOVING,   /* what ^C stops */
    AT_MOVING_U, /* what it does not */
    AT_STOPPING,
    AT_FAULT,
    AT_STOPPED,
    STATES
} at_state;

static uint32_t home_of(int kind) { return kind == DR_TRIO ? 40000 : 80000; }

static void stopped_by_hand(bool with_fault)
{
    stop_input(true);
    run_ms(600);
    if (with_fault) {
        input(DR_INPUT_STOP_2, false);
        run_ms(60);
        expect_fault(DR_FAULT_STOP_WIRING);
    }
}

/* False: this controller has no such state. */
static bool bring_to(int kind, at_state state)
{
    const uint32_t at = home_of(kind);
    if ((kind == DR_TRIO && state == AT_PAUSE) || (kind == DR_MPC && state == AT_MOVING_U))
        return false;
    if (kind == DR_TRIO)
        bench_trio();
    else
        bench_mpc();
    (void)keep_out(9000, 9100, 9000, 9100, 9000, 9100);
    rig.by_hand = state == AT_LOCKED;
    bench_start();
    if (state == AT_LOCKED || state == AT_DISARMED)
        return true;
    bench_arm();
    if (state == AT_FAULT || state == AT_STOPPED) {
        stopped_by_hand(state == AT_FAULT);
        return true;
    }
    if (state == AT_IDLE)
        return true;
    if (state == AT_MOVING_U)
        host_axis('x', at + 7200); /* 180 ms */
    else
        host_line(4, at + 4800, at, at);
    if (state == AT_SENDING)
        while (rig.guard.out_count < 14)
            run_us(50);
    else if (state != AT_CHECKING)
        run_ms(state == AT_PAUSE ? 15 : 80);
    if (state == AT_STOPPING)
        host_code(3);
    static const uint8_t expected[STATES] = {
        [AT_CHECKING] = DR_GUARD_CHECKING, [AT_SENDING] = DR_GUARD_CHECKING,  [AT_PAUSE] = DR_GUARD_MOVING_S,
        [AT_MOVING] = DR_GUARD_MOVING_S,   [AT_MOVING_U] = DR_GUARD_MOVING_U, [AT_STOPPING] = DR_GUARD_STOPPING};
    expect_state((dr_guard_state)expected[state]);
    return true;
}

/* -- Row 72 ------------------------------------------------------------------------------------------------------------- */

static void flip_in_memory(size_t bit)
{
    uint8_t *const bytes = (uint8_t *)&rig.guard;
    bytes[bit / 8] = (uint8_t)(bytes[bit / 8] ^ 1u << bit % 8);
    rig.is_damaged = true;
}

static uint32_t motion_bytes_since(uint32_t from)
{
    uint32_t count = 0;
    for (uint32_t i = from; i < rig.wire_count; i++)
        count += rig.wire[i] != 'c' && rig.wire[i] != 'C' && rig.wire[i] != 0x03;
    return count;
}

/* Whichever bit of its memory flips while nothing is on its way in or out: with the next event the guard finds it and locks, and
 * nothing more of a motion leaves. */
static void row_72_every_flipped_bit_of_the_guards_memory_is_found(void)
{
    const size_t bits = offsetof(dr_guard, word_end) * 8;
    uint32_t found = 0;
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++)
        for (int state = AT_LOCKED; state < STATES; state++) {
            if (!bring_to(kind, (at_state)state))
                continue;
            const uint32_t at = home_of(kind);
            saved = rig;
            TEST_ASSERT_TRUE(rig.guard.sealed);
            for (size_t bit = all ? 0 : (size_t)(state * 7 + kind) % 7; bit < bits; bit += all ? 1 : 7) {
                rig = saved;
                flip_in_memory(bit);
                TEST_ASSERT_EQUAL(DR_FAULT_DAMAGED, status().fault);
                TEST_ASSERT_EQUAL(DR_GUARD_LOCKED, status().state);
                if (state == AT_MOVING || state == AT_MOVING_U)
                    run_ms(400); /* its CR is the next event */
                else
                    host_line(15, at + 800, at, at);
                run_ms(20);
                TEST_ASSERT_EQUAL(0, motion_bytes_since(saved.wire_count));
                expect_fault(DR_FAULT_DAMAGED);
                expect_state(DR_GUARD_LOCKED);
                stop_input(true);
                stop_input(false);
                clear_fault();
                press(DR_INPUT_ARM);
                host_line(15, at + 800, at, at);
                run_ms(200);
                TEST_ASSERT_EQUAL(0, motion_bytes_since(saved.wire_count));
                found++;
            }
        }
    (void)printf("%u bits of memory flipped, all found\n", found);
}

/* What moves when the damage is found is stopped; half a frame is not made whole. */
static void row_72_damage_stops_what_moves_and_completes_nothing(void)
{
    for (int state = AT_PAUSE; state <= AT_MOVING; state++) {
        TEST_ASSERT_TRUE(bring_to(DR_MPC, (at_state)state));
        const uint32_t stops = wire_stops(), wire = rig.wire_count;
        rig.is_damaged = true;
        rig.guard.inputs ^= 1u << DR_INPUT_IN_TISSUE;
        host_code('C');
        run_ms(100);
        TEST_ASSERT_EQUAL(state == AT_MOVING ? 1 : 0, wire_stops() - stops);
        TEST_ASSERT_EQUAL(state == AT_PAUSE, status().confirm_wanted);
        host_code(3);
        run_ms(1000);
        TEST_ASSERT_EQUAL(state == AT_MOVING ? 2 : 0, wire_stops() - stops);
        TEST_ASSERT_NOT_EQUAL(DR_STATE_MOVING, rig.controller.state);
        TEST_ASSERT_EQUAL(0, motion_bytes_since(wire));
    }
}

/* Whoever forgets that a frame was torn would complete it. */
static void row_72_a_flipped_bit_does_not_forget_a_torn_frame(void)
{
    for (unsigned bit = 0; bit < 8; bit++) {
        TEST_ASSERT_TRUE(bring_to(DR_MPC, AT_PAUSE));
        const uint32_t wire = rig.wire_count;
        cables(true, false);
        cables(true, true);
        expect_fault(DR_FAULT_TORN);
        rig.is_damaged = true;
        rig.guard.torn ^= (uint8_t)(1u << bit);
        for (int i = 0; i < 20; i++)
            host_code(3);
        run_ms(1000);
        expect_fault(DR_FAULT_DAMAGED);
        TEST_ASSERT_TRUE(status().confirm_wanted);
        TEST_ASSERT_EQUAL(wire, rig.wire_count);
    }
}

/* A flip that the seal itself takes is as bad as any; one that breaks it open is none, until another bit flips. */
static void row_72_a_flipped_seal(void)
{
    for (size_t bit = 0; bit < sizeof rig.guard.seal * 8; bit++) {
        TEST_ASSERT_TRUE(bring_to(DR_TRIO, AT_IDLE));
        rig.is_damaged = true;
        rig.guard.seal ^= UINT32_C(1) << bit;
        host_line(15, 40800, 40000, 40000);
        run_ms(100);
        expect_fault(DR_FAULT_DAMAGED);
    }
    TEST_ASSERT_TRUE(bring_to(DR_TRIO, AT_IDLE));
    rig.guard.sealed ^= 1u;
    host_line(15, 40800, 40000, 40000);
    run_ms(200);
    expect_cr();
    expect_fault(DR_FAULT_NONE);
}

/* -- Row 21 ------------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint32_t flips, refused, no_frame, passed, same, near, far;
} residue;

#define SOUND_FRAMES 6u

/* A sound frame of this command, which passes where it is armed; another one for each `which`. */
static size_t sound_frame(int kind, const dr_command *command, unsigned which, uint8_t *frame)
{
    static const int32_t to_um[SOUND_FRAMES][DR_AXES] = {{50, 50, 50}, {100, 0, 0},      {-100, -20, 3},
                                                         {0, 0, 0},    {300, -300, 200}, {-60, 70, -50}};
    static const uint8_t levels[SOUND_FRAMES] = {15, 0, 3, 8, 13, 10}, values[SOUND_FRAMES] = {1, 2, 1, 2, 1, 2};
    const int32_t per_um = kind == DR_TRIO ? 8 : 16;
    uint32_t to[DR_AXES];
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        to[axis] = (uint32_t)((int32_t)home_of(kind) + to_um[which][axis] * per_um);
    switch (command->args) {
    case DR_ARGS_LINE:
        return put_line_frame(frame, levels[which], to[DR_X], to[DR_Y], to[DR_Z]);
    case DR_ARGS_POINT:
        return put_point_frame(frame, command->code, to[DR_X], to[DR_Y], to[DR_Z]);
    default:
        (void)put_point_frame(frame, command->code, to[which % DR_AXES], 0, 0);
        if (command->args == DR_ARGS_BYTE)
            frame[1] = command->op == DR_OP_TRIO_ANGLE ? (uint8_t)(10 + 10 * which) : values[which];
        return 1u + command->args;
    }
}

static uint32_t farthest_um(int kind, const uint32_t a[DR_AXES], const uint32_t b[DR_AXES])
{
    uint32_t farthest = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const uint32_t apart = (a[axis] < b[axis] ? b[axis] - a[axis] : a[axis] - b[axis]) / (kind == DR_TRIO ? 8 : 16);
        farthest = apart > farthest ? apart : farthest;
    }
    return farthest;
}

static void tip_at(uint8_t drive, uint32_t steps[DR_AXES])
{
    dr_controller_position(&rig.controller, drive, (dr_us)(rig.clock_at_start + rig.now), steps);
}

/* What became of it: sent whole, in one go, and waited for. */
static void count_what_became(residue *r, int kind, const uint32_t sound[DR_AXES])
{
    uint32_t is[DR_AXES];
    tip_at(0, is);
    r->flips++;
    if (rig.motions > 0)
        *(memcmp(is, sound, sizeof is) == 0 ? &r->same : farthest_um(kind, is, sound) <= 100 ? &r->near : &r->far) += 1;
    else if (status().forwarded > 0)
        r->passed++;
    else if (status().refused > 0)
        r->refused++;
    else
        r->no_frame++;
}

static void flip_in_frame(int kind, const dr_command *command, unsigned which, residue *r)
{
    uint8_t frame[DR_FRAME_MAX];
    uint32_t sound[DR_AXES], other[DR_AXES];
    const size_t length = sound_frame(kind, command, which, frame);
    rig = saved;
    host_bytes(frame, length);
    run_ms(2000);
    tip_at(0, sound);
    for (size_t bit = all ? 0 : (which * 5u + command->code) % 3u; bit < length * 8; bit += all ? 1 : 3) {
        rig = saved;
        (void)sound_frame(kind, command, which, frame);
        frame[bit / 8] = (uint8_t)(frame[bit / 8] ^ 1u << bit % 8);
        host_bytes(frame, length);
        run_ms(6000); /* the slowest allowed move lasts 5 mm / 81 um/s, but ^C and refusals need less */
        while (rig.state == DR_GUARD_MOVING_S || rig.state == DR_GUARD_MOVING_U)
            run_ms(1000);
        count_what_became(r, kind, sound);
        tip_at(1, other);
        if (kind == DR_MPC) /* one bit does not reach the other drive's tip */
            TEST_ASSERT_EQUAL(0, farthest_um(kind, other, (const uint32_t[]){80000, 80000, 80000}));
    }
}

/* The protocol has no check sum. What a flipped bit makes of a frame is refused, or is another frame that the policies allow:
 * M1 to M7 hold, and the target is within box and longest move. How many there are is printed, for docs/proofs.md. */
static void row_21_every_flipped_bit_of_a_corpus_where_it_is_armed(void)
{
    dr_command command;
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++) {
        residue sum = {0, 0, 0, 0, 0, 0, 0};
        TEST_ASSERT_TRUE(bring_to(kind, AT_IDLE));
        saved = rig;
        for (uint8_t row = 0; dr_command_row((dr_kind)kind, row, &command); row++)
            if (dr_command_find((dr_kind)kind, rig.limits.firmware, command.code, &command))
                for (unsigned which = 0; which < SOUND_FRAMES; which++)
                    flip_in_frame(kind, &command, which, &sum);
        (void)printf("%s, armed: %u flips: %u refused, %u no frame, %u query or setting, %u moved as meant, %u to "
                     "within 100 um, "
                     "%u farther\n",
                     kind == DR_TRIO ? "TRIO" : "MPC-200", sum.flips, sum.refused, sum.no_frame, sum.passed, sum.same,
                     sum.near, sum.far);
        TEST_ASSERT_TRUE(sum.refused > sum.flips / 3);
        TEST_ASSERT_TRUE(sum.near + sum.far < sum.flips / 3);
    }
}

/* Where it is not armed, or busy: nothing but queries, settings and ^C, whichever bit flips. */
static void row_21_every_flipped_bit_of_a_corpus_in_all_other_states(void)
{
    dr_command command;
    uint8_t frame[DR_FRAME_MAX];
    uint32_t flips = 0;
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++)
        for (int state = AT_LOCKED; state < STATES; state++) {
            if (state == AT_IDLE || !bring_to(kind, (at_state)state))
                continue;
            saved = rig;
            const uint32_t moves =
                rig.motions + (state == AT_CHECKING || state == AT_SENDING || state == AT_PAUSE ? 1 : 0);
            for (uint8_t row = 0; dr_command_row((dr_kind)kind, row, &command); row++)
                for (unsigned which = 0; which < (all ? SOUND_FRAMES : 1); which++) {
                    const size_t length = sound_frame(kind, &command, which, frame);
                    for (size_t bit = all ? 0 : (row + (unsigned)state) % 3u; bit < length * 8;
                         bit += all ? 1 : 3, flips++) {
                        rig = saved;
                        (void)sound_frame(kind, &command, which, frame);
                        frame[bit / 8] = (uint8_t)(frame[bit / 8] ^ 1u << bit % 8);
                        host_bytes(frame, length);
                        run_ms(70); /* whatever it is, it has left by now */
                        TEST_ASSERT_TRUE_MESSAGE(rig.motions <= moves, "a motion passed");
                    }
                }
        }
    (void)printf("not armed or busy: %u flips, no motion\n", flips);
}

int main(int argc, char **argv)
{
    all = argc > 1 && strcmp(argv[1], "all") == 0;
    UNITY_BEGIN();
    RUN_TEST(row_72_every_flipped_bit_of_the_guards_memory_is_found);
    RUN_TEST(row_72_damage_stops_what_moves_and_completes_nothing);
    RUN_TEST(row_72_a_flipped_bit_does_not_forget_a_torn_frame);
    RUN_TEST(row_72_a_flipped_seal);
    RUN_TEST(row_21_every_flipped_bit_of_a_corpus_where_it_is_armed);
    RUN_TEST(row_21_every_flipped_bit_of_a_corpus_in_all_other_states);
    return UNITY_END();
}
