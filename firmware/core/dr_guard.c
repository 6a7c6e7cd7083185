#include "dr_guard_rooms.h"

#define LINE_KEEPS_US MS(100) /* a frame of 14 bytes takes 2.4 ms; a USB converter's latency is 16 ms */
#define RATE_TOKENS 20u
#define EVENTS_MAX 16u /* at most so many in one call; a caller who comes that late is due again at once */

static void happen(dr_guard *g, uint8_t timer, dr_us now)
{
    switch (timer) {
    case DR_TIMER_FRAME:
        dr_g_drop_frame(g, now);
        break;
    case DR_TIMER_RESYNC:
        g->resync = false;
        dr_g_flush_dropped(g, now);
        break;
    case DR_TIMER_TASK:
        dr_g_task_due(g, now);
        break;
    case DR_TIMER_READ:
        dr_g_read_due(g, now);
        break;
    case DR_TIMER_SEND:
        g->out_ready = g->out_at == 0 && g->command.op == DR_OP_MPC_LINE ? LINE_HEAD : g->out_count;
        break;
    case DR_TIMER_PROOF:
        g->buzzer = true;
        g->cut = has_rig(g, DR_RIG_HAS_CUT);
        dr_g_latch(g, DR_FAULT_UNSTOPPABLE);
        break;
    case DR_TIMER_REPEAT:
        dr_g_repeat_due(g, now);
        break;
    case DR_TIMER_IDLE:
        if (g->task == TASK_NONE)
            dr_g_set_mode(g, MODE_DISARMED);
        else
            dr_g_start_idling(g, now);
        break;
    case DR_TIMER_RATE:
        if (++g->tokens < RATE_TOKENS)
            dr_g_set_timer(g, DR_TIMER_RATE, now + RATE_US);
        break;
    case DR_TIMER_NOISE:
        dr_g_flush_quarantined(g, now);
        g->noise = 0;
        break;
    case DR_TIMER_WIRING:
        g->wiring_alarm = true;
        dr_g_latch(g, DR_FAULT_STOP_WIRING);
        break;
    case DR_TIMER_RELEASE:
        g->stop_latched = false;
        break;
    default: /* DR_TIMER_STALE, DR_TIMER_LINE: it is enough that they do not run any more */
        break;
    }
}

static bool earliest(const dr_guard *g, uint8_t *timer)
{
    bool any = false;
    uint16_t left = g->running & ((1u << DR_TIMERS) - 1u); /* a flipped bit is no timer */
    for (uint8_t i = 0; left != 0; i++, left >>= 1)
        if ((left & 1u) != 0 && (!any || dr_us_before(g->at[i], g->at[*timer]))) {
            *timer = i;
            any = true;
        }
    return any;
}

static bool is_due(const dr_guard *g, dr_us now)
{
    uint8_t timer = 0;
    return earliest(g, &timer) && !dr_us_before(now, g->at[timer]);
}

/* What an event leaves to be done. */
static void settle(dr_guard *g, dr_us now)
{
    if (g->torn && g->device_present) /* found now: to the guard it is as unplugged */
        dr_g_link(g, now, g->host_open, g->plugged);
    dr_g_show_state(g, now);
}

/* Every call that may change something is between begin() and end(). */
static void begin(dr_guard *g, dr_us now)
{
    uint8_t timer = 0;
    dr_g_unseal(g);
    for (uint16_t i = 0; i < EVENTS_MAX && earliest(g, &timer) && !dr_us_before(now, g->at[timer]); i++) {
        const dr_us when = g->at[timer];
        clear_timer(g, timer);
        happen(g, timer, when);
        settle(g, when);
    }
}

/* Within a frame or a reply the next byte is near, and there is no time to seal between two on a small machine. */
static bool is_between_bytes(const dr_guard *g)
{
    return g->framer.have == 0 && g->out_at == g->out_ready && (g->read_phase != READ_SENT || g->read_have == 0) &&
           (g->task != TASK_PASS || g->reply_have == 0);
}

static void end(dr_guard *g, dr_us now)
{
    settle(g, now);
    if (g->stops_out == 0 && is_between_bytes(g)) /* nor while a ^C waits to be pulled */
        dr_g_seal(g);
}

bool dr_guard_is_mid_frame(const dr_guard *g) { return g->torn || is_leaving(g); }

