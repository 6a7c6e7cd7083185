/* The conversation with the controller: readings, replies to the host, noise. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

#define REPLY_GAP_US MS(100) /* between two bytes of one reply */
#define NOISE_US MS(1000)
#define NOISE_MAX 16u

/* Before anything else of the controller's is told, so that the log keeps to the order of the line. */
void dr_g_flush_quarantined(dr_guard *g, dr_us now)
{
    if (g->quarantined_count > 0)
        dr_g_log_bytes(g, now, DR_EVENT_QUARANTINED, 0, DR_OP_NONE, g->quarantined, g->quarantined_count);
    g->quarantined_count = 0;
}

static void use_reading(dr_guard *g, dr_us now, const dr_reply *reply)
{
    dr_g_flush_quarantined(g, now);
    dr_record record = dr_g_record_of(g, now, DR_EVENT_READING, 0);
    record.item = reply->value;
    copy_point(record.position_steps, reply->steps);
    dr_log_put(&g->log, &record);
    dr_g_stop_reading(g);
    switch (g->task) {
    case TASK_PROVE:
        dr_g_read_for_proof(g, now, reply);
        break;
    case TASK_ARM:
        dr_g_read_for_arming(g, now, reply);
        break;
    case TASK_CHECK:
        dr_g_read_for_motion(g, now, reply);
        break;
    case TASK_VERIFY:
        dr_g_read_for_end(g, now, reply);
        break;
    case TASK_STOP:
        dr_g_read_for_rest(g, now, reply);
        break;
    default: /* TASK_RECHECK: the controller talks sense again */
        dr_g_know_place(g, now, reply);
        dr_g_end_task(g);
        break;
    }
}

static void give_up_reading(dr_guard *g, dr_us now, dr_fault fault)
{
    if (g->task == TASK_PROVE) {
        dr_g_stop_reading(g);
        g->fault = (uint8_t)(fault == DR_FAULT_IMPLAUSIBLE ? DR_FAULT_IDENTITY : fault);
        if (--g->attempts > 0)
            dr_g_set_timer(g, DR_TIMER_TASK, now + (PROVE_ATTEMPTS - g->attempts) * PROVE_RETRY_US);
        else
            dr_g_end_task(g);
        return;
    }
    if (g->task == TASK_CHECK)
        dr_g_refuse_pending(g, now, dr_g_because(DR_REASON_NO_POSITION));
    dr_g_fail(g, now, fault);
}

static void bad_reading(dr_guard *g, dr_us now)
{
    dr_g_flush_quarantined(g, now);
    dr_g_log_bytes(g, now, DR_EVENT_IMPLAUSIBLE, 0, DR_OP_NONE, g->read, g->read_have);
    if (g->read_again) {
        give_up_reading(g, now, DR_FAULT_IMPLAUSIBLE);
        return;
    }
    g->read_again = true;
    g->read_phase = READ_QUIETS;
    dr_g_set_timer(g, DR_TIMER_READ, now + QUIET_US);
}

static void push_reading(dr_guard *g, dr_us now, uint8_t byte)
{
    dr_reply reply;
    g->read[g->read_have++] = byte;
    if (g->read_have < DR_REPLY_MAX) {
        dr_g_set_timer(g, DR_TIMER_READ, now + REPLY_GAP_US);
        return;
    }
    if (dr_g_is_plausible(g, g->read, &reply))
        use_reading(g, now, &reply);
    else
        bad_reading(g, now);
}

/* Never forwarded: it would look like the answer to the next command. */
static void quarantine(dr_guard *g, dr_us now, uint8_t byte)
{
    if (g->quarantined_count < DR_RECORD_TEXT)
        g->quarantined[g->quarantined_count] = byte;
    if (g->quarantined_count < UINT8_MAX)
        g->quarantined_count++;
    g->quarantined_bytes++;
    if (!is_running(g, DR_TIMER_NOISE))
        dr_g_set_timer(g, DR_TIMER_NOISE, now + NOISE_US);
    if (g->task == TASK_STOP || g->mode == MODE_LOCKED || g->noise > NOISE_MAX)
        return;
    if (++g->noise > NOISE_MAX)
        dr_g_fail(g, now, DR_FAULT_DEVICE_NOISE);
}

/* A streamed position within a move: 12 bytes by length, whatever their values. */
static bool is_streamed(dr_guard *g, uint8_t byte)
{
    if (g->stream_left > 0)
        g->stream_left--;
    else if (kind_of(g) == DR_MPC && byte == 0xFFu)
        g->stream_left = DR_STREAM_FRAME - 1u;
    else
        return false;
    if (has_rig(g, DR_RIG_MAY_STREAM))
        dr_g_put_host(g, byte);
    return true;
}

/* A host's query or setting was answered in full: what does the guard learn from it? */
static void learn(dr_guard *g, dr_us now)
{
    dr_reply reply;
    switch (g->command.op) {
    case DR_OP_TRIO_POSITION:
    case DR_OP_MPC_POSITION:
        if (!dr_g_is_plausible(g, g->reply, &reply)) {
            g->task = TASK_RECHECK;
            dr_g_start_reading(g, now, QUIET_US);
            break;
        }
        if (g->mode == MODE_ARMED && dr_g_has_jumped(g, now, &reply))
            dr_g_latch(g, DR_FAULT_POSITION_JUMP);
        dr_g_know_place(g, now, &reply);
        break;
    case DR_OP_MPC_SELECT:
        if (dr_wire_get_reply(&g->command, g->reply, g->command.reply, &reply) &&
            (g->command.reply == 1u || reply.value == g->request.value)) {
            g->scene.chosen = (uint8_t)(g->request.value - 1u);
            g->host_chose = true;
        }
        break;
    case DR_OP_MPC_ACTIVE:
        if (dr_wire_get_reply(&g->command, g->reply, g->command.reply, &reply) && g->command.reply > 2u &&
            reply.firmware != g->limits->firmware) {
            g->other_firmware = true; /* a position cannot prove the opposite: until it is plugged in anew */
            dr_g_lock(g, DR_FAULT_IDENTITY);
        }
        break;
    default:
        break;
    }
}

