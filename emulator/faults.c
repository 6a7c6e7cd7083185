#include "faults.h"

#include <string.h>

#define NO_BYTE UINT8_MAX
#define MS UINT32_C(1000)

static const fault_words words[FAULTS] = {
    [FAULT_DROP_BYTE] = {.name = "drop-byte", .meaning = "one byte of an answer is lost", .strikes = FAULT_OF_ANSWER},
    [FAULT_DELAY_BYTE] = {.name = "delay-byte",
                          .meaning = "one byte of an answer, and what follows, is late",
                          .delay_us = 200 * MS,
                          .strikes = FAULT_OF_ANSWER},
    [FAULT_DUPLICATE_BYTE] = {.name = "duplicate-byte",
                              .meaning = "one byte of an answer comes twice",
                              .strikes = FAULT_OF_ANSWER},
    [FAULT_CORRUPT_BYTE] = {.name = "corrupt-byte",
                            .meaning = "one bit of an answer is changed",
                            .strikes = FAULT_OF_ANSWER},
    [FAULT_DROP_CR] = {.name = "drop-cr", .meaning = "the CR of an answer is lost", .strikes = FAULT_OF_ANSWER},
    [FAULT_LATE_CR] = {.name = "late-cr",
                       .meaning = "the CR of an answer is late",
                       .delay_us = 500 * MS,
                       .strikes = FAULT_OF_ANSWER},
    [FAULT_STRAY_BYTES] = {.name = "stray-bytes",
                           .meaning = "two bytes that mean nothing come before an answer",
                           .strikes = FAULT_OF_ANSWER},
    [FAULT_SLOW_ANSWER] = {.name = "slow-answer",
                           .meaning = "an answer is late",
                           .delay_us = 500 * MS,
                           .strikes = FAULT_OF_ANSWER},
    [FAULT_SHORT_FRAME] = {.name = "short-frame",
                           .meaning = "a streamed frame lacks its last bytes",
                           .strikes = FAULT_OF_FRAME},
    [FAULT_TORN_FRAME] = {.name = "torn-frame",
                          .meaning = "a streamed frame stops in its middle for a while",
                          .delay_us = 50 * MS,
                          .strikes = FAULT_OF_FRAME},
    [FAULT_LOSE_HOST_BYTE] = {.name = "lose-host-byte",
                              .meaning = "a byte of the host never arrives",
                              .strikes = FAULT_OF_HOST_BYTE},
    [FAULT_IGNORE_STOP] = {.name = "ignore-stop", .meaning = "^C never arrives", .strikes = FAULT_OF_STOP},
    [FAULT_WEDGE] = {.name = "wedge",
                     .meaning = "deaf and mute from a command on, until a power cycle",
                     .strikes = FAULT_OF_COMMAND},
    [FAULT_STALL_AXIS] = {.name = "stall-axis",
                          .meaning = "an axis gets half of its way only; the answer is as ever",
                          .strikes = FAULT_OF_LEG,
                          .takes_axis = true},
    [FAULT_SLIP_AXIS] = {.name = "slip-axis",
                         .meaning = "the position of an axis counts, its tip stays",
                         .strikes = FAULT_OF_LEG,
                         .takes_axis = true},
    [FAULT_SLOW_MOTION] = {.name = "slow-motion",
                           .meaning = "a move lasts several times as long",
                           .strikes = FAULT_OF_MOVE,
                           .times = 3},
    [FAULT_POWER_LOSS] = {.name = "power-loss",
                          .meaning = "the power goes half way through a leg of a move, for a while",
                          .delay_us = 1000 * MS,
                          .strikes = FAULT_OF_LEG},
    [FAULT_POWER_LOSS_FORGET] = {.name = "power-loss-forget",
                                 .meaning =
                                     "the power goes half way through a leg of a move, and the positions with it",
                                 .delay_us = 1000 * MS,
                                 .strikes = FAULT_OF_LEG},
    [FAULT_USB_UNPLUG] = {.name = "usb-unplug",
                          .meaning = "the cable to the host comes out when a command has arrived, for a while",
                          .delay_us = 2000 * MS,
                          .strikes = FAULT_OF_COMMAND}};

const fault_words *faults_words(fault_id id) { return &words[id]; }

bool faults_find(const char *name, fault_id *id)
{
    for (unsigned i = 0; i < FAULTS; i++)
        if (strcmp(name, words[i].name) == 0) {
            *id = (fault_id)i;
            return true;
        }
    return false;
}

