#include "dr_guard.h"

#include <string.h>

/* Who may do what. Less safe only by a person: LOCKED -> DISARMED by proof, DISARMED -> ARMED by key and ARM,
 * FAULT and STOPPED -> DISARMED by the key. */
typedef enum { MODE_LOCKED, MODE_DISARMED, MODE_ARMED, MODE_FAULT, MODE_STOPPED } dr_mode;

/* What is under way on the controller's side. One thing at a time. */
typedef enum {
    TASK_NONE,
    TASK_PROVE,   /* is it the controller of the limits? READ or, between two tries, DR_TIMER_TASK runs */
    TASK_ARM,     /* two readings that must agree */
    TASK_PASS,    /* the host's query, setting or idle ^C: its reply goes through byte by byte */
    TASK_RECHECK, /* the host's query got nonsense: a reading of the guard's own decides */
    TASK_CHECK,   /* a motion waits for a reading */
    TASK_SEND,    /* a motion was allowed and waits for its turn, or is leaving */
    TASK_MOVE,    /* its CR is awaited */
    TASK_VERIFY,  /* the CR is there and kept back: is the tip where it should be? */
    TASK_STOP     /* ^C was sent: quiet, then two readings that agree prove rest */
} dr_task;

typedef enum {
    READ_OFF,
    READ_WAITS, /* for DR_TIMER_READ: the gap between frames */
    READ_SENT,  /* DR_TIMER_READ is its deadline */
    READ_QUIETS /* after nonsense: 100 ms without a byte, then once more */
} dr_read_phase;

#define MS(ms) ((dr_us)(ms)*1000u)
#define FRAME_GAP_US MS(2)      /* between two frames to the controller */
#define LINE_PAUSE_US MS(35)    /* within the 'S' of an MPC-200: 30 ms [M note 10], and some */
#define LINE_HEAD 2u            /* bytes before that pause: 'S' and the speed */
#define BYTE_TIMEOUT_US MS(100) /* longest gap of real hosts: 35 ms and a USB converter's 16 ms */
#define FRAME_TIMEOUT_US MS(300)
#define RESYNC_US MS(50)
#define REPLY_TIMEOUT_US MS(2000)
#define REPLY_GAP_US MS(100) /* between two bytes of one reply */
#define QUIET_US MS(100)
#define REST_APART_US MS(100) /* between two readings that must agree */
#define PROOF_OF_REST_US MS(1000)
#define PROOF_RETRY_US MS(500) /* once that has failed */
#define REPEAT_STOP_US MS(150)
#define STOPS_MAX 3u
#define HOST_STOPS_MAX 15u    /* known clients send as many running */
#define SMALL_MOVE_US MS(100) /* 15 microsteps at the slowest speed take 15 ms */
#define SMALL_MOVE_STEPS 16u  /* an MPC-200 ignores shorter moves, without a CR ([P], small-move-silent) */
#define CALIBRATION_US MS(60000)
#define STALE_US MS(20000) /* the longest travel, by knob */
#define JUMP_Q (20 * (int32_t)DR_QUANTA_PER_UM)
#define READY_US MS(1000) /* "ready about one second after power-on" [O] */
/* A TRIO may be calibrating by itself: a minute, in pauses that grow by a second. Ten queries and the ^C after a reset are
 * fewer than the 12 bytes that a controller waits for if the guard before died within an 'S': whole, it would move. */
#define PROVE_RETRY_US MS(1000)
#define PROVE_ATTEMPTS 10u
#define RATE_TOKENS 20u
#define RATE_US MS(50)
#define NOISE_US MS(1000)
#define NOISE_MAX 16u
#define WIRING_US MS(50)
#define RELEASE_US MS(20)
#define RAW_STOPS_MAX 15u /* ^C that wait to leave */
#define EVENTS_MAX 16u    /* at most so many in one call; a caller who comes that late is due again at once */

/* -- Small helpers ------------------------------------------------------------------------------------------------- */

static dr_kind kind_of(const dr_guard *g) { return (dr_kind)g->limits->kind; }
static bool has_rig(const dr_guard *g, uint16_t rig) { return (g->limits->rig & rig) != 0; }
static bool is_on(const dr_guard *g, dr_input input) { return (g->inputs >> input & 1u) != 0; }
static bool is_stoppable(const dr_guard *g) { return (g->command.is & DR_IS_STOPPABLE) != 0; }
static bool is_leaving(const dr_guard *g) { return g->out_at > 0 && g->out_at < g->out_count; }

static bool is_calibration(uint8_t op)
{
    return op == DR_OP_TRIO_RECALIBRATE || op == DR_OP_MPC_CALIBRATE || op == DR_OP_MPC_CENTRE;
}

static uint32_t apart(uint32_t a, uint32_t b) { return a < b ? b - a : a - b; }

