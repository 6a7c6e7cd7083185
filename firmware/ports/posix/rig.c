#include "rig.h"

#include "image.h"

#include "dr_judge.h" /* dr_judge_place */
#include "dr_words.h" /* names of stages and controllers */

#include <errno.h>
#include <libconfig.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FORMAT 1
#define FILE_MAX 65536u
#define DIGITS_MAX 9u
#define FAR_UM ((double)DR_FAR_Q / DR_QUANTA_PER_UM)
#define SLOW_LEVEL 3u /* below a surface, where nothing else is said */

/* The first problem counts; what is read after it is not used. */
typedef struct {
    const char *path;
    char *why;
    size_t room;
    bool failed;
    rig *out;
    config_setting_t *drives[DR_PORTS]; /* where a drive, an obstacle is told: for errors */
    config_setting_t *obstacles[DR_OBSTACLES_MAX];
} reader;

__attribute__((format(printf, 3, 4))) static void fail_at(reader *r, unsigned line, const char *format, ...)
{
    va_list arguments;
    if (r->failed)
        return;
    r->failed = true;
    const int used =
        line > 0 ? snprintf(r->why, r->room, "%s:%u: ", r->path, line) : snprintf(r->why, r->room, "%s: ", r->path);
    if (used < 0 || (size_t)used >= r->room)
        return;
    va_start(arguments, format);
    (void)vsnprintf(r->why + used, r->room - (size_t)used, format, arguments);
    va_end(arguments);
}

static unsigned line_of(const config_setting_t *at)
{
    return config_setting_is_root(at) ? 1u : config_setting_source_line(at);
}

/* -- What libconfig lets pass ------------------------------------------------------------------------------------------ */

/* libconfig folds numbers that do not fit into others without a word, reads further files, and loses memory over a text
 * without its end: none of that is for a guard. */

