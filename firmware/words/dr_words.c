/* dr_words: see dr_words.h. Tables first, then numbers, then bytes and notes into sentences. */
#include "dr_words.h"

#include "dr_wire.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* -- A text that grows at its end, as far as there is room --------------------------------------------------------- */

typedef struct {
    char *out;
    size_t room, length; /* length: of the whole text, written or not */
} text;

static text text_in(char *out, size_t room)
{
    if (room > 0)
        out[0] = '\0';
    return (text){out, room, 0};
}

#if defined(__GNUC__)
static void add(text *t, const char *format, ...) __attribute__((format(printf, 2, 3)));
#endif

static void add(text *t, const char *format, ...)
{
    const size_t room = t->length < t->room ? t->room - t->length : 0;
    va_list arguments;
    va_start(arguments, format);
    /* NOLINTNEXTLINE(clang-analyzer-valist.Uninitialized): the analyzer of LLVM 14 overlooks va_start() */
    const int n = vsnprintf(room > 0 ? t->out + t->length : NULL, room, format, arguments);
    va_end(arguments);
    t->length += n > 0 ? (size_t)n : 0;
}

/* -- Names without regard to case ---------------------------------------------------------------------------------- */

static int lower(char c) { return c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c; }

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

static bool same(const char *a, const char *b)
{
    while (*a != '\0' && lower(*a) == lower(*b)) {
        a++;
        b++;
    }
    return lower(*a) == lower(*b);
}

/* -- Controllers --------------------------------------------------------------------------------------------------- */

const char *dr_words_kind(dr_kind kind) { return kind == DR_TRIO ? "trio" : "mpc"; }

const char *dr_words_controller(dr_kind kind) { return kind == DR_TRIO ? "TRIO MP-245A" : "MPC-200"; }

bool dr_words_kind_find(const char *name, dr_kind *out)
{
    static const dr_kind kinds[] = {DR_TRIO, DR_MPC};
    for (size_t i = 0; i < COUNT(kinds); i++) {
        if (same(name, dr_words_kind(kinds[i])) || same(name, dr_words_controller(kinds[i]))) {
            *out = kinds[i];
            return true;
        }
    }
    return false;
}

/* -- Stages -------------------------------------------------------------------------------------------------------- */

/* [T] tables 2, 4, 5; [M] tables 6 to 8. The first name of a stage is the one that we use. '#' stands for a digit or
 * the x of a series' name; the first row that fits a name decides, so MPC-78 is no MPC-x8. */
#define NAMES_MAX 6
static const char *const stage_names[DR_STAGES][NAMES_MAX] = {
    [DR_STAGE_NONE] = {"none"},
    [DR_STAGE_TRIO_MP845] = {"MP-845", "MP-245", "MP-x45"},
    [DR_STAGE_TRIO_MP865] = {"MP-865"},
    [DR_STAGE_TRIO_MP285] = {"MP-285", "3DMS", "MT-78", "MOM", "SOM"},
    [DR_STAGE_TRIO_MP265] = {"MP-265"},
    [DR_STAGE_MPC_MP225] = {"MP-225"},
    [DR_STAGE_MPC_MP285] = {"MP-285", "3DMS", "MPC-78", "SOM"},
    [DR_STAGE_MPC_MP265] = {"MP-265"},
    [DR_STAGE_MPC_MP845] = {"MP-845", "MP-245", "MP-x45", "MPC-#8"},
    [DR_STAGE_MPC_MP865] = {"MP-865"},
    [DR_STAGE_MPC_MT800] = {"MT-800", "MT-8#0", "MT-22##"},
    [DR_STAGE_MPC_MOM] = {"MOM"},
};

static bool is_stage_of(dr_kind kind, size_t id)
{
    dr_stage stage;
    return dr_stage_get((dr_stage_id)id, &stage) && stage.kind == kind;
}

const char *dr_words_stage(dr_stage_id id)
{
    return stage_names[(unsigned)id < (unsigned)DR_STAGES ? id : DR_STAGE_NONE][0];
}

/* Steps over what stands at *name. False: something else stands there. */
static bool step_over(const char **name, const char *what)
{
    const char *at = *name;
    for (; *what != '\0'; what++, at++)
        if (lower(*at) != lower(*what))
            return false;
    *name = at;
    return true;
}

static bool names_alike(const char *known, const char *name)
{
    const char *want = known;
    for (; *want != '\0'; want++) {
        if (*want == '-')
            name += *name == '-' ? 1 : 0;
        else if (lower(*name) == lower(*want) || (*want == '#' && (is_digit(*name) || lower(*name) == 'x')))
            name++;
        else
            return false;
    }
    if (want[-2] == '4' && want[-1] == '5' &&
        !step_over(&name, "[S]")) /* every MP-x45 has a short version [T table 2] */
        (void)step_over(&name, "S");
    (void)step_over(&name, "/M");
    return *name == '\0';
}

bool dr_words_stage_find(dr_kind kind, const char *name, dr_stage_id *out)
{
    for (size_t id = 0; id < DR_STAGES; id++)
        for (size_t i = 0; is_stage_of(kind, id) && i < NAMES_MAX && stage_names[id][i] != NULL; i++)
            if (names_alike(stage_names[id][i], name)) {
                *out = (dr_stage_id)id;
                return true;
            }
    return false;
}

