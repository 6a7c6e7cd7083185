/* Policies: rows 1 to 17 of the fault matrix, and 35 to 38, 60, 62, 87. TRIO with an MP-285: 8 steps/um, 8 quanta/step;
 * MPC-200 with an MP-225: 16 steps/um, 4 quanta/step. All positions in um where nothing else is said. */
#include "dr_judge.h"
#include "unity.h"

#include <string.h>

#define UM(um) ((int32_t)((um)*64))

static dr_limits limits;
static dr_scene scene;
static uint32_t per_um;

static void rig(dr_kind kind)
{
    dr_limits_init(&limits, kind);
    limits.rig = DR_RIG_KNOBS_LOCKED;
    limits.margin_q = 0;
    limits.unstoppable_ms = 60000;
    per_um = kind == DR_TRIO ? 8 : 16;
    for (uint8_t i = 0; i < (kind == DR_TRIO ? 1 : 2); i++) {
        TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, i, kind == DR_TRIO ? DR_STAGE_TRIO_MP285 : DR_STAGE_MPC_MP225));
        limits.drives[i].max_move_q = (uint32_t)DR_FAR_Q;
    }
    memset(&scene, 0, sizeof scene);
    scene.angle_deg = 30;
}

static void at(uint32_t x, uint32_t y, uint32_t z)
{
    scene.start_steps[DR_X] = x * per_um;
    scene.start_steps[DR_Y] = y * per_um;
    scene.start_steps[DR_Z] = z * per_um;
}

void setUp(void)
{
    rig(DR_TRIO);
    at(5000, 5000, 5000);
}

void tearDown(void) {}

static dr_verdict verdict_of(int code, uint8_t value, uint32_t x, uint32_t y, uint32_t z)
{
    dr_command command;
    dr_limits_problem problem;
    TEST_ASSERT_TRUE_MESSAGE(dr_limits_check(&limits, &problem), "limits");
    TEST_ASSERT_TRUE(dr_command_find((dr_kind)limits.kind, limits.firmware, (uint8_t)code, &command));
    const dr_request request = {command.op, value, {x, y, z}};
    const dr_verdict frame = dr_judge_frame(&limits, &command, &request);
    if (frame.reason != DR_REASON_NONE || (command.is & DR_IS_MOTION) == 0)
        return frame;
    return dr_judge_motion(&limits, &scene, &command, &request);
}

/* A motion to a place in um; one-axis commands fill their own axis only, as the wire does. */
static dr_reason judge(int code, uint32_t x, uint32_t y, uint32_t z)
{
    const bool one = code == 'x' || code == 'y' || code == 'z';
    return (dr_reason)verdict_of(code, 0, one && code != 'x' ? 0 : x * per_um, one && code != 'y' ? 0 : y * per_um,
                                 one && code != 'z' ? 0 : z * per_um)
        .reason;
}

static dr_reason judge_level(uint8_t level, uint32_t x, uint32_t y, uint32_t z)
{
    return (dr_reason)verdict_of('S', level, x * per_um, y * per_um, z * per_um).reason;
}

#define ALLOWED(verdict) TEST_ASSERT_EQUAL(DR_REASON_NONE, verdict)
#define REFUSED(expected, verdict) TEST_ASSERT_EQUAL(expected, verdict)

/* All that a verdict tells. */
static void tells(dr_reason reason, uint8_t axis, uint8_t item, int64_t measured, int64_t limit, dr_verdict verdict)
{
    TEST_ASSERT_EQUAL(reason, verdict.reason);
    TEST_ASSERT_EQUAL(axis, verdict.axis);
    TEST_ASSERT_EQUAL(item, verdict.item);
    TEST_ASSERT_EQUAL_INT64(measured, verdict.measured);
    TEST_ASSERT_EQUAL_INT64(limit, verdict.limit);
}

static dr_obstacle *keep_out(int32_t x0, int32_t x1, int32_t y0, int32_t y1, int32_t z0, int32_t z1)
{
    dr_obstacle *o = &limits.obstacles[limits.obstacle_count++];
    memset(o, 0, sizeof *o);
    o->shape = DR_SHAPE_BOX;
    o->box_q = (dr_box){{UM(x0), UM(y0), UM(z0)}, {UM(x1), UM(y1), UM(z1)}};
    return o;
}

static dr_obstacle *floor_below(int32_t z)
{
    dr_obstacle *o = &limits.obstacles[limits.obstacle_count++];
    memset(o, 0, sizeof *o);
    o->shape = DR_SHAPE_HALF;
    o->half_q = (dr_half){UM(z), {0, 0, 1}};
    return o;
}

/* -- Rows 1, 2 ---------------------------------------------------------------------------------------------------------- */

static void row_01_targets_on_the_limit_pass_and_a_step_beyond_do_not(void)
{
    static const char codes[] = {'S', 'H', 'W'};
    limits.drives[0].box_q = (dr_box){{UM(1000), UM(2000), UM(3000)}, {UM(11000), UM(12000), UM(13000)}};
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        for (uint8_t c = 0; c < sizeof codes; c++)
            for (uint8_t side = 0; side < 2; side++) {
                const uint32_t limit = (axis + 1u) * 8000u + side * 80000u;
                uint32_t to[DR_AXES] = {40000, 40000, 40000};
                to[axis] = limit;
                ALLOWED(verdict_of(codes[c], 0, to[0], to[1], to[2]).reason);
                to[axis] = side == 0 ? limit - 1 : limit + 1;
                const dr_verdict beyond = verdict_of(codes[c], 0, to[0], to[1], to[2]);
                REFUSED(DR_REASON_LIMIT, beyond.reason);
                TEST_ASSERT_EQUAL(axis, beyond.axis);
                TEST_ASSERT_EQUAL_INT64((int64_t)limit * 8, beyond.limit);
                TEST_ASSERT_EQUAL_INT64((int64_t)to[axis] * 8, beyond.measured);
            }
    ALLOWED(verdict_of('x', 0, 88000, 0, 0).reason);
    REFUSED(DR_REASON_LIMIT, verdict_of('x', 0, 88001, 0, 0).reason);
}

static void row_02_negative_targets_are_refused_in_every_mode(void)
{
    static const uint32_t negative[] = {0x80000000u, 0xFFFFFFFFu, 0xFFFFFFFEu, 200001u, 0x41000000u};
    limits.drives[0].box_q = (dr_box){{0, 0, 0}, {200000 * 8, 200000 * 8, 200000 * 8}};
    for (size_t i = 0; i < sizeof negative / sizeof *negative; i++) {
        REFUSED(DR_REASON_RANGE, verdict_of('S', 0, negative[i], 40000, 40000).reason);
        REFUSED(DR_REASON_RANGE, verdict_of('H', 0, 40000, negative[i], 40000).reason);
        REFUSED(DR_REASON_RANGE, verdict_of('z', 0, 0, 0, negative[i]).reason);
    }
    ALLOWED(verdict_of('S', 0, 200000, 40000, 40000).reason);
}

static void a_target_is_held_against_the_travel_of_the_drive_that_moves(void)
{
    rig(DR_MPC);
    limits.firmware = 0x0321;
    TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, 1, DR_STAGE_MPC_MP845)); /* longer travel, in steps */
    at(5000, 5000, 5000);
    REFUSED(DR_REASON_RANGE, verdict_of('M', 0, 400001, 80000, 80000).reason);
    scene.drive = scene.chosen = 1;
    REFUSED(DR_REASON_LIMIT, verdict_of('M', 0, 533333, 80000, 80000).reason);
}

/* -- Rows 3 to 6: keep-outs ------------------------------------------------------------------------------------------------- */