static bool in_word(char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' || c == '-'; }

static void check_number(reader *r, const char *number, size_t digits, unsigned line, bool is_fraction)
{
    if (digits > DIGITS_MAX && !is_fraction)
        fail_at(r, line, "the number %.20s has more than %u digits before its point", number, DIGITS_MAX);
    else if (number[digits] == 'x' || number[digits] == 'X' || number[digits] == 'L')
        fail_at(r, line, "numbers are decimal, without a letter: %.12s", number);
}

/* What begins here and is no number, as far as it has to be looked at together: how long it is. */
static size_t length_of_piece(reader *r, const char *at, unsigned line)
{
    size_t length = 1;
    if (*at == '@') {
        fail_at(r, line, "no other file can be included: a configuration is one file");
    } else if (*at == '"') {
        while (at[length] != '\0' && at[length] != '"')
            length += at[length] == '\\' && at[length + 1] != '\0' ? 2 : 1;
        if (at[length] == '\0')
            fail_at(r, line, "the text that begins here has no quotation mark at its end");
        else
            length++;
    } else if (*at == '#' || (at[0] == '/' && at[1] == '/')) {
        length = strcspn(at, "\n");
    } else if (at[0] == '/' && at[1] == '*') {
        const char *const end = strstr(at + 2, "*/");
        if (end == NULL)
            fail_at(r, line, "the comment that begins here has no end");
        else
            length = (size_t)(end - at) + 2;
    }
    return length;
}

static void check_text(reader *r, const char *text)
{
    unsigned line = 1;
    char before = '\0';
    for (const char *at = text; *at != '\0' && !r->failed;) {
        const size_t digits = strspn(at, "0123456789");
        const size_t length = digits > 0 ? digits : length_of_piece(r, at, line);
        if (digits > 0 && !in_word(before))
            check_number(r, at, digits, line, before == '.');
        for (size_t i = 0; i < length && at[i] != '\0'; i++)
            line += at[i] == '\n';
        before = at[length - 1];
        at += length;
    }
}

/* The file, with a 0 behind it; *size: without. NULL: it cannot be had. */
static char *read_file(reader *r, size_t *size)
{
    FILE *file = fopen(r->path, "re");
    char *text = calloc(1, FILE_MAX + 2u);
    if (file == NULL || text == NULL) {
        fail_at(r, 0, "%s", strerror(errno));
    } else {
        *size = fread(text, 1, FILE_MAX + 1u, file);
        if (ferror(file) != 0)
            fail_at(r, 0, "%s", strerror(errno));
        else if (*size > FILE_MAX)
            fail_at(r, 0, "longer than %u bytes: not a configuration", FILE_MAX);
    }
    if (file != NULL)
        (void)fclose(file);
    if (r->failed) {
        free(text);
        return NULL;
    }
    return text;
}

/* -- Values ------------------------------------------------------------------------------------------------------------ */

static const char *name_of(const config_setting_t *at)
{
    const char *const name = config_setting_name(at);
    return name != NULL ? name : "this";
}

/* Is `known` `name` with a unit behind it? */
static bool lacks_unit(const char *name, const char *known)
{
    const size_t length = strlen(name);
    return strncmp(name, known, length) == 0 && known[length] == '_';
}

/* Refuses every key that is not in the list, which ends with NULL. */
static void allow_only(reader *r, const config_setting_t *group, const char *const *known)
{
    for (int i = 0; i < config_setting_length(group); i++) {
        const config_setting_t *const at = config_setting_get_elem(group, (unsigned)i);
        const char *const name = name_of(at);
        char list[RIG_WHY_MAX / 2] = "";
        bool found = false;
        for (const char *const *k = known; *k != NULL && !found; k++) {
            found = strcmp(*k, name) == 0;
            const size_t used = strlen(list);
            (void)snprintf(list + used, sizeof list - used, "%s%s", used == 0 ? "" : ", ", *k);
            if (lacks_unit(name, *k))
                fail_at(r, line_of(at), "'%s' has no unit: it is '%s'", name, *k);
        }
        if (!found)
            fail_at(r, line_of(at), "there is no key '%s' here; there are %s", name, list);
    }
}

static config_setting_t *find(reader *r, const config_setting_t *group, const char *key, bool is_required)
{
    config_setting_t *const at = config_setting_get_member(group, key);
    if (at == NULL && is_required)
        fail_at(r, line_of(group), "'%s' is missing; it has no default", key);
    return at;
}

static bool is_number(const config_setting_t *at)
{
    const int type = config_setting_type(at);
    return type == CONFIG_TYPE_INT || type == CONFIG_TYPE_FLOAT;
}

static double number_of(const config_setting_t *at)
{
    return config_setting_type(at) == CONFIG_TYPE_INT ? (double)config_setting_get_int(at)
                                                      : config_setting_get_float(at);
}

static double get_number(reader *r, const config_setting_t *at, double min, double max)
{
    if (!is_number(at))
        fail_at(r, line_of(at), "'%s' is a number", name_of(at));
    else if (!(number_of(at) >= min && number_of(at) <= max))
        fail_at(r, line_of(at), "'%s' is %.10g: expected %.10g to %.10g", name_of(at), number_of(at), min, max);
    else
        return number_of(at);
    return min;
}

static int get_whole(reader *r, const config_setting_t *at, int min, int max)
{
    if (config_setting_type(at) != CONFIG_TYPE_INT)
        fail_at(r, line_of(at), "'%s' is a whole number from %d to %d", name_of(at), min, max);
    return (int)get_number(r, at, min, max);
}

/* A whole number, or what is there already where the key is missing. */
static int whole(reader *r, const config_setting_t *group, const char *key, int usual, int min, int max)
{
    const config_setting_t *const at = find(r, group, key, false);
    return at == NULL ? usual : get_whole(r, at, min, max);
}

static const char *text(reader *r, const config_setting_t *group, const char *key, bool is_required)
{
    const config_setting_t *const at = find(r, group, key, is_required);
    if (at == NULL)
        return NULL;
    if (config_setting_type(at) == CONFIG_TYPE_STRING)
        return config_setting_get_string(at);
    fail_at(r, line_of(at), "'%s' is a text in quotation marks", key);
    return NULL;
}

static bool flag(reader *r, const config_setting_t *group, const char *key, bool is_required)
{
    const config_setting_t *const at = find(r, group, key, is_required);
    if (at != NULL && config_setting_type(at) != CONFIG_TYPE_BOOL)
        fail_at(r, line_of(at), "'%s' is true or false", key);
    return at != NULL && config_setting_get_bool(at) != 0;
}

/* Which of the names; `usual` where the key is missing (less than 0: it must not be). */
static int choice(reader *r, const config_setting_t *group, const char *key, const char *const *names, int usual)
{
    char list[RIG_WHY_MAX / 2] = "";
    const char *const name = text(r, group, key, usual < 0);
    if (name == NULL)
        return usual < 0 ? 0 : usual;
    for (int i = 0; names[i] != NULL; i++) {
        if (strcmp(names[i], name) == 0)
            return i;
        const size_t used = strlen(list);
        (void)snprintf(list + used, sizeof list - used, "%s\"%s\"", used == 0 ? "" : ", ", names[i]);
    }
    fail_at(r, line_of(config_setting_get_member(group, key)), "'%s' is \"%s\": expected one of %s", key, name, list);
    return 0;
}

static int32_t down_q(double um) { return (int32_t)floor(um * DR_QUANTA_PER_UM); }
static int32_t up_q(double um) { return (int32_t)ceil(um * DR_QUANTA_PER_UM); }

static double get_um(reader *r, const config_setting_t *at) { return get_number(r, at, -FAR_UM, FAR_UM); }

static bool is_group(reader *r, const config_setting_t *at)
{
    if (config_setting_is_group(at))
        return true;
    fail_at(r, line_of(at), "'%s' is a group: { key = value; ... }", name_of(at));
    return false;
}

/* Elements of ( ) or [ ]. */
static bool is_row(reader *r, const config_setting_t *at, int count, const char *what)
{
    const bool is_right =
        (config_setting_is_list(at) || config_setting_is_array(at)) && config_setting_length(at) == count;
    if (!is_right)
        fail_at(r, line_of(at), "'%s' is %d numbers in parentheses: %s", name_of(at), count, what);
    for (int i = 0; is_right && i < count; i++)
        if (!is_number(config_setting_get_elem(at, (unsigned)i)))
            fail_at(r, line_of(at), "'%s' is %d numbers in parentheses: %s", name_of(at), count, what);
    return !r->failed;
}

static double row_um(reader *r, const config_setting_t *row, unsigned i)
{
    const double um = number_of(config_setting_get_elem(row, i));
    if (um >= -FAR_UM && um <= FAR_UM)
        return um;
    fail_at(r, line_of(row), "'%s' has %.10g: expected %.10g to %.10g", name_of(row), um, -FAR_UM, FAR_UM);
    return 0;
}

/* { x = (min, max); y = ...; z = ...; }, rounded to within it, or to around it. */
static dr_box get_box(reader *r, const config_setting_t *group, bool outwards)
{
    static const char *const axes[] = {"x", "y", "z", NULL};
    dr_box box = {{0, 0, 0}, {0, 0, 0}};
    if (!is_group(r, group))
        return box;
    allow_only(r, group, axes);
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        const config_setting_t *const row = find(r, group, axes[axis], true);
        if (row == NULL || !is_row(r, row, 2, "(min, max)"))
            return box;
        const double min = row_um(r, row, 0), max = row_um(r, row, 1);
        if (min >= max)
            fail_at(r, line_of(row), "'%s': the first number, %.10g, must be below the second, %.10g", axes[axis], min,
                    max);
        box.min_q[axis] = outwards ? down_q(min) : up_q(min);
        box.max_q[axis] = outwards ? up_q(max) : down_q(max);
    }
    return box;
}

