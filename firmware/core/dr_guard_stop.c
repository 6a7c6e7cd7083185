/* Faults, stops, and the proof of rest. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

#define PROOF_RETRY_US MS(500) /* once that has failed */
#define STOPS_MAX 3u
#define HOST_STOPS_MAX 15u /* known clients send as many running */

void dr_g_latch(dr_guard *g, dr_fault fault)
{
    g->fault = (uint8_t)fault;
    if (g->mode != MODE_LOCKED)
        dr_g_set_mode(g, MODE_FAULT);
}

void dr_g_lock(dr_guard *g, dr_fault fault)
{
    g->fault = (uint8_t)fault;
    g->proved = g->ambiguous = false;
    dr_g_set_mode(g, MODE_LOCKED);
}

/* The target of a motion that was broken off stays possible until a later motion has ended at its own. */
void dr_g_keep_old_target(dr_guard *g)
{
    dr_old_move *old = &g->scene.old[g->path_drive];
    const dr_box before = old->target_q;
    copy_point(old->at_steps, g->scene.start_steps);
    if (!old->is_open)
        old->target_q = g->path.target_q;
    for (uint8_t axis = 0; old->is_open && axis < DR_AXES; axis++) {
        if (g->path.target_q.min_q[axis] < before.min_q[axis])
            old->target_q.min_q[axis] = g->path.target_q.min_q[axis];
        if (g->path.target_q.max_q[axis] > before.max_q[axis])
            old->target_q.max_q[axis] = g->path.target_q.max_q[axis];
    }
    old->is_open = true;
}

/* A motion was broken off and nobody can tell where. */
void dr_g_break_off_unproved(dr_guard *g)
{
    dr_g_keep_old_target(g);
    if (is_calibration(g->command.op))
        g->scene.frame_lost = true;
}

/* Sends ^C, drops whatever is pending, and proves rest. */
void dr_g_begin_stop(dr_guard *g, dr_us now, dr_stop_cause cause, dr_fault fault, uint8_t owed)
{
    const bool begun = g->task == TASK_MOVE || g->task == TASK_VERIFY || (g->task == TASK_SEND && is_leaving(g));
    const bool waits = g->task == TASK_MOVE && !is_stoppable(g) && cause != DR_STOP_DEADLINE;
    const bool asked = g->out_at > 0 || g->out_count == 0; /* the query or frame has left, at least in part */
    const uint8_t read_left = g->read_phase == READ_SENT ? (uint8_t)(DR_REPLY_MAX - g->read_have) : 0;
    const uint8_t reply_left = g->task == TASK_PASS ? (uint8_t)(g->reply_want - g->reply_have) : 0;
    const dr_us ends = g->at[DR_TIMER_TASK];
    if (g->task == TASK_CHECK || (g->task == TASK_SEND && !begun))
        dr_g_refuse_pending(g, now, dr_g_because(DR_REASON_CANCELLED));
    dr_g_end_task(g);
    dr_g_withdraw(g);
    g->task = TASK_STOP;
    g->stop_owed = owed;
    g->stop_crs = 0;
    g->stop_sent = 1;
    g->stop_skip = asked ? (uint8_t)(read_left + reply_left) : 0;
    g->stop_fault = (uint8_t)fault;
    g->stop_broke_off = begun;
    g->stop_waits = waits;
    dr_g_send_stop(g, now, cause);
    if (waits) { /* nothing more can be done; its own CR tells the end */
        g->buzzer = true;
        g->cut = has_rig(g, DR_RIG_HAS_CUT);
        dr_g_latch(g, DR_FAULT_UNSTOPPABLE);
        dr_g_set_timer(g, DR_TIMER_TASK, ends);
        return;
    }
    dr_g_set_timer(g, DR_TIMER_TASK, now + QUIET_US);
    dr_g_set_timer(g, DR_TIMER_PROOF, now + PROOF_OF_REST_US);
    dr_g_set_timer(g, DR_TIMER_REPEAT, now + REPEAT_STOP_US);
}

static bool is_busy_with_motion(const dr_guard *g)
{
    return g->task == TASK_CHECK || g->task == TASK_SEND || g->task == TASK_MOVE || g->task == TASK_VERIFY;
}

/* Breaks off what can be: for a lost host, the key, a changed tip. A motion that ^C cannot stop goes on to its end. */
static void break_off(dr_guard *g, dr_us now, dr_stop_cause cause)
{
    const bool goes_on = g->task == TASK_MOVE && !is_stoppable(g);
    if (g->task == TASK_ARM || (is_busy_with_motion(g) && !goes_on))
        dr_g_begin_stop(g, now, cause, DR_FAULT_NONE, 0);
}

