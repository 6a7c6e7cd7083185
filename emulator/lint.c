#include "lint.h"

#include "dr_words.h" /* names of commands, points */

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define NS_PER_US UINT64_C(1000)
#define SMALL_MOVE_STEPS 16u
#define MODE_MAX 9u

/* -- The rules --------------------------------------------------------------------------------------------------------- */

static const lint_words words[LINT_RULES] = {
    [LINT_EARLY_COMMAND] = {"early-command", "A command was sent before the CR of the one before.",
                            "[T] notes 1 and 12, [M] notes 1, 3 and 14",
                            "Read the whole answer, to its CR, before the next command. Only ^C may come earlier."},
    [LINT_HURRIED_COMMAND] = {"hurried-command", "A command was sent less than 2 ms after the answer before it.",
                              "[T] note 2, [M] note 2", "Wait 2 ms between an answer and the next command."},
    [LINT_NO_PAUSE_IN_S] = {"no-pause-in-s",
                            "An S came with less than 20 ms of pause in all. Real controllers hang on it.",
                            "[M] table 9, 'S': 30 ms between the velocity byte and the rest",
                            "Write 'S' and the speed, wait 30 ms, then write the coordinates."},
    [LINT_BEYOND_TRAVEL] = {"beyond-travel", "A target is beyond the travel, or negative.", "[T] note 5, [M] note 5",
                            "Check targets before they are sent: 0 to the last microstep of the axis, unsigned."},
    [LINT_SWAPPED_BYTES] = {"swapped-bytes",
                            "The bytes of a coordinate look swapped: read the other way round they are within the "
                            "travel.",
                            "[O] USB commands v1.10; PROTOCOL.md, contradictions: byte order",
                            "Send coordinates with the least significant byte first."},
    [LINT_SHORT_TIME_LIMIT] = {"short-time-limit",
                               "The program waited for an answer, gave up too early, and went on. The late answer will "
                               "be taken for the next one's.",
                               "[T] note 1, [M] notes 1 and 10",
                               "Let the time limit of reading be longer than the longest move, or end the move with "
                               "^C and read its CR."},
    [LINT_UNREAD_REPLY] =
        {"unread-reply", "An answer, or a part of one, was left unread.",
         "[T] table 6 and note 3, [M] table 9 and note 3",
         "Read exactly as many bytes as the command answers, and clear the buffers before a command."},
    [LINT_WRONG_COMMAND] = {"wrong-command", "A command was sent that this controller, or its firmware, does not have.",
                            "[T] table 6, [M] table 9",
                            "Ask for the firmware first ('K' on an MPC-200) and use the table of this controller."},
    [LINT_UPPER_CASE_AXIS] = {"upper-case-axis",
                              "A TRIO was sent an upper-case X, Y or Z, or the code printed for one.",
                              "[T] table 6, whose codes 5A, 5B, 5C are one letter off",
                              "Send the lower-case letters: 78, 79, 7A."},
    [LINT_ANGLE_EXTREME] = {"angle-extreme", "The angle was set to 0 or 90, where an axis does not move, or beyond.",
                            "[T] note 13", "Set 1 to 89 degrees."},
    [LINT_WORK_WITHOUT_HOME] = {"work-without-home", "Y was sent though the last completed motion was no Home.",
                                "[M] table 9, 'Y'; [O]", "Send H, read its CR, and only then Y."},
    [LINT_SMALL_MOVE] = {"small-move",
                         "A move of under 16 microsteps on every axis. Real MPC-200s ignore it and send no CR.",
                         "PROTOCOL.md, quirk small-move-silent [R]",
                         "Leave out moves that short, or go farther and come back."},
    [LINT_QUERY_IN_MOVE] = {"query-in-move", "A query was sent during a move.", "[T] note 12, [M] notes 3 and 14",
                            "Wait for the CR of the move; on an MPC-200 'O' makes S tell its positions by itself."},
    [LINT_STREAMING_ASSUMED] = {"streaming-assumed",
                                "S was sent without F or O before it: whether positions are streamed is not known.",
                                "[M] table 9, 'F' and 'O', note 16", "Send F or O once after the port is opened."},
    [LINT_WRONG_BAUD] = {"wrong-baud", "The port is set to a baud rate that the controller does not have.",
                         "[T] table 3, [M] table 5", "Set 57600 baud for a TRIO, 128000 for an MPC-200."},
    [LINT_THIRTEEN_BYTES] = {"thirteen-bytes", "The last byte of a position's answer was left unread: it has 14 bytes.",
                             "[T] table 6, 'c'; [M] table 9, 'C'", "Read 14 bytes."},
    [LINT_NO_WORK_POSITION] = {"no-work-position", "A move to the work position, but none is stored: nothing moves.",
                               "[T] page 1, [M] page 1", "Store one at the controller, or move to coordinates."},
    [LINT_SPEED_TOO_HIGH] = {"speed-too-high", "The speed of S is above 15.", "[T] note 11, [M] note 12",
                             "Send 0 to 15."},
    [LINT_VALUE_OUT_OF_RANGE] = {"value-out-of-range", "A drive that is not 1 to 4, or a mode above 9.",
                                 "[M] table 9, 'I' and 'L'", "Send the number as one byte: 01, not the digit '1'."},
};

