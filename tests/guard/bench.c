#include "bench.h"

#include <stdio.h>
#include <string.h>

bench rig;

static dr_us clock_now(void) { return (dr_us)(rig.clock_at_start + rig.now); }
static uint64_t from_clock(dr_us when)
{
    const uint32_t ahead = when - clock_now();
    return rig.now + (ahead > 0x7FFFFFFFu ? 0 : ahead);
}

dr_guard_status status(void)
{
    dr_guard_status out;
    dr_guard_get_status(&rig.guard, &out);
    return out;
}

/* The state that status() tells. This is asked at every byte, and status() judges the tip's place each time. */
static uint8_t state_now(void) { return rig.guard.shown_state; }

/* -- Monitors -------------------------------------------------------------------------------------------------------- */

static bool is_less_safe(uint8_t before, uint8_t after)
{
    const bool latched = before == DR_GUARD_FAULT || before == DR_GUARD_STOPPED;
    const bool armed = after == DR_GUARD_IDLE || after == DR_GUARD_CHECKING || after == DR_GUARD_MOVING_S ||
                       after == DR_GUARD_MOVING_U;
    return (latched && (after == DR_GUARD_DISARMED || armed)) ||
           ((before == DR_GUARD_DISARMED || before == DR_GUARD_LOCKED) && armed);
}

/* Nothing is under way that the host may still get an answer to. */
static bool is_quiet(uint8_t state)
{
    return state != DR_GUARD_CHECKING && state != DR_GUARD_MOVING_S && state != DR_GUARD_MOVING_U &&
           state != DR_GUARD_STOPPING;
}

/* What the host may hear after a motion of its was refused: the answer to something else, or 'E' where that is chosen. */
static void monitor_answers(const dr_record *record)
{
    dr_command command;
    const bool known =
        dr_command_find((dr_kind)rig.limits.kind, rig.limits.firmware, record->bytes[0], &command) && record->count > 0;
    const bool motion = known && (command.is & DR_IS_MOTION) != 0;
    switch (record->event) {
    case DR_EVENT_REFUSED:
        if (motion && record->code != DR_REASON_CANCELLED && is_quiet(record->after))
            rig.refused_open = true;
        if (motion && record->code != DR_REASON_CANCELLED && record->code != DR_REASON_BUSY)
            rig.owed += rig.limits.refusal == DR_REFUSE_E;
        if (record->op == DR_OP_MPC_SELECT && record->code == DR_REASON_DRIVE_VALUE)
            rig.owed += 2; /* 'E' CR */
        break;
    case DR_EVENT_ALLOWED:
        rig.refused_open = false;
        rig.owed = motion ? 0 : command.reply;
        break;
    case DR_EVENT_STOP: /* with nothing under way the controller's CR goes to the host */
        rig.refused_open = false;
        rig.owed += record->code == DR_STOP_HOST && is_quiet(record->after);
        break;
    case DR_EVENT_NO_REPLY:
        rig.owed = 0;
        break;
    default:
        break;
    }
}

static void monitor_record(const dr_record *record)
{
    if (record->event == DR_EVENT_REFUSED) {
        TEST_ASSERT_TRUE_MESSAGE(record->code != DR_REASON_NONE, "M4: refused without a reason");
        rig.frames_refused++;
    }
    monitor_answers(record);
    if (record->sequence == rig.next_sequence) /* else: some were overwritten unread, and counted */
        TEST_ASSERT_EQUAL_HEX32_MESSAGE(dr_record_crc(rig.crc, record), record->crc, "the log's chain is broken");
    else
        TEST_ASSERT_TRUE(status().log_missed > 0);
    rig.crc = record->crc;
    rig.next_sequence = record->sequence + 1;
}

static void monitor_state(void)
{
    const uint8_t now = state_now();
    if (is_less_safe(rig.state, now)) {
        const bool arming = now == DR_GUARD_IDLE && rig.now - rig.arm_pressed < 1000000;
        TEST_ASSERT_TRUE_MESSAGE(rig.person || arming, "M7: less safe without a person");
    }
    rig.person = false;
    rig.state = now;
    if (!rig.is_damaged)
        TEST_ASSERT_EQUAL_MESSAGE(rig.guard.refused, rig.frames_refused, "M4: a refusal without a record");
}

