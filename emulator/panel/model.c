#include "model.h"

#include "dr_wire.h"  /* dr_wire_put_reply */
#include "dr_words.h" /* names of stages and controllers */

#include <cjson/cJSON.h>
#include <stdio.h>
#include <string.h>

/* -- Reading JSON -------------------------------------------------------------------------------------------------------- */

static const cJSON *get(const cJSON *from, const char *key) { return cJSON_GetObjectItemCaseSensitive(from, key); }

static void take_text(const cJSON *from, const char *key, char *out, size_t room)
{
    const char *const text = cJSON_GetStringValue(get(from, key));
    (void)snprintf(out, room, "%s", text == NULL ? "" : text);
}

static bool is_true(const cJSON *from, const char *key) { return cJSON_IsTrue(get(from, key)) != 0; }

/* A whole number that is not negative. */
static uint64_t number(const cJSON *from, const char *key)
{
    const cJSON *const item = get(from, key);
    return cJSON_IsNumber(item) && item->valuedouble >= 0 && item->valuedouble < 1e18 ? (uint64_t)item->valuedouble : 0;
}

static bool take_point(const cJSON *from, const char *key, uint32_t steps[DR_AXES])
{
    const cJSON *const list = get(from, key);
    uint32_t at_steps[DR_AXES];
    for (int axis = 0; axis < (int)DR_AXES; axis++) {
        const cJSON *const item = cJSON_GetArrayItem(list, axis);
        if (!cJSON_IsNumber(item) || item->valuedouble < 0 || item->valuedouble > UINT32_MAX)
            return false;
        at_steps[axis] = (uint32_t)item->valuedouble;
    }
    memcpy(steps, at_steps, sizeof at_steps);
    return true;
}

/* -- Where a device has been --------------------------------------------------------------------------------------------- */

static void add_corner(model_device *d, const uint32_t steps[DR_AXES])
{
    if (d->path_count > 0 &&
        memcmp(d->path_steps[(d->path_first + d->path_count - 1) % MODEL_PATH], steps, sizeof d->path_steps[0]) == 0)
        return;
    if (d->path_count == MODEL_PATH) {
        d->path_first = (d->path_first + 1) % MODEL_PATH;
        d->path_count--;
    }
    memcpy(d->path_steps[(d->path_first + d->path_count++) % MODEL_PATH], steps, sizeof d->path_steps[0]);
}

/* A leg that begins is the end of the one before; what ends a move says where. */
static void follow(model *m, const cJSON *event, const char *note)
{
    const uint64_t device = number(event, "device");
    uint32_t steps[DR_AXES];
    if (device < 1 || device > DR_PORTS || !take_point(event, "steps", steps))
        return;
    model_device *const d = &m->devices[device - 1];
    if (d->is_on_leg)
        add_corner(d, d->leg_to_steps);
    d->is_on_leg = strcmp(note, "leg") == 0;
    if (d->is_on_leg)
        memcpy(d->leg_to_steps, steps, sizeof steps);
    else if (strcmp(note, "resumed") != 0)
        add_corner(d, steps);
}

/* -- Events -------------------------------------------------------------------------------------------------------------- */

static model_entry *add_entry(model *m, uint64_t when_us, model_side side)
{
    if (m->log_count == MODEL_LOG) {
        m->log_first = (m->log_first + 1) % MODEL_LOG;
        m->log_count--;
    }
    model_entry *const entry = &m->log[(m->log_first + m->log_count++) % MODEL_LOG];
    *entry = (model_entry){.when_us = when_us, .side = side};
    return entry;
}

void model_say(model *m, const char *text)
{
    (void)snprintf(add_entry(m, m->now_us, MODEL_HAPPENED)->text, MODEL_TEXT, "%s", text);
}

