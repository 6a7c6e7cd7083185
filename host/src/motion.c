/* Motions: how long they may last, waiting for their end, streamed frames, and whether they arrived.
 *
 * A CR alone proves nothing: it may be a late one of an older command, or line noise. A motion is over when a CR came
 * and the stage stands, and it has succeeded when it stands at its target. A CR that comes long before the motion can
 * be over is followed by more listening. */
#include "session.h"

#include "dr_words.h" /* dr_words_controller */

#include <stdio.h>
#include <string.h>

#define EARLY 0.4                     /* of the documented time: real units were seen to be 2.1 times faster, */
#define EARLY_LINE 0.2                /* and 4.2 times in slow straight lines [P] */
#define EARLY_WAIT_US (1000u * MS_US) /* for the true end, after an early CR */
#define STILL_US (50u * MS_US)        /* between two looks that show whether it still moves: 4 um at the slowest */
#define AGAIN_US (100u * MS_US)       /* until the next look, while it does */
#define SMALL_STEPS 16                /* MPC: moves below this on all axes may be ignored [P, small-move-silent] */
#define SMALL_WAIT_US (300u * MS_US)
#define STOPS_MAX 3                 /* ^C is repeated where it is not answered */
#define STOP_AGAIN_US (25u * MS_US) /* longer than USB adapters hold back the CR */
#define TORN_US (200u * MS_US) /* silence that shows that a frame is torn: the slowest stream has 12 ms between two */
#define WATCH_US (100u * MS_US)
#define ARRIVED_STEPS 2 /* a motion that ended so near has arrived: the last step may be rounded */

enum { IDLE, STOPPABLE, UNSTOPPABLE }; /* dryrig.stoppable */

/* -- What is asked for --------------------------------------------------------------------------------------------- */

typedef struct {
    dr_request request;
    dr_command row;
    bool stream;
    bool in_turn;        /* axes may move one after the other */
    bool known[DR_AXES]; /* is this axis's end known? */
    dryrig_position start;
    dr_stage_id stage;
    double shortest_us, longest_us; /* by distance and documented speed */
} plan;

static double distance(const plan *p, size_t axis)
{
    const double way = (double)p->request.steps[axis] - (double)p->start.steps[axis];
    return way < 0 ? -way : way;
}

/* Over all stages that it may be. An axis that goes nobody knows where may go to and fro. */
static void time_plan(const dryrig *d, plan *p)
{
    const bool is_line = p->row.op == DR_OP_TRIO_LINE || p->row.op == DR_OP_MPC_LINE;
    bool first = true;
    for (int id = DR_STAGE_NONE + 1; id < DR_STAGES; id++) {
        dr_stage stage;
        if ((p->stage != DR_STAGE_NONE && id != (int)p->stage) || !dr_stage_get((dr_stage_id)id, &stage) ||
            stage.kind != d->kind)
            continue;
        const double speed = dr_speed_quanta_per_s((dr_stage_id)id, is_line ? p->request.value : DR_SPEED_FULL);
        double sum_us = 0, most_us = 0, known_us = 0;
        for (size_t axis = 0; axis < DR_AXES; axis++) {
            const double steps = p->known[axis] ? distance(p, axis) : 2.0 * stage.travel_steps[axis];
            const double us = steps * stage.quanta_per_step / speed * DR_US_PER_S;
            sum_us += us;
            most_us = us > most_us ? us : most_us;
            known_us = p->known[axis] && us > known_us ? us : known_us;
        }
        const double longest_us = p->in_turn ? sum_us : most_us;
        p->longest_us = first || longest_us > p->longest_us ? longest_us : p->longest_us;
        p->shortest_us = first || known_us < p->shortest_us ? known_us : p->shortest_us;
        first = false;
    }
}

static bool is_small(const dryrig *d, const plan *p)
{
    for (size_t axis = 0; axis < DR_AXES; axis++)
        if (!p->known[axis] || distance(p, axis) >= SMALL_STEPS)
            return false;
    return d->kind == DR_MPC && (p->row.is & DR_IS_TARGETED);
}