static void row_03_a_line_through_a_keep_out_is_refused_to_the_quantum(void)
{
    keep_out(6000, 7000, 4000, 6000, 6000, 7000);
    ALLOWED(judge('S', 8000, 5000, 5000)); /* passes below it */
    at(5000, 5000, 6500);
    REFUSED(DR_REASON_KEEP_OUT, judge('S', 8000, 5000, 6500)); /* end points safe, way not */
    at(5000, 5000, 5000);
    REFUSED(DR_REASON_KEEP_OUT, judge('S', 8000, 5000, 8000)); /* slanting */
    limits.margin_q = UM(50);
    at(5000, 5000, 0);
    scene.start_steps[DR_Z] = 5950 * 8; /* along the face, at the margin: touches */
    REFUSED(DR_REASON_KEEP_OUT, verdict_of('S', 0, 8000 * 8, 40000, 5950 * 8).reason);
    scene.start_steps[DR_Z] = 5950 * 8 - 1; /* one microstep lower (8 quanta) */
    ALLOWED(verdict_of('S', 0, 8000 * 8, 40000, 5950 * 8 - 1).reason);
    limits.margin_q = UM(50) + 7;
    ALLOWED(verdict_of('S', 0, 8000 * 8, 40000, 5950 * 8 - 1).reason);
    limits.margin_q = UM(50) + 8;
    REFUSED(DR_REASON_KEEP_OUT, verdict_of('S', 0, 8000 * 8, 40000, 5950 * 8 - 1).reason);
}

static void row_03_half_spaces_too(void)
{
    floor_below(3000);
    ALLOWED(verdict_of('S', 0, 40000, 40000, 24001).reason);
    const dr_verdict touch = verdict_of('S', 0, 40000, 40000, 24000);
    REFUSED(DR_REASON_KEEP_OUT, touch.reason);
    TEST_ASSERT_EQUAL(0, touch.item);
    limits.margin_q = UM(1);
    REFUSED(DR_REASON_KEEP_OUT, verdict_of('z', 0, 0, 0, 24008).reason);
    ALLOWED(verdict_of('z', 0, 0, 0, 24009).reason);
}

static void row_03_a_line_beside_a_slanting_half_space_passes_though_its_hull_does_not(void)
{
    dr_obstacle *o = floor_below(0);
    o->half_q = (dr_half){UM(10500), {1, 0, 1}}; /* x + z <= 10,500 um */
    at(5000, 5000, 6000);
    ALLOWED(judge('S', 6000, 5000, 5000)); /* x + z = 11,000 all the way */
    REFUSED(DR_REASON_KEEP_OUT, judge('H', 6000, 5000, 5000));
    REFUSED(DR_REASON_KEEP_OUT, judge('S', 5500, 5000, 5000));
}

static void row_04_home_order_and_work_order_sweep_different_boxes(void)
{
    /* Home order: X and Z at the old Y, then Y. An obstacle at the old Y blocks it, not work order. */
    keep_out(7000, 8000, 4500, 5500, 5500, 6500);
    REFUSED(DR_REASON_KEEP_OUT, judge('H', 9000, 9000, 9000));
    ALLOWED(judge('W', 9000, 9000, 9000));
    limits.obstacle_count = 0;
    keep_out(7000, 8000, 8500, 9500, 5500, 6500); /* at the new Y: the reverse */
    ALLOWED(judge('H', 9000, 9000, 9000));
    REFUSED(DR_REASON_KEEP_OUT, judge('W', 9000, 9000, 9000));
    limits.rig |= DR_RIG_PATHS_UNKNOWN;
    REFUSED(DR_REASON_KEEP_OUT, judge('H', 9000, 9000, 9000));
}

static void row_05_either_order_of_x_and_z_may_collide(void)
{
    keep_out(8500, 8900, 4500, 5500, 5500, 6000); /* in the way of X first, then Z */
    for (uint8_t angle = 44; angle <= 46; angle++) {
        scene.angle_deg = angle;
        REFUSED(DR_REASON_KEEP_OUT, judge('H', 9000, 5000, 9000));
    }
    limits.obstacle_count = 0;
    keep_out(5100, 5500, 4500, 5500, 8500, 8900); /* in the way of Z first, then X */
    for (uint8_t angle = 44; angle <= 46; angle++) {
        scene.angle_deg = angle;
        REFUSED(DR_REASON_KEEP_OUT, judge('H', 9000, 5000, 9000));
    }
    scene.angle_deg = 0;
    REFUSED(DR_REASON_ANGLE, judge('S', 5001, 5000, 5000));
    scene.angle_deg = 90;
    REFUSED(DR_REASON_ANGLE, judge('x', 5001, 0, 0));
    scene.angle_deg = 89;
    ALLOWED(judge('x', 5001, 0, 0));
}

static void row_06_m_may_go_anywhere_in_its_hull(void)
{
    rig(DR_MPC);
    at(5000, 5000, 5000);
    keep_out(8500, 8900, 8500, 8900, 5100, 5500); /* far off the diagonal */
    REFUSED(DR_REASON_KEEP_OUT, judge('M', 9000, 9000, 9000));
    ALLOWED(judge('S', 9000, 9000, 9000));
    limits.rig |= DR_RIG_PATHS_UNKNOWN;
    REFUSED(DR_REASON_KEEP_OUT, judge('S', 9000, 9000, 9000));
}

static void obstacles_of_another_drive_do_not_count(void)
{
    rig(DR_MPC);
    at(5000, 5000, 5000);
    keep_out(5500, 6000, 4000, 6000, 4000, 6000)->drive = 1;
    ALLOWED(judge('M', 7000, 5000, 5000));
    scene.drive = scene.chosen = 1;
    REFUSED(DR_REASON_KEEP_OUT, judge('M', 7000, 5000, 5000));
}

static void knobs_that_are_not_locked_widen_the_margin(void)
{
    dr_command line, move;
    rig(DR_MPC);
    limits.rig = 0;
    limits.margin_q = UM(50);
    TEST_ASSERT_TRUE(dr_command_find(DR_MPC, 0x0321, 'S', &line));
    TEST_ASSERT_TRUE(dr_command_find(DR_MPC, 0x0321, 'M', &move));
    TEST_ASSERT_EQUAL(UM(300), dr_judge_margin_q(&limits, &scene, &line)); /* 5 mm/s for 50 ms */
    TEST_ASSERT_EQUAL(UM(100), dr_judge_margin_q(&limits, &scene, &move)); /* for 10 ms */
    scene.waited_us = DR_WAITED_MAX_US;                                    /* 100 ms longer */
    TEST_ASSERT_EQUAL(UM(800), dr_judge_margin_q(&limits, &scene, &line));
    TEST_ASSERT_EQUAL(UM(600), dr_judge_margin_q(&limits, &scene, &move));
    limits.rig = DR_RIG_KNOBS_LOCKED;
    TEST_ASSERT_EQUAL(UM(50), dr_judge_margin_q(&limits, &scene, &line));
}

/* -- Rows 7, 8, 9, 14 ------------------------------------------------------------------------------------------------------------ */

static void row_07_displacement_per_axis_and_euclidean(void)
{
    limits.drives[0].max_move_q = (uint32_t)UM(1000);
    ALLOWED(verdict_of('S', 0, 48000, 40000, 40000).reason);
    const dr_verdict far = verdict_of('S', 0, 48001, 40000, 40000);
    REFUSED(DR_REASON_STEP, far.reason);
    TEST_ASSERT_EQUAL(DR_X, far.axis);
    TEST_ASSERT_EQUAL_INT64(UM(1000) + 8, far.measured);
    ALLOWED(verdict_of('S', 0, 40000 + 4800, 40000, 40000 - 6400).reason); /* 600, 0, -800 um: 1,000 */
    const dr_verdict slant = verdict_of('S', 0, 40000 + 4801, 40000, 40000 - 6400);
    REFUSED(DR_REASON_STEP, slant.reason);
    TEST_ASSERT_EQUAL(DR_AXES, slant.axis);
    TEST_ASSERT_EQUAL_INT64(64005, slant.measured); /* sqrt(38408^2 + 51200^2), rounded up */
    TEST_ASSERT_EQUAL_INT64(64000, slant.limit);
}