size_t dr_words_stages(char *out, size_t room, dr_kind kind)
{
    text t = text_in(out, room);
    for (size_t id = 0; id < DR_STAGES; id++) {
        if (!is_stage_of(kind, id))
            continue;
        add(&t, "%s%s", t.length > 0 ? ", " : "", stage_names[id][0]);
        size_t i = 1;
        for (; i < NAMES_MAX && stage_names[id][i] != NULL; i++) {
            add(&t, "%s", i == 1 ? " (also " : ", ");
            for (const char *c = stage_names[id][i]; *c != '\0'; c++)
                add(&t, "%c", *c == '#' ? 'x' : *c);
        }
        add(&t, "%s", i > 1 ? ")" : "");
    }
    return t.length;
}

size_t dr_words_fit(char *out, size_t room, dr_stage_id id, dr_kind kind, uint16_t firmware, uint8_t port)
{
    text t = text_in(out, room);
    const char *const name = dr_words_stage(id);
    dr_stage stage = {0};
    char is[8], since[8];
    (void)dr_stage_get(id, &stage);
    (void)dr_words_firmware(is, sizeof is, firmware);
    (void)dr_words_firmware(since, sizeof since, stage.since);
    switch (dr_stage_fits(id, kind, firmware, port)) {
    case DR_FIT_YES:
        break;
    case DR_FIT_OTHER_CONTROLLER:
        add(&t, "this %s is a stage of the other controller, not of the %s", name, dr_words_controller(kind));
        break;
    case DR_FIT_FIRMWARE_TOO_OLD:
        add(&t, "%s needs firmware %s or later, this is %s", name, since, is);
        break;
    case DR_FIT_FIRMWARE_EXACTLY:
        add(&t, "%s works with firmware 3.13 and 3.16 only, this is %s", name, is);
        break;
    case DR_FIT_PORT:
        add(&t, "%s works on ports 1 and 3 only (port A of each controller), this is port %u", name, (unsigned)port);
        break;
    }
    return t.length;
}

/* -- Commands ------------------------------------------------------------------------------------------------------ */

static const dr_command_words command_words[DR_OPS] = {
    [DR_OP_NONE] = {"none", "nothing", "No command.", ""},

    [DR_OP_TRIO_POSITION] = {"position", "tell position and angle",
                             "Tells where X, Y and Z are, in microsteps, and the angle in degrees.", "[T] table 6"},
    [DR_OP_TRIO_HOME] = {"home", "go home",
                         "Moves to the stored home position: X and Z first, in the order that the angle gives, Y last.",
                         "[T] table 6"},
    [DR_OP_TRIO_WORK] = {"work", "go to work",
                         "Moves to the stored work position: Y first, X and Z last, in the order that the angle gives.",
                         "[T] table 6"},
    [DR_OP_TRIO_HOME_TO] = {"home-to", "move in home order",
                            "Moves to a given position in home order: X and Z first, Y last. Stores nothing.",
                            "[T] table 6"},
    [DR_OP_TRIO_WORK_TO] = {"work-to", "move in work order",
                            "Moves to a given position in work order: Y first, X and Z last. Stores nothing.",
                            "[T] table 6"},
    [DR_OP_TRIO_LINE] = {"line", "move straight",
                         "Moves in a straight line at one of 16 speeds; all axes start and end together.",
                         "[T] table 6, note 11"},
    [DR_OP_TRIO_X] = {"x", "move", "Moves the X axis alone.", "[T] table 6"},
    [DR_OP_TRIO_Y] = {"y", "move", "Moves the Y axis alone.", "[T] table 6"},
    [DR_OP_TRIO_Z] = {"z", "move", "Moves the Z axis alone.", "[T] table 6"},
    [DR_OP_TRIO_ANGLE] = {"angle", "set the angle", "Sets the angle, 0 to 90 degrees, that orders X against Z.",
                          "[T] table 6, note 13"},
    [DR_OP_TRIO_RECALIBRATE] = {"recalibrate", "recalibrate",
                                "Runs every axis to the beginning of its travel and then out to 1,000 um.",
                                "[T] table 6, [O]"},
    [DR_OP_TRIO_INTERRUPT] = {"interrupt", "stop", "Stops a straight-line move where it is; no other.",
                              "[T] table 6, note 12"},

    [DR_OP_MPC_COUNT] = {"count", "count the drives", "Tells how many drives are connected. Firmware before 3.00.",
                         "[M] table 9"},
    [DR_OP_MPC_DRIVES] = {"drives", "list the drives", "Tells how many drives are connected, and at which ports.",
                          "[M] table 9"},
    [DR_OP_MPC_ACTIVE] = {"active", "tell active drive and firmware",
                          "Tells which drive commands act on and, from 3.00, the version of the firmware.",
                          "[M] table 9, note 15"},
    [DR_OP_MPC_POSITION] = {"position", "tell position",
                            "Tells where X, Y and Z of the active drive are, in microsteps.", "[M] table 9"},
    [DR_OP_MPC_SELECT] = {"select", "make active", "Chooses the drive that later commands act on.", "[M] table 9"},
    [DR_OP_MPC_HOME] = {"home", "go home",
                        "Moves to 0,0,0: along the diagonal until X or Z is there, then Y with the other one.",
                        "[M] page 1, table 9"},
    [DR_OP_MPC_WORK] = {"work", "go to work",
                        "Goes the way of the last Home backwards to the work position; only right after a Home.",
                        "[M] table 9, [P]"},
    [DR_OP_MPC_CENTRE] = {"centre", "go to the centre", "Moves to the middle of each axis. Firmware up to 1.03.",
                          "[M] table 9"},
    [DR_OP_MPC_CALIBRATE] = {"calibrate", "calibrate",
                             "Runs every axis to the beginning of its travel and finds 0 anew.", "[M] table 9, [P]"},
    [DR_OP_MPC_MOVE] = {"move", "move", "Moves each axis at full speed, for itself; an axis stops when it is there.",
                        "[M] table 9, notes 11 and 13"},
    [DR_OP_MPC_LINE] = {"line", "move straight",
                        "Moves in a straight line at one of 16 speeds; all axes start and end together.",
                        "[M] table 9, note 12"},
    [DR_OP_MPC_INTERRUPT] = {"interrupt", "stop", "Stops any move where it is.", "[M] table 9, note 14"},
    [DR_OP_MPC_STREAM_OFF] = {"stream-off", "turn streaming off", "Later straight-line moves send their CR only.",
                              "[M] table 9, note 16"},
    [DR_OP_MPC_STREAM_ON] = {"stream-on", "turn streaming on",
                             "Later straight-line moves send their position at each micron of the way.",
                             "[M] table 9, note 16"},
    [DR_OP_MPC_MODE] = {"mode", "set mode", "Sets how coarse the knobs of the ROE are, 0 to 9. Moves nothing.",
                        "[M] table 9"},
};