static bool same_place(const uint32_t a[DR_AXES], const uint32_t b[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (apart(a[axis], b[axis]) > DR_REST_STEPS)
            return false;
    return true;
}

static void copy_point(uint32_t to[DR_AXES], const uint32_t from[DR_AXES]) { memcpy(to, from, DR_AXES * sizeof *to); }

static void set_timer(dr_guard *g, uint8_t timer, dr_us when)
{
    g->at[timer] = when;
    g->running = (uint16_t)(g->running | 1u << timer);
}

static void clear_timer(dr_guard *g, uint8_t timer) { g->running = (uint16_t)(g->running & ~(1u << timer)); }
static bool is_running(const dr_guard *g, uint8_t timer) { return (g->running >> timer & 1u) != 0; }

static void set_mode(dr_guard *g, dr_mode mode)
{
    g->mode = (uint8_t)mode;
    g->mode_inverse = (uint8_t)~g->mode;
    if (mode != MODE_ARMED)
        clear_timer(g, DR_TIMER_IDLE);
}

static void start_idling(dr_guard *g, dr_us now)
{
    set_timer(g, DR_TIMER_IDLE, now + g->limits->arm_idle_s * DR_US_PER_S);
}

static dr_guard_state state_of(const dr_guard *g)
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

/* -- Log ------------------------------------------------------------------------------------------------------------ */

static dr_record record_of(const dr_guard *g, dr_us now, dr_event event, uint8_t code)
{
    dr_record record = {.when = now, .event = (uint8_t)event, .before = g->shown_state, .after = (uint8_t)state_of(g)};
    record.code = code;
    record.axis = DR_AXES;
    record.item = DR_NO_ITEM;
    return record;
}

static void log_bytes(dr_guard *g, dr_us now, dr_event event, uint8_t code, uint8_t op, const uint8_t *bytes,
                      uint8_t count)
{
    dr_record record = record_of(g, now, event, code);
    record.op = op;
    record.count = count;
    memcpy(record.bytes, bytes, count < DR_RECORD_TEXT ? count : DR_RECORD_TEXT);
    copy_point(record.position_steps, g->scene.start_steps);
    dr_log_put(&g->log, &record);
}

static void log_event(dr_guard *g, dr_us now, dr_event event, uint8_t code, uint8_t item)
{
    dr_record record = record_of(g, now, event, code);
    record.item = item;
    copy_point(record.position_steps, g->scene.start_steps);
    dr_log_put(&g->log, &record);
}

/* Every call ends with it: a change of the state is a record of its own. */
static void show_state(dr_guard *g, dr_us now)
{
    if (state_of(g) == (dr_guard_state)g->shown_state)
        return;
    log_event(g, now, DR_EVENT_STATE, g->fault, DR_NO_ITEM);
    g->shown_state = (uint8_t)state_of(g);
}

/* -- To the host ------------------------------------------------------------------------------------------------------ */

/* What does not fit a host that does not read is lost, as on a wire. */
static void put_host(dr_guard *g, uint8_t byte)
{
    if (g->to_host_count < DR_HOST_OUT_MAX)
        g->to_host[((unsigned)g->to_host_first + g->to_host_count++) % DR_HOST_OUT_MAX] = byte;
}

static void flush_dropped(dr_guard *g, dr_us now)
{
    if (g->dropped_count > 0)
        log_bytes(g, now, DR_EVENT_DROPPED, g->dropped_reason, DR_OP_NONE, g->dropped, g->dropped_count);
    g->dropped_count = 0;
}

static void drop(dr_guard *g, dr_us now, dr_reason reason, uint8_t byte)
{
    if (g->dropped_reason != reason)
        flush_dropped(g, now);
    g->dropped_reason = (uint8_t)reason;
    if (g->dropped_count < DR_RECORD_TEXT)
        g->dropped[g->dropped_count] = byte;
    if (g->dropped_count < UINT8_MAX)
        g->dropped_count++;
    g->dropped_bytes++;
}

static void resync(dr_guard *g, dr_us now)
{
    g->resync = true;
    set_timer(g, DR_TIMER_RESYNC, now + RESYNC_US);
}

static void refuse(dr_guard *g, dr_us now, const dr_command *command, const uint8_t *frame, dr_verdict verdict)
{
    dr_record record = record_of(g, now, DR_EVENT_REFUSED, verdict.reason);
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
        put_host(g, DR_NO_SUCH_DRIVE);
}

static dr_verdict because(dr_reason reason) { return (dr_verdict){(uint8_t)reason, DR_AXES, DR_NO_ITEM, 0, 0}; }

static void refuse_pending(dr_guard *g, dr_us now, dr_verdict verdict)
{
    refuse(g, now, &g->command, g->frame, verdict);
}

/* -- To the controller -------------------------------------------------------------------------------------------------- */

static void put_out(dr_guard *g, const uint8_t *bytes, uint8_t count, uint8_t ready)
{
    memcpy(g->out, bytes, count);
    g->out_at = 0;
    g->out_count = count;
    g->out_ready = ready;
}

/* What nobody has begun to pull was never sent. What has been begun must be finished, its pause included: half a frame
 * would swallow the stop that follows. */
static void withdraw(dr_guard *g)
{
    if (is_leaving(g))
        return;
    g->out_at = g->out_count = g->out_ready = 0;
    clear_timer(g, DR_TIMER_SEND);
}

static void send_stop(dr_guard *g, dr_us now, dr_stop_cause cause)
{
    if (g->torn) /* it would not be heard as ^C, and might complete a motion */
        return;
    if (g->stops_out < RAW_STOPS_MAX)
        g->stops_out++;
    log_event(g, now, DR_EVENT_STOP, (uint8_t)cause, DR_NO_ITEM);
}

static void start_reading(dr_guard *g, dr_us now, dr_us after_us)
{
    g->read_phase = READ_WAITS;
    g->read_again = false;
    set_timer(g, DR_TIMER_READ, now + after_us);
}

static void stop_reading(dr_guard *g)
{
    g->read_phase = READ_OFF;
    clear_timer(g, DR_TIMER_READ);
}

static dr_command position_query(const dr_guard *g)
{
    dr_command query = {0, 0, 0, 0, 0, 0, 0};
    (void)dr_command_for(kind_of(g), g->limits->firmware,
                         kind_of(g) == DR_TRIO ? DR_OP_TRIO_POSITION : DR_OP_MPC_POSITION, &query);
    return query;
}

static void send_query(dr_guard *g, dr_us now)
{
    const dr_command query = position_query(g);
    if (is_leaving(g)) { /* a frame that nobody pulls on */
        set_timer(g, DR_TIMER_READ, now + FRAME_GAP_US);
        return;
    }
    put_out(g, &query.code, 1, 1);
    g->read_phase = READ_SENT;
    g->read_have = 0;
    set_timer(g, DR_TIMER_READ, now + REPLY_TIMEOUT_US);
}

static void end_task(dr_guard *g)
{
    stop_reading(g);
    clear_timer(g, DR_TIMER_TASK);
    clear_timer(g, DR_TIMER_PROOF);
    clear_timer(g, DR_TIMER_REPEAT);
    g->task = TASK_NONE;
    g->has_first = false;
    g->stop_waits = false;
    g->stream_left = 0;
}

static void start_proof(dr_guard *g, dr_us now)
{
    g->task = TASK_PROVE;
    g->attempts = PROVE_ATTEMPTS;
    set_timer(g, DR_TIMER_TASK, now + READY_US);
}

/* -- Faults and stops ----------------------------------------------------------------------------------------------------- */

static void latch(dr_guard *g, dr_fault fault)
{
    g->fault = (uint8_t)fault;
    if (g->mode != MODE_LOCKED)
        set_mode(g, MODE_FAULT);
}

static void lock(dr_guard *g, dr_fault fault)
{
    g->fault = (uint8_t)fault;
    g->proved = g->ambiguous = false;
    set_mode(g, MODE_LOCKED);
}

/* The target of a motion that was broken off stays possible until a later motion has ended at its own. */
static void keep_old_target(dr_guard *g)
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
static void break_off_unproved(dr_guard *g)
{
    keep_old_target(g);
    if (is_calibration(g->command.op))
        g->scene.frame_lost = true;
}

/* Sends ^C, drops whatever is pending, and proves rest. */
static void begin_stop(dr_guard *g, dr_us now, dr_stop_cause cause, dr_fault fault, uint8_t owed)
{
    const bool begun = g->task == TASK_MOVE || g->task == TASK_VERIFY || (g->task == TASK_SEND && is_leaving(g));
    const bool waits = g->task == TASK_MOVE && !is_stoppable(g) && cause != DR_STOP_DEADLINE;
    const bool asked = g->out_at > 0 || g->out_count == 0; /* the query or frame has left, at least in part */
    const uint8_t read_left = g->read_phase == READ_SENT ? (uint8_t)(DR_REPLY_MAX - g->read_have) : 0;
    const uint8_t reply_left = g->task == TASK_PASS ? (uint8_t)(g->reply_want - g->reply_have) : 0;
    const dr_us ends = g->at[DR_TIMER_TASK];
    if (g->task == TASK_CHECK || (g->task == TASK_SEND && !begun))
        refuse_pending(g, now, because(DR_REASON_CANCELLED));
    end_task(g);
    withdraw(g);
    g->task = TASK_STOP;
    g->stop_owed = owed;
    g->stop_crs = 0;
    g->stop_sent = 1;
    g->stop_skip = asked ? (uint8_t)(read_left + reply_left) : 0;
    g->stop_fault = (uint8_t)fault;
    g->stop_broke_off = begun;
    g->stop_waits = waits;
    send_stop(g, now, cause);
    if (waits) { /* nothing more can be done; its own CR tells the end */
        g->buzzer = true;
        g->cut = has_rig(g, DR_RIG_HAS_CUT);
        latch(g, DR_FAULT_UNSTOPPABLE);
        set_timer(g, DR_TIMER_TASK, ends);
        return;
    }
    set_timer(g, DR_TIMER_TASK, now + QUIET_US);
    set_timer(g, DR_TIMER_PROOF, now + PROOF_OF_REST_US);
    set_timer(g, DR_TIMER_REPEAT, now + REPEAT_STOP_US);
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
        begin_stop(g, now, cause, DR_FAULT_NONE, 0);
}

static void disarm(dr_guard *g, dr_us now, dr_stop_cause cause)
{
    break_off(g, now, cause);
    if (g->mode == MODE_ARMED)
        set_mode(g, MODE_DISARMED);
}

/* Nothing that depends on the limits may be done any more: ^C only. */
static void fall_back(dr_guard *g, dr_us now)
{
    if (g->task != TASK_NONE)
        send_stop(g, now, DR_STOP_AGAIN);
    end_task(g);
    withdraw(g);
    lock(g, DR_FAULT_DAMAGED);
    g->limits = NULL;
    g->running = 0;
}

static bool is_intact(const dr_guard *g)
{
    return (g->mode ^ g->mode_inverse) == UINT8_MAX && dr_limits_crc(g->limits) == g->limits_crc;
}

/* A fault. While something may move: it is stopped first. */
static void fail(dr_guard *g, dr_us now, dr_fault fault)
{
    if (g->task == TASK_MOVE || g->task == TASK_VERIFY || g->task == TASK_SEND) {
        begin_stop(g, now, fault == DR_FAULT_DEVICE_NOISE ? DR_STOP_NOISE : DR_STOP_DEADLINE, fault, 0);
    } else {
        if (g->task == TASK_STOP && g->stop_broke_off)
            break_off_unproved(g);
        end_task(g);
        withdraw(g);
    }
    latch(g, fault);
}

/* -- Readings --------------------------------------------------------------------------------------------------------------- */

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

static bool is_plausible(const dr_guard *g, const uint8_t *bytes, dr_reply *reply)
{
    const dr_command query = position_query(g);
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

static void know_place(dr_guard *g, dr_us now, const dr_reply *reply)
{
    copy_point(g->scene.start_steps, reply->steps);
    if (kind_of(g) == DR_TRIO)
        g->scene.angle_deg = reply->value;
    else
        g->scene.drive = (uint8_t)(reply->value - 1u);
    g->position_known = true;
    g->position_at = now;
    set_timer(g, DR_TIMER_STALE, now + STALE_US);
}

/* Has the tip moved farther than a knob can have moved it since? */
static bool has_jumped(const dr_guard *g, dr_us now, const dr_reply *reply)
{
    const uint8_t drive = kind_of(g) == DR_TRIO ? 0 : (uint8_t)(reply->value - 1u);
    dr_stage stage;
    if (drive != g->scene.drive || !dr_stage_get((dr_stage_id)g->limits->drives[drive].stage, &stage))
        return false;
    const bool locked = has_rig(g, DR_RIG_KNOBS_LOCKED);
    if (!locked && !is_running(g, DR_TIMER_STALE))
        return false;
    const uint64_t knob_q = locked ? 0 : (uint64_t)g->limits->knob_q_per_s * (now - g->position_at) / DR_US_PER_S;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if ((uint64_t)apart(reply->steps[axis], g->scene.start_steps[axis]) * stage.quanta_per_step >
            knob_q + (uint64_t)JUMP_Q)
            return true;
    return false;
}

/* The first of two readings is kept, the second compared. False: it was the first, a second was asked for. */
static bool has_two(dr_guard *g, dr_us now, const dr_reply *reply, bool *agree)
{
    if (!g->has_first) {
        g->has_first = true;
        copy_point(g->first_steps, reply->steps);
        start_reading(g, now, REST_APART_US);
        return false;
    }
    *agree = same_place(g->first_steps, reply->steps);
    copy_point(g->first_steps, reply->steps);
    return true;
}

static void identity_proved(dr_guard *g)
{
    g->proved = true;
    g->ambiguous = false;
    set_mode(g, g->stop_latched ? MODE_STOPPED : MODE_DISARMED);
}

static void read_for_proof(dr_guard *g, dr_us now, const dr_reply *reply)
{
    know_place(g, now, reply);
    end_task(g);
    g->fault = DR_FAULT_NONE;
    if (kind_of(g) == DR_TRIO && looks_like_mpc(g))
        g->ambiguous = true;
    else
        identity_proved(g);
}

static void read_for_arming(dr_guard *g, dr_us now, const dr_reply *reply)
{
    bool agree;
    if (!has_two(g, now, reply, &agree))
        return;
    know_place(g, now, reply);
    end_task(g);
    g->unsteady = !agree;
    const dr_verdict place = dr_judge_place(g->limits, g->scene.drive, reply->steps);
    if (!agree || (place.reason != DR_REASON_NONE && !is_on(g, DR_INPUT_ESCAPE)))
        return;
    g->scene.chosen = g->scene.drive;
    set_mode(g, MODE_ARMED);
    start_idling(g, now);
}

/* How long the motion may last at most: one and a half times its way at the slowest plausible speed, and 2 s. */
static dr_us longest_us(const dr_guard *g)
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
    return (dr_us)
        lasts_us; /* the longest: 87.5 mm in all (MP-865) at 81 um/s, 27 minutes; instants are told apart up to 35 */
}

static bool is_small(const dr_guard *g)
{
    if (kind_of(g) == DR_TRIO || (g->command.is & DR_IS_TARGETED) == 0)
        return false;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (apart(g->request.steps[axis], g->scene.start_steps[axis]) >= SMALL_MOVE_STEPS)
            return false;
    return true;
}

static void read_for_motion(dr_guard *g, dr_us now, const dr_reply *reply)
{
    const bool jumped = has_jumped(g, now, reply);
    know_place(g, now, reply);
    if (jumped) {
        refuse_pending(g, now, because(DR_REASON_NO_POSITION));
        fail(g, now, DR_FAULT_POSITION_JUMP);
        return;
    }
    if (!is_intact(g)) {
        fall_back(g, now);
        return;
    }
    g->scene.may_calibrate = is_on(g, DR_INPUT_MAY_CALIBRATE);
    g->scene.in_tissue = is_on(g, DR_INPUT_IN_TISSUE);
    const dr_verdict verdict = dr_judge_motion(g->limits, &g->scene, &g->command, &g->request);
    if (verdict.reason != DR_REASON_NONE) {
        end_task(g);
        refuse_pending(g, now, verdict);
        return;
    }
    g->path = dr_judge_path(g->limits, &g->scene, &g->command, &g->request);
    g->path_drive = g->scene.drive;
    g->small = is_small(g);
    g->end_told = false;
    g->forwarded++;
    g->tokens--;
    if (!is_running(g, DR_TIMER_RATE))
        set_timer(g, DR_TIMER_RATE, now + RATE_US);
    const uint8_t length = (uint8_t)(1u + g->command.args);
    put_out(g, g->frame, length, 0);
    set_timer(g, DR_TIMER_SEND, now + FRAME_GAP_US);
    start_idling(g, now);
    g->task = TASK_SEND;
    log_bytes(g, now, DR_EVENT_ALLOWED, 0, g->command.op, g->frame, length);
}

static bool is_at(const dr_guard *g, const dr_reply *reply, const dr_box *target_q)
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

/* Where the motion may rightly end: at its target; without Y where homing leaves it out; where it began, if it was so short
 * that the controller ignores it. */
static bool is_at_an_end(const dr_guard *g, const dr_reply *reply)
{
    dr_box without_y = g->path.target_q;
    without_y.min_q[DR_Y] = without_y.max_q[DR_Y] = g->path.line.from_q[DR_Y];
    const dr_segment stays = {{g->path.line.from_q[DR_X], g->path.line.from_q[DR_Y], g->path.line.from_q[DR_Z]},
                              {g->path.line.from_q[DR_X], g->path.line.from_q[DR_Y], g->path.line.from_q[DR_Z]}};
    const dr_box start = dr_box_around(&stays);
    const bool homes = g->command.op == DR_OP_TRIO_HOME || g->command.op == DR_OP_TRIO_HOME_TO;
    return is_at(g, reply, &g->path.target_q) ||
           (homes && has_rig(g, DR_RIG_Y_LOCKED_OUT) && is_at(g, reply, &without_y)) ||
           (g->small && is_at(g, reply, &start));
}

static void read_for_end(dr_guard *g, dr_us now, const dr_reply *reply)
{
    bool agree = true;
    if (is_at_an_end(g, reply)) {
        know_place(g, now, reply);
        end_task(g);
        for (uint8_t drive = 0; drive < DR_PORTS; drive++)
            g->scene.old[drive].is_open = false;
        if (is_calibration(g->command.op))
            g->scene.frame_lost = false;
        if (g->end_told)
            put_host(g, DR_CR);
        log_event(g, now, DR_EVENT_ENDED, g->command.op, DR_NO_ITEM);
        return;
    }
    if (!has_two(g, now, reply, &agree))
        return;
    know_place(g, now, reply);
    if (!agree) {
        begin_stop(g, now, DR_STOP_EARLY_CR, DR_FAULT_EARLY_CR, 0);
        latch(g, DR_FAULT_EARLY_CR);
        return;
    }
    const dr_old_move *old = &g->scene.old[g->path_drive];
    const bool resumed = old->is_open && is_at(g, reply, &old->target_q);
    keep_old_target(g);
    end_task(g);
    latch(g, resumed ? DR_FAULT_RESUMED_OLD_MOVE : DR_FAULT_WRONG_END);
}

static void rest_proved(dr_guard *g, dr_us now, const dr_reply *reply)
{
    const uint8_t crs = g->stop_crs < g->stop_owed ? g->stop_crs : g->stop_owed;
    const dr_fault fault = (dr_fault)g->stop_fault;
    know_place(g, now, reply);
    end_task(g);
    g->buzzer = false;
    if (g->stop_broke_off && !is_at(g, reply, &g->path.target_q))
        keep_old_target(g);
    if (g->stop_broke_off && is_calibration(g->command.op)) {
        g->scene.frame_lost = true;
        latch(g, DR_FAULT_FRAME_LOST);
    } else if (fault != DR_FAULT_NONE) {
        latch(g, fault);
    }
    for (uint8_t i = 0; i < crs; i++)
        put_host(g, DR_CR);
    if (g->mode == MODE_LOCKED && !g->other_firmware)
        start_proof(g, now);
}

static void read_for_rest(dr_guard *g, dr_us now, const dr_reply *reply)
{
    bool agree;
    if (!has_two(g, now, reply, &agree))
        return;
    if (agree) {
        rest_proved(g, now, reply);
        return;
    }
    if (g->stop_sent < STOPS_MAX) {
        g->stop_sent++;
        send_stop(g, now, DR_STOP_AGAIN);
    }
    start_reading(g, now, is_running(g, DR_TIMER_PROOF) ? REST_APART_US : PROOF_RETRY_US);
}

static void use_reading(dr_guard *g, dr_us now, const dr_reply *reply)
{
    dr_record record = record_of(g, now, DR_EVENT_READING, 0);
    record.item = reply->value;
    copy_point(record.position_steps, reply->steps);
    dr_log_put(&g->log, &record);
    stop_reading(g);
    switch (g->task) {
    case TASK_PROVE:
        read_for_proof(g, now, reply);
        break;
    case TASK_ARM:
        read_for_arming(g, now, reply);
        break;
    case TASK_CHECK:
        read_for_motion(g, now, reply);
        break;
    case TASK_VERIFY:
        read_for_end(g, now, reply);
        break;
    case TASK_STOP:
        read_for_rest(g, now, reply);
        break;
    default: /* TASK_RECHECK: the controller talks sense again */
        know_place(g, now, reply);
        end_task(g);
        break;
    }
}

static void give_up_reading(dr_guard *g, dr_us now, dr_fault fault)
{
    if (g->task == TASK_PROVE) {
        stop_reading(g);
        g->fault = (uint8_t)(fault == DR_FAULT_IMPLAUSIBLE ? DR_FAULT_IDENTITY : fault);
        if (--g->attempts > 0)
            set_timer(g, DR_TIMER_TASK, now + (PROVE_ATTEMPTS - g->attempts) * PROVE_RETRY_US);
        else
            end_task(g);
        return;
    }
    if (g->task == TASK_CHECK)
        refuse_pending(g, now, because(DR_REASON_NO_POSITION));
    fail(g, now, fault);
}

static void bad_reading(dr_guard *g, dr_us now)
{
    log_bytes(g, now, DR_EVENT_IMPLAUSIBLE, 0, DR_OP_NONE, g->read, g->read_have);
    if (g->read_again) {
        give_up_reading(g, now, DR_FAULT_IMPLAUSIBLE);
        return;
    }
    g->read_again = true;
    g->read_phase = READ_QUIETS;
    set_timer(g, DR_TIMER_READ, now + QUIET_US);
}

static void push_reading(dr_guard *g, dr_us now, uint8_t byte)
{
    dr_reply reply;
    g->read[g->read_have++] = byte;
    if (g->read_have < DR_REPLY_MAX) {
        set_timer(g, DR_TIMER_READ, now + REPLY_GAP_US);
        return;
    }
    if (is_plausible(g, g->read, &reply))
        use_reading(g, now, &reply);
    else
        bad_reading(g, now);
}

/* -- From the controller ------------------------------------------------------------------------------------------------------ */

static void flush_quarantined(dr_guard *g, dr_us now)
{
    log_bytes(g, now, DR_EVENT_QUARANTINED, 0, DR_OP_NONE, g->quarantined, g->quarantined_count);
    g->quarantined_count = 0;
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
        set_timer(g, DR_TIMER_NOISE, now + NOISE_US);
    if (g->task == TASK_STOP || g->mode == MODE_LOCKED || g->noise > NOISE_MAX)
        return;
    if (++g->noise > NOISE_MAX)
        fail(g, now, DR_FAULT_DEVICE_NOISE);
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
        put_host(g, byte);
    return true;
}

/* A host's query or setting was answered in full: what does the guard learn from it? */
static void learn(dr_guard *g, dr_us now)
{
    dr_reply reply;
    switch (g->command.op) {
    case DR_OP_TRIO_POSITION:
    case DR_OP_MPC_POSITION:
        if (!is_plausible(g, g->reply, &reply)) {
            g->task = TASK_RECHECK;
            start_reading(g, now, QUIET_US);
            break;
        }
        if (g->mode == MODE_ARMED && has_jumped(g, now, &reply))
            latch(g, DR_FAULT_POSITION_JUMP);
        know_place(g, now, &reply);
        break;
    case DR_OP_MPC_SELECT:
        if (dr_wire_get_reply(&g->command, g->reply, g->command.reply, &reply) &&
            (g->command.reply == 1u || reply.value == g->request.value))
            g->scene.chosen = (uint8_t)(g->request.value - 1u);
        break;
    case DR_OP_MPC_ACTIVE:
        if (dr_wire_get_reply(&g->command, g->reply, g->command.reply, &reply) && g->command.reply > 2u &&
            reply.firmware != g->limits->firmware) {
            g->other_firmware = true; /* a position cannot prove the opposite: until it is plugged in anew */
            lock(g, DR_FAULT_IDENTITY);
        }
        break;
    default:
        break;
    }
}

static void push_passed(dr_guard *g, dr_us now, uint8_t byte)
{
    put_host(g, byte);
    if (g->reply_have < DR_REPLY_MAX)
        g->reply[g->reply_have] = byte;
    if (++g->reply_have < g->reply_want) {
        set_timer(g, DR_TIMER_TASK, now + REPLY_GAP_US);
        return;
    }
    log_bytes(g, now, DR_EVENT_REPLY, g->command.op, g->command.op, g->reply,
              g->reply_have < DR_REPLY_MAX ? g->reply_have : DR_REPLY_MAX);
    end_task(g);
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
            set_timer(g, DR_TIMER_PROOF, now + PROOF_OF_REST_US);
        }
    }
    quarantine(g, now, byte);
    if (!g->stop_waits && g->read_phase == READ_OFF)
        set_timer(g, DR_TIMER_TASK, now + QUIET_US);
}

