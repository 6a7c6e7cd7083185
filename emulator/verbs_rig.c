/* Verbs for the rig: its clock, its controllers' power, plugs and settings, and what it looks like. */
#include "language.h"

#include "dr_words.h" /* names */

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define IDLE_LIMIT_US (UINT64_C(3600) * DR_US_PER_S) /* advance until idle, where no other limit is given */

static dr_controller *controller(const telling *t) { return &t->s->ins.controller; }
static dr_us now(const telling *t) { return (dr_us)t->s->ins.now_us; }

/* A hand, where one can be laid on. */
static bool poke(telling *t, const dr_hand *hand, const char *why_not)
{
    return dr_controller_poke(controller(t), now(t), hand) || telling_wrong(t, "%s", why_not);
}

static bool has_port(const telling *t) { return t->words[t->at] != NULL && strlen(t->words[t->at]) == 1; }

/* The number of a port that stands next in the line, else that of the active device; as an index. */
static bool read_port(telling *t, bool is_optional, uint8_t *drive)
{
    char why[WHY_ROOM];
    unsigned number;
    *drive = controller(t)->active;
    if (is_optional && !has_port(t))
        return true;
    const char *const word = telling_word(t);
    if (!values_number(word, 1, controller(t)->drive_count, &number, why)) {
        (void)snprintf(why, sizeof why, "expected the port of a device, 1 to %u", (unsigned)controller(t)->drive_count);
        return telling_about(t, word, why);
    }
    *drive = (uint8_t)(number - 1u);
    return true;
}

/* -- state --------------------------------------------------------------------------------------------------------------- */

static const char *state_name(const dr_controller *c)
{
    switch ((dr_state)c->state) {
    case DR_STATE_OFF:
        return "off";
    case DR_STATE_BOOTING:
        return "booting";
    case DR_STATE_REST:
        return "rest";
    case DR_STATE_MOVING:
        return "moving";
    case DR_STATE_STRANDED:
        return "stranded";
    case DR_STATE_WEDGED:
        return "wedged";
    case DR_STATE_PAUSED:
        return "paused";
    }
    return "?";
}

static void add_point(cJSON *to, const char *key, const uint32_t steps[DR_AXES])
{
    cJSON *const list = cJSON_AddArrayToObject(to, key);
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        (void)cJSON_AddItemToArray(list, cJSON_CreateNumber(steps[axis]));
}

static void add_um(cJSON *to, const char *key, const uint32_t steps[DR_AXES], dr_stage_id id)
{
    dr_stage stage;
    if (!dr_stage_get(id, &stage))
        return;
    cJSON *const list = cJSON_AddArrayToObject(to, key);
    for (unsigned axis = 0; axis < DR_AXES; axis++) /* quanta are exact in binary */
        (void)cJSON_AddItemToArray(list,
                                   cJSON_CreateNumber((double)steps[axis] * stage.quanta_per_step / DR_QUANTA_PER_UM));
}

static cJSON *device_json(const station *s, uint8_t i)
{
    static const char *const calibrations[] = {"calibrated", "uncalibrated", "uncalibrated, power-cycled"};
    const dr_controller *const c = &s->ins.controller;
    const dr_drive *const drive = &c->drives[i];
    const dr_stage_id stage = (dr_stage_id)drive->stage;
    cJSON *const out = cJSON_CreateObject();
    (void)cJSON_AddNumberToObject(out, "port", i + 1);
    (void)cJSON_AddStringToObject(out, "model", dr_words_stage(stage));
    if (stage == DR_STAGE_NONE)
        return out;
    uint32_t steps[DR_AXES];
    dr_controller_position(c, i, (dr_us)s->ins.now_us, steps);
    add_point(out, "position_steps", steps);
    add_um(out, "position_um", steps, stage);
    cJSON *const tip = cJSON_AddArrayToObject(out, "tip_steps"); /* where it really is: fault slip-axis */
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        (void)cJSON_AddItemToArray(
            tip, cJSON_CreateNumber((double)((int64_t)steps[axis] -
                                             faults_slipped_steps(&s->ins.faults, c, i, axis, (dr_us)s->ins.now_us))));
    if (drive->work_is_set)
        add_point(out, "work_steps", drive->work_steps);
    else
        (void)cJSON_AddNullToObject(out, "work_steps");
    (void)cJSON_AddStringToObject(out, "calibration", calibrations[drive->calibration % 3u]);
    if (c->kind == DR_MPC) {
        (void)cJSON_AddNumberToObject(out, "mode", drive->mode);
        (void)cJSON_AddNumberToObject(out, "diagonal", drive->diagonal);
        (void)cJSON_AddBoolToObject(out, "at_home", drive->at_home);
    }
    return out;
}

