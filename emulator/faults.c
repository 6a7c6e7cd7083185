#include "faults.h"

#include <string.h>

#define NO_BYTE UINT8_MAX
#define MS UINT32_C(1000)

static const fault_words words[FAULTS] = {
    [FAULT_DROP_BYTE] = {"drop-byte", "one byte of an answer is lost", 0, FAULT_OF_ANSWER, false},
    [FAULT_DELAY_BYTE] = {"delay-byte", "one byte of an answer, and what follows, is late", 200 * MS, FAULT_OF_ANSWER,
                          false},
    [FAULT_DUPLICATE_BYTE] = {"duplicate-byte", "one byte of an answer comes twice", 0, FAULT_OF_ANSWER, false},
    [FAULT_CORRUPT_BYTE] = {"corrupt-byte", "one bit of an answer is changed", 0, FAULT_OF_ANSWER, false},
    [FAULT_DROP_CR] = {"drop-cr", "the CR of an answer is lost", 0, FAULT_OF_ANSWER, false},
    [FAULT_LATE_CR] = {"late-cr", "the CR of an answer is late", 500 * MS, FAULT_OF_ANSWER, false},
    [FAULT_STRAY_BYTES] = {"stray-bytes", "two bytes that mean nothing come before an answer", 0, FAULT_OF_ANSWER,
                           false},
    [FAULT_SLOW_ANSWER] = {"slow-answer", "an answer is late", 500 * MS, FAULT_OF_ANSWER, false},
    [FAULT_SHORT_FRAME] = {"short-frame", "a streamed frame lacks its last bytes", 0, FAULT_OF_FRAME, false},
    [FAULT_TORN_FRAME] = {"torn-frame", "a streamed frame stops in its middle for a while", 50 * MS, FAULT_OF_FRAME,
                          false},
    [FAULT_LOSE_HOST_BYTE] = {"lose-host-byte", "a byte of the host never arrives", 0, FAULT_OF_HOST_BYTE, false},
    [FAULT_IGNORE_STOP] = {"ignore-stop", "^C never arrives", 0, FAULT_OF_STOP, false},
    [FAULT_WEDGE] = {"wedge", "deaf and mute from a command on, until a power cycle", 0, FAULT_OF_COMMAND, false},
    [FAULT_STALL_AXIS] = {"stall-axis", "an axis gets half of its way only; the answer is as ever", 0, FAULT_OF_LEG,
                          true},
    [FAULT_SLIP_AXIS] = {"slip-axis", "the position of an axis counts, its tip stays", 0, FAULT_OF_LEG, true}};

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

/* Does a rule of this fault strike now? *rule: as it was. */
static bool strikes(faults *f, fault_id id, uint64_t now_us, uint8_t op, fault_rule *rule)
{
    for (uint8_t i = 0; i < f->count; i++) {
        fault_rule *const r = &f->rules[i];
        if (r->id != id || (r->op != DR_OP_NONE && r->op != op) || now_us < r->from_us || now_us >= r->until_us ||
            (r->chance_millionths < FAULT_SURE && chance(f, FAULT_SURE) >= r->chance_millionths))
            continue;
        *rule = *r;
        f->struck |= UINT32_C(1) << id;
        if (r->left != FAULT_ALWAYS && --r->left == 0)
            remove_at(f, i);
        return true;
    }
    return false;
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

bool faults_host_byte(faults *f, uint64_t now_us, const dr_controller *c, uint8_t byte)
{
    dr_command command;
    fault_rule r;
    if (f->is_wedged || strikes(f, FAULT_LOSE_HOST_BYTE, now_us, DR_OP_NONE, &r))
        return false;
    if (c->framer.have > 0 || !dr_command_find((dr_kind)c->kind, c->firmware, byte, &command))
        return true;
    if ((command.is & DR_IS_INTERRUPT) != 0 && strikes(f, FAULT_IGNORE_STOP, now_us, command.op, &r))
        return false;
    f->is_wedged = strikes(f, FAULT_WEDGE, now_us, command.op, &r);
    return !f->is_wedged;
}

/* -- Axes ----------------------------------------------------------------------------------------------------------------- */

static bool is_moving(const dr_controller *c) { return c->state == DR_STATE_MOVING || c->state == DR_STATE_PAUSED; }

static void end_slip(faults *f, const dr_controller *c)
{
    if (!f->slips)
        return;
    f->slips = false;
    f->slipped_steps[f->slip_drive][f->slip_axis] +=
        (int64_t)c->drives[f->slip_drive].position_steps[f->slip_axis] - (int64_t)f->slip_from_steps;
}

/* The leg has just begun, nothing of it is done: its end comes half way, and so much earlier. The core evaluates the leg as
 * it stands, so positions, streamed frames and ^C are right. */
static void stall(dr_leg *leg, uint8_t axis)
{
    const uint32_t from = leg->from[axis], to = leg->to[axis];
    leg->to[axis] = to > from ? from + (to - from) / 2u : from - (from - to) / 2u;
    leg->lasts_us[axis] = leg->to[axis] == from ? 0 : (leg->lasts_us[axis] + 1u) / 2u;
}

static void begin_leg(faults *f, uint64_t now_us, dr_controller *c)
{
    fault_rule r;
    if (strikes(f, FAULT_STALL_AXIS, now_us, c->move_op, &r))
        stall(&c->leg, r.axis);
    if (strikes(f, FAULT_SLIP_AXIS, now_us, c->move_op, &r)) {
        f->slips = true;
        f->slip_axis = r.axis;
        f->slip_drive = c->active;
        f->slip_from_steps = c->leg.from[r.axis];
    }
}

void faults_look(faults *f, uint64_t now_us, dr_controller *c)
{
    const bool moves = is_moving(c);
    const bool is_new = c->state == DR_STATE_MOVING && c->leg_began == (dr_us)now_us &&
                        (f->leg_state == DR_STATE_REST || f->leg_number != c->move_leg || f->leg_began != c->leg_began);
    if (c->state == DR_STATE_OFF)
        f->is_wedged = f->is_answering = false;
    if (is_new || !moves)
        end_slip(f, c);
    if (is_new)
        begin_leg(f, now_us, c);
    f->leg_state = moves ? DR_STATE_MOVING : DR_STATE_REST;
    f->leg_number = c->move_leg;
    f->leg_began = c->leg_began;
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