const lint_words *lint_words_of(lint_rule rule) { return &words[rule]; }

/* -- Findings ---------------------------------------------------------------------------------------------------------- */

static bool make_room(lint *l)
{
    if (l->finding_count < l->finding_room)
        return true;
    if (l->finding_room >= LINT_FINDINGS_MAX)
        return false;
    unsigned room = l->finding_room == 0 ? 64u : 2u * l->finding_room;
    room = room < LINT_FINDINGS_MAX ? room : LINT_FINDINGS_MAX;
    lint_finding *const more = realloc(l->findings, room * sizeof *more);
    if (more == NULL)
        return false;
    l->findings = more;
    l->finding_room = room;
    return true;
}

#if defined(__GNUC__)
static void find(lint *l, const lint_station *s, const observation *seen, lint_rule rule, const uint8_t *bytes,
                 size_t count, const char *format, ...) __attribute__((format(printf, 7, 8)));
#endif

static void find(lint *l, const lint_station *s, const observation *seen, lint_rule rule, const uint8_t *bytes,
                 size_t count, const char *format, ...)
{
    l->counts[rule]++;
    if (!make_room(l)) {
        l->lacks_memory = true;
        return;
    }
    lint_finding *const f = &l->findings[l->finding_count++];
    memset(f, 0, sizeof *f);
    f->rule = rule;
    f->station = (uint16_t)(s - l->stations);
    f->when_us = seen->when_us;
    f->count = (uint8_t)(count <= sizeof f->bytes ? count : sizeof f->bytes);
    if (f->count > 0)
        memcpy(f->bytes, bytes, f->count);
    va_list arguments;
    va_start(arguments, format);
    /* NOLINTNEXTLINE(clang-analyzer-valist.Uninitialized): the analyzer of LLVM 14 overlooks va_start() */
    (void)vsnprintf(f->text, sizeof f->text, format, arguments);
    va_end(arguments);
}

unsigned long lint_total(const lint *l)
{
    unsigned long total = 0;
    for (unsigned i = 0; i < LINT_RULES; i++)
        total += l->counts[i];
    return total;
}

/* -- What the host is owed --------------------------------------------------------------------------------------------- */

static bool is_deaf(const instrument *ins)
{
    const dr_controller *const c = &ins->controller;
    return c->state == DR_STATE_OFF || c->state == DR_STATE_BOOTING || c->state == DR_STATE_WEDGED ||
           ins->faults.is_wedged;
}

/* A move of the host's is under way. */
static bool is_moving_for_host(const dr_controller *c)
{
    return (c->state == DR_STATE_MOVING || c->state == DR_STATE_PAUSED) && c->move_answers;
}

static bool is_reply_leaving(const instrument *ins)
{
    return dr_controller_ready(&ins->controller) > 0 ||
           (ins->sending != INSTRUMENT_NOTHING && ins->sending != INSTRUMENT_NUL);
}