static void drain_log(void)
{
    dr_record record;
    while (dr_guard_pull_log(&rig.guard, &record)) {
        monitor_record(&record);
        rig.log[rig.log_count++ % 512u] = record;
    }
    monitor_state();
}

static bool host_has_sent(const uint8_t *bytes, uint32_t count)
{
    for (uint32_t at = 0; at + count <= rig.sent_count; at++)
        if (memcmp(rig.sent + at, bytes, count) == 0)
            return true;
    return false;
}

static void monitor_wire(uint8_t byte, uint8_t state_before)
{
    dr_command command;
    if (rig.framer.have == 0)
        rig.frame_state = state_before;
    const dr_framed framed = dr_framer_push(&rig.framer, (dr_kind)rig.limits.kind, rig.limits.firmware, byte, &command);
    TEST_ASSERT_TRUE_MESSAGE(framed == DR_FRAMED_PART || framed == DR_FRAMED_WHOLE, "M1: no frame begins so");
    if (framed == DR_FRAMED_PART)
        return;
    const bool own =
        command.op == DR_OP_TRIO_POSITION || command.op == DR_OP_MPC_POSITION || (command.is & DR_IS_INTERRUPT) != 0;
    TEST_ASSERT_TRUE_MESSAGE(own || host_has_sent(rig.framer.bytes, 1u + command.args),
                             "M1: not a frame of the host's");
    if ((command.is & DR_IS_MOTION) != 0)
        rig.motions++;
    if ((command.is & DR_IS_MOTION) != 0)
        TEST_ASSERT_EQUAL_MESSAGE(DR_GUARD_CHECKING, rig.frame_state, "M2: a motion left in this state");
}

static void monitor_tip(void)
{
    if (!rig.watch_tip || rig.by_hand || rig.now == rig.tip_checked)
        return;
    rig.tip_checked = rig.now;
    for (uint8_t drive = 0; drive < rig.controller.drive_count; drive++) {
        dr_stage stage;
        uint32_t steps[DR_AXES];
        if (!dr_stage_get((dr_stage_id)rig.limits.drives[drive].stage, &stage))
            continue;
        dr_controller_position(&rig.controller, drive, clock_now(), steps);
        dr_segment still;
        for (uint8_t axis = 0; axis < DR_AXES; axis++)
            still.from_q[axis] = still.to_q[axis] = (int32_t)(steps[axis] * stage.quanta_per_step);
        const dr_box tip = dr_box_around(&still);
        TEST_ASSERT_TRUE_MESSAGE(dr_box_is_in(&tip, &rig.limits.drives[drive].box_q), "M3: the tip has left its box");
        for (uint8_t i = 0; i < rig.limits.obstacle_count; i++) {
            const dr_obstacle *o = &rig.limits.obstacles[i];
            const int32_t margin_q = rig.limits.margin_q - stage.quanta_per_step; /* a line on whole microsteps */
            const dr_box box = dr_box_grown(&o->box_q, margin_q);
            const dr_half half = dr_half_grown(&o->half_q, margin_q);
            if (o->drive == drive)
                TEST_ASSERT_FALSE_MESSAGE(o->shape == DR_SHAPE_BOX ? dr_box_touches_box(&tip, &box)
                                                                   : dr_box_touches_half(&tip, &half),
                                          "M3: the tip is in an obstacle");
        }
    }
}

/* -- The world --------------------------------------------------------------------------------------------------------- */

static void from_guard_to_host(void)
{
    uint8_t byte;
    while (dr_guard_pull_host(&rig.guard, clock_now(), &byte, 1) == 1) {
        if (rig.owed > 0)
            rig.owed--;
        else
            TEST_ASSERT_FALSE_MESSAGE(rig.refused_open, "M5: a refused motion was answered");
        TEST_ASSERT_TRUE(rig.heard_count < HEARD_MAX);
        rig.heard[rig.heard_count++] = byte;
    }
}

