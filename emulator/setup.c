#include "setup.h"

#include "dr_words.h" /* names of stages and quirks */

#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

/* Remembers which text it is that is being read, for what may be wrong with it. */
static void at(setup_problem *problem, const char *what, unsigned index, const char *text)
{
    problem->what = what;
    problem->index = index;
    problem->text = text;
}

__attribute__((format(printf, 2, 3))) static bool wrong(setup_problem *problem, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(problem->why, sizeof problem->why, format, arguments);
    va_end(arguments);
    return false;
}

/* -- Devices --------------------------------------------------------------------------------------------------------- */

static bool read_device(setup *o, uint8_t port, const char *name, dr_stage_id *stage, setup_problem *problem)
{
    char text[512];
    *stage = DR_STAGE_NONE;
    if (name == NULL || strcasecmp(name, "none") == 0)
        return o->kind == DR_MPC || wrong(problem, "a TRIO needs its device");
    if (!dr_words_stage_find(o->kind, name, stage)) {
        (void)dr_words_stages(text, sizeof text, o->kind);
        return wrong(problem, "expected %s%s", text, o->kind == DR_MPC ? ", or none" : "");
    }
    return dr_words_fit(text, sizeof text, *stage, o->kind, o->firmware, port) == 0 || wrong(problem, "%s", text);
}

static bool read_devices(setup *o, const setup_text *t, setup_problem *problem)
{
    static const char *const usual[2][DR_PORTS] = {{"MP-845"}, {"MP-225", "MP-225"}};
    o->drive_count = o->kind == DR_TRIO ? 1 : DR_PORTS;
    if (t->device_count > o->drive_count) {
        at(problem, "device", o->drive_count, t->devices[o->drive_count]);
        return wrong(problem, "a TRIO has one device");
    }
    const char *const *names = t->device_count > 0 ? t->devices : usual[o->kind];
    for (uint8_t i = 0; i < o->drive_count; i++) {
        const kept_drive *const k = &o->kept.drives[i];
        const bool is_kept = o->was_kept && t->device_count == 0;
        const char *const name = is_kept ? dr_words_stage((dr_stage_id)k->stage) : names[i];
        dr_stage_id stage;
        at(problem, "device", i, name);
        if (!read_device(o, (uint8_t)(i + 1u), name, &stage, problem))
            return false;
        if (o->was_kept && k->stage != stage)
            return wrong(problem, "%s was at port %u when %s was written; with other devices, take another file",
                         dr_words_stage((dr_stage_id)k->stage), i + 1u, t->state);
        dr_drive_init(&o->drives[i], stage);
    }
    return true;
}

/* -- What was kept ------------------------------------------------------------------------------------------------------ */

static bool read_state(setup *o, const setup_text *t, setup_problem *problem)
{
    at(problem, "state", 0, t->state);
    o->state = t->state;
    if (t->state == NULL)
        return true;
    if (*t->state == '\0')
        return wrong(problem, "a path is missing");
    if (!kept_read(t->state, &o->kept, &o->was_kept, problem->why))
        return false;
    return !o->was_kept || o->kept.kind == o->kind ||
           wrong(problem, "this is the state of a controller '%s'", dr_words_kind(o->kept.kind));
}

static void set_as_kept(setup *o)
{
    for (uint8_t i = 0; i < o->drive_count; i++) {
        const kept_drive *const k = &o->kept.drives[i];
        dr_drive *const d = &o->drives[i];
        memcpy(d->position_steps, k->position_steps, sizeof d->position_steps);
        memcpy(d->work_steps, k->work_steps, sizeof d->work_steps);
        d->work_is_set = k->work_is_set;
        d->calibration = k->calibration;
        if (o->kind == DR_MPC)
            d->diagonal = k->rear % DR_DIAGONALS; /* switches 1 to 4 [M table 2] */
    }
    memcpy(o->home_steps, o->kept.home_steps, sizeof o->home_steps);
}

/* The drive that the n-th position or work position is for: the n-th that is connected. */
static dr_drive *nth_drive(setup *o, unsigned n, setup_problem *problem)
{
    unsigned connected = 0;
    for (uint8_t i = 0; i < o->drive_count; i++)
        if (o->drives[i].stage != DR_STAGE_NONE && connected++ == n)
            return &o->drives[i];
    (void)wrong(problem, "one too many, %u device%s connected", connected, connected == 1 ? " is" : "s are");
    return NULL;
}

