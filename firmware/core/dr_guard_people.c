/* What a person does and what cables do: key, ARM, STOP, CONFIRM. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

#define WIRING_US MS(50)
#define RELEASE_US MS(20)

/* -- Cables ---------------------------------------------------------------------------------------------------------- */

static void lose_device(dr_guard *g)
{
    const bool moved = g->task == TASK_MOVE || g->task == TASK_VERIFY || (g->task == TASK_SEND && is_leaving(g)) ||
                       (g->task == TASK_STOP && g->stop_broke_off);
    if (moved)
        dr_g_break_off_unproved(g);
    dr_g_end_task(g);
    g->torn = g->torn || is_leaving(g) || is_running(g, DR_TIMER_LINE);
    g->out_at = g->out_count = g->out_ready = g->stops_out = 0;
    clear_timer(g, DR_TIMER_SEND);
    g->position_known = false;
    dr_g_lock(g, g->torn ? DR_FAULT_TORN : DR_FAULT_NO_DEVICE);
}

static void lose_host(dr_guard *g, dr_us now)
{
    const bool at_rest = g->task == TASK_NONE || g->task == TASK_PASS;
    dr_framer_reset(&g->framer);
    clear_timer(g, DR_TIMER_FRAME);
    g->to_host_count = 0;
    g->host_chose = false;
    if (at_rest && has_rig(g, DR_RIG_STAYS_ARMED))
        return;
    const bool begun = g->task != TASK_CHECK && (g->task != TASK_SEND || g->out_at > 0);
    if (g->limits->host_loss == DR_HOST_LOSS_FINISH && begun && g->mode == MODE_ARMED)
        dr_g_set_mode(g, MODE_DISARMED);
    else
        dr_g_disarm(g, now, DR_STOP_HOST_LOST);
}

void dr_g_link(dr_guard *g, dr_us now, bool host_open, bool device_present)
{
    const bool present = device_present && !g->torn;
    const bool host_lost = g->host_open && !host_open, device_lost = g->device_present && !present;
    const bool device_came = !g->device_present && present;
    g->plugged = device_present;
    if (g->host_open == host_open && g->device_present == present)
        return;
    g->host_open = host_open;
    g->device_present = present;
    dr_g_log_event(g, now, DR_EVENT_LINK, (uint8_t)((host_open ? 1u : 0u) | (present ? 2u : 0u)), DR_NO_ITEM);
    if (device_came && g->after_reset)
        dr_g_send_stop(g, now, DR_STOP_AFTER_RESET);
    g->after_reset = g->after_reset && !device_came;
    if (g->limits == NULL)
        return;
    if (host_lost)
        lose_host(g, now);
    if (device_lost)
        lose_device(g);
    if (device_came) {
        g->other_firmware = false;
        dr_g_start_proof(g, now);
    }
}

/* -- Inputs ---------------------------------------------------------------------------------------------------------- */

uint16_t dr_g_needs_of(const dr_guard *g)
{
    uint32_t needs = 0;
    if (g->limits == NULL)
        return DR_NEEDS_LIMITS;
    needs |= g->proved ? 0 : DR_NEEDS_IDENTITY;
    needs |= g->device_present ? 0 : DR_NEEDS_DEVICE;
    needs |= is_on(g, DR_INPUT_STOP) || is_on(g, DR_INPUT_STOP_2) || g->stop_latched ? DR_NEEDS_STOP_RELEASED : 0;
    needs |= g->mode == MODE_FAULT || g->mode == MODE_STOPPED ? DR_NEEDS_CLEAR : 0;
    needs |= g->log.size == 0 || is_on(g, DR_INPUT_LOG_FAILED) ? DR_NEEDS_LOG : 0;
    needs |= is_on(g, DR_INPUT_KEY) ? 0 : DR_NEEDS_KEY;
    needs |= g->tip_changed ? DR_NEEDS_TIP : 0;
    needs |= g->task != TASK_NONE ? DR_NEEDS_REST : 0;
    return (uint16_t)needs;
}

/* Its power was off: whatever was on its way to it is gone, half a frame too. Who is there? */
static void give_power_back(dr_guard *g, dr_us now)
{
    g->cut = false;
    dr_g_end_task(g);
    g->out_at = g->out_count; /* not half of anything any more */
    dr_g_withdraw(g);
    dr_g_lock(g, DR_FAULT_NONE);
    dr_g_start_proof(g, now);
}