static void push_device_byte(dr_guard *g, dr_us now, uint8_t byte)
{
    const bool sent = g->out_at == g->out_count;
    if (g->limits == NULL) {
        g->quarantined_bytes++;
        return;
    }
    if (g->read_phase == READ_SENT && sent) {
        push_reading(g, now, byte);
        return;
    }
    if (g->read_phase == READ_QUIETS)
        set_timer(g, DR_TIMER_READ, now + QUIET_US);
    else if (g->read_phase == READ_WAITS && dr_us_before(g->at[DR_TIMER_READ], now + FRAME_GAP_US))
        set_timer(g, DR_TIMER_READ, now + FRAME_GAP_US);
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
        start_reading(g, now, FRAME_GAP_US);
    } else {
        quarantine(g, now, byte);
        if (g->task == TASK_SEND && g->out_at == 0) { /* the reply was longer than a reply: not to be believed */
            withdraw(g);
            g->task = TASK_CHECK;
            bad_reading(g, now);
        }
    }
}

/* -- From the host -------------------------------------------------------------------------------------------------------------- */

static void pass(dr_guard *g, dr_us now, const dr_command *command, const dr_request *request, const uint8_t *frame)
{
    const uint8_t length = (uint8_t)(1u + command->args);
    g->command = *command;
    g->request = *request;
    g->task = TASK_PASS;
    g->reply_have = 0;
    g->reply_want = command->reply;
    g->forwarded++;
    put_out(g, frame, length, length);
    set_timer(g, DR_TIMER_TASK, now + REPLY_TIMEOUT_US);
    log_bytes(g, now, DR_EVENT_ALLOWED, 0, command->op, frame, length);
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
    set_timer(g, DR_TIMER_TASK, now + REPLY_TIMEOUT_US);
    send_stop(g, now, DR_STOP_HOST);
}

