#include "guard_words.h"

#include "dr_words.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define COUNT(table) (sizeof(table) / sizeof(table)[0])

/* -- One word each ----------------------------------------------------------------------------------------------------- */

static const char *pick(const char *const *names, size_t count, uint8_t index)
{
    return index < count && names[index] != NULL ? names[index] : "unknown";
}

const char *guard_words_state(uint8_t state)
{
    static const char *const names[] = {
        [DR_GUARD_LOCKED] = "locked",     [DR_GUARD_DISARMED] = "disarmed", [DR_GUARD_IDLE] = "armed",
        [DR_GUARD_CHECKING] = "checking", [DR_GUARD_MOVING_S] = "moving",   [DR_GUARD_MOVING_U] = "moving-unstoppable",
        [DR_GUARD_STOPPING] = "stopping", [DR_GUARD_FAULT] = "fault",       [DR_GUARD_STOPPED] = "stopped",
    };
    return pick(names, COUNT(names), state);
}

static const struct {
    const char *name, *says;
} faults[DR_FAULTS] = {
    [DR_FAULT_NONE] = {"none", ""},
    [DR_FAULT_LIMITS] = {"limits", "There are no valid limits."},
    [DR_FAULT_IDENTITY] = {"identity",
                           "The controller is not the one, or not the firmware, that the configuration is for."},
    [DR_FAULT_NO_DEVICE] =
        {"no-device", "The controller's port is gone, or is not there yet. When it is back, it is looked at anew."},
    [DR_FAULT_DEVICE_SILENT] = {"device-silent",
                                "The controller does not answer a position query. Is it on, is it the right port?"},
    [DR_FAULT_NO_CR] = {"no-cr", "A move never told its end. The tip is at rest at a known place."},
    [DR_FAULT_EARLY_CR] = {"early-cr", "The controller told the end of a move while it still moved."},
    [DR_FAULT_WRONG_END] = {"wrong-end", "A move came to rest elsewhere than it should. Was a knob or a button used?"},
    [DR_FAULT_RESUMED_OLD_MOVE] = {"resumed-old-move",
                                   "The controller went on with the move that a stop had broken off."},
    [DR_FAULT_IMPLAUSIBLE] = {"implausible", "Two position replies running that cannot be."},
    [DR_FAULT_POSITION_JUMP] = {"position-jump",
                                "The tip is where no knob can have put it: a power cycle, a calibration, lost steps?"},
    [DR_FAULT_DEVICE_NOISE] = {"device-noise", "The controller sends bytes that nobody asked for."},
    [DR_FAULT_UNSTOPPABLE] = {"unstoppable",
                              "A stop was asked for, and the tip could not be proved at rest within a second."},
    [DR_FAULT_FRAME_LOST] = {"frame-lost", "A calibration was broken off: coordinates mean nothing until a whole one."},
    [DR_FAULT_STOP_WIRING] = {"stop-wiring", "The two stop contacts disagree."},
    [DR_FAULT_DAMAGED] = {"damaged", "Limits or state in memory are not what they were. Restart the guard."},
    [DR_FAULT_TORN] =
        {"torn-frame",
         "The controller may wait for the rest of a command (the cable or the guard before went within one, "
         "or it does not answer), and would take it from any byte: switch it off and on, then 'confirm'. "
         "Until then nothing is sent."},
};
const char *guard_words_fault(uint8_t fault) { return fault < DR_FAULTS ? faults[fault].name : "unknown"; }
const char *guard_words_fault_says(uint8_t fault) { return fault < DR_FAULTS ? faults[fault].says : ""; }

/* By bit of DR_NEEDS_*. */
static const struct {
    const char *name, *says;
} needs[] = {
    {"limits", "there are no valid limits"},
    {"identity",
     "the controller has not proved to be the one of the configuration: 'clear' tries again; 'confirm' if the answer "
     "fits both controllers and you have looked"},
    {"inside",
     "the tip is outside the box or in an obstacle: move it out by hand, or 'escape on' to move it out by commands"},
    {"stop-released", "the stop is on: 'clear'"},
    {"device", "the controller's port is not there"},
    {"log", "the log cannot be written: make room on its disk"},
    {"key", "the key is off: 'arm' turns it on"},
    {"clear", "a fault or stop is latched: look at the rig, then 'clear'"},
    {"tip", "the tip was changed: check the configuration against it, then 'confirm'"},
    {"rest", "something is under way: wait"},
    {"steady", "two position readings differ: is a knob being turned?"},
};
const char *guard_words_need(unsigned bit) { return bit < COUNT(needs) ? needs[bit].name : NULL; }
const char *guard_words_need_says(unsigned bit) { return bit < COUNT(needs) ? needs[bit].says : NULL; }

