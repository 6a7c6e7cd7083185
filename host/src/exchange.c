/* One command and its answer; doubt, and how to get back in step.
 *
 * The controllers answer without addresses, counters or checksums, and CR (0x0D) is an ordinary byte of a coordinate.
 * So an answer is believed for what surrounds it: the line was purged before, the answer has the documented length and
 * form, silence follows, and (queries) a second one is the same. Anything else raises doubt, and in doubt nothing is
 * sent but what resync() sends. */
#include "session.h"

#include "dr_words.h" /* dr_words_command */

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

int fail(dryrig *d, int error, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(d->why, sizeof d->why, format, arguments);
    va_end(arguments);
    return error;
}

uint64_t now_us(const dryrig *d) { return d->link.now_us(d->link.context); }

/* -- The line ------------------------------------------------------------------------------------------------------ */

static int lost(dryrig *d)
{
    d->doubt = d->doubt == DOUBT_NONE ? DOUBT_LATE : d->doubt;
    return fail(d, DRYRIG_ERR_LINK, "the port failed: unplugged, or whatever is behind it ended");
}

int hear(dryrig *d, uint8_t *bytes, size_t room, uint32_t timeout_us)
{
    const int count = d->link.read(d->link.context, bytes, room, timeout_us);
    if (count < 0)
        return lost(d);
    if (count > 0)
        d->busy_us = now_us(d);
    return count;
}

int drain(dryrig *d, uint32_t quiet_us, uint32_t limit_us)
{
    const uint64_t began_us = now_us(d);
    uint64_t silent_since_us = began_us;
    for (;;) {
        uint8_t dropped[64];
        const uint64_t at_us = now_us(d);
        if (at_us - silent_since_us >= quiet_us)
            return DRYRIG_OK;
        if (at_us - began_us >= limit_us)
            return fail(d, DRYRIG_ERR_GARBLED,
                        "the controller keeps sending: a streamed move is under way, or this is "
                        "another kind of device or another baud rate");
        const int count = hear(d, dropped, sizeof dropped, (uint32_t)(quiet_us - (at_us - silent_since_us)));
        if (count < 0)
            return count;
        if (count > 0)
            silent_since_us = now_us(d);
    }
}

static int write_out(dryrig *d, const uint8_t *bytes, size_t count)
{
    if (d->link.write(d->link.context, bytes, count) < 0)
        return lost(d);
    d->busy_us = now_us(d);
    return DRYRIG_OK;
}

int send(dryrig *d, const dr_request *request)
{
    uint8_t frame[DR_FRAME_MAX];
    const size_t count = dr_wire_put_request(d->kind, d->firmware, request, frame);
    if (count == 0)
        return fail(d, DRYRIG_ERR_UNSUPPORTED, "%s (firmware %x.%02x) has no command to %s",
                    dr_words_controller(d->kind), d->firmware >> 8u, d->firmware & 0xFFu,
                    dr_words_command((dr_op)request->op)->asks);
    const uint64_t since_us = now_us(d) - d->busy_us;
    if (since_us < PAUSE_US)
        d->link.sleep_us(d->link.context, (uint32_t)(PAUSE_US - since_us));
    if (d->link.purge(d->link.context) < 0)
        return lost(d);
    if (request->op != DR_OP_MPC_LINE)
        return write_out(d, frame, count);
    const int result = write_out(d, frame, 2);
    d->link.sleep_us(d->link.context, LINE_PAUSE_US);
    return result < 0 ? result : write_out(d, frame + 2, count - 2u);
}

int send_interrupt(dryrig *d)
{
    const dr_request stop = {d->kind == DR_TRIO ? DR_OP_TRIO_INTERRUPT : DR_OP_MPC_INTERRUPT, 0, {0, 0, 0}};
    uint8_t frame[DR_FRAME_MAX];
    return write_out(d, frame, dr_wire_put_request(d->kind, d->firmware, &stop, frame));
}

/* -- Answers ------------------------------------------------------------------------------------------------------- */

/* How many bytes an answer has that begins with these. */
static size_t answer_wants(const dryrig *d, const dr_command *row, const uint8_t *bytes, size_t count)
{
    switch (row->op) {
    case DR_OP_MPC_ACTIVE: /* below 3.00 no version follows the drive; a version's minor byte is never CR, as BCD */
        return count >= 2 && bytes[1] == DR_CR ? 2 : 4;
    case DR_OP_MPC_SELECT: /* up to 1.05 a CR alone */
        return count >= 1 && bytes[0] == DR_CR ? 1 : 2;
    case DR_OP_MPC_POSITION:
        return d->position_bytes == 13 ? 13 : row->reply;
    default:
        return row->reply;
    }
}

/* Some firmware leaves the drive out of a position [P, position-13]. Thirteen bytes may also be fourteen of which one
 * was lost: but then, unless it was the drive, the first is a drive's number. */
static bool is_position_13(dryrig *d, const uint8_t *bytes, size_t count)
{
    if (count != 13 || bytes[12] != DR_CR || d->position_bytes == 14)
        return false;
    return d->position_bytes == 13 || bytes[0] < 1u || bytes[0] > DR_PORTS;
}