const dr_command_words *dr_words_command(dr_op op)
{
    return &command_words[(unsigned)op < (unsigned)DR_OPS ? op : DR_OP_NONE];
}

/* -- Quirks -------------------------------------------------------------------------------------------------------- */

static const dr_quirk_words quirk_words[DR_QUIRK_IDS] = {
    [DR_QUIRK_ID_SMALL_MOVE_SILENT] = {"small-move-silent",
                                       "a move of under 16 steps on every axis is ignored and gets no CR", "[R]", true,
                                       true, DR_QUIRK_SMALL_MOVE_SILENT},
    [DR_QUIRK_ID_S_NEEDS_PAUSE] =
        {"s-needs-pause",
         "an S that comes with less than 20 ms of pause in all silences the controller until a power cycle",
         "[R], several", true, true, DR_QUIRK_S_NEEDS_PAUSE},
    [DR_QUIRK_ID_MEASURED_SPEEDS] = {"measured-speeds",
                                     "moves are as fast as one real controller was measured, not as the manual says",
                                     "[R], one unit", true, true, DR_QUIRK_MEASURED_SPEEDS},
    [DR_QUIRK_ID_BOOT_SECOND] = {"boot-second", "deaf for one second after power-on", "[O] USB commands v1.10", true,
                                 false, DR_QUIRK_BOOT_SECOND},
    [DR_QUIRK_ID_STOP_SAYS_I] =
        {"stop-says-i", "^C is answered by 'I' and CR; STOP on the ROE sends 'I' alone and the move's CR never comes",
         "[R], some firmware", false, true, 0},
    [DR_QUIRK_ID_POSITION_13] = {"position-13", "C is answered with 13 bytes, without the drive", "[O] of 2012, [R]",
                                 false, true, 0},
    [DR_QUIRK_ID_STREAM_AT_POWER_UP] = {"stream-at-power-up", "streaming is on from power-up", "[O]", false, true,
                                        DR_QUIRK_STREAM_AT_POWER_UP},
    [DR_QUIRK_ID_NUL_HEARTBEAT] = {"nul-heartbeat", "a 0x00 comes every 100 ms during a long M", "[R], one unit", false,
                                   true, 0},
    [DR_QUIRK_ID_ENDLESS_NEGATIVE] =
        {"endless-negative", "a target above 0x7FFFFFFF runs the axis to 0 and gives no CR until ^C or a power cycle",
         "[R]", false, false, DR_QUIRK_ENDLESS_NEGATIVE},
    [DR_QUIRK_ID_PAUSE_ON_STOP] =
        {"pause-on-stop", "^C only pauses: the next move command goes on with the old move and drops its own target",
         "[R], old firmware", false, false, DR_QUIRK_PAUSE_ON_STOP},
    [DR_QUIRK_ID_QUERY_WEDGES] = {"query-wedges",
                                  "a position query during a move silences the controller until a power cycle", "[R]",
                                  false, false, DR_QUIRK_QUERY_WEDGES},
};

const dr_quirk_words *dr_words_quirk(dr_quirk_id id)
{
    return (unsigned)id < (unsigned)DR_QUIRK_IDS ? &quirk_words[id] : NULL;
}