/* -- Rules --------------------------------------------------------------------------------------------------------------- */

void faults_init(faults *f, uint64_t seed)
{
    memset(f, 0, sizeof *f);
    f->random = seed * UINT64_C(0x9E3779B97F4A7C15) | 1u;
}

bool faults_add(faults *f, const fault_rule *rule)
{
    if (f->count == FAULT_RULES)
        return false;
    f->rules[f->count++] = *rule;
    return true;
}

static void remove_at(faults *f, uint8_t i)
{
    f->count--;
    memmove(&f->rules[i], &f->rules[i + 1u], (size_t)(f->count - i) * sizeof f->rules[0]);
}

void faults_remove(faults *f, fault_id id)
{
    for (uint8_t i = f->count; i-- > 0;)
        if (id == FAULTS || f->rules[i].id == id)
            remove_at(f, i);
    if (id == FAULTS || id == FAULT_SLOW_MOTION)
        f->slow_times = 0;
    if (id == FAULTS || id == FAULT_POWER_LOSS || id == FAULT_POWER_LOSS_FORGET)
        f->power_off_us = 0;
}

/* A number from 0 to most - 1 (xorshift64*). */
static uint32_t chance(faults *f, uint32_t most)
{
    f->has_chanced = true;
    f->random ^= f->random >> 12;
    f->random ^= f->random << 25;
    f->random ^= f->random >> 27;
    return (uint32_t)(((f->random * UINT64_C(0x2545F4914F6CDD1D)) >> 33) % most);
}

/* Does a rule of this fault strike now? leg: NULL, or only one whose axis has a way to go in it. *rule: as it was. */
static bool strikes_leg(faults *f, fault_id id, uint64_t now_us, uint8_t op, const dr_leg *leg, fault_rule *rule)
{
    for (uint8_t i = 0; i < f->count; i++) {
        fault_rule *const r = &f->rules[i];
        if (r->id != id || (r->op != DR_OP_NONE && r->op != op) || now_us < r->from_us || now_us >= r->until_us ||
            (r->chance_millionths < FAULT_SURE && chance(f, FAULT_SURE) >= r->chance_millionths) ||
            (leg != NULL && leg->from[r->axis] == leg->to[r->axis]))
            continue;
        *rule = *r;
        f->struck |= UINT32_C(1) << id;
        if (r->left != FAULT_ALWAYS && --r->left == 0)
            remove_at(f, i);
        return true;
    }
    return false;
}

static bool strikes(faults *f, fault_id id, uint64_t now_us, uint8_t op, fault_rule *rule)
{
    return strikes_leg(f, id, now_us, op, NULL, rule);
}

/* -- Answers and streamed frames ------------------------------------------------------------------------------------------ */

static void begin_frame(faults *f, uint64_t now_us, uint8_t op)
{
    fault_rule r;
    if (strikes(f, FAULT_SHORT_FRAME, now_us, op, &r)) {
        f->drop_from = (uint8_t)(1u + chance(f, DR_STREAM_FRAME - 1u));
        f->drop_to = DR_STREAM_FRAME;
    }
    if (strikes(f, FAULT_TORN_FRAME, now_us, op, &r)) {
        f->late_at = DR_STREAM_FRAME / 2u;
        f->late_us = r.delay_us;
    }
}

static void begin_answer(faults *f, uint64_t now_us, uint8_t op)
{
    const uint8_t last = (uint8_t)(f->length - 1u);
    fault_rule r;
    if (strikes(f, FAULT_DROP_CR, now_us, op, &r))
        f->drop_from = last;
    else if (strikes(f, FAULT_DROP_BYTE, now_us, op, &r))
        f->drop_from = (uint8_t)chance(f, f->length);
    if (f->drop_from != NO_BYTE)
        f->drop_to = (uint8_t)(f->drop_from + 1u);
    if (strikes(f, FAULT_DUPLICATE_BYTE, now_us, op, &r))
        f->twice_at = (uint8_t)chance(f, f->length);
    if (strikes(f, FAULT_CORRUPT_BYTE, now_us, op, &r)) {
        f->corrupt_at = (uint8_t)chance(f, f->length);
        f->corrupt_bit = (uint8_t)chance(f, 8);
    }
    if (strikes(f, FAULT_STRAY_BYTES, now_us, op, &r))
        f->stray_count = 2;
    if (strikes(f, FAULT_SLOW_ANSWER, now_us, op, &r))
        f->late_at = 0;
    else if (strikes(f, FAULT_LATE_CR, now_us, op, &r))
        f->late_at = last;
    else if (strikes(f, FAULT_DELAY_BYTE, now_us, op, &r))
        f->late_at = (uint8_t)chance(f, f->length);
    if (f->late_at != NO_BYTE)
        f->late_us = r.delay_us;
}