static bool same_place(const dryrig_position *a, const dryrig_position *b)
{
    return memcmp(a->steps, b->steps, sizeof a->steps) == 0;
}

static dryrig_position nowhere(void)
{
    dryrig_position p;
    memset(&p, 0, sizeof p);
    p.drive = -1;
    return p;
}

/* -- What comes back: CR, streamed frames, and what real units add ------------------------------------------------- */

typedef struct {
    uint64_t began_us, heard_us, watched_us, stopped_us;
    int stops;     /* ^C sent */
    bool by_hand;  /* 'I': STOP on the ROE [P, stop-says-i] */
    bool by_guard; /* 'E' and nothing else: a guard before the controller has refused it */
    bool is_first; /* the byte that is looked at is the first */
    bool hunting;  /* lost the thread; looks for a signature */
    uint8_t held[DR_STREAM_FRAME];
    size_t count;
} watch;

static void tell(dryrig *d, const plan *p, watch *w, const dr_reply *streamed)
{
    w->watched_us = now_us(d);
    if (d->callback == NULL)
        return;
    dryrig_motion motion;
    memset(&motion, 0, sizeof motion);
    motion.streamed = streamed != NULL;
    motion.position = streamed != NULL ? to_position(d, streamed) : p->start;
    motion.elapsed_ms = (uint32_t)((w->watched_us - w->began_us) / MS_US);
    motion.expected_ms = (uint32_t)(p->longest_us / MS_US);
    d->callback(d->callback_context, &motion);
}

/* A streamed position lies between start and target; what does not is a torn frame. */
static bool read_frame(const dryrig *d, const plan *p, const uint8_t *bytes, dr_reply *out)
{
    memset(out, 0, sizeof *out);
    out->value = (uint8_t)p->start.drive;
    if (d->kind != DR_MPC || !dr_wire_get_stream(bytes, out->steps))
        return false;
    for (size_t axis = 0; axis < DR_AXES; axis++) {
        const int64_t at = out->steps[axis], from = p->start.steps[axis], to = (int64_t)p->request.steps[axis];
        if (at + ARRIVED_STEPS < (from < to ? from : to) || at - ARRIVED_STEPS > (from < to ? to : from))
            return false;
    }
    return true;
}

static void drop_first(watch *w) { memmove(w->held, w->held + 1, --w->count); }

/* Reads what is held as far as it goes. True: CR. */
static bool read_held(dryrig *d, const plan *p, watch *w)
{
    while (w->count > 0) {
        size_t signature = 0;
        dr_reply frame;
        while (signature < w->count && signature < 3u && w->held[signature] == 0xFF)
            signature++;
        if (signature == w->count || (signature == 3u && w->count < DR_STREAM_FRAME))
            return false; /* so far, a frame */
        if (signature == 3u && read_frame(d, p, w->held, &frame)) {
            w->count = 0;
            w->hunting = false;
            if (p->stream)
                tell(d, p, w, &frame);
            continue;
        }
        const uint8_t byte = w->held[0];
        if (w->hunting && w->count == 1 && byte == DR_CR)
            return false; /* the end, or a coordinate of a torn frame: silence will tell */
        drop_first(w);
        if (!w->hunting && byte == DR_CR)
            return true;
        if (!w->hunting && byte == 'I' && d->kind == DR_MPC)
            w->by_hand = w->stops == 0;
        else if (!w->hunting && w->is_first && byte == DR_NO_SUCH_DRIVE) /* no controller answers a motion so */
            w->by_guard = w->stops == 0;
        else if (byte != 0 || d->kind != DR_MPC) /* heartbeats [P, nul-heartbeat] */
            w->hunting = true;
    }
    return false;
}

static bool read_byte(dryrig *d, const plan *p, watch *w, uint8_t byte)
{
    w->held[w->count++] = byte; /* read_held() leaves room for one */
    return read_held(d, p, w);
}

/* Nothing follows a torn frame any more. True: its last byte was the CR. */
static bool give_up_frame(watch *w)
{
    const bool ended = w->count > 0 && w->held[w->count - 1u] == DR_CR;
    w->count = 0;
    w->hunting = false;
    return ended;
}

/* -- Waiting ------------------------------------------------------------------------------------------------------- */

