/* What is kept, as text: kept_read() and kept_print(). */
#include "kept_text.h"

#include "textfile.h" /* columns, which libconfig does not know */

#include "dr_words.h" /* names of controllers and stages */

#include <libconfig.h>

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#define VERSION 1
#define CALIBRATIONS 3u

static const char *const calibrations[CALIBRATIONS] = {"calibrated", "uncalibrated", "uncalibrated, power-cycled"};

static unsigned ports_of(dr_kind kind) { return kind == DR_TRIO ? 1u : DR_PORTS; }
static unsigned rear_of(dr_kind kind) { return kind == DR_TRIO ? 6u : 8u; }
static const char *inside_of(dr_kind kind) { return kind == DR_TRIO ? "internal" : "roe"; }

/* -- Writing ----------------------------------------------------------------------------------------------------------- */

static void print_point(FILE *file, const char *key, const uint32_t steps[DR_AXES])
{
    (void)fprintf(file, "%s = [ %lu, %lu, %lu ];", key, (unsigned long)steps[DR_X], (unsigned long)steps[DR_Y],
                  (unsigned long)steps[DR_Z]);
}

static void print_switches(FILE *file, const char *key, uint8_t bits, unsigned count)
{
    (void)fprintf(file, "%s = [ ", key);
    for (unsigned i = 0; i < count; i++)
        (void)fprintf(file, "%s%u", i == 0 ? "" : ", ", (unsigned)bits >> i & 1u);
    (void)fprintf(file, " ];");
}

void kept_print(FILE *file, const kept_state *k)
{
    (void)fprintf(file,
                  "# What a controller keeps, written by dryrig-emu --state. Microsteps; switches from number 1 on.\n"
                  "dryrig_state = %d;\ncontroller = \"%s\";\n",
                  VERSION, dr_words_kind(k->kind));
    if (k->kind == DR_TRIO) {
        print_point(file, "home", k->home_steps);
        (void)fprintf(file, "\nangle = %u;\n", (unsigned)k->angle_deg);
    }
    print_switches(file, inside_of(k->kind), k->inside, 4);
    (void)fprintf(file, "\ndevices = (\n");
    for (unsigned i = 0; i < ports_of(k->kind); i++) {
        const kept_drive *const d = &k->drives[i];
        (void)fprintf(file, "%s    { model = \"%s\";", i == 0 ? "" : ",\n", dr_words_stage((dr_stage_id)d->stage));
        if (d->stage != DR_STAGE_NONE) {
            print_point(file, " position", d->position_steps);
            if (d->work_is_set)
                print_point(file, " work", d->work_steps);
            (void)fprintf(file, " calibration = \"%s\";", calibrations[d->calibration % CALIBRATIONS]);
        }
        print_switches(file, "\n      rear", d->rear, rear_of(k->kind));
        if (k->kind == DR_MPC)
            print_switches(file, " right", d->right, 1);
        (void)fprintf(file, " }");
    }
    (void)fprintf(file, "\n);\n");
}

/* -- Reading ----------------------------------------------------------------------------------------------------------- */

typedef struct {
    const char *path, *text;
    char *why;
} reading;

__attribute__((format(printf, 4, 5))) static bool wrong(const reading *r, unsigned line, const char *word,
                                                        const char *format, ...)
{
    const int length = snprintf(r->why, WHY_ROOM, "%s:%u:%u: ", r->path, line, textfile_column(r->text, line, word));
    va_list arguments;
    va_start(arguments, format);
    if (length >= 0 && (size_t)length < WHY_ROOM)
        (void)vsnprintf(r->why + length, WHY_ROOM - (size_t)length, format, arguments);
    va_end(arguments);
    return false;
}

static bool wrong_at(const reading *r, const config_setting_t *at, const char *expected)
{
    const char *const name = config_setting_name(at);
    return wrong(r, config_setting_source_line(at), name, "%s%sexpected %s", name == NULL ? "" : name,
                 name == NULL ? "" : ": ", expected);
}