static cJSON *controller_json(const station *s)
{
    const dr_controller *const c = &s->ins.controller;
    char firmware[16];
    cJSON *const out = cJSON_CreateObject();
    (void)dr_words_firmware(firmware, sizeof firmware, c->firmware);
    (void)cJSON_AddStringToObject(out, "name", s->name);
    (void)cJSON_AddStringToObject(out, "controller", dr_words_kind((dr_kind)c->kind));
    (void)cJSON_AddStringToObject(out, "firmware", firmware);
    if (s->is_plugged)
        (void)cJSON_AddStringToObject(out, "port", s->port.path);
    else
        (void)cJSON_AddNullToObject(out, "port");
    if (s->link != NULL)
        (void)cJSON_AddStringToObject(out, "link", s->link);
    (void)cJSON_AddBoolToObject(out, "is_open", s->port.opens > 0);
    (void)cJSON_AddStringToObject(out, "state", s->ins.faults.is_wedged ? "wedged" : state_name(c));
    if (c->state == DR_STATE_MOVING || c->state == DR_STATE_PAUSED)
        (void)cJSON_AddStringToObject(out, "move", dr_words_command((dr_op)c->move_op)->name);
    (void)cJSON_AddNumberToObject(out, "active", c->active + 1);
    if (c->kind == DR_TRIO) {
        (void)cJSON_AddNumberToObject(out, "angle_deg", c->angle_deg);
        add_point(out, "home_steps", c->home_steps);
    } else {
        (void)cJSON_AddBoolToObject(out, "streaming", c->streaming);
    }
    cJSON *const devices = cJSON_AddArrayToObject(out, "devices");
    for (uint8_t i = 0; i < c->drive_count; i++)
        (void)cJSON_AddItemToArray(devices, device_json(s, i));
    cJSON *const quirks = cJSON_AddArrayToObject(out, "quirks");
    for (unsigned i = 0; i < DR_QUIRK_IDS; i++)
        if (setup_has_quirk(&s->ins, (dr_quirk_id)i))
            (void)cJSON_AddItemToArray(quirks, cJSON_CreateString(dr_words_quirk((dr_quirk_id)i)->name));
    (void)cJSON_AddNumberToObject(out, "unknown_bytes", c->unknown_bytes);
    (void)cJSON_AddNumberToObject(out, "lost_bytes", c->lost_bytes);
    (void)cJSON_AddNumberToObject(out, "kept_commands", c->kept_commands);
    (void)cJSON_AddNumberToObject(out, "unread_lost_bytes", (double)s->port.lost_bytes);
    return out;
}

static void add_time(const telling *t)
{
    uint64_t when_us;
    (void)cJSON_AddNumberToObject(t->answer, "now_us", (double)t->l->e->now_us);
    (void)cJSON_AddBoolToObject(t->answer, "idle", !engine_due(t->l->e, &when_us));
}

static bool do_state(telling *t)
{
    static const char *const modes[] = {"real", "step", "jump"};
    if (!telling_ends(t))
        return false;
    (void)cJSON_AddStringToObject(t->answer, "clock", modes[t->l->e->mode]);
    (void)cJSON_AddBoolToObject(t->answer, "waits_for_client", t->l->e->waits_for_client);
    add_time(t);
    cJSON *const list = cJSON_AddArrayToObject(t->answer, "controllers");
    for (unsigned i = 0; i < t->l->e->station_count; i++)
        if (t->s == NULL || t->s == &t->l->e->stations[i])
            (void)cJSON_AddItemToArray(list, controller_json(&t->l->e->stations[i]));
    return true;
}