/* 0x03 from the host while something is under way. */
static void stop_by_host(dr_guard *g, dr_us now)
{
    if (g->task == TASK_STOP && g->stop_owed >= HOST_STOPS_MAX && is_running(g, DR_TIMER_PROOF)) {
        drop(g, now, DR_REASON_BUSY, DR_INTERRUPT); /* their answers would keep rest from being proved */
    } else if (g->task == TASK_STOP) {
        if (g->stop_owed < UINT8_MAX)
            g->stop_owed++;
        send_stop(g, now, DR_STOP_HOST);
    } else if (g->task == TASK_MOVE && !is_stoppable(g)) {
        send_stop(g, now, DR_STOP_HOST); /* it will not be heard, and the move's own CR will tell the end */
    } else {
        begin_stop(g, now, DR_STOP_HOST, DR_FAULT_NONE, 1);
    }
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
    flush_dropped(g, now);
    clear_timer(g, DR_TIMER_FRAME);
    if ((command->is & DR_IS_INTERRUPT) != 0) {
        pass_stop(g, now, command);
        return;
    }
    const dr_request request = dr_wire_get_request(command, frame);
    const dr_verdict shape = dr_judge_frame(g->limits, command, &request);
    const dr_reason reason = may_pass(g, command);
    if (shape.reason != DR_REASON_NONE && command->op != DR_OP_MPC_SELECT) {
        refuse(g, now, command, frame, shape);
        resync(g, now);
    } else if (reason != DR_REASON_NONE) {
        refuse(g, now, command, frame, because(reason));
    } else if (shape.reason != DR_REASON_NONE) {
        refuse(g, now, command, frame, shape);
        if (command->reply > 1u) { /* the one documented error reply [M table 9] */
            put_host(g, DR_NO_SUCH_DRIVE);
            put_host(g, DR_CR);
        }
    } else if ((command->is & DR_IS_MOTION) == 0) {
        pass(g, now, command, &request, frame);
    } else {
        g->command = *command;
        g->request = request;
        memcpy(g->frame, frame, (size_t)1u + command->args);
        g->task = TASK_CHECK;
        start_reading(g, now, FRAME_GAP_US);
    }
}

