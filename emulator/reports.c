#include "reports.h"

#include "lint_report.h" /* for people and programs */

#include <errno.h>
#include <stdlib.h>
#include <string.h>

static bool cannot(const char *option, const char *path)
{
    (void)fprintf(stderr, "dryrig-emu: --%s %s: %s\n", option, path, strerror(errno));
    return false;
}

static bool open_file(const char *option, const char *path, FILE **file)
{
    return path == NULL || (*file = recording_file(path)) != NULL || cannot(option, path);
}

static void look_on(station *s, observer_link *link, observer *who)
{
    link->who = who;
    station_observe(s, link);
}

bool reports_open(reports *r, const options *o, station *stations, unsigned station_count)
{
    memset(r, 0, sizeof *r);
    r->o = o;
    r->links = calloc(3u * (size_t)station_count, sizeof *r->links);
    if (r->links == NULL) {
        (void)fprintf(stderr, "dryrig-emu: no memory\n");
        return false;
    }
    if (o->lints) {
        lint_open(&r->lint);
        r->lint.runs_ahead = o->clock == CLOCK_JUMP ? "--clock jump" : o->speedup > 1 ? "--speedup" : NULL;
    }
    if (o->trace != NULL && !trace_open(&r->trace, o->trace, station_count > 1))
        return cannot("trace", o->trace);
    if (!open_file("lint-json", o->lint_json, &r->lint_json) || !open_file("lint-junit", o->lint_junit, &r->lint_junit))
        return false;
    if (o->record != NULL && !recorder_open(&r->recorder, o->record))
        return cannot("record", o->record);
    for (unsigned i = 0; i < station_count; i++) {
        station *const s = &stations[i];
        if (o->trace != NULL)
            look_on(s, &r->links[3u * i], &r->trace.base);
        if (o->lints)
            look_on(s, &r->links[3u * i + 1u], &r->lint.base);
        if (o->record == NULL)
            continue;
        recorder_introduce(&r->recorder, s->name, &s->ins);
        look_on(s, &r->links[3u * i + 2u], &r->recorder.base);
    }
    return true;
}

void reports_stop(reports *r)
{
    const bool has_trace = trace_close(&r->trace), has_recording = recorder_close(&r->recorder);
    r->is_incomplete = !has_trace || !has_recording;
}

static void close_report(reports *r, const char *path, FILE *file, bool done)
{
    if (fclose(file) == 0 && done)
        return;
    (void)fprintf(stderr, "dryrig-emu: %s is incomplete: %s\n", path, strerror(errno));
    r->is_incomplete = true;
}

bool reports_finish(reports *r, unsigned long *findings)
{
    *findings = lint_total(&r->lint);
    (void)lint_report_text(&r->lint, stderr); /* who has closed stderr does not want to know */
    if (r->lint_json != NULL)
        close_report(r, r->o->lint_json, r->lint_json, lint_report_json(&r->lint, r->lint_json));
    if (r->lint_junit != NULL)
        close_report(r, r->o->lint_junit, r->lint_junit, lint_report_junit(&r->lint, r->lint_junit));
    lint_close(&r->lint);
    free(r->links);
    return !r->is_incomplete;
}