static bool from_guard_to_device(void)
{
    const uint8_t before = state_now();
    uint8_t byte;
    if (rig.to_device_busy || dr_guard_pull_device(&rig.guard, clock_now(), &byte, 1) == 0)
        return false;
    drain_log();
    monitor_wire(byte, before);
    TEST_ASSERT_TRUE(rig.wire_count < WIRE_MAX);
    rig.wire_at[rig.wire_count] = rig.now;
    rig.wire[rig.wire_count++] = byte;
    rig.to_device_busy = true;
    rig.to_device_byte = byte;
    rig.to_device_at = rig.now + rig.byte_us;
    (void)dr_guard_pull_device(&rig.guard, clock_now(), &byte, 0); /* now it has the time to seal */
    return true;
}

static bool from_device(void)
{
    uint8_t byte;
    if (rig.by_hand || rig.to_guard_busy || dr_controller_pull(&rig.controller, clock_now(), &byte, 1) == 0)
        return false;
    rig.to_guard_busy = true;
    rig.to_guard_byte = byte;
    rig.to_guard_at = rig.now + rig.byte_us;
    return true;
}

static void settle_world(void)
{
    for (bool any = true; any;) {
        any = false;
        if (rig.to_device_busy && rig.to_device_at <= rig.now) {
            rig.to_device_busy = false;
            if (!rig.by_hand) {
                const uint64_t since = rig.now - rig.device_heard_at;
                dr_controller_paused(&rig.controller, since > rig.byte_us ? (uint32_t)(since - rig.byte_us) : 0);
                dr_controller_push(&rig.controller, clock_now(), &rig.to_device_byte, 1);
            }
            rig.device_heard_at = rig.now;
            any = true;
        }
        if (rig.to_guard_busy && rig.to_guard_at <= rig.now) {
            rig.to_guard_busy = false;
            rig.said++;
            const int byte = rig.spoil == NULL ? rig.to_guard_byte : rig.spoil(&rig, rig.to_guard_byte);
            const uint8_t arrives = (uint8_t)byte;
            if (byte >= 0)
                dr_guard_push_device(&rig.guard, clock_now(), &arrives, 1);
            any = true;
        }
        any = from_guard_to_device() || any;
        any = from_device() || any;
        drain_log();
        from_guard_to_host();
    }
    monitor_tip();
}

void bench_forget(void)
{
    const uint32_t recent = 256;
    if (rig.framer.have == 0 && rig.wire_count > WIRE_MAX / 16u)
        rig.wire_count = rig.wire_taken = 0;
    if (rig.sent_count > WIRE_MAX / 16u) {
        memmove(rig.sent, rig.sent + rig.sent_count - recent, recent);
        rig.sent_count = recent;
    }
    if (rig.heard_count > HEARD_MAX / 4u)
        rig.heard_count = rig.heard_taken = 0;
}

static void sooner(uint64_t *next, uint64_t when)
{
    if (when < *next)
        *next = when;
}

static void run_to(uint64_t until)
{
    settle_world();
    while (rig.now < until) {
        uint64_t next = until;
        dr_us when;
        if (dr_guard_due(&rig.guard, &when))
            sooner(&next, from_clock(when));
        if (!rig.by_hand && dr_controller_due(&rig.controller, &when))
            sooner(&next, from_clock(when));
        if (rig.to_device_busy)
            sooner(&next, rig.to_device_at);
        if (rig.to_guard_busy)
            sooner(&next, rig.to_guard_at);
        if (rig.watch_tip && rig.controller.state == DR_STATE_MOVING)
            sooner(&next, rig.now + 1000);
        rig.now = next;
        uint8_t none; /* both do what is due, though the line may be busy */
        (void)dr_guard_pull_device(&rig.guard, clock_now(), &none, 0);
        (void)dr_controller_pull(&rig.controller, clock_now(), &none, 0);
        settle_world();
    }
}

void run_us(uint64_t us) { run_to(rig.now + us); }
void run_ms(uint64_t ms) { run_to(rig.now + ms * 1000); }