bool dr_words_quirk_find(const char *name, dr_quirk_id *out)
{
    for (size_t i = 0; i < COUNT(quirk_words); i++) {
        if (same(name, quirk_words[i].name)) {
            *out = (dr_quirk_id)i;
            return true;
        }
    }
    return false;
}

/* -- Numbers ------------------------------------------------------------------------------------------------------- */

static void add_number(text *t, uint64_t number)
{
    char digits[24];
    const int n = snprintf(digits, sizeof digits, "%llu", (unsigned long long)number);
    for (int i = 0; i < n; i++)
        add(t, i > 0 && (n - i) % 3 == 0 ? ",%c" : "%c", digits[i]);
}

static void add_um(text *t, uint64_t quanta)
{
    /* to 1/10,000 um, halves upward */
    const uint64_t whole_um = quanta / DR_QUANTA_PER_UM;
    uint64_t rest = ((quanta % DR_QUANTA_PER_UM) * 10000u + DR_QUANTA_PER_UM / 2u) / DR_QUANTA_PER_UM;
    int decimals = 4; /* the rest is at most 9,844 of 10,000: rounding never makes it one more micron */
    while (decimals > 1 && rest % 10u == 0) {
        rest /= 10u;
        decimals--;
    }
    add_number(t, whole_um);
    add(t, ".%0*u", decimals, (unsigned)rest);
}

size_t dr_words_number(char *out, size_t room, uint64_t number)
{
    text t = text_in(out, room);
    add_number(&t, number);
    return t.length;
}

size_t dr_words_um(char *out, size_t room, uint64_t quanta)
{
    text t = text_in(out, room);
    add_um(&t, quanta);
    return t.length;
}

/* Microseconds as milliseconds: "333.334 ms". */
static void add_ms(text *t, uint32_t span_us)
{
    add_number(t, span_us / 1000u);
    add(t, ".%03u ms", (unsigned)(span_us % 1000u));
}

size_t dr_words_firmware(char *out, size_t room, uint16_t firmware)
{
    text t = text_in(out, room);
    add(&t, "%x.%02x", (unsigned)firmware >> 8, (unsigned)firmware & 0xFFu);
    return t.length;
}

const char *dr_words_firmware_parse(const char *version_text, uint16_t *out)
{
    uint16_t version = 0;
    const char *at = version_text;
    for (; is_digit(*at) && at - version_text < 2; at++)
        version = (uint16_t)(version << 4 | (*at - '0'));
    if (at == version_text)
        return "a version begins with a digit, as 3.21 does";
    if (is_digit(*at))
        return "a version has at most two digits before the point, as in 3.21";
    if (*at != '.')
        return "a version has a point between its two numbers, as in 3.21";
    if (!is_digit(at[1]) || !is_digit(at[2]) || at[3] != '\0')
        return "a version has exactly two digits after the point, as in 3.21, and nothing behind them";
    version = (uint16_t)(version << 8 | (at[1] - '0') << 4 | (at[2] - '0'));
    if (version < DR_FIRMWARE_FIRST)
        return "the first version is 1.00";
    *out = version;
    return NULL;
}

/* -- Points, in microns where the stage is known ------------------------------------------------------------------- */

static const char axis_letters[DR_AXES] = {'X', 'Y', 'Z'};

/* "X 1,000.0 um (16,000 steps)". What lies beyond the travel is said, because the manuals forbid it. */
static void add_axis(text *t, const dr_words_context *context, unsigned axis, uint32_t steps, bool unit)
{
    dr_stage stage;
    const bool known = dr_stage_get(context->stage, &stage);
    add(t, "%c ", axis_letters[axis]);
    if (known) {
        add_um(t, (uint64_t)steps * stage.quanta_per_step);
        add(t, " um (");
    }
    add_number(t, steps);
    if (unit || !known)
        add(t, steps == 1 ? " step" : " steps");
    if (known && steps > stage.travel_steps[axis]) {
        add(t, ", beyond the travel of ");
        add_number(t, stage.travel_steps[axis]);
    }
    if (steps > UINT32_C(0x7FFFFFFF)) {
        add(t, "%s%llu as a signed number", known ? ", -" : " = -",
            (unsigned long long)(UINT64_C(0x100000000) - steps));
    }
    add(t, known ? ")" : "");
}

static void add_point(text *t, const dr_words_context *context, const uint32_t steps[DR_AXES])
{
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        add(t, axis > 0 ? ", " : "");
        add_axis(t, context, axis, steps[axis], axis == 0);
    }
}

size_t dr_words_point(char *out, size_t room, const dr_words_context *context, const uint32_t steps[DR_AXES])
{
    text t = text_in(out, room);
    add_point(&t, context, steps);
    return t.length;
}

/* -- Requests ------------------------------------------------------------------------------------------------------ */

/* "0xEE", or "0x31 '1'" where it can be printed. */
static void add_byte(text *t, uint8_t byte)
{
    add(t, "0x%02X", (unsigned)byte);
    if (byte >= 0x20 && byte < 0x7F)
        add(t, " '%c'", (int)byte);
}