static void row_08_speed_levels_above_the_cap_or_15_are_refused(void)
{
    limits.drives[0].fast_level = 9;
    limits.drives[0].slow_level = 3;
    for (unsigned level = 0; level < 256; level++) {
        const dr_reason reason = judge_level((uint8_t)level, 5001, 5000, 5000);
        REFUSED(level > 15 ? DR_REASON_LEVEL : level > 9 ? DR_REASON_SPEED : DR_REASON_NONE, reason);
    }
    REFUSED(DR_REASON_SPEED, judge('x', 5001, 0, 0)); /* 5 mm/s is more than level 9 */
    limits.drives[0].fast_level = 15;                 /* is 5 mm/s too on a TRIO */
    ALLOWED(judge('x', 5001, 0, 0));
    rig(DR_MPC);
    at(5000, 5000, 5000);
    limits.drives[0].fast_level = 15;
    limits.drives[0].slow_level = 15;
    REFUSED(DR_REASON_SPEED, judge('M', 5001, 5000, 5000)); /* 3 to 4.65 mm/s against 1.3 to 2.767 */
    ALLOWED(judge_level(15, 5001, 5000, 5000));
}

static void speeds_are_the_faster_of_documented_and_measured(void)
{
    rig(DR_MPC);
    TEST_ASSERT_EQUAL(2767 * 64, dr_judge_speed(&limits, 0, 15, true));
    TEST_ASSERT_EQUAL(1300 * 64, dr_judge_speed(&limits, 0, 15, false));
    TEST_ASSERT_EQUAL(4650 * 64, dr_judge_speed(&limits, 0, DR_SPEED_FULL, true));
    TEST_ASSERT_EQUAL(3000 * 64, dr_judge_speed(&limits, 0, DR_SPEED_FULL, false));
    TEST_ASSERT_EQUAL(81.25 * 64, dr_judge_speed(&limits, 0, 0, false));
    TEST_ASSERT_EQUAL(338 * 64, dr_judge_speed(&limits, 0, 0, true));
    rig(DR_TRIO);
    TEST_ASSERT_EQUAL(5000 * 64, dr_judge_speed(&limits, 0, 15, true));
}

static void surface(int32_t z_um)
{
    dr_drive_limits *d = &limits.drives[0];
    d->retract = DR_TO_MORE_Z;
    d->surface_q = UM(z_um);
    d->clearance_q = (uint32_t)UM(500);
    d->approach[DR_Z] = 1;
    d->slow_level = 3;
}

static void row_09_fixed_speed_commands_are_refused_below_the_surface(void)
{
    surface(4000);
    ALLOWED(judge('z', 0, 0, 4001));
    REFUSED(DR_REASON_SPEED, judge('z', 0, 0, 4000));
    REFUSED(DR_REASON_SPEED, judge('H', 5000, 5000, 3000));
    ALLOWED(judge_level(3, 5000, 5000, 3000));
    REFUSED(DR_REASON_SPEED, judge_level(4, 5000, 5000, 3000));
    ALLOWED(judge_level(15, 5000, 5000, 4001));
    limits.margin_q = UM(50); /* belongs to every way */
    REFUSED(DR_REASON_SPEED, judge('z', 0, 0, 4050));
    ALLOWED(judge('z', 0, 0, 4051));
}

static void a_surface_may_be_on_the_other_side(void)
{
    surface(6000);
    limits.drives[0].retract = DR_TO_LESS_Z;
    ALLOWED(judge('z', 0, 0, 5999));
    REFUSED(DR_REASON_SPEED, judge('z', 0, 0, 6000));
}

static void row_10_sideways_only_above_surface_and_clearance(void)
{
    surface(4000);
    at(5000, 5000, 3000);
    REFUSED(DR_REASON_LATERAL, judge_level(3, 5003, 5000, 3000));
    ALLOWED(judge_level(3, 5002, 5000, 3000));
    ALLOWED(judge_level(3, 5000, 5000, 9000)); /* straight up */
    ALLOWED(judge_level(3, 5000, 5000, 2000));
    REFUSED(DR_REASON_LATERAL, judge_level(3, 5100, 5000, 9000));
    at(5000, 5000, 4500);
    const dr_verdict low = verdict_of('S', 0, 41000, 40000, 4500 * 8);
    REFUSED(DR_REASON_LATERAL, low.reason);
    TEST_ASSERT_EQUAL_INT64(UM(500), low.measured);
    at(5000, 5000, 4501);
    ALLOWED(judge_level(3, 5100, 5000, 4501));
    ALLOWED(judge('H', 6000, 6000, 6000));
    REFUSED(DR_REASON_LATERAL, judge('H', 6000, 6000, 4400));
}

static void row_11_every_microstep_of_the_approach_line_passes(void)
{
    surface(8000);
    limits.drives[0].approach[DR_X] = 866;
    limits.drives[0].approach[DR_Z] = -500; /* 30 degrees */
    scene.in_tissue = true;
    for (uint32_t along = 0; along <= 40000; along += 7) { /* 5 mm in microsteps, and back */
        const uint32_t x = 40000 + (uint32_t)((uint64_t)along * 866 / 1000), z = 60000 - along / 2;
        scene.start_steps[DR_X] = x;
        scene.start_steps[DR_Z] = z;
        ALLOWED(verdict_of('S', 0, 40000, 40000, 60000).reason);
    }
    REFUSED(DR_REASON_APPROACH, verdict_of('S', 0, 40000, 40000 + 32, 60000).reason);
}

static void in_tissue_nothing_leaves_the_line_wherever_the_surface_is_said_to_be(void)
{
    surface(1000);
    scene.in_tissue = true;
    REFUSED(DR_REASON_APPROACH, judge_level(3, 5100, 5000, 5000));
    ALLOWED(judge_level(3, 5000, 5000, 5100));
    ALLOWED(judge('z', 0, 0, 5100));
    REFUSED(DR_REASON_APPROACH, judge('x', 5100, 0, 0));
    limits.drives[0].approach[DR_X] = 1; /* a slanting line: H would leave it on its way */
    ALLOWED(judge_level(3, 5100, 5000, 5100));
    REFUSED(DR_REASON_APPROACH, judge('H', 5100, 5000, 5100));
    limits.drives[0].retract = DR_TO_NONE;
    limits.drives[0].approach[DR_X] = limits.drives[0].approach[DR_Z] = 0;
    REFUSED(DR_REASON_APPROACH, judge_level(3, 5000, 5000, 5100));
}

/* -- Rows 12, 13: escape ------------------------------------------------------------------------------------------------------------ */