/* Bytes that hosts and ports emit between frames: clients append CR or LF, ports 0xF0 and 0xFF when they are opened. */
static bool is_filler(uint8_t byte)
{
    return byte == DR_CR || byte == DR_LF || byte == 0x00u || byte == 0xF0u || byte == 0xFFu;
}

static void push_host_byte(dr_guard *g, dr_us now, uint8_t byte)
{
    dr_command command = {0, 0, 0, 0, 0, 0, 0};
    if (g->limits == NULL) {
        if (byte == DR_INTERRUPT)
            send_stop(g, now, DR_STOP_HOST);
        else
            drop(g, now, DR_REASON_NOT_ARMED, byte);
        return;
    }
    const bool busy = g->task != TASK_NONE && g->task != TASK_PASS;
    if (byte == DR_INTERRUPT && busy) { /* at any offset: a stop too many is cheap */
        stop_by_host(g, now);
        if (g->framer.have == 0)
            return;
    }
    if (g->resync) {
        set_timer(g, DR_TIMER_RESYNC, now + RESYNC_US);
        drop(g, now, DR_REASON_RESYNC, byte);
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
    g->tainted = g->tainted || g->task != TASK_NONE;
    switch (dr_framer_push(&g->framer, kind_of(g), g->limits->firmware, byte, &command)) {
    case DR_FRAMED_WHOLE:
        take_frame(g, now, &command, g->framer.bytes);
        break;
    case DR_FRAMED_PART: {
        const dr_us whole = g->frame_began + FRAME_TIMEOUT_US, next = now + BYTE_TIMEOUT_US;
        set_timer(g, DR_TIMER_FRAME, dr_us_before(whole, next) ? whole : next);
        break;
    }
    default:
        drop(g, now, DR_REASON_UNKNOWN, byte);
        resync(g, now);
        break;
    }
}

static void drop_frame(dr_guard *g, dr_us now)
{
    for (uint8_t i = 0; i < g->framer.have; i++)
        drop(g, now, DR_REASON_TORN, g->framer.bytes[i]);
    dr_framer_reset(&g->framer);
    clear_timer(g, DR_TIMER_FRAME);
    flush_dropped(g, now);
    resync(g, now);
}

/* -- What happens by itself ---------------------------------------------------------------------------------------------------- */

static void task_due(dr_guard *g, dr_us now)
{
    switch (g->task) {
    case TASK_PROVE:
        start_reading(g, now, 0);
        break;
    case TASK_PASS:
        if (is_leaving(g)) { /* nobody pulls on it */
            set_timer(g, DR_TIMER_TASK, now + REPLY_TIMEOUT_US);
            break;
        }
        log_event(g, now, DR_EVENT_NO_REPLY, g->command.op, DR_NO_ITEM);
        withdraw(g);
        end_task(g);
        break;
    case TASK_MOVE:
        if (g->small) { /* ignored without a CR, or over: the position tells */
            g->task = TASK_VERIFY;
            start_reading(g, now, 0);
        } else {
            begin_stop(g, now, DR_STOP_DEADLINE, DR_FAULT_NO_CR, 0);
        }
        break;
    default: /* TASK_STOP: it has been quiet; without a CR, ^C is repeated first */
        g->stop_waits = false;
        if (!is_running(g, DR_TIMER_REPEAT))
            start_reading(g, now, 0);
        break;
    }
}

static void read_due(dr_guard *g, dr_us now)
{
    if (g->read_phase != READ_SENT)
        send_query(g, now);
    else if (g->read_have > 0)
        bad_reading(g, now);
    else
        give_up_reading(g, now, DR_FAULT_DEVICE_SILENT);
}

static void repeat_due(dr_guard *g, dr_us now)
{
    g->stop_sent++;
    send_stop(g, now, DR_STOP_AGAIN);
    set_timer(g, DR_TIMER_TASK, now + QUIET_US);
    if (g->stop_sent < STOPS_MAX)
        set_timer(g, DR_TIMER_REPEAT, now + REPEAT_STOP_US);
}

static void happen(dr_guard *g, uint8_t timer, dr_us now)
{
    switch (timer) {
    case DR_TIMER_FRAME:
        drop_frame(g, now);
        break;
    case DR_TIMER_RESYNC:
        g->resync = false;
        flush_dropped(g, now);
        break;
    case DR_TIMER_TASK:
        task_due(g, now);
        break;
    case DR_TIMER_READ:
        read_due(g, now);
        break;
    case DR_TIMER_SEND:
        g->out_ready = g->out_at == 0 && g->command.op == DR_OP_MPC_LINE ? LINE_HEAD : g->out_count;
        break;
    case DR_TIMER_PROOF:
        g->buzzer = true;
        g->cut = has_rig(g, DR_RIG_HAS_CUT);
        latch(g, DR_FAULT_UNSTOPPABLE);
        break;
    case DR_TIMER_REPEAT:
        repeat_due(g, now);
        break;
    case DR_TIMER_IDLE:
        if (g->task == TASK_NONE)
            set_mode(g, MODE_DISARMED);
        else
            start_idling(g, now);
        break;
    case DR_TIMER_RATE:
        if (++g->tokens < RATE_TOKENS)
            set_timer(g, DR_TIMER_RATE, now + RATE_US);
        break;
    case DR_TIMER_NOISE:
        flush_quarantined(g, now);
        g->noise = 0;
        break;
    case DR_TIMER_WIRING:
        g->wiring_alarm = true;
        latch(g, DR_FAULT_STOP_WIRING);
        break;
    case DR_TIMER_RELEASE:
        g->stop_latched = false;
        break;
    default: /* DR_TIMER_STALE has run out: nothing to do */
        break;
    }
}

static bool earliest(const dr_guard *g, uint8_t *timer)
{
    bool any = false;
    for (uint8_t i = 0; i < DR_TIMERS; i++)
        if (is_running(g, i) && (!any || dr_us_before(g->at[i], g->at[*timer]))) {
            *timer = i;
            any = true;
        }
    return any;
}

static void settle(dr_guard *g, dr_us now)
{
    uint8_t timer = 0;
    for (uint16_t i = 0; i < EVENTS_MAX && earliest(g, &timer) && !dr_us_before(now, g->at[timer]); i++) {
        const dr_us when = g->at[timer];
        clear_timer(g, timer);
        happen(g, timer, when);
        show_state(g, when);
    }
}

bool dr_guard_due(const dr_guard *g, dr_us *when)
{
    uint8_t timer = 0;
    if (!earliest(g, &timer))
        return false;
    *when = g->at[timer];
    return true;
}

/* -- Both sides -------------------------------------------------------------------------------------------------------------------- */

void dr_guard_push_host(dr_guard *g, dr_us now, const uint8_t *bytes, size_t count)
{
    settle(g, now);
    for (size_t i = 0; i < count; i++)
        push_host_byte(g, now, bytes[i]);
    show_state(g, now);
}

void dr_guard_push_device(dr_guard *g, dr_us now, const uint8_t *bytes, size_t count)
{
    settle(g, now);
    for (size_t i = 0; i < count; i++)
        push_device_byte(g, now, bytes[i]);
    show_state(g, now);
}

/* The last byte of a frame, or of the guard's own query, is on the wire. */
static void frame_sent(dr_guard *g, dr_us now)
{
    if (g->task == TASK_SEND) {
        g->task = TASK_MOVE;
        set_timer(g, DR_TIMER_TASK, now + longest_us(g));
    } else if (g->task == TASK_STOP && g->read_phase == READ_OFF) { /* the stop that had to wait for it begins now */
        set_timer(g, DR_TIMER_TASK, now + QUIET_US);
        set_timer(g, DR_TIMER_PROOF, now + PROOF_OF_REST_US);
        set_timer(g, DR_TIMER_REPEAT, now + REPEAT_STOP_US);
    }
}

size_t dr_guard_pull_device(dr_guard *g, dr_us now, uint8_t *bytes, size_t room)
{
    size_t count = 0;
    settle(g, now);
    while (count < room) { /* at most room times */
        if (g->stops_out > 0 && !is_leaving(g)) {
            g->stops_out--;
            bytes[count++] = DR_INTERRUPT;
        } else if (g->out_at < g->out_ready) {
            bytes[count++] = g->out[g->out_at++];
            if (g->out_at == g->out_count)
                frame_sent(g, now);
            else if (g->out_at == g->out_ready)
                set_timer(g, DR_TIMER_SEND, now + LINE_PAUSE_US);
        } else {
            break;
        }
    }
    show_state(g, now);
    return count;
}

size_t dr_guard_pull_host(dr_guard *g, dr_us now, uint8_t *bytes, size_t room)
{
    size_t count = 0;
    settle(g, now);
    while (count < room && g->to_host_count > 0) { /* at most room times */
        bytes[count++] = g->to_host[g->to_host_first];
        g->to_host_first = (uint8_t)((g->to_host_first + 1u) % DR_HOST_OUT_MAX);
        g->to_host_count--;
    }
    return count;
}

/* -- People and cables -------------------------------------------------------------------------------------------------------------- */

static uint16_t needs_of(const dr_guard *g)
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

static void key_turned_on(dr_guard *g, dr_us now)
{
    const bool latched = g->mode == MODE_FAULT || g->mode == MODE_STOPPED;
    if (g->limits == NULL || g->task != TASK_NONE || !g->device_present)
        return;
    if (g->mode == MODE_LOCKED && !g->other_firmware && !g->ambiguous) {
        start_proof(g, now);
    } else if (latched && !g->stop_latched && !g->wiring_alarm) {
        g->fault = DR_FAULT_NONE;
        g->buzzer = false;
        set_mode(g, MODE_DISARMED);
        if (g->cut && !has_rig(g, DR_RIG_CALIBRATES_AT_POWER_ON)) { /* power comes back: who is there? */
            g->cut = false;
            lock(g, DR_FAULT_NONE);
            start_proof(g, now);
        }
    }
}

static void stop_pressed(dr_guard *g, dr_us now)
{
    g->stop_latched = true;
    clear_timer(g, DR_TIMER_RELEASE);
    if (g->mode == MODE_ARMED || g->mode == MODE_DISARMED)
        set_mode(g, MODE_STOPPED);
    if (g->limits == NULL)
        send_stop(g, now, DR_STOP_INPUT);
    else if (g->task != TASK_STOP && g->device_present)
        begin_stop(g, now, DR_STOP_INPUT, DR_FAULT_NONE, 0);
}

static void stop_contacts(dr_guard *g, dr_us now)
{
    const bool first = is_on(g, DR_INPUT_STOP), second = is_on(g, DR_INPUT_STOP_2);
    if (first == second) {
        clear_timer(g, DR_TIMER_WIRING);
        g->wiring_alarm = false;
    } else {
        set_timer(g, DR_TIMER_WIRING, now + WIRING_US);
    }
    if (!first && !second)
        set_timer(g, DR_TIMER_RELEASE, now + RELEASE_US);
    else if (!g->stop_latched)
        stop_pressed(g, now);
    else
        clear_timer(g, DR_TIMER_RELEASE);
}

static void arm_pressed(dr_guard *g, dr_us now)
{
    if (g->mode == MODE_DISARMED && needs_of(g) == 0) {
        g->task = TASK_ARM;
        start_reading(g, now, FRAME_GAP_US);
    }
}

static void confirm_pressed(dr_guard *g, dr_us now)
{
    g->tip_changed = false;
    g->confirmed = true;
    if (g->torn) { /* somebody has cycled the controller's power: it has forgotten its half of the frame */
        g->torn = false;
        dr_guard_link(g, now, g->host_open, g->plugged);
    }
    if (g->ambiguous)
        identity_proved(g);
    if (g->cut && g->mode == MODE_DISARMED) { /* somebody has made room for the calibration at power-on */
        g->cut = false;
        lock(g, DR_FAULT_NONE);
        start_proof(g, now);
    }
}

static void input_changed(dr_guard *g, dr_us now, dr_input what, bool on)
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
            disarm(g, now, DR_STOP_KEY);
        break;
    case DR_INPUT_ARM:
        if (on)
            arm_pressed(g, now);
        break;
    case DR_INPUT_TIP_CHANGED:
        if (on) {
            g->tip_changed = true;
            disarm(g, now, DR_STOP_KEY);
        }
        break;
    case DR_INPUT_LOG_FAILED:
        if (on)
            disarm(g, now, DR_STOP_KEY);
        break;
    case DR_INPUT_CONFIRM:
        if (on)
            confirm_pressed(g, now);
        break;
    default: /* levels that are looked at when they matter */
        break;
    }
}

