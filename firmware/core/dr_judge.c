#include "dr_judge.h"

#include <string.h>

#define MODE_LAST 9u /* [M table 9, 'L'] */
#define LAST_LEVEL (DR_SPEED_LEVELS - 1u)

static const dr_verdict allowed = {DR_REASON_NONE, DR_AXES, DR_NO_ITEM, 0, 0};

static bool is_allowed(dr_verdict verdict) { return verdict.reason == DR_REASON_NONE; }

static dr_verdict refuse(dr_reason reason, uint8_t axis, int64_t measured, int64_t limit)
{
    return (dr_verdict){(uint8_t)reason, axis, DR_NO_ITEM, measured, limit};
}

static dr_verdict refuse_item(dr_reason reason, uint8_t item)
{
    return (dr_verdict){(uint8_t)reason, DR_AXES, item, 0, 0};
}

static bool has(const dr_limits *l, uint16_t rig) { return (l->rig & rig) != 0; }
static bool is_line(uint8_t op) { return op == DR_OP_TRIO_LINE || op == DR_OP_MPC_LINE; }
static bool is_motion(const dr_command *command) { return (command->is & DR_IS_MOTION) != 0; }
static bool is_targeted(const dr_command *command) { return (command->is & DR_IS_TARGETED) != 0; }

static bool calibrates(uint8_t op)
{
    return op == DR_OP_TRIO_RECALIBRATE || op == DR_OP_MPC_CALIBRATE || op == DR_OP_MPC_CENTRE;
}

static dr_stage stage_of(const dr_limits *l, uint8_t drive)
{
    dr_stage stage;
    memset(&stage, 0, sizeof stage); /* nothing connected: no travel */
    (void)dr_stage_get((dr_stage_id)l->drives[drive].stage, &stage);
    return stage;
}

uint32_t dr_judge_speed(const dr_limits *l, uint8_t drive, uint8_t level, bool fastest)
{
    const uint32_t documented = dr_speed_quanta_per_s((dr_stage_id)l->drives[drive].stage, level);
    if (l->kind == DR_TRIO)
        return documented;
    const uint32_t measured = dr_measured_quanta_per_s(level);
    return (documented < measured) == fastest ? measured : documented;
}

/* -- What a frame tells by itself ------------------------------------------------------------------------------------- */

static uint32_t longest_travel_steps(const dr_limits *l, uint8_t axis)
{
    uint32_t longest = 0;
    for (uint8_t drive = 0; drive < DR_PORTS; drive++) {
        const uint32_t travel = stage_of(l, drive).travel_steps[axis];
        if (travel > longest)
            longest = travel;
    }
    return longest;
}

static dr_verdict judge_value(dr_reason reason, uint8_t value, uint8_t min, uint8_t max)
{
    if (value < min)
        return refuse(reason, DR_AXES, value, min);
    return value > max ? refuse(reason, DR_AXES, value, max) : allowed;
}

static dr_verdict judge_setting(const dr_limits *l, const dr_command *command, uint8_t value)
{
    switch (command->op) {
    case DR_OP_TRIO_ANGLE:
        return judge_value(DR_REASON_ANGLE_VALUE, value, l->angle_min_deg, l->angle_max_deg);
    case DR_OP_MPC_MODE:
        return judge_value(DR_REASON_MODE_VALUE, value, l->mode_min, MODE_LAST);
    case DR_OP_MPC_SELECT:
        if (value >= 1u && value <= DR_PORTS && l->drives[value - 1u].stage != DR_STAGE_NONE)
            return allowed;
        return refuse(DR_REASON_DRIVE_VALUE, DR_AXES, value, 0);
    case DR_OP_MPC_STREAM_ON:
        return has(l, DR_RIG_MAY_STREAM) ? allowed : refuse(DR_REASON_STREAM, DR_AXES, 0, 0);
    default:
        return allowed;
    }
}