/* -- advance ------------------------------------------------------------------------------------------------------------- */

static bool do_advance(telling *t)
{
    engine *const e = t->l->e;
    const bool until_idle = telling_take(t, "until");
    uint64_t span_us = IDLE_LIMIT_US;
    if (until_idle && !telling_take(t, "idle"))
        return telling_wrong(t, "expected: advance until idle");
    if ((!until_idle || t->words[t->at] != NULL) && !telling_time(t, &span_us))
        return false;
    if (e->mode == CLOCK_REAL)
        return telling_wrong(t, "the clock goes by itself; it can be moved with --clock step, or jump");
    if (t->is_later || t->l->depth > 0)
        return telling_wrong(t, "a command that comes with time cannot move it");
    if (!telling_ends(t))
        return false;
    if (e->waits_for_client)
        return telling_wrong(t, "the clock stands until somebody has opened a port (--wait-client)");
    engine_advance(e, e->now_us + span_us, until_idle);
    add_time(t);
    return true;
}

/* -- power, device, usb --------------------------------------------------------------------------------------------------- */

/* The switches are read when it goes on, so it is the panel's. */
static bool power(telling *t, bool on)
{
    if (on != (controller(t)->state == DR_STATE_OFF))
        return telling_wrong(t, on ? "it is on" : "it is off");
    dr_panel_power(&t->s->ins.panel, now(t), on);
    faults_look(&t->s->ins.faults, t->s->ins.now_us, controller(t));
    return true;
}

static bool do_power(telling *t)
{
    uint64_t span_us = 0;
    const bool off = telling_take(t, "off");
    if (!off && telling_take(t, "on"))
        return telling_ends(t) && power(t, true);
    if (!off && !telling_take(t, "cycle"))
        return telling_wrong(t, "expected off, on or cycle");
    bool forgets = telling_take(t, "forget");
    if (!off && !forgets && t->words[t->at] != NULL) {
        if (!telling_time(t, &span_us))
            return false;
        forgets = telling_take(t, "forget");
    }
    if (!telling_ends(t) || !power(t, false))
        return false;
    if (forgets)
        faults_forget_positions(&t->s->ins.faults, controller(t));
    if (off)
        return true;
    char line[LANGUAGE_LINE];
    (void)snprintf(line, sizeof line, "@%s power on", t->s->name);
    return span_us > 0 ? telling_later(t, t->s->ins.now_us + span_us, line, false) : power(t, true);
}

static bool do_device(telling *t)
{
    dr_hand hand = {.what = DR_HAND_CONNECT};
    char text[WHY_ROOM];
    dr_stage_id id = DR_STAGE_NONE;
    if (!read_port(t, false, &hand.drive))
        return false;
    uint8_t *const last = &t->s->unplugged[hand.drive];
    const uint8_t present = controller(t)->drives[hand.drive].stage;
    if (telling_take(t, "unplug")) {
        if (!telling_ends(t))
            return false;
        if (present == DR_STAGE_NONE)
            return telling_wrong(t, "nothing is plugged in there");
        if (!poke(t, &hand, "it cannot be unplugged"))
            return false;
        *last = present;
        return true;
    }
    if (!telling_take(t, "plug"))
        return telling_wrong(t, "expected plug or unplug");
    const char *const model = telling_next(t);
    if (model != NULL && !dr_words_stage_find((dr_kind)controller(t)->kind, model, &id)) {
        (void)dr_words_stages(text, sizeof text, (dr_kind)controller(t)->kind);
        return telling_wrong(t, "'%s': expected %.500s", model, text);
    }
    if (model != NULL && dr_words_fit(text, sizeof text, id, (dr_kind)controller(t)->kind, controller(t)->firmware,
                                      (uint8_t)(hand.drive + 1u)) > 0)
        return telling_wrong(t, "'%s': %.500s", model, text);
    if (!telling_ends(t))
        return false;
    hand.stage = model == NULL ? *last : (uint8_t)id;
    if (hand.stage == DR_STAGE_NONE)
        return telling_wrong(t, "which model? Nothing was unplugged there before");
    return poke(t, &hand, "it cannot be plugged in");
}