static void row_12_from_outside_the_box_only_shrinking_lines_pass(void)
{
    limits.drives[0].box_q = (dr_box){{UM(1000), UM(1000), UM(1000)}, {UM(9000), UM(9000), UM(9000)}};
    at(500, 5000, 5000);
    ALLOWED(judge('S', 600, 5000, 5000));
    ALLOWED(judge('S', 1500, 5000, 5000)); /* exactly 1 mm */
    REFUSED(DR_REASON_ESCAPE, judge('S', 1501, 5000, 5000));
    REFUSED(DR_REASON_ESCAPE, judge('S', 500, 5000, 5000)); /* shrinks nothing */
    REFUSED(DR_REASON_ESCAPE, judge('S', 400, 5000, 5000));
    REFUSED(DR_REASON_ESCAPE, judge('H', 600, 5000, 5000)); /* S only */
    REFUSED(DR_REASON_ESCAPE, judge('x', 600, 0, 0));
    at(500, 9500, 5000); /* two axes: both must shrink */
    ALLOWED(judge('S', 600, 9400, 5000));
    REFUSED(DR_REASON_ESCAPE, judge('S', 600, 9500, 5000));
    REFUSED(DR_REASON_ESCAPE, judge('S', 600, 9600, 5000));
    at(500, 9500, 500);
    ALLOWED(judge('S', 600, 9400, 600));
    REFUSED(DR_REASON_ESCAPE, judge('S', 600, 9400, 400));
    at(500, 8900, 5000);
    REFUSED(DR_REASON_ESCAPE, judge('S', 600, 9001, 5000)); /* a new violation */
    limits.drives[0].box_q.max_q[DR_X] = UM(1200);          /* in at one side, out at the other */
    at(900, 5000, 5000);
    ALLOWED(judge('S', 1200, 5000, 5000));
    REFUSED(DR_REASON_ESCAPE, judge('S', 1250, 5000, 5000));
    at(1300, 5000, 5000);
    REFUSED(DR_REASON_ESCAPE, judge('S', 950, 5000, 5000));
    REFUSED(DR_REASON_LIMIT, dr_judge_place(&limits, 0, scene.start_steps).reason);
}

static void row_13_out_of_an_obstacle_only_by_its_exit(void)
{
    dr_obstacle *o = keep_out(4000, 6000, 4000, 6000, 4800, 6000);
    REFUSED(DR_REASON_KEEP_OUT, dr_judge_place(&limits, 0, scene.start_steps).reason);
    REFUSED(DR_REASON_ESCAPE, judge('S', 5000, 5000, 4700)); /* no exit: by hand */
    REFUSED(DR_REASON_ESCAPE, judge('S', 5000, 5000, 4999));
    o->exit = DR_TO_LESS_Z;
    ALLOWED(judge('S', 5000, 5000, 4700));
    ALLOWED(judge('S', 5002, 4998, 4900)); /* rounding */
    REFUSED(DR_REASON_ESCAPE, judge('S', 5003, 5000, 4700));
    REFUSED(DR_REASON_ESCAPE, judge('S', 4997, 5000, 4700));
    REFUSED(DR_REASON_ESCAPE, judge('S', 5000, 5000, 5100));
    REFUSED(DR_REASON_ESCAPE, judge('S', 5000, 5000, 5000));
    o->exit = DR_TO_MORE_Z;
    ALLOWED(judge('S', 5000, 5000, 5900));
    o->exit = DR_TO_LESS_Z;
    keep_out(4000, 6000, 4000, 6000, 4000, 4300); /* another one on the way out */
    ALLOWED(judge('S', 5000, 5000, 4301));
    REFUSED(DR_REASON_ESCAPE, judge('S', 5000, 5000, 4300));
    limits.obstacle_count = 0;
    floor_below(5500);
    ALLOWED(judge('S', 5100, 5000, 5001)); /* any way that gains height */
    REFUSED(DR_REASON_ESCAPE, judge('S', 5100, 5000, 5000));
    rig(DR_MPC);
    at(5000, 5000, 5000);
    keep_out(4000, 6000, 4000, 6000, 4800, 6000)->drive = 1; /* another drive's */
    limits.drives[0].box_q.min_q[DR_X] = UM(5100);
    ALLOWED(judge('S', 5050, 5000, 5000));
}

static void row_14_a_motion_that_cannot_be_stopped_is_short(void)
{
    limits.unstoppable_ms = 200;
    ALLOWED(judge('x', 6000, 0, 0));
    const dr_verdict far = verdict_of('x', 0, 48001, 0, 0);
    REFUSED(DR_REASON_UNSTOPPABLE, far.reason);
    TEST_ASSERT_EQUAL_INT64(201, far.measured);
    ALLOWED(judge('y', 0, 4000, 0));
    REFUSED(DR_REASON_UNSTOPPABLE, judge('z', 0, 0, 3999));
    ALLOWED(judge('H', 5333, 5333, 5333));                        /* 999 um in all */
    REFUSED(DR_REASON_UNSTOPPABLE, judge('H', 5333, 5333, 5335)); /* 1,001 */
    REFUSED(DR_REASON_UNSTOPPABLE, judge('W', 4665, 4667, 5334));
    ALLOWED(judge('S', 9000, 9000, 9000)); /* can be stopped */
}

/* -- Rows 16, 17, 87 ---------------------------------------------------------------------------------------------------------------- */

static void all_travel(uint8_t drive, int32_t travel_q)
{
    limits.drives[drive].box_q = (dr_box){{0, 0, 0}, {travel_q, travel_q, travel_q}};
}

static void row_16_hidden_targets_pass_only_when_all_travel_is_clear(void)
{
    REFUSED(DR_REASON_HIDDEN, judge('h', 0, 0, 0));
    REFUSED(DR_REASON_HIDDEN, judge('w', 0, 0, 0));
    all_travel(0, 200000 * 8);
    ALLOWED(judge('h', 0, 0, 0));
    ALLOWED(judge('w', 0, 0, 0));
    limits.unstoppable_ms = 200;
    REFUSED(DR_REASON_UNSTOPPABLE, judge('h', 0, 0, 0));
    limits.unstoppable_ms = 60000;
    limits.drives[0].max_move_q = (uint32_t)UM(5000);
    REFUSED(DR_REASON_STEP, judge('h', 0, 0, 0));
    limits.drives[0].max_move_q = (uint32_t)DR_FAR_Q;
    keep_out(20000, 20001, 20000, 20001, 20000, 20001);
    REFUSED(DR_REASON_HIDDEN, judge('h', 0, 0, 0));
    limits.obstacle_count = 0;
    surface(1000);
    REFUSED(DR_REASON_SPEED, judge('h', 0, 0, 0));
    limits.drives[0].slow_level = DR_SPEED_FULL;
    REFUSED(DR_REASON_LATERAL, judge('h', 0, 0, 0));

    rig(DR_MPC);
    at(5000, 5000, 5000);
    REFUSED(DR_REASON_HIDDEN, judge('H', 0, 0, 0));
    REFUSED(DR_REASON_HIDDEN, judge('Y', 0, 0, 0));
    all_travel(0, 400000 * 4);
    ALLOWED(judge('H', 0, 0, 0));
    ALLOWED(judge('Y', 0, 0, 0));
}

static void an_mpc_that_homes_to_0_sweeps_no_more_than_the_way_there(void)
{
    rig(DR_MPC);
    at(5000, 5000, 5000);
    all_travel(0, 400000 * 4);
    keep_out(6000, 7000, 0, 7000, 0, 7000);
    REFUSED(DR_REASON_HIDDEN, judge('H', 0, 0, 0));
    limits.rig |= DR_RIG_HOME_IS_ZERO;
    ALLOWED(judge('H', 0, 0, 0));
    REFUSED(DR_REASON_HIDDEN, judge('Y', 0, 0, 0));
    keep_out(1000, 1001, 4000, 4001, 2000, 2001);
    REFUSED(DR_REASON_HIDDEN, judge('H', 0, 0, 0));
    limits.obstacle_count = 0;
    limits.drives[0].max_move_q = (uint32_t)UM(8660);
    REFUSED(DR_REASON_STEP, judge('H', 0, 0, 0)); /* 5,000 * sqrt(3) = 8,660.3 */
    limits.drives[0].max_move_q = (uint32_t)UM(8661);
    ALLOWED(judge('H', 0, 0, 0));
}

