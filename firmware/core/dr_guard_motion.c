/* One motion: from the reading before it to the proof of its end. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

#define SMALL_MOVE_US MS(100) /* 15 microsteps at the slowest speed take 15 ms */
#define SMALL_MOVE_STEPS 16u  /* an MPC-200 ignores shorter moves, without a CR ([P], small-move-silent) */
#define CALIBRATION_US MS(60000)
#define FRAME_US 2500u /* 14 bytes of a TRIO take 2,431 us on the line */
#define LATE_MAX 20u

/* How long the motion may last at most: one and a half times its way at the slowest plausible speed, and 2 s. */
dr_us dr_g_longest_us(const dr_guard *g)
{
    if (g->small)
        return SMALL_MOVE_US;
    if (is_calibration(g->command.op))
        return CALIBRATION_US;
    const bool line = g->command.op == DR_OP_TRIO_LINE || g->command.op == DR_OP_MPC_LINE;
    uint64_t way_q = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const int32_t down = g->path.line.from_q[axis] - g->path.target_q.min_q[axis];
        const int32_t up = g->path.target_q.max_q[axis] - g->path.line.from_q[axis];
        way_q += (uint64_t)(up > down ? up : down);
    }
    const uint64_t speed = dr_judge_speed(g->limits, g->path_drive, line ? g->request.value : DR_SPEED_FULL, false);
    const uint64_t lasts_us = way_q * 3u * (DR_US_PER_S / 2u) / speed + MS(2000);
    /* The longest: 87.5 mm in all (MP-865) at 81 um/s, 27 minutes; instants are told apart up to 35. */
    return (dr_us)lasts_us;
}

static bool is_small(const dr_guard *g)
{
    if (kind_of(g) == DR_TRIO || (g->command.is & DR_IS_TARGETED) == 0)
        return false;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (dr_g_apart(g->request.steps[axis], g->scene.start_steps[axis]) >= SMALL_MOVE_STEPS)
            return false;
    return true;
}

static void read_again(dr_guard *g, dr_us now)
{
    if (++g->late > LATE_MAX) {
        dr_g_end_task(g);
        dr_g_refuse_pending(g, now, dr_g_because(DR_REASON_NO_POSITION));
        return;
    }
    g->task = TASK_CHECK;
    dr_g_start_reading(g, now, 0);
}

void dr_g_read_for_motion(dr_guard *g, dr_us now, const dr_reply *reply)
{
    const bool jumped = dr_g_has_jumped(g, now, reply);
    const dr_news news = dr_g_news(g, reply);
    dr_g_know_place(g, now, reply);
    if (jumped) {
        dr_g_refuse_pending(g, now, dr_g_because(DR_REASON_NO_POSITION));
        dr_g_fail(g, now, DR_FAULT_POSITION_JUMP);
        return;
    }
    if (news == NEWS_OTHER || (news == NEWS_MOVED && !g->doubted)) {
        g->doubted = true;
        read_again(g, now);
        return;
    }
    const dr_us took = now - g->asked_at;
    g->scene.waited_us = took > DR_ANSWER_US ? took - DR_ANSWER_US : 0;
    if (g->scene.waited_us > DR_WAITED_MAX_US && !has_rig(g, DR_RIG_KNOBS_LOCKED)) {
        read_again(g, now);
        return;
    }
    g->scene.may_calibrate = is_on(g, DR_INPUT_MAY_CALIBRATE);
    g->scene.in_tissue = is_on(g, DR_INPUT_IN_TISSUE);
    const dr_verdict verdict = dr_judge_motion(g->limits, &g->scene, &g->command, &g->request);
    if (verdict.reason != DR_REASON_NONE) {
        dr_g_end_task(g);
        dr_g_refuse_pending(g, now, verdict);
        return;
    }
    g->path = dr_judge_path(g->limits, &g->scene, &g->command, &g->request);
    g->path_drive = g->scene.drive;
    g->small = is_small(g);
    g->end_told = false;
    const bool again = g->counted;
    if (!again) { /* one motion, however often it is read for */
        g->counted = true;
        g->forwarded++;
        g->tokens--;
        if (!is_running(g, DR_TIMER_RATE))
            dr_g_set_timer(g, DR_TIMER_RATE, now + RATE_US);
    }
    const uint8_t length = (uint8_t)(1u + g->command.args);
    dr_g_put_out(g, g->frame, length, 0);
    dr_g_set_timer(g, DR_TIMER_SEND, now + FRAME_GAP_US);
    dr_g_start_idling(g, now);
    g->task = TASK_SEND;
    dr_g_log_bytes(g, now, DR_EVENT_ALLOWED, again, g->command.op, g->frame, length);
}

