/* Verbs for faults: what goes wrong, when and how often (faults.h). */
#include "language.h"

#include "dr_words.h" /* names of commands */

#include <stdio.h>
#include <string.h>

#define TIMES_MAX 100u

static const char *const axes[DR_AXES] = {"x", "y", "z"};

static faults *faults_of(const telling *t) { return &t->s->ins.faults; }

static bool wrong_name(telling *t, const char *name)
{
    char why[WHY_ROOM] = "expected off";
    size_t length = strlen(why);
    for (unsigned i = 0; i < FAULTS && length < sizeof why; i++)
        length += (size_t)snprintf(why + length, sizeof why - length, ", %s", faults_words((fault_id)i)->name);
    return telling_about(t, name, why);
}

static bool read_number(telling *t, uint32_t *number)
{
    char why[WHY_ROOM];
    unsigned value;
    const char *const word = telling_word(t);
    if (!values_number(word, 1, 1000000, &value, why))
        return telling_about(t, word, why);
    *number = value;
    return true;
}

static bool read_chance(telling *t, uint32_t *millionths)
{
    char why[WHY_ROOM];
    const char *const word = telling_word(t);
    return values_millionths(word, millionths, why) || telling_about(t, word, why);
}

static bool read_axis(telling *t, uint8_t *axis)
{
    for (*axis = 0; *axis < DR_AXES; (*axis)++)
        if (telling_take(t, axes[*axis]))
            return true;
    return telling_about(t, t->words[t->at], "expected an axis: x, y or z");
}

/* How many times as long. */
static bool read_times(telling *t, uint8_t *times)
{
    char why[WHY_ROOM];
    unsigned value;
    if (!values_number(telling_next(t), 2, TIMES_MAX, &value, why))
        return telling_about(t, t->words[t->at - 1], why);
    *times = (uint8_t)value;
    return true;
}

/* Can the fault strike this command at all? */
static bool can_strike(telling *t, const fault_words *words, dr_op op)
{
    dr_command command;
    const char *const word = t->words[t->at - 1];
    const dr_controller *const c = &t->s->ins.controller;
    if (!dr_command_for((dr_kind)c->kind, c->firmware, op, &command))
        return true;
    switch ((fault_chance)words->strikes) {
    case FAULT_OF_HOST_BYTE:
        return telling_wrong(t, "'%s': a byte that is lost belongs to no command yet: say 'on S fault ...'", word);
    case FAULT_OF_STOP:
        return (command.is & DR_IS_INTERRUPT) != 0 || telling_wrong(t, "'%s': it is about ^C alone", word);
    case FAULT_OF_FRAME:
        return op == DR_OP_MPC_LINE || telling_wrong(t, "'%s': positions are streamed by S of an MPC-200 alone", word);
    case FAULT_OF_LEG:
    case FAULT_OF_MOVE:
        return (command.is & DR_IS_MOTION) != 0 || telling_wrong(t, "'%s': expected a command that moves", word);
    case FAULT_OF_ANSWER:
    case FAULT_OF_COMMAND:
        break;
    }
    return true;
}

/* When and how often. What is said by chance, or of a span of time, holds always, else once, where nothing is said. */
static bool read_when(telling *t, fault_rule *r)
{
    dr_op op;
    bool has_count = false, has_limits = false;
    while (t->words[t->at] != NULL) {
        bool done;
        if (telling_take(t, "next")) {
            has_count = true;
            r->left = 1;
            const char *const word = t->words[t->at];
            done = word == NULL || word[strspn(word, "0123456789")] != '\0' || read_number(t, &r->left);
        } else if (telling_take(t, "always")) {
            has_count = done = true;
            r->left = FAULT_ALWAYS;
        } else if (telling_take(t, "on")) {
            done = telling_command(t, &op) && can_strike(t, faults_words((fault_id)r->id), op);
            r->op = done ? (uint8_t)op : r->op;
        } else if (telling_take(t, "chance")) {
            has_limits = true;
            done = read_chance(t, &r->chance_millionths);
        } else if (telling_take(t, "from")) {
            has_limits = true;
            done = telling_time(t, &r->from_us);
        } else if (telling_take(t, "until")) {
            has_limits = true;
            done = telling_time(t, &r->until_us);
        } else {
            return telling_wrong(t, "'%s': expected next, always, on, chance, from or until", t->words[t->at]);
        }
        if (!done)
            return false;
        if (r->from_us >= r->until_us)
            return telling_wrong(t, "'%s': from must be before until, or it can never strike", t->words[t->at - 1]);
    }
    if (!has_count)
        r->left = has_limits ? FAULT_ALWAYS : 1;
    return true;
}

