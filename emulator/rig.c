#include "rig.h"

#include "textfile.h" /* columns, which libconfig does not know */

#include <libconfig.h>

#include <ctype.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    const char *path; /* of the file */
    const char *text; /* all of it, for columns */
    char *why;
    size_t room;
    bool is_paced_by_default;
} reading;

#define VALUE_MAX 256u /* a longer one is looked for by its beginning */

/* -- What is wrong, and where --------------------------------------------------------------------------------------------- */

static unsigned column_of(const reading *r, unsigned line, const char *word)
{
    return textfile_column(r->text, line, word);
}

/* A value is looked for with its quotation marks: "a" is no part of `name`. */
static unsigned column_of_value(const reading *r, unsigned line, const char *value)
{
    char quoted[VALUE_MAX];
    if (value == NULL || *value == '\0')
        return column_of(r, line, value);
    (void)snprintf(quoted, sizeof quoted, "\"%s\"", value);
    const unsigned column = column_of(r, line, quoted);
    return column == column_of(r, line, NULL) ? column_of(r, line, value) : column + 1u;
}

__attribute__((format(printf, 4, 5))) static bool wrong(const reading *r, unsigned line, unsigned column,
                                                        const char *format, ...)
{
    const int length = snprintf(r->why, r->room, "%s:%u:%u: ", r->path, line, column);
    va_list arguments;
    va_start(arguments, format);
    if (length >= 0 && (size_t)length < r->room)
        (void)vsnprintf(r->why + length, r->room - (size_t)length, format, arguments);
    va_end(arguments);
    return false;
}

static bool wrong_at(const reading *r, const config_setting_t *at, const char *what)
{
    const char *const name = config_setting_name(at);
    const unsigned line = config_setting_source_line(at);
    return wrong(r, line, column_of(r, line, name), "%s%s%s", name == NULL ? "" : name, name == NULL ? "" : ": ", what);
}

/* -- One controller ------------------------------------------------------------------------------------------------------ */

static bool read_list(const reading *r, const config_setting_t *from, const char **texts, unsigned most,
                      unsigned *count)
{
    const int type = config_setting_type(from);
    if (type == CONFIG_TYPE_STRING) {
        texts[0] = config_setting_get_string(from);
        *count = 1;
        return true;
    }
    if (type != CONFIG_TYPE_ARRAY && type != CONFIG_TYPE_LIST)
        return wrong_at(r, from, "expected texts: [ \"...\", \"...\" ]");
    *count = 0;
    for (int i = 0; i < config_setting_length(from); i++) {
        const char *const text = config_setting_get_string_elem(from, i);
        if (text == NULL)
            return wrong_at(r, from, "expected texts in quotation marks");
        if (*count == most) {
            const char *const name = config_setting_name(from);
            const unsigned line = config_setting_source_line(from);
            return wrong(r, line, column_of(r, line, name), "%s: %u are too many, %u at most", name, *count + 1u, most);
        }
        texts[(*count)++] = text;
    }
    return true;
}

/* Where the lines of `do` stand, for what is found wrong with them later. */
static bool note_places(const reading *r, const config_setting_t *entry, rig_member *member)
{
    const bool is_list = config_setting_is_aggregate(entry) == CONFIG_TRUE;
    for (unsigned i = 0; strcmp(config_setting_name(entry), "do") == 0 && i < member->do_count; i++) {
        member->do_line[i] = config_setting_source_line(is_list ? config_setting_get_elem(entry, i) : entry);
        member->do_column[i] = column_of_value(r, member->do_line[i], member->do_[i]);
    }
    return true;
}

static bool read_entry(const reading *r, const config_setting_t *entry, rig_member *member, setup_text *t,
                       const char **name)
{
    const char *const key = config_setting_name(entry);
    const struct {
        const char *key;
        const char **text;
    } one[] = {{"name", name},
               {"controller", &t->controller},
               {"link", &member->link},
               {"firmware", &t->firmware},
               {"scenario", &member->scenario},
               {"state", &t->state},
               {"home", &t->home},
               {"angle", &t->angle},
               {"quirks", &t->quirks},
               {"pace", &t->pace}};
    const struct {
        const char *key;
        const char **texts;
        unsigned most, *count;
    } many[] = {{"devices", t->devices, DR_PORTS, &t->device_count},
                {"positions", t->positions, DR_PORTS, &t->position_count},
                {"works", t->works, DR_PORTS, &t->work_count},
                {"do", member->do_, RIG_DO_MAX, &member->do_count}};
    for (size_t i = 0; i < sizeof one / sizeof one[0]; i++)
        if (strcmp(key, one[i].key) == 0) {
            *one[i].text = config_setting_get_string(entry);
            return *one[i].text != NULL || wrong_at(r, entry, "expected a text in quotation marks");
        }
    for (size_t i = 0; i < sizeof many / sizeof many[0]; i++)
        if (strcmp(key, many[i].key) == 0)
            return read_list(r, entry, many[i].texts, many[i].most, many[i].count) && note_places(r, entry, member);
    return wrong_at(r, entry,
                    "there is no such entry; expected name, controller, link, firmware, devices, positions, works, "
                    "home, angle, quirks, pace, scenario, state or do");
}

static bool is_name(const char *name)
{
    const size_t length = strlen(name);
    if (length == 0 || length >= RIG_NAME_MAX || isdigit((unsigned char)name[0]))
        return false;
    for (; *name != '\0'; name++)
        if (!isalnum((unsigned char)*name) && *name != '_')
            return false;
    return true;
}

static unsigned line_of(const config_setting_t *controller, const char *key)
{
    const config_setting_t *const at = config_setting_get_member(controller, key);
    return config_setting_source_line(at == NULL ? controller : at);
}