static bool interrupt_is_wanted(dryrig *d) { return __atomic_load_n(&d->interrupted, __ATOMIC_SEQ_CST) != 0; }

typedef enum { TIME_UP, ENDED, NO_CR } outcome; /* or a negative error */

/* Takes what the line has within timeout_us. ENDED: and a CR ended it. */
static int take(dryrig *d, const plan *p, watch *w, uint32_t timeout_us)
{
    uint8_t bytes[DR_STREAM_FRAME];
    const int count = hear(d, bytes, sizeof bytes, timeout_us);
    if (count < 0)
        return count;
    w->heard_us = count > 0 ? now_us(d) : w->heard_us;
    for (int i = 0; i < count; i++) {
        w->by_guard = false;
        const bool has_ended = read_byte(d, p, w, bytes[i]);
        w->is_first = false;
        if (has_ended) {
            if (i + 1 < count) /* something behind the end */
                d->doubt = DOUBT_LATE;
            return ENDED;
        }
    }
    return TIME_UP;
}

static int wait_for_end(dryrig *d, const plan *p, watch *w, uint64_t until_us)
{
    for (;;) {
        int result = TIME_UP;
        const uint64_t at_us = now_us(d);
        if (w->stops == STOPS_MAX && at_us - w->stopped_us >= STOP_AGAIN_US)
            return TIME_UP;
        if ((p->row.is & DR_IS_STOPPABLE) && interrupt_is_wanted(d) &&
            (w->stops == 0 || at_us - w->stopped_us >= STOP_AGAIN_US)) {
            result = take(d, p, w, 0); /* it may have ended by itself */
            if (result == TIME_UP)
                result = send_interrupt(d);
            if (result != DRYRIG_OK)
                return result;
            w->stops++;
            w->stopped_us = now_us(d);
        }
        if (at_us >= until_us)
            return TIME_UP;
        const uint64_t left_us = until_us - at_us;
        result = take(d, p, w, left_us < SLICE_US ? (uint32_t)left_us : SLICE_US);
        if (result == TIME_UP && now_us(d) - w->heard_us >= TORN_US) {
            if (w->by_hand || w->by_guard)
                return NO_CR; /* it never comes */
            result = give_up_frame(w) ? ENDED : TIME_UP;
        }
        if (result != TIME_UP)
            return result;
        if (now_us(d) - w->watched_us >= WATCH_US)
            tell(d, p, w, NULL);
    }
}

/* -- Arrival ------------------------------------------------------------------------------------------------------- */

typedef struct {
    char text[128];
} place;

/* Where it stands, for people: in microns too where the stage is known. */
static place place_of(const dryrig_position *at)
{
    place p;
    const int32_t *steps = at->steps;
    const int length = snprintf(p.text, sizeof p.text, "%d, %d, %d steps", steps[0], steps[1], steps[2]);
    if (at->has_um && length > 0)
        (void)snprintf(p.text + length, sizeof p.text - (size_t)length, " (%.3f, %.3f, %.3f um)", at->um[0], at->um[1],
                       at->um[2]);
    return p;
}