static void get_direction(reader *r, const config_setting_t *row, int16_t out[DR_AXES])
{
    if (!is_row(r, row, (int)DR_AXES, "the direction (x, y, z), in whole numbers from -1024 to 1024"))
        return;
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        const config_setting_t *const at = config_setting_get_elem(row, axis);
        if (config_setting_type(at) != CONFIG_TYPE_INT || abs(config_setting_get_int(at)) > DR_NORMAL_MAX)
            fail_at(r, line_of(row), "'%s' is a direction: whole numbers from -1024 to 1024", name_of(row));
        else
            out[axis] = (int16_t)config_setting_get_int(at);
    }
    if (out[DR_X] == 0 && out[DR_Y] == 0 && out[DR_Z] == 0)
        fail_at(r, line_of(row), "'%s' is 0, 0, 0: that is no direction", name_of(row));
}

static const char *const directions[] = {"none", "-x", "+x", "-y", "+y", "-z", "+z", NULL}; /* as in dr_to */

/* -- Drives ------------------------------------------------------------------------------------------------------------ */

static uint8_t level(reader *r, const config_setting_t *group, const char *key, uint8_t usual)
{
    const config_setting_t *const at = find(r, group, key, false);
    if (at == NULL)
        return usual;
    if (config_setting_type(at) == CONFIG_TYPE_STRING && strcmp(config_setting_get_string(at), "full") == 0)
        return DR_SPEED_FULL;
    if (config_setting_type(at) != CONFIG_TYPE_INT)
        fail_at(r, line_of(at), "'%s' is a level of 'S', 0 to 15, or \"full\" (the speed of all other motions)", key);
    return (uint8_t)get_whole(r, at, 0, (int)DR_SPEED_LEVELS - 1);
}

static void read_surface(reader *r, const config_setting_t *group, dr_drive_limits *d)
{
    static const char *const known[] = {"retract", "at_um", "clearance_um", "approach", "fastest_level", NULL};
    if (!is_group(r, group))
        return;
    allow_only(r, group, known);
    const config_setting_t *const at = find(r, group, "at_um", true);
    const config_setting_t *const clearance = find(r, group, "clearance_um", true);
    const config_setting_t *const approach = find(r, group, "approach", true);
    d->retract = (uint8_t)choice(r, group, "retract", directions, -1);
    if (!r->failed && d->retract == DR_TO_NONE)
        fail_at(r, line_of(group), "'retract' is the way out of the specimen: expected one of -x, +x, -y, +y, -z, +z");
    if (r->failed)
        return;
    const double um = get_um(r, at);
    d->surface_q = dr_to_more(d->retract) ? up_q(um) : down_q(um); /* more is below it */
    d->clearance_q = (uint32_t)up_q(get_number(r, clearance, 0, FAR_UM));
    get_direction(r, approach, d->approach);
    d->slow_level = level(r, group, "fastest_level", d->fast_level < SLOW_LEVEL ? d->fast_level : SLOW_LEVEL);
}