const char *guard_words_input(uint8_t input)
{
    static const char *const names[] = {
        [DR_INPUT_STOP] = "stop",
        [DR_INPUT_STOP_2] = "stop, second channel",
        [DR_INPUT_KEY] = "key",
        [DR_INPUT_ARM] = "arm",
        [DR_INPUT_MAY_CALIBRATE] = "may calibrate",
        [DR_INPUT_IN_TISSUE] = "in tissue",
        [DR_INPUT_ESCAPE] = "escape",
        [DR_INPUT_TIP_CHANGED] = "tip changed",
        [DR_INPUT_CONFIRM] = "confirm",
        [DR_INPUT_LOG_FAILED] = "log failed",
    };
    return pick(names, COUNT(names), input);
}

const char *guard_words_event(uint8_t event)
{
    static const char *const names[] = {
        [DR_EVENT_START] = "start",
        [DR_EVENT_STATE] = "state",
        [DR_EVENT_ALLOWED] = "allowed",
        [DR_EVENT_REFUSED] = "refused",
        [DR_EVENT_DROPPED] = "dropped",
        [DR_EVENT_REPLY] = "reply",
        [DR_EVENT_READING] = "reading",
        [DR_EVENT_IMPLAUSIBLE] = "implausible",
        [DR_EVENT_QUARANTINED] = "quarantined",
        [DR_EVENT_STOP] = "stop",
        [DR_EVENT_ENDED] = "ended",
        [DR_EVENT_NO_REPLY] = "no-reply",
        [DR_EVENT_INPUT] = "input",
        [DR_EVENT_LINK] = "link",
    };
    return pick(names, COUNT(names), event);
}

/* -- Reasons ----------------------------------------------------------------------------------------------------------- */

typedef enum { BARE, STEPS, PLAIN, UM, MS, SPEED, HEIGHT } unit;

/* says: with two texts for %s, the measured and the limit, where there is a unit. */
static const struct {
    const char *name, *says;
    uint8_t unit;
} reasons[DR_REASONS] = {
    [DR_REASON_NONE] = {"none", "allowed", BARE},
    [DR_REASON_RANGE] = {"range", "no drive goes there: %s microsteps, the longest travel has %s", STEPS},
    [DR_REASON_LEVEL] = {"level", "there is no speed level %s; the highest is %s", PLAIN},
    [DR_REASON_AMBIGUOUS] = {"ambiguous", "the manual gives this letter two meanings; send it in lower case", BARE},
    [DR_REASON_ANGLE_VALUE] = {"angle-value", "the angle would be %s degrees, the limit is %s", PLAIN},
    [DR_REASON_MODE_VALUE] = {"mode-value", "the knob mode would be %s, the limit is %s", PLAIN},
    [DR_REASON_DRIVE_VALUE] = {"drive-value", "drive %s is not in the configuration", PLAIN},
    [DR_REASON_STREAM] = {"stream", "streaming is not allowed (allow_stream)", BARE},
    [DR_REASON_DRIVE] = {"drive", "drive %s is active on the controller, the host chose drive %s", PLAIN},
    [DR_REASON_ANGLE] = {"angle", "the controller stands at %s degrees, where an axis fails to move", PLAIN},
    [DR_REASON_FRAME_LOST] = {"frame-lost", "a calibration was broken off: coordinates mean nothing until a whole one",
                              BARE},
    [DR_REASON_CALIBRATE] = {"calibrate",
                             "calibrating takes 'allow_calibrate = true' and a person's leave ('allow-calibrate')",
                             BARE},
    [DR_REASON_HIDDEN] = {"hidden", "only the controller knows where this goes, and not all of the travel is free",
                          BARE},
    [DR_REASON_LIMIT] = {"limit", "leaves the box: it would be at %s um, the limit is %s um", UM},
    [DR_REASON_ESCAPE] =
        {"escape",
         "the tip is in a forbidden place, and this is no way out: a straight line of at most 1 mm that "
         "lessens what is violated",
         BARE},
    [DR_REASON_KEEP_OUT] = {"keep-out", "the way touches an obstacle", BARE},
    [DR_REASON_OLD_TARGET] = {"old-target",
                              "the move that a stop broke off may be resumed instead, and its way touches an obstacle",
                              BARE},
    [DR_REASON_STEP] = {"step", "too long a move: %s um, the limit is %s um", UM},
    [DR_REASON_UNSTOPPABLE] = {"unstoppable", "cannot be stopped and would last %s ms, the limit is %s ms", MS},
    [DR_REASON_SPEED] = {"speed", "too fast there: %s um/s, the limit is %s um/s", SPEED},
    [DR_REASON_LATERAL] = {"lateral",
                           "sideways too low: %s um above the surface, margin taken off; from %s um it is allowed",
                           HEIGHT},
    [DR_REASON_APPROACH] = {"approach", "in tissue only straight lines along 'approach' are allowed", BARE},
    [DR_REASON_UNKNOWN] = {"unknown", "no command of this controller begins so", BARE},
    [DR_REASON_RESYNC] = {"resync",
                          "after a frame of impossible shape everything is dropped until the host has paused for 50 ms",
                          BARE},
    [DR_REASON_TORN] = {"torn", "the frame was not finished in time", BARE},
    [DR_REASON_BUSY] = {"busy", "something else is under way", BARE},
    [DR_REASON_NOT_ARMED] = {"not-armed", "the guard is not armed", BARE},
    [DR_REASON_CANCELLED] = {"cancelled", "a stop came first", BARE},
    [DR_REASON_RATE] = {"rate", "more than 20 motions in a second", BARE},
    [DR_REASON_NO_POSITION] = {"no-position", "the controller did not tell a believable position", BARE},
    [DR_REASON_DAMAGED] = {"damaged", "limits or state in memory are not what they were", BARE},
};
const char *guard_words_reason(uint8_t reason) { return reason < DR_REASONS ? reasons[reason].name : "unknown"; }

