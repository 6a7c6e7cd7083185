/* Who the controller is, and where its tip is. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

#define STALE_US MS(20000) /* the longest travel, by knob */
#define JUMP_Q (20 * (int32_t)DR_QUANTA_PER_UM)
#define READY_US MS(1000) /* "ready about one second after power-on" [O] */

uint32_t dr_g_apart(uint32_t a, uint32_t b) { return a < b ? b - a : a - b; }

static bool same_place(const uint32_t a[DR_AXES], const uint32_t b[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (dr_g_apart(a[axis], b[axis]) > DR_REST_STEPS)
            return false;
    return true;
}

static bool is_within_travel(const dr_guard *g, const dr_reply *reply)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        uint64_t longest = 0;
        uint8_t quanta = 1;
        for (uint8_t drive = 0; drive < DR_PORTS; drive++) {
            dr_stage stage;
            const bool meant = kind_of(g) == DR_TRIO || drive + 1u == reply->value ||
                               g->limits->drives[(reply->value - 1u) % DR_PORTS].stage == DR_STAGE_NONE;
            if (!meant || !dr_stage_get((dr_stage_id)g->limits->drives[drive].stage, &stage))
                continue;
            if ((uint64_t)stage.travel_steps[axis] * stage.quanta_per_step > longest) {
                longest = (uint64_t)stage.travel_steps[axis] * stage.quanta_per_step;
                quanta = stage.quanta_per_step;
            }
        }
        if ((uint64_t)reply->steps[axis] * quanta > longest + DR_PLAUSIBLE_BEYOND_Q)
            return false;
    }
    return true;
}

bool dr_g_is_plausible(const dr_guard *g, const uint8_t *bytes, dr_reply *reply)
{
    const dr_command query = dr_g_position_query(g);
    return dr_wire_get_reply(&query, bytes, DR_REPLY_MAX, reply) && is_within_travel(g, reply);
}

/* A TRIO's reply ends with the angle, an MPC-200's with the highest byte of Z, which is 0 for every travel: only a TRIO at
 * 0 degrees can look like an MPC-200. */
static bool looks_like_mpc(const dr_guard *g)
{
    dr_command query;
    dr_reply reply;
    (void)dr_command_for(DR_MPC, DR_FIRMWARE_MPC, DR_OP_MPC_POSITION, &query);
    return dr_wire_get_reply(&query, g->read, DR_REPLY_MAX, &reply) && reply.steps[DR_X] < (UINT32_C(1) << 24) &&
           reply.steps[DR_Y] < (UINT32_C(1) << 24) && reply.steps[DR_Z] < (UINT32_C(1) << 24);
}

void dr_g_know_place(dr_guard *g, dr_us now, const dr_reply *reply)
{
    copy_point(g->scene.start_steps, reply->steps);
    if (kind_of(g) == DR_TRIO)
        g->scene.angle_deg = reply->value;
    else
        g->scene.drive = (uint8_t)(reply->value - 1u);
    g->position_known = true;
    g->position_at = now;
    dr_g_set_timer(g, DR_TIMER_STALE, now + STALE_US);
}

/* Where a controller begins that has lost its power and its count with it, wherever the tip is [S]. */
static bool is_origin(const dr_reply *reply)
{
    return reply->steps[DR_X] == 0 && reply->steps[DR_Y] == 0 && reply->steps[DR_Z] == 0;
}

/* Has the tip moved farther than a knob can have moved it since, or the count without the tip? */
bool dr_g_has_jumped(const dr_guard *g, dr_us now, const dr_reply *reply)
{
    const uint8_t drive = kind_of(g) == DR_TRIO ? 0 : (uint8_t)(reply->value - 1u);
    dr_stage stage;
    if (drive != g->scene.drive || !dr_stage_get((dr_stage_id)g->limits->drives[drive].stage, &stage))
        return false;
    if (is_origin(reply) && !same_place(g->scene.start_steps, reply->steps))
        return true;
    const bool locked = has_rig(g, DR_RIG_KNOBS_LOCKED);
    if (!locked && !is_running(g, DR_TIMER_STALE))
        return false;
    const uint64_t knob_q = locked ? 0 : (uint64_t)g->limits->knob_q_per_s * (now - g->position_at) / DR_US_PER_S;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if ((uint64_t)dr_g_apart(reply->steps[axis], g->scene.start_steps[axis]) * stage.quanta_per_step >
            knob_q + (uint64_t)JUMP_Q)
            return true;
    return false;
}

/* A reading has no check sum: what is news may be a knob, or a bit that was flipped on the line. It is believed when the next
 * reading says the same, or as much as a knob can have changed in between. */
dr_news dr_g_news(const dr_guard *g, const dr_reply *reply)
{
    if (reply->value != (kind_of(g) == DR_TRIO ? g->scene.angle_deg : g->scene.drive + 1u))
        return NEWS_OTHER;
    return same_place(g->scene.start_steps, reply->steps) ? NEWS_NONE : NEWS_MOVED;
}

/* The first of two readings is kept, the second compared. False: it was the first, a second was asked for. */
bool dr_g_has_two(dr_guard *g, dr_us now, const dr_reply *reply, bool *agree)
{
    if (!g->has_first) {
        g->has_first = true;
        copy_point(g->first_steps, reply->steps);
        dr_g_start_reading(g, now, REST_APART_US);
        return false;
    }
    *agree = same_place(g->first_steps, reply->steps);
    copy_point(g->first_steps, reply->steps);
    return true;
}

bool dr_g_is_at(const dr_guard *g, const dr_reply *reply, const dr_box *target_q)
{
    dr_stage stage;
    if (kind_of(g) == DR_MPC && reply->value != g->path_drive + 1u)
        return false; /* somebody has chosen another drive by hand */
    (void)dr_stage_get((dr_stage_id)g->limits->drives[g->path_drive].stage, &stage);
    const int64_t slack_q = (int64_t)DR_REST_STEPS * stage.quanta_per_step;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const int64_t at_q = (int64_t)reply->steps[axis] * stage.quanta_per_step;
        if (at_q < target_q->min_q[axis] - slack_q || at_q > target_q->max_q[axis] + slack_q)
            return false;
    }
    return true;
}

void dr_g_start_proof(dr_guard *g, dr_us now)
{
    g->proved = g->ambiguous = false;
    g->task = TASK_PROVE;
    g->attempts = PROVE_ATTEMPTS;
    dr_g_set_timer(g, DR_TIMER_TASK, now + READY_US);
}

void dr_g_identity_proved(dr_guard *g)
{
    g->proved = true;
    g->ambiguous = false;
    dr_g_set_mode(g, g->stop_latched ? MODE_STOPPED : MODE_DISARMED);
}

void dr_g_read_for_proof(dr_guard *g, dr_us now, const dr_reply *reply)
{
    dr_g_know_place(g, now, reply);
    dr_g_end_task(g);
    g->fault = DR_FAULT_NONE;
    if (kind_of(g) == DR_TRIO && looks_like_mpc(g))
        g->ambiguous = true;
    else
        dr_g_identity_proved(g);
}