uint64_t faults_hold_us(faults *f, uint64_t now_us, const dr_controller *c)
{
    bool first;
    const uint8_t op = (uint8_t)dr_controller_answering(c, &first);
    const bool has_reply = c->out_at < c->out_bytes;
    if (f->is_wedged)
        return UINT64_MAX;
    if (!f->is_answering) {
        const bool is_frame = op == DR_OP_MPC_LINE && has_reply && c->out_bytes - c->out_at >= (int)DR_STREAM_FRAME;
        f->is_answering = true;
        f->at = 0;
        f->length = is_frame ? DR_STREAM_FRAME : has_reply ? (uint8_t)(c->out_bytes - c->out_at) : 1u;
        f->drop_from = f->drop_to = f->twice_at = f->corrupt_at = f->late_at = NO_BYTE;
        f->stray_count = 0;
        f->late_us = 0;
        if (is_frame)
            begin_frame(f, now_us, op);
        else
            begin_answer(f, now_us, op);
    }
    if (f->at != f->late_at)
        return now_us;
    f->late_at = NO_BYTE;
    return now_us + f->late_us;
}

uint8_t faults_byte(faults *f, uint8_t byte, uint8_t out[FAULT_BYTES_MAX])
{
    uint8_t count = 0;
    const uint8_t at = f->at++;
    for (; f->stray_count > 0; f->stray_count--)
        out[count++] = (uint8_t)chance(f, 256);
    if (at == f->corrupt_at)
        byte = (uint8_t)(byte ^ 1u << f->corrupt_bit);
    if (at < f->drop_from || at >= f->drop_to)
        out[count++] = byte;
    if (at == f->twice_at && count > 0 && count < FAULT_BYTES_MAX)
        out[count++] = byte;
    f->is_answering = f->at < f->length;
    return count;
}

/* -- The host's bytes ----------------------------------------------------------------------------------------------------- */

/* Is this byte the last one of a command? */
static bool completes(const dr_controller *c, uint8_t byte, dr_command *command)
{
    const uint8_t code = c->framer.have > 0 ? c->framer.bytes[0] : byte;
    return dr_command_find((dr_kind)c->kind, c->firmware, code, command) && c->framer.have == command->args;
}

bool faults_host_byte(faults *f, uint64_t now_us, const dr_controller *c, uint8_t byte)
{
    dr_command command;
    fault_rule r;
    if (f->is_wedged || strikes(f, FAULT_LOSE_HOST_BYTE, now_us, DR_OP_NONE, &r))
        return false;
    if (c->framer.have == 0 && dr_command_find((dr_kind)c->kind, c->firmware, byte, &command)) {
        if ((command.is & DR_IS_INTERRUPT) != 0 && strikes(f, FAULT_IGNORE_STOP, now_us, command.op, &r))
            return false;
        f->is_wedged = strikes(f, FAULT_WEDGE, now_us, command.op, &r);
    }
    if (completes(c, byte, &command) && !f->is_wedged && strikes(f, FAULT_USB_UNPLUG, now_us, command.op, &r))
        f->unplug_us = r.delay_us > 0 ? r.delay_us : 1u;
    return !f->is_wedged;
}

/* -- Moves --------------------------------------------------------------------------------------------------------------- */

static bool is_moving(const dr_controller *c) { return c->state == DR_STATE_MOVING || c->state == DR_STATE_PAUSED; }

static bool calibrates(uint8_t op) { return op == DR_OP_MPC_CALIBRATE || op == DR_OP_TRIO_RECALIBRATE; }

static void end_slip(faults *f, const dr_controller *c)
{
    if (!f->slips)
        return;
    f->slips = false;
    f->has_slipped = true;
    f->slipped_steps[f->slip_drive][f->slip_axis] +=
        (int64_t)c->drives[f->slip_drive].position_steps[f->slip_axis] - (int64_t)f->slip_from_steps;
}

/* A whole calibration finds the ends of the axes: positions are those of the tips again. */
static void end_move(faults *f, const dr_controller *c)
{
    f->slow_times = 0;
    if (calibrates(f->move_op) && c->drives[f->move_drive].calibration == DR_CALIBRATED)
        memset(f->slipped_steps[f->move_drive], 0, sizeof f->slipped_steps[f->move_drive]);
}