static void check_microstep(reader *r, const config_setting_t *group, dr_stage_id id)
{
    dr_stage stage;
    const config_setting_t *const at = find(r, group, "microstep_um", true);
    if (at == NULL || !dr_stage_get(id, &stage))
        return;
    const double um = (double)stage.quanta_per_step / DR_QUANTA_PER_UM;
    if (!is_number(at) || number_of(at) < um || number_of(at) > um)
        fail_at(r, line_of(at), "'microstep_um' of an %s on a %s is %.6f. Is 'device' or 'profile' wrong?",
                dr_words_stage(id), dr_words_controller((dr_kind)r->out->limits.kind), um);
}

static void read_stage(reader *r, const config_setting_t *group, uint8_t drive)
{
    dr_limits *const l = &r->out->limits;
    dr_stage_id id = DR_STAGE_NONE;
    char list[RIG_WHY_MAX / 2];
    const char *const device = text(r, group, "device", true);
    if (device == NULL)
        return;
    const unsigned line = line_of(config_setting_get_member(group, "device"));
    if (!dr_words_stage_find((dr_kind)l->kind, device, &id)) {
        (void)dr_words_stages(list, sizeof list, (dr_kind)l->kind);
        fail_at(r, line, "there is no device \"%s\"; there are %s", device, list);
    } else if (dr_words_fit(list, sizeof list, id, (dr_kind)l->kind, l->firmware, (uint8_t)(drive + 1u)) > 0) {
        fail_at(r, line, "%s", list);
    } else {
        (void)dr_limits_init_drive(l, drive, id);
        check_microstep(r, group, id);
    }
}

static void set_fact(dr_limits *l, uint16_t fact, bool is_so)
{
    if (is_so)
        l->rig = (uint16_t)(l->rig | fact);
}

#define FOR_ANY_DRIVE "number", "device", "microstep_um", "box_um", "max_move_um", "fastest_level", "surface"

static void read_drive(reader *r, config_setting_t *group)
{
    static const char *const of_trio[] = {FOR_ANY_DRIVE, NULL};
    static const char *const of_mpc[] = {FOR_ANY_DRIVE, "switch8_on", NULL};
    dr_limits *const l = &r->out->limits;
    if (!is_group(r, group))
        return;
    allow_only(r, group, l->kind == DR_TRIO ? of_trio : of_mpc);
    const config_setting_t *const number = find(r, group, "number", true);
    const config_setting_t *const box = find(r, group, "box_um", true);
    const config_setting_t *const max_move = find(r, group, "max_move_um", false);
    const config_setting_t *const surface = find(r, group, "surface", false);
    if (r->failed)
        return;
    const uint8_t drive = (uint8_t)(get_whole(r, number, 1, l->kind == DR_TRIO ? 1 : (int)DR_PORTS) - 1);
    if (!r->failed && l->drives[drive].stage != DR_STAGE_NONE)
        fail_at(r, line_of(number), "drive %u is told twice", drive + 1u);
    if (r->failed)
        return;
    dr_drive_limits *const d = &l->drives[drive];
    r->drives[drive] = group;
    read_stage(r, group, drive);
    d->box_q = get_box(r, box, false);
    if (max_move != NULL)
        d->max_move_q = (uint32_t)down_q(get_number(r, max_move, 0, FAR_UM));
    d->fast_level = d->slow_level = level(r, group, "fastest_level", DR_SPEED_FULL);
    if (surface != NULL)
        read_surface(r, surface, d);
    if (l->kind == DR_MPC)
        set_fact(l, (uint16_t)(DR_RIG_Y_LOCKED_OUT << drive), !flag(r, group, "switch8_on", true));
}

/* -- Obstacles --------------------------------------------------------------------------------------------------------- */

static dr_obstacle *add_obstacle(reader *r, config_setting_t *group, const dr_obstacle *like, const char *name)
{
    dr_limits *const l = &r->out->limits;
    if (l->obstacle_count == DR_OBSTACLES_MAX) {
        fail_at(r, line_of(group), "more than %u obstacles (a cone takes %u)", DR_OBSTACLES_MAX, RIG_CONE_SLICES);
        return NULL;
    }
    const uint8_t item = l->obstacle_count++;
    (void)snprintf(r->out->names[item], RIG_NAME_MAX, "%s", name);
    r->obstacles[item] = group;
    l->obstacles[item] = *like;
    return &l->obstacles[item];
}

