#define _GNU_SOURCE /* strdup */
#include "language.h"

#include "dr_words.h" /* names of commands */

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* -- Words --------------------------------------------------------------------------------------------------------------- */

const char *telling_next(telling *t) { return t->words[t->at] == NULL ? NULL : t->words[t->at++]; }

const char *telling_word(telling *t)
{
    const char *const word = telling_next(t);
    return word == NULL ? "" : word;
}

bool telling_take(telling *t, const char *word)
{
    if (t->words[t->at] == NULL || strcasecmp(t->words[t->at], word) != 0)
        return false;
    t->at++;
    return true;
}

bool telling_wrong(telling *t, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(t->why, sizeof t->why, format, arguments);
    va_end(arguments);
    return false;
}

bool telling_ends(telling *t)
{
    if (t->words[t->at] != NULL)
        return telling_wrong(t, "'%s' is one word too many", t->words[t->at]);
    t->was_read = true;
    return !t->is_check;
}

bool telling_about(telling *t, const char *word, const char *why)
{
    return word == NULL || *word == '\0' ? telling_wrong(t, "%s", why) : telling_wrong(t, "'%s': %s", word, why);
}

bool telling_time(telling *t, uint64_t *us)
{
    char why[WHY_ROOM];
    const char *const word = telling_word(t);
    return values_time_us(word, us, why) || telling_about(t, word, why);
}

/* -- Commands of the controller ------------------------------------------------------------------------------------------- */

bool telling_command(telling *t, dr_op *op)
{
    const dr_controller *const c = &t->s->ins.controller;
    const char *const word = telling_next(t);
    dr_command command;
    if (word != NULL && word[0] != '\0' && word[1] == '\0' &&
        dr_command_find((dr_kind)c->kind, c->firmware, (uint8_t)word[0], &command)) {
        *op = (dr_op)command.op;
        return true;
    }
    char why[WHY_ROOM];
    size_t length = (size_t)snprintf(why, sizeof why, "expected a command of the %s as its letter, as ^C, or as ",
                                     dr_words_kind((dr_kind)c->kind));
    const char *const names = why + length;
    for (uint8_t i = 0; dr_command_row((dr_kind)c->kind, i, &command); i++) {
        const char *const name = dr_words_command((dr_op)command.op)->name;
        const bool is_stop = (command.is & DR_IS_INTERRUPT) != 0 && word != NULL && strcasecmp(word, "^C") == 0;
        if (word != NULL && c->firmware >= command.since && c->firmware <= command.until &&
            (is_stop || strcasecmp(word, name) == 0)) {
            *op = (dr_op)command.op;
            return true;
        }
        if (length < sizeof why && strstr(names, name) == NULL)
            length += (size_t)snprintf(why + length, sizeof why - length, "%s%s", i == 0 ? "" : ", ", name);
    }
    return telling_about(t, word, why);
}

/* -- Later: at a time, after commands -------------------------------------------------------------------------------------- */

/* A line that waits for commands of a host. It may not act while it looks on, so it plans itself for that very instant. */
typedef struct trigger trigger;
struct trigger {
    observer base;
    observer_link link;
    language *l;
    station *s;
    dr_op op; /* DR_OP_NONE: any */
    unsigned left;
    bool is_each;
    char line[LANGUAGE_LINE];
    trigger *next;
};

/* One that waits for a time. */
typedef struct {
    planned base;
    language *l;
    trigger *spent; /* what has planned it, where that is of no use any more; NULL: nothing */
    char line[LANGUAGE_LINE];
} later;

/* Not while observers look on. */
static void forget_trigger(language *l, trigger *g)
{
    for (trigger **at = &l->triggers; *at != NULL; at = &(*at)->next)
        if (*at == g) {
            *at = g->next;
            break;
        }
    station_unobserve(g->s, &g->link);
    free(g);
}

/* What goes wrong later has nobody to tell but those who look on. */
static void carry_out_later(language *l, const char *line)
{
    char text[LANGUAGE_LINE + WHY_ROOM];
    cJSON *const answer = language_do(l, line, NULL);
    const char *const error = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(answer, "why"));
    (void)snprintf(text, sizeof text, "%s: %s", line, error == NULL ? "done" : error);
    for (unsigned i = 0; i < l->e->station_count; i++)
        station_say(&l->e->stations[i], OBSERVED_EVENT, text);
    if (error != NULL)
        (void)fprintf(stderr, "dryrig-emu: %s\n", text);
    cJSON_Delete(answer);
}

