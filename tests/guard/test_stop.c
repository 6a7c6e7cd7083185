/* A stop never moves (row 64): at every millisecond of every kind of move, at every byte of every frame on its way to the guard and
 * to the controller. The monitors of bench.h run under all of it. */
#include "bench.h"

#include <stdio.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static bench saved;
static unsigned stops;

typedef enum { BY_INPUT, BY_CTRL_C, BY_LOST_HOST, BY_KEY, WAYS } way_to_stop;

/* The kinds of moves: 300 um on each axis that they take, 40 to 600 ms. */
static const struct {
    uint8_t kind, code;
    uint16_t quirks;
} moves[] = {
    {DR_TRIO, 'S', 0},
    {DR_TRIO, 'H', 0},
    {DR_TRIO, 'W', 0},
    {DR_TRIO, 'x', 0},
    {DR_TRIO, 'y', 0},
    {DR_TRIO, 'z', 0},
    {DR_TRIO, 'h', 0},
    {DR_TRIO, 'w', 0},
    {DR_TRIO, 'R', 0},
    {DR_MPC, 'S', 0},
    {DR_MPC, 'M', 0},
    {DR_MPC, 'H', 0},
    {DR_MPC, 'Y', 0},
    {DR_MPC, 'N', 0},
    {DR_MPC, 'S', DR_QUIRK_PAUSE_ON_STOP},
    {DR_MPC, 'M', DR_QUIRK_PAUSE_ON_STOP},
    {DR_MPC, 'H', DR_QUIRK_PAUSE_ON_STOP},
    {DR_MPC, 'M', DR_QUIRK_MEASURED_SPEEDS},
};
#define MOVES (sizeof moves / sizeof *moves)

static uint32_t per_um(size_t m) { return moves[m].kind == DR_TRIO ? 8 : 16; }

static void send_move(size_t m)
{
    const uint32_t to = (uint32_t)(900 * per_um(m));
    switch (moves[m].code) {
    case 'S':
        host_line(12, to, to, to);
        break;
    case 'x':
    case 'y':
    case 'z':
        host_axis(moves[m].code, to);
        break;
    case 'M':
        host_point('M', to, to, to);
        break;
    case 'H':
    case 'W':
        if (moves[m].kind == DR_TRIO)
            host_point(moves[m].code, to, to, to);
        else
            host_code('H');
        break;
    default:
        host_code(moves[m].code);
        break;
    }
}

/* A rig where all of them are allowed, at 600 um, armed. */
static void ready_for(size_t m)
{
    const uint32_t at = 600 * per_um(m);
    if (moves[m].kind == DR_TRIO)
        bench_trio();
    else
        bench_mpc();
    rig.controller.quirks = moves[m].quirks;
    rig.limits.rig |= DR_RIG_MAY_CALIBRATE;
    rig.limits.unstoppable_ms = 60000;
    for (uint8_t drive = 0; drive < rig.controller.drive_count; drive++) {
        rig.limits.drives[drive].max_move_q = (uint32_t)DR_FAR_Q;
        rig.limits.drives[drive].box_q = (dr_box){{0, 0, 0}, {UM(25000), UM(25000), UM(25000)}};
        rig.drives[drive].work_is_set = true;
        for (uint8_t axis = 0; axis < DR_AXES; axis++) {
            rig.drives[drive].position_steps[axis] = at;
            rig.drives[drive].work_steps[axis] = at / 2;
        }
    }
    rig.watch_tip = false; /* a calibration goes beyond 0 */
    bench_start();
    bench_arm();
    input(DR_INPUT_MAY_CALIBRATE, true);
    if (moves[m].code == 'Y') {
        host_code('H');
        run_ms(3000);
        expect_cr();
        expect_state(DR_GUARD_IDLE);
    }
}