static bool read_points(setup *o, const setup_text *t, setup_problem *problem)
{
    for (unsigned i = 0; i < t->position_count; i++) {
        at(problem, "position", i, t->positions[i]);
        dr_drive *const drive = nth_drive(o, i, problem);
        if (drive == NULL ||
            !values_point(t->positions[i], (dr_stage_id)drive->stage, drive->position_steps, problem->why))
            return false;
    }
    for (unsigned i = 0; i < t->work_count; i++) {
        at(problem, "work", i, t->works[i]);
        dr_drive *const drive = nth_drive(o, i, problem);
        if (drive == NULL || !values_point(t->works[i], (dr_stage_id)drive->stage, drive->work_steps, problem->why))
            return false;
        drive->work_is_set = true;
    }
    if (t->home == NULL)
        return true;
    at(problem, "home", 0, t->home);
    if (o->kind != DR_TRIO)
        return wrong(problem, "an MPC-200 stores no home position, its home is 0,0,0; a home position is for trio");
    return values_point(t->home, (dr_stage_id)o->drives[0].stage, o->home_steps, problem->why);
}

static bool read_angle(setup *o, const char *text, setup_problem *problem)
{
    unsigned angle_deg = o->was_kept ? o->kept.angle_deg : DR_ANGLE_DEFAULT_DEG;
    uint8_t diagonal;
    at(problem, "angle", 0, text);
    if (text != NULL && o->kind == DR_TRIO && !values_number(text, 0, DR_ANGLE_MAX_DEG, &angle_deg, problem->why))
        return false;
    o->angle_deg = (uint8_t)angle_deg;
    if (text == NULL || o->kind == DR_TRIO)
        return true;
    if (!values_diagonal(text, &diagonal, problem->why))
        return false;
    for (uint8_t i = 0; i < o->drive_count; i++) {
        o->drives[i].diagonal = diagonal;
    }
    return true;
}

/* -- Quirks ---------------------------------------------------------------------------------------------------------- */

static uint8_t byte_quirk(dr_quirk_id id)
{
    switch (id) {
    case DR_QUIRK_ID_POSITION_13:
        return INSTRUMENT_POSITION_13;
    case DR_QUIRK_ID_STOP_SAYS_I:
        return INSTRUMENT_STOP_SAYS_I;
    case DR_QUIRK_ID_NUL_HEARTBEAT:
        return INSTRUMENT_NUL_HEARTBEAT;
    default:
        return 0;
    }
}

static void add_quirk(setup *o, dr_quirk_id id)
{
    o->quirk_ids = (uint16_t)(o->quirk_ids | 1u << id);
    o->quirks = (uint16_t)(o->quirks | dr_words_quirk(id)->core);
    o->byte_quirks = (uint8_t)(o->byte_quirks | byte_quirk(id));
}

static bool find_quirk(dr_kind kind, const char *name, const char *sets, dr_quirk_id *id, char why[WHY_ROOM])
{
    if (!dr_words_quirk_find(name, id)) {
        size_t length = (size_t)snprintf(why, WHY_ROOM, "expected %s", sets);
        for (unsigned i = 0; i < DR_QUIRK_IDS && length < WHY_ROOM; i++)
            length += (size_t)snprintf(why + length, WHY_ROOM - length, "%s%s", length > 9 ? ", " : "",
                                       dr_words_quirk((dr_quirk_id)i)->name);
        return false;
    }
    if (dr_words_quirk(*id)->mpc_only && kind == DR_TRIO) {
        (void)snprintf(why, WHY_ROOM, "that is a quirk of the MPC-200");
        return false;
    }
    return true;
}