/* Coordinates fit 24 bits, as streamed ones must [M note 16]; the longest travel takes 21. */
static bool is_plausible(const dr_command *row, const dr_reply *reply)
{
    for (size_t axis = 0; axis < DR_AXES; axis++)
        if ((row->is & DR_IS_QUERY) && reply->steps[axis] > UINT32_C(0xFFFFFF))
            return false;
    return true;
}

static bool read_answer(dryrig *d, const dr_command *row, answer *a)
{
    dr_command as = *row;
    if (row->op == DR_OP_MPC_POSITION && is_position_13(d, a->bytes, a->count)) {
        uint8_t whole[DR_REPLY_MAX] = {1};
        memcpy(whole + 1, a->bytes, 13);
        const bool valid = dr_wire_get_reply(row, whole, sizeof whole, &a->reply) && is_plausible(row, &a->reply);
        a->reply.value = 0; /* not told */
        return valid;
    }
    if (row->op == DR_OP_MPC_ACTIVE || row->op == DR_OP_MPC_SELECT)
        as.reply = a->count; /* the length tells the firmware, see answer_wants() */
    return dr_wire_get_reply(&as, a->bytes, a->count, &a->reply) && is_plausible(row, &a->reply);
}

static int garbled(dryrig *d, const dr_command *row, const answer *a, const char *what)
{
    char hex[3 * DR_REPLY_MAX + 1] = "";
    for (size_t i = 0; i < a->count; i++)
        (void)snprintf(hex + 3 * i, 4, " %02X", a->bytes[i]);
    return fail(d, DRYRIG_ERR_GARBLED, "%s (asked to %s; got%s)", what, dr_words_command((dr_op)row->op)->asks, hex);
}

/* Sends a command, and takes its answer when it is exact and quiet_us of silence follow. */
static int exchange(dryrig *d, const dr_request *request, uint32_t quiet_us, answer *a)
{
    dr_command row;
    memset(a, 0, sizeof *a);
    const int sent = send(d, request);
    if (sent < 0)
        return sent;
    (void)dr_command_for(d->kind, d->firmware, (dr_op)request->op, &row); /* there is one: it was sent */
    while (a->count < answer_wants(d, &row, a->bytes, a->count)) {
        const size_t room = answer_wants(d, &row, a->bytes, a->count) - a->count;
        const uint64_t limit_us = d->busy_us + (a->count == 0 ? d->answer_us : GAP_US);
        const uint64_t at_us = now_us(d);
        if (at_us >= limit_us)
            break;
        const int count = hear(d, a->bytes + a->count, room, (uint32_t)(limit_us - at_us));
        if (count < 0)
            return count;
        a->count = (uint8_t)(a->count + count);
    }
    if (a->count == 0)
        return fail(d, DRYRIG_ERR_TIMEOUT,
                    "no answer within %u ms (asked to %s). Is the controller on, is this its port, "
                    "and is a manipulator connected?",
                    (unsigned)(d->answer_us / MS_US), dr_words_command((dr_op)row.op)->asks);
    if (!read_answer(d, &row, a))
        return garbled(d, &row, a, "the answer is not a documented one");
    for (uint64_t end_us = now_us(d) + quiet_us, at_us; (at_us = now_us(d)) < end_us;) {
        uint8_t surplus;
        const int count = hear(d, &surplus, 1, (uint32_t)(end_us - at_us));
        if (count < 0)
            return count;
        if (count > 0)
            return garbled(d, &row, a, "more followed than the answer");
    }
    if (row.op == DR_OP_MPC_POSITION && d->position_bytes == 0 && a->count == 14)
        d->position_bytes = 14;
    return DRYRIG_OK;
}

/* -- Getting in step ----------------------------------------------------------------------------------------------- */

static dr_op position_op(const dryrig *d) { return d->kind == DR_TRIO ? DR_OP_TRIO_POSITION : DR_OP_MPC_POSITION; }

int stop_everything(dryrig *d, size_t times)
{
    bool answered = false;
    for (size_t i = 1; i <= times; i++) {
        uint8_t byte;
        int result = send_interrupt(d);
        /* All are sent, whatever comes back: a CR may as well be a coordinate of a position that is streamed. */
        const uint64_t end_us = now_us(d) + (i < times ? PAUSE_US : d->answer_us);
        for (uint64_t at_us; result >= 0 && !(answered && i == times) && (at_us = now_us(d)) < end_us;) {
            result = hear(d, &byte, 1, (uint32_t)(end_us - at_us));
            answered = answered || (result > 0 && byte == DR_CR);
        }
        if (result < 0)
            return result;
    }
    return answered ? DRYRIG_OK
                    : fail(d, DRYRIG_ERR_CANNOT_STOP, "no answer to ^C within %u ms", (unsigned)(d->answer_us / MS_US));
}