static bool do_usb(telling *t)
{
    uint64_t span_us = 0;
    if (telling_take(t, "plug"))
        return telling_ends(t) && engine_plug_station(t->l->e, t->s, t->why, sizeof t->why);
    if (!telling_take(t, "unplug"))
        return telling_wrong(t, "expected plug or unplug");
    if (t->words[t->at] != NULL && !telling_time(t, &span_us))
        return false;
    if (!telling_ends(t))
        return false;
    engine_unplug_station(t->l->e, t->s, span_us);
    return true;
}

/* -- set, quirk ----------------------------------------------------------------------------------------------------------- */

/* X,Y,Z for a drive; in a check, for one that may be in use or plugged in by then. */
static bool read_point(telling *t, uint8_t drive, bool is_active, uint32_t steps[DR_AXES])
{
    char why[WHY_ROOM] = "";
    const char *const word = telling_word(t);
    const uint8_t count = controller(t)->drive_count;
    bool is_any_connected = false;
    for (uint8_t i = t->is_check && is_active ? 0 : drive; i < (t->is_check && is_active ? count : drive + 1u); i++) {
        const dr_stage_id id = (dr_stage_id)controller(t)->drives[i].stage;
        if (id != DR_STAGE_NONE && values_point(word, id, steps, why))
            return true;
        is_any_connected = is_any_connected || id != DR_STAGE_NONE;
    }
    if (is_any_connected)
        return telling_about(t, word, why);
    return (t->is_check && *word != '\0') || telling_wrong(t, "there is no device at port %u", drive + 1u);
}

static bool set_position(telling *t)
{
    dr_hand hand = {.what = DR_HAND_PLACE};
    const bool is_active = !has_port(t);
    return read_port(t, true, &hand.drive) && read_point(t, hand.drive, is_active, hand.steps) && telling_ends(t) &&
           poke(t, &hand, "it moves or is off: nobody can turn it now");
}

static bool set_work(telling *t)
{
    uint8_t drive;
    uint32_t steps[DR_AXES];
    const bool is_active = !has_port(t);
    if (!read_port(t, true, &drive))
        return false;
    const bool is_none = telling_take(t, "none");
    if ((!is_none && !read_point(t, drive, is_active, steps)) || !telling_ends(t))
        return false;
    dr_drive *const d = &controller(t)->drives[drive];
    d->work_is_set = !is_none;
    if (!is_none)
        memcpy(d->work_steps, steps, sizeof steps);
    return true;
}

static bool set_home(telling *t)
{
    uint32_t steps[DR_AXES];
    if (controller(t)->kind != DR_TRIO)
        return telling_wrong(t, "an MPC-200 stores no home position, its home is 0,0,0");
    if (!read_point(t, 0, false, steps) || !telling_ends(t))
        return false;
    memcpy(controller(t)->home_steps, steps, sizeof steps);
    return true;
}

static bool set_angle(telling *t)
{
    char why[WHY_ROOM];
    const char *const word = telling_word(t);
    unsigned angle_deg;
    uint8_t diagonal;
    if (controller(t)->kind == DR_TRIO) {
        if (!values_number(word, 0, DR_ANGLE_MAX_DEG, &angle_deg, why))
            return telling_about(t, word, why);
        return telling_ends(t) && (dr_controller_apply(controller(t), now(t), DR_EFFECT_ANGLE, (uint8_t)angle_deg) ||
                                   telling_wrong(t, "it moves or is off: the angle cannot be set now"));
    }
    if (!values_diagonal(word, &diagonal, why))
        return telling_about(t, word, why);
    if (!telling_ends(t))
        return false;
    controller(t)->drives[controller(t)->active].diagonal = diagonal;
    for (uint8_t number = 1; number <= 4; number++) /* the switches stand so too, or a power cycle would undo it */
        (void)dr_panel_switch(&t->s->ins.panel, DR_SWITCHES_REAR, controller(t)->active, number,
                              ((unsigned)diagonal >> (number - 1u) & 1u) != 0);
    return true;
}