void dr_guard_input(dr_guard *g, dr_us now, dr_input what, bool on)
{
    settle(g, now);
    if (what >= DR_INPUTS || is_on(g, what) == on)
        return;
    g->inputs = (uint16_t)(g->inputs ^ 1u << what);
    log_event(g, now, DR_EVENT_INPUT, (uint8_t)what, on);
    input_changed(g, now, what, on);
    show_state(g, now);
}

static void lose_device(dr_guard *g)
{
    const bool moved = g->task == TASK_MOVE || g->task == TASK_VERIFY || (g->task == TASK_SEND && is_leaving(g)) ||
                       (g->task == TASK_STOP && g->stop_broke_off);
    if (moved)
        break_off_unproved(g);
    end_task(g);
    g->torn = is_leaving(g);
    g->out_at = g->out_count = g->out_ready = g->stops_out = 0;
    clear_timer(g, DR_TIMER_SEND);
    g->position_known = false;
    lock(g, g->torn ? DR_FAULT_TORN : DR_FAULT_NO_DEVICE);
}

static void lose_host(dr_guard *g, dr_us now)
{
    dr_framer_reset(&g->framer);
    clear_timer(g, DR_TIMER_FRAME);
    g->to_host_count = 0;
    if (g->limits->host_loss == DR_HOST_LOSS_FINISH && g->task != TASK_CHECK && g->mode == MODE_ARMED)
        set_mode(g, MODE_DISARMED);
    else
        disarm(g, now, DR_STOP_HOST_LOST);
}