int resync(dryrig *d)
{
    if (d->doubt == DOUBT_TORN)
        return fail(d, DRYRIG_ERR_OUT_OF_STEP,
                    "a move that a TRIO cannot stop was not answered: it may still run, or the "
                    "command lost a byte. Look at the stage; then resynchronize");
    if (d->doubt == DOUBT_MOVING) {
        d->streaming = -1;
        const int result = stop_everything(d, STOPS_THAT_END_ALL);
        if (result < 0 && result != DRYRIG_ERR_CANNOT_STOP) /* not answering ^C, it may yet answer a query */
            return result;
    }
    const dr_request where = {(uint8_t)position_op(d), 0, {0, 0, 0}};
    uint8_t last_short[DR_REPLY_MAX];
    int silent = 0, alike_short = 0;
    for (int tries = 0, good = 0; tries < 6; tries++) {
        answer a;
        int result = drain(d, QUIET_US, DRAIN_US);
        if (result < 0)
            return result == DRYRIG_ERR_GARBLED ? DRYRIG_ERR_OUT_OF_STEP : result;
        result = exchange(d, &where, QUIET_US, &a);
        if (result == DRYRIG_ERR_LINK)
            return result;
        if (result == DRYRIG_ERR_TIMEOUT && ++silent == 2) /* no more: a command that waits for bytes would take them */
            return result;
        /* Two of thirteen bytes that cannot be anything else: that is how this firmware answers. */
        if (result == DRYRIG_OK && a.count == 13 && d->position_bytes == 0) {
            alike_short = alike_short && memcmp(last_short, a.bytes, 13) == 0 ? 2 : 1;
            memcpy(last_short, a.bytes, 13);
            if (alike_short == 2)
                d->position_bytes = 13;
        }
        good = result == DRYRIG_OK ? good + 1 : 0;
        if (good == 2) {
            d->doubt = DOUBT_NONE;
            return DRYRIG_OK;
        }
    }
    char last[DRYRIG_WHY_MAX / 2];
    (void)snprintf(last, sizeof last, "%.200s", d->why);
    return fail(d, DRYRIG_ERR_OUT_OF_STEP, "could not get in step with the controller; the last attempt: %s", last);
}

int command(dryrig *d, const dr_request *request, answer *out)
{
    for (int tries = 0;; tries++) {
        uint8_t unasked;
        /* Bytes that nobody asked for: whose answer were they? Not the one before this. */
        const int stray = d->doubt == DOUBT_NONE ? hear(d, &unasked, 1, 0) : 0;
        if (stray < 0)
            return stray;
        if (stray > 0)
            d->doubt = DOUBT_LATE;
        int result = d->doubt == DOUBT_NONE ? DRYRIG_OK : resync(d);
        if (result < 0)
            return result;
        result = exchange(d, request, PAUSE_US, out);
        if (result != DRYRIG_ERR_TIMEOUT && result != DRYRIG_ERR_GARBLED)
            return result;
        d->doubt = DOUBT_LATE;
        if (tries == 1)
            return result;
    }
}

int ask(dryrig *d, dr_op op, answer *out)
{
    const dr_request query = {(uint8_t)op, 0, {0, 0, 0}};
    answer before;
    memset(out, 0, sizeof *out);
    int result = command(d, &query, out);
    for (int tries = 0; result == DRYRIG_OK && !d->ask_once && tries < 4; tries++) {
        before = *out;
        result = command(d, &query, out);
        if (result == DRYRIG_OK && before.count == out->count && memcmp(before.bytes, out->bytes, out->count) == 0)
            return DRYRIG_OK;
    }
    if (result == DRYRIG_OK && !d->ask_once)
        return fail(d, DRYRIG_ERR_CHANGING,
                    "the answers differ from one to the next (asked to %s): a knob is turned, or "
                    "something moves",
                    dr_words_command(op)->asks);
    return result;
}

int settle(dryrig *d, uint32_t spacing_us, dryrig_position *out)
{
    answer first, a;
    int result = ask(d, position_op(d), &first);
    a = first;
    if (result == DRYRIG_OK && spacing_us > 0) {
        d->link.sleep_us(d->link.context, spacing_us);
        result = ask(d, position_op(d), &a);
        if (result == DRYRIG_OK && memcmp(first.bytes, a.bytes, sizeof first.bytes) != 0)
            result = fail(d, DRYRIG_ERR_CHANGING, "the stage still moves");
    }
    if (result == DRYRIG_OK && d->position_bytes == 13) {
        answer active;
        result = ask(d, DR_OP_MPC_ACTIVE, &active);
        a.reply.value = active.reply.value;
    }
    if (result == DRYRIG_OK || result == DRYRIG_ERR_CHANGING)
        *out = to_position(d, &a.reply);
    return result;
}

int need_firmware(dryrig *d)
{
    if (d->firmware_is_known || d->firmware_is_old)
        return DRYRIG_OK;
    answer a;
    const int result = ask(d, DR_OP_MPC_ACTIVE, &a);
    if (result < 0)
        return result;
    d->firmware_is_known = a.count == 4;
    d->firmware_is_old = a.count == 2;
    d->firmware = d->firmware_is_known ? a.reply.firmware : 0x0299; /* the newest of those that do not tell */
    return DRYRIG_OK;
}