static bool is_owed(const lint_station *s)
{
    const dr_controller *const c = &s->ins->controller;
    return s->in_flight > 0 || is_moving_for_host(c) || c->kept_bytes > 0 || is_reply_leaving(s->ins);
}

/* -- One command ------------------------------------------------------------------------------------------------------- */

static const dr_drive *active_of(const instrument *ins) { return &ins->controller.drives[ins->controller.active]; }

static uint32_t swapped(uint32_t v) { return v >> 24 | (v >> 8 & 0xFF00u) | (v << 8 & 0xFF0000u) | v << 24; }

/* The axes whose coordinates are in the frame, as bits. */
static unsigned axes_of(const dr_command *command)
{
    const uint8_t axis = dr_wire_axis((dr_op)command->op);
    return axis < DR_AXES ? 1u << axis : 7u;
}

static void judge_target(lint *l, const lint_station *s, const observation *seen, const dr_command *command,
                         const uint8_t *bytes, size_t count)
{
    static const char letters[DR_AXES] = {'X', 'Y', 'Z'};
    dr_stage stage;
    if (!dr_stage_get((dr_stage_id)active_of(s->ins)->stage, &stage))
        return;
    const dr_request request = dr_wire_get_request(command, bytes);
    const unsigned axes = axes_of(command);
    unsigned first = DR_AXES;
    bool fits_swapped = true;
    for (unsigned axis = DR_AXES; axis-- > 0;) {
        if ((axes >> axis & 1u) == 0)
            continue;
        if (request.steps[axis] > stage.travel_steps[axis])
            first = axis;
        if (swapped(request.steps[axis]) > stage.travel_steps[axis])
            fits_swapped = false;
    }
    if (first == DR_AXES)
        return;
    const unsigned long is = request.steps[first], last = stage.travel_steps[first];
    if (fits_swapped)
        find(l, s, seen, LINT_SWAPPED_BYTES, bytes, count,
             "%c is %lu; with its bytes swapped %lu, and the travel is %lu", letters[first], is,
             (unsigned long)swapped(request.steps[first]), last);
    else if (is > 0x7FFFFFFFu)
        find(l, s, seen, LINT_BEYOND_TRAVEL, bytes, count, "%c is %lu, that is -%lu; it must be 0 to %lu",
             letters[first], is, 0x100000000u - is, last);
    else
        find(l, s, seen, LINT_BEYOND_TRAVEL, bytes, count, "%c is %lu; it must be 0 to %lu", letters[first], is, last);
}

static void judge_distance(lint *l, const lint_station *s, const observation *seen, const dr_command *command,
                           const uint8_t *bytes, size_t count)
{
    const dr_drive *const drive = active_of(s->ins);
    const dr_request request = dr_wire_get_request(command, bytes);
    dr_stage stage;
    if (!dr_stage_get((dr_stage_id)drive->stage, &stage) || s->ins->controller.state != DR_STATE_REST)
        return;
    uint32_t longest = 0;
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        const uint32_t last = stage.travel_steps[axis];
        const uint32_t to = request.steps[axis] < last ? request.steps[axis] : last, at = drive->position_steps[axis];
        const uint32_t way = to > at ? to - at : at - to;
        longest = way > longest ? way : longest;
    }
    if (longest < SMALL_MOVE_STEPS)
        find(l, s, seen, LINT_SMALL_MOVE, bytes, count, "the longest way is %lu microstep%s", (unsigned long)longest,
             longest == 1 ? "" : "s");
}