static bool set_mode(telling *t)
{
    char why[WHY_ROOM];
    unsigned mode;
    if (controller(t)->kind != DR_MPC)
        return telling_wrong(t, "a TRIO has no modes");
    const char *const word = telling_word(t);
    if (!values_number(word, 0, 9, &mode, why))
        return telling_about(t, word, why);
    return telling_ends(t) && (dr_controller_apply(controller(t), now(t), DR_EFFECT_MODE, (uint8_t)mode) ||
                               telling_wrong(t, "it moves or is off: the mode cannot be set now"));
}

static bool do_set(telling *t)
{
    static const struct {
        const char *name;
        bool (*set)(telling *t);
    } settings[] = {
        {"position", set_position}, {"work", set_work}, {"home", set_home}, {"angle", set_angle}, {"mode", set_mode}};
    for (size_t i = 0; i < sizeof settings / sizeof settings[0]; i++)
        if (telling_take(t, settings[i].name))
            return settings[i].set(t);
    return telling_wrong(t, "expected position, work, home, angle or mode");
}

static bool do_quirk(telling *t)
{
    char why[WHY_ROOM];
    const char *const name = telling_word(t);
    if (!setup_knows_quirk(&t->s->ins, name, why))
        return telling_about(t, name, why);
    const bool on = telling_take(t, "on");
    if (!on && !telling_take(t, "off"))
        return telling_wrong(t, "expected on or off behind the quirk");
    if (!telling_ends(t))
        return false;
    return setup_quirk(&t->s->ins, name, on, why) || telling_about(t, name, why);
}

/* -- trace, subscribe, quit ------------------------------------------------------------------------------------------------ */

static bool do_trace(telling *t)
{
    const bool on = telling_take(t, "on");
    if (!on && !telling_take(t, "off"))
        return telling_wrong(t, "expected on or off");
    if (t->l->trace == NULL)
        return telling_wrong(t, "there is no trace; --trace FILE opens one");
    if (!telling_ends(t))
        return false;
    t->l->trace->is_on = on;
    return true;
}

static bool do_subscribe(telling *t)
{
    t->follows = telling_ends(t);
    return t->follows;
}

static bool do_quit(telling *t)
{
    if (!telling_ends(t))
        return false;
    t->l->e->is_over = true;
    return true;
}

const verb verbs_rig[] = {
    {"state", "", "tell everything: the clock, and each controller with its devices", false, do_state},
    {"advance", "TIME | until idle [TIME]",
     "move the clock of --clock step or jump; 'until idle': an hour at most, or TIME", false, do_advance},
    {"power", "off [forget] | on | cycle [TIME] [forget]",
     "the mains switch; cycle: off, and on again at once or after TIME; forget: positions are lost", true, do_power},
    {"device", "N unplug | plug [MODEL]", "the device at port N", true, do_device},
    {"usb", "unplug [TIME] | plug", "the host's cable: its port hangs up and its link is gone; back after TIME", true,
     do_usb},
    {"set", "position|work [N] X,Y,Z | work [N] none | home X,Y,Z | angle DEG | mode 0-9",
     "as if by hand; N: the device at that port, else the active one", true, do_set},
    {"quirk", "NAME on|off", "behave as some real controllers do", true, do_quirk},
    {"trace", "on | off", "go on, or pause, with --trace", false, do_trace},
    {"subscribe", "", "a JSON line for everything that happens, from now on", false, do_subscribe},
    {"quit", "", "end the emulator; the command of `run` goes on without it", false, do_quit},
    {NULL, NULL, NULL, false, NULL}};