static int judge(dryrig *d, const plan *p, const watch *w, const dryrig_position *end)
{
    if (w->stops > 0) {
        __atomic_store_n(&d->interrupted, 0, __ATOMIC_SEQ_CST);
        return fail(d, DRYRIG_ERR_INTERRUPTED, "interrupted; the stage stands at %s%s", place_of(end).text,
                    p->row.op == DR_OP_MPC_CALIBRATE ? ", uncalibrated until a power cycle and a whole calibration"
                                                     : "");
    }
    if (w->by_hand)
        return fail(d, DRYRIG_ERR_STOPPED, "STOP was pressed on the ROE; the stage stands at %s", place_of(end).text);
    const bool moved = !same_place(&p->start, end);
    if (w->by_guard && !moved)
        return fail(d, DRYRIG_ERR_REFUSED,
                    "a guard before the controller has refused it; 'dryrig-guard ctl SOCKET status' says why");
    bool exact = true, near = true;
    for (size_t axis = 0; axis < DR_AXES; axis++) {
        const int64_t off = p->known[axis] ? (int64_t)end->steps[axis] - (int64_t)p->request.steps[axis] : 0;
        exact = exact && off == 0;
        near = near && off >= -ARRIVED_STEPS && off <= ARRIVED_STEPS;
    }
    if (p->row.op == DR_OP_MPC_WORK && !moved)
        return fail(d, DRYRIG_ERR_STOOD_STILL,
                    "the stage stood still: an MPC-200 goes to the work position only right "
                    "after a home, and only when one is stored (STOP/SET with WORK on the ROE)");
    if (exact || (near && moved))
        return DRYRIG_OK;
    d->doubt = DOUBT_LATE;
    if (d->kind == DR_TRIO && (end->angle_deg == 0 || end->angle_deg == DRYRIG_ANGLE_MAX_DEG))
        return fail(d, moved ? DRYRIG_ERR_ELSEWHERE : DRYRIG_ERR_STOOD_STILL,
                    "the stage did not reach its target: with the angle set to %d degrees the %c axis does not move",
                    end->angle_deg, end->angle_deg == 0 ? 'Z' : 'X');
    if (!moved)
        return fail(d, DRYRIG_ERR_STOOD_STILL, "the stage stood still%s",
                    is_small(d, p) ? ": this controller ignores moves of under 16 steps" : "");
    return fail(
        d, DRYRIG_ERR_ELSEWHERE,
        "the stage stands at %s, not at its target: stopped on the controller, blocked, or an older move was resumed",
        place_of(end).text);
}

/* No CR within the limit. What can be stopped is stopped: it has overrun all margins. */
static int overdue(dryrig *d, const plan *p, const watch *w, dryrig_position *end)
{
    const unsigned waited_ms = (unsigned)((now_us(d) - w->began_us) / MS_US);
    int result;
    *end = nowhere(); /* what was seen on the way does not count */
    if (is_small(d, p) && w->stops == 0) {
        d->doubt = DOUBT_LATE;
        result = settle(d, STILL_US, end);
        return result == DRYRIG_OK ? judge(d, p, w, end) : result;
    }
    if (!(p->row.is & DR_IS_STOPPABLE)) {
        d->doubt = p->row.args > 0 ? DOUBT_TORN : DOUBT_LATE;
        return fail(d, DRYRIG_ERR_TIMEOUT,
                    "no CR within %u.%03u s: the move may still run (paused on the controller?), "
                    "and a TRIO cannot stop it",
                    waited_ms / 1000u, waited_ms % 1000u);
    }
    d->doubt = DOUBT_MOVING;
    result = settle(d, STILL_US, end);
    if (result < 0)
        return result;
    if (w->stops > 0)
        return judge(d, p, w, end);
    return fail(d, DRYRIG_ERR_TIMEOUT, "no CR within %u.%03u s; ^C was sent, and the stage stands at %s",
                waited_ms / 1000u, waited_ms % 1000u, place_of(end).text);
}

