/* Proves of the judge, for all limits within the ranges that dr_limits_check() holds, starts, targets, stages and motions of
 * both controllers:
 *
 *   path      every point of the documented way of a command lies within what the judge looks at, and its end in target_q;
 *   box       allowed from a place within the travel box: the target, and every box or line of the way, is in it too;
 *   keep_out  allowed: no point of the way is within a box that is kept out, grown by the margin, unless the tip was in it;
 *   escape    from beyond the travel box: no axis gets farther out, or out on its other side.
 *
 * Each leaves out of dr_judge.c what it does not need: such a function may then answer anything. */
#define dr_segment_touches_box proved_segment_touches_box
#define dr_segment_touches_half proved_segment_touches_half
#define dr_box_touches_half proved_box_touches_half
#include "dr_geometry.c"
#undef dr_segment_touches_box
#undef dr_segment_touches_half
#undef dr_box_touches_half
#include "dr_judge.c" /* with what is private to it */
#include "proof.h"

static dr_limits limits; /* of drive DR_PROOF_DRIVE: a proof for each */
static dr_scene scene;
static dr_command command;
static dr_request request;
static dr_stage stage;

static void any_box(dr_box *box)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        box->min_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
        box->max_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
    }
}

/* One drive, any stage; a motion; a start as far beyond the travel as the guard believes a reading. */
static void any_motion(void)
{
    dr_limits any; /* not initialised: the model checker takes everything for possible */
    dr_scene any_scene;
    limits = any;
    scene = any_scene;
    limits.kind = anything() ? DR_MPC : DR_TRIO;
    assume(limits.margin_q >= 0 && limits.margin_q <= 640000);
    assume(limits.knob_q_per_s >= 0 && limits.knob_q_per_s <= 1280000);
    assume(limits.beyond_zero_q >= 0 && limits.beyond_zero_q <= 640000);
    assume(limits.obstacle_count <= DR_OBSTACLES_MAX);
    scene.drive = DR_PROOF_DRIVE;
    scene.waited_us = (uint32_t)anything_between(0, DR_WAITED_MAX_US);
    scene.may_calibrate = anything();
    scene.in_tissue = anything();
    scene.frame_lost = anything();
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        scene.old[drive].is_open = anything();
    assume(dr_stage_get((dr_stage_id)limits.drives[scene.drive].stage, &stage) && stage.kind == limits.kind);
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const dr_box *box_q = &limits.drives[scene.drive].box_q;
        const int32_t end_q = (int32_t)(stage.travel_steps[axis] * stage.quanta_per_step);
        assume(0 <= box_q->min_q[axis] && box_q->min_q[axis] < box_q->max_q[axis] && box_q->max_q[axis] <= end_q);
        assume((uint64_t)scene.start_steps[axis] * stage.quanta_per_step <= (uint64_t)end_q + DR_PLAUSIBLE_BEYOND_Q);
        request.steps[axis] = anything_32();
    }
    assume(dr_command_row((dr_kind)limits.kind, anything_8(), &command) && (command.is & DR_IS_MOTION) != 0);
    request.op = command.op;
    request.value = anything_8();
}

static bool is_in(const int32_t p_q[DR_AXES], const dr_box *box)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (p_q[axis] < box->min_q[axis] || p_q[axis] > box->max_q[axis])
            return false;
    return true;
}

static bool is_between(int32_t at, int32_t a, int32_t b) { return (a <= at && at <= b) || (b <= at && at <= a); }

/* -- The way ---------------------------------------------------------------------------------------------------------- */

void proof_path(void)
{
    int32_t from_q[DR_AXES], to_q[DR_AXES], p_q[DR_AXES];
    any_motion();
    assume(!calibrates(command.op));
    const bool line = command.op == DR_OP_TRIO_LINE || command.op == DR_OP_MPC_LINE;
    const bool homes = command.op == DR_OP_TRIO_HOME_TO, works = command.op == DR_OP_TRIO_WORK_TO;
    const bool hidden = (command.is & DR_IS_TARGETED) == 0;
    const uint8_t only = command.op == DR_OP_TRIO_X   ? DR_X
                         : command.op == DR_OP_TRIO_Y ? DR_Y
                         : command.op == DR_OP_TRIO_Z ? DR_Z
                                                      : DR_AXES;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        assume(request.steps[axis] <= stage.travel_steps[axis]); /* the judge looks first */
        from_q[axis] = (int32_t)(scene.start_steps[axis] * stage.quanta_per_step);
        to_q[axis] = (int32_t)(request.steps[axis] * stage.quanta_per_step);
        if (only != DR_AXES && axis != only)
            to_q[axis] = from_q[axis];
        if (hidden) /* a stored position: anywhere in the travel */
            to_q[axis] = anything_between(0, (int32_t)(stage.travel_steps[axis] * stage.quanta_per_step));
        if (hidden && command.op == DR_OP_MPC_HOME && has(&limits, DR_RIG_HOME_IS_ZERO))
            to_q[axis] = 0;
        /* a point of the way: between start and end on each axis */
        p_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
        assume(is_between(p_q[axis], from_q[axis], to_q[axis]));
    }
    const dr_path path = dr_judge_path(&limits, &scene, &command, &request);

    assert(is_in(to_q, &path.target_q));
    assert(path.stages == 1 || path.stages == 2);
    if (path.straight) {
        assert(line && !has(&limits, DR_RIG_PATHS_UNKNOWN));
        for (uint8_t axis = 0; axis < DR_AXES; axis++)
            assert(path.line.from_q[axis] == from_q[axis] && path.line.to_q[axis] == to_q[axis]);
    } else if (path.stages == 1) { /* whatever way between the ends */
        assert(is_in(p_q, &path.swept[0]));
    } else { /* home order: X and Z, then Y; work order: Y, then X and Z */
        assert(homes || works);
        const bool first = homes ? p_q[DR_Y] == from_q[DR_Y] : p_q[DR_X] == from_q[DR_X] && p_q[DR_Z] == from_q[DR_Z];
        const bool second = homes ? p_q[DR_X] == to_q[DR_X] && p_q[DR_Z] == to_q[DR_Z] : p_q[DR_Y] == to_q[DR_Y];
        if (first)
            assert(is_in(p_q, &path.swept[0]));
        if (second)
            assert(is_in(p_q, &path.swept[1]));
    }
    proved();
}