static void row_17_calibration_needs_leave_and_room(void)
{
    REFUSED(DR_REASON_CALIBRATE, judge('R', 0, 0, 0));
    scene.may_calibrate = true;
    REFUSED(DR_REASON_CALIBRATE, judge('R', 0, 0, 0));
    limits.rig |= DR_RIG_MAY_CALIBRATE;
    ALLOWED(judge('R', 0, 0, 0));
    scene.frame_lost = true;
    ALLOWED(judge('R', 0, 0, 0));
    REFUSED(DR_REASON_FRAME_LOST, judge('S', 5000, 5000, 5001));
    keep_out(2000, 2100, 2000, 2100, 2000, 2100);
    REFUSED(DR_REASON_KEEP_OUT, judge('R', 0, 0, 0));
    limits.obstacle_count = 0;
    at(500, 500, 500);
    keep_out(900, 950, 900, 950, 900, 950); /* beyond the start, within the 1,000 um where it ends */
    REFUSED(DR_REASON_KEEP_OUT, judge('R', 0, 0, 0));
    scene.may_calibrate = false;
    REFUSED(DR_REASON_CALIBRATE, judge('R', 0, 0, 0));
    rig(DR_MPC);
    at(500, 500, 500);
    limits.rig |= DR_RIG_MAY_CALIBRATE;
    scene.may_calibrate = true;
    ALLOWED(judge('N', 0, 0, 0));
    keep_out(12000, 12400, 12000, 12400, 12000, 12400); /* N may be centre on old firmware: the union is swept */
    REFUSED(DR_REASON_KEEP_OUT, judge('N', 0, 0, 0));
}

static void row_87_calibration_goes_below_0(void)
{
    limits.rig |= DR_RIG_MAY_CALIBRATE;
    limits.beyond_zero_q = UM(300);
    scene.may_calibrate = true;
    keep_out(-400, -301, 0, 9000, 0, 9000);
    ALLOWED(judge('R', 0, 0, 0));
    limits.obstacle_count = 0;
    keep_out(-400, -300, 0, 9000, 0, 9000);
    REFUSED(DR_REASON_KEEP_OUT, judge('R', 0, 0, 0));
}

/* -- Rows 35 to 38, 60, 62, and what ^C broke off --------------------------------------------------------------------------------------- */

static void row_35_upper_case_axes_are_ambiguous(void)
{
    REFUSED(DR_REASON_AMBIGUOUS, verdict_of('X', 0, 40001, 0, 0).reason);
    REFUSED(DR_REASON_AMBIGUOUS, verdict_of('Y', 0, 0, 40001, 0).reason);
    REFUSED(DR_REASON_AMBIGUOUS, verdict_of('Z', 0, 0, 0, 40001).reason);
    dr_command command;
    TEST_ASSERT_FALSE(dr_command_find(DR_TRIO, limits.firmware, 0x5B, &command));
    TEST_ASSERT_FALSE(dr_command_find(DR_TRIO, limits.firmware, 0x5C, &command));
}

static void row_36_angles_at_which_an_axis_fails_are_refused(void)
{
    for (unsigned angle = 0; angle < 256; angle++)
        REFUSED(angle < 10 || angle > 80 ? DR_REASON_ANGLE_VALUE : DR_REASON_NONE,
                verdict_of('A', (uint8_t)angle, 0, 0, 0).reason);
    limits.angle_min_deg = 1;
    limits.angle_max_deg = 89;
    ALLOWED(verdict_of('A', 89, 0, 0, 0).reason);
    REFUSED(DR_REASON_ANGLE_VALUE, verdict_of('A', 0, 0, 0, 0).reason);
    REFUSED(DR_REASON_ANGLE_VALUE, verdict_of('A', 90, 0, 0, 0).reason);
}

static void row_37_38_62_settings_of_an_mpc(void)
{
    rig(DR_MPC);
    REFUSED(DR_REASON_STREAM, verdict_of('O', 0, 0, 0, 0).reason);
    ALLOWED(verdict_of('F', 0, 0, 0, 0).reason);
    limits.rig |= DR_RIG_MAY_STREAM;
    ALLOWED(verdict_of('O', 0, 0, 0, 0).reason);
    for (unsigned drive = 0; drive < 256; drive++)
        REFUSED(drive == 1 || drive == 2 ? DR_REASON_NONE : DR_REASON_DRIVE_VALUE,
                verdict_of('I', (uint8_t)drive, 0, 0, 0).reason);
    limits.mode_min = 3;
    for (unsigned mode = 0; mode < 256; mode++)
        REFUSED(mode < 3 || mode > 9 ? DR_REASON_MODE_VALUE : DR_REASON_NONE,
                verdict_of('L', (uint8_t)mode, 0, 0, 0).reason);
    ALLOWED(verdict_of('C', 0, 0, 0, 0).reason);
    ALLOWED(verdict_of('K', 0, 0, 0, 0).reason);
}

static void row_60_another_drive_than_the_hosts_does_not_move(void)
{
    rig(DR_MPC);
    at(5000, 5000, 5000);
    scene.drive = 1;
    const dr_verdict verdict = verdict_of('M', 0, 81000, 80000, 80000);
    REFUSED(DR_REASON_DRIVE, verdict.reason);
    TEST_ASSERT_EQUAL_INT64(2, verdict.measured);
    TEST_ASSERT_EQUAL_INT64(1, verdict.limit);
    scene.drive = scene.chosen = 3; /* not one that may be moved */
    REFUSED(DR_REASON_DRIVE, verdict_of('M', 0, 81000, 80000, 80000).reason);
}

static void row_49_what_stop_broke_off_must_be_clear_too(void)
{
    rig(DR_MPC);
    at(5000, 5000, 5000);
    keep_out(7000, 7500, 7000, 7500, 7000, 7500);
    scene.old[0] = (dr_old_move){true, {0, 0, 0}, {{UM(9000), UM(9000), UM(6000)}, {UM(9000), UM(9000), UM(6000)}}};
    ALLOWED(judge('M', 5100, 5000, 5000));
    at(5000, 5000, 8000); /* from here the old target's hull holds the obstacle */
    const dr_verdict verdict = verdict_of('M', 0, 5100 * 16, 80000, 8000 * 16);
    REFUSED(DR_REASON_OLD_TARGET, verdict.reason);
    TEST_ASSERT_EQUAL(0, verdict.item);
    scene.drive = scene.chosen = 1; /* the other drive's next motion may resume it as well, from where it rests */
    ALLOWED(judge('M', 5100, 5000, 8000));
    scene.old[0].at_steps[DR_Z] = 9000 * 16;
    REFUSED(DR_REASON_OLD_TARGET, judge('M', 5100, 5000, 8000));
    scene.old[0].is_open = false;
    ALLOWED(judge('M', 5100, 5000, 8000));
    scene.drive = scene.chosen = 0; /* and the reverse, with an obstacle of drive 1 */
    limits.obstacles[0].drive = 1;
    scene.old[1] = (dr_old_move){
        true, {5000 * 16, 5000 * 16, 9000 * 16}, {{UM(9000), UM(9000), UM(6000)}, {UM(9000), UM(9000), UM(6000)}}};
    REFUSED(DR_REASON_OLD_TARGET, judge('M', 5100, 5000, 8000));
}

/* -- What verdicts tell, and where exactly they turn ------------------------------------------------------------------------------------ */

