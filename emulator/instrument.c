#include "instrument.h"

#define BEAT_US 100000u /* quirk nul-heartbeat */
#define LETTER_I 0x49u  /* quirk stop-says-i */

/* -- Time ------------------------------------------------------------------------------------------------------------ */

/* An instant of the controller's clock that lies ahead; one that has passed is now. */
static uint64_t ahead(const instrument *ins, dr_us when)
{
    return dr_us_before(when, instrument_now(ins)) ? ins->now_us : ins->now_us + (dr_us)(when - instrument_now(ins));
}

static bool earlier(bool have, uint64_t candidate, uint64_t *when)
{
    if (!have || candidate < *when)
        *when = candidate;
    return true;
}

/* -- The line -------------------------------------------------------------------------------------------------------- */

/* When the first `bytes` bytes of the busy period are through. */
static uint64_t through_us(const instrument *ins, const instrument_line *line, uint64_t bytes)
{
    return line->since_us + (bytes * ins->byte_num + ins->byte_den - 1u) / ins->byte_den;
}

/* A byte begins now: in the present busy period if the one before has just ended, else in a new one. */
static void begin_byte(const instrument *ins, instrument_line *line)
{
    if (through_us(ins, line, line->bytes) != ins->now_us)
        *line = (instrument_line){ins->now_us, 0};
}

/* -- To the host ----------------------------------------------------------------------------------------------------- */

static bool is_interrupt(dr_op op) { return op == DR_OP_MPC_INTERRUPT || op == DR_OP_TRIO_INTERRUPT; }

/* What the line carries next, if anything. */
static instrument_sending next_to_send(instrument *ins)
{
    dr_controller *c = &ins->controller;
    if (dr_controller_ready(c) == 0)
        return INSTRUMENT_NOTHING;
    if (ins->quirks == 0)
        return INSTRUMENT_REPLY;

    bool first;
    const dr_op op = dr_controller_answering(c, &first);
    if ((ins->quirks & INSTRUMENT_STOP_SAYS_I) != 0 &&
        ((is_interrupt(op) && !ins->said_i) || dr_controller_answers_stop(c)))
        return INSTRUMENT_LETTER_I;
    if ((ins->quirks & INSTRUMENT_POSITION_13) != 0 && op == DR_OP_MPC_POSITION && first) {
        uint8_t drive; /* never gets onto the line */
        (void)dr_controller_pull(c, instrument_now(ins), &drive, 1);
        ins->faults.at++;
    }
    return INSTRUMENT_REPLY;
}

/* Does a fault hold up what is to be sent? It is asked once for each byte. */
static bool is_held(instrument *ins)
{
    if (dr_controller_ready(&ins->controller) == 0 || !faults_any(&ins->faults))
        ins->held_until_us = 0;
    else if (ins->held_until_us <= ins->now_us)
        ins->held_until_us = faults_hold_us(&ins->faults, ins->now_us, &ins->controller);
    return ins->held_until_us > ins->now_us;
}

/* Gives the line something to carry, if it is free. */
static void feed_line(instrument *ins)
{
    if (ins->sending != INSTRUMENT_NOTHING || is_held(ins))
        return;
    ins->sending = (uint8_t)next_to_send(ins);
    if (ins->sending != INSTRUMENT_NOTHING)
        begin_byte(ins, &ins->to_host);
}

/* The byte on the line is through. Returns how many bytes that makes for the host: none, if the power went meanwhile. */
static size_t finish_byte(instrument *ins, uint8_t *bytes, size_t room)
{
    const uint8_t sent = ins->sending;
    size_t count = 1;
    ins->sent = sent;
    ins->sending = INSTRUMENT_NOTHING;
    ins->said_i = sent == INSTRUMENT_LETTER_I && !dr_controller_answers_stop(&ins->controller);
    switch (sent) {
    case INSTRUMENT_LETTER_I: /* before the CR, or in its place */
        count = dr_controller_ready(&ins->controller) > 0 ? 1 : 0;
        if (dr_controller_answers_stop(&ins->controller))
            ins->faults.is_answering = dr_controller_pull(&ins->controller, instrument_now(ins), bytes, 1) == 0;
        bytes[0] = LETTER_I;
        break;
    case INSTRUMENT_NUL:
        bytes[0] = 0;
        break;
    default: /* where bytes take no time, all leave at once, but not across the edge of a reply that a quirk changes */
        count = dr_controller_pull(&ins->controller, instrument_now(ins), bytes,
                                   ins->byte_num == 0 && ins->quirks == 0 && !faults_any(&ins->faults) ? room : 1);
        break;
    }
    ins->to_host.bytes += count;
    if (sent == INSTRUMENT_REPLY && count == 1 && ins->faults.is_answering)
        count = faults_byte(&ins->faults, bytes[0], bytes);
    return count;
}