dr_verdict dr_judge_frame(const dr_limits *l, const dr_command *command, const dr_request *request)
{
    if (!is_motion(command))
        return judge_setting(l, command, request->value);
    const uint8_t only = dr_wire_axis((dr_op)command->op);
    if (only < DR_AXES && command->code >= 'X' && command->code <= 'Z')
        return refuse(DR_REASON_AMBIGUOUS, only, 0, 0);
    if (is_line(command->op) && request->value > LAST_LEVEL)
        return refuse(DR_REASON_LEVEL, DR_AXES, request->value, LAST_LEVEL);
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const uint32_t longest = longest_travel_steps(l, axis);
        if (is_targeted(command) && request->steps[axis] > longest)
            return refuse(DR_REASON_RANGE, axis, request->steps[axis], longest);
    }
    return allowed;
}

/* -- The way ---------------------------------------------------------------------------------------------------------- */

static void to_quanta(const uint32_t steps[DR_AXES], uint8_t quanta_per_step, int32_t out_q[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        out_q[axis] = (int32_t)(steps[axis] * quanta_per_step);
}

static dr_box travel_of(const dr_stage *stage)
{
    dr_box travel = {{0, 0, 0}, {0, 0, 0}};
    to_quanta(stage->travel_steps, stage->quanta_per_step, travel.max_q);
    return travel;
}

/* Where a calibration may go: from beyond 0 to where it began or to where it ends, whichever is farther out. */
static dr_box calibration_of(const dr_limits *l, const dr_stage *stage, const int32_t start_q[DR_AXES], uint8_t op)
{
    dr_box box;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const int32_t end_q = op == DR_OP_TRIO_RECALIBRATE
                                  ? DR_CALIBRATED_TO_Q
                                  : (int32_t)(stage->travel_steps[axis] * stage->quanta_per_step / 2u);
        box.min_q[axis] = -l->beyond_zero_q;
        box.max_q[axis] = start_q[axis] > end_q ? start_q[axis] : end_q;
    }
    return box;
}

static dr_box point(const int32_t q[DR_AXES])
{
    const dr_segment still = {{q[DR_X], q[DR_Y], q[DR_Z]}, {q[DR_X], q[DR_Y], q[DR_Z]}};
    return dr_box_around(&still);
}

static dr_box hull(const dr_box *a, const dr_box *b)
{
    dr_box both = *a;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        if (b->min_q[axis] < both.min_q[axis])
            both.min_q[axis] = b->min_q[axis];
        if (b->max_q[axis] > both.max_q[axis])
            both.max_q[axis] = b->max_q[axis];
    }
    return both;
}

/* Home order: X and Z first, in either order, then Y; work order: Y first [T page 1]. Two boxes that meet at the corner. */
static void stage_boxes(dr_path *path, bool y_first)
{
    int32_t corner_q[DR_AXES];
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        corner_q[axis] = (axis == DR_Y) == y_first ? path->line.to_q[axis] : path->line.from_q[axis];
    const dr_box from = point(path->line.from_q), corner = point(corner_q), to = point(path->line.to_q);
    path->swept[0] = hull(&from, &corner);
    path->swept[1] = hull(&corner, &to);
    path->stages = 2;
}

dr_path dr_judge_path(const dr_limits *l, const dr_scene *scene, const dr_command *command, const dr_request *request)
{
    const dr_stage stage = stage_of(l, scene->drive);
    dr_path path = {.stages = 1};
    to_quanta(scene->start_steps, stage.quanta_per_step, path.line.from_q);
    to_quanta(scene->start_steps, stage.quanta_per_step, path.line.to_q);
    const dr_box start = point(path.line.from_q);

    if (calibrates(command->op)) {
        path.target_q = calibration_of(l, &stage, path.line.from_q, command->op);
        path.swept[0] = path.target_q;
        return path;
    }
    if (!is_targeted(command)) { /* to a place that only the controller knows, unless the rig is known to home to 0 */
        path.target_q = travel_of(&stage);
        if (command->op == DR_OP_MPC_HOME && has(l, DR_RIG_HOME_IS_ZERO)) {
            memset(path.line.to_q, 0, sizeof path.line.to_q);
            path.target_q = point(path.line.to_q);
        }
        path.swept[0] = hull(&start, &path.target_q);
        return path;
    }
    const uint8_t only = dr_wire_axis((dr_op)command->op);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (only == DR_AXES || only == axis)
            path.line.to_q[axis] = (int32_t)(request->steps[axis] * stage.quanta_per_step);
    path.target_q = point(path.line.to_q);
    path.swept[0] = dr_box_around(&path.line);
    if (has(l, DR_RIG_PATHS_UNKNOWN))
        return path;
    path.straight = is_line(command->op);
    if (command->op == DR_OP_TRIO_HOME_TO || command->op == DR_OP_TRIO_WORK_TO)
        stage_boxes(&path, command->op == DR_OP_TRIO_WORK_TO);
    return path;
}