/* normal . p is the same on the whole plane: rounded so that the half-space does not shrink. */
static void read_half(reader *r, const config_setting_t *at, dr_half *half)
{
    static const char *const known[] = {"normal", "through_um", NULL};
    if (!is_group(r, at))
        return;
    allow_only(r, at, known);
    const config_setting_t *const normal = find(r, at, "normal", true), *const through =
                                                                            find(r, at, "through_um", true);
    if (r->failed)
        return;
    get_direction(r, normal, half->normal);
    if (!is_row(r, through, (int)DR_AXES, "a point (x, y, z) of the plane"))
        return;
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        const double um = row_um(r, through, axis);
        half->offset_q += (int64_t)half->normal[axis] * (half->normal[axis] > 0 ? up_q(um) : down_q(um));
    }
}

/* A cone or cylinder along an axis: boxes around its slices. */
static void read_cone(reader *r, config_setting_t *group, const config_setting_t *at, dr_obstacle like,
                      const char *name)
{
    static const char *const known[] = {"axis", "centre", "from", "radius_from", "to", "radius_to", NULL};
    static const char *const axes[] = {"x", "y", "z", NULL};
    if (!is_group(r, at))
        return;
    allow_only(r, at, known);
    const config_setting_t *ends[4];
    for (unsigned i = 0; i < 4; i++)
        ends[i] = find(r, at, known[2 + i], true);
    const config_setting_t *const centre = find(r, at, "centre", true);
    const unsigned axis = (unsigned)choice(r, at, "axis", axes, -1);
    if (r->failed || !is_row(r, centre, 2, "the two other axes, in the order x, y, z"))
        return;
    const double from = get_um(r, ends[0]), to = get_um(r, ends[2]);
    const double from_radius = get_number(r, ends[1], 0, FAR_UM), to_radius = get_number(r, ends[3], 0, FAR_UM);
    if (!r->failed && from >= to)
        fail_at(r, line_of(ends[0]), "'from' is %.10g: it must be below 'to', %.10g", from, to);
    const bool is_cylinder = from_radius >= to_radius && from_radius <= to_radius;
    const unsigned slices = is_cylinder ? 1 : RIG_CONE_SLICES;
    for (unsigned i = 0; i < slices && !r->failed; i++) {
        const double radii[2] = {from_radius + (to_radius - from_radius) * i / slices,
                                 from_radius + (to_radius - from_radius) * (i + 1u) / slices};
        const double radius = fmax(radii[0], radii[1]);
        dr_obstacle *const o = add_obstacle(r, group, &like, name);
        if (o == NULL)
            return;
        for (unsigned a = 0, other = 0; a < DR_AXES; a++) {
            const double middle = a == axis ? 0 : row_um(r, centre, other++);
            const double min = a == axis ? from + (to - from) * i / slices : middle - radius;
            const double max = a == axis ? from + (to - from) * (i + 1u) / slices : middle + radius;
            o->box_q.min_q[a] = down_q(min) - (is_cylinder ? 0 : 1); /* a quantum for what the division rounds */
            o->box_q.max_q[a] = up_q(max) + (is_cylinder ? 0 : 1);
        }
    }
}

static void read_keepout(reader *r, config_setting_t *group)
{
    static const char *const known[] = {"name", "drive", "exit", "box_um", "half", "cone_um", NULL};
    dr_obstacle o = {0, 0, 0, {{0, 0, 0}, {0, 0, 0}}, {0, {0, 0, 0}}};
    if (!is_group(r, group))
        return;
    allow_only(r, group, known);
    const char *const name = text(r, group, "name", true);
    const config_setting_t *const drive = find(r, group, "drive", true);
    const config_setting_t *const box = find(r, group, "box_um", false), *const half = find(r, group, "half", false);
    const config_setting_t *const cone = find(r, group, "cone_um", false);
    if (!r->failed && (box != NULL) + (half != NULL) + (cone != NULL) != 1)
        fail_at(r, line_of(group), "an obstacle has one shape: 'box_um', 'half' or 'cone_um'");
    if (r->failed)
        return;
    if (*name == '\0' || strlen(name) >= RIG_NAME_MAX)
        fail_at(r, line_of(group), "'name' has 1 to %u letters", RIG_NAME_MAX - 1u);
    for (uint8_t i = 0; i < r->out->limits.obstacle_count; i++)
        if (strcmp(r->out->names[i], name) == 0)
            fail_at(r, line_of(group), "there are two obstacles \"%s\"", name);
    o.drive = (uint8_t)(get_whole(r, drive, 1, (int)DR_PORTS) - 1);
    o.exit = (uint8_t)choice(r, group, "exit", directions, DR_TO_NONE);
    o.shape = half != NULL ? DR_SHAPE_HALF : DR_SHAPE_BOX;
    if (half != NULL && find(r, group, "exit", false) != NULL)
        fail_at(r, line_of(group), "a half-space has no 'exit': the way out of it is its normal");
    if (box != NULL)
        o.box_q = get_box(r, box, true);
    if (half != NULL)
        read_half(r, half, &o.half_q);
    if (cone != NULL)
        read_cone(r, group, cone, o, name);
    else if (!r->failed)
        (void)add_obstacle(r, group, &o, name);
}