void run_until_state(dr_guard_state state, uint64_t at_most_ms)
{
    const uint64_t until = rig.now + at_most_ms * 1000;
    settle_world();
    while (status().state != state && rig.now < until)
        run_us(100);
    TEST_ASSERT_EQUAL_MESSAGE(state, status().state, "the state did not come");
}

/* -- Setting up ---------------------------------------------------------------------------------------------------------- */

static void bench_new(dr_kind kind, dr_stage_id stage, uint8_t drives, uint32_t at_steps)
{
    memset(&rig, 0, sizeof rig);
    rig.clock_at_start = 0xFFFF0000u; /* wraps within the first second */
    rig.byte_us = (uint32_t)(DR_BITS_PER_BYTE * DR_US_PER_S / (kind == DR_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC));
    dr_limits_init(&rig.limits, kind);
    rig.limits.rig = DR_RIG_KNOBS_LOCKED;
    for (uint8_t i = 0; i < drives; i++) {
        dr_drive_init(&rig.drives[i], stage);
        for (uint8_t axis = 0; axis < DR_AXES; axis++)
            rig.drives[i].position_steps[axis] = at_steps;
        TEST_ASSERT_TRUE(dr_limits_init_drive(&rig.limits, i, stage));
    }
    dr_controller_init(&rig.controller, kind, rig.drives, drives);
    rig.watch_tip = true;
}

void bench_trio(void) { bench_new(DR_TRIO, DR_STAGE_TRIO_MP285, 1, 40000); }
void bench_mpc(void) { bench_new(DR_MPC, DR_STAGE_MPC_MP225, 2, 80000); }

void bench_start(void)
{
    dr_limits_problem problem;
    TEST_ASSERT_TRUE(dr_limits_check(&rig.limits, &problem));
    dr_controller_start(&rig.controller, clock_now());
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
    dr_guard_start(&rig.guard, clock_now(), DR_START_POWER_ON);
    rig.state = status().state;
    drain_log();
    dr_guard_link(&rig.guard, clock_now(), true, true);
    if (!rig.by_hand) {
        run_ms(1100);
        expect_state(DR_GUARD_DISARMED);
    }
}

void bench_arm(void)
{
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_ms(150);
    expect_state(DR_GUARD_IDLE);
}

void bench_armed_trio(void)
{
    bench_trio();
    bench_start();
    bench_arm();
}

void bench_armed_mpc(void)
{
    bench_mpc();
    bench_start();
    bench_arm();
}

void limits_changed(void)
{
    rig.guard.limits_crc = dr_limits_crc(&rig.limits);
    rig.guard.limits_memory_crc = dr_crc32c(0, (const uint8_t *)&rig.limits, sizeof rig.limits);
    rig.guard.sealed = 0;
}

uint8_t keep_out(int32_t x0, int32_t x1, int32_t y0, int32_t y1, int32_t z0, int32_t z1)
{
    const uint8_t item = rig.limits.obstacle_count++;
    rig.limits.obstacles[item] = (dr_obstacle){
        DR_SHAPE_BOX, 0, DR_TO_NONE, {{UM(x0), UM(y0), UM(z0)}, {UM(x1), UM(y1), UM(z1)}}, {0, {0, 0, 0}}};
    return item;
}

/* -- The host -------------------------------------------------------------------------------------------------------------- */

void host_bytes(const void *bytes, size_t count)
{
    const uint8_t *byte = bytes;
    TEST_ASSERT_TRUE(rig.sent_count + count <= WIRE_MAX);
    for (size_t i = 0; i < count; i++) {
        const bool moving = state_now() == DR_GUARD_MOVING_S,
                   leaving = rig.guard.out_at > 0 && rig.guard.out_at < rig.guard.out_count;
        const uint32_t stops = rig.guard.stops_out, sent = moving && byte[i] == 0x03 ? wire_stops() : 0;
        rig.sent[rig.sent_count++] = byte[i];
        dr_guard_push_host(&rig.guard, clock_now(), byte + i, 1);
        if (moving && byte[i] == 0x03) /* M6: it waits for nothing but a byte, or a frame, that is on the wire */
            TEST_ASSERT_TRUE_MESSAGE(rig.guard.stops_out > stops || leaving || wire_stops() > sent,
                                     "M6: ^C did not leave at once");
        settle_world();
    }
}