int32_t dr_judge_margin_q(const dr_limits *l, const dr_scene *scene, const dr_command *command)
{
    const int64_t window_us =
        (command->op == DR_OP_MPC_LINE ? DR_WINDOW_MPC_LINE_US : DR_WINDOW_US) + (int64_t)scene->waited_us;
    if (has(l, DR_RIG_KNOBS_LOCKED))
        return l->margin_q;
    return l->margin_q + (int32_t)((l->knob_q_per_s * window_us + DR_US_PER_S - 1) / DR_US_PER_S);
}

/* -- Obstacles -------------------------------------------------------------------------------------------------------- */

static bool box_hits(const dr_box *box, const dr_obstacle *o, int32_t margin_q)
{
    if (o->shape == DR_SHAPE_HALF) {
        const dr_half half = dr_half_grown(&o->half_q, margin_q);
        return dr_box_touches_half(box, &half);
    }
    const dr_box grown = dr_box_grown(&o->box_q, margin_q);
    return dr_box_touches_box(box, &grown);
}

static bool line_hits(const dr_segment *line, const dr_obstacle *o, int32_t margin_q)
{
    if (o->shape == DR_SHAPE_HALF) {
        const dr_half half = dr_half_grown(&o->half_q, margin_q);
        return dr_segment_touches_half(line, &half);
    }
    const dr_box grown = dr_box_grown(&o->box_q, margin_q);
    return dr_segment_touches_box(line, &grown);
}

static bool path_hits(const dr_path *path, const dr_obstacle *o, int32_t margin_q)
{
    if (path->straight) /* its hull first: most obstacles are nowhere near, and 8 bits are slow with the line's products */
        return box_hits(&path->swept[0], o, margin_q) && line_hits(&path->line, o, margin_q);
    for (uint8_t stage = 0; stage < path->stages; stage++)
        if (box_hits(&path->swept[stage], o, margin_q))
            return true;
    return false;
}

static dr_verdict judge_box_clear(const dr_limits *l, uint8_t drive, const dr_box *box, int32_t margin_q,
                                  dr_reason reason)
{
    for (uint8_t item = 0; item < l->obstacle_count; item++)
        if (l->obstacles[item].drive == drive && box_hits(box, &l->obstacles[item], margin_q))
            return refuse_item(reason, item);
    return allowed;
}

static dr_verdict judge_clear(const dr_limits *l, uint8_t drive, const dr_path *path, int32_t margin_q)
{
    for (uint8_t item = 0; item < l->obstacle_count; item++)
        if (l->obstacles[item].drive == drive && path_hits(path, &l->obstacles[item], margin_q))
            return refuse_item(DR_REASON_KEEP_OUT, item);
    return allowed;
}

static dr_verdict judge_in_box(const dr_box *box_q, const dr_box *allowed_q)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        if (box_q->min_q[axis] < allowed_q->min_q[axis])
            return refuse(DR_REASON_LIMIT, axis, box_q->min_q[axis], allowed_q->min_q[axis]);
        if (box_q->max_q[axis] > allowed_q->max_q[axis])
            return refuse(DR_REASON_LIMIT, axis, box_q->max_q[axis], allowed_q->max_q[axis]);
    }
    return allowed;
}