/* What a note is about. Frames of a stream, and detents of a knob, would drive everything else out. */
static void take_note(model *m, const cJSON *event, const char *note)
{
    const bool is_stream = strcmp(note, "stream") == 0;
    const bool is_from_host =
        strcmp(note, "request") == 0 || strcmp(note, "unknown") == 0 || strcmp(note, "filler") == 0;
    const bool is_to_host = is_stream || strcmp(note, "reply") == 0;
    const model_side side = is_from_host ? MODEL_FROM_HOST : is_to_host ? MODEL_TO_HOST : MODEL_HAPPENED;
    const bool gathers = is_stream || strcmp(note, "placed") == 0;
    const model_entry *const last = model_entry_at(m, 0);
    if (gathers && last != NULL && strcmp(last->gathers, note) == 0)
        m->log_count--;
    model_entry *const entry = add_entry(m, number(event, "when_us"), side);
    (void)snprintf(entry->gathers, sizeof entry->gathers, "%s", gathers ? note : "");
    if (side != MODEL_HAPPENED)
        take_text(event, "bytes", entry->hex, sizeof entry->hex);
    take_text(event, "text", entry->text, sizeof entry->text);
    follow(m, event, note);
}

static void take_event(model *m, const cJSON *event, const char *what)
{
    const char *const name = cJSON_GetStringValue(get(event, "controller"));
    if (name == NULL || strcmp(name, m->name) != 0)
        return;
    const char *const note = cJSON_GetStringValue(get(event, "note"));
    const char *const text = cJSON_GetStringValue(get(event, "text"));
    if (strcmp(what, "note") == 0 && note != NULL)
        take_note(m, event, note);
    else if (text != NULL)
        take_text(event, "text", add_entry(m, number(event, "when_us"), MODEL_HAPPENED)->text, MODEL_TEXT);
}

/* -- Answers ------------------------------------------------------------------------------------------------------------- */

static void take_device(model *m, unsigned i, const cJSON *device)
{
    model_device *const d = &m->devices[i];
    dr_stage_id id = DR_STAGE_NONE;
    char name[MODEL_NAME];
    take_text(device, "model", name, sizeof name);
    if (strcmp(name, d->name) != 0) /* another one: it has been nowhere yet */
        *d = (model_device){.is_there = false};
    memcpy(d->name, name, sizeof name);
    d->is_there = dr_words_stage_find(m->kind, name, &id) && dr_stage_get(id, &d->stage) &&
                  take_point(device, "position_steps", d->at_steps);
    d->work_is_set = take_point(device, "work_steps", d->work_steps);
    if (d->is_there && d->path_count == 0)
        add_corner(d, d->at_steps);
}

static bool take_controller(model *m, const cJSON *c)
{
    char kind[16];
    const cJSON *const devices = get(c, "devices");
    take_text(c, "controller", kind, sizeof kind);
    if (!dr_words_kind_find(kind, &m->kind))
        return false;
    take_text(c, "name", m->name, sizeof m->name);
    take_text(c, "firmware", m->firmware, sizeof m->firmware);
    take_text(c, get(c, "link") != NULL ? "link" : "port", m->port, sizeof m->port);
    take_text(c, "state", m->state, sizeof m->state);
    m->is_open = is_true(c, "is_open");
    m->angle_deg = (unsigned)number(c, "angle_deg");
    (void)take_point(c, "home_steps", m->home_steps);
    m->device_count = 0;
    for (int i = 0; i < (int)DR_PORTS && cJSON_GetArrayItem(devices, i) != NULL; i++)
        take_device(m, m->device_count++, cJSON_GetArrayItem(devices, i));
    const uint64_t active = number(c, "active");
    m->active = active >= 1 && active <= m->device_count ? (unsigned)active - 1u : 0;
    m->is_known = m->device_count > 0;
    return true;
}

/* The controllers of a rig, or the one that was asked for. */
static bool take_state(model *m, const cJSON *answer, char next[MODEL_NAME])
{
    const cJSON *const list = get(answer, "controllers");
    const int count = cJSON_GetArraySize(list);
    bool done = false;
    take_text(answer, "clock", m->clock, sizeof m->clock);
    m->waits_for_client = is_true(answer, "waits_for_client");
    m->now_us = number(answer, "now_us");
    for (int i = 0; i < count; i++) {
        const cJSON *const c = cJSON_GetArrayItem(list, i);
        const char *const name = cJSON_GetStringValue(get(c, "name"));
        if (done || name == NULL || (m->name[0] != '\0' && strcmp(name, m->name) != 0))
            continue;
        done = take_controller(m, c);
        if (next != NULL)
            take_text(cJSON_GetArrayItem(list, (i + 1) % count), "name", next, MODEL_NAME);
    }
    if (count > 1)
        m->controllers = (unsigned)count;
    return done;
}