static void add_level(text *t, const dr_words_context *context, uint8_t level)
{
    const uint8_t counts = level % DR_SPEED_LEVELS;
    /* the speed of a level depends on the controller alone; any of its stages will do */
    const dr_stage_id any = context->kind == DR_TRIO ? DR_STAGE_TRIO_MP845 : DR_STAGE_MPC_MP225;
    add(t, " at speed %u", (unsigned)level);
    if (level != counts)
        add(t, ", which counts as %u", (unsigned)counts);
    add(t, " (");
    add_um(t, dr_speed_quanta_per_s(any, counts));
    add(t, " um/s)");
}

static void add_value(text *t, dr_op op, uint8_t value)
{
    switch (op) {
    case DR_OP_TRIO_ANGLE:
        add(t, " to %u degrees", (unsigned)value);
        add(t, value > DR_ANGLE_MAX_DEG ? ", which is not within 0 to 90 and changes nothing" : "");
        break;
    case DR_OP_MPC_SELECT:
        if (value >= 1 && value <= DR_PORTS) {
            add(t, " drive %u", (unsigned)value);
        } else {
            add(t, " drive ");
            add_byte(t, value);
            add(t, ", which is no drive: they are the bytes 0x01 to 0x04");
        }
        break;
    default: /* the mode of the knobs */
        add(t, " %u", (unsigned)value);
        add(t, value > 9 ? ", which is not within 0 to 9 and changes nothing" : "");
        break;
    }
}

static void add_request(text *t, const dr_words_context *context, const uint8_t *bytes, size_t count)
{
    dr_command command;
    if (count == 0) {
        add(t, "nothing");
        return;
    }
    if (!dr_command_find(context->kind, context->firmware, bytes[0], &command)) {
        char version[8];
        (void)dr_words_firmware(version, sizeof version, context->firmware);
        add_byte(t, bytes[0]);
        add(t, " is no command of the %s with firmware %s", dr_words_controller(context->kind), version);
        return;
    }
    const dr_op op = (dr_op)command.op;
    const size_t want = 1u + (size_t)command.args;
    if (count != want) {
        add(t, "%s: %zu byte%s of a command that has %zu", dr_words_command(op)->name, count, count == 1 ? "" : "s",
            want);
        return;
    }
    const dr_request request = dr_wire_get_request(&command, bytes);
    add(t, "%s", dr_words_command(op)->asks);
    switch ((dr_args)command.args) {
    case DR_ARGS_NONE:
        break;
    case DR_ARGS_BYTE:
        add_value(t, op, request.value);
        break;
    case DR_ARGS_AXIS:
        add(t, " to ");
        add_axis(t, context, dr_wire_axis(op), request.steps[dr_wire_axis(op)], true);
        break;
    case DR_ARGS_LINE:
        add_level(t, context, request.value); /* fall through */
    case DR_ARGS_POINT:
        add(t, " to ");
        add_point(t, context, request.steps);
        break;
    }
}

size_t dr_words_request(char *out, size_t room, const dr_words_context *context, const uint8_t *bytes, size_t count)
{
    text t = text_in(out, room);
    add_request(&t, context, bytes, count);
    return t.length;
}

/* -- Replies ------------------------------------------------------------------------------------------------------- */

static void add_drives(text *t, unsigned count, unsigned connected)
{
    const char *before = ": ";
    add(t, "%u drive%s connected", count, count == 1 ? "" : "s");
    for (unsigned port = 1; port <= DR_PORTS; port++) {
        if ((connected >> (port - 1u) & 1u) != 0) {
            add(t, "%s%u", before, port);
            before = ", ";
        }
    }
}

static void add_reply(text *t, const dr_words_context *context, dr_op op, const uint8_t *bytes, size_t count)
{
    dr_command command;
    dr_reply reply;
    char version[8];
    if (!dr_command_for(context->kind, context->firmware, op, &command)) {
        add(t, "an answer to no command of this controller");
        return;
    }
    if (!dr_wire_get_reply(&command, bytes, count, &reply)) {
        add(t, "no answer to %s: ", dr_words_command(op)->name);
        if (count != command.reply) {
            add(t, "%zu byte%s instead of %u", count, count == 1 ? "" : "s", (unsigned)command.reply);
        } else if (bytes[count - 1] != DR_CR) {
            add(t, "the last byte is ");
            add_byte(t, bytes[count - 1]);
            add(t, ", not CR");
        } else {
            add(t, "a value that no controller sends there");
        }
        return;
    }
    switch (op) {
    case DR_OP_TRIO_POSITION:
        add_point(t, context, reply.steps);
        add(t, ", angle %u degrees", (unsigned)reply.value);
        break;
    case DR_OP_MPC_POSITION:
        add(t, "drive %u: ", (unsigned)reply.value);
        add_point(t, context, reply.steps);
        break;
    case DR_OP_MPC_COUNT:
        add_drives(t, reply.value, 0);
        break;
    case DR_OP_MPC_DRIVES:
        add_drives(t, reply.value, reply.connected);
        break;
    case DR_OP_MPC_ACTIVE:
        add(t, "drive %u is active", (unsigned)reply.value);
        if (command.reply > 2) { /* from 3.00 on */
            (void)dr_words_firmware(version, sizeof version, reply.firmware);
            add(t, ", firmware %s", version);
        }
        break;
    case DR_OP_MPC_SELECT:
        if (command.reply == 1) /* up to 1.05 */
            add(t, "task complete");
        else if (reply.value == DR_NO_SUCH_DRIVE)
            add(t, "error: no such drive is connected");
        else
            add(t, "drive %u is active", (unsigned)reply.value);
        break;
    default:
        add(t, "%s: task complete", dr_words_command(op)->name);
        break;
    }
}

