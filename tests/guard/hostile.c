#include "hostile.h"

#include <string.h>

static chance *lying; /* decides what becomes of the controller's bytes */

uint32_t any_below(chance *c, uint32_t n)
{
    if (c->bytes == NULL) {
        c->state = c->state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
        return (uint32_t)((c->state >> 32) * n >> 32);
    }
    uint32_t value = 0;
    for (uint64_t range = 1; range < n; range *= 256)
        value = value << 8 | (c->at < c->count ? c->bytes[c->at++] : 0u);
    return value % n;
}

static bool one_in(chance *c, uint32_t n) { return any_below(c, n) == n - 1; }
static int32_t any_within(chance *c, int32_t min, int32_t max)
{
    return min + (int32_t)any_below(c, (uint32_t)(max - min) + 1u);
}
static int32_t clamp(int32_t value, int32_t min, int32_t max) { return value < min ? min : value > max ? max : value; }

/* -- The rig ----------------------------------------------------------------------------------------------------------- */

static bool makes_sense(void)
{
    dr_limits_problem problem;
    if (!dr_limits_check(&rig.limits, &problem))
        return false;
    for (uint8_t drive = 0; drive < rig.controller.drive_count; drive++)
        if (dr_judge_place(&rig.limits, drive, rig.drives[drive].position_steps).reason != DR_REASON_NONE)
            return false;
    return true;
}

static void any_place(chance *c, uint8_t drive)
{
    dr_drive_limits *d = &rig.limits.drives[drive];
    dr_stage stage;
    TEST_ASSERT_TRUE(dr_stage_get((dr_stage_id)d->stage, &stage));
    for (uint8_t axis = 0; axis < DR_AXES; axis++) { /* within the default box, at 2 % to 98 % of the travel */
        const uint32_t steps = stage.travel_steps[axis] / 50u * (1u + any_below(c, 49));
        const int32_t at_q = (int32_t)(steps * stage.quanta_per_step);
        rig.drives[drive].position_steps[axis] = steps;
        d->box_q.min_q[axis] = clamp(at_q - UM(any_below(c, 4000)), d->box_q.min_q[axis], at_q);
        d->box_q.max_q[axis] = clamp(at_q + UM(1 + any_below(c, 4000)), at_q + 1, d->box_q.max_q[axis]);
    }
}

static void any_surface(chance *c, uint8_t drive)
{
    dr_drive_limits *d = &rig.limits.drives[drive];
    const dr_drive_limits plain = *d;
    d->retract = (uint8_t)(DR_TO_LESS_X + any_below(c, 6));
    const uint8_t axis = dr_to_axis(d->retract);
    d->surface_q = any_within(c, d->box_q.min_q[axis], d->box_q.max_q[axis]);
    d->clearance_q = (uint32_t)UM(any_below(c, 500));
    for (uint8_t i = 0; i < DR_AXES; i++)
        d->approach[i] = (int16_t)any_within(c, -DR_NORMAL_MAX, DR_NORMAL_MAX);
    if (!makes_sense())
        *d = plain;
}

static void any_obstacle(chance *c, uint8_t drive)
{
    dr_obstacle *o = &rig.limits.obstacles[rig.limits.obstacle_count++];
    dr_stage stage;
    int32_t at_q[DR_AXES];
    TEST_ASSERT_TRUE(dr_stage_get((dr_stage_id)rig.limits.drives[drive].stage, &stage));
    memset(o, 0, sizeof *o);
    o->drive = drive;
    o->shape = one_in(c, 3) ? DR_SHAPE_HALF : DR_SHAPE_BOX;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        at_q[axis] =
            (int32_t)(rig.drives[drive].position_steps[axis] * stage.quanta_per_step) + UM(any_within(c, -1500, 1500));
        const int32_t half_q = UM(any_below(c, 1200));
        if (o->shape == DR_SHAPE_BOX) {
            o->box_q.min_q[axis] = at_q[axis] - half_q;
            o->box_q.max_q[axis] = at_q[axis] + half_q;
        } else {
            o->half_q.normal[axis] = (int16_t)any_within(c, -DR_NORMAL_MAX, DR_NORMAL_MAX);
        }
    }
    if (o->shape == DR_SHAPE_HALF)
        o->half_q.offset_q = dr_dot(o->half_q.normal, at_q);
    if (!makes_sense()) /* the tip is in it, for one */
        rig.limits.obstacle_count--;
}