static void verdicts_tell_axis_item_and_numbers(void)
{
    const uint8_t none = DR_AXES;
    tells(DR_REASON_NONE, none, DR_NO_ITEM, 0, 0, verdict_of('x', 0, 40001, 0, 0));
    tells(DR_REASON_AMBIGUOUS, DR_X, DR_NO_ITEM, 0, 0, verdict_of('X', 0, 40001, 0, 0));
    tells(DR_REASON_AMBIGUOUS, DR_Z, DR_NO_ITEM, 0, 0, verdict_of('Z', 0, 0, 0, 40001));
    tells(DR_REASON_LEVEL, none, DR_NO_ITEM, 16, 15, verdict_of('S', 16, 40000, 40000, 40000));
    tells(DR_REASON_ANGLE_VALUE, none, DR_NO_ITEM, 9, 10, verdict_of('A', 9, 0, 0, 0));
    tells(DR_REASON_ANGLE_VALUE, none, DR_NO_ITEM, 81, 80, verdict_of('A', 81, 0, 0, 0));
    tells(DR_REASON_CALIBRATE, none, DR_NO_ITEM, 0, 0, verdict_of('R', 0, 0, 0, 0));
    scene.angle_deg = 90;
    tells(DR_REASON_ANGLE, none, DR_NO_ITEM, 90, 0, verdict_of('x', 0, 40001, 0, 0));
    scene.angle_deg = 30;
    scene.frame_lost = true;
    tells(DR_REASON_FRAME_LOST, none, DR_NO_ITEM, 0, 0, verdict_of('x', 0, 40001, 0, 0));
    scene.frame_lost = false;
    keep_out(1000, 2000, 1000, 2000, 1000, 2000);
    floor_below(3000);
    tells(DR_REASON_KEEP_OUT, none, 1, 0, 0, verdict_of('z', 0, 0, 0, 20000));
    tells(DR_REASON_ESCAPE, none, 1, 0, 0, (at(5000, 5000, 2500), verdict_of('S', 0, 40000, 40000, 19999)));
    tells(DR_REASON_ESCAPE, none, DR_NO_ITEM, 0, 0, verdict_of('H', 0, 40000, 40000, 20001));
    tells(DR_REASON_KEEP_OUT, none, 1, 0, 0, dr_judge_place(&limits, 0, scene.start_steps));
    tells(DR_REASON_DRIVE, none, DR_NO_ITEM, 3, 0, dr_judge_place(&limits, 2, scene.start_steps));
    rig(DR_MPC);
    tells(DR_REASON_STREAM, none, DR_NO_ITEM, 0, 0, verdict_of('O', 0, 0, 0, 0));
    tells(DR_REASON_DRIVE_VALUE, none, DR_NO_ITEM, 3, 0, verdict_of('I', 3, 0, 0, 0));
    tells(DR_REASON_MODE_VALUE, none, DR_NO_ITEM, 10, 9, verdict_of('L', 10, 0, 0, 0));
}

static void the_frame_alone_is_held_against_the_longest_travel(void)
{
    static const uint32_t travel[DR_AXES] = {533333, 133333, 266667}; /* an MP-865 [T] */
    dr_command command;
    TEST_ASSERT_TRUE(dr_command_find(DR_TRIO, limits.firmware, 'S', &command));
    TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, 0, DR_STAGE_TRIO_MP865));
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        dr_request request = {command.op, 0, {0, 0, 0}};
        request.steps[axis] = travel[axis];
        tells(DR_REASON_NONE, DR_AXES, DR_NO_ITEM, 0, 0, dr_judge_frame(&limits, &command, &request));
        request.steps[axis]++;
        tells(DR_REASON_RANGE, axis, DR_NO_ITEM, travel[axis] + 1, travel[axis],
              dr_judge_frame(&limits, &command, &request));
        limits.drives[0].stage = DR_STAGE_NONE; /* nothing is connected: no travel at all */
        request.steps[axis] = 1;
        tells(DR_REASON_RANGE, axis, DR_NO_ITEM, 1, 0, dr_judge_frame(&limits, &command, &request));
        limits.drives[0].stage = DR_STAGE_TRIO_MP865;
    }
    rig(DR_MPC);
    at(5000, 5000, 5000);
    TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, 1, DR_STAGE_MPC_MP845)); /* 533,333 steps: more than drive 0 */
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        uint32_t to[DR_AXES] = {80000, 80000, 80000};
        to[axis] = 400001;
        tells(DR_REASON_RANGE, axis, DR_NO_ITEM, 400001, 400000, verdict_of('M', 0, to[0], to[1], to[2]));
    }
}

static void what_a_frame_does_not_carry_does_not_count(void)
{
    ALLOWED(verdict_of('x', 255, 40001, 0, 0).reason);
    ALLOWED(verdict_of('H', 16, 40001, 40000, 40000).reason);
    all_travel(0, 200000 * 8);
    ALLOWED(verdict_of('h', 255, UINT32_MAX, UINT32_MAX, 200001).reason);
    limits.drives[0].fast_level = 15; /* an empty frame is no 'S' of level 0 either */
    limits.drives[0].slow_level = 0;
    ALLOWED(verdict_of('x', 0, 40001, 0, 0).reason);
}

static void all_four_drives_can_be_chosen(void)
{
    rig(DR_MPC);
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, drive, DR_STAGE_MPC_MP225));
    for (uint8_t drive = 0; drive <= DR_PORTS + 1u; drive++)
        REFUSED(drive >= 1 && drive <= DR_PORTS ? DR_REASON_NONE : DR_REASON_DRIVE_VALUE,
                verdict_of('I', drive, 0, 0, 0).reason);
}

static void a_hidden_target_needs_every_face_of_the_travel(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        all_travel(0, 200000 * 8);
        limits.drives[0].box_q.min_q[axis] = 1;
        tells(DR_REASON_HIDDEN, axis, DR_NO_ITEM, 0, 1, verdict_of('h', 0, 0, 0, 0));
        all_travel(0, 200000 * 8);
        limits.drives[0].box_q.max_q[axis]--;
        tells(DR_REASON_HIDDEN, axis, DR_NO_ITEM, 200000 * 8, 200000 * 8 - 1, verdict_of('h', 0, 0, 0, 0));
    }
}

static void a_calibration_goes_no_farther_than_it_ends(void)
{
    limits.rig |= DR_RIG_MAY_CALIBRATE;
    scene.may_calibrate = true;
    at(500, 500, 500);
    dr_obstacle *o = keep_out(1000, 3000, 0, 3000, 0, 3000); /* a TRIO's ends at 1,000 um */
    REFUSED(DR_REASON_KEEP_OUT, judge('R', 0, 0, 0));
    o->box_q.min_q[DR_X]++;
    ALLOWED(judge('R', 0, 0, 0));
    rig(DR_MPC);
    at(500, 500, 500);
    limits.rig |= DR_RIG_MAY_CALIBRATE;
    scene.may_calibrate = true;
    o = keep_out(0, 13000, 12500, 13000, 0, 13000); /* an MPC-200's in the middle */
    REFUSED(DR_REASON_KEEP_OUT, judge('N', 0, 0, 0));
    o->box_q.min_q[DR_Y]++;
    ALLOWED(judge('N', 0, 0, 0));
}

static void the_window_of_a_knob_is_rounded_up(void)
{
    dr_command line, move;
    rig(DR_MPC);
    limits.rig = 0;
    TEST_ASSERT_TRUE(dr_command_find(DR_MPC, 0x0321, 'S', &line));
    TEST_ASSERT_TRUE(dr_command_find(DR_MPC, 0x0321, 'M', &move));
    limits.knob_q_per_s = 1;
    TEST_ASSERT_EQUAL(1, dr_judge_margin_q(&limits, &scene, &line));
    TEST_ASSERT_EQUAL(1, dr_judge_margin_q(&limits, &scene, &move));
    limits.knob_q_per_s = 100;
    TEST_ASSERT_EQUAL(5, dr_judge_margin_q(&limits, &scene, &line));
    TEST_ASSERT_EQUAL(1, dr_judge_margin_q(&limits, &scene, &move));
    limits.knob_q_per_s = 101;
    TEST_ASSERT_EQUAL(6, dr_judge_margin_q(&limits, &scene, &line));
    TEST_ASSERT_EQUAL(2, dr_judge_margin_q(&limits, &scene, &move));
    scene.waited_us = 11; /* 10,011 us at 99,091 quanta/s: 992 and a millionth */
    limits.knob_q_per_s = 99091;
    TEST_ASSERT_EQUAL(993, dr_judge_margin_q(&limits, &scene, &move));
}

