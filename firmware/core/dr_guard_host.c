/* The host's bytes: frames, and what of them may go on. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

#define BYTE_TIMEOUT_US MS(100) /* longest gap of real hosts: 35 ms and a USB converter's 16 ms */
#define FRAME_TIMEOUT_US MS(300)
#define RESYNC_US MS(50)

static void resync(dr_guard *g, dr_us now)
{
    g->resync = true;
    dr_g_set_timer(g, DR_TIMER_RESYNC, now + RESYNC_US);
}

/* ^C with nothing moving: one CR each, behind whatever reply is on its way. */
static void pass_stop(dr_guard *g, dr_us now, const dr_command *command)
{
    if (g->task == TASK_NONE) {
        g->command = *command;
        g->task = TASK_PASS;
        g->reply_have = g->reply_want = 0;
    }
    if (g->reply_want < UINT8_MAX)
        g->reply_want++;
    dr_g_set_timer(g, DR_TIMER_TASK, now + REPLY_TIMEOUT_US);
    dr_g_send_stop(g, now, DR_STOP_HOST);
}

static dr_reason may_pass(const dr_guard *g, const dr_command *command)
{
    if (g->tainted) /* its last byte too, if not all */
        return DR_REASON_BUSY;
    if (!g->proved && !g->ambiguous)
        return DR_REASON_NOT_ARMED;
    if ((command->is & DR_IS_QUERY) != 0)
        return DR_REASON_NONE;
    if ((command->is & DR_IS_SETTING) != 0)
        return g->mode == MODE_DISARMED || g->mode == MODE_ARMED ? DR_REASON_NONE : DR_REASON_NOT_ARMED;
    if (g->mode != MODE_ARMED)
        return DR_REASON_NOT_ARMED;
    return g->tokens > 0 ? DR_REASON_NONE : DR_REASON_RATE;
}

static void take_frame(dr_guard *g, dr_us now, const dr_command *command, const uint8_t *frame)
{
    dr_g_flush_dropped(g, now);
    clear_timer(g, DR_TIMER_FRAME);
    if ((command->is & DR_IS_INTERRUPT) != 0) {
        pass_stop(g, now, command);
        return;
    }
    const dr_request request = dr_wire_get_request(command, frame);
    const dr_verdict shape = dr_judge_frame(g->limits, command, &request);
    const dr_reason reason = may_pass(g, command);
    if (shape.reason != DR_REASON_NONE && command->op != DR_OP_MPC_SELECT) {
        dr_g_refuse(g, now, command, frame, shape);
        resync(g, now);
    } else if (reason != DR_REASON_NONE) {
        dr_g_refuse(g, now, command, frame, dr_g_because(reason));
    } else if (shape.reason != DR_REASON_NONE) {
        dr_g_refuse(g, now, command, frame, shape);
        if (command->reply > 1u) { /* the one documented error reply [M table 9] */
            dr_g_put_host(g, DR_NO_SUCH_DRIVE);
            dr_g_put_host(g, DR_CR);
        }
    } else if ((command->is & DR_IS_MOTION) == 0) {
        dr_g_pass(g, now, command, &request, frame);
    } else if (!dr_g_is_intact(g)) {
        dr_g_refuse(g, now, command, frame, dr_g_because(DR_REASON_DAMAGED));
        dr_g_fall_back(g, now);
    } else {
        g->command = *command;
        g->request = request;
        g->late = 0;
        g->doubted = false;
        g->counted = false;
        memcpy(g->frame, frame, (size_t)1u + command->args);
        g->task = TASK_CHECK;
        dr_g_start_reading(g, now, FRAME_GAP_US);
    }
}

/* Bytes that hosts and ports emit between frames: clients append CR or LF, ports 0xF0 and 0xFF when they are opened. */
static bool is_filler(uint8_t byte)
{
    return byte == DR_CR || byte == DR_LF || byte == 0x00u || byte == 0xF0u || byte == 0xFFu;
}

void dr_g_push_host_byte(dr_guard *g, dr_us now, uint8_t byte)
{
    dr_command command = {0, 0, 0, 0, 0, 0, 0};
    if (g->limits == NULL) {
        if (byte == DR_INTERRUPT)
            dr_g_send_stop(g, now, DR_STOP_HOST);
        else
            dr_g_drop(g, now, DR_REASON_NOT_ARMED, byte);
        return;
    }
    const bool busy = g->task != TASK_NONE && g->task != TASK_PASS;
    if (byte == DR_INTERRUPT && busy) { /* at any offset: a stop too many is cheap */
        dr_g_stop_by_host(g, now);
        if (g->framer.have == 0)
            return;
    }
    if (g->resync) {
        dr_g_set_timer(g, DR_TIMER_RESYNC, now + RESYNC_US);
        dr_g_drop(g, now, DR_REASON_RESYNC, byte);
        return;
    }
    if (g->framer.have == 0) {
        if (is_filler(byte)) {
            g->dropped_bytes++;
            return;
        }
        g->frame_began = now;
        g->tainted = false;
    }
    g->tainted = g->tainted || g->task != TASK_NONE || is_leaving(g);
    switch (dr_framer_push(&g->framer, kind_of(g), g->limits->firmware, byte, &command)) {
    case DR_FRAMED_WHOLE:
        take_frame(g, now, &command, g->framer.bytes);
        break;
    case DR_FRAMED_PART: {
        const dr_us whole = g->frame_began + FRAME_TIMEOUT_US, next = now + BYTE_TIMEOUT_US;
        dr_g_set_timer(g, DR_TIMER_FRAME, dr_us_before(whole, next) ? whole : next);
        break;
    }
    default:
        dr_g_drop(g, now, DR_REASON_UNKNOWN, byte);
        resync(g, now);
        break;
    }
}

void dr_g_drop_frame(dr_guard *g, dr_us now)
{
    for (uint8_t i = 0; i < g->framer.have; i++)
        dr_g_drop(g, now, DR_REASON_TORN, g->framer.bytes[i]);
    dr_framer_reset(&g->framer);
    clear_timer(g, DR_TIMER_FRAME);
    dr_g_flush_dropped(g, now);
    resync(g, now);
}