static int run(dryrig *d, const plan *p, dryrig_position *end)
{
    watch w;
    memset(&w, 0, sizeof w);
    w.is_first = true;
    const bool stoppable = p->row.is & DR_IS_STOPPABLE;
    __atomic_store_n(&d->stoppable, stoppable ? STOPPABLE : UNSTOPPABLE, __ATOMIC_SEQ_CST);
    int result = send(d, &p->request);
    w.began_us = w.heard_us = w.watched_us = now_us(d);
    const uint64_t limit_us = w.began_us + (is_small(d, p) ? (uint64_t)p->longest_us + SMALL_WAIT_US
                                                           : (uint64_t)(p->longest_us * d->margin) + d->grace_us);
    const double early = p->row.op == DR_OP_MPC_LINE ? EARLY_LINE : EARLY;
    uint64_t until_us = limit_us;
    bool has_ended = false;
    for (bool unsure = false; result >= 0; unsure = true) {
        result = wait_for_end(d, p, &w, until_us);
        has_ended = has_ended || result > TIME_UP;
        if (result == TIME_UP && (!unsure || now_us(d) >= limit_us))
            return overdue(d, p, &w, end);
        if (result == ENDED && w.stops == 0 && !d->is_fast &&
            (double)(now_us(d) - w.began_us) < early * p->shortest_us) {
            const uint64_t over_us = w.began_us + (uint64_t)p->longest_us + QUIET_US,
                           wait_us = now_us(d) + EARLY_WAIT_US;
            result = wait_for_end(d, p, &w, over_us < wait_us ? over_us : wait_us);
            unsure = true;
        }
        if (result >= 0 && w.stops > 0) /* two CRs when it ended just before ^C came: the move's, and the idle ^C's */
            result = drain(d, QUIET_US, DRAIN_US);
        if (result < 0)
            break;
        result = settle(d, unsure ? STILL_US : 0, end);
        if (result == DRYRIG_OK)
            return judge(d, p, &w, end);
        if (result != DRYRIG_ERR_CHANGING || now_us(d) >= limit_us)
            break;
        until_us = now_us(d) + AGAIN_US; /* it moves: that CR was not its own */
        until_us = until_us < limit_us ? until_us : limit_us;
        result = DRYRIG_OK;
    }
    if (!has_ended)
        d->doubt = stoppable ? DOUBT_MOVING : p->row.args > 0 ? DOUBT_TORN : DOUBT_LATE;
    return result;
}

/* -- Asking for it ------------------------------------------------------------------------------------------------- */

/* What a public function wants. Targets are copies: a caller may pass one place as target and as end. */
typedef struct {
    dr_op op;
    enum { NO_TARGET, IN_UM, IN_STEPS } target;
    double um[DR_AXES];
    int32_t steps[DR_AXES];
    size_t axis; /* the target's only axis; DR_AXES: all */
    int level;   /* of a straight line */
    bool stream;
    dryrig_order order;
} wish;

/* The target, as far as it can be known without asking where the stage is; checked. */
static int take_target(dryrig *d, const wish *want, dr_stage_id stage, plan *p)
{
    int32_t steps[DR_AXES];
    memcpy(steps, want->steps, sizeof steps);
    int result = want->target == IN_UM ? convert_um(d, stage, want->um, steps) : DRYRIG_OK;
    if (result == DRYRIG_OK)
        result = check_target(d, stage, steps);
    for (size_t axis = 0; result == DRYRIG_OK && axis < DR_AXES; axis++)
        p->request.steps[axis] = (uint32_t)steps[axis];
    return result;
}

/* What can be refused before the controller is asked anything: what no drive that may be the active one can do. */
static int refuse_early(dryrig *d, const wish *want)
{
    if (want->level < 0 || want->level >= DRYRIG_SPEEDS)
        return fail(d, DRYRIG_ERR_RANGE, "speed level %d: there are 0 (slowest) to 15", want->level);
    if (want->stream && d->kind == DR_TRIO)
        return fail(d, DRYRIG_ERR_UNSUPPORTED, "a TRIO streams no positions");
    if (want->target == NO_TARGET)
        return DRYRIG_OK;
    const bool any = d->kind == DR_MPC && d->drive == 0;
    int result = DRYRIG_OK;
    for (int drive = any ? 1 : d->drive; drive <= (any ? DRYRIG_DRIVES : d->drive); drive++) {
        plan unused;
        const dr_stage_id stage = stage_of(d, drive);
        if (any && want->target == IN_UM && stage == DR_STAGE_NONE && (result < 0 || drive < DRYRIG_DRIVES))
            continue; /* the others' stages may be known */
        result = take_target(d, want, stage, &unused);
        if (result == DRYRIG_OK)
            break;
    }
    return result;
}

static int was_interrupted(dryrig *d)
{
    if (__atomic_exchange_n(&d->interrupted, 0, __ATOMIC_SEQ_CST) == 0)
        return DRYRIG_OK;
    return fail(d, DRYRIG_ERR_INTERRUPTED, "interrupted before it began; nothing was sent");
}