/* As much longer as the clock of a leg can tell. */
static uint16_t times_that_fit(const dr_controller *c, uint8_t times)
{
    const uint32_t lasts_us = dr_leg_lasts_us(&c->leg);
    const uint32_t most = lasts_us == 0 ? 1u : (uint32_t)INT32_MAX / lasts_us;
    return times == 0 ? 1u : times < most ? times : (uint16_t)most;
}

static void lose_power(faults *f, uint64_t now_us, const dr_controller *c, fault_id id)
{
    fault_rule r;
    const bool began_by_itself = c->move_op == DR_OP_TRIO_RECALIBRATE && !c->move_answers; /* or it would never end */
    if (began_by_itself || !strikes(f, id, now_us, c->move_op, &r))
        return;
    f->power_off_us = now_us + dr_leg_lasts_us(&c->leg) / 2u;
    f->without_power_us = r.delay_us;
    f->power_forgets = id == FAULT_POWER_LOSS_FORGET;
}

static void begin_leg(faults *f, uint64_t now_us, dr_controller *c)
{
    fault_rule r;
    const uint8_t stalled = strikes_leg(f, FAULT_STALL_AXIS, now_us, c->move_op, &c->leg, &r) ? r.axis : DR_AXES;
    if (stalled < DR_AXES || f->slow_times > 0)
        (void)dr_controller_spoil_leg(c, (dr_us)now_us, stalled, times_that_fit(c, f->slow_times));
    if (strikes_leg(f, FAULT_SLIP_AXIS, now_us, c->move_op, &c->leg, &r)) {
        f->slips = true;
        f->slip_axis = r.axis;
        f->slip_drive = c->active;
        f->slip_from_steps = c->drives[c->active].position_steps[r.axis]; /* where the leg begins */
    }
    lose_power(f, now_us, c, FAULT_POWER_LOSS);
    lose_power(f, now_us, c, FAULT_POWER_LOSS_FORGET);
}

void faults_look(faults *f, uint64_t now_us, dr_controller *c)
{
    fault_rule r;
    const bool moves = is_moving(c);
    const bool is_leg = c->state == DR_STATE_MOVING && c->leg_began == (dr_us)now_us &&
                        (!f->was_moving || f->leg_number != c->move_leg || f->leg_began != c->leg_began);
    const bool is_move = is_leg && (!f->was_moving || c->move_leg <= f->leg_number || c->move_op != f->move_op);
    if (c->state == DR_STATE_OFF)
        f->is_wedged = f->is_answering = false;
    else
        f->power_on_us = 0; /* it is back, or somebody was faster */
    if (is_leg || !moves)
        end_slip(f, c);
    if (f->was_moving && (is_move || !moves))
        end_move(f, c);
    if (is_move)
        f->slow_times = strikes(f, FAULT_SLOW_MOTION, now_us, c->move_op, &r) ? r.times : 0;
    if (is_leg)
        begin_leg(f, now_us, c);
    f->was_moving = moves;
    f->move_op = c->move_op;
    f->move_drive = c->active;
    f->leg_number = c->move_leg;
    f->leg_began = c->leg_began;
}

bool faults_power_due(const faults *f, uint64_t *when_us, bool *on)
{
    *on = f->power_off_us == 0;
    *when_us = *on ? f->power_on_us : f->power_off_us;
    return *when_us > 0;
}

void faults_forget_positions(faults *f, dr_controller *c)
{
    for (uint8_t i = 0; i < c->drive_count; i++) {
        dr_drive *const drive = &c->drives[i];
        for (uint8_t axis = 0; axis < DR_AXES; axis++) {
            f->slipped_steps[i][axis] -= drive->position_steps[axis];
            drive->position_steps[axis] = 0;
        }
        drive->calibration = DR_UNCALIBRATED;
    }
    f->has_slipped = true;
}

int64_t faults_slipped_steps(const faults *f, const dr_controller *c, uint8_t drive, uint8_t axis, dr_us now)
{
    int64_t slipped = f->slipped_steps[drive][axis];
    if (f->slips && drive == f->slip_drive && axis == f->slip_axis) {
        uint32_t steps[DR_AXES];
        dr_controller_position(c, drive, now, steps);
        slipped += (int64_t)steps[axis] - (int64_t)f->slip_from_steps;
    }
    return slipped;
}