static void take_panel(model *m, const cJSON *answer)
{
    static const char *const colours[MODEL_COLOURS] = {"dark", "plain", "green", "blue", "red"};
    char colour[16];
    const cJSON *button;
    take_text(answer, "screen", colour, sizeof colour);
    m->colour = MODEL_DARK;
    for (unsigned i = 0; i < MODEL_COLOURS; i++)
        if (strcmp(colour, colours[i]) == 0)
            m->colour = (model_colour)i;
    take_text(answer, "text", m->text, sizeof m->text);
    m->is_locked = is_true(answer, "locked");
    m->is_relative = is_true(answer, "relative");
    m->sets_angle = is_true(answer, "setting_angle");
    m->led_diagonal = is_true(get(answer, "leds"), "diagonal");
    m->moves = cJSON_IsString(get(answer, "moving")) != 0;
    m->mode = (unsigned)number(answer, m->kind == DR_TRIO ? "speed" : "mode");
    m->beeps = (unsigned)number(answer, "beeps");
    size_t length = (size_t)snprintf(m->down, sizeof m->down, " ");
    cJSON_ArrayForEach(button, get(answer, "down"))
    {
        if (cJSON_IsString(button) && length < sizeof m->down)
            length += (size_t)snprintf(m->down + length, sizeof m->down - length, "%s ", button->valuestring);
    }
    m->is_shown = true;
}

model_line model_take(model *m, const char *line, char why[MODEL_TEXT], char next[MODEL_NAME])
{
    model_line what = MODEL_NOTHING;
    if (strncmp(line, "{\"event\":\"to-host\"", 18) == 0) /* its notes tell the same, and these are many */
        return MODEL_EVENT;
    cJSON *const object = cJSON_Parse(line);
    const char *const event = cJSON_GetStringValue(get(object, "event"));
    if (event != NULL) {
        take_event(m, object, event);
        what = MODEL_EVENT;
    } else if (cJSON_IsFalse(get(object, "ok"))) {
        take_text(object, "why", why, MODEL_TEXT);
        what = MODEL_REFUSED;
    } else if (get(object, "controllers") != NULL) {
        what = take_state(m, object, next) ? MODEL_STATE : MODEL_REFUSED;
        if (what == MODEL_REFUSED)
            (void)snprintf(why, MODEL_TEXT, "there is no controller '%s'", m->name);
    } else if (get(object, "screen") != NULL) {
        take_panel(m, object);
        what = MODEL_PANEL;
    } else if (is_true(object, "ok")) {
        what = MODEL_DONE;
    }
    cJSON_Delete(object);
    return what;
}

/* -- Asking -------------------------------------------------------------------------------------------------------------- */

void model_init(model *m, const char *name)
{
    memset(m, 0, sizeof *m);
    m->controllers = 1;
    (void)snprintf(m->name, sizeof m->name, "%s", name);
}

void model_choose(model *m, const char *name)
{
    const unsigned controllers = m->controllers;
    char copy[MODEL_NAME];
    (void)snprintf(copy, sizeof copy, "%s", name);
    model_init(m, copy);
    m->controllers = controllers;
}

double model_um(const model_device *d, uint32_t steps)
{
    return (double)steps * d->stage.quanta_per_step / (double)DR_QUANTA_PER_UM;
}

const model_device *model_active(const model *m) { return &m->devices[m->active]; }

const model_entry *model_entry_at(const model *m, unsigned n)
{
    return n < m->log_count ? &m->log[(m->log_first + m->log_count - 1u - n) % MODEL_LOG] : NULL;
}

void model_position_answer(const model *m, char out[64])
{
    const model_device *const d = model_active(m);
    const bool is_trio = m->kind == DR_TRIO;
    dr_reply reply = {.value = (uint8_t)(is_trio ? m->angle_deg : m->active + 1u)};
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        reply.steps[axis] = d->at_steps[axis];
    dr_command query; /* the same in every firmware */
    uint8_t bytes[DR_REPLY_MAX];
    size_t length = 0;
    (void)dr_command_for(m->kind, DR_FIRMWARE_FIRST, is_trio ? DR_OP_TRIO_POSITION : DR_OP_MPC_POSITION, &query);
    const size_t count = dr_wire_put_reply(&query, &reply, bytes);
    for (size_t i = 0; i < count; i++)
        length += (size_t)snprintf(out + length, 64 - length, i == 0 ? "%02X" : " %02X", bytes[i]);
}