static void strike(planned *what)
{
    later *const it = (later *)what;
    if (it->spent != NULL)
        forget_trigger(it->l, it->spent);
    it->l->depth++;
    carry_out_later(it->l, it->line);
    it->l->depth--;
    free(it);
}

/* NULL: no memory. */
static later *plan(language *l, uint64_t when_us, const char *line, bool is_passive)
{
    later *const it = calloc(1, sizeof *it);
    if (it == NULL)
        return NULL;
    it->base.strike = strike;
    it->base.when_us = when_us;
    it->base.is_passive = is_passive;
    it->l = l;
    (void)snprintf(it->line, sizeof it->line, "%s", line);
    engine_plan(l->e, &it->base);
    return it;
}

bool telling_later(telling *t, uint64_t when_us, const char *line, bool is_passive)
{
    return plan(t->l, when_us, line, is_passive) != NULL || telling_wrong(t, "no memory");
}

static bool carry_out_words(telling *t);

/* Is what stands there a command? */
static bool is_rest_right(telling *t)
{
    telling rest = *t;
    if (t->words[t->at] == NULL)
        return telling_wrong(t, "and then? Another command is expected behind it");
    rest.is_check = rest.is_later = true;
    (void)carry_out_words(&rest);
    if (rest.was_read)
        return true;
    t->at = rest.at;
    t->has_usage = rest.has_usage;
    memcpy(t->why, rest.why, sizeof t->why);
    return false;
}

/* The rest of the line as it was, for the same controller. */
static bool rest_of(telling *t, char line[LANGUAGE_LINE])
{
    if (!is_rest_right(t))
        return false;
    const bool is_named = t->words[t->at][0] == '@';
    size_t length = t->s == NULL || is_named ? 0 : (size_t)snprintf(line, LANGUAGE_LINE, "@%s", t->s->name);
    t->was_read = true;
    if (t->is_check)
        return false;
    for (const char *word; (word = telling_next(t)) != NULL && length < LANGUAGE_LINE;)
        length += (size_t)snprintf(line + length, LANGUAGE_LINE - length, "%s%s", length > 0 ? " " : "", word);
    return length < LANGUAGE_LINE || telling_wrong(t, "the line is too long");
}

static bool do_at(telling *t)
{
    char line[LANGUAGE_LINE];
    uint64_t when_us;
    return telling_time(t, &when_us) && rest_of(t, line) && telling_later(t, when_us, line, true);
}

static bool do_in(telling *t)
{
    char line[LANGUAGE_LINE];
    uint64_t span_us;
    return telling_time(t, &span_us) && rest_of(t, line) && telling_later(t, t->l->e->now_us + span_us, line, true);
}

static void see_command(observer *o, const observation *seen)
{
    trigger *const g = (trigger *)o;
    if (seen->what != OBSERVED_NOTE || seen->note->what != DR_NOTE_REQUEST || g->left == 0 ||
        (g->op != DR_OP_NONE && g->op != seen->note->op) || --g->left > 0)
        return;
    later *const it = plan(g->l, seen->when_us, g->line, false);
    g->left = g->is_each ? 1 : 0;
    if (it != NULL && !g->is_each)
        it->spent = g;
}

static bool add_trigger(telling *t, dr_op op, unsigned count, bool is_each)
{
    char line[LANGUAGE_LINE];
    if (!rest_of(t, line))
        return false;
    trigger *const g = calloc(1, sizeof *g);
    if (g == NULL)
        return telling_wrong(t, "no memory");
    *g = (trigger){.base = {see_command}, .l = t->l, .s = t->s, .op = op, .left = count, .is_each = is_each};
    memcpy(g->line, line, sizeof g->line);
    g->link.who = &g->base;
    g->next = t->l->triggers;
    t->l->triggers = g;
    station_observe(t->s, &g->link);
    return true;
}

