/* Proves, by induction over the events of a guard, for any limits and for input of any length:
 *
 *   no motion begins to leave for the controller unless the guard is armed and the judge has just allowed this very frame;
 *   in LOCKED, FAULT and STOPPED nothing begins to leave but ^C and queries, in DISARMED settings too; nothing at all
 *   while the controller may be within a torn frame;
 *   a frame that has begun to leave stays as it is and goes on leaving, unless the cable or the controller's power goes;
 *   bytes of the host, timers and cables never make the guard less safe (LOCKED, FAULT, STOPPED < DISARMED < ARMED), bytes
 *   of the controller only when they answer the proof of identity or an ARM that a person pressed.
 *
 * The step: valid() holds of a guard of which nothing else is known, one event happens, valid() holds again. Each proof is
 * one kind of event. The base: a guard after dr_guard_init() is valid. The model checker adds to each: no access out of
 * bounds, no overflow, no bad shift. The judge, the limits' check and the log are replaced by functions that may answer
 * anything that their headers allow; begin() is left out, because its timers are events of their own (timer), and so is
 * the seal. */
#include "dr_guard.c" /* with happen(), which is private to it */
#include "proof.h"

static dr_limits limits;
static dr_guard g, before;
static dr_us now;

/* -- What stands in for the judge, the limits' check, the log and the seal ------------------------------------------ */

static bool asked, was_allowed;
static dr_command asked_command;
static dr_request asked_request;

static dr_verdict any_verdict(void)
{
    const dr_verdict verdict = {anything_8(), anything_8(), anything_8(), 0, 0};
    return verdict;
}

dr_verdict dr_judge_frame(const dr_limits *l, const dr_command *command, const dr_request *request)
{
    const dr_verdict verdict = any_verdict();
    (void)l;
    if (command->op == DR_OP_MPC_SELECT && verdict.reason == DR_REASON_NONE)
        assume(request->value >= 1u && request->value <= DR_PORTS);
    return verdict;
}

dr_verdict dr_judge_motion(const dr_limits *l, const dr_scene *scene, const dr_command *command,
                           const dr_request *request)
{
    const dr_verdict verdict = any_verdict();
    assert(l == &limits && scene == &g.scene);
    asked = true;
    was_allowed = verdict.reason == DR_REASON_NONE;
    asked_command = *command;
    asked_request = *request;
    return verdict;
}

static dr_path any_path(void)
{
    dr_path path;
    path.stages = 1;
    path.straight = anything();
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        path.line.from_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
        path.line.to_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
        path.target_q.min_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
        path.target_q.max_q[axis] = anything_between(-DR_FAR_Q, DR_FAR_Q);
    }
    return path;
}

dr_path dr_judge_path(const dr_limits *l, const dr_scene *scene, const dr_command *command, const dr_request *request)
{
    return (void)l, (void)scene, (void)command, (void)request, any_path();
}

dr_verdict dr_judge_place(const dr_limits *l, uint8_t drive, const uint32_t steps[DR_AXES])
{
    return (void)l, (void)drive, (void)steps, any_verdict();
}

uint32_t dr_judge_speed(const dr_limits *l, uint8_t drive, uint8_t level, bool fastest)
{
    const uint32_t speed = anything_32();
    (void)l, (void)drive, (void)level, (void)fastest;
    assume(speed > 0);
    return speed;
}

bool dr_limits_check(const dr_limits *l, dr_limits_problem *problem) { return (void)l, (void)problem, anything(); }
uint32_t dr_limits_crc(const dr_limits *l) { return (void)l, anything_32(); }
uint32_t dr_crc32c(uint32_t crc, const uint8_t *bytes, size_t count)
{
    return (void)crc, (void)bytes, (void)count, anything_32();
}
void dr_log_init(dr_log *log, dr_record *ring, uint16_t size) { *log = (dr_log){ring, size, 0, 0, 0, 0, 0}; }
void dr_log_put(dr_log *log, dr_record *record) { (void)log, (void)record; }
bool dr_log_take(dr_log *log, dr_record *out) { return (void)log, (void)out, false; }
void dr_g_seal(dr_guard *of) { (void)of; }
void dr_g_unseal(dr_guard *of) { (void)of; }
bool dr_g_is_damaged(const dr_guard *of) { return (void)of, false; }

/* -- The invariant ---------------------------------------------------------------------------------------------------- */

static bool command_of(uint8_t code, dr_command *command)
{
    return dr_command_find((dr_kind)limits.kind, limits.firmware, code, command);
}