static void every_obstacle_counts_and_none_beyond_the_count(void)
{
    keep_out(1000, 2000, 1000, 2000, 1000, 2000);
    keep_out(2000, 3000, 2000, 3000, 2000, 3000);
    keep_out(4000, 6000, 4000, 6000, 4000, 6000);
    tells(DR_REASON_KEEP_OUT, DR_AXES, 2, 0, 0, dr_judge_place(&limits, 0, scene.start_steps));
    limits.obstacle_count = 2; /* the third is still there, but not in force */
    tells(DR_REASON_NONE, DR_AXES, DR_NO_ITEM, 0, 0, dr_judge_place(&limits, 0, scene.start_steps));
    ALLOWED(judge('S', 5001, 5000, 5000));
    limits.drives[0].box_q.min_q[DR_X] = UM(5100); /* nor on the way out of another forbidden place */
    ALLOWED(judge('S', 5050, 5000, 5000));
    rig(DR_MPC);
    at(5000, 5000, 5000);
    keep_out(4000, 6000, 4000, 6000, 4000, 6000)->drive = 1;
    TEST_ASSERT_EQUAL(DR_REASON_NONE, dr_judge_place(&limits, 0, scene.start_steps).reason);
    TEST_ASSERT_EQUAL(DR_REASON_KEEP_OUT, dr_judge_place(&limits, 1, scene.start_steps).reason);
}

static void an_escape_tells_by_how_much_it_is_outside_and_was(void)
{
    limits.drives[0].box_q = (dr_box){{UM(1000), UM(1000), UM(1000)}, {UM(9000), UM(9000), UM(9000)}};
    at(500, 5000, 5000);
    tells(DR_REASON_ESCAPE, DR_X, DR_NO_ITEM, UM(600), UM(500), verdict_of('S', 0, 400 * 8, 40000, 40000));
    tells(DR_REASON_ESCAPE, DR_Y, DR_NO_ITEM, UM(100), 0,
          (at(500, 8900, 5000), verdict_of('S', 0, 600 * 8, 9100 * 8, 40000)));
    tells(DR_REASON_ESCAPE, DR_Z, DR_NO_ITEM, UM(300), UM(200),
          (at(5000, 5000, 9200), verdict_of('S', 0, 40000, 40000, 9300 * 8)));
    /* A violation of one quantum is one: faces need not lie on microsteps. */
    limits.drives[0].box_q.max_q[DR_Y] = UM(9000) - 1;
    at(500, 8999, 5000);
    tells(DR_REASON_ESCAPE, DR_Y, DR_NO_ITEM, 1, 0, verdict_of('S', 0, 600 * 8, 9000 * 8, 40000));
    limits.drives[0].box_q = (dr_box){{UM(1000) + 5, 0, 0}, {UM(1000) + 15, UM(9000), UM(9000)}};
    at(1000, 5000, 5000); /* 5 quanta below; 1 quantum above is out on the other side */
    tells(DR_REASON_ESCAPE, DR_X, DR_NO_ITEM, 1, 5, verdict_of('S', 0, 8002, 40000, 40000));
    ALLOWED(verdict_of('S', 0, 8001, 40000, 40000).reason);
}

/* The smallest length that the Euclidean displacement does not exceed. */
static void a_slanting_displacement_is_told_rounded_up(void)
{
    limits.drives[0].max_move_q = (uint32_t)UM(100);
    const dr_verdict exact = verdict_of('S', 0, 40000 + 60 * 8, 40000 + 90 * 8, 40000); /* 60, 90: 108.17 um */
    REFUSED(DR_REASON_STEP, exact.reason);
    limits.drives[0].max_move_q = (uint32_t)UM(99);
    tells(DR_REASON_STEP, DR_AXES, DR_NO_ITEM, UM(100), UM(99),
          verdict_of('S', 0, 40000 + 60 * 8, 40000, 40000 - 80 * 8));
    for (uint32_t x = 1; x <= 750; x += 7)
        for (uint32_t z = 700; z <= 790; z += 9) {
            const int64_t squared = ((int64_t)x * x + (int64_t)z * z) * 64;
            const dr_verdict verdict = verdict_of('S', 0, 40000 + x, 40000, 40000 - z);
            if (squared <= (int64_t)UM(99) * UM(99)) {
                ALLOWED(verdict.reason);
                continue;
            }
            REFUSED(DR_REASON_STEP, verdict.reason);
            TEST_ASSERT_TRUE(verdict.measured * verdict.measured >= squared);
            TEST_ASSERT_TRUE((verdict.measured - 1) * (verdict.measured - 1) < squared);
        }
}

static void how_long_it_would_last_is_told_rounded_up(void)
{
    limits.unstoppable_ms = 200; /* 1 um in 0.2 ms */
    tells(DR_REASON_UNSTOPPABLE, DR_AXES, DR_NO_ITEM, 201, 200, verdict_of('x', 0, 40000 + 8001, 0, 0));
    tells(DR_REASON_UNSTOPPABLE, DR_AXES, DR_NO_ITEM, 201, 200, verdict_of('x', 0, 40000 + 8040, 0, 0));
    tells(DR_REASON_UNSTOPPABLE, DR_AXES, DR_NO_ITEM, 202, 200, verdict_of('x', 0, 40000 + 8041, 0, 0));
    tells(DR_REASON_UNSTOPPABLE, DR_AXES, DR_NO_ITEM, 2000, 200, verdict_of('x', 0, 40000 + 80000, 0, 0));
}

static void both_stages_of_home_and_work_order_are_held_against_the_surface(void)
{
    surface(4000);
    limits.drives[0].clearance_q = 0;
    ALLOWED(judge('W', 5000, 6000, 4001));
    REFUSED(DR_REASON_SPEED, judge('W', 5000, 6000, 4000)); /* down in the second stage */
    at(5000, 5000, 4000);
    REFUSED(DR_REASON_SPEED, judge('H', 5000, 6000, 5000)); /* up in the first */
    at(5000, 5000, 5000);
    limits.drives[0].surface_q = UM(4000) - 1; /* one quantum above it is above it */
    ALLOWED(judge('z', 0, 0, 4000));
}

static void the_cap_of_an_mpc_holds_with_the_faster_of_two_tables(void)
{
    rig(DR_MPC);
    at(5000, 5000, 5000);
    for (uint8_t cap = 0; cap <= 16; cap++)
        for (uint8_t level = 0; level <= 15; level++) {
            limits.drives[0].fast_level = cap;
            limits.drives[0].slow_level = 0;
            REFUSED(level > cap ? DR_REASON_SPEED : DR_REASON_NONE, judge_level(level, 5001, 5000, 5000));
        }
    limits.drives[0].fast_level = DR_SPEED_FULL;
    ALLOWED(judge('M', 5001, 5000, 5000));
    limits.drives[0].fast_level = 0;
    tells(DR_REASON_SPEED, DR_AXES, DR_NO_ITEM, 2767 * 64, 338 * 64, verdict_of('S', 15, 5001 * 16, 80000, 80000));
}