static bool do_after(telling *t)
{
    unsigned count;
    char why[WHY_ROOM] = "";
    const char *const word = telling_word(t);
    if (!values_number(word, 1, 1000000, &count, why))
        return telling_about(t, word, why);
    if (!telling_take(t, "commands") && !telling_take(t, "command"))
        return telling_wrong(t, "expected: after 3 commands COMMAND");
    return add_trigger(t, DR_OP_NONE, count, false);
}

static bool do_on(telling *t)
{
    dr_op op = DR_OP_NONE;
    const bool is_each = telling_take(t, "each");
    return telling_command(t, &op) && add_trigger(t, op, 1, is_each);
}

/* -- Help ---------------------------------------------------------------------------------------------------------------- */

static bool do_help(telling *t);

static const verb verbs_self[] = {
    {"at", "TIME COMMAND", "carry COMMAND out when the controllers' clock shows TIME", false, do_at},
    {"in", "TIME COMMAND", "carry COMMAND out when TIME has gone by", false, do_in},
    {"after", "N commands COMMAND", "carry COMMAND out when the host has sent N more commands", true, do_after},
    {"on", "[each] S COMMAND", "carry COMMAND out when the host sends S the next time, or each time", true, do_on},
    {"help", "[VERB]", "list what can be told to the emulator", false, do_help},
    {NULL, NULL, NULL, false, NULL}};

static const verb *const tables[] = {verbs_rig, verbs_fault, verbs_hands, verbs_self};
#define TABLES (sizeof tables / sizeof tables[0])

static const verb *find(const char *name)
{
    for (size_t i = 0; i < TABLES; i++)
        for (const verb *v = tables[i]; v->name != NULL; v++)
            if (strcasecmp(v->name, name) == 0)
                return v;
    return NULL;
}

static bool do_help(telling *t)
{
    const char *const name = telling_next(t);
    if (name != NULL && find(name) == NULL)
        return telling_wrong(t, "'%s' is no verb; 'help' lists them", name);
    if (!telling_ends(t))
        return false;
    cJSON *const list = cJSON_AddArrayToObject(t->answer, "commands");
    for (size_t i = 0; i < TABLES; i++)
        for (const verb *v = tables[i]; v->name != NULL; v++) {
            if (name != NULL && v != find(name))
                continue;
            char usage[WHY_ROOM];
            cJSON *const entry = cJSON_CreateObject();
            (void)snprintf(usage, sizeof usage, "%s%s%s", v->name, *v->usage == '\0' ? "" : " ", v->usage);
            (void)cJSON_AddStringToObject(entry, "command", usage);
            (void)cJSON_AddStringToObject(entry, "does", v->help);
            (void)cJSON_AddItemToArray(list, entry);
        }
    return true;
}

/* -- A line -------------------------------------------------------------------------------------------------------------- */

static bool cut(telling *t, char *line)
{
    unsigned count = 0;
    for (const char *at = line; *at != '\0'; at++)
        if ((unsigned char)*at > 0x7Fu) { /* what is said about it would be no JSON, where it is no UTF-8 */
            t->words[0] = at;
            return telling_wrong(t, "byte %02X at character %u: commands are plain ASCII", (unsigned)(unsigned char)*at,
                                 (unsigned)(at - line) + 1u);
        }
    for (char *rest, *word = strtok_r(line, " \t\r\n", &rest); word != NULL; word = strtok_r(NULL, " \t\r\n", &rest)) {
        if (count == LANGUAGE_WORDS)
            return telling_wrong(t, "more than %u words", LANGUAGE_WORDS);
        t->words[count++] = word;
    }
    return count > 0 || telling_wrong(t, "a command is expected; 'help' lists them");
}

static bool choose_station(telling *t)
{
    engine *const e = t->l->e;
    const char *const word = t->words[t->at];
    if (t->s == NULL && e->station_count == 1)
        t->s = &e->stations[0];
    if (word == NULL || word[0] != '@')
        return true;
    t->at++;
    for (unsigned i = 0; i < e->station_count; i++)
        if (strcmp(e->stations[i].name, word + 1) == 0) {
            t->s = &e->stations[i];
            return t->words[t->at] != NULL || telling_wrong(t, "and what about '%s'?", word + 1);
        }
    t->at--;
    return telling_wrong(t, "there is no controller '%s'", word + 1);
}