static bool do_fault(telling *t)
{
    fault_id id;
    fault_rule r = {.left = 1, .chance_millionths = FAULT_SURE, .until_us = UINT64_MAX};
    if (telling_take(t, "off")) {
        if (!telling_ends(t))
            return false;
        faults_remove(faults_of(t), FAULTS);
        return true;
    }
    const char *const name = telling_next(t);
    if (name == NULL || !faults_find(name, &id))
        return wrong_name(t, name);
    if (telling_take(t, "off")) {
        if (!telling_ends(t))
            return false;
        faults_remove(faults_of(t), id);
        return true;
    }
    const fault_words *const words = faults_words(id);
    r.id = (uint8_t)id;
    r.delay_us = words->delay_us;
    r.times = words->times;
    if (words->takes_axis && !read_axis(t, &r.axis))
        return false;
    const char *const word = t->words[t->at];
    const bool has_number = word != NULL && strspn(word, "0123456789") > 0;
    if (words->delay_us > 0 && has_number && !telling_time(t, &r.delay_us))
        return false;
    if (words->times > 0 && has_number && !read_times(t, &r.times))
        return false;
    if (!read_when(t, &r) || !telling_ends(t))
        return false;
    faults_look(faults_of(t), t->s->ins.now_us, &t->s->ins.controller); /* the leg that has begun is spared */
    return faults_add(faults_of(t), &r) ||
           telling_wrong(t, "%u rules are all that there is room for; 'fault off' forgets them", FAULT_RULES);
}

static cJSON *rule_json(const fault_rule *r)
{
    cJSON *const out = cJSON_CreateObject();
    (void)cJSON_AddStringToObject(out, "fault", faults_words((fault_id)r->id)->name);
    if (faults_words((fault_id)r->id)->takes_axis)
        (void)cJSON_AddStringToObject(out, "axis", axes[r->axis % DR_AXES]);
    if (r->left != FAULT_ALWAYS)
        (void)cJSON_AddNumberToObject(out, "left", r->left);
    if (r->op != DR_OP_NONE)
        (void)cJSON_AddStringToObject(out, "command", dr_words_command((dr_op)r->op)->name);
    if (r->chance_millionths < FAULT_SURE)
        (void)cJSON_AddNumberToObject(out, "chance", r->chance_millionths / 1e6);
    if (r->from_us > 0)
        (void)cJSON_AddNumberToObject(out, "from_us", (double)r->from_us);
    if (r->until_us < UINT64_MAX)
        (void)cJSON_AddNumberToObject(out, "until_us", (double)r->until_us);
    if (r->delay_us > 0)
        (void)cJSON_AddNumberToObject(out, "delay_us", (double)r->delay_us);
    if (r->times > 0)
        (void)cJSON_AddNumberToObject(out, "times", r->times);
    return out;
}

static bool do_faults(telling *t)
{
    if (!telling_ends(t))
        return false;
    cJSON *const active = cJSON_AddArrayToObject(t->answer, "active");
    for (uint8_t i = 0; t->s != NULL && i < faults_of(t)->count; i++)
        (void)cJSON_AddItemToArray(active, rule_json(&faults_of(t)->rules[i]));
    cJSON *const list = cJSON_AddArrayToObject(t->answer, "faults");
    for (unsigned i = 0; i < FAULTS; i++) {
        const fault_words *const words = faults_words((fault_id)i);
        cJSON *const entry = cJSON_CreateObject();
        (void)cJSON_AddStringToObject(entry, "fault", words->name);
        (void)cJSON_AddStringToObject(entry, "does", words->meaning);
        if (words->delay_us > 0)
            (void)cJSON_AddNumberToObject(entry, "delay_us", words->delay_us);
        if (words->times > 0)
            (void)cJSON_AddNumberToObject(entry, "times", words->times);
        (void)cJSON_AddBoolToObject(entry, "takes_axis", words->takes_axis);
        (void)cJSON_AddItemToArray(list, entry);
    }
    return true;
}

const verb verbs_fault[] = {
    {"fault", "NAME [AXIS|TIME|TIMES] [next [N]|always] [on S] [chance P] [from TIME] [until TIME] | [NAME] off",
     "something goes wrong: once, where nothing else is said", true, do_fault},
    {"faults", "", "list what can go wrong, and what is about to", false, do_faults},
    {NULL, NULL, NULL, false, NULL}};