bool dr_guard_due(const dr_guard *g, dr_us *when)
{
    uint8_t timer = 0;
    if (!earliest(g, &timer))
        return false;
    *when = g->at[timer];
    return true;
}

void dr_guard_push_host(dr_guard *g, dr_us now, const uint8_t *bytes, size_t count)
{
    begin(g, now);
    for (size_t i = 0; i < count; i++)
        dr_g_push_host_byte(g, now, bytes[i]);
    end(g, now);
}

void dr_guard_push_device(dr_guard *g, dr_us now, const uint8_t *bytes, size_t count)
{
    begin(g, now);
    for (size_t i = 0; i < count; i++)
        dr_g_push_device_byte(g, now, bytes[i]);
    if (g->task == TASK_MOVE) /* positions may be streaming */
        dr_g_show_state(g, now);
    else
        end(g, now);
}

/* The last byte of a frame, or of the guard's own query, is on the wire. */
static void frame_sent(dr_guard *g, dr_us now)
{
    if (g->read_phase == READ_SENT)
        g->asked_at = now;
    if (g->out_count > 1u)
        dr_g_set_timer(g, DR_TIMER_LINE, now + LINE_KEEPS_US);
    if (g->task == TASK_SEND) {
        g->task = TASK_MOVE;
        dr_g_set_timer(g, DR_TIMER_TASK, now + dr_g_longest_us(g));
    } else if (g->task == TASK_STOP && g->read_phase == READ_OFF) { /* the stop that had to wait for it begins now */
        dr_g_set_timer(g, DR_TIMER_TASK, now + QUIET_US);
        dr_g_set_timer(g, DR_TIMER_PROOF, now + PROOF_OF_REST_US);
        dr_g_set_timer(g, DR_TIMER_REPEAT, now + REPEAT_STOP_US);
    }
}

size_t dr_guard_pull_device(dr_guard *g, dr_us now, uint8_t *bytes, size_t room)
{
    size_t count = 0;
    const bool is_idle = g->stops_out == 0 && g->out_at == g->out_ready && !is_due(g, now);
    if (g->sealed && is_idle) /* asked often; mostly there is nothing */
        return 0;
    begin(g, now);
    while (count < room) { /* at most room times */
        if (g->stops_out > 0 && !is_leaving(g)) {
            g->stops_out--;
            bytes[count++] = DR_INTERRUPT;
        } else if (g->out_at < g->out_ready && g->task == TASK_SEND && dr_g_is_late(g, now)) {
            dr_g_come_late(g, now);
        } else if (g->out_at < g->out_ready) {
            bytes[count++] = g->out[g->out_at++];
            if (g->out_at == g->out_count)
                frame_sent(g, now);
            else if (g->out_at == g->out_ready)
                dr_g_set_timer(g, DR_TIMER_SEND, now + LINE_PAUSE_US);
        } else {
            break;
        }
    }
    if (is_idle)
        end(g, now);
    else
        settle(g, now); /* what was pulled goes to its line first, and a stop may be near: the next call seals */
    return count;
}

size_t dr_guard_pull_host(dr_guard *g, dr_us now, uint8_t *bytes, size_t room)
{
    size_t count = 0;
    if (g->to_host_count == 0 && !is_due(g, now))
        return 0;
    begin(g, now);
    while (count < room && g->to_host_count > 0) { /* at most room times */
        bytes[count++] = g->to_host[g->to_host_first];
        g->to_host_first = (uint8_t)((g->to_host_first + 1u) % DR_HOST_OUT_MAX);
        g->to_host_count--;
    }
    end(g, now);
    return count;
}

void dr_guard_input(dr_guard *g, dr_us now, dr_input what, bool on)
{
    begin(g, now);
    if (what < DR_INPUTS && is_on(g, what) != on) {
        g->inputs = (uint16_t)(g->inputs ^ 1u << what);
        dr_g_log_event(g, now, DR_EVENT_INPUT, (uint8_t)what, on);
        dr_g_input_changed(g, now, what, on);
    }
    end(g, now);
}

void dr_guard_link(dr_guard *g, dr_us now, bool host_open, bool device_present)
{
    begin(g, now);
    dr_g_link(g, now, host_open, device_present);
    end(g, now);
}