/* The heartbeats of an 'M' come at whole 100 ms since it began. */
static bool beat_due(const instrument *ins, uint64_t *when_us)
{
    const dr_controller *c = &ins->controller;
    if ((ins->quirks & INSTRUMENT_NUL_HEARTBEAT) == 0 || c->state != DR_STATE_MOVING || c->move_op != DR_OP_MPC_MOVE)
        return false;
    const dr_us gone = instrument_now(ins) - c->leg_began;
    const dr_us past = gone % BEAT_US;
    const bool is_now = past == 0 && gone > 0 && ins->beat_us != ins->now_us;
    *when_us = is_now ? ins->now_us : ins->now_us - past + BEAT_US;
    return true;
}

static void beat(instrument *ins)
{
    ins->beat_us = ins->now_us;
    if (ins->sending == INSTRUMENT_NOTHING) {
        ins->sending = INSTRUMENT_NUL;
        begin_byte(ins, &ins->to_host);
    }
}

/* -- Running --------------------------------------------------------------------------------------------------------- */

void instrument_start(instrument *ins, uint64_t now_us)
{
    const uint32_t baud = ins->controller.kind == DR_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC;
    ins->now_us = now_us;
    ins->byte_num = ins->is_paced ? DR_BITS_PER_BYTE * DR_US_PER_S : 0;
    ins->byte_den = baud;
    ins->to_host = ins->from_host = (instrument_line){now_us, 0};
    ins->sending = INSTRUMENT_NOTHING;
    ins->said_i = false;
    ins->beat_us = now_us;
    ins->arriving_first = ins->arriving_count = 0;
    dr_controller_start(&ins->controller, instrument_now(ins));
    dr_panel_init(&ins->panel, &ins->controller, ins->panel_drives);
}

size_t instrument_room(const instrument *ins) { return INSTRUMENT_LINE_MAX - ins->arriving_count; }

size_t instrument_take(instrument *ins, uint32_t pause_us, const uint8_t *bytes, size_t count)
{
    const size_t taken = count < instrument_room(ins) ? count : instrument_room(ins);
    if (taken > 0 && ins->arriving_count == 0)
        begin_byte(ins, &ins->from_host);
    for (size_t i = 0; i < taken; i++) {
        const uint16_t at = (uint16_t)((ins->arriving_first + ins->arriving_count++) % INSTRUMENT_LINE_MAX);
        ins->arriving[at].byte = bytes[i];
        ins->arriving[at].pause_us = i == 0 ? pause_us : 0;
    }
    return taken;
}

/* The next byte from the host is through. */
static void arrive(instrument *ins)
{
    const uint16_t at = ins->arriving_first;
    ins->arriving_first = (uint16_t)((at + 1u) % INSTRUMENT_LINE_MAX);
    ins->arriving_count--;
    ins->from_host.bytes++;
    if (faults_any(&ins->faults) &&
        !faults_host_byte(&ins->faults, ins->now_us, &ins->controller, ins->arriving[at].byte))
        return;
    if (ins->arriving[at].pause_us > 0)
        dr_controller_paused(&ins->controller, ins->arriving[at].pause_us);
    dr_controller_push(&ins->controller, instrument_now(ins), &ins->arriving[at].byte, 1);
}

