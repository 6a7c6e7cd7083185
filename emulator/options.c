#define _GNU_SOURCE /* argp */
#include "options.h"

#include "dr_words.h"   /* names of stages and quirks */
#include "instrument.h" /* INSTRUMENT_POSITION_13 ... */

#include <argp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define REPEATS DR_PORTS
#define TEXT 512
#define MICRO UINT64_C(1000000)

/* What was typed. It is understood when all of it is known: what fits depends on the controller and its firmware. */
typedef struct {
    const char *controller, *link, *firmware, *home, *angle, *quirks, *pace, *trace, *speedup;
    const char *devices[REPEATS], *positions[REPEATS], *works[REPEATS];
    unsigned device_count, position_count, work_count;
} typed;

const char *argp_program_version = "dryrig-emu " DRYRIG_VERSION;

__attribute__((format(printf, 1, 2), noreturn)) static void refuse(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    (void)fputs("dryrig-emu: ", stderr);
    (void)vfprintf(stderr, format, arguments);
    (void)fputs("\nTry 'dryrig-emu --help'.\n", stderr);
    va_end(arguments);
    exit(2);
}

/* -- Reading --------------------------------------------------------------------------------------------------------- */

enum { LINK = 256, DEVICE, FIRMWARE, POSITION, HOME, WORK, ANGLE, QUIRKS, PACE, TRACE, SPEEDUP };

static const struct argp_option known[] = {
    {"link", LINK, "PATH", 0, "Make a symbolic link PATH to the port; it is removed at the end", 1},
    {"device", DEVICE, "MODEL", 0,
     "What is connected: the first --device to port 1, and so on; 'none' leaves a port empty. Once for trio (default "
     "MP-845), up to "
     "four times for mpc (default: MP-225 at ports 1 and 2)",
     2},
    {"firmware", FIRMWARE, "X.YY", 0, "Version of the controller's firmware (default: 3.12 for trio, 3.21 for mpc)", 2},
    {"position", POSITION, "X,Y,Z", 0,
     "Where a device is at the start, in microsteps, or in microns: 100um,200um,300um. The first --position is for the "
     "first device, "
     "and so on (default: 1,000 um on each axis for trio, 0,0,0 for mpc)",
     2},
    {"home", HOME, "X,Y,Z", 0, "trio: the stored home position (default 0,0,0)", 2},
    {"work", WORK, "X,Y,Z", 0, "The stored work position of a device, repeated as --position (default: none)", 2},
    {"angle", ANGLE, "DEG", 0,
     "trio: 0 to 90 (default 30). mpc: how steep the diagonal of all devices is: 7, 11, 14, 21, 27, 29, 35, 39 or 45 "
     "degrees off the "
     "horizontal; '29more' for the steep side of 45 (default 29, that is 29less)",
     2},
    {"quirks", QUIRKS, "LIST", 0,
     "'documented' (default): as the manuals say; 'observed': and what people meet on real controllers; or names with "
     "commas between, "
     "see the manual page",
     3},
    {"pace", PACE, "on|off", 0,
     "Take and send bytes at the rate of the serial line (default on), or as fast as they come", 4},
    {"speedup", SPEEDUP, "N", 0, "Run the controller's clock and its line N times faster, 1 to 1000", 4},
    {"trace", TRACE, "FILE", 0, "Write what happens, in words, to FILE; '-' is stderr", 4},
    {NULL, 0, NULL, 0, NULL, 0}};

static void once(struct argp_state *state, const char **place, const char *name, const char *value)
{
    if (*place != NULL)
        argp_error(state, "--%s is given twice", name);
    *place = value;
}