/* What the frame itself says. */
static void judge_contents(lint *l, lint_station *s, const observation *seen, const dr_command *command,
                           const uint8_t *bytes, size_t count, bool was_owed)
{
    const dr_controller *const c = &s->ins->controller;
    const dr_drive *const drive = active_of(s->ins);
    const bool is_connected = drive->stage != DR_STAGE_NONE;
    const unsigned value = command->args == DR_ARGS_BYTE || command->args == DR_ARGS_LINE ? bytes[1] : 0;
    if ((command->is & DR_IS_TARGETED) != 0)
        judge_target(l, s, seen, command, bytes, count);
    switch ((dr_op)command->op) {
    case DR_OP_TRIO_X:
    case DR_OP_TRIO_Y:
    case DR_OP_TRIO_Z:
        if (bytes[0] >= 'X' && bytes[0] <= 'Z')
            find(l, s, seen, LINT_UPPER_CASE_AXIS, bytes, count, "%02X is '%c' and moves %c", (unsigned)bytes[0],
                 bytes[0], bytes[0]);
        break;
    case DR_OP_TRIO_ANGLE:
        if (value == 0 || value == DR_ANGLE_MAX_DEG)
            find(l, s, seen, LINT_ANGLE_EXTREME, bytes, count, "at %u degrees the %c axis does not move", value,
                 value == 0 ? 'Z' : 'X');
        else if (value > DR_ANGLE_MAX_DEG)
            find(l, s, seen, LINT_ANGLE_EXTREME, bytes, count, "%u degrees change nothing: the angle is 0 to 90",
                 value);
        break;
    case DR_OP_MPC_LINE:
        if ((uint64_t)s->pause_us + s->late_us < DR_PAUSE_IN_LINE_US)
            find(l, s, seen, LINT_NO_PAUSE_IN_S, bytes, count, "%lu.%01lu ms of pause within it",
                 (unsigned long)s->pause_us / 1000u, (unsigned long)s->pause_us / 100u % 10u);
        if (!s->said_streaming && !s->told_streaming) {
            s->told_streaming = true; /* once: it is one omission */
            find(l, s, seen, LINT_STREAMING_ASSUMED, bytes, count,
                 "neither F nor O has been sent since the port was opened");
        }
        /* fall through */
    case DR_OP_MPC_MOVE:
        if (!was_owed && is_connected) /* else it is not known where it will start */
            judge_distance(l, s, seen, command, bytes, count);
        if (command->op == DR_OP_MPC_MOVE)
            break;
        /* fall through */
    case DR_OP_TRIO_LINE:
        if (value >= DR_SPEED_LEVELS)
            find(l, s, seen, LINT_SPEED_TOO_HIGH, bytes, count, "%u counts as %u", value, value % DR_SPEED_LEVELS);
        break;
    case DR_OP_MPC_WORK:
        if (was_owed || !is_connected)
            break;
        if (!drive->work_is_set)
            find(l, s, seen, LINT_NO_WORK_POSITION, bytes, count, "drive %u has none", c->active + 1u);
        else if (!drive->at_home)
            find(l, s, seen, LINT_WORK_WITHOUT_HOME, bytes, count, "drive %u is not at home", c->active + 1u);
        break;
    case DR_OP_TRIO_WORK:
        if (!was_owed && !drive->work_is_set)
            find(l, s, seen, LINT_NO_WORK_POSITION, bytes, count, "WORK has stored nothing yet");
        break;
    case DR_OP_MPC_STREAM_OFF:
    case DR_OP_MPC_STREAM_ON:
        s->said_streaming = true;
        break;
    case DR_OP_MPC_SELECT:
        if (value < 1 || value > DR_PORTS)
            find(l, s, seen, LINT_VALUE_OUT_OF_RANGE, bytes, count, "drive %02X is none of 01 to 04", value);
        break;
    case DR_OP_MPC_MODE:
        if (value > MODE_MAX)
            find(l, s, seen, LINT_VALUE_OUT_OF_RANGE, bytes, count, "mode %02X is none of 00 to 09", value);
        break;
    default:
        break;
    }
}

static uint64_t us_between(uint64_t from_ns, uint64_t to_ns)
{
    return to_ns > from_ns ? (to_ns - from_ns) / NS_PER_US : 0;
}

static bool follows_position(const lint_station *s)
{
    return s->last == DR_OP_TRIO_POSITION || s->last == DR_OP_MPC_POSITION;
}

/* What the answer to a position still has on the line, where nothing else is; else nothing. */
static uint32_t to_come(const lint_station *s)
{
    const dr_controller *const c = &s->ins->controller;
    return follows_position(s) && s->in_flight == 0 && !is_moving_for_host(c) && c->kept_bytes == 0
               ? (uint32_t)dr_controller_ready(c)
               : 0;
}