size_t guard_words_um(char *out, size_t room, int64_t quanta)
{
    const bool has_room = room > 1 && quanta < 0;
    if (quanta >= 0)
        return dr_words_um(out, room, (uint64_t)quanta);
    if (has_room)
        *out = '-';
    return 1 + dr_words_um(has_room ? out + 1 : NULL, has_room ? room - 1 : 0, (uint64_t)-quanta);
}

static void value(char *out, size_t room, uint8_t of, int64_t number)
{
    if (of == UM || of == SPEED || of == HEIGHT)
        (void)guard_words_um(out, room, number);
    else if (of == STEPS || of == MS)
        (void)dr_words_number(out, room, (uint64_t)number);
    else
        (void)snprintf(out, room, "%lld", (long long)number);
}

static const char *item_name(const rig *r, uint8_t item)
{
    return item < r->limits.obstacle_count ? r->names[item] : NULL;
}

size_t guard_words_verdict(char *out, size_t room, const rig *r, const dr_verdict *v)
{
    static const char axes[] = "XYZ";
    char says[GUARD_WORDS_MAX], measured[32], limit[32];
    if (v->reason >= DR_REASONS)
        return (size_t)snprintf(out, room, "reason %u", v->reason);
    value(measured, sizeof measured, reasons[v->reason].unit, v->measured);
    value(limit, sizeof limit, reasons[v->reason].unit, v->limit);
    /* The table's texts take two texts at most. */
    const char *at = reasons[v->reason].says, *const values[] = {measured, limit};
    size_t used = 0;
    for (unsigned n = 0; *at != '\0' && used + 1 < sizeof says;) {
        if (at[0] == '%' && n < COUNT(values)) {
            used += (size_t)snprintf(says + used, sizeof says - used, "%s", values[n++]);
            at += 2;
        } else {
            says[used++] = *at++;
        }
    }
    says[used < sizeof says ? used : sizeof says - 1] = '\0';
    const char *const item = item_name(r, v->item);
    if (item != NULL)
        return (size_t)snprintf(out, room, "%s: %s", says, item);
    const bool is_of_axis = v->reason != DR_REASON_HIDDEN && v->reason != DR_REASON_AMBIGUOUS;
    if (v->axis < DR_AXES && is_of_axis)
        return (size_t)snprintf(out, room, "%c: %s", axes[v->axis], says);
    return (size_t)snprintf(out, room, "%s", says);
}

/* -- Records ----------------------------------------------------------------------------------------------------------- */

typedef struct {
    char *out;
    size_t room, used;
} sink;

__attribute__((format(printf, 2, 3))) static void add(sink *s, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    const int length = s->used < s->room ? vsnprintf(s->out + s->used, s->room - s->used, format, arguments)
                                         : vsnprintf(NULL, 0, format, arguments);
    va_end(arguments);
    s->used += length > 0 ? (size_t)length : 0;
}

static dr_words_context context_of(const rig *r, uint8_t drive)
{
    return (dr_words_context){(dr_kind)r->limits.kind, r->limits.firmware,
                              (dr_stage_id)r->limits.drives[drive < DR_PORTS ? drive : 0].stage};
}

static void add_bytes(sink *s, const dr_record *record)
{
    for (uint8_t i = 0; i < record->count && i < DR_RECORD_TEXT; i++)
        add(s, " %02X", record->bytes[i]);
    if (record->count > DR_RECORD_TEXT)
        add(s, " ... (%u bytes%s)", record->count, record->count == UINT8_MAX ? " or more" : "");
}