/* Where it stands, and whether that is the drive that the caller means. */
static int find_start(dryrig *d, plan *p)
{
    const int result = settle(d, 0, &p->start);
    if (result < 0)
        return result;
    if (d->drive != 0 && p->start.drive != 0 && p->start.drive != d->drive)
        return fail(d, DRYRIG_ERR_OTHER_DRIVE,
                    "drive %d is active, not drive %u: changed on the ROE? Select the one that "
                    "is meant",
                    p->start.drive, d->drive);
    d->drive = d->drive != 0 ? d->drive : (uint8_t)p->start.drive;
    p->stage = stage_of(d, d->drive);
    return DRYRIG_OK;
}

static int make_plan(dryrig *d, const wish *want, plan *p)
{
    const bool has_target = want->target != NO_TARGET;
    p->request.op = (uint8_t)want->op;
    p->request.value = (uint8_t)want->level;
    p->stream = want->stream;
    if (has_target) {
        const int result = take_target(d, want, p->stage, p);
        if (result < 0)
            return result;
    }
    for (size_t axis = 0; axis < DR_AXES; axis++) {
        p->known[axis] = has_target;
        if (has_target && want->axis != DR_AXES && want->axis != axis)
            p->request.steps[axis] = (uint32_t)p->start.steps[axis];
    }
    if (want->op == DR_OP_TRIO_WORK_TO) /* so the callers; AUTO is decided here [P] */
        p->request.op =
            (uint8_t)(want->order == DRYRIG_ORDER_WORK || (want->order == DRYRIG_ORDER_AUTO &&
                                                           (int64_t)p->request.steps[DR_Z] > p->start.steps[DR_Z])
                          ? DR_OP_TRIO_WORK_TO
                          : DR_OP_TRIO_HOME_TO);
    if (want->op == DR_OP_MPC_HOME) /* to 0,0,0 [P]; whether Y takes part is for its switch 8 [M table 3] */
        p->known[DR_X] = p->known[DR_Z] = true;
    (void)dr_command_for(d->kind, d->firmware, (dr_op)p->request.op, &p->row); /* go() has looked */
    p->in_turn = p->row.op == DR_OP_TRIO_HOME_TO || p->row.op == DR_OP_TRIO_WORK_TO || !has_target;
    time_plan(d, p);
    return DRYRIG_OK;
}

static int set_streaming(dryrig *d, bool on)
{
    const dr_request request = {(uint8_t)(on ? DR_OP_MPC_STREAM_ON : DR_OP_MPC_STREAM_OFF), 0, {0, 0, 0}};
    answer a;
    if (d->kind == DR_TRIO || d->streaming == (on ? 1 : 0))
        return DRYRIG_OK;
    const int result = command(d, &request, &a);
    d->streaming = result < 0 ? -1 : on ? 1 : 0;
    return result;
}

static int go(dryrig *d, const wish *want, dryrig_position *end)
{
    dr_command row;
    plan p;
    memset(&p, 0, sizeof p);
    int result = was_interrupted(d);
    if (result == DRYRIG_OK)
        result = refuse_early(d, want);
    if (result == DRYRIG_OK && d->kind == DR_MPC && want->op != DR_OP_MPC_MOVE && want->op != DR_OP_MPC_HOME &&
        want->op != DR_OP_MPC_WORK)
        result = need_firmware(d); /* the others are known to all */
    if (result < 0)
        return result;
    if ((want->op == DR_OP_MPC_CALIBRATE || want->op == DR_OP_MPC_CENTRE) && !d->firmware_is_known)
        return fail(d, DRYRIG_ERR_UNSUPPORTED,
                    "up to firmware 1.03 'N' centres, later it calibrates, and below 3.00 the "
                    "controller does not tell its version: set options.firmware");
    if (!dr_command_for(d->kind, d->firmware, want->op, &row))
        return fail(d, DRYRIG_ERR_UNSUPPORTED, "firmware %x.%02x has no command to %s", d->firmware >> 8u,
                    d->firmware & 0xFFu, dr_words_command(want->op)->asks);
    result = find_start(d, &p);
    if (result == DRYRIG_OK)
        result = make_plan(d, want, &p);
    if (result == DRYRIG_OK && p.row.op != DR_OP_MPC_HOME && p.known[DR_Y] &&
        distance(&p, DR_X) + distance(&p, DR_Y) + distance(&p, DR_Z) <= 0) {
        *end = p.start;
        return DRYRIG_OK;
    }
    if (result == DRYRIG_OK && row.op == DR_OP_MPC_LINE)
        result = set_streaming(d, want->stream);
    if (result == DRYRIG_OK)
        result = was_interrupted(d);
    return result < 0 ? result : run(d, &p, end);
}