static void was_counted(const lint *l, lint_station *s, uint32_t unread)
{
    s->left = (lint_left){.is_known = true, .bytes = unread, .first = l->finding_count};
}

/* So many bytes are unread now: is it what a program leaves that reads 13 bytes of each position? Then that is what has been
 * found since it could last be counted. */
static bool leaves_one_of_each(lint *l, lint_station *s, uint32_t unread)
{
    const lint_left *const left = &s->left;
    const unsigned last = follows_position(s) ? 1 : 0;
    if (!left->is_known)
        return last == 1 && unread == 1 && left->supposed == 0;
    if (left->positions + last == 0 || unread != left->bytes + last)
        return false;
    for (unsigned i = left->first; i < l->finding_count; i++)
        if (&l->stations[l->findings[i].station] == s && l->findings[i].rule == LINT_UNREAD_REPLY)
            l->findings[i].rule = LINT_THIRTEEN_BYTES;
    l->counts[LINT_UNREAD_REPLY] -= left->supposed;
    l->counts[LINT_THIRTEEN_BYTES] += left->supposed;
    return true;
}

/* What had been left was read before it could be counted. */
static void suppose_one_of_each(lint_station *s)
{
    const unsigned last = follows_position(s) ? 1 : 0;
    s->left.bytes += last;
    s->left.positions += last;
    s->left.supposed++;
    s->left.is_known = s->left.is_known && s->left.bytes > 0; /* else it is none of a position */
}

/* A command that came while the host was owed an answer. */
static void judge_early(lint *l, lint_station *s, const observation *seen, const dr_command *command,
                        const uint8_t *bytes, size_t count)
{
    const dr_controller *const c = &s->ins->controller;
    const char *const before = dr_words_command(s->last)->name;
    const uint64_t waited_us = us_between(s->command_ns, s->began_ns);
    const uint32_t coming = to_come(s);
    if (coming > 0 && leaves_one_of_each(l, s, s->unread + coming)) { /* a slow line: the 14th is still on its way */
        find(l, s, seen, LINT_THIRTEEN_BYTES, bytes, count, "%lu byte%s of the position %s still to come",
             (unsigned long)coming, coming == 1 ? "" : "s", coming == 1 ? "was" : "were");
        was_counted(l, s, s->unread + coming);
        return;
    }
    s->left.is_known = false;
    if ((command->is & DR_IS_QUERY) != 0 && is_moving_for_host(c) && s->in_flight == 0)
        find(l, s, seen, LINT_QUERY_IN_MOVE, bytes, count, "during %s", dr_words_command((dr_op)c->move_op)->name);
    else if (waited_us >= LINT_GAVE_UP_US)
        find(l, s, seen, LINT_SHORT_TIME_LIMIT, bytes, count, "%llu ms after %s, whose CR had not come",
             (unsigned long long)waited_us / 1000u, before);
    else
        find(l, s, seen, LINT_EARLY_COMMAND, bytes, count, "%s was not yet answered", before);
}

static void judge_left(lint *l, lint_station *s, const observation *seen, const uint8_t *bytes, size_t count)
{
    const char *const before = dr_words_command(s->last)->name;
    const unsigned long unread = s->unread;
    if (unread == 0 && s->read_behind) {
        find(l, s, seen, LINT_UNREAD_REPLY, bytes, count, "the last of the answer to %s was read behind this", before);
        suppose_one_of_each(s);
        return;
    }
    if (unread == 1 && leaves_one_of_each(l, s, 1))
        find(l, s, seen, LINT_THIRTEEN_BYTES, bytes, count, "1 byte of the position was still unread");
    else if (unread > 1 && leaves_one_of_each(l, s, s->unread))
        find(l, s, seen, LINT_THIRTEEN_BYTES, bytes, count, "%lu bytes were unread, 1 of each position", unread);
    else if (unread > 0)
        find(l, s, seen, LINT_UNREAD_REPLY, bytes, count, "%lu byte%s unread, the last answer was that to %s", unread,
             unread == 1 ? " was" : "s were", before);
    was_counted(l, s, s->unread);
}