static void any_drive(chance *c, uint8_t drive, dr_stage_id stage)
{
    dr_drive_init(&rig.drives[drive], stage);
    TEST_ASSERT_TRUE(dr_limits_init_drive(&rig.limits, drive, stage));
    any_place(c, drive);
    rig.drives[drive].diagonal = (uint8_t)any_below(c, DR_DIAGONALS);
    rig.drives[drive].work_is_set = one_in(c, 2);
    memcpy(rig.drives[drive].work_steps, rig.drives[drive].position_steps, sizeof rig.drives[drive].work_steps);
    dr_drive_limits *d = &rig.limits.drives[drive];
    d->max_move_q = (uint32_t)UM(100 + any_below(c, 5000));
    d->fast_level = (uint8_t)(DR_SPEED_FULL - (one_in(c, 3) ? any_below(c, DR_SPEED_LEVELS) : 0));
    d->slow_level = (uint8_t)(d->fast_level - any_below(c, d->fast_level + 1u));
    if (one_in(c, 3))
        any_surface(c, drive);
}

static uint16_t any_facts(chance *c)
{
    static const uint16_t trio[] = {0, DR_RIG_Y_LOCKED_OUT, DR_RIG_PATHS_UNKNOWN,
                                    DR_RIG_Y_LOCKED_OUT | DR_RIG_PATHS_UNKNOWN};
    static const uint16_t mpc[] = {0, DR_RIG_HOME_IS_ZERO, DR_RIG_MAY_STREAM | DR_RIG_Y_LOCKED_OUT << 1,
                                   DR_RIG_HOME_IS_ZERO | DR_RIG_MAY_STREAM | DR_RIG_PATHS_UNKNOWN |
                                       DR_RIG_Y_LOCKED_OUT};
    const uint16_t knobs = one_in(c, 4) ? 0 : DR_RIG_KNOBS_LOCKED, stays = one_in(c, 4) ? DR_RIG_STAYS_ARMED : 0;
    return (uint16_t)(knobs | stays | (rig.limits.kind == DR_TRIO ? trio[any_below(c, 4)] : mpc[any_below(c, 4)]));
}

/* A byte of the controller's: 1 in 16 changes or gets lost. */
static int lie(bench *b, uint8_t byte)
{
    (void)b;
    if (!one_in(lying, 16))
        return byte;
    return one_in(lying, 3) ? -1 : byte ^ 1 << any_below(lying, 8);
}

void hostile_begin(chance *c, bool lies)
{
    static const dr_stage_id trio[] = {DR_STAGE_TRIO_MP845, DR_STAGE_TRIO_MP865, DR_STAGE_TRIO_MP285,
                                       DR_STAGE_TRIO_MP265};
    static const dr_stage_id mpc[] = {DR_STAGE_MPC_MP225, DR_STAGE_MPC_MP285, DR_STAGE_MPC_MP265,
                                      DR_STAGE_MPC_MP845, DR_STAGE_MPC_MP865, DR_STAGE_MPC_MT800};
    const bool is_trio = one_in(c, 2);
    if (is_trio)
        bench_trio();
    else
        bench_mpc();
    rig.limits.margin_q = UM(50 + any_below(c, 100));
    rig.limits.rig = any_facts(c);
    rig.limits.refusal = (uint8_t)any_below(c, 2);
    rig.limits.host_loss = (uint8_t)any_below(c, 2);
    rig.limits.unstoppable_ms = (uint16_t)any_below(c, 1500);
    rig.limits.mode_min = (uint8_t)any_below(c, 10);
    for (uint8_t drive = 0; drive < rig.controller.drive_count; drive++) {
        any_drive(c, drive, is_trio ? trio[any_below(c, 4)] : mpc[any_below(c, 6)]);
        rig.drives[drive].y_moves_home = (rig.limits.rig & DR_RIG_Y_LOCKED_OUT << drive) == 0;
        for (uint32_t i = any_below(c, 6); i > 0; i--)
            any_obstacle(c, drive);
    }
    rig.controller.quirks = one_in(c, 2) ? (uint16_t)any_below(c, 256) : 0;
    rig.controller.angle_deg = (uint8_t)(1u + any_below(c, DR_ANGLE_MAX_DEG - 1u)); /* at 0 and 90 nothing may move */
    rig.controller.calibrates_at_power_on =
        false; /* moves the tip without the guard, when a quirk needs a power cycle */
    bench_start();
    bench_arm();
    if (lies) {
        lying = c;
        rig.spoil = lie;
        rig.watch_tip = false;
    }
}