/* An entry that must be there. */
static const config_setting_t *need(const reading *r, const config_setting_t *from, const char *key)
{
    const config_setting_t *const found = config_setting_get_member(from, key);
    if (found == NULL)
        (void)wrong(r, config_setting_is_root(from) ? 1 : config_setting_source_line(from), NULL, "%s is missing", key);
    return found;
}

/* Nothing may be there that means nothing. keys: with a blank before and behind each. */
static bool has_only(const reading *r, const config_setting_t *from, const char *keys)
{
    for (int i = 0; i < config_setting_length(from); i++) {
        char key[64];
        const config_setting_t *const entry = config_setting_get_elem(from, (unsigned)i);
        (void)snprintf(key, sizeof key, " %s ", config_setting_name(entry));
        if (strstr(keys, key) == NULL)
            return wrong(r, config_setting_source_line(entry), config_setting_name(entry),
                         "%s: there is no such entry; expected%.*s", config_setting_name(entry), (int)strlen(keys) - 1,
                         keys);
    }
    return true;
}

/* So many whole numbers of 0 to most[]. */
static bool read_numbers(const reading *r, const config_setting_t *from, const char *key, unsigned count,
                         const uint32_t *most, uint32_t *numbers)
{
    const config_setting_t *const list = need(r, from, key);
    if (list == NULL)
        return false;
    const bool is_one = count == 1 && config_setting_type(list) == CONFIG_TYPE_INT;
    if (!is_one && (!config_setting_is_aggregate(list) || (unsigned)config_setting_length(list) != count))
        return wrong(r, config_setting_source_line(list), key, "%s: expected %u numbers: [ ... ]", key, count);
    for (unsigned i = 0; i < count; i++) {
        const config_setting_t *const entry = is_one ? list : config_setting_get_elem(list, i);
        const int value = config_setting_get_int(entry);
        if (config_setting_type(entry) != CONFIG_TYPE_INT || value < 0 || (uint32_t)value > most[i])
            return wrong(r, config_setting_source_line(entry), key,
                         "%s: expected whole numbers, number %u from 0 to %lu", key, i + 1u, (unsigned long)most[i]);
        numbers[i] = (uint32_t)value;
    }
    return true;
}

static bool read_switches(const reading *r, const config_setting_t *from, const char *key, unsigned count,
                          uint8_t *bits)
{
    static const uint32_t most[8] = {1, 1, 1, 1, 1, 1, 1, 1};
    uint32_t numbers[8] = {0};
    if (!read_numbers(r, from, key, count, most, numbers))
        return false;
    *bits = 0;
    for (unsigned i = 0; i < count; i++)
        *bits = (uint8_t)(*bits | numbers[i] << i);
    return true;
}

static const char *read_text(const reading *r, const config_setting_t *from, const char *key)
{
    const config_setting_t *const entry = need(r, from, key);
    const char *const text = entry == NULL ? NULL : config_setting_get_string(entry);
    if (entry != NULL && text == NULL)
        (void)wrong_at(r, entry, "a text in quotation marks");
    return text;
}

static bool read_calibration(const reading *r, const config_setting_t *from, uint8_t *calibration)
{
    const char *const text = read_text(r, from, "calibration");
    for (uint8_t i = 0; text != NULL && i < CALIBRATIONS; i++)
        if (strcmp(text, calibrations[i]) == 0) {
            *calibration = i;
            return true;
        }
    return text != NULL && wrong_at(r, config_setting_get_member(from, "calibration"),
                                    "calibrated, uncalibrated, or 'uncalibrated, power-cycled'");
}

