#include "lint_report.h"

#include "dr_words.h" /* what the bytes say */

#include <cjson/cJSON.h>
#include <stdlib.h>

#define TEXT 512u
#define HEX_ROOM (3u * DR_FRAME_MAX + 1u)
#define JSON_FORMAT 1 /* of the report; grows when a reader of the old one would be wrong */

static void hex_of(char hex[HEX_ROOM], const lint_finding *f)
{
    size_t at = 0;
    hex[0] = '\0';
    for (unsigned i = 0; i < f->count; i++)
        at += (size_t)snprintf(hex + at, HEX_ROOM - at, i == 0 ? "%02X" : " %02X", (unsigned)f->bytes[i]);
}

/* What the host asked for; without microns: which drive was active then is not kept. */
static void meaning_of(char *out, size_t room, const lint *l, const lint_finding *f)
{
    const lint_station *const s = &l->stations[f->station];
    const dr_words_context context = {s->kind, s->firmware, DR_STAGE_NONE};
    out[0] = '\0';
    if (f->count > 0)
        (void)dr_words_request(out, room, &context, f->bytes, f->count);
}

static unsigned long long seconds_of(const lint_finding *f) { return f->when_us / DR_US_PER_S; }
static unsigned micros_of(const lint_finding *f) { return (unsigned)(f->when_us % DR_US_PER_S); }

static const char *plural(unsigned long count) { return count == 1 ? "" : "s"; }

/* -- For people ---------------------------------------------------------------------------------------------------------- */

static void tell_rule(const lint *l, lint_rule rule, FILE *file)
{
    const lint_words *const w = lint_words_of(rule);
    unsigned long left = l->counts[rule];
    unsigned shown = 0;
    (void)fprintf(file, "\n%u %s, %lu time%s\n  %s\n  %s\n", lint_number(rule), w->name, left, plural(left), w->breach,
                  w->source);
    for (unsigned i = 0; i < l->finding_count && shown < LINT_SHOWN; i++) {
        const lint_finding *const f = &l->findings[i];
        if (f->rule != rule)
            continue;
        char hex[HEX_ROOM], meaning[TEXT];
        hex_of(hex, f);
        meaning_of(meaning, sizeof meaning, l, f);
        (void)fprintf(file, "    %s%sat %llu.%06u s: %s\n", l->station_count > 1 ? l->stations[f->station].name : "",
                      l->station_count > 1 ? " " : "", seconds_of(f), micros_of(f), f->text);
        if (f->count > 0)
            (void)fprintf(file, "        %s  %s\n", hex, meaning);
        shown++;
    }
    if (left > shown)
        (void)fprintf(file, "    and %lu more\n", left - shown);
    (void)fprintf(file, "  Instead: %s\n", w->instead);
}

bool lint_report_text(const lint *l, FILE *file)
{
    const unsigned long total = lint_total(l);
    unsigned rules = 0;
    for (unsigned i = 0; i < LINT_RULES; i++)
        rules += l->counts[i] > 0 ? 1 : 0;
    if (l->late_stops > 0)
        (void)fprintf(
            file,
            "dryrig-emu: with %s a move was over before its ^C came. %lu time%s the host read one CR where there were "
            "two, the move's and ^C's, and was a byte behind from then on, which is not judged. Use --clock step, or "
            "real "
            "time, where programs stop moves.\n",
            l->runs_ahead, l->late_stops, plural(l->late_stops));
    if (total == 0)
        return true;
    (void)fprintf(file,
                  "dryrig-emu lint: the host broke %u rule%s of the protocol, %lu time%s in all.\n"
                  "Times are the controller's. [T], [M], [O], [R]: the sources, see PROTOCOL.md.\n",
                  rules, plural(rules), total, plural(total));
    for (unsigned i = 0; i < LINT_RULES; i++)
        if (l->counts[i] > 0)
            tell_rule(l, (lint_rule)i, file);
    return fflush(file) == 0 && ferror(file) == 0;
}

/* -- For programs -------------------------------------------------------------------------------------------------------- */

static cJSON *json_rule(const lint *l, lint_rule rule)
{
    const lint_words *const w = lint_words_of(rule);
    cJSON *const item = cJSON_CreateObject();
    (void)cJSON_AddNumberToObject(item, "number", lint_number(rule));
    (void)cJSON_AddStringToObject(item, "name", w->name);
    (void)cJSON_AddNumberToObject(item, "count", (double)l->counts[rule]);
    (void)cJSON_AddStringToObject(item, "breach", w->breach);
    (void)cJSON_AddStringToObject(item, "source", w->source);
    (void)cJSON_AddStringToObject(item, "instead", w->instead);
    return item;
}