/* Whether it was the host's turn. Real time: the host knows no other. */
static void judge_turn(lint *l, lint_station *s, const observation *seen, const dr_command *command,
                       const uint8_t *bytes, size_t count, bool was_owed)
{
    if (s->is_excused || s->stopped_late || s->command_ns == 0) {
        was_counted(l, s, s->unread);
        s->left.is_known = !s->read_behind;
        return;
    }
    if (was_owed) {
        judge_early(l, s, seen, command, bytes, count);
        return;
    }
    judge_left(l, s, seen, bytes, count);
    const uint64_t pause_us = us_between(s->reply_ns > s->command_ns ? s->reply_ns : s->command_ns, s->began_ns);
    if (pause_us + s->late_us < LINT_PAUSE_US && s->unread == 0 &&
        !s->read_behind) /* one that did not read has no pause to make */
        find(l, s, seen, LINT_HURRIED_COMMAND, bytes, count, "%llu.%llu ms after the answer to %s",
             (unsigned long long)pause_us / 1000u, (unsigned long long)pause_us / 100u % 10u,
             dr_words_command(s->last)->name);
}

static bool moves(const lint_station *s, dr_op op)
{
    dr_command command;
    return dr_command_for(s->kind, s->ins->controller.firmware, op, &command) && (command.is & DR_IS_MOTION) != 0;
}

/* Where the clock jumps, or runs faster, a move ends before a host can stop it: its CR is there, and ^C gets another one. A host that reads
 * one CR behind ^C, as the manuals say, is one byte off from then on, until it has read everything. */
static void look_for_late_stop(lint *l, lint_station *s, bool is_interrupt, bool was_owed)
{
    const bool is_behind = s->unread > 0 || s->read_behind; /* a quick one has read by now what it had left */
    if (!is_interrupt && s->stopped_late) {
        s->stopped_late = is_behind;
        l->late_stops += s->stopped_late && !s->told_late_stop ? 1u : 0u;
        s->told_late_stop = true;
    } else if (is_interrupt && l->runs_ahead != NULL && !was_owed && is_behind && !s->stopped_late &&
               moves(s, s->last)) {
        s->stopped_late = true;
        s->told_late_stop = false;
    }
}

static void command_written(lint *l, lint_station *s, const observation *seen, const dr_command *command)
{
    const uint8_t *const bytes = s->framer.bytes;
    const size_t count = 1u + (size_t)command->args;
    const bool was_owed = is_owed(s);
    const bool is_interrupt = (command->is & DR_IS_INTERRUPT) != 0;
    look_for_late_stop(l, s, is_interrupt, was_owed);
    if (is_interrupt) {
        s->left.is_known = false;
    } else {
        judge_turn(l, s, seen, command, bytes, count, was_owed);
        judge_contents(l, s, seen, command, bytes, count, was_owed);
    }
    s->last = (dr_op)command->op;
    s->in_flight++;
    s->is_excused = s->is_excused && was_owed; /* it is still late because of the fault */
    s->command_ns = seen->real_ns;
    s->reply_ns = 0;
    s->lost_reply = false;
}

/* -- Bytes that are no command ----------------------------------------------------------------------------------------- */

/* The table of this controller that knows the byte: another firmware's, or the other controller's. */
static bool command_elsewhere(const dr_controller *c, uint8_t byte, dr_command *found, dr_kind *kind)
{
    const dr_kind own = (dr_kind)c->kind, kinds[] = {own, own == DR_TRIO ? DR_MPC : DR_TRIO};
    for (unsigned i = 0; i < 2; i++)
        for (uint8_t row = 0; dr_command_row(kinds[i], row, found); row++)
            if (found->code == byte) {
                *kind = kinds[i];
                return true;
            }
    return false;
}

