#include "first.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEXT 1024u
#define DO_ROOM (LANGUAGE_LINE + RIG_NAME_MAX) /* one that is too long stays too long */

static bool open_script(first *f, const char *path, const char *whose)
{
    char why[TEXT];
    if (path == NULL || script_open(&f->scripts[f->script_count], path, whose, why, sizeof why)) {
        f->script_count += path != NULL;
        return true;
    }
    (void)fprintf(stderr, "dryrig-emu: %s\n", why);
    return false;
}

/* A line of a rig file, for its controller. Returns how many characters are put before it. */
static unsigned do_line(const first *f, unsigned member, unsigned n, char line[DO_ROOM])
{
    const rig_member *const m = &f->o->rig.members[member];
    const bool is_named = m->do_[n][0] == '@';
    (void)snprintf(line, DO_ROOM, "%s%s%s%s", is_named ? "" : "@", is_named ? "" : m->name, is_named ? "" : " ",
                   m->do_[n]);
    return is_named ? 0 : (unsigned)strlen(m->name) + 2u;
}

static bool check_rig_line(const first *f, language *l, unsigned member, unsigned n)
{
    char line[DO_ROOM], why[WHY_ROOM];
    unsigned column;
    const unsigned added = do_line(f, member, n, line);
    const rig_member *const m = &f->o->rig.members[member];
    if (language_check(l, line, why, &column))
        return true;
    (void)fprintf(stderr, "dryrig-emu: %s:%u:%u: %s\n", f->o->rig_file, m->do_line[n],
                  m->do_column[n] + column - 1u - added, why);
    return false;
}

static bool check_line(language *l, const char *line)
{
    char why[WHY_ROOM];
    unsigned column;
    if (language_check(l, line, why, &column))
        return true;
    (void)fprintf(stderr, "dryrig-emu: '%s': %s\n", line, why);
    return false;
}

bool first_check(first *f, const options *o, language *l)
{
    const rig *const r = &o->rig;
    char why[TEXT];
    *f = (first){.o = o, .scripts = calloc(r->count + 1u, sizeof *f->scripts)};
    if (f->scripts == NULL) {
        (void)fprintf(stderr, "dryrig-emu: no memory\n");
        return false;
    }
    for (unsigned i = 0; i < r->count; i++) {
        for (unsigned n = 0; n < r->members[i].do_count; n++)
            if (!check_rig_line(f, l, i, n))
                return false;
        if (!open_script(f, r->members[i].scenario, r->members[i].name))
            return false;
    }
    if (!open_script(f, o->scenario, NULL))
        return false;
    for (unsigned i = 0; i < f->script_count; i++)
        if (!script_check(&f->scripts[i], l, why, sizeof why)) {
            (void)fprintf(stderr, "dryrig-emu: %s\n", why);
            return false;
        }
    for (unsigned i = 0; i < o->do_count; i++)
        if (!check_line(l, o->dos[i]))
            return false;
    return true;
}

static bool carry_out(language *l, const char *line)
{
    char why[WHY_ROOM];
    if (language_done(l, line, why))
        return true;
    (void)fprintf(stderr, "dryrig-emu: '%s': %s\n", line, why);
    return false;
}

bool first_do(const first *f, language *l)
{
    const rig *const r = &f->o->rig;
    char line[DO_ROOM], why[TEXT];
    for (unsigned i = 0; i < r->count; i++)
        for (unsigned n = 0; n < r->members[i].do_count; n++) {
            (void)do_line(f, i, n, line);
            if (!carry_out(l, line))
                return false;
        }
    for (unsigned i = 0; i < f->script_count; i++)
        if (!script_do(&f->scripts[i], l, why, sizeof why)) {
            (void)fprintf(stderr, "dryrig-emu: %s\n", why);
            return false;
        }
    for (unsigned i = 0; i < f->o->do_count; i++)
        if (!carry_out(l, f->o->dos[i]))
            return false;
    return true;
}

void first_close(first *f)
{
    while (f->script_count > 0)
        script_close(&f->scripts[--f->script_count]);
    free(f->scripts);
}