void dr_guard_link(dr_guard *g, dr_us now, bool host_open, bool device_present)
{
    settle(g, now);
    const bool present = device_present && !g->torn;
    const bool host_lost = g->host_open && !host_open, device_lost = g->device_present && !present;
    const bool device_came = !g->device_present && present;
    g->plugged = device_present;
    if (g->host_open == host_open && g->device_present == present)
        return;
    g->host_open = host_open;
    g->device_present = present;
    log_event(g, now, DR_EVENT_LINK, (uint8_t)((host_open ? 1u : 0u) | (present ? 2u : 0u)), DR_NO_ITEM);
    if (device_came && g->after_reset)
        send_stop(g, now, DR_STOP_AFTER_RESET);
    g->after_reset = g->after_reset && !device_came;
    if (g->limits != NULL) {
        if (host_lost)
            lose_host(g, now);
        if (device_lost)
            lose_device(g);
        if (device_came) {
            g->other_firmware = false;
            start_proof(g, now);
        }
    }
    show_state(g, now);
}

void dr_guard_host_line_error(dr_guard *g, dr_us now)
{
    settle(g, now);
    drop_frame(g, now);
}

bool dr_guard_self_check(dr_guard *g, dr_us now)
{
    settle(g, now);
    if (g->limits != NULL && !is_intact(g))
        fall_back(g, now);
    show_state(g, now);
    return g->limits != NULL;
}