/* How much longer than the margin reckons with a knob has had since the reading, if the rest of the frame leaves now. */
static dr_us beyond_window(const dr_guard *g, dr_us now)
{
    const bool line = g->command.op == DR_OP_MPC_LINE;
    const dr_us until_it_begins = FRAME_US + (line && g->out_at == 0 ? LINE_PAUSE_US : 0);
    const dr_us age = now - g->asked_at, window = line ? DR_WINDOW_MPC_LINE_US : DR_WINDOW_US;
    return age > window - until_it_begins ? age - (window - until_it_begins) : 0;
}

/* Who comes later, a suspended program or a slow machine, would let it begin somewhere else. */
bool dr_g_is_late(const dr_guard *g, dr_us now)
{
    const bool about_to_begin = g->out_at == 0 || (g->command.op == DR_OP_MPC_LINE && g->out_at == LINE_HEAD);
    return about_to_begin && !has_rig(g, DR_RIG_KNOBS_LOCKED) && beyond_window(g, now) > g->scene.waited_us;
}

/* What has begun cannot be taken back, nor be left as it is. It goes on if it may from wherever a knob can have moved the tip
 * by now; if not, it is finished and ^C follows at its heels. */
void dr_g_come_late(dr_guard *g, dr_us now)
{
    if (g->out_at == 0) {
        dr_g_withdraw(g);
        dr_g_end_task(g);
        read_again(g, now);
        return;
    }
    g->scene.waited_us = beyond_window(g, now);
    if (g->scene.waited_us > DR_WAITED_MAX_US ||
        dr_judge_motion(g->limits, &g->scene, &g->command, &g->request).reason != DR_REASON_NONE)
        dr_g_begin_stop(g, now, DR_STOP_LATE, DR_FAULT_NONE, 0);
}

/* Where the motion may rightly end: at its target; without Y where homing leaves it out; where it began, if it was so short
 * that the controller ignores it. */
static bool is_at_an_end(const dr_guard *g, const dr_reply *reply)
{
    dr_box without_y = g->path.target_q;
    without_y.min_q[DR_Y] = without_y.max_q[DR_Y] = g->path.line.from_q[DR_Y];
    const dr_segment stays = {{g->path.line.from_q[DR_X], g->path.line.from_q[DR_Y], g->path.line.from_q[DR_Z]},
                              {g->path.line.from_q[DR_X], g->path.line.from_q[DR_Y], g->path.line.from_q[DR_Z]}};
    const dr_box start = dr_box_around(&stays);
    const bool homes =
        g->command.op == DR_OP_TRIO_HOME || g->command.op == DR_OP_TRIO_HOME_TO || g->command.op == DR_OP_MPC_HOME;
    return dr_g_is_at(g, reply, &g->path.target_q) ||
           (homes && has_rig(g, (uint16_t)(DR_RIG_Y_LOCKED_OUT << g->path_drive)) &&
            dr_g_is_at(g, reply, &without_y)) ||
           (g->small && dr_g_is_at(g, reply, &start));
}

void dr_g_read_for_end(dr_guard *g, dr_us now, const dr_reply *reply)
{
    bool agree = true;
    if (is_at_an_end(g, reply)) {
        dr_g_know_place(g, now, reply);
        dr_g_end_task(g);
        for (uint8_t drive = 0; drive < DR_PORTS; drive++) /* what had no CR may have been ignored */
            g->scene.old[drive].is_open = g->scene.old[drive].is_open && !g->end_told;
        if (is_calibration(g->command.op))
            g->scene.frame_lost = false;
        if (g->end_told)
            dr_g_put_host(g, DR_CR);
        dr_record record = dr_g_record_of(g, now, DR_EVENT_ENDED, g->command.op);
        record.item = g->path_drive;
        record.count = g->end_told;
        record.bytes[0] = DR_CR;
        copy_point(record.position_steps, reply->steps);
        dr_log_put(&g->log, &record);
        return;
    }
    if (!dr_g_has_two(g, now, reply, &agree))
        return;
    dr_g_know_place(g, now, reply);
    if (!agree) {
        dr_g_begin_stop(g, now, DR_STOP_EARLY_CR, DR_FAULT_EARLY_CR, 0);
        dr_g_latch(g, DR_FAULT_EARLY_CR);
        return;
    }
    const dr_old_move *old = &g->scene.old[g->path_drive];
    const bool resumed = old->is_open && dr_g_is_at(g, reply, &old->target_q);
    dr_g_keep_old_target(g);
    dr_g_end_task(g);
    dr_g_latch(g, resumed ? DR_FAULT_RESUMED_OLD_MOVE : DR_FAULT_WRONG_END);
}