/* -- Frames -------------------------------------------------------------------------------------------------------------- */

static uint32_t any_u32(chance *c) { return any_below(c, 65536) << 16 | any_below(c, 65536); }

/* Somewhere on an axis: mostly near the tip, or right at what limits it. */
static uint32_t any_coordinate(chance *c, uint8_t drive, uint8_t axis)
{
    const dr_drive_limits *d = &rig.limits.drives[drive];
    const dr_obstacle *o = &rig.limits.obstacles[any_below(c, DR_OBSTACLES_MAX) % (rig.limits.obstacle_count + 1u)];
    const int32_t near = any_within(c, -2, 2);
    uint32_t steps[DR_AXES];
    dr_stage stage;
    TEST_ASSERT_TRUE(dr_stage_get((dr_stage_id)d->stage, &stage));
    dr_controller_position(&rig.controller, drive, (dr_us)(rig.clock_at_start + rig.now), steps);
    int32_t at_q;
    switch (any_below(c, 16)) {
    case 0:
        at_q = d->box_q.min_q[axis];
        break;
    case 1:
        at_q = d->box_q.max_q[axis];
        break;
    case 2:
        at_q = o->box_q.min_q[axis] - rig.limits.margin_q;
        break;
    case 3:
        at_q = o->box_q.max_q[axis] + rig.limits.margin_q;
        break;
    case 4:
        at_q = any_within(c, d->box_q.min_q[axis], d->box_q.max_q[axis]);
        break;
    case 5:
        return any_below(c, stage.travel_steps[axis] + 2u);
    case 6:
        return any_u32(c);
    case 7:
        return steps[axis] + (uint32_t)near;
    case 8:
    case 9:
    case 10:
    case 11:
        return steps[axis] + (uint32_t)(any_within(c, -400, 400) * (int32_t)(DR_QUANTA_PER_UM / stage.quanta_per_step));
    default:
        return steps[axis];
    }
    return (uint32_t)(at_q / stage.quanta_per_step + near);
}

/* A whole frame of some command, motions above all. */
static size_t any_frame(chance *c, uint8_t *frame)
{
    static const uint8_t trio[] = "SSSSHWxyzXcCAhwR\x03";
    static const uint8_t mpc[] = "SSSSMMMMCKUAIHYNFOL\x03";
    const bool is_trio = rig.limits.kind == DR_TRIO;
    const uint8_t code = is_trio ? trio[any_below(c, sizeof trio - 1)] : mpc[any_below(c, sizeof mpc - 1)];
    const uint8_t drive = rig.controller.active;
    dr_command command;
    frame[0] = code;
    if (!dr_command_find((dr_kind)rig.limits.kind, rig.limits.firmware, code, &command))
        return 1;
    size_t count = 1;
    if (command.args == DR_ARGS_LINE)
        frame[count++] = (uint8_t)(one_in(c, 16) ? any_below(c, 256) : any_below(c, DR_SPEED_LEVELS));
    if (command.args == DR_ARGS_BYTE)
        frame[count++] = (uint8_t)(one_in(c, 4) ? any_below(c, 256) : any_below(c, is_trio ? 91 : 6));
    for (uint8_t axis = dr_wire_axis((dr_op)command.op) % DR_AXES; count <= command.args; axis++) {
        const uint32_t steps = any_coordinate(c, drive, axis % DR_AXES);
        for (unsigned i = 0; i < 4; i++)
            frame[count++] = (uint8_t)(steps >> 8 * i);
    }
    return count;
}

/* The same, or damaged: cut off, with a byte too many or too few, a bit flipped, or noise. */
static size_t any_bytes(chance *c, uint8_t *frame)
{
    size_t count = any_frame(c, frame);
    const size_t where = any_below(c, (uint32_t)count);
    switch (any_below(c, 16)) {
    case 0:
        return where;
    case 1:
        memmove(frame + where + 1, frame + where, count - where);
        frame[where] = (uint8_t)any_below(c, 256);
        return count + 1;
    case 2:
        memmove(frame + where, frame + where + 1, count - where - 1);
        return count - 1;
    case 3:
        frame[where] = (uint8_t)(frame[where] ^ 1u << any_below(c, 8));
        return count;
    case 4:
        count = 1 + any_below(c, 24);
        for (size_t i = 0; i < count; i++)
            frame[i] = (uint8_t)any_below(c, 256);
        return count;
    case 5:
        frame[count] = 0x03;
        return count + 1;
    default:
        return count;
    }
}