static void key_turned_on(dr_guard *g, dr_us now)
{
    const bool latched = g->mode == MODE_FAULT || g->mode == MODE_STOPPED;
    if (g->limits == NULL || g->task != TASK_NONE || !g->device_present)
        return;
    if (g->mode == MODE_LOCKED && !g->other_firmware && !g->ambiguous) {
        dr_g_start_proof(g, now);
    } else if (latched && !g->stop_latched && !g->wiring_alarm) {
        g->fault = DR_FAULT_NONE;
        g->buzzer = false;
        dr_g_set_mode(g, MODE_DISARMED);
        if (g->cut && !has_rig(g, DR_RIG_CALIBRATES_AT_POWER_ON))
            give_power_back(g, now);
    }
}

static void stop_pressed(dr_guard *g, dr_us now)
{
    g->stop_latched = true;
    clear_timer(g, DR_TIMER_RELEASE);
    if (g->mode == MODE_ARMED || g->mode == MODE_DISARMED)
        dr_g_set_mode(g, MODE_STOPPED);
    if (g->limits == NULL)
        dr_g_send_stop(g, now, DR_STOP_INPUT);
    else if (g->task != TASK_STOP && g->device_present)
        dr_g_begin_stop(g, now, DR_STOP_INPUT, DR_FAULT_NONE, 0);
}

static void stop_contacts(dr_guard *g, dr_us now)
{
    const bool first = is_on(g, DR_INPUT_STOP), second = is_on(g, DR_INPUT_STOP_2);
    if (first == second) {
        clear_timer(g, DR_TIMER_WIRING);
        g->wiring_alarm = false;
    } else {
        dr_g_set_timer(g, DR_TIMER_WIRING, now + WIRING_US);
    }
    if (!first && !second)
        dr_g_set_timer(g, DR_TIMER_RELEASE, now + RELEASE_US);
    else if (!g->stop_latched)
        stop_pressed(g, now);
    else
        clear_timer(g, DR_TIMER_RELEASE);
}

static void arm_pressed(dr_guard *g, dr_us now)
{
    if (g->mode == MODE_DISARMED && dr_g_needs_of(g) == 0) {
        g->task = TASK_ARM;
        dr_g_start_reading(g, now, FRAME_GAP_US);
    }
}

void dr_g_read_for_arming(dr_guard *g, dr_us now, const dr_reply *reply)
{
    bool agree;
    if (!dr_g_has_two(g, now, reply, &agree))
        return;
    dr_g_know_place(g, now, reply);
    dr_g_end_task(g);
    g->unsteady = !agree;
    const dr_verdict place = dr_judge_place(g->limits, g->scene.drive, reply->steps);
    if (!dr_g_is_intact(g)) {
        dr_g_fall_back(g, now);
        return;
    }
    if (!agree || (place.reason != DR_REASON_NONE && !is_on(g, DR_INPUT_ESCAPE)))
        return;
    if (!g->host_chose)
        g->scene.chosen = g->scene.drive;
    dr_g_set_mode(g, MODE_ARMED);
    dr_g_start_idling(g, now);
}

static void confirm_pressed(dr_guard *g, dr_us now)
{
    g->tip_changed = false;
    g->confirmed = true;
    if (g->torn) { /* somebody has cycled the controller's power: it has forgotten its half of the frame */
        g->torn = false;
        g->unanswered = 0;
        dr_g_link(g, now, g->host_open, g->plugged);
    }
    if (g->ambiguous)
        dr_g_identity_proved(g);
    if (g->cut && g->mode == MODE_DISARMED) /* somebody has made room for the calibration at power-on */
        give_power_back(g, now);
}

void dr_g_input_changed(dr_guard *g, dr_us now, dr_input what, bool on)
{
    switch (what) {
    case DR_INPUT_STOP:
    case DR_INPUT_STOP_2:
        stop_contacts(g, now);
        break;
    case DR_INPUT_KEY:
        if (on)
            key_turned_on(g, now);
        else
            dr_g_disarm(g, now, DR_STOP_KEY);
        break;
    case DR_INPUT_ARM:
        if (on)
            arm_pressed(g, now);
        break;
    case DR_INPUT_TIP_CHANGED:
        if (on) {
            g->tip_changed = true;
            dr_g_disarm(g, now, DR_STOP_KEY);
        }
        break;
    case DR_INPUT_LOG_FAILED:
        if (on)
            dr_g_disarm(g, now, DR_STOP_KEY);
        break;
    case DR_INPUT_CONFIRM:
        if (on)
            confirm_pressed(g, now);
        break;
    default: /* levels that are looked at when they matter */
        break;
    }
}