static dr_verdict judge_point(const dr_limits *l, uint8_t drive, const int32_t at_q[DR_AXES], int32_t margin_q)
{
    const dr_box at = point(at_q);
    const dr_verdict verdict = judge_in_box(&at, &l->drives[drive].box_q);
    return is_allowed(verdict) ? judge_box_clear(l, drive, &at, margin_q, DR_REASON_KEEP_OUT) : verdict;
}

dr_verdict dr_judge_place(const dr_limits *l, uint8_t drive, const uint32_t steps[DR_AXES])
{
    int32_t at_q[DR_AXES];
    if (l->drives[drive].stage == DR_STAGE_NONE)
        return refuse(DR_REASON_DRIVE, DR_AXES, drive + 1, 0);
    to_quanta(steps, stage_of(l, drive).quanta_per_step, at_q);
    return judge_point(l, drive, at_q, l->margin_q);
}

/* -- The way out of a forbidden place: every violated amount shrinks, no new one comes --------------------------------- */

static int64_t beyond(int64_t at, int64_t min, int64_t max)
{
    if (at < min)
        return min - at;
    return at > max ? at - max : 0;
}

static dr_verdict judge_escape_box(const dr_drive_limits *d, const dr_segment *line)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const int64_t was = beyond(line->from_q[axis], d->box_q.min_q[axis], d->box_q.max_q[axis]);
        const int64_t is = beyond(line->to_q[axis], d->box_q.min_q[axis], d->box_q.max_q[axis]);
        if (is > 0 && is >= was)
            return refuse(DR_REASON_ESCAPE, axis, is, was);
        /* Out on the other side would be a new violation, however small. */
        if (is > 0 && (line->from_q[axis] < d->box_q.min_q[axis]) != (line->to_q[axis] < d->box_q.min_q[axis]))
            return refuse(DR_REASON_ESCAPE, axis, is, was);
    }
    return allowed;
}

static bool leads_out(const dr_obstacle *o, const dr_segment *line)
{
    if (o->shape == DR_SHAPE_HALF)
        return dr_dot(o->half_q.normal, line->to_q) > dr_dot(o->half_q.normal, line->from_q);
    if (o->exit == DR_TO_NONE)
        return false;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const int32_t step = line->to_q[axis] - line->from_q[axis];
        if (axis == dr_to_axis(o->exit) ? step == 0 || (step > 0) != dr_to_more(o->exit)
                                        : step > DR_LATERAL_TOLERANCE_Q || step < -DR_LATERAL_TOLERANCE_Q)
            return false;
    }
    return true;
}

static dr_verdict judge_escape(const dr_limits *l, uint8_t drive, const dr_path *path, int32_t margin_q)
{
    const dr_box start = point(path->line.from_q);
    int32_t move_q[DR_AXES];
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        move_q[axis] = path->line.to_q[axis] - path->line.from_q[axis];
    if (!path->straight || dr_length_squared(move_q) > (int64_t)DR_ESCAPE_MAX_Q * DR_ESCAPE_MAX_Q)
        return refuse(DR_REASON_ESCAPE, DR_AXES, 0, 0);
    for (uint8_t item = 0; item < l->obstacle_count; item++) {
        const dr_obstacle *o = &l->obstacles[item];
        if (o->drive != drive)
            continue;
        if (box_hits(&start, o, margin_q) ? !leads_out(o, &path->line) : path_hits(path, o, margin_q))
            return refuse_item(DR_REASON_ESCAPE, item);
    }
    return judge_escape_box(&l->drives[drive], &path->line);
}

/* -- The other policies ------------------------------------------------------------------------------------------------ */

/* The longest way that may be on an axis: the target is one point, or anywhere in a box. */
static int32_t farthest_q(const dr_path *path, uint8_t axis)
{
    const int32_t down = path->line.from_q[axis] - path->target_q.min_q[axis];
    const int32_t up = path->target_q.max_q[axis] - path->line.from_q[axis];
    return up > down ? up : down;
}

