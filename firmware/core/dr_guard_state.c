/* The state, timers, and the log of both. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

void dr_g_set_timer(dr_guard *g, uint8_t timer, dr_us when)
{
    g->at[timer] = when;
    g->running = (uint16_t)(g->running | 1u << timer);
}

void dr_g_set_mode(dr_guard *g, dr_mode mode)
{
    g->mode = (uint8_t)mode;
    if (mode != MODE_ARMED)
        clear_timer(g, DR_TIMER_IDLE);
}

void dr_g_start_idling(dr_guard *g, dr_us now)
{
    dr_g_set_timer(g, DR_TIMER_IDLE, now + g->limits->arm_idle_s * DR_US_PER_S);
}

dr_guard_state dr_g_state_of(const dr_guard *g)
{
    switch (g->task) {
    case TASK_STOP:
        return DR_GUARD_STOPPING;
    case TASK_CHECK:
        return DR_GUARD_CHECKING;
    case TASK_SEND:
        if (g->out_at == 0)
            return DR_GUARD_CHECKING;
        return is_stoppable(g) ? DR_GUARD_MOVING_S : DR_GUARD_MOVING_U;
    case TASK_MOVE:
    case TASK_VERIFY:
        return is_stoppable(g) ? DR_GUARD_MOVING_S : DR_GUARD_MOVING_U;
    default:
        break;
    }
    switch (g->mode) {
    case MODE_DISARMED:
        return DR_GUARD_DISARMED;
    case MODE_ARMED:
        return DR_GUARD_IDLE;
    case MODE_FAULT:
        return DR_GUARD_FAULT;
    case MODE_STOPPED:
        return DR_GUARD_STOPPED;
    default:
        return DR_GUARD_LOCKED;
    }
}

dr_record dr_g_record_of(const dr_guard *g, dr_us now, dr_event event, uint8_t code)
{
    dr_record record = {
        .when = now, .event = (uint8_t)event, .before = g->shown_state, .after = (uint8_t)dr_g_state_of(g)};
    record.code = code;
    record.axis = DR_AXES;
    record.item = DR_NO_ITEM;
    return record;
}

void dr_g_log_bytes(dr_guard *g, dr_us now, dr_event event, uint8_t code, uint8_t op, const uint8_t *bytes,
                    uint8_t count)
{
    dr_record record = dr_g_record_of(g, now, event, code);
    record.op = op;
    record.count = count;
    memcpy(record.bytes, bytes, count < DR_RECORD_TEXT ? count : DR_RECORD_TEXT);
    copy_point(record.position_steps, g->scene.start_steps);
    dr_log_put(&g->log, &record);
}

void dr_g_log_event(dr_guard *g, dr_us now, dr_event event, uint8_t code, uint8_t item)
{
    dr_record record = dr_g_record_of(g, now, event, code);
    record.item = item;
    copy_point(record.position_steps, g->scene.start_steps);
    dr_log_put(&g->log, &record);
}

/* Every call ends with it: a change of the state is a record of its own. */
void dr_g_show_state(dr_guard *g, dr_us now)
{
    if (dr_g_state_of(g) == (dr_guard_state)g->shown_state)
        return;
    dr_g_log_event(g, now, DR_EVENT_STATE, g->fault, DR_NO_ITEM);
    g->shown_state = (uint8_t)dr_g_state_of(g);
}