/* Is there something in *end that the caller may look at? */
static bool tells_end(int result)
{
    switch (result) {
    case DRYRIG_OK:
    case DRYRIG_ERR_INTERRUPTED:
    case DRYRIG_ERR_STOPPED:
    case DRYRIG_ERR_STOOD_STILL:
    case DRYRIG_ERR_ELSEWHERE:
    case DRYRIG_ERR_TIMEOUT:
        return true;
    default:
        return false;
    }
}

static int move(dryrig *d, const wish *want, dryrig_position *end)
{
    dryrig_position there = nowhere();
    if (end != NULL)
        *end = nowhere();
    int result = enter(d);
    if (result < 0)
        return result;
    result = go(d, want, &there);
    __atomic_store_n(&d->stoppable, IDLE, __ATOMIC_SEQ_CST);
    if (end != NULL)
        *end = tells_end(result) ? there : nowhere();
    return leave(d, result);
}

static dr_op op_for(const dryrig *d, dr_op trio, dr_op mpc) { return d != NULL && d->kind == DR_TRIO ? trio : mpc; }

static int refuse(dryrig *d, int error, const char *text)
{
    const int result = enter(d);
    return result < 0 ? result : leave(d, fail(d, error, "%s", text));
}

static wish wish_for(dr_op op, const double *um, const int32_t *steps)
{
    wish want;
    memset(&want, 0, sizeof want);
    want.op = op;
    want.axis = DR_AXES;
    want.target = um != NULL ? IN_UM : steps != NULL ? IN_STEPS : NO_TARGET;
    for (size_t axis = 0; axis < DR_AXES; axis++) {
        want.um[axis] = um != NULL ? um[axis] : 0;
        want.steps[axis] = steps != NULL ? steps[axis] : 0;
    }
    return want;
}

static int move_to(dryrig *d, wish want, dryrig_order order, dryrig_position *end)
{
    if (want.target == NO_TARGET || order < DRYRIG_ORDER_AUTO || order > DRYRIG_ORDER_WORK)
        return refuse(d, DRYRIG_ERR_ARGUMENT, "no target, or no such order");
    if (want.op == DR_OP_MPC_MOVE && order != DRYRIG_ORDER_AUTO)
        return refuse(d, DRYRIG_ERR_UNSUPPORTED, "an MPC-200 moves all axes at once: there is no order to choose");
    want.order = order;
    return move(d, &want, end);
}

int dryrig_move_um(dryrig *d, const double target_um[DRYRIG_AXES], dryrig_order order, dryrig_position *end)
{
    return move_to(d, wish_for(op_for(d, DR_OP_TRIO_WORK_TO, DR_OP_MPC_MOVE), target_um, NULL), order, end);
}

int dryrig_move_steps(dryrig *d, const int32_t target_steps[DRYRIG_AXES], dryrig_order order, dryrig_position *end)
{
    return move_to(d, wish_for(op_for(d, DR_OP_TRIO_WORK_TO, DR_OP_MPC_MOVE), NULL, target_steps), order, end);
}

static int line_to(dryrig *d, wish want, int level, bool stream, dryrig_position *end)
{
    if (want.target == NO_TARGET)
        return refuse(d, DRYRIG_ERR_ARGUMENT, "no target");
    want.level = level;
    want.stream = stream;
    return move(d, &want, end);
}

int dryrig_line_um(dryrig *d, const double target_um[DRYRIG_AXES], int speed_level, bool stream, dryrig_position *end)
{
    return line_to(d, wish_for(op_for(d, DR_OP_TRIO_LINE, DR_OP_MPC_LINE), target_um, NULL), speed_level, stream, end);
}