void host_code(int code)
{
    const uint8_t byte = (uint8_t)code;
    host_bytes(&byte, 1);
}

void host_value(int code, unsigned value)
{
    const uint8_t bytes[] = {(uint8_t)code, (uint8_t)value};
    host_bytes(bytes, 2);
}

static uint8_t *put_u32(uint8_t *to, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        *to++ = (uint8_t)(value >> (8 * i));
    return to;
}

void host_axis(int code, uint32_t steps)
{
    uint8_t frame[5] = {(uint8_t)code};
    put_u32(frame + 1, steps);
    host_bytes(frame, 5);
}

size_t put_point_frame(uint8_t *frame, int code, uint32_t x, uint32_t y, uint32_t z)
{
    frame[0] = (uint8_t)code;
    put_u32(put_u32(put_u32(frame + 1, x), y), z);
    return 13;
}

size_t put_line_frame(uint8_t *frame, unsigned level, uint32_t x, uint32_t y, uint32_t z)
{
    frame[0] = 'S';
    frame[1] = (uint8_t)level;
    put_u32(put_u32(put_u32(frame + 2, x), y), z);
    return 14;
}

void host_point(int code, uint32_t x, uint32_t y, uint32_t z)
{
    uint8_t frame[13];
    host_bytes(frame, put_point_frame(frame, code, x, y, z));
}

void host_line(unsigned level, uint32_t x, uint32_t y, uint32_t z)
{
    uint8_t frame[14];
    host_bytes(frame, put_line_frame(frame, level, x, y, z));
}

/* -- People ------------------------------------------------------------------------------------------------------------------ */

void input(dr_input what, bool on)
{
    const bool moving = status().state == DR_GUARD_MOVING_S,
               stop = on && (what == DR_INPUT_STOP || what == DR_INPUT_STOP_2);
    const uint32_t stops = rig.guard.stops_out, sent = wire_stops();
    rig.person = true;
    if (what == DR_INPUT_ARM && on)
        rig.arm_pressed = rig.now;
    dr_guard_input(&rig.guard, clock_now(), what, on);
    if (moving && stop)
        TEST_ASSERT_TRUE_MESSAGE(rig.guard.stops_out > stops || wire_stops() > sent, "M6: STOP did not leave at once");
    settle_world();
}

/* A frame that an unplugged cable has cut off is no frame that left the guard; what the controller makes of it is for M3. */
void cables(bool host_open, bool device_present)
{
    if (!device_present)
        rig.framer.have = rig.framer.want = 0;
    dr_guard_link(&rig.guard, clock_now(), host_open, device_present);
    settle_world();
}

void press(dr_input what)
{
    input(what, true);
    input(what, false);
}

void stop_input(bool on)
{
    input(DR_INPUT_STOP, on);
    input(DR_INPUT_STOP_2, on);
}

void clear_fault(void)
{
    input(DR_INPUT_KEY, false);
    input(DR_INPUT_KEY, true);
}

void place_tip(uint8_t drive, uint32_t x, uint32_t y, uint32_t z)
{
    const dr_hand hand = {DR_HAND_PLACE, drive, 0, {x, y, z}};
    TEST_ASSERT_TRUE(dr_controller_poke(&rig.controller, clock_now(), &hand));
}

/* -- A line that hangs -------------------------------------------------------------------------------------------------------- */

void line_hangs(void)
{
    rig.to_device_busy = true;
    rig.to_device_at = UINT64_MAX;
}

void line_goes_on(void)
{
    rig.to_device_at = rig.now;
    settle_world();
}

/* -- The test as the controller ---------------------------------------------------------------------------------------------- */

void device_says(const void *bytes, size_t count)
{
    const uint8_t *byte = bytes;
    for (size_t i = 0; i < count; i++) {
        dr_guard_push_device(&rig.guard, clock_now(), byte + i, 1);
        settle_world();
    }
}