size_t dr_words_reply(char *out, size_t room, const dr_words_context *context, dr_op op, const uint8_t *bytes,
                      size_t count)
{
    text t = text_in(out, room);
    add_reply(&t, context, op, bytes, count);
    return t.length;
}

static void add_stream(text *t, const dr_words_context *context, const uint8_t *bytes, size_t count)
{
    uint32_t steps[DR_AXES];
    if (count != DR_STREAM_FRAME) {
        add(t, "no streamed position: %zu byte%s instead of %u", count, count == 1 ? "" : "s", DR_STREAM_FRAME);
    } else if (!dr_wire_get_stream(bytes, steps)) {
        add(t, "no streamed position: it does not begin with FF FF FF");
    } else {
        add(t, "at ");
        add_point(t, context, steps);
    }
}

size_t dr_words_stream(char *out, size_t room, const dr_words_context *context, const uint8_t *bytes, size_t count)
{
    text t = text_in(out, room);
    add_stream(&t, context, bytes, count);
    return t.length;
}

/* -- Byte by byte ------------------------------------------------------------------------------------------------- */

/* Byte `at` of a number of `width` bytes, least significant first. */
static void add_number_byte(text *t, const dr_words_context *context, unsigned axis, const uint8_t *number,
                            unsigned width, unsigned at)
{
    uint32_t value = 0;
    for (unsigned i = width; i-- > 0;)
        value = value << 8 | number[i];
    add(t, "%c, byte %u of %u%s: %u", axis_letters[axis], at + 1u, width,
        at == 0            ? " (least significant)"
        : at + 1u == width ? " (most significant)"
                           : "",
        (unsigned)number[at]);
    if (at > 0) {
        add(t, " x ");
        add_number(t, UINT64_C(1) << 8u * at);
        add(t, " = ");
        add_number(t, (uint64_t)number[at] << 8u * at);
    }
    if (at + 1u == width) {
        add(t, "; together ");
        add_axis(t, context, axis, value, true);
    }
}

/* Where the coordinates of a frame begin, in bytes, and how wide one is. */
static bool add_coordinate(text *t, const dr_words_context *context, const uint8_t *bytes, size_t at, size_t first,
                           unsigned width, unsigned axis)
{
    if (at < first || at >= first + (size_t)width)
        return false;
    add_number_byte(t, context, axis, bytes + first, width, (unsigned)(at - first));
    return true;
}

static bool add_coordinates(text *t, const dr_words_context *context, const uint8_t *bytes, size_t at, size_t first,
                            unsigned width)
{
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        if (add_coordinate(t, context, bytes, at, first + (size_t)axis * width, width, axis))
            return true;
    return false;
}

static void add_cr(text *t, uint8_t byte)
{
    if (byte == DR_CR) {
        add(t, "CR, the task-complete indicator ([T] note 1, [M] note 1)");
    } else {
        add_byte(t, byte);
        add(t, " where CR is expected");
    }
}

size_t dr_words_request_byte(char *out, size_t room, const dr_words_context *context, const uint8_t *bytes,
                             size_t count, size_t at)
{
    text t = text_in(out, room);
    dr_command command;
    if (at >= count)
        return 0;
    if (!dr_command_find(context->kind, context->firmware, bytes[0], &command) || count != 1u + (size_t)command.args) {
        add_byte(&t, bytes[at]);
        return t.length;
    }
    const dr_op op = (dr_op)command.op;
    if (at == 0) {
        const dr_command_words *const w = dr_words_command(op);
        add(&t, "command ");
        if (bytes[0] >= 0x20)
            add(&t, "'%c'", (int)bytes[0]);
        else
            add(&t, "^%c", (int)bytes[0] + '@');
        add(&t, ", %s: %s (%s)", w->name, w->meaning, w->source);
        return t.length;
    }
    switch ((dr_args)command.args) {
    case DR_ARGS_NONE:
        break;
    case DR_ARGS_BYTE:
        add(&t, "%s", op == DR_OP_TRIO_ANGLE ? "sets the angle" : op == DR_OP_MPC_SELECT ? "asks for" : "the mode:");
        add_value(&t, op, bytes[at]);
        break;
    case DR_ARGS_AXIS:
        (void)add_coordinate(&t, context, bytes, at, 1, 4, dr_wire_axis(op));
        break;
    case DR_ARGS_POINT:
        (void)add_coordinates(&t, context, bytes, at, 1, 4);
        break;
    case DR_ARGS_LINE:
        if (at == 1) {
            add(&t, "moves");
            add_level(&t, context, bytes[at]);
            add(&t, context->kind == DR_TRIO ? " ([T] table 7)" : " ([M] table 10); 30 ms of pause belong behind it");
        } else {
            (void)add_coordinates(&t, context, bytes, at, 2, 4);
        }
        break;
    }
    return t.length;
}