static bool carry_out_words(telling *t)
{
    if (!choose_station(t))
        return false;
    const char *const name = telling_next(t);
    const verb *const v = find(name);
    if (v == NULL)
        return telling_wrong(t, "'%s' is no verb; 'help' lists them", name);
    if (v->needs_one && t->s == NULL && t->l->e->station_count > 1) {
        t->at--;
        return telling_wrong(t, "which controller? Write @%s before it, or another one's name",
                             t->l->e->stations[0].name);
    }
    if (v->carry_out(t))
        return true;
    const size_t length = strlen(t->why);
    if (length < sizeof t->why && !t->has_usage)
        (void)snprintf(t->why + length, sizeof t->why - length, " (%s%s%s)", v->name, *v->usage == '\0' ? "" : " ",
                       v->usage);
    t->has_usage = true;
    return false;
}

static bool carry_out(telling *t, char *line) { return cut(t, line) && carry_out_words(t); }

/* The word that is wrong: it is quoted where it has been taken, else it is the one that comes next. */
static unsigned column_of_wrong(const telling *t, const char *text, size_t length)
{
    for (unsigned back = 0; back < 2 && back <= t->at; back++) {
        const char *const word = t->words[t->at - back];
        if (word != NULL && t->why[0] == '\'' && strncmp(t->why + 1, word, strlen(word)) == 0 &&
            t->why[1 + strlen(word)] == '\'')
            return (unsigned)(word - text) + 1u;
    }
    return t->words[t->at] != NULL ? (unsigned)(t->words[t->at] - text) + 1u : (unsigned)length + 1u;
}

bool language_check(language *l, const char *line, char why[WHY_ROOM], unsigned *column)
{
    telling t;
    char text[LANGUAGE_LINE];
    memset(&t, 0, sizeof t);
    t.l = l;
    t.is_check = true;
    if ((size_t)snprintf(text, sizeof text, "%s", line) >= sizeof text) {
        *column = LANGUAGE_LINE;
        (void)snprintf(why, WHY_ROOM, "the line is longer than %u characters", LANGUAGE_LINE - 1u);
        return false;
    }
    t.answer = cJSON_CreateObject();
    (void)carry_out(&t, text);
    cJSON_Delete(t.answer);
    if (t.was_read)
        return true;
    *column = column_of_wrong(&t, text, strcspn(line, "\r\n"));
    memcpy(why, t.why, sizeof t.why);
    return false;
}

cJSON *language_do(language *l, const char *line, bool *follows)
{
    telling t;
    char text[LANGUAGE_LINE];
    memset(&t, 0, sizeof t);
    t.l = l;
    t.answer = cJSON_CreateObject();
    (void)cJSON_AddTrueToObject(t.answer, "ok");
    const bool fits = (size_t)snprintf(text, sizeof text, "%s", line) < sizeof text;
    if (l->depth == 0)
        engine_catch_up(l->e);
    if (!(fits ? carry_out(&t, text)
               : telling_wrong(&t, "the line is longer than %u characters", LANGUAGE_LINE - 1u))) {
        cJSON_Delete(t.answer);
        t.answer = cJSON_CreateObject();
        (void)cJSON_AddFalseToObject(t.answer, "ok");
        (void)cJSON_AddStringToObject(t.answer, "why", t.why);
    }
    if (follows != NULL)
        *follows = t.follows;
    return t.answer;
}

bool language_done(language *l, const char *line, char why[WHY_ROOM])
{
    cJSON *const answer = language_do(l, line, NULL);
    const char *const error = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(answer, "why"));
    const bool done = error == NULL;
    if (!done)
        (void)snprintf(why, WHY_ROOM, "%s", error);
    cJSON_Delete(answer);
    return done;
}

void language_close(language *l)
{
    verbs_hands_close(l->e);
    for (planned *p = l->e->plans, *next; p != NULL; p = next) {
        next = p->next;
        if (p->strike == strike) {
            engine_unplan(l->e, p);
            free(p);
        }
    }
    while (l->triggers != NULL)
        forget_trigger(l, l->triggers);
}