static cJSON *json_finding(const lint *l, const lint_finding *f)
{
    char hex[HEX_ROOM], meaning[TEXT];
    hex_of(hex, f);
    meaning_of(meaning, sizeof meaning, l, f);
    cJSON *const item = cJSON_CreateObject();
    (void)cJSON_AddNumberToObject(item, "rule", lint_number(f->rule));
    (void)cJSON_AddStringToObject(item, "name", lint_words_of(f->rule)->name);
    (void)cJSON_AddStringToObject(item, "station", l->stations[f->station].name);
    (void)cJSON_AddNumberToObject(item, "time_us", (double)f->when_us);
    (void)cJSON_AddStringToObject(item, "bytes", hex);
    (void)cJSON_AddStringToObject(item, "command", meaning);
    (void)cJSON_AddStringToObject(item, "text", f->text);
    return item;
}

bool lint_report_json(const lint *l, FILE *file)
{
    cJSON *const root = cJSON_CreateObject();
    (void)cJSON_AddNumberToObject(root, "format", JSON_FORMAT);
    (void)cJSON_AddNumberToObject(root, "count", (double)lint_total(l));
    cJSON *const rules = cJSON_AddArrayToObject(root, "rules");
    for (unsigned i = 0; i < LINT_RULES; i++)
        (void)cJSON_AddItemToArray(rules, json_rule(l, (lint_rule)i));
    cJSON *const findings = cJSON_AddArrayToObject(root, "findings");
    for (unsigned i = 0; i < l->finding_count; i++)
        (void)cJSON_AddItemToArray(findings, json_finding(l, &l->findings[i]));
    char *const text = cJSON_Print(root);
    const bool done = text != NULL && fprintf(file, "%s\n", text) > 0 && fflush(file) == 0;
    cJSON_free(text);
    cJSON_Delete(root);
    return done;
}

/* -- For CI servers ------------------------------------------------------------------------------------------------------ */

static void put_escaped(const char *text, FILE *file)
{
    for (; *text != '\0'; text++) {
        const unsigned char c = (unsigned char)*text;
        switch (c) {
        case '&':
            (void)fputs("&amp;", file);
            break;
        case '<':
            (void)fputs("&lt;", file);
            break;
        case '>':
            (void)fputs("&gt;", file);
            break;
        case '"':
            (void)fputs("&quot;", file);
            break;
        default: /* XML has no control characters, escaped or not */
            (void)fputc(c < 0x20 ? '?' : c, file);
            break;
        }
    }
}

static void junit_failure(const lint *l, lint_rule rule, FILE *file)
{
    const lint_words *const w = lint_words_of(rule);
    (void)fprintf(file, "    <failure type=\"%s\" message=\"", w->name);
    put_escaped(w->breach, file);
    (void)fprintf(file, "\">%lu time%s. ", l->counts[rule], plural(l->counts[rule]));
    put_escaped(w->source, file);
    (void)fputs(". Instead: ", file);
    put_escaped(w->instead, file);
    (void)fputc('\n', file);
    for (unsigned i = 0; i < l->finding_count; i++) {
        const lint_finding *const f = &l->findings[i];
        if (f->rule != rule)
            continue;
        char hex[HEX_ROOM];
        hex_of(hex, f);
        put_escaped(l->stations[f->station].name, file);
        (void)fprintf(file, " at %llu.%06u s: %s%s", seconds_of(f), micros_of(f), hex, f->count > 0 ? ": " : "");
        put_escaped(f->text, file);
        (void)fputc('\n', file);
    }
    (void)fputs("    </failure>\n", file);
}

bool lint_report_junit(const lint *l, FILE *file)
{
    unsigned failures = 0;
    for (unsigned i = 0; i < LINT_RULES; i++)
        failures += l->counts[i] > 0 ? 1 : 0;
    (void)fprintf(file,
                  "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                  "<testsuites>\n<testsuite name=\"dryrig-lint\" tests=\"%u\" failures=\"%u\">\n",
                  (unsigned)LINT_RULES, failures);
    for (unsigned i = 0; i < LINT_RULES; i++) {
        (void)fprintf(file, "  <testcase classname=\"dryrig-lint\" name=\"%02u %s\">\n", lint_number((lint_rule)i),
                      lint_words_of((lint_rule)i)->name);
        if (l->counts[i] > 0)
            junit_failure(l, (lint_rule)i, file);
        (void)fputs("  </testcase>\n", file);
    }
    (void)fputs("</testsuite>\n</testsuites>\n", file);
    return fflush(file) == 0 && ferror(file) == 0;
}
