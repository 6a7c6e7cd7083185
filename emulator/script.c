#include "script.h"

#include "textfile.h" /* the file */

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool script_open(script *s, const char *path, const char *whose, char *why, size_t room)
{
    *s = (script){.path = path, .whose = whose, .text = textfile_read(path)};
    if (s->text == NULL)
        (void)snprintf(why, room, "%s: %s", path, textfile_why());
    return s->text != NULL;
}

void script_close(script *s)
{
    free(s->text);
    s->text = NULL;
}

/* A line as the language has it: without comment, and with a name before it. False: it is too long. Empty: there is nothing
 * to do. *added: how many characters were put before it. */
static bool prepare(const script *s, const char *from, size_t length, char line[LANGUAGE_LINE], unsigned *added)
{
    const char *const comment = memchr(from, '#', length);
    if (comment != NULL)
        length = (size_t)(comment - from);
    while (length > 0 && strchr(" \t\r", from[length - 1]) != NULL)
        length--;
    const size_t blank = strspn(from, " \t\r");
    const bool is_named = s->whose == NULL || (blank < length && from[blank] == '@');
    *added = length == 0 || is_named ? 0 : (unsigned)strlen(s->whose) + 2u;
    if (length + *added >= LANGUAGE_LINE)
        return false;
    (void)snprintf(line, LANGUAGE_LINE, "%s%s%s%.*s", *added > 0 ? "@" : "", *added > 0 ? s->whose : "",
                   *added > 0 ? " " : "", (int)length, from);
    return true;
}

static bool each_line(const script *s, language *l, bool is_check, char *why, size_t room)
{
    unsigned number = 1;
    for (const char *at = s->text; *at != '\0'; number++) {
        char line[LANGUAGE_LINE], wrong[WHY_ROOM];
        const size_t length = strcspn(at, "\n");
        unsigned added = 0, column = LANGUAGE_LINE;
        bool done = prepare(s, at, length, line, &added);
        if (!done)
            (void)snprintf(wrong, sizeof wrong, "the line is longer than %u characters", LANGUAGE_LINE - 1u);
        else if (line[0] != '\0' && is_check)
            done = language_check(l, line, wrong, &column);
        else if (line[0] != '\0') {
            column = added + 1u + (unsigned)strspn(at, " \t\r");
            done = language_done(l, line, wrong);
        }
        if (!done) {
            (void)snprintf(why, room, "%s:%u:%u: %s", s->path, number, column - added, wrong);
            return false;
        }
        at += length + (at[length] == '\n' ? 1 : 0);
    }
    return true;
}

bool script_check(const script *s, language *l, char *why, size_t room) { return each_line(s, l, true, why, room); }
bool script_do(const script *s, language *l, char *why, size_t room) { return each_line(s, l, false, why, room); }