static bool read_quirks(setup *o, const char *list, setup_problem *problem)
{
    static char name[64]; /* for the problem, which outlives this call */
    while (*list != '\0') {
        dr_quirk_id id;
        const size_t length = strcspn(list, ",");
        (void)snprintf(name, sizeof name, "%.*s", (int)length, list);
        at(problem, "quirks", 0, name);
        if (strcasecmp(name, "observed") == 0) {
            for (unsigned i = 0; i < DR_QUIRK_IDS; i++)
                if (dr_words_quirk((dr_quirk_id)i)->observed &&
                    !(dr_words_quirk((dr_quirk_id)i)->mpc_only && o->kind == DR_TRIO))
                    add_quirk(o, (dr_quirk_id)i);
        } else if (strcasecmp(name, "documented") != 0) {
            if (!find_quirk(o->kind, name, "documented, observed", &id, problem->why))
                return false;
            add_quirk(o, id);
        }
        list += length + (list[length] == ',' ? 1 : 0);
    }
    return true;
}

bool setup_has_quirk(const instrument *ins, dr_quirk_id id)
{
    return (ins->controller.quirks & dr_words_quirk(id)->core) != 0 || (ins->quirks & byte_quirk(id)) != 0;
}

bool setup_knows_quirk(const instrument *ins, const char *name, char why[WHY_ROOM])
{
    dr_quirk_id id;
    return find_quirk((dr_kind)ins->controller.kind, name, "", &id, why);
}

bool setup_quirk(instrument *ins, const char *name, bool on, char why[WHY_ROOM])
{
    dr_quirk_id id;
    if (!find_quirk((dr_kind)ins->controller.kind, name, "", &id, why))
        return false;
    const uint16_t core = dr_words_quirk(id)->core;
    const uint8_t bytes = byte_quirk(id);
    ins->controller.quirks = (uint16_t)(on ? ins->controller.quirks | core : ins->controller.quirks & ~core);
    ins->quirks = (uint8_t)(on ? ins->quirks | bytes : ins->quirks & ~bytes);
    return true;
}

/* -- The whole ------------------------------------------------------------------------------------------------------- */

bool setup_read(const setup_text *t, bool is_paced_by_default, setup *o, setup_problem *problem)
{
    memset(o, 0, sizeof *o);
    at(problem, "controller", 0, t->controller);
    if (!dr_words_kind_find(t->controller, &o->kind))
        return wrong(problem, "expected trio or mpc");
    const uint16_t newest = o->kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
    o->firmware = newest;
    at(problem, "firmware", 0, t->firmware);
    const char *const bad = t->firmware == NULL ? NULL : dr_words_firmware_parse(t->firmware, &o->firmware);
    if (bad != NULL)
        return wrong(problem, "%s", bad);
    if (o->firmware > newest) /* what it would do, nobody here knows */
        return wrong(problem, "the manual tells of 1.00 to %x.%02x", newest >> 8u, newest & 0xFFu);
    if (!read_state(o, t, problem) || !read_devices(o, t, problem))
        return false;
    if (o->was_kept)
        set_as_kept(o);
    if (!read_points(o, t, problem) || !read_angle(o, t->angle, problem) ||
        !read_quirks(o, t->quirks == NULL ? "" : t->quirks, problem))
        return false;
    at(problem, "pace", 0, t->pace);
    o->is_paced = t->pace == NULL ? is_paced_by_default : strcasecmp(t->pace, "on") == 0;
    return t->pace == NULL || o->is_paced || strcasecmp(t->pace, "off") == 0 || wrong(problem, "expected on or off");
}

void setup_started(const setup *s, instrument *ins)
{
    kept_state k = s->kept;
    for (uint8_t i = 0; i < s->drive_count && s->kind == DR_MPC; i++) /* --angle may have said otherwise */
        k.drives[i].rear = (uint8_t)((k.drives[i].rear & ~(DR_DIAGONALS - 1u)) | s->drives[i].diagonal);
    if (s->was_kept)
        kept_switches(&k, ins);
}

void setup_apply(const setup *s, instrument *ins, dr_drive *drives)
{
    dr_controller *c = &ins->controller;
    memcpy(drives, s->drives, sizeof s->drives);
    dr_controller_init(c, s->kind, drives, s->drive_count);
    c->firmware = s->firmware;
    c->quirks = s->quirks;
    c->angle_deg = s->angle_deg;
    memcpy(c->home_steps, s->home_steps, sizeof c->home_steps);
    ins->quirks = s->byte_quirks;
    ins->is_paced = s->is_paced;
}