/* The box of a TRIO's staged move has corners off the approach line, on whichever two axes the line slants. */
static void a_move_in_stages_keeps_to_no_slanting_line(void)
{
    static const int16_t lines[][DR_AXES] = {{1, 0, 1}, {0, 1, 1}, {1, 1, 1}, {0, 0, 1}};
    surface(1000);
    scene.in_tissue = true;
    for (size_t i = 0; i < 4; i++) {
        memcpy(limits.drives[0].approach, lines[i], sizeof lines[i]);
        const uint32_t to[DR_AXES] = {5100 - 100 * (lines[i][0] == 0), 5100 - 100 * (lines[i][1] == 0), 5100};
        ALLOWED(judge('S', to[0], to[1], to[2]));
        REFUSED(i == 3 ? DR_REASON_NONE : DR_REASON_APPROACH, judge('H', to[0], to[1], to[2]));
        REFUSED(i == 3 ? DR_REASON_NONE : DR_REASON_APPROACH, judge('W', to[0], to[1], to[2]));
        tells(DR_REASON_APPROACH, DR_AXES, DR_NO_ITEM, 0, 0, verdict_of('S', 0, to[0] * 8, to[1] * 8 + 80, to[2] * 8));
    }
}

static void a_move_in_stages_may_be_as_far_off_the_line_as_one_that_is_straight(void)
{
    surface(1000);
    scene.in_tissue = true;
    ALLOWED(judge('S', 5002, 5000, 5100));
    ALLOWED(judge('H', 5002, 5000, 5100));
    ALLOWED(judge('W', 5000, 5002, 5100));
    REFUSED(DR_REASON_APPROACH, verdict_of('H', 0, 5002 * 8 + 1, 40000, 5100 * 8).reason);
    REFUSED(DR_REASON_APPROACH, verdict_of('W', 0, 40000, 5002 * 8 + 1, 5100 * 8).reason);
}

static void every_move_that_was_broken_off_must_be_clear(void)
{
    static const dr_box high = {{UM(5000), UM(5000), UM(9000)}, {UM(5000), UM(5000), UM(9000)}};
    rig(DR_MPC);
    at(5000, 5000, 5000);
    dr_obstacle *o = keep_out(4900, 5100, 4900, 5100, 7000, 7100);
    o->drive = 1;
    for (uint8_t drive = 0; drive < 2; drive++) /* drive 0 has nothing in its way */
        scene.old[drive] = (dr_old_move){true, {80000, 80000, 80000}, high};
    tells(DR_REASON_OLD_TARGET, DR_AXES, 0, 0, 0, verdict_of('M', 0, 5001 * 16, 80000, 80000));
    o->drive = 0;
    tells(DR_REASON_OLD_TARGET, DR_AXES, 0, 0, 0, verdict_of('M', 0, 5001 * 16, 80000, 80000));
    o->box_q.min_q[DR_Z] = UM(9000) + 1;
    o->box_q.max_q[DR_Z] = UM(9000) + 2;
    ALLOWED(judge('M', 5001, 5000, 5000));
}

static void one_degree_is_no_angle_at_which_an_axis_fails(void)
{
    scene.angle_deg = 1;
    ALLOWED(judge('x', 5001, 0, 0));
    scene.angle_deg = 0;
    tells(DR_REASON_ANGLE, DR_AXES, DR_NO_ITEM, 0, 0, verdict_of('x', 0, 40001, 0, 0));
}

static void in_tissue_without_a_surface_nothing_moves_and_says_so(void)
{
    scene.in_tissue = true;
    tells(DR_REASON_APPROACH, DR_AXES, DR_NO_ITEM, 0, 0, verdict_of('S', 0, 40001, 40000, 40000));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(row_01_targets_on_the_limit_pass_and_a_step_beyond_do_not);
    RUN_TEST(row_02_negative_targets_are_refused_in_every_mode);
    RUN_TEST(a_target_is_held_against_the_travel_of_the_drive_that_moves);
    RUN_TEST(row_03_a_line_through_a_keep_out_is_refused_to_the_quantum);
    RUN_TEST(row_03_half_spaces_too);
    RUN_TEST(row_03_a_line_beside_a_slanting_half_space_passes_though_its_hull_does_not);
    RUN_TEST(row_04_home_order_and_work_order_sweep_different_boxes);
    RUN_TEST(row_05_either_order_of_x_and_z_may_collide);
    RUN_TEST(row_06_m_may_go_anywhere_in_its_hull);
    RUN_TEST(obstacles_of_another_drive_do_not_count);
    RUN_TEST(knobs_that_are_not_locked_widen_the_margin);
    RUN_TEST(row_07_displacement_per_axis_and_euclidean);
    RUN_TEST(row_08_speed_levels_above_the_cap_or_15_are_refused);
    RUN_TEST(speeds_are_the_faster_of_documented_and_measured);
    RUN_TEST(row_09_fixed_speed_commands_are_refused_below_the_surface);
    RUN_TEST(a_surface_may_be_on_the_other_side);
    RUN_TEST(row_10_sideways_only_above_surface_and_clearance);
    RUN_TEST(row_11_every_microstep_of_the_approach_line_passes);
    RUN_TEST(in_tissue_nothing_leaves_the_line_wherever_the_surface_is_said_to_be);
    RUN_TEST(row_12_from_outside_the_box_only_shrinking_lines_pass);
    RUN_TEST(row_13_out_of_an_obstacle_only_by_its_exit);
    RUN_TEST(row_14_a_motion_that_cannot_be_stopped_is_short);
    RUN_TEST(row_16_hidden_targets_pass_only_when_all_travel_is_clear);
    RUN_TEST(an_mpc_that_homes_to_0_sweeps_no_more_than_the_way_there);
    RUN_TEST(row_17_calibration_needs_leave_and_room);
    RUN_TEST(row_87_calibration_goes_below_0);
    RUN_TEST(row_35_upper_case_axes_are_ambiguous);
    RUN_TEST(row_36_angles_at_which_an_axis_fails_are_refused);
    RUN_TEST(row_37_38_62_settings_of_an_mpc);
    RUN_TEST(row_60_another_drive_than_the_hosts_does_not_move);
    RUN_TEST(row_49_what_stop_broke_off_must_be_clear_too);
    RUN_TEST(verdicts_tell_axis_item_and_numbers);
    RUN_TEST(the_frame_alone_is_held_against_the_longest_travel);
    RUN_TEST(what_a_frame_does_not_carry_does_not_count);
    RUN_TEST(all_four_drives_can_be_chosen);
    RUN_TEST(a_hidden_target_needs_every_face_of_the_travel);
    RUN_TEST(a_calibration_goes_no_farther_than_it_ends);
    RUN_TEST(the_window_of_a_knob_is_rounded_up);
    RUN_TEST(every_obstacle_counts_and_none_beyond_the_count);
    RUN_TEST(an_escape_tells_by_how_much_it_is_outside_and_was);
    RUN_TEST(a_slanting_displacement_is_told_rounded_up);
    RUN_TEST(how_long_it_would_last_is_told_rounded_up);
    RUN_TEST(both_stages_of_home_and_work_order_are_held_against_the_surface);
    RUN_TEST(the_cap_of_an_mpc_holds_with_the_faster_of_two_tables);
    RUN_TEST(a_move_in_stages_keeps_to_no_slanting_line);
    RUN_TEST(a_move_in_stages_may_be_as_far_off_the_line_as_one_that_is_straight);
    RUN_TEST(every_move_that_was_broken_off_must_be_clear);
    RUN_TEST(one_degree_is_no_angle_at_which_an_axis_fails);
    RUN_TEST(in_tissue_without_a_surface_nothing_moves_and_says_so);
    return UNITY_END();
}