/* Most unknown bytes are nobody's business: programs send 0xEE or 0x22 to wake a controller up [P]. True: a breach. */
static bool judge_unknown(lint *l, const lint_station *s, const observation *seen, uint8_t byte)
{
    const dr_controller *const c = &s->ins->controller;
    dr_command found;
    dr_kind kind;
    char is[8], since[8];
    if (c->kind == DR_TRIO && (byte == 0x5Bu || byte == 0x5Cu)) {
        find(l, s, seen, LINT_UPPER_CASE_AXIS, &byte, 1, "%02X is printed for '%c' and is none of the commands",
             (unsigned)byte, byte == 0x5Bu ? 'Y' : 'Z');
        return true;
    }
    if (!command_elsewhere(c, byte, &found, &kind))
        return false;
    const char *const name = dr_words_command((dr_op)found.op)->name;
    (void)dr_words_firmware(is, sizeof is, c->firmware);
    (void)dr_words_firmware(since, sizeof since, c->firmware < found.since ? found.since : found.until);
    if (kind != (dr_kind)c->kind)
        find(l, s, seen, LINT_WRONG_COMMAND, &byte, 1, "'%c' is %s of the %s; this is the %s", byte, name,
             dr_words_controller(kind), dr_words_controller((dr_kind)c->kind));
    else if (c->firmware < found.since)
        find(l, s, seen, LINT_WRONG_COMMAND, &byte, 1, "'%c' (%s) came with firmware %s; this is %s", byte, name, since,
             is);
    else
        find(l, s, seen, LINT_WRONG_COMMAND, &byte, 1, "'%c' (%s) went after firmware %s; this is %s", byte, name,
             since, is);
    return true;
}

/* -- What is observed -------------------------------------------------------------------------------------------------- */

static void bytes_from_host(lint *l, lint_station *s, const observation *seen)
{
    const dr_controller *const c = &s->ins->controller;
    bool is_astray = false; /* what follows a command that is not known may be its arguments */
    if (s->ins->arriving_count == 0)
        s->in_flight = 0; /* also what got lost on the line */
    if (is_deaf(s->ins))
        return; /* and so is the framer of the controller */
    for (size_t i = 0; i < seen->count; i++) {
        dr_command command;
        if (s->framer.have == 0) {
            s->began_ns = seen->real_ns;
            s->pause_us = 0;
            s->late_us = i == 0 ? seen->late_us : 0;
            s->unread = i == 0 ? seen->unread : 0;
            s->read_behind = i == 0 && seen->has_read_behind;
        } else if (i == 0) {
            s->read_behind = s->read_behind || seen->has_read_behind;
            s->pause_us = seen->pause_us > UINT32_MAX - s->pause_us ? UINT32_MAX : s->pause_us + seen->pause_us;
            s->late_us = seen->late_us > UINT32_MAX - s->late_us ? UINT32_MAX : s->late_us + seen->late_us;
        }
        switch (dr_framer_push(&s->framer, s->kind, c->firmware, seen->bytes[i], &command)) {
        case DR_FRAMED_WHOLE:
            if (!is_astray)
                command_written(l, s, seen, &command);
            break;
        case DR_FRAMED_UNKNOWN:
            is_astray = is_astray || judge_unknown(l, s, seen, seen->bytes[i]);
            break;
        case DR_FRAMED_PART:
        case DR_FRAMED_FILLER:
            break;
        }
    }
}

static void note_made(lint_station *s, const dr_note *note)
{
    switch ((dr_note_kind)note->what) {
    case DR_NOTE_REQUEST:
        s->in_flight -= s->in_flight > 0 ? 1 : 0;
        break;
    case DR_NOTE_REPLY:
        s->reply_is_leaving = true;
        break;
    case DR_NOTE_POWER_ON:
    case DR_NOTE_POWER_OFF:
        dr_framer_reset(&s->framer);
        s->in_flight = 0;
        s->said_streaming = s->told_streaming = s->stopped_late = false;
        s->is_excused = true;
        break;
    default:
        break;
    }
}