static bool read_device(const reading *r, const config_setting_t *from, dr_kind kind, kept_drive *d)
{
    if (config_setting_type(from) != CONFIG_TYPE_GROUP)
        return wrong_at(r, from, "a device: { model = \"...\"; ... }");
    const char *const model = read_text(r, from, "model");
    dr_stage_id id = DR_STAGE_NONE;
    dr_stage stage;
    if (model == NULL)
        return false;
    if ((strcmp(model, "none") != 0 || kind == DR_TRIO) && !dr_words_stage_find(kind, model, &id)) {
        char names[512];
        (void)dr_words_stages(names, sizeof names, kind);
        return wrong_at(r, config_setting_get_member(from, "model"), names);
    }
    d->stage = (uint8_t)id;
    if (!read_switches(r, from, "rear", rear_of(kind), &d->rear) ||
        (kind == DR_MPC && !read_switches(r, from, "right", 1, &d->right)))
        return false;
    if (!dr_stage_get(id, &stage))
        return has_only(r, from, " model rear right ");
    d->work_is_set = config_setting_get_member(from, "work") != NULL;
    return read_numbers(r, from, "position", DR_AXES, stage.travel_steps, d->position_steps) &&
           (!d->work_is_set || read_numbers(r, from, "work", DR_AXES, stage.travel_steps, d->work_steps)) &&
           read_calibration(r, from, &d->calibration) &&
           has_only(r, from,
                    kind == DR_TRIO ? " model position work calibration rear "
                                    : " model position work calibration rear right ");
}

static bool read_devices(const reading *r, const config_setting_t *root, kept_state *k)
{
    const unsigned count = ports_of(k->kind);
    const config_setting_t *const list = need(r, root, "devices");
    if (list == NULL)
        return false;
    if (config_setting_type(list) != CONFIG_TYPE_LIST || (unsigned)config_setting_length(list) != count)
        return wrong(r, config_setting_source_line(list), "devices", "devices: expected a list of %u: ( { ... } )",
                     count);
    for (unsigned i = 0; i < count; i++)
        if (!read_device(r, config_setting_get_elem(list, i), k->kind, &k->drives[i]))
            return false;
    return true;
}

static bool read_root(const reading *r, const config_setting_t *root, kept_state *k)
{
    static const uint32_t angle_most[1] = {DR_ANGLE_MAX_DEG};
    const config_setting_t *const version = config_setting_get_member(root, "dryrig_state");
    uint32_t angle_deg[1] = {0};
    dr_stage stage;
    if (version == NULL || config_setting_type(version) != CONFIG_TYPE_INT)
        return wrong(r, 1, NULL, "this is no state of a controller: dryrig_state = %d; is missing. It stays as it is",
                     VERSION);
    if (config_setting_get_int(version) != VERSION)
        return wrong_at(r, version, "version 1; another version of dryrig-emu has written this");
    const char *const controller = read_text(r, root, "controller");
    if (controller == NULL)
        return false;
    if (!dr_words_kind_find(controller, &k->kind))
        return wrong_at(r, config_setting_get_member(root, "controller"), "trio or mpc");
    if (!read_switches(r, root, inside_of(k->kind), 4, &k->inside) || !read_devices(r, root, k))
        return false;
    if (k->kind == DR_MPC)
        return has_only(r, root, " dryrig_state controller roe devices ");
    (void)dr_stage_get((dr_stage_id)k->drives[0].stage, &stage);
    if (!read_numbers(r, root, "home", DR_AXES, stage.travel_steps, k->home_steps) ||
        !read_numbers(r, root, "angle", 1, angle_most, angle_deg))
        return false;
    k->angle_deg = (uint8_t)angle_deg[0];
    return has_only(r, root, " dryrig_state controller home angle internal devices ");
}

bool kept_read(const char *path, kept_state *out, bool *is_there, char why[WHY_ROOM])
{
    config_t config;
    memset(out, 0, sizeof *out);
    *is_there = access(path, F_OK) == 0;
    char *const text = *is_there ? textfile_read(path) : NULL;
    const reading r = {path, text, why};
    if (text == NULL && *is_there)
        (void)snprintf(why, WHY_ROOM, "%s: %s", path, textfile_why());
    if (text == NULL)
        return !*is_there;
    config_init(&config);
    const bool done = config_read_string(&config, text) == CONFIG_TRUE
                          ? read_root(&r, config_root_setting(&config), out)
                          : wrong(&r, (unsigned)config_error_line(&config), NULL,
                                  "%s: this is no state of a controller, or it is damaged. It stays as it is",
                                  config_error_text(&config));
    config_destroy(&config);
    free(text);
    return done;
}