static void stop_it(way_to_stop way)
{
    switch (way) {
    case BY_INPUT:
        stop_input(true);
        break;
    case BY_CTRL_C:
        host_code(3);
        break;
    case BY_LOST_HOST:
        cables(false, true);
        break;
    default:
        input(DR_INPUT_KEY, false);
        break;
    }
}

static void tip_is(uint32_t steps[DR_AXES])
{
    dr_controller_position(&rig.controller, 0, (dr_us)(rig.clock_at_start + rig.now), steps);
}

static bool is_leaving(void) { return dr_guard_is_mid_frame(&rig.guard); }

/* After the stop nothing of a motion leaves but the rest of a frame that had been begun, and the tip stays where it is but for what
 * it travels while ^C is on the line: 3 bytes at 5 mm/s are 3 um. What ^C does not stop runs to its end and no farther. */
static void expect_that_a_stop_stops(size_t m, way_to_stop way)
{
    const bool leaving = is_leaving(), stoppable = moves[m].kind == DR_MPC || moves[m].code == 'S';
    const uint32_t motions = rig.motions, wire = rig.wire_count;
    const bool moves_on = !stoppable && status().state == DR_GUARD_MOVING_U;
    uint32_t at[DR_AXES], then[DR_AXES], later[DR_AXES];
    stops++;
    tip_is(at);
    stop_it(way);
    TEST_ASSERT_TRUE(!leaving || rig.motions == motions);
    run_ms(20 + (leaving ? 40 : 0));
    tip_is(then);
    const uint32_t near = 6 * per_um(m);
    for (uint8_t axis = 0; axis < DR_AXES && !moves_on; axis++)
        TEST_ASSERT_UINT32_WITHIN_MESSAGE(near, at[axis], then[axis], "a stop did not stop, or moved");
    run_ms(moves_on ? 8000 : 1500);
    tip_is(later);
    for (uint8_t axis = 0; axis < DR_AXES && !moves_on; axis++)
        TEST_ASSERT_EQUAL_MESSAGE(then[axis], later[axis], "something moved after a stop");
    TEST_ASSERT_EQUAL_MESSAGE(motions + (leaving ? 1 : 0), rig.motions, "a motion left after a stop");
    uint32_t other = 0;
    for (uint32_t i = wire; i < rig.wire_count; i++)
        other += rig.wire[i] != 'c' && rig.wire[i] != 'C' && rig.wire[i] != 3;
    TEST_ASSERT_TRUE_MESSAGE(leaving ? other <= 13 : other == 0, "something else was sent");
    TEST_ASSERT_NOT_EQUAL(DR_STATE_MOVING, rig.controller.state);
    TEST_ASSERT_FALSE(status().buzzer);
    if (way == BY_INPUT)
        TEST_ASSERT_TRUE(status().state == DR_GUARD_STOPPED || status().state == DR_GUARD_FAULT);
    else if (way != BY_CTRL_C)
        TEST_ASSERT_TRUE(status().state == DR_GUARD_DISARMED || status().state == DR_GUARD_FAULT);
    const uint32_t settled = rig.wire_count;
    stop_input(false);
    run_ms(1000);
    TEST_ASSERT_EQUAL_MESSAGE(settled, rig.wire_count, "something was sent after the stop's release");
}

/* From the frame's arrival until well after the end of the move. */
static void row_64_a_stop_at_every_millisecond_of_every_kind_of_move(void)
{
    for (size_t m = 0; m < MOVES; m++)
        for (int way = BY_INPUT; way < WAYS; way++) {
            unsigned after_the_end = 0, ms = 0;
            ready_for(m);
            send_move(m);
            for (; after_the_end < 20 && ms < 4000; ms++) {
                saved = rig;
                expect_that_a_stop_stops(m, (way_to_stop)way);
                rig = saved;
                run_ms(1);
                after_the_end += status().state == DR_GUARD_IDLE;
            }
            TEST_ASSERT_TRUE(ms > 60 && ms < 4000); /* it did move, and ended */
            TEST_ASSERT_EQUAL(moves[m].code == 'Y' ? 2 : 1, rig.motions);
        }
}