static bool is_same(const uint8_t *a, const uint8_t *b, uint8_t count)
{
    for (uint8_t i = 0; i < DR_FRAME_MAX; i++)
        if (i < count && a[i] != b[i])
            return false;
    return true;
}

/* Assumed before an event, asserted after it. */
#define HOLDS(condition)                                                                                               \
    do {                                                                                                               \
        if (asserted)                                                                                                  \
            assert(condition);                                                                                         \
        else                                                                                                           \
            assume(condition);                                                                                         \
    } while (0)

static void valid_values(bool asserted)
{
    dr_command command;
    HOLDS(g.limits == NULL || g.limits == &limits);
    HOLDS(g.mode <= MODE_STOPPED && g.task <= TASK_STOP && g.read_phase <= READ_QUIETS);
    HOLDS(g.scene.drive < DR_PORTS && g.path_drive < DR_PORTS);
    HOLDS(g.to_host_first < DR_HOST_OUT_MAX && g.to_host_count <= DR_HOST_OUT_MAX);
    HOLDS(g.read_have <= DR_REPLY_MAX);
    if (g.framer.have == 0) {
        HOLDS(g.framer.want == 0);
    } else {
        HOLDS(g.framer.have < g.framer.want && g.framer.want <= DR_FRAME_MAX);
        HOLDS(command_of(g.framer.bytes[0], &command) && g.framer.want == 1u + command.args);
    }
}

static void valid_mode(bool asserted)
{
    const bool first = is_on(&g, DR_INPUT_STOP), second = is_on(&g, DR_INPUT_STOP_2);
    if (g.limits == NULL)
        HOLDS(g.mode == MODE_LOCKED && !g.proved && !g.ambiguous && g.task == TASK_NONE && g.read_phase == READ_OFF);
    else if (!g.device_present) /* a ^C of the host's may wait for an answer */
        HOLDS(g.out_at == g.out_count &&
              (g.task == TASK_NONE || (g.task == TASK_PASS && (g.command.is & DR_IS_INTERRUPT) != 0)));
    if (g.mode != MODE_LOCKED)
        HOLDS(g.proved);
    if (g.ambiguous)
        HOLDS(!g.proved);
    if (g.proved || g.ambiguous)
        HOLDS(g.device_present);
    if (g.torn && !g.device_present &&
        g.limits != NULL) /* present: found within this call, whose end() does the rest */
        HOLDS(g.stops_out == 0 && g.out_at == g.out_count);
    if (first || second)
        HOLDS(g.stop_latched && !is_running(&g, DR_TIMER_RELEASE));
    if (is_running(&g, DR_TIMER_WIRING))
        HOLDS(first != second);
    if (g.stop_latched)
        HOLDS(g.mode != MODE_ARMED && g.mode != MODE_DISARMED);
}

static void valid_task(bool asserted)
{
    dr_command command;
    const bool moves = g.task >= TASK_CHECK && g.task <= TASK_VERIFY;
    if (g.task == TASK_PASS || moves) {
        HOLDS(command_of(g.command.code, &command));
        HOLDS(command.op == g.command.op && command.args == g.command.args && command.reply == g.command.reply &&
              command.is == g.command.is && moves == ((command.is & DR_IS_MOTION) != 0));
    }
    if (g.task == TASK_CHECK || g.task == TASK_SEND)
        HOLDS(g.frame[0] == g.command.code);
    if (g.task == TASK_CHECK || (g.task == TASK_SEND && g.out_at == 0))
        HOLDS(g.mode == MODE_ARMED);
    if (g.task == TASK_SEND)
        HOLDS(g.out_at < g.out_count && g.out_count == 1u + g.command.args && is_same(g.out, g.frame, g.out_count));
    if (g.task == TASK_PROVE)
        HOLDS(g.mode == MODE_LOCKED && !g.proved && !g.ambiguous);
    if (g.task == TASK_ARM)
        HOLDS(!g.stop_latched && g.mode == MODE_DISARMED);
    if (g.task == TASK_ARM || moves)
        HOLDS(g.proved);
    if (g.read_phase != READ_OFF)
        HOLDS(g.task != TASK_NONE && g.task != TASK_PASS && g.task != TASK_SEND && g.task != TASK_MOVE);
    if (g.read_phase == READ_SENT)
        HOLDS(g.read_have < DR_REPLY_MAX);
}