/* -- The whole --------------------------------------------------------------------------------------------------------- */

static void read_elements(reader *r, config_setting_t *list, void (*read_one)(reader *, config_setting_t *))
{
    if (!config_setting_is_list(list))
        fail_at(r, line_of(list), "'%s' is a list: ( { ... }, { ... } )", name_of(list));
    for (int i = 0; i < config_setting_length(list) && !r->failed; i++)
        read_one(r, config_setting_get_elem(list, (unsigned)i));
}

static void read_facts(reader *r, const config_setting_t *root)
{
    static const char *const paths[] = {"documented", "hull", NULL};
    static const char *const homes[] = {"unknown", "zero", NULL};
    dr_limits *const l = &r->out->limits;
    if (l->kind == DR_TRIO) {
        set_fact(l, DR_RIG_Y_LOCKED_OUT, !flag(r, root, "external_switch5_on", true));
        set_fact(l, DR_RIG_CALIBRATES_AT_POWER_ON, flag(r, root, "external_switch6_on", true));
        l->angle_min_deg = (uint8_t)whole(r, root, "angle_min_deg", l->angle_min_deg, 1, 89);
        l->angle_max_deg = (uint8_t)whole(r, root, "angle_max_deg", l->angle_max_deg, 1, 89);
    } else {
        set_fact(l, DR_RIG_HOME_IS_ZERO, choice(r, root, "mpc_home", homes, 0) == 1);
        set_fact(l, DR_RIG_MAY_STREAM, flag(r, root, "allow_stream", false));
        l->mode_min = (uint8_t)whole(r, root, "roe_mode_min", l->mode_min, 0, 9);
    }
    set_fact(l, DR_RIG_KNOBS_LOCKED, flag(r, root, "knobs_locked", false));
    set_fact(l, DR_RIG_PATHS_UNKNOWN, choice(r, root, "path_model", paths, 0) == 1);
    set_fact(l, DR_RIG_MAY_CALIBRATE, flag(r, root, "allow_calibrate", false));
    set_fact(l, DR_RIG_STAYS_ARMED, flag(r, root, "stay_armed", false));
    set_fact(l, DR_RIG_HAS_CUT, flag(r, root, "relay", false));
}

static void read_numbers(reader *r, const config_setting_t *root)
{
    static const char *const refusals[] = {"silent", "E", NULL};
    static const char *const losses[] = {"stop", "finish", NULL};
    dr_limits *const l = &r->out->limits;
    const config_setting_t *const margin = find(r, root, "margin_um", false);
    const config_setting_t *const knob = find(r, root, "knob_um_per_s", false);
    const config_setting_t *const beyond = find(r, root, "beyond_zero_um", false);
    l->refusal = (uint8_t)choice(r, root, "refusal", refusals, DR_REFUSE_SILENT);
    l->host_loss = (uint8_t)choice(r, root, "on_host_loss", losses, DR_HOST_LOSS_STOP);
    l->unstoppable_ms = (uint16_t)whole(r, root, "unstoppable_ms", l->unstoppable_ms, 0, (int)DR_UNSTOPPABLE_MAX_MS);
    l->arm_idle_s = (uint16_t)whole(r, root, "arm_idle_s", l->arm_idle_s, 1, (int)DR_ARM_IDLE_MAX_S);
    if (margin != NULL)
        l->margin_q = up_q(get_number(r, margin, 0, 10000));
    if (knob != NULL)
        l->knob_q_per_s = up_q(get_number(r, knob, 0, 20000));
    if (beyond != NULL)
        l->beyond_zero_q = up_q(get_number(r, beyond, 0, 10000));
}

static void read_serial(reader *r, const config_setting_t *root)
{
    const char *const serial = text(r, root, "converter_serial", false);
    if (serial == NULL)
        return;
    if (*serial == '\0' || strlen(serial) > DR_SERIAL_MAX)
        fail_at(r, line_of(config_setting_get_member(root, "converter_serial")),
                "'converter_serial' has 1 to %u characters; leave it out if any converter will do", DR_SERIAL_MAX);
    else
        memcpy(r->out->limits.serial, serial, strlen(serial));
}

#define FOR_ANY                                                                                                        \
    "format", "revision", "profile", "firmware", "converter_serial", "knobs_locked", "path_model", "allow_calibrate",  \
        "refusal", "on_host_loss", "stay_armed", "relay", "unstoppable_ms", "arm_idle_s", "margin_um",                 \
        "knob_um_per_s", "beyond_zero_um", "drives", "keepouts"

