/* What goes out: to the host, to the controller; refusals. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

#define RAW_STOPS_MAX 15u  /* ^C that wait to leave */
#define UNANSWERED_MAX 11u /* an MPC-200 that has the head of an 'S' waits for 12 bytes [M table 9] */

/* What does not fit a host that does not read is lost, as on a wire; so is what comes when nobody is there. */
void dr_g_put_host(dr_guard *g, uint8_t byte)
{
    if (g->host_open && g->to_host_count < DR_HOST_OUT_MAX)
        g->to_host[((unsigned)g->to_host_first + g->to_host_count++) % DR_HOST_OUT_MAX] = byte;
}

void dr_g_flush_dropped(dr_guard *g, dr_us now)
{
    if (g->dropped_count > 0)
        dr_g_log_bytes(g, now, DR_EVENT_DROPPED, g->dropped_reason, DR_OP_NONE, g->dropped, g->dropped_count);
    g->dropped_count = 0;
}

void dr_g_drop(dr_guard *g, dr_us now, dr_reason reason, uint8_t byte)
{
    if (g->dropped_reason != reason)
        dr_g_flush_dropped(g, now);
    g->dropped_reason = (uint8_t)reason;
    if (g->dropped_count < DR_RECORD_TEXT)
        g->dropped[g->dropped_count] = byte;
    if (g->dropped_count < UINT8_MAX)
        g->dropped_count++;
    g->dropped_bytes++;
}

dr_verdict dr_g_because(dr_reason reason) { return (dr_verdict){(uint8_t)reason, DR_AXES, DR_NO_ITEM, 0, 0}; }

void dr_g_refuse(dr_guard *g, dr_us now, const dr_command *command, const uint8_t *frame, dr_verdict verdict)
{
    dr_record record = dr_g_record_of(g, now, DR_EVENT_REFUSED, verdict.reason);
    record.op = command->op;
    record.axis = verdict.axis;
    record.item = verdict.item;
    record.count = (uint8_t)(1u + command->args);
    memcpy(record.bytes, frame, record.count);
    copy_point(record.position_steps, g->scene.start_steps);
    dr_log_put(&g->log, &record);
    g->refused++;
    g->last_op = command->op;
    g->last_refusal = verdict;
    if ((command->is & DR_IS_MOTION) != 0 && verdict.reason != DR_REASON_BUSY &&
        verdict.reason != DR_REASON_CANCELLED && g->limits->refusal == DR_REFUSE_E)
        dr_g_put_host(g, DR_NO_SUCH_DRIVE);
}

void dr_g_refuse_pending(dr_guard *g, dr_us now, dr_verdict verdict)
{
    if (g->counted)
        g->forwarded--;
    g->counted = false;
    dr_g_refuse(g, now, &g->command, g->frame, verdict);
}

void dr_g_put_out(dr_guard *g, const uint8_t *bytes, uint8_t count, uint8_t ready)
{
    memcpy(g->out, bytes, count);
    g->out_at = 0;
    g->out_count = count;
    g->out_ready = ready;
}

/* What nobody has begun to pull was never sent. What has been begun must be finished, its pause included: half a frame
 * would swallow the stop that follows. */
void dr_g_withdraw(dr_guard *g)
{
    if (is_leaving(g))
        return;
    g->out_at = g->out_count = g->out_ready = 0;
    clear_timer(g, DR_TIMER_SEND);
}

/* One byte more? An MPC-200 that is silent from the start may hold the head of an 'S', from a guard that lost its power
 * within the pause: it must not get the rest, whoever asks for a ^C. Torn: end() does what follows. */
static bool may_send(dr_guard *g)
{
    if (g->proved || g->limits == NULL || kind_of(g) != DR_MPC)
        return true;
    if (g->unanswered < UNANSWERED_MAX) {
        g->unanswered++;
        return true;
    }
    g->torn = true;
    g->stops_out = 0; /* of a host that asked before the cable was in */
    return false;
}

void dr_g_send_stop(dr_guard *g, dr_us now, dr_stop_cause cause)
{
    if (g->torn || !may_send(g)) /* it would not be heard as ^C, and might complete a motion */
        return;
    if (g->stops_out < RAW_STOPS_MAX)
        g->stops_out++;
    dr_g_log_event(g, now, DR_EVENT_STOP, (uint8_t)cause, DR_NO_ITEM);
}

dr_command dr_g_position_query(const dr_guard *g)
{
    dr_command query = {0, 0, 0, 0, 0, 0, 0};
    (void)dr_command_for(kind_of(g), g->limits->firmware,
                         kind_of(g) == DR_TRIO ? DR_OP_TRIO_POSITION : DR_OP_MPC_POSITION, &query);
    return query;
}

void dr_g_start_reading(dr_guard *g, dr_us now, dr_us after_us)
{
    g->read_phase = READ_WAITS;
    g->read_again = false;
    dr_g_set_timer(g, DR_TIMER_READ, now + after_us);
}

void dr_g_stop_reading(dr_guard *g)
{
    g->read_phase = READ_OFF;
    clear_timer(g, DR_TIMER_READ);
}

void dr_g_send_query(dr_guard *g, dr_us now)
{
    const dr_command query = dr_g_position_query(g);
    if (is_leaving(g)) { /* a frame that nobody pulls on */
        dr_g_set_timer(g, DR_TIMER_READ, now + FRAME_GAP_US);
        return;
    }
    if (!may_send(g))
        return;
    dr_g_put_out(g, &query.code, 1, 1);
    g->read_phase = READ_SENT;
    g->read_have = 0;
    dr_g_set_timer(g, DR_TIMER_READ, now + REPLY_TIMEOUT_US);
}

void dr_g_end_task(dr_guard *g)
{
    dr_g_stop_reading(g);
    clear_timer(g, DR_TIMER_TASK);
    clear_timer(g, DR_TIMER_PROOF);
    clear_timer(g, DR_TIMER_REPEAT);
    g->task = TASK_NONE;
    g->has_first = false;
    g->stop_waits = false;
    g->stream_left = 0;
}