size_t dr_words_reply_byte(char *out, size_t room, const dr_words_context *context, dr_op op, const uint8_t *bytes,
                           size_t count, size_t at)
{
    text t = text_in(out, room);
    dr_command command;
    if (at >= count)
        return 0;
    if (!dr_command_for(context->kind, context->firmware, op, &command) || count != command.reply) {
        add_byte(&t, bytes[at]);
        return t.length;
    }
    if (at + 1u == count) {
        add_cr(&t, bytes[at]);
        return t.length;
    }
    switch (op) {
    case DR_OP_TRIO_POSITION:
        if (!add_coordinates(&t, context, bytes, at, 0, 4))
            add(&t, "the angle: %u degrees", (unsigned)bytes[at]);
        break;
    case DR_OP_MPC_POSITION:
        if (!add_coordinates(&t, context, bytes, at, 1, 4))
            add(&t, "the active drive: %u", (unsigned)bytes[at]);
        break;
    case DR_OP_MPC_COUNT:
    case DR_OP_MPC_DRIVES:
        if (at == 0)
            add(&t, "how many drives are connected: %u", (unsigned)bytes[at]);
        else
            add(&t, "port %u: %s", (unsigned)at, bytes[at] == 0 ? "empty" : "connected");
        break;
    case DR_OP_MPC_ACTIVE:
        if (at == 0)
            add(&t, "the active drive: %u", (unsigned)bytes[at]);
        else
            add(&t, "the firmware's %s version, binary-coded decimal: %x", at == 1 ? "minor" : "major",
                (unsigned)bytes[at]);
        break;
    case DR_OP_MPC_SELECT:
        if (bytes[at] == DR_NO_SUCH_DRIVE)
            add(&t, "'E': no such drive is connected");
        else
            add(&t, "the drive that is active now: %u", (unsigned)bytes[at]);
        break;
    default:
        add_byte(&t, bytes[at]);
        break;
    }
    return t.length;
}

size_t dr_words_stream_byte(char *out, size_t room, const dr_words_context *context, const uint8_t *bytes, size_t count,
                            size_t at)
{
    text t = text_in(out, room);
    if (at >= count)
        return 0;
    if (count == DR_STREAM_FRAME && at < 3 && bytes[at] == 0xFF)
        add(&t, "signature of a streamed position, byte %u of 3 ([M] note 16)", (unsigned)at + 1u);
    else if (count != DR_STREAM_FRAME || !add_coordinates(&t, context, bytes, at, 3, 3))
        add_byte(&t, bytes[at]);
    return t.length;
}

/* -- Notes --------------------------------------------------------------------------------------------------------- */

const char *dr_words_note_name(dr_note_kind kind)
{
    switch (kind) {
    case DR_NOTE_REQUEST:
        return "request";
    case DR_NOTE_REPLY:
        return "reply";
    case DR_NOTE_STREAM:
        return "stream";
    case DR_NOTE_FILLER:
        return "filler";
    case DR_NOTE_UNKNOWN:
        return "unknown";
    case DR_NOTE_LOST:
        return "lost";
    case DR_NOTE_KEPT:
        return "kept";
    case DR_NOTE_STOP_IGNORED:
        return "stop-ignored";
    case DR_NOTE_LEG:
        return "leg";
    case DR_NOTE_ARRIVED:
        return "arrived";
    case DR_NOTE_STOPPED:
        return "stopped";
    case DR_NOTE_RESUMED:
        return "resumed";
    case DR_NOTE_STRANDED:
        return "stranded";
    case DR_NOTE_CLIPPED:
        return "clipped";
    case DR_NOTE_SPEED_CUT:
        return "speed-cut";
    case DR_NOTE_SMALL_MOVE:
        return "small-move";
    case DR_NOTE_AXIS_STANDS:
        return "axis-stands";
    case DR_NOTE_NO_WORK:
        return "no-work";
    case DR_NOTE_NOT_AT_HOME:
        return "not-at-home";
    case DR_NOTE_BAD_VALUE:
        return "bad-value";
    case DR_NOTE_NO_DRIVE:
        return "no-drive";
    case DR_NOTE_WEDGED:
        return "wedged";
    case DR_NOTE_POWER_OFF:
        return "power-off";
    case DR_NOTE_POWER_ON:
        return "power-on";
    case DR_NOTE_CONNECTED:
        return "connected";
    case DR_NOTE_HAND:
        return "hand";
    case DR_NOTE_PLACED:
        return "placed";
    case DR_NOTE_STARTED:
        return "started";
    }
    return "?";
}