static void push_passed(dr_guard *g, dr_us now, uint8_t byte)
{
    dr_g_put_host(g, byte);
    if (g->reply_have < DR_REPLY_MAX)
        g->reply[g->reply_have] = byte;
    if (++g->reply_have < g->reply_want) {
        dr_g_set_timer(g, DR_TIMER_TASK, now + REPLY_GAP_US);
        return;
    }
    dr_g_flush_quarantined(g, now);
    dr_g_log_bytes(g, now, DR_EVENT_REPLY, g->command.op, g->command.op, g->reply,
                   g->reply_have < DR_REPLY_MAX ? g->reply_have : DR_REPLY_MAX);
    dr_g_end_task(g);
    learn(g, now);
}

static void push_in_stop(dr_guard *g, dr_us now, uint8_t byte)
{
    if (g->stop_skip > 0) {
        g->stop_skip--;
    } else if (!is_streamed(g, byte) && byte == DR_CR) {
        if (g->stop_crs < UINT8_MAX)
            g->stop_crs++;
        clear_timer(g, DR_TIMER_REPEAT);
        if (g->stop_waits) {
            g->stop_waits = false;
            dr_g_set_timer(g, DR_TIMER_PROOF, now + PROOF_OF_REST_US);
        }
    }
    quarantine(g, now, byte);
    if (!g->stop_waits && g->read_phase == READ_OFF)
        dr_g_set_timer(g, DR_TIMER_TASK, now + QUIET_US);
}

void dr_g_push_device_byte(dr_guard *g, dr_us now, uint8_t byte)
{
    const bool sent = g->out_at == g->out_count;
    g->unanswered = 0;
    if (g->limits == NULL) {
        g->quarantined_bytes++;
        return;
    }
    if (g->read_phase == READ_SENT && sent) {
        push_reading(g, now, byte);
        return;
    }
    if (g->read_phase == READ_QUIETS)
        dr_g_set_timer(g, DR_TIMER_READ, now + QUIET_US);
    else if (g->read_phase == READ_WAITS && dr_us_before(g->at[DR_TIMER_READ], now + FRAME_GAP_US))
        dr_g_set_timer(g, DR_TIMER_READ, now + FRAME_GAP_US);
    if (g->task == TASK_STOP) {
        push_in_stop(g, now, byte);
    } else if (g->task == TASK_PASS && sent) {
        push_passed(g, now, byte);
    } else if (g->task == TASK_MOVE && is_streamed(g, byte)) {
        return;
    } else if (g->task == TASK_MOVE && byte == DR_CR) {
        clear_timer(g, DR_TIMER_TASK);
        g->end_told = true;
        g->task = TASK_VERIFY;
        dr_g_start_reading(g, now, FRAME_GAP_US);
    } else {
        quarantine(g, now, byte);
        if (g->task == TASK_SEND && g->out_at == 0) { /* the reply was longer than a reply: not to be believed */
            dr_g_withdraw(g);
            g->task = TASK_CHECK;
            bad_reading(g, now);
        }
    }
}

void dr_g_pass(dr_guard *g, dr_us now, const dr_command *command, const dr_request *request, const uint8_t *frame)
{
    const uint8_t length = (uint8_t)(1u + command->args);
    g->command = *command;
    g->request = *request;
    g->task = TASK_PASS;
    g->reply_have = 0;
    g->reply_want = command->reply;
    g->forwarded++;
    dr_g_put_out(g, frame, length, length);
    dr_g_set_timer(g, DR_TIMER_TASK, now + REPLY_TIMEOUT_US);
    dr_g_flush_quarantined(g, now);
    dr_g_log_bytes(g, now, DR_EVENT_ALLOWED, 0, command->op, frame, length);
}

void dr_g_task_due(dr_guard *g, dr_us now)
{
    switch (g->task) {
    case TASK_PROVE:
        dr_g_start_reading(g, now, 0);
        break;
    case TASK_PASS:
        if (is_leaving(g)) { /* nobody pulls on it */
            dr_g_set_timer(g, DR_TIMER_TASK, now + REPLY_TIMEOUT_US);
            break;
        }
        dr_g_log_event(g, now, DR_EVENT_NO_REPLY, g->command.op, DR_NO_ITEM);
        dr_g_withdraw(g);
        dr_g_end_task(g);
        break;
    case TASK_MOVE:
        if (g->small) { /* ignored without a CR, or over: the position tells */
            g->task = TASK_VERIFY;
            dr_g_start_reading(g, now, 0);
        } else {
            dr_g_begin_stop(g, now, DR_STOP_DEADLINE, DR_FAULT_NO_CR, 0);
        }
        break;
    default: /* TASK_STOP: it has been quiet; without a CR, ^C is repeated first */
        g->stop_waits = false;
        if (!is_running(g, DR_TIMER_REPEAT))
            dr_g_start_reading(g, now, 0);
        break;
    }
}

void dr_g_read_due(dr_guard *g, dr_us now)
{
    if (g->read_phase != READ_SENT)
        dr_g_send_query(g, now);
    else if (g->read_have > 0)
        bad_reading(g, now);
    else
        give_up_reading(g, now, DR_FAULT_DEVICE_SILENT);
}