static void row_64_a_stop_at_every_byte_of_every_frame_to_the_controller(void)
{
    for (size_t m = 0; m < MOVES; m++)
        for (int way = BY_INPUT; way < WAYS; way++) {
            ready_for(m);
            send_move(m);
            for (uint32_t left = 0; status().state == DR_GUARD_CHECKING || is_leaving(); left++) {
                const uint32_t wire = rig.wire_count;
                saved = rig;
                expect_that_a_stop_stops(m, (way_to_stop)way);
                rig = saved;
                while (rig.wire_count == wire)
                    run_us(10);
            }
            saved = rig; /* behind its last byte */
            expect_that_a_stop_stops(m, (way_to_stop)way);
        }
}

/* The rest of the host's frame comes after the stop: no part of it is a motion, nor a setting. */
static void row_64_a_stop_at_every_byte_of_every_frame_of_the_host(void)
{
    dr_command command;
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++)
        for (uint8_t row = 0; dr_command_row((dr_kind)kind, row, &command); row++) {
            uint8_t frame[DR_FRAME_MAX] = {command.code, 12};
            const uint32_t near = kind == DR_TRIO ? 40400 : 80800;
            if (command.args == DR_ARGS_LINE)
                (void)put_line_frame(frame, 12, near, near, near);
            else if (command.args != DR_ARGS_BYTE)
                (void)put_point_frame(frame, command.code, near, near, near);
            for (size_t cut = 0; cut <= command.args; cut++)
                for (int way = BY_INPUT; way < WAYS;
                     way += way == BY_INPUT ? 2 : 1) { /* ^C would be data: rows 19, 28 */
                    if (kind == DR_TRIO)
                        bench_armed_trio();
                    else
                        bench_armed_mpc();
                    host_bytes(frame, cut);
                    stop_it((way_to_stop)way);
                    host_bytes(frame + cut, 1u + command.args - cut);
                    run_ms(600);
                    TEST_ASSERT_EQUAL(0, rig.motions);
                    expect_tip(0, near / 101 * 100, near / 101 * 100, near / 101 * 100);
                    if (way == BY_INPUT) {
                        expect_state(DR_GUARD_STOPPED);
                        if ((command.is & DR_IS_QUERY) == 0)
                            TEST_ASSERT_EQUAL(0, status().forwarded);
                    } else {
                        expect_state(DR_GUARD_DISARMED);
                    }
                }
        }
}

/* Stops upon stops, pressed and released while it is at rest, on a controller that takes the next motion for a resumption. */
static void row_64_many_stops_on_a_controller_that_only_pauses(void)
{
    for (uint64_t ms = 10; ms < 400; ms += 13) {
        uint32_t at[DR_AXES], later[DR_AXES];
        bench_mpc();
        rig.controller.quirks = DR_QUIRK_PAUSE_ON_STOP;
        bench_start();
        bench_arm();
        host_line(15, 88000, 80000, 80000);
        run_ms(ms);
        stop_input(true);
        run_ms(50);
        tip_is(at);
        for (int i = 0; i < 5; i++) {
            stop_input(false);
            run_ms(50);
            stop_input(true);
        }
        run_ms(1500);
        tip_is(later);
        TEST_ASSERT_EQUAL_UINT32_ARRAY(at, later, DR_AXES);
        expect_state(DR_GUARD_STOPPED);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(row_64_a_stop_at_every_millisecond_of_every_kind_of_move);
    RUN_TEST(row_64_a_stop_at_every_byte_of_every_frame_to_the_controller);
    RUN_TEST(row_64_a_stop_at_every_byte_of_every_frame_of_the_host);
    RUN_TEST(row_64_many_stops_on_a_controller_that_only_pauses);
    (void)printf("%u stops\n", stops);
    return UNITY_END();
}