static dr_verdict judge_step(const dr_drive_limits *d, const dr_path *path)
{
    const int64_t limit = d->max_move_q;
    int32_t move_q[DR_AXES];
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        move_q[axis] = farthest_q(path, axis);
        if (move_q[axis] > limit)
            return refuse(DR_REASON_STEP, axis, move_q[axis], limit);
    }
    const int64_t squared = dr_length_squared(move_q);
    if (squared <= limit * limit)
        return allowed;
    int64_t length = limit; /* rounded up, for the report: the longest of three sides times sqrt(3) bounds it */
    for (int64_t step = DR_FAR_Q; step > 0; step /= 2)
        if ((length + step) * (length + step) < squared)
            length += step;
    return refuse(DR_REASON_STEP, DR_AXES, length + 1, limit);
}

static dr_verdict judge_time(const dr_limits *l, uint8_t drive, const dr_path *path)
{
    int64_t way_q = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        way_q += farthest_q(path, axis);
    const int64_t speed = dr_judge_speed(l, drive, DR_SPEED_FULL, false);
    if (way_q * 1000 > l->unstoppable_ms * speed)
        return refuse(DR_REASON_UNSTOPPABLE, DR_AXES, (way_q * 1000 + speed - 1) / speed, l->unstoppable_ms);
    return allowed;
}

/* How low the way comes on the axis of the surface, as a height above it; negative: below it. */
static int64_t height_q(const dr_drive_limits *d, const dr_path *path)
{
    const uint8_t axis = dr_to_axis(d->retract);
    int64_t lowest = INT64_MAX;
    for (uint8_t stage = 0; stage < path->stages; stage++) {
        const int64_t height = dr_to_more(d->retract) ? (int64_t)path->swept[stage].min_q[axis] - d->surface_q
                                                      : (int64_t)d->surface_q - path->swept[stage].max_q[axis];
        if (height < lowest)
            lowest = height;
    }
    return lowest;
}

static dr_verdict judge_speed(const dr_limits *l, uint8_t drive, uint8_t level, bool below)
{
    const dr_drive_limits *d = &l->drives[drive];
    const uint8_t cap = below ? d->slow_level : d->fast_level;
    const uint32_t speed = dr_judge_speed(l, drive, level, true), limit = dr_judge_speed(l, drive, cap, true);
    if (speed > limit)
        return refuse(DR_REASON_SPEED, DR_AXES, speed, limit);
    return allowed;
}

/* Does every point that the way may touch lie along the approach line? The farthest is a corner. */
static bool keeps_to_line(const dr_drive_limits *d, const dr_path *path)
{
    for (uint8_t corner = path->straight ? 7u : 0u; corner < 8u;
         corner++) { /* a bit per axis; the last is the target */
        int32_t move_q[DR_AXES];
        for (uint8_t axis = 0; axis < DR_AXES; axis++) {
            const bool moves = (((unsigned)corner >> axis) & 1u) != 0;
            move_q[axis] = moves ? path->line.to_q[axis] - path->line.from_q[axis] : 0;
        }
        if (!dr_is_along(move_q, d->approach, DR_LATERAL_TOLERANCE_Q))
            return false;
    }
    return true;
}

static dr_verdict judge_surface(const dr_limits *l, const dr_scene *scene, const dr_path *path, uint8_t level,
                                int32_t margin_q)
{
    const dr_drive_limits *d = &l->drives[scene->drive];
    if (d->retract == DR_TO_NONE) /* in tissue without a line to keep to: nothing moves */
        return scene->in_tissue ? refuse(DR_REASON_APPROACH, DR_AXES, 0, 0)
                                : judge_speed(l, scene->drive, level, false);
    const int64_t height = height_q(d, path) - margin_q;
    const dr_verdict fast = judge_speed(l, scene->drive, level, height <= 0);
    if (!is_allowed(fast))
        return fast;
    const dr_box end = point(path->line.to_q);
    if (dr_box_is_in(&path->target_q, &end) && keeps_to_line(d, path)) /* a hidden target is nowhere in line */
        return allowed;
    if (scene->in_tissue)
        return refuse(DR_REASON_APPROACH, DR_AXES, 0, 0);
    return height <= (int64_t)d->clearance_q ? refuse(DR_REASON_LATERAL, dr_to_axis(d->retract), height, d->clearance_q)
                                             : allowed;
}