/* Who leaves the port leaves nothing behind. */
static void port_left(lint *l, lint_station *s, const observation *seen)
{
    if (!s->is_open)
        return;
    s->is_open = false;
    const bool has_spoken = s->command_ns != 0;
    const char *const before = dr_words_command(s->last)->name;
    s->command_ns = 0;
    const bool stopped_late = s->stopped_late;
    s->stopped_late = false;
    if (stopped_late && seen->unread > 0 && !s->told_late_stop)
        l->late_stops++;
    if (!has_spoken || s->is_excused || stopped_late || is_deaf(s->ins))
        return;
    const uint32_t left = seen->unread + to_come(s);
    if (left == 1 && leaves_one_of_each(l, s, left))
        find(l, s, seen, LINT_THIRTEEN_BYTES, NULL, 0, "the port was closed with 1 byte of the position unread");
    else if (left > 1 && leaves_one_of_each(l, s, left))
        find(l, s, seen, LINT_THIRTEEN_BYTES, NULL, 0, "the port was closed with %lu bytes unread, 1 of each position",
             (unsigned long)left);
    else if (seen->unread > 0)
        find(l, s, seen, LINT_UNREAD_REPLY, NULL, 0, "the port was closed with %lu byte%s unread, after %s",
             (unsigned long)seen->unread, seen->unread == 1 ? "" : "s", before);
    else if (is_owed(s) || s->lost_reply)
        find(l, s, seen, LINT_UNREAD_REPLY, NULL, 0, "the port was closed before %s was answered", before);
}

static void tty_set(lint *l, const lint_station *s, const observation *seen)
{
    const uint32_t right = s->kind == DR_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC;
    /* real MPC-200s run at 125,000 as well [P] */
    if (seen->baud != 0 && seen->baud != right && !(s->kind == DR_MPC && seen->baud == 125000u))
        find(l, s, seen, LINT_WRONG_BAUD, NULL, 0, "%lu baud; the %s has %lu", (unsigned long)seen->baud,
             dr_words_controller(s->kind), (unsigned long)right);
}

static lint_station *station_of(lint *l, const observation *seen)
{
    for (unsigned i = 0; i < l->station_count; i++)
        if (l->stations[i].ins == seen->ins)
            return &l->stations[i];
    lint_station *const more = realloc(l->stations, (l->station_count + 1u) * sizeof *more);
    if (more == NULL) {
        l->lacks_memory = true;
        return NULL;
    }
    l->stations = more;
    lint_station *const s = &more[l->station_count++];
    memset(s, 0, sizeof *s);
    s->ins = seen->ins;
    s->kind = (dr_kind)seen->ins->controller.kind;
    s->firmware = seen->ins->controller.firmware;
    (void)snprintf(s->name, sizeof s->name, "%s", seen->name);
    dr_framer_reset(&s->framer);
    return s;
}

static void see(observer *o, const observation *seen)
{
    lint *const l = (lint *)o;
    lint_station *const s = station_of(l, seen);
    if (s == NULL)
        return;
    switch (seen->what) {
    case OBSERVED_FROM_HOST:
        s->is_open = true;
        bytes_from_host(l, s, seen);
        break;
    case OBSERVED_TO_HOST:
        if (s->reply_is_leaving)
            s->reply_ns = seen->real_ns;
        s->reply_is_leaving = s->reply_is_leaving && is_reply_leaving(s->ins);
        break;
    case OBSERVED_NOTE:
        note_made(s, seen->note);
        break;
    case OBSERVED_OPENED:
        s->is_open = true;
        s->command_ns = 0;
        s->said_streaming = s->told_streaming = s->stopped_late = false;
        break;
    case OBSERVED_CLOSED:
    case OBSERVED_END:
        port_left(l, s, seen);
        break;
    case OBSERVED_TTY:
        tty_set(l, s, seen);
        break;
    case OBSERVED_FAULT:
        s->is_excused = true;
        break;
    case OBSERVED_LOST:
        s->lost_reply = true;
        break;
    case OBSERVED_EVENT:
        break;
    }
}

void lint_open(lint *l)
{
    memset(l, 0, sizeof *l);
    l->base.see = see;
}

void lint_close(lint *l)
{
    free(l->stations);
    free(l->findings);
    memset(l, 0, sizeof *l);
}