/* -- The travel box ----------------------------------------------------------------------------------------------------- */

/* Without judge_box_clear, judge_clear, judge_escape, judge_old_moves, judge_step, judge_time, judge_surface. */
void proof_box(void)
{
    any_motion();
    assume(!calibrates(command.op)); /* which is judged by obstacles alone */
    limits.obstacle_count = 0;       /* they only add reasons to refuse, and ways out: keep_out, escape */
    const dr_verdict verdict = dr_judge_motion(&limits, &scene, &command, &request);
    if (!is_allowed(verdict))
        return;
    const dr_path path = dr_judge_path(&limits, &scene, &command, &request);
    const dr_box *box_q = &limits.drives[scene.drive].box_q;
    assert(scene.drive == scene.chosen);
    assert(limits.kind == DR_MPC || (scene.angle_deg >= 1u && scene.angle_deg < DR_ANGLE_MAX_DEG));
    assert(!scene.frame_lost);
    if (is_in(path.line.from_q, box_q)) {
        assert(dr_box_is_in(&path.target_q, box_q));
        for (uint8_t i = 0; i < path.stages; i++)
            assert(dr_box_is_in(&path.swept[i], box_q));
    }
    proved();
}

/* -- Obstacles -------------------------------------------------------------------------------------------------------- */

/* A point of the way: between the ends, in the order of the axes where one is documented; on the line for 'S'. */
static int32_t p_q[DR_AXES];

/* Stand in for the geometry of lines and half-spaces, which geometry.c proves: what is not touched does not hold p. */
bool dr_segment_touches_box(const dr_segment *way, const dr_box *box)
{
    const bool touches = anything();
    (void)way;
    assume(touches || !is_in(p_q, box));
    return touches;
}

bool dr_segment_touches_half(const dr_segment *way, const dr_half *half) { return (void)way, (void)half, anything(); }
bool dr_box_touches_half(const dr_box *box, const dr_half *half) { return (void)box, (void)half, anything(); }

/* One obstacle, as one among many is looked at: the others can only add reasons to refuse. */
void proof_keep_out(void)
{
    any_motion();
    assume(!calibrates(command.op));
    dr_obstacle *o = &limits.obstacles[0];
    limits.obstacle_count = 1;
    o->drive = scene.drive;
    o->shape = DR_SHAPE_BOX;
    any_box(&o->box_q);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        assume(request.steps[axis] <= stage.travel_steps[axis]); /* the judge looks first */
    const dr_path path = dr_judge_path(&limits, &scene, &command, &request);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        p_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
    assume(is_in(p_q, &path.swept[0]) || (path.stages == 2 && is_in(p_q, &path.swept[1])));
    const dr_verdict verdict = judge_where(&limits, &scene, &command, &path, limits.margin_q);
    const dr_box start = point(path.line.from_q);
    if (!is_allowed(verdict) || box_hits(&start, o, limits.margin_q))
        return; /* refused; or the way out of this obstacle: leads_out */
    const dr_box grown = dr_box_grown(&o->box_q, limits.margin_q);
    assert(!is_in(p_q, &grown));
    proved();
}

/* -- The way out ---------------------------------------------------------------------------------------------------------- */

static int64_t outside(int32_t at, int32_t min, int32_t max)
{
    return at < min ? (int64_t)min - at : at > max ? (int64_t)at - max : 0;
}

void proof_escape(void)
{
    dr_drive_limits drive;
    dr_segment line;
    any_box(&drive.box_q);
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        line.from_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
        line.to_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
        assume(drive.box_q.min_q[axis] < drive.box_q.max_q[axis]);
    }
    if (!is_allowed(judge_escape_box(&drive, &line)))
        return;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const int32_t min = drive.box_q.min_q[axis], max = drive.box_q.max_q[axis];
        const int64_t was = outside(line.from_q[axis], min, max), is = outside(line.to_q[axis], min, max);
        assert(is == 0 || (is < was && (line.from_q[axis] < min) == (line.to_q[axis] < min)));
    }
    proved();
}