static void valid_out(bool asserted)
{
    dr_command command;
    HOLDS(g.out_at <= g.out_ready && g.out_ready <= g.out_count && g.out_count <= DR_FRAME_MAX);
    if (g.out_at == g.out_count)
        return;
    HOLDS(command_of(g.out[0], &command) && g.out_count == 1u + command.args);
    if (g.out_at == g.out_ready)
        HOLDS(is_running(&g, DR_TIMER_SEND));
    if (g.out_at > 0)
        return;
    HOLDS(g.limits != NULL);
    if ((command.is & DR_IS_MOTION) != 0)
        HOLDS(g.task == TASK_SEND);
    else if ((command.is & DR_IS_SETTING) != 0)
        HOLDS(g.task == TASK_PASS && (g.mode == MODE_ARMED || g.mode == MODE_DISARMED));
    else
        HOLDS((command.is & DR_IS_QUERY) != 0 && g.out_count == 1u);
}

static void valid_timers(bool asserted)
{
    const uint32_t without_limits = 1u << DR_TIMER_WIRING | 1u << DR_TIMER_RELEASE | 1u << DR_TIMER_RESYNC |
                                    1u << DR_TIMER_SEND | 1u << DR_TIMER_LINE;
    if (g.limits == NULL)
        HOLDS((g.running & ~without_limits) == 0);
    else
        HOLDS(g.tokens <= RATE_TOKENS && is_running(&g, DR_TIMER_RATE) == (g.tokens < RATE_TOKENS));
    if (g.task == TASK_CHECK)
        HOLDS(g.tokens > 0 || g.counted);
    if (g.task == TASK_SEND)
        HOLDS(g.counted);
    if (is_running(&g, DR_TIMER_TASK))
        HOLDS((g.task == TASK_PROVE && g.read_phase == READ_OFF) || g.task == TASK_PASS || g.task == TASK_MOVE ||
              g.task == TASK_STOP);
    if (is_running(&g, DR_TIMER_READ))
        HOLDS(g.read_phase != READ_OFF);
    else if (!g.torn)
        HOLDS(g.read_phase == READ_OFF);
    if (is_running(&g, DR_TIMER_PROOF) || is_running(&g, DR_TIMER_REPEAT))
        HOLDS(g.task == TASK_STOP);
    if (is_running(&g, DR_TIMER_IDLE))
        HOLDS(g.mode == MODE_ARMED);
    if (is_running(&g, DR_TIMER_SEND))
        HOLDS(g.out_at < g.out_count && g.out_at == g.out_ready && (g.task == TASK_SEND || g.out_at > 0));
}

static void valid(bool asserted)
{
    valid_values(asserted);
    valid_mode(asserted);
    valid_task(asserted);
    valid_out(asserted);
    valid_timers(asserted);
}

/* -- Any valid guard -------------------------------------------------------------------------------------------------- */

/* A bool may be anything of its eight bits to the model checker. */
#define ANY(member) g.member = anything()

static void any_limits(void)
{
    limits.kind = anything() ? DR_MPC : DR_TRIO;
    limits.firmware = anything_16();
    limits.rig = anything_16();
    limits.refusal = anything_8();
    limits.host_loss = anything_8();
    limits.arm_idle_s = anything_16();
    limits.knob_q_per_s = anything_between(0, 20000 * (int32_t)DR_QUANTA_PER_UM);
    limits.obstacle_count = anything_8();
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        limits.drives[drive].stage = anything_8();
    assume(limits.firmware >= DR_FIRMWARE_FIRST && limits.firmware <= DR_FIRMWARE_LAST);
    assume(limits.arm_idle_s <= DR_ARM_IDLE_MAX_S);
}

static void any_guard(void)
{
    dr_guard any; /* not initialised: the model checker takes everything for possible */
    any_limits();
    g = any;
    ANY(host_open), ANY(device_present), ANY(plugged), ANY(torn), ANY(after_reset), ANY(proved), ANY(other_firmware);
    ANY(ambiguous), ANY(host_chose), ANY(confirmed), ANY(tip_changed), ANY(unsteady), ANY(wiring_alarm);
    ANY(stop_latched), ANY(cut), ANY(buzzer), ANY(resync), ANY(tainted), ANY(read_again), ANY(has_first);
    ANY(stop_broke_off), ANY(stop_waits), ANY(end_told), ANY(small), ANY(position_known), ANY(sealed);
    ANY(counted);
    ANY(scene.may_calibrate), ANY(scene.in_tissue), ANY(scene.frame_lost);
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        ANY(scene.old[drive].is_open);
    g.path = any_path();
    g.limits = anything() ? &limits : NULL;
    g.log.ring = NULL;
#ifdef DR_PROOF_TASK /* one proof for each task instead of one for all */
    g.task = DR_PROOF_TASK;
#endif
    valid(false);
    before = g;
    now = anything_32();
}