static bool arrival_due(const instrument *ins, uint64_t *when_us)
{
    if (ins->arriving_count > 0)
        *when_us = through_us(ins, &ins->from_host, ins->from_host.bytes + 1u);
    return ins->arriving_count > 0;
}

static bool hands_or_controller_due(const instrument *ins, uint64_t *when_us)
{
    bool have = false;
    dr_us at;
    if (dr_controller_due(&ins->controller, &at))
        have = earlier(have, ahead(ins, at), when_us);
    if (dr_panel_due(&ins->panel, &at))
        have = earlier(have, ahead(ins, at), when_us);
    return have;
}

/* The mains switch, as faults work it. */
static bool power_due(const instrument *ins, uint64_t *when_us, bool *on)
{
    if (!faults_power_due(&ins->faults, when_us, on))
        return false;
    if (*when_us < ins->now_us)
        *when_us = ins->now_us;
    return true;
}

static void switch_power(instrument *ins, bool on)
{
    faults *f = &ins->faults;
    const bool was_on = ins->controller.state != DR_STATE_OFF;
    f->power_off_us = f->power_on_us = 0;
    dr_panel_power(&ins->panel, instrument_now(ins), on);
    if (on || !was_on)
        return;
    f->power_on_us = ins->now_us + f->without_power_us;
    if (f->power_forgets)
        faults_forget_positions(f, &ins->controller);
}

bool instrument_due(const instrument *ins, uint64_t *when_us)
{
    bool have = hands_or_controller_due(ins, when_us);
    bool on;
    uint64_t when;
    if (ins->sending != INSTRUMENT_NOTHING)
        have = earlier(have, through_us(ins, &ins->to_host, ins->to_host.bytes + 1u), when_us);
    else if (ins->held_until_us > ins->now_us && ins->held_until_us < UINT64_MAX)
        have = earlier(have, ins->held_until_us, when_us);
    else if (dr_controller_ready(&ins->controller) > 0 && ins->held_until_us < UINT64_MAX)
        have = earlier(have, ins->now_us, when_us); /* hands have made it answer since the last run */
    if (beat_due(ins, &when))
        have = earlier(have, when, when_us);
    if (arrival_due(ins, &when))
        have = earlier(have, when, when_us);
    if (power_due(ins, &when, &on))
        have = earlier(have, when, when_us);
    return have;
}

/* Does the first thing that is to be done at now_us. Returns how many bytes have left. As each instant is visited, the panel
 * is settled whenever the controller is called. */
static size_t step(instrument *ins, uint8_t *bytes, size_t room)
{
    size_t count = 0;
    bool on;
    uint64_t when;
    if (hands_or_controller_due(ins, &when) && when == ins->now_us)
        dr_panel_settle(&ins->panel, instrument_now(ins));
    else if (power_due(ins, &when, &on) && when == ins->now_us)
        switch_power(ins, on);
    else if (ins->sending != INSTRUMENT_NOTHING &&
             through_us(ins, &ins->to_host, ins->to_host.bytes + 1u) == ins->now_us)
        count = finish_byte(ins, bytes, room);
    else if (beat_due(ins, &when) && when == ins->now_us)
        beat(ins);
    else if (arrival_due(ins, &when) && when == ins->now_us)
        arrive(ins);
    if (faults_any(&ins->faults))
        faults_look(&ins->faults, ins->now_us, &ins->controller);
    feed_line(ins);
    return count;
}

static bool has_news(const instrument *ins)
{
    return ins->faults.struck != 0 || (ins->controller.notes != NULL && ins->controller.notes->count > 0);
}

bool instrument_run(instrument *ins, uint64_t until_us, uint8_t *bytes, size_t room, size_t *count)
{
    uint64_t when;
    *count = 0;
    if (faults_any(&ins->faults)) /* hands may have begun a leg */
        faults_look(&ins->faults, ins->now_us, &ins->controller);
    while (instrument_due(ins, &when) && when <= until_us) {
        ins->now_us = when;
        *count = step(ins, bytes, room);
        if (*count > 0 || has_news(ins))
            return true;
    }
    if (until_us > ins->now_us)
        ins->now_us = until_us;
    return has_news(ins);
}