static void repeated(struct argp_state *state, const char **places, unsigned *count, const char *name,
                     const char *value)
{
    if (*count == REPEATS)
        argp_error(state, "--%s is given more than %u times; an MPC-200 has %u ports", name, REPEATS, DR_PORTS);
    places[(*count)++] = value;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    typed *t = state->input;
    switch (key) {
    case LINK:
        once(state, &t->link, "link", value);
        break;
    case DEVICE:
        repeated(state, t->devices, &t->device_count, "device", value);
        break;
    case FIRMWARE:
        once(state, &t->firmware, "firmware", value);
        break;
    case POSITION:
        repeated(state, t->positions, &t->position_count, "position", value);
        break;
    case HOME:
        once(state, &t->home, "home", value);
        break;
    case WORK:
        repeated(state, t->works, &t->work_count, "work", value);
        break;
    case ANGLE:
        once(state, &t->angle, "angle", value);
        break;
    case QUIRKS:
        once(state, &t->quirks, "quirks", value);
        break;
    case PACE:
        once(state, &t->pace, "pace", value);
        break;
    case TRACE:
        once(state, &t->trace, "trace", value);
        break;
    case SPEEDUP:
        once(state, &t->speedup, "speedup", value);
        break;
    case ARGP_KEY_ARG:
        if (t->controller != NULL)
            argp_error(state, "one controller at a time: '%s' is one too many", value);
        t->controller = value;
        break;
    case ARGP_KEY_END:
        if (t->controller == NULL)
            argp_error(state, "which controller? trio or mpc");
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

/* -- Positions ------------------------------------------------------------------------------------------------------- */

/* Reads a number of up to 9 digits, with decimals, in millionths. Returns what stands behind it; NULL: it is no number. */
static const char *read_millionths(const char *text, uint64_t *millionths)
{
    const size_t whole = strspn(text, "0123456789");
    if (whole == 0 || whole > 9)
        return NULL;
    *millionths = strtoull(text, NULL, 10) * MICRO;
    text += whole;
    if (*text != '.')
        return text;
    uint64_t worth = MICRO / 10u;
    for (text++; *text >= '0' && *text <= '9'; text++, worth /= 10u)
        *millionths += worth * (uint64_t)(*text - '0');
    return text;
}

/* X,Y,Z for a stage. */
static void read_point(const char *option, const char *text, dr_stage_id id, uint32_t steps[DR_AXES])
{
    static const char *const shape = "X,Y,Z in whole microsteps, as 16000,0,400, or in microns, as 100um,0um,12.5um";
    uint64_t millionths[DR_AXES];
    bool in_um[DR_AXES];
    dr_stage stage;
    (void)dr_stage_get(id, &stage);

    const char *rest = text;
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        rest = read_millionths(rest, &millionths[axis]);
        if (rest == NULL)
            refuse("--%s %s: expected %s", option, text, shape);
        in_um[axis] = strncasecmp(rest, "um", 2) == 0;
        rest += in_um[axis] ? 2 : 0;
        if (*rest != (axis + 1u < DR_AXES ? ',' : '\0'))
            refuse("--%s %s: expected %s", option, text, shape);
        rest++;
    }
    if (in_um[DR_Z] && !in_um[DR_X] && !in_um[DR_Y]) /* 100,200,300um: said once, meant for all */
        in_um[DR_X] = in_um[DR_Y] = true;

    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        if (in_um[axis] != in_um[0])
            refuse("--%s %s: microns or microsteps, not both", option, text);
        if (!in_um[axis] && millionths[axis] % MICRO != 0)
            refuse("--%s %s: microsteps are whole; microns are written with um", option, text);
        const uint64_t unit = in_um[axis] ? MICRO * stage.quanta_per_step : MICRO;
        const uint64_t at = (millionths[axis] * (in_um[axis] ? DR_QUANTA_PER_UM : 1u) + unit / 2u) / unit;
        if (at > stage.travel_steps[axis]) {
            char most[32], most_um[32];
            (void)dr_words_number(most, sizeof most, stage.travel_steps[axis]);
            (void)dr_words_um(most_um, sizeof most_um, (uint64_t)stage.travel_steps[axis] * stage.quanta_per_step);
            refuse("--%s %s: %c is beyond the travel of %s, which is 0 to %s steps (%s um)", option, text, "XYZ"[axis],
                   dr_words_stage(id), most, most_um);
        }
        steps[axis] = (uint32_t)at;
    }
}

/* -- The rest, one option each --------------------------------------------------------------------------------------- */

static unsigned read_number(const char *option, const char *text, unsigned least, unsigned most)
{
    const size_t digits = strspn(text, "0123456789");
    const unsigned long number =
        digits > 0 && digits < 9 && text[digits] == '\0' ? strtoul(text, NULL, 10) : most + 1ul;
    if (number < least || number > most)
        refuse("--%s %s: expected a whole number from %u to %u", option, text, least, most);
    return (unsigned)number;
}