static void add_point(sink *s, const rig *r, const dr_record *record, uint8_t drive)
{
    char text[GUARD_WORDS_MAX / 2];
    const dr_words_context context = context_of(r, drive);
    (void)dr_words_point(text, sizeof text, &context, record->position_steps);
    add(s, "%s", text);
}

static void add_request(sink *s, const rig *r, const dr_record *record)
{
    char text[GUARD_WORDS_MAX / 2];
    const dr_words_context context = context_of(r, 0);
    (void)dr_words_request(text, sizeof text, &context, record->bytes, record->count);
    add_bytes(s, record);
    add(s, ": %s", text);
}

static const char *stop_cause(uint8_t code)
{
    static const char *const causes[] = {
        [DR_STOP_HOST] = "the host's ^C",
        [DR_STOP_INPUT] = "the stop input",
        [DR_STOP_HOST_LOST] = "the host is gone",
        [DR_STOP_KEY] = "the key was turned off",
        [DR_STOP_DEADLINE] = "a move did not end in time",
        [DR_STOP_EARLY_CR] = "the end of a move was told early",
        [DR_STOP_AGAIN] = "repeated: not at rest yet",
        [DR_STOP_AFTER_RESET] = "the guard was not stopped in order before",
        [DR_STOP_NOISE] = "the controller sends what nobody asked for",
        [DR_STOP_LATE] = "the guard came too late in the pause within S: by now the tip may be somewhere else",
    };
    return pick(causes, COUNT(causes), code);
}

size_t guard_words_record(char *out, size_t room, const rig *r, const dr_record *record)
{
    sink s = {out, room, 0};
    char text[GUARD_WORDS_MAX / 2];
    if (room > 0)
        out[0] = '\0';
    switch (record->event) {
    case DR_EVENT_START:
        add(&s, "configuration %08X, revision %u%s", record->position_steps[0], record->position_steps[1],
            record->code == DR_START_POWER_ON    ? ""
            : record->code == DR_START_MID_FRAME ? "; the last guard ended within a frame"
                                                 : "; the last guard was not stopped in order");
        break;
    case DR_EVENT_STATE:
        add(&s, "%s to %s%s%s", guard_words_state(record->before), guard_words_state(record->after),
            record->code != DR_FAULT_NONE ? ": " : "", guard_words_fault_says(record->code));
        break;
    case DR_EVENT_ALLOWED:
        add(&s, "host");
        add_request(&s, r, record);
        break;
    case DR_EVENT_REFUSED: {
        const dr_verdict verdict = {record->code, record->axis, record->item, 0, 0};
        add(&s, "host");
        add_request(&s, r, record);
        add(&s, "; %s", guard_words_reason(verdict.reason));
        if (item_name(r, verdict.item) != NULL)
            add(&s, " \"%s\"", item_name(r, verdict.item));
        if (verdict.axis < DR_AXES)
            add(&s, " on axis %c", "XYZ"[verdict.axis]);
        break;
    }
    case DR_EVENT_DROPPED:
        add(&s, "host");
        add_bytes(&s, record);
        add(&s, ": %s", guard_words_reason(record->code));
        break;
    case DR_EVENT_REPLY: {
        const dr_words_context context = context_of(r, 0);
        (void)dr_words_reply(text, sizeof text, &context, (dr_op)record->code, record->bytes, record->count);
        add(&s, "controller");
        add_bytes(&s, record);
        add(&s, ": %s", text);
        break;
    }
    case DR_EVENT_READING:
        if (r->limits.kind == DR_TRIO) {
            add_point(&s, r, record, 0);
            add(&s, ", %u degrees", record->item);
        } else {
            add(&s, "drive %u at ", record->item);
            add_point(&s, r, record, (uint8_t)(record->item - 1u));
        }
        break;
    case DR_EVENT_IMPLAUSIBLE:
    case DR_EVENT_QUARANTINED:
        add(&s, "controller");
        add_bytes(&s, record);
        break;
    case DR_EVENT_STOP:
        add(&s, "^C: %s", stop_cause(record->code));
        break;
    case DR_EVENT_ENDED:
        add_point(&s, r, record, record->item);
        break;
    case DR_EVENT_NO_REPLY:
        add(&s, "to '%s'", dr_words_command((dr_op)record->code)->name);
        break;
    case DR_EVENT_INPUT:
        add(&s, "%s %s", guard_words_input(record->code), record->item != 0 ? "on" : "off");
        break;
    case DR_EVENT_LINK:
        add(&s, "host %s, controller %s", (record->code & 1u) != 0 ? "there" : "gone",
            (record->code & 2u) != 0 ? "there" : "gone");
        break;
    default:
        add(&s, "event %u", record->event);
        break;
    }
    return s.used;
}