/* -- One event after another ------------------------------------------------------------------------------------------ */

static uint8_t danger(const dr_guard *of) { return of->mode == MODE_ARMED ? 2 : of->mode == MODE_DISARMED ? 1 : 0; }
/* In the call under way; settle() does the rest. */
static bool found_torn(void) { return g.torn && g.device_present && g.limits != NULL; }
static bool was_leaving(void) { return before.out_at > 0 && before.out_at < before.out_count; }

/* What every event but a pull keeps to. */
static void check(void)
{
    valid(true);
    if (g.task == TASK_SEND && before.task != TASK_SEND)
        assert(asked && was_allowed && asked_command.code == g.frame[0] && asked_command.op == g.command.op &&
               before.task == TASK_CHECK && is_same(g.frame, before.frame, DR_FRAME_MAX));
    if (was_leaving() && !(g.torn && g.out_count == 0) &&
        !(before.cut && !g.cut)) /* the cable is gone, or its power was */
        assert(g.out_at == before.out_at && g.out_count == before.out_count && is_same(g.out, before.out, g.out_count));
}

void proof_start(void)
{
    const dr_limits *given = anything() ? &limits : NULL;
    any_limits();
    dr_guard_init(&g, given, NULL, anything_16());
    valid(true);
    proved();
}

void proof_host_byte(void)
{
    any_guard();
    dr_g_push_host_byte(&g, now, anything_8());
    check();
    assert(danger(&g) <= danger(&before));
    proved();
}

void proof_device_byte(void)
{
    any_guard();
    dr_g_push_device_byte(&g, now, anything_8());
    check();
    assert(danger(&g) <= danger(&before) || before.task == TASK_PROVE || before.task == TASK_ARM);
    proved();
}

#ifdef DR_PROOF_TIMER /* a proof for each */
void proof_timer(void)
{
    any_guard();
    const uint8_t timer = DR_PROOF_TIMER;
    assume(is_running(&g, timer));
    clear_timer(&g, timer);
    happen(&g, timer, now);
    settle(&g, now);
    assert(!found_torn());
    check();
    assert(danger(&g) <= danger(&before));
    proved();
}
#endif

void proof_person(void)
{
    any_guard();
    assume(!found_torn()); /* begin() has settled what its timers found */
    dr_guard_input(&g, now, (dr_input)anything_8(), anything());
    check();
    proved();
}

void proof_cable(void)
{
    any_guard();
    dr_guard_link(&g, now, anything(), anything());
    check();
    assert(danger(&g) <= danger(&before));
    proved();
}

void proof_line_error_or_damage(void)
{
    any_guard();
    if (anything())
        dr_guard_host_line_error(&g, now);
    else
        (void)dr_guard_self_check(&g, now);
    check();
    assert(danger(&g) <= danger(&before));
    proved();
}

/* The theorem itself: what a pulled byte may be. */
void proof_pulled_byte(void)
{
    uint8_t byte = 0;
    dr_command command;
    any_guard();
    const size_t count = dr_guard_pull_device(&g, now, &byte, 1);
    valid(true);
    assert(count == 0 || !before.torn || before.device_present || before.limits == NULL);
    if (count == 0) {
        assert(before.out_at == before.out_ready ||
               (before.task == TASK_SEND && before.out_at == 0)); /* read for too long ago */
        assert(before.stops_out == 0 || was_leaving());
    } else if (was_leaving()) {
        assert(byte == before.out[before.out_at] && (before.torn || g.out_at == before.out_at + 1u));
    } else if (before.stops_out > 0) {
        assert(byte == DR_INTERRUPT);
    } else {
        assert(command_of(byte, &command) && (command.is & DR_IS_INTERRUPT) == 0);
        if ((command.is & DR_IS_MOTION) != 0)
            assert(before.mode == MODE_ARMED && before.task == TASK_SEND && byte == before.frame[0]);
        if ((command.is & DR_IS_SETTING) != 0)
            assert(before.mode == MODE_ARMED || before.mode == MODE_DISARMED);
    }
    proved();
}

void proof_bytes_for_the_host(void)
{
    uint8_t bytes[2];
    any_guard();
    (void)dr_guard_pull_host(&g, now, bytes, 2);
    check();
    assert(danger(&g) <= danger(&before)); /* a torn frame may have been found */
    proved();
}