static void read_devices(options *o, const typed *t)
{
    static const char *const usual[2][DR_PORTS] = {{"MP-845"}, {"MP-225", "MP-225"}};
    o->drive_count = o->kind == DR_TRIO ? 1 : DR_PORTS;
    if (t->device_count > o->drive_count)
        refuse("--device %s: a TRIO has one device", t->devices[o->drive_count]);
    const char *const *names = t->device_count > 0 ? t->devices : usual[o->kind];
    for (uint8_t i = 0; i < o->drive_count; i++) {
        const char *const name = names[i];
        dr_stage_id stage = DR_STAGE_NONE;
        char text[TEXT];
        if (name != NULL && strcasecmp(name, "none") != 0) {
            if (!dr_words_stage_find(o->kind, name, &stage)) {
                (void)dr_words_stages(text, sizeof text, o->kind);
                refuse("--device %s: expected %s%s", name, text, o->kind == DR_MPC ? ", or none" : "");
            }
            if (dr_words_fit(text, sizeof text, stage, o->kind, o->firmware, (uint8_t)(i + 1u)) > 0)
                refuse("--device %s: %s", name, text);
        } else if (o->kind == DR_TRIO) {
            refuse("--device none: a TRIO needs its device");
        }
        dr_drive_init(&o->drives[i], stage);
    }
}

/* The drive that the n-th --position or --work is for: the n-th that is connected. */
static dr_drive *nth_drive(options *o, const char *option, const char *text, unsigned n)
{
    unsigned connected = 0;
    for (uint8_t i = 0; i < o->drive_count; i++)
        if (o->drives[i].stage != DR_STAGE_NONE && connected++ == n)
            return &o->drives[i];
    refuse("--%s %s: one too many, %u device%s connected", option, text, connected, connected == 1 ? " is" : "s are");
}

static void read_points(options *o, const typed *t)
{
    for (unsigned i = 0; i < t->position_count; i++) {
        dr_drive *drive = nth_drive(o, "position", t->positions[i], i);
        read_point("position", t->positions[i], (dr_stage_id)drive->stage, drive->position_steps);
    }
    for (unsigned i = 0; i < t->work_count; i++) {
        dr_drive *drive = nth_drive(o, "work", t->works[i], i);
        read_point("work", t->works[i], (dr_stage_id)drive->stage, drive->work_steps);
        drive->work_is_set = true;
    }
    if (t->home == NULL)
        return;
    if (o->kind != DR_TRIO)
        refuse("--home %s: an MPC-200 stores no home position, its home is 0,0,0; --home is for trio", t->home);
    read_point("home", t->home, (dr_stage_id)o->drives[0].stage, o->home_steps);
}

/* MPC-200 switches 1-4 as a number [M table 2]: 0 to 6 are steeper than 45 degrees, 8 to 15 less steep. */
static uint8_t read_diagonal(const char *text)
{
    static const uint8_t degrees[DR_DIAGONALS] = {11, 14, 21, 27, 29, 35, 39, 45, 39, 35, 29, 27, 21, 14, 11, 7};
    const unsigned even = 7;
    char *rest;
    const unsigned long angle = strtoul(text, &rest, 10);
    rest += strspn(rest, " -,:");
    const bool more = strcasecmp(rest, "more") == 0;
    const bool less = strcasecmp(rest, "less") == 0;
    if (rest != text && (more || less || *rest == '\0'))
        for (unsigned value = more ? 0 : even; value < DR_DIAGONALS; value++)
            if (degrees[value] == angle && !(value == even && (more || less)) && !(more && value > even))
                return (uint8_t)value;
    refuse("--angle %s: expected 7, 11, 14, 21, 27, 29, 35 or 39, less steep than 45 degrees; 45; or "
           "11more, 14more, 21more, 27more, 29more, 35more or 39more, steeper",
           text);
}

static void read_angle(options *o, const char *text)
{
    o->angle_deg = DR_ANGLE_DEFAULT_DEG;
    if (text == NULL)
        return;
    if (o->kind == DR_TRIO)
        o->angle_deg = (uint8_t)read_number("angle", text, 0, DR_ANGLE_MAX_DEG);
    else
        for (uint8_t i = 0; i < o->drive_count; i++)
            o->drives[i].diagonal = read_diagonal(text);
}