/* What ^C broke off, on any drive, may be resumed by the next motion: that way must be clear too. */
static dr_verdict judge_old_moves(const dr_limits *l, const dr_scene *scene, int32_t margin_q)
{
    for (uint8_t drive = 0; drive < DR_PORTS; drive++) {
        const dr_old_move *old = &scene->old[drive];
        int32_t at_q[DR_AXES];
        if (!old->is_open)
            continue;
        to_quanta(drive == scene->drive ? scene->start_steps : old->at_steps, stage_of(l, drive).quanta_per_step, at_q);
        const dr_box at = point(at_q), way = hull(&at, &old->target_q);
        const dr_verdict verdict = judge_box_clear(l, drive, &way, margin_q, DR_REASON_OLD_TARGET);
        if (!is_allowed(verdict))
            return verdict;
    }
    return allowed;
}

/* -- The whole ----------------------------------------------------------------------------------------------------------- */

static dr_verdict judge_calibration(const dr_limits *l, const dr_scene *scene, const dr_path *path, int32_t margin_q)
{
    if (!has(l, DR_RIG_MAY_CALIBRATE) || !scene->may_calibrate)
        return refuse(DR_REASON_CALIBRATE, DR_AXES, 0, 0);
    return judge_clear(l, scene->drive, path, margin_q);
}

static dr_verdict judge_where(const dr_limits *l, const dr_scene *scene, const dr_command *command, const dr_path *path,
                              int32_t margin_q)
{
    const dr_verdict start = judge_point(l, scene->drive, path->line.from_q, margin_q);
    if (!is_allowed(start))
        return judge_escape(l, scene->drive, path, margin_q);
    const dr_verdict end = judge_in_box(&path->target_q, &l->drives[scene->drive].box_q);
    const dr_verdict way = is_allowed(end) ? judge_clear(l, scene->drive, path, margin_q) : end;
    if (is_allowed(way) || is_targeted(command))
        return way;
    return refuse(DR_REASON_HIDDEN, way.axis, way.measured, way.limit);
}

dr_verdict dr_judge_motion(const dr_limits *l, const dr_scene *scene, const dr_command *command,
                           const dr_request *request)
{
    if (scene->drive != scene->chosen || l->drives[scene->drive].stage == DR_STAGE_NONE)
        return refuse(DR_REASON_DRIVE, DR_AXES, scene->drive + 1, scene->chosen + 1);
    if (l->kind == DR_TRIO && (scene->angle_deg < 1u || scene->angle_deg >= DR_ANGLE_MAX_DEG))
        return refuse(DR_REASON_ANGLE, DR_AXES, scene->angle_deg, 0);
    const dr_stage stage = stage_of(l, scene->drive);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (is_targeted(command) && request->steps[axis] > stage.travel_steps[axis])
            return refuse(DR_REASON_RANGE, axis, request->steps[axis], stage.travel_steps[axis]);

    const dr_path path = dr_judge_path(l, scene, command, request);
    const int32_t margin_q = dr_judge_margin_q(l, scene, command);
    if (calibrates(command->op))
        return judge_calibration(l, scene, &path, margin_q);
    if (scene->frame_lost)
        return refuse(DR_REASON_FRAME_LOST, DR_AXES, 0, 0);
    dr_verdict verdict = judge_where(l, scene, command, &path, margin_q);
    if (is_allowed(verdict))
        verdict = judge_old_moves(l, scene, margin_q);
    if (is_allowed(verdict))
        verdict = judge_step(&l->drives[scene->drive], &path);
    if (is_allowed(verdict) && (command->is & DR_IS_STOPPABLE) == 0)
        verdict = judge_time(l, scene->drive, &path);
    if (is_allowed(verdict))
        verdict = judge_surface(l, scene, &path, is_line(command->op) ? request->value : DR_SPEED_FULL, margin_q);
    return verdict;
}