static void read_root(reader *r, const config_setting_t *root)
{
    static const char *const profiles[] = {"trio-mp245a", "mpc-200", NULL}; /* as in dr_kind */
    static const char *const for_trio[] = {FOR_ANY,         "external_switch5_on", "external_switch6_on",
                                           "angle_min_deg", "angle_max_deg",       NULL};
    static const char *const for_mpc[] = {FOR_ANY, "mpc_home", "allow_stream", "roe_mode_min", NULL};
    dr_limits *const l = &r->out->limits;
    const config_setting_t *const format = find(r, root, "format", true);
    if (format != NULL && get_whole(r, format, 1, 1000) != FORMAT)
        fail_at(r, line_of(format), "'format' is %d; this program knows format %d", config_setting_get_int(format),
                FORMAT);
    const dr_kind kind = choice(r, root, "profile", profiles, -1) == 0 ? DR_TRIO : DR_MPC;
    if (r->failed)
        return;
    allow_only(r, root, kind == DR_TRIO ? for_trio : for_mpc);
    dr_limits_init(l, kind);
    const char *const firmware = text(r, root, "firmware", true);
    const config_setting_t *const revision = find(r, root, "revision", true);
    const char *const wrong = firmware == NULL ? NULL : dr_words_firmware_parse(firmware, &l->firmware);
    if (wrong != NULL)
        fail_at(r, line_of(config_setting_get_member(root, "firmware")), "'firmware' is \"%s\": %s", firmware, wrong);
    if (revision != NULL)
        l->revision = (uint32_t)get_whole(r, revision, 1, INT32_MAX);
    read_serial(r, root);
    read_facts(r, root);
    read_numbers(r, root);
    config_setting_t *const drives = find(r, root, "drives", true), *const keepouts = find(r, root, "keepouts", false);
    if (drives != NULL)
        read_elements(r, drives, read_drive);
    if (keepouts != NULL && !r->failed)
        read_elements(r, keepouts, read_keepout);
}

/* -- Does the whole make sense? ---------------------------------------------------------------------------------------- */

/* What a problem is about: the key where it should be looked for, and what is wrong. What cannot come from a text that has
 * been read this far has the plainest words. */
static const struct {
    uint8_t error;
    const char *key, *says;
} problems[] = {
    {DR_LIMITS_RIG, "profile", "a fact or permission that this controller cannot have"},
    {DR_LIMITS_SERIAL, "converter_serial", "letters, digits and signs only, without blanks"},
    {DR_LIMITS_ANGLES, "angle_min_deg", "'angle_min_deg' is above 'angle_max_deg'"},
    {DR_LIMITS_KNOB, "knob_um_per_s", "'knob_um_per_s' may be 0 only with 'knobs_locked = true'"},
    {DR_LIMITS_NO_DRIVE, "drives", "there is no drive to be moved"},
    {DR_LIMITS_BOX, "box_um", "'box_um' is thinner than 1/64 um"},
    {DR_LIMITS_BOX_OUTSIDE, "box_um", "'box_um' goes beyond the travel of the device"},
    {DR_LIMITS_MAX_MOVE, "max_move_um", "'max_move_um' allows no move"},
    {DR_LIMITS_SPEED, "fastest_level", "'fastest_level' below the surface is above that of the drive"},
    {DR_LIMITS_SURFACE, "surface", "the surface is not within the travel of the device"},
    {DR_LIMITS_CLEARANCE, "surface", "no room is left above surface and clearance within 'box_um'"},
    {DR_LIMITS_APPROACH, "surface",
     "'approach' must lead along the axis of 'retract' too, or it never comes to the surface"},
    {DR_LIMITS_OBSTACLE_DRIVE, "drive", "the obstacle is for a drive that is not among 'drives'"},
    {DR_LIMITS_OBSTACLE_BOX, "name", "the obstacle goes beyond 262 mm"},
    {DR_LIMITS_OBSTACLE_NORMAL, "half", "the plane is absurdly far away"},
    {DR_LIMITS_OBSTACLE_OUTSIDE, "name", "the obstacle is nowhere near the drive's travel. A slip of sign or unit?"},
    {DR_LIMITS_NO_ROOM, "box_um", "an obstacle and its margin leave nothing of 'box_um'"},
};