/* What a button of the panel has asked for. */
static void add_effect(text *t, dr_effect effect, uint8_t value)
{
    switch (effect) {
    case DR_EFFECT_HOME:
        add(t, "go home");
        return;
    case DR_EFFECT_WORK:
        add(t, "go to work");
        return;
    case DR_EFFECT_CALIBRATE:
        add(t, "calibrate");
        return;
    case DR_EFFECT_PAUSE:
        add(t, "pause");
        return;
    case DR_EFFECT_RESUME:
        add(t, "go on");
        return;
    case DR_EFFECT_STOP:
        add(t, "stop");
        return;
    case DR_EFFECT_SELECT:
        add(t, "select drive %u", value + 1u);
        return;
    case DR_EFFECT_MODE:
        add(t, "set mode %u", value);
        return;
    case DR_EFFECT_ANGLE:
        add(t, "set the angle to %u degrees", value);
        return;
    case DR_EFFECT_STORE_HOME:
        add(t, "this place is home");
        return;
    case DR_EFFECT_STORE_WORK:
        add(t, "this place is the work position");
        return;
    }
}

static int axis_of(uint32_t value) { return value < DR_AXES ? axis_letters[value] : '?'; }

size_t dr_words_note(char *out, size_t room, const dr_words_context *context, const dr_note *note)
{
    text t = text_in(out, room);
    const char *const command = dr_words_command((dr_op)note->op)->name;
    const unsigned drive = note->drive + 1u;
    const bool numbered = context->kind == DR_MPC; /* a TRIO has one drive only */

    switch ((dr_note_kind)note->what) {
    case DR_NOTE_REQUEST:
        add_request(&t, context, note->bytes, note->count);
        break;
    case DR_NOTE_REPLY:
        add_reply(&t, context, (dr_op)note->op, note->bytes, note->count);
        break;
    case DR_NOTE_STREAM:
        add_stream(&t, context, note->bytes, note->count);
        break;
    case DR_NOTE_FILLER:
        add(&t, "%s between commands, swallowed", note->bytes[0] == DR_LF ? "LF" : "CR");
        break;
    case DR_NOTE_UNKNOWN:
        add_request(&t, context, note->bytes, 1);
        add(&t, ", ignored");
        break;
    case DR_NOTE_LOST:
        add_number(&t, note->value);
        add(&t, note->value == 1 ? " byte of the host was lost" : " bytes of the host were lost");
        break;
    case DR_NOTE_KEPT:
        add(&t, "%s came before the reply to the command before it had left, and waits", command);
        break;
    case DR_NOTE_STOP_IGNORED:
        add(&t, "^C has no effect: a TRIO stops straight-line moves only");
        break;
    case DR_NOTE_LEG:
    case DR_NOTE_ARRIVED:
    case DR_NOTE_STOPPED:
    case DR_NOTE_PLACED:
        if (numbered)
            add(&t, "drive %u ", drive);
        switch ((dr_note_kind)note->what) {
        case DR_NOTE_LEG:
            add(&t, "runs to ");
            break;
        case DR_NOTE_ARRIVED:
            add(&t, "has arrived at ");
            break;
        case DR_NOTE_STOPPED:
            add(&t, "was stopped at ");
            break;
        default:
            add(&t, "was moved by hand to ");
            break;
        }
        add_point(&t, context, note->steps);
        if (note->what == DR_NOTE_LEG) {
            add(&t, " in ");
            add_ms(&t, note->value);
        }
        break;
    case DR_NOTE_RESUMED:
        add(&t, "the move that was stopped goes on; the new one is dropped");
        break;
    case DR_NOTE_STRANDED:
        add(&t, "%s is over and its CR will not come", command);
        break;
    case DR_NOTE_CLIPPED:
        add(&t, "the target of %c is beyond the travel", axis_of(note->value));
        break;
    case DR_NOTE_SPEED_CUT:
        add(&t, "a speed above 15 counts by its low four bits: %u", (unsigned)note->value);
        break;
    case DR_NOTE_SMALL_MOVE:
        add(&t, "%s of under 16 steps on each axis is ignored, without a CR", command);
        break;
    case DR_NOTE_AXIS_STANDS:
        add(&t, "%c does not move at an angle of %u degrees", axis_of(note->value), note->value == DR_X ? 90u : 0u);
        break;
    case DR_NOTE_NO_WORK:
        add(&t, "no work position is stored: nothing moves");
        break;
    case DR_NOTE_NOT_AT_HOME:
        add(&t, "the last completed motion was no Home: nothing moves");
        break;
    case DR_NOTE_BAD_VALUE:
        add_byte(&t, (uint8_t)note->value);
        add(&t, " is out of range for %s and changes nothing", command);
        break;
    case DR_NOTE_NO_DRIVE:
        add(&t, "no drive is connected: nothing is answered");
        break;
    case DR_NOTE_WEDGED:
        add(&t, "the controller hangs until a power cycle");
        break;
    case DR_NOTE_POWER_OFF:
        add(&t, "power off");
        break;
    case DR_NOTE_POWER_ON:
        add(&t, "power on");
        break;
    case DR_NOTE_STARTED:
        add(&t, "it has been on for a while");
        break;
    case DR_NOTE_CONNECTED:
        if (note->value == DR_STAGE_NONE)
            add(&t, "port %u was unplugged", drive);
        else
            add(&t, "%s was plugged into port %u", dr_words_stage((dr_stage_id)note->value), drive);
        break;
    case DR_NOTE_HAND:
        add(&t, "by hand: ");
        add_effect(&t, (dr_effect)note->value, note->bytes[0]);
        break;
    }
    return t.length;
}