void dr_guard_host_line_error(dr_guard *g, dr_us now)
{
    begin(g, now);
    dr_g_drop_frame(g, now);
    end(g, now);
}

bool dr_guard_self_check(dr_guard *g, dr_us now)
{
    begin(g, now);
    if (g->limits != NULL && !dr_g_is_intact(g))
        dr_g_fall_back(g, now);
    end(g, now);
    return g->limits != NULL;
}

void dr_guard_get_status(const dr_guard *g, dr_guard_status *out)
{
    if (dr_g_is_damaged(g)) { /* the next call makes it so */
        *out = (dr_guard_status){.state = DR_GUARD_LOCKED, .fault = DR_FAULT_DAMAGED, .needs = DR_NEEDS_LIMITS};
        return;
    }
    *out = (dr_guard_status){.state = (uint8_t)dr_g_state_of(g), .fault = g->fault, .needs = dr_g_needs_of(g)};
    if (g->limits != NULL) {
        const bool outside = g->position_known && g->task == TASK_NONE &&
                             dr_judge_place(g->limits, g->scene.drive, g->scene.start_steps).reason != DR_REASON_NONE;
        if (outside && !is_on(g, DR_INPUT_ESCAPE))
            out->needs |= DR_NEEDS_INSIDE;
        if (g->unsteady)
            out->needs |= DR_NEEDS_STEADY;
        out->confirm_wanted = g->ambiguous || g->tip_changed || (g->limits->obstacle_count == 0 && !g->confirmed) ||
                              (g->cut && g->mode == MODE_DISARMED);
    }
    out->confirm_wanted = out->confirm_wanted || g->torn;
    out->in_tissue = is_on(g, DR_INPUT_IN_TISSUE);
    out->escape = is_on(g, DR_INPUT_ESCAPE);
    out->may_calibrate = is_on(g, DR_INPUT_MAY_CALIBRATE);
    out->buzzer = g->buzzer;
    out->cut = g->cut;
    out->position_known = g->position_known;
    out->drive = g->scene.drive;
    out->angle_deg = g->scene.angle_deg;
    copy_point(out->position_steps, g->scene.start_steps);
    out->last_op = g->last_op;
    out->last_refusal = g->last_refusal;
    out->forwarded = g->forwarded;
    out->refused = g->refused;
    out->dropped_bytes = g->dropped_bytes;
    out->quarantined_bytes = g->quarantined_bytes;
    out->log_missed = g->log.missed;
}

bool dr_guard_pull_log(dr_guard *g, dr_record *out)
{
    const bool was_sealed = g->sealed;
    if (g->log.count == 0)
        return false;
    dr_g_unseal(g);
    const bool taken = dr_log_take(&g->log, out);
    if (was_sealed)
        dr_g_seal(g);
    return taken;
}

void dr_guard_init(dr_guard *g, const dr_limits *limits, dr_record *ring, uint16_t size)
{
    dr_limits_problem problem;
    memset(g, 0, sizeof *g);
    dr_log_init(&g->log, ring, size);
    g->limits = limits != NULL && dr_limits_check(limits, &problem) ? limits : NULL;
    g->limits_crc = g->limits == NULL ? 0 : dr_limits_crc(limits);
    g->limits_memory_crc = g->limits == NULL ? 0 : dr_crc32c(0, (const uint8_t *)limits, sizeof *limits);
    g->tokens = RATE_TOKENS;
    g->last_refusal = dr_g_because(DR_REASON_NONE);
    dr_g_set_mode(g, MODE_LOCKED);
    g->fault = (uint8_t)(g->limits == NULL ? DR_FAULT_LIMITS : DR_FAULT_NO_DEVICE);
}

void dr_guard_start(dr_guard *g, dr_us now, dr_start how)
{
    dr_record record = dr_g_record_of(g, now, DR_EVENT_START, (uint8_t)how);
    record.position_steps[0] = g->limits_crc;
    record.position_steps[1] = g->limits == NULL ? 0 : g->limits->revision;
    dr_log_put(&g->log, &record);
    g->after_reset = how == DR_START_AFTER_RESET;
    g->torn = how == DR_START_MID_FRAME;
    if (g->torn && g->limits != NULL)
        g->fault = DR_FAULT_TORN;
}