/* -- Time and people -------------------------------------------------------------------------------------------------------- */

static uint32_t any_us(chance *c)
{
    static const uint32_t below_us[] = {1, 1, 1, 300, 3000, 20000, 60000, 120000, 400000};
    return any_below(c, below_us[any_below(c, sizeof below_us / sizeof *below_us)]);
}

static bool is_armed(void)
{
    const uint8_t state = rig.state;
    return state == DR_GUARD_IDLE || state == DR_GUARD_CHECKING || state == DR_GUARD_MOVING_S ||
           state == DR_GUARD_MOVING_U || state == DR_GUARD_STOPPING;
}

/* Somebody sees to it that the rig works again. */
static void put_right(void)
{
    if (status().fault == DR_FAULT_DEVICE_SILENT || status().state == DR_GUARD_LOCKED) { /* a quirk has wedged it */
        const dr_hand off = {DR_HAND_POWER_OFF, 0, 0, {0, 0, 0}}, on = {DR_HAND_POWER_ON, 0, 0, {0, 0, 0}};
        (void)dr_controller_poke(&rig.controller, (dr_us)(rig.clock_at_start + rig.now), &off);
        cables(true, false);
        run_ms(10);
        (void)dr_controller_poke(&rig.controller, (dr_us)(rig.clock_at_start + rig.now), &on);
    }
    cables(true, true);
    stop_input(false);
    input(DR_INPUT_IN_TISSUE, false);
    input(DR_INPUT_LOG_FAILED, false);
    run_ms(1200);
    clear_fault();
    press(DR_INPUT_CONFIRM);
    run_ms(50);
    press(DR_INPUT_ARM);
    run_ms(200);
}

static void somebody_acts(chance *c)
{
    const dr_us now = (dr_us)(rig.clock_at_start + rig.now);
    switch (any_below(c, 8)) {
    case 0:
        stop_input(true);
        break;
    case 1:
        input(DR_INPUT_KEY, one_in(c, 2));
        break;
    case 2:
        dr_guard_host_line_error(&rig.guard, now);
        break;
    case 3:
        cables(one_in(c, 2), !one_in(c, 4));
        break;
    case 4:
        input(DR_INPUT_IN_TISSUE, one_in(c, 2));
        break;
    case 5:
        press(DR_INPUT_TIP_CHANGED);
        break;
    case 6:
        (void)dr_guard_self_check(&rig.guard, now);
        break;
    default:
        input(DR_INPUT_STOP, one_in(c, 2)); /* one contact of the two */
        break;
    }
    run_us(any_us(c));
}

static void controller_speaks(chance *c)
{
    uint8_t noise[16];
    const size_t count = 1 + any_below(c, sizeof noise);
    for (size_t i = 0; i < count; i++)
        noise[i] = (uint8_t)(one_in(c, 2) ? DR_CR : any_below(c, 256));
    device_says(noise, count);
}

void hostile_act(chance *c)
{
    uint8_t frame[32];
    bench_forget();
    if (one_in(c, 32))
        somebody_acts(c);
    if (rig.spoil != NULL && one_in(c, 8))
        controller_speaks(c);
    if (!is_armed() && one_in(c, 3))
        put_right();
    if (one_in(c, 2)) /* out of RESYNC */
        run_ms(60);
    const size_t count = any_bytes(c, frame), pause_at = any_below(c, 32);
    const uint32_t each_us = one_in(c, 3) ? rig.byte_us : 0;
    for (size_t i = 0; i < count; i++) {
        if (i == pause_at)
            run_us(any_us(c));
        if (each_us > 0)
            run_us(each_us);
        host_bytes(frame + i, 1);
    }
    run_us(any_us(c));
    for (uint32_t ms = one_in(c, 2) ? 1500 : 0; ms > 0 && is_armed() && rig.state != DR_GUARD_IDLE; ms--)
        run_ms(1);
}