void device_at(uint32_t x, uint32_t y, uint32_t z, unsigned last)
{
    uint8_t reply[14];
    put_u32(put_u32(put_u32(reply, x), y), z);
    reply[12] = (uint8_t)last;
    reply[13] = 0x0D;
    device_says(reply, 14);
}

void device_at_drive(unsigned drive, uint32_t x, uint32_t y, uint32_t z)
{
    uint8_t reply[14] = {(uint8_t)drive};
    put_u32(put_u32(put_u32(reply + 1, x), y), z);
    reply[13] = 0x0D;
    device_says(reply, 14);
}

void device_at_home(void)
{
    if (rig.limits.kind == DR_TRIO)
        device_at(40000, 40000, 40000, 30);
    else
        device_at_drive(1, 80000, 80000, 80000);
}

void bench_start_by_hand(void (*says)(void))
{
    rig.by_hand = true;
    bench_start();
    run_us(1000000);
    says();
    expect_state(DR_GUARD_DISARMED);
}

/* ARM is followed by two readings: at once, and 100 ms later. */
void bench_proved_by_hand(dr_kind kind, uint16_t facts)
{
    if (kind == DR_TRIO)
        bench_trio();
    else
        bench_mpc();
    rig.limits.rig = (uint16_t)(DR_RIG_KNOBS_LOCKED | facts);
    bench_start_by_hand(device_at_home);
}

void bench_arm_by_hand(void (*says)(void))
{
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_us(2000);
    says();
    run_us(100000);
    says();
    expect_state(DR_GUARD_IDLE);
}

int wire_next(void) { return rig.wire_taken < rig.wire_count ? rig.wire[rig.wire_taken++] : -1; }

/* ^C outside frames: told apart as the controller would. */
uint32_t wire_stops(void)
{
    dr_framer framer = {{0}, 0, 0};
    dr_command command;
    uint32_t stops = 0;
    for (uint32_t i = 0; i < rig.wire_count; i++)
        if (dr_framer_push(&framer, (dr_kind)rig.limits.kind, rig.limits.firmware, rig.wire[i], &command) ==
                DR_FRAMED_WHOLE &&
            (command.is & DR_IS_INTERRUPT) != 0)
            stops++;
    return stops;
}

/* -- Expectations -------------------------------------------------------------------------------------------------------------- */

void expect_heard(const void *bytes, size_t count)
{
    TEST_ASSERT_GREATER_OR_EQUAL_MESSAGE(count, rig.heard_count - rig.heard_taken, "the host has heard too little");
    TEST_ASSERT_EQUAL_HEX8_ARRAY(bytes, rig.heard + rig.heard_taken, count);
    rig.heard_taken += (uint32_t)count;
}

void expect_cr(void) { expect_heard("\r", 1); }

void expect_silence(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(rig.heard_taken, rig.heard_count, "the host has heard something");
}

void expect_state(dr_guard_state state) { TEST_ASSERT_EQUAL_MESSAGE(state, status().state, "state"); }
void expect_refused(dr_reason reason) { TEST_ASSERT_EQUAL_MESSAGE(reason, status().last_refusal.reason, "reason"); }
void expect_fault(dr_fault fault) { TEST_ASSERT_EQUAL_MESSAGE(fault, status().fault, "fault"); }

void expect_tip(uint8_t drive, uint32_t x, uint32_t y, uint32_t z)
{
    uint32_t steps[DR_AXES];
    dr_controller_position(&rig.controller, drive, clock_now(), steps);
    TEST_ASSERT_EQUAL(x, steps[0]);
    TEST_ASSERT_EQUAL(y, steps[1]);
    TEST_ASSERT_EQUAL(z, steps[2]);
}

const dr_record *last_record(dr_event event)
{
    for (uint32_t i = rig.log_count; i > 0 && i + 512u > rig.log_count; i--)
        if (rig.log[(i - 1u) % 512u].event == event)
            return &rig.log[(i - 1u) % 512u];
    return NULL;
}