/* Links and state files have one owner. */
static bool is_its_own(const reading *r, const config_setting_t *from, const char *key, const char *path,
                       const char *others_path, const char *other)
{
    const unsigned line = line_of(from, key);
    return path == NULL || others_path == NULL || strcmp(path, others_path) != 0 ||
           wrong(r, line, column_of_value(r, line, path), "%s %s: '%s' has it already", key, path, other);
}

static bool read_member(const reading *r, rig *so_far, const config_setting_t *from)
{
    rig_member *const member = &so_far->members[so_far->count];
    const unsigned line = config_setting_source_line(from);
    setup_text t;
    setup_problem problem;
    const char *name = NULL;
    memset(&t, 0, sizeof t);
    if (config_setting_type(from) != CONFIG_TYPE_GROUP)
        return wrong(r, line, column_of(r, line, NULL),
                     "expected a controller: { name = \"left\"; controller = \"mpc\"; }");
    for (int i = 0; i < config_setting_length(from); i++)
        if (!read_entry(r, config_setting_get_elem(from, (unsigned)i), member, &t, &name))
            return false;
    if (t.controller == NULL)
        return wrong(r, line, column_of(r, line, NULL),
                     "this one says not what it is: controller = \"trio\"; or \"mpc\"");
    if (name == NULL)
        name = t.controller;
    const unsigned name_line = line_of(from, "name");
    if (!is_name(name))
        return wrong(
            r, name_line, column_of_value(r, name_line, name),
            "'%s' is no name: expected up to %u letters, digits and _, a letter first (a program finds the port "
            "in DRYRIG_PORT_<name>)",
            name, RIG_NAME_MAX - 1u);
    for (unsigned i = 0; i < so_far->count; i++)
        if (strcmp(name, so_far->members[i].name) == 0)
            return wrong(r, name_line, column_of_value(r, name_line, name), "'%s' is the name of another one already",
                         name);
    (void)snprintf(member->name, sizeof member->name, "%s", name);
    for (unsigned i = 0; i < so_far->count; i++)
        if (!is_its_own(r, from, "link", member->link, so_far->members[i].link, so_far->members[i].name) ||
            !is_its_own(r, from, "state", t.state, so_far->members[i].setup.state, so_far->members[i].name))
            return false;
    if (setup_read(&t, r->is_paced_by_default, &member->setup, &problem)) {
        so_far->count++;
        return true;
    }
    static const char *const plural[] = {"device", "position", "work"}; /* as the file calls them */
    char key[16];
    (void)snprintf(key, sizeof key, "%s", problem.what);
    for (size_t i = 0; i < sizeof plural / sizeof plural[0]; i++)
        if (strcmp(problem.what, plural[i]) == 0)
            (void)snprintf(key, sizeof key, "%ss", problem.what);
    const config_setting_t *at = config_setting_get_member(from, key);
    if (at != NULL && config_setting_is_aggregate(at) && config_setting_get_elem(at, problem.index) != NULL)
        at = config_setting_get_elem(at, problem.index);
    const unsigned at_line = at == NULL ? line : config_setting_source_line(at);
    return wrong(r, at_line, column_of_value(r, at_line, problem.text), "%s %s: %s", problem.what,
                 problem.text == NULL ? "" : problem.text, problem.why);
}

/* -- The file ------------------------------------------------------------------------------------------------------------ */

static bool read_controllers(const reading *r, const config_t *config, rig *result)
{
    const config_setting_t *const root = config_root_setting(config);
    const config_setting_t *const list = config_lookup(config, "controllers");
    for (unsigned i = 0; i < (unsigned)config_setting_length(root); i++)
        if (config_setting_get_elem(root, i) != list)
            return wrong_at(r, config_setting_get_elem(root, i), "there is no such entry; expected controllers");
    if (list == NULL)
        return wrong(r, 1, 1, "no controllers in it: expected controllers = ( { controller = \"mpc\"; } );");
    if (config_setting_type(list) != CONFIG_TYPE_LIST || config_setting_length(list) == 0)
        return wrong_at(r, list, "expected a list: ( { ... }, { ... } )");
    const unsigned count = (unsigned)config_setting_length(list);
    if (count > RIG_MAX)
        return wrong(r, config_setting_source_line(list), 1, "%u controllers are too many, %u at most", count, RIG_MAX);
    result->count = 0;
    result->members = calloc(count, sizeof *result->members);
    if (result->members == NULL)
        return wrong(r, 1, 1, "no memory");
    for (unsigned i = 0; i < count; i++)
        if (!read_member(r, result, config_setting_get_elem(list, i)))
            return false;
    return true;
}

bool rig_read(rig *result, const char *path, bool is_paced_by_default, char *why, size_t room)
{
    static config_t config; /* holds the texts */
    char *const text = textfile_read(path);
    const reading r = {path, text, why, room, is_paced_by_default};
    if (text == NULL) {
        (void)snprintf(why, room, "%s: %s", path, textfile_why());
        return false;
    }
    config_init(&config);
    const bool done =
        config_read_string(&config, text) == CONFIG_TRUE
            ? read_controllers(&r, &config, result)
            : wrong(&r, (unsigned)config_error_line(&config), column_of(&r, (unsigned)config_error_line(&config), NULL),
                    "%s; 'man dryrig-emu' shows a rig file", config_error_text(&config));
    free(text);
    return done;
}

bool rig_of_one(rig *r, const setup *s, const char *link)
{
    r->members = calloc(1, sizeof *r->members);
    r->count = 1;
    if (r->members == NULL)
        return false;
    (void)snprintf(r->members[0].name, RIG_NAME_MAX, "%s", s->kind == DR_TRIO ? "trio" : "mpc");
    r->members[0].link = link;
    r->members[0].setup = *s;
    return true;
}