void dr_guard_get_status(const dr_guard *g, dr_guard_status *out)
{
    *out = (dr_guard_status){.state = (uint8_t)state_of(g), .fault = g->fault, .needs = needs_of(g)};
    if (g->limits != NULL) {
        const bool outside = g->position_known &&
                             dr_judge_place(g->limits, g->scene.drive, g->scene.start_steps).reason != DR_REASON_NONE;
        if (outside && !is_on(g, DR_INPUT_ESCAPE))
            out->needs |= DR_NEEDS_INSIDE;
        if (g->unsteady)
            out->needs |= DR_NEEDS_STEADY;
        out->confirm_wanted = g->ambiguous || g->tip_changed || (g->limits->obstacle_count == 0 && !g->confirmed) ||
                              (g->cut && g->mode == MODE_DISARMED) || g->torn;
    }
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

bool dr_guard_pull_log(dr_guard *g, dr_record *out) { return dr_log_take(&g->log, out); }

/* -- Setting up ------------------------------------------------------------------------------------------------------------------------ */

void dr_guard_init(dr_guard *g, const dr_limits *limits, dr_record *ring, uint16_t size)
{
    dr_limits_problem problem;
    memset(g, 0, sizeof *g);
    dr_log_init(&g->log, ring, size);
    g->limits = limits != NULL && dr_limits_check(limits, &problem) ? limits : NULL;
    g->limits_crc = g->limits == NULL ? 0 : dr_limits_crc(limits);
    g->tokens = RATE_TOKENS;
    g->last_refusal = because(DR_REASON_NONE);
    set_mode(g, MODE_LOCKED);
    g->fault = (uint8_t)(g->limits == NULL ? DR_FAULT_LIMITS : DR_FAULT_NO_DEVICE);
}

void dr_guard_start(dr_guard *g, dr_us now, bool after_reset)
{
    dr_record record = record_of(g, now, DR_EVENT_START, after_reset);
    record.position_steps[0] = g->limits_crc;
    record.position_steps[1] = g->limits == NULL ? 0 : g->limits->revision;
    dr_log_put(&g->log, &record);
    g->after_reset = after_reset;
}