int dryrig_line_steps(dryrig *d, const int32_t target_steps[DRYRIG_AXES], int speed_level, bool stream,
                      dryrig_position *end)
{
    return line_to(d, wish_for(op_for(d, DR_OP_TRIO_LINE, DR_OP_MPC_LINE), NULL, target_steps), speed_level, stream,
                   end);
}

static int axis_to(dryrig *d, int axis, double um, int32_t steps, bool in_um, dryrig_position *end)
{
    double um_of[DR_AXES] = {0, 0, 0};
    int32_t steps_of[DR_AXES] = {0, 0, 0};
    if (axis < DRYRIG_X || axis > DRYRIG_Z)
        return refuse(d, DRYRIG_ERR_ARGUMENT, "no such axis");
    um_of[axis] = um;
    steps_of[axis] = steps;
    wish want = wish_for(op_for(d, (dr_op)(DR_OP_TRIO_X + axis), DR_OP_MPC_MOVE), in_um ? um_of : NULL,
                         in_um ? NULL : steps_of);
    want.axis = (size_t)axis;
    return move(d, &want, end);
}

int dryrig_axis_um(dryrig *d, int axis, double target_um, dryrig_position *end)
{
    return axis_to(d, axis, target_um, 0, true, end);
}

int dryrig_axis_steps(dryrig *d, int axis, int32_t target_steps, dryrig_position *end)
{
    return axis_to(d, axis, 0, target_steps, false, end);
}

static int move_by_name(dryrig *d, dr_op trio, dr_op mpc, dryrig_position *end)
{
    const wish want = wish_for(op_for(d, trio, mpc), NULL, NULL);
    return move(d, &want, end);
}

int dryrig_home(dryrig *d, dryrig_position *end) { return move_by_name(d, DR_OP_TRIO_HOME, DR_OP_MPC_HOME, end); }

int dryrig_work(dryrig *d, dryrig_position *end) { return move_by_name(d, DR_OP_TRIO_WORK, DR_OP_MPC_WORK, end); }

int dryrig_calibrate(dryrig *d, dryrig_position *end)
{
    return move_by_name(d, DR_OP_TRIO_RECALIBRATE, DR_OP_MPC_CALIBRATE, end);
}

int dryrig_centre(dryrig *d, dryrig_position *end) { return move_by_name(d, DR_OP_MPC_CENTRE, DR_OP_MPC_CENTRE, end); }

/* -- Stopping ------------------------------------------------------------------------------------------------------ */

int dryrig_stop(dryrig *d, dryrig_position *end)
{
    dryrig_position there = nowhere();
    if (end != NULL)
        *end = nowhere();
    int result = enter(d);
    if (result < 0)
        return result;
    /* A TRIO gets one ^C: were it the byte that a command waits for, it would begin a motion that nothing stops. */
    result = stop_everything(d, d->kind == DR_TRIO ? 1 : STOPS_THAT_END_ALL);
    if (result == DRYRIG_ERR_CANNOT_STOP && d->kind == DR_TRIO)
        result = fail(d, result,
                      "no answer to ^C: a TRIO answers it at rest and during a straight line; it is off, or in a "
                      "motion that cannot be stopped");
    if (result == DRYRIG_OK) {
        d->doubt = DOUBT_LATE;
        result = settle(d, STILL_US, &there);
    }
    if (result == DRYRIG_OK && end != NULL)
        *end = there;
    return leave(d, result);
}

int dryrig_interrupt(dryrig *d)
{
    if (d == NULL)
        return DRYRIG_ERR_ARGUMENT;
    __atomic_store_n(&d->interrupted, 1, __ATOMIC_SEQ_CST);
    return __atomic_load_n(&d->stoppable, __ATOMIC_SEQ_CST) == UNSTOPPABLE ? DRYRIG_ERR_CANNOT_STOP : DRYRIG_OK;
}

void dryrig_clear_interrupt(dryrig *d)
{
    if (d != NULL)
        __atomic_store_n(&d->interrupted, 0, __ATOMIC_SEQ_CST);
}

void dryrig_watch(dryrig *d, void (*callback)(void *context, const dryrig_motion *motion), void *context)
{
    if (d == NULL || d->within)
        return;
    d->callback = callback;
    d->callback_context = context;
}