static void add_quirk(options *o, dr_quirk_id id)
{
    o->quirk_ids = (uint16_t)(o->quirk_ids | 1u << id);
    o->quirks = (uint16_t)(o->quirks | dr_words_quirk(id)->core);
    if (id == DR_QUIRK_ID_POSITION_13)
        o->byte_quirks |= INSTRUMENT_POSITION_13;
    else if (id == DR_QUIRK_ID_STOP_SAYS_I)
        o->byte_quirks |= INSTRUMENT_STOP_SAYS_I;
    else if (id == DR_QUIRK_ID_NUL_HEARTBEAT)
        o->byte_quirks |= INSTRUMENT_NUL_HEARTBEAT;
}

static void add_quirk_named(options *o, const char *name)
{
    dr_quirk_id id;
    if (!dr_words_quirk_find(name, &id)) {
        char names[TEXT] = "";
        for (unsigned i = 0; i < DR_QUIRK_IDS; i++) {
            const size_t length = strlen(names);
            (void)snprintf(names + length, sizeof names - length, ", %s", dr_words_quirk((dr_quirk_id)i)->name);
        }
        refuse("--quirks %s: expected documented, observed%s", name, names);
    }
    if (dr_words_quirk(id)->mpc_only && o->kind == DR_TRIO)
        refuse("--quirks %s: that is a quirk of the MPC-200", name);
    add_quirk(o, id);
}

static void read_quirks(options *o, const char *list)
{
    while (*list != '\0') {
        char name[TEXT];
        const size_t length = strcspn(list, ",");
        (void)snprintf(name, sizeof name, "%.*s", (int)length, list);
        if (strcasecmp(name, "observed") == 0) {
            for (unsigned i = 0; i < DR_QUIRK_IDS; i++)
                if (dr_words_quirk((dr_quirk_id)i)->observed &&
                    !(dr_words_quirk((dr_quirk_id)i)->mpc_only && o->kind == DR_TRIO))
                    add_quirk(o, (dr_quirk_id)i);
        } else if (strcasecmp(name, "documented") != 0) {
            add_quirk_named(o, name);
        }
        list += length + (list[length] == ',' ? 1 : 0);
    }
}

static bool read_pace(const char *text)
{
    const bool on = strcasecmp(text, "on") == 0;
    if (!on && strcasecmp(text, "off") != 0)
        refuse("--pace %s: expected on or off", text);
    return on;
}

options options_read(int argc, char **argv)
{
    static const struct argp argp = {
        known,
        parse,
        "trio|mpc",
        "Stands in for a Sutter TRIO MP-245A (trio) or MPC-200 (mpc) micromanipulator controller on a pseudo-terminal. "
        "Prints 'ready' and the port's path, and runs until SIGINT, SIGTERM or SIGHUP.\v"
        "Exit status: 0 stopped by a signal, 1 the port, the link or the trace cannot be had, 2 wrong options.",
        NULL,
        NULL,
        NULL};
    typed t;
    options o;
    memset(&t, 0, sizeof t);
    memset(&o, 0, sizeof o);
    argp_err_exit_status = 2;
    (void)argp_parse(&argp, argc, argv, 0, NULL, &t);

    if (!dr_words_kind_find(t.controller, &o.kind))
        refuse("'%s': expected trio or mpc", t.controller);
    o.firmware = o.kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
    const char *wrong = t.firmware == NULL ? NULL : dr_words_firmware_parse(t.firmware, &o.firmware);
    if (wrong != NULL)
        refuse("--firmware %s: %s", t.firmware, wrong);
    read_devices(&o, &t);
    read_points(&o, &t);
    read_angle(&o, t.angle);
    read_quirks(&o, t.quirks == NULL ? "" : t.quirks);
    o.is_paced = t.pace == NULL || read_pace(t.pace);
    o.speedup = t.speedup == NULL ? 1 : read_number("speedup", t.speedup, 1, SPEEDUP_MAX);
    if (t.link != NULL && *t.link == '\0')
        refuse("--link: a path is missing");
    o.link = t.link;
    o.trace = t.trace;
    return o;
}