static void tell_problem(reader *r, const config_setting_t *root, dr_limits_problem problem)
{
    static const char *const axes[] = {", axis x", ", axis y", ", axis z", ""};
    const char *key = "format", *says = "the limits make no sense";
    for (size_t i = 0; i < sizeof problems / sizeof problems[0]; i++)
        if (problems[i].error == problem.error) {
            key = problems[i].key;
            says = problems[i].says;
        }
    const config_setting_t *group = root;
    if (problem.error >= DR_LIMITS_SHAPE && problem.error <= DR_LIMITS_OBSTACLE_OUTSIDE)
        group = r->obstacles[problem.item];
    else if (problem.error >= DR_LIMITS_STAGE)
        group = r->drives[problem.item];
    const config_setting_t *at = config_setting_get_member(group, key);
    const config_setting_t *const row = at != NULL && problem.axis < DR_AXES && config_setting_is_group(at)
                                            ? config_setting_get_elem(at, problem.axis)
                                            : NULL;
    if (row != NULL && problem.error <= DR_LIMITS_BOX_OUTSIDE)
        at = config_setting_get_member(at, (const char *[]){"x", "y", "z"}[problem.axis]);
    const unsigned line = line_of(at != NULL ? at : group);
    dr_stage stage;
    if (problem.error == DR_LIMITS_BOX_OUTSIDE &&
        dr_stage_get((dr_stage_id)r->out->limits.drives[problem.item].stage, &stage))
        fail_at(r, line, "%s%s: 0 to %.10g um", says, axes[problem.axis],
                (double)stage.travel_steps[problem.axis] * stage.quanta_per_step / DR_QUANTA_PER_UM);
    fail_at(r, line, "%s%s", says, axes[problem.axis < DR_AXES ? problem.axis : DR_AXES]);
}

uint8_t rig_ports(const dr_limits *l)
{
    uint8_t ports = 0;
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        if (l->drives[drive].stage != DR_STAGE_NONE)
            ports = (uint8_t)(drive + 1u);
    return ports;
}

uint32_t rig_count_free(const dr_limits *l, uint8_t drive, uint32_t enough, uint32_t one[DR_AXES])
{
    dr_stage stage;
    uint32_t count = 0;
    const dr_box *const box = &l->drives[drive].box_q;
    if (!dr_stage_get((dr_stage_id)l->drives[drive].stage, &stage))
        return 0;
    for (uint32_t i = 0; i < RIG_POINTS && count < enough; i++) {
        const uint32_t at[DR_AXES] = {i % RIG_GRID, i / RIG_GRID % RIG_GRID, i / RIG_GRID / RIG_GRID};
        uint32_t steps[DR_AXES];
        for (unsigned axis = 0; axis < DR_AXES; axis++) {
            const int64_t side_q = (int64_t)box->max_q[axis] - box->min_q[axis];
            steps[axis] = (uint32_t)((box->min_q[axis] + side_q * (2 * at[axis] + 1) / (2 * (int64_t)RIG_GRID)) /
                                     stage.quanta_per_step);
        }
        if (dr_judge_place(l, drive, steps).reason != DR_REASON_NONE)
            continue;
        count++;
        if (one != NULL)
            memcpy(one, steps, sizeof steps);
    }
    return count;
}

static void check_whole(reader *r, const config_setting_t *root)
{
    dr_limits_problem problem;
    const dr_limits *const l = &r->out->limits;
    if (!dr_limits_check(l, &problem))
        tell_problem(r, root, problem);
    for (uint8_t drive = 0; drive < DR_PORTS && !r->failed; drive++)
        if (l->drives[drive].stage != DR_STAGE_NONE && rig_count_free(l, drive, 1, NULL) == 0)
            tell_problem(r, root, (dr_limits_problem){DR_LIMITS_NO_ROOM, drive, DR_AXES});
}

static void read_text(reader *r, char *text, size_t size)
{
    config_t config;
    const char *const zero = memchr(text, '\0', size);
    unsigned line = 1;
    for (const char *at = text; zero != NULL && at < zero; at++)
        line += *at == '\n';
    if (zero != NULL)
        fail_at(r, line, "holds a byte of value 0: not a text");
    else
        (void)memcpy(text + size, "\n", 2); /* libconfig wants an end of the last line */
    check_text(r, text);
    config_init(&config);
    if (!r->failed && config_read_string(&config, text) != CONFIG_TRUE)
        fail_at(r, (unsigned)config_error_line(&config), "%s", config_error_text(&config));
    if (!r->failed)
        read_root(r, config_root_setting(&config));
    if (!r->failed)
        check_whole(r, config_root_setting(&config));
    config_destroy(&config);
}

/* Its obstacles have numbers for names. */
static void read_image(reader *r, const char *bytes, size_t size)
{
    dr_limits_problem problem;
    if (!dr_limits_get((const uint8_t *)bytes, size, &r->out->limits, &problem))
        fail_at(r, 0, "%s", image_problem(problem.error));
    for (unsigned i = 0; !r->failed && i < r->out->limits.obstacle_count; i++)
        (void)snprintf(r->out->names[i], RIG_NAME_MAX, "obstacle %u", i + 1u);
}

bool rig_read(rig *out, const char *path, char *why, size_t room)
{
    reader r = {.path = path, .room = room, .out = out};
    size_t size = 0;
    r.why = why;
    memset(out, 0, sizeof *out);
    char *const content = read_file(&r, &size);
    if (content == NULL)
        return false;
    if (image_is(content, size))
        read_image(&r, content, size);
    else
        read_text(&r, content, size);
    free(content);
    return !r.failed;
}