void dr_g_disarm(dr_guard *g, dr_us now, dr_stop_cause cause)
{
    break_off(g, now, cause);
    if (g->mode == MODE_ARMED)
        dr_g_set_mode(g, MODE_DISARMED);
}

/* Nothing that depends on the limits may be done any more: ^C only. */
void dr_g_fall_back(dr_guard *g, dr_us now)
{
    if (g->task != TASK_NONE)
        dr_g_send_stop(g, now, DR_STOP_AGAIN);
    dr_g_end_task(g);
    dr_g_withdraw(g);
    dr_g_lock(g, DR_FAULT_DAMAGED);
    g->limits = NULL;
    g->running =
        (uint16_t)(g->running & (is_leaving(g) ? 1u << DR_TIMER_SEND : 0u)); /* half a frame would swallow the ^C */
}

bool dr_g_is_intact(const dr_guard *g)
{
    return dr_crc32c(0, (const uint8_t *)g->limits, sizeof *g->limits) == g->limits_memory_crc;
}

/* A fault. While something may move: it is stopped first. */
void dr_g_fail(dr_guard *g, dr_us now, dr_fault fault)
{
    if (g->task == TASK_MOVE || g->task == TASK_VERIFY || g->task == TASK_SEND) {
        dr_g_begin_stop(g, now, fault == DR_FAULT_DEVICE_NOISE ? DR_STOP_NOISE : DR_STOP_DEADLINE, fault, 0);
    } else {
        if (g->task == TASK_STOP && g->stop_broke_off)
            dr_g_break_off_unproved(g);
        dr_g_end_task(g);
        dr_g_withdraw(g);
    }
    dr_g_latch(g, fault);
}

static void rest_proved(dr_guard *g, dr_us now, const dr_reply *reply)
{
    const uint8_t crs = g->stop_crs < g->stop_owed ? g->stop_crs : g->stop_owed;
    const dr_fault fault = (dr_fault)g->stop_fault;
    dr_g_know_place(g, now, reply);
    dr_g_end_task(g);
    g->buzzer = false;
    if (g->stop_broke_off && !dr_g_is_at(g, reply, &g->path.target_q))
        dr_g_keep_old_target(g);
    if (g->stop_broke_off && is_calibration(g->command.op)) {
        g->scene.frame_lost = true;
        dr_g_latch(g, DR_FAULT_FRAME_LOST);
    } else if (fault != DR_FAULT_NONE) {
        dr_g_latch(g, fault);
    }
    for (uint8_t i = 0; i < crs; i++)
        dr_g_put_host(g, DR_CR);
    if (g->mode == MODE_LOCKED && !g->other_firmware)
        dr_g_start_proof(g, now);
}

void dr_g_read_for_rest(dr_guard *g, dr_us now, const dr_reply *reply)
{
    bool agree;
    if (!dr_g_has_two(g, now, reply, &agree))
        return;
    if (agree) {
        rest_proved(g, now, reply);
        return;
    }
    if (g->stop_sent < STOPS_MAX) {
        g->stop_sent++;
        dr_g_send_stop(g, now, DR_STOP_AGAIN);
    }
    dr_g_start_reading(g, now, is_running(g, DR_TIMER_PROOF) ? REST_APART_US : PROOF_RETRY_US);
}

void dr_g_repeat_due(dr_guard *g, dr_us now)
{
    g->stop_sent++;
    dr_g_send_stop(g, now, DR_STOP_AGAIN);
    dr_g_set_timer(g, DR_TIMER_TASK, now + QUIET_US);
    if (g->stop_sent < STOPS_MAX)
        dr_g_set_timer(g, DR_TIMER_REPEAT, now + REPEAT_STOP_US);
}

/* 0x03 from the host while something is under way. */
void dr_g_stop_by_host(dr_guard *g, dr_us now)
{
    if (g->task == TASK_STOP && g->stop_owed >= HOST_STOPS_MAX && is_running(g, DR_TIMER_PROOF)) {
        dr_g_drop(g, now, DR_REASON_BUSY, DR_INTERRUPT); /* their answers would keep rest from being proved */
    } else if (g->task == TASK_STOP) {
        if (g->stop_owed < UINT8_MAX)
            g->stop_owed++;
        dr_g_send_stop(g, now, DR_STOP_HOST);
    } else if (g->task == TASK_MOVE && !is_stoppable(g)) {
        dr_g_send_stop(g, now, DR_STOP_HOST); /* it will not be heard, and the move's own CR will tell the end */
    } else {
        dr_g_begin_stop(g, now, DR_STOP_HOST, DR_FAULT_NONE, 1);
    }
}
