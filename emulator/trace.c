#define _POSIX_C_SOURCE 200809L /* poll, fileno */
#include "trace.h"

#include "observe_json.h" /* for programs */
#include "recording.h"    /* a file that may be a pipe */

#include "dr_words.h" /* dr_words_note */

#include <errno.h>
#include <poll.h>
#include <string.h>

#define TEXT 512
#define JSON_LINES ".jsonl"
#define HEX_WIDTH ((int)(3u * DR_FRAME_MAX))

static void see(observer *o, const observation *seen);

bool trace_open(trace *t, const char *path, bool has_names)
{
    memset(t, 0, sizeof *t);
    t->base.see = see;
    const bool to_stderr = strcmp(path, "-") == 0;
    t->path = to_stderr ? "stderr" : path;
    t->file = to_stderr ? stderr : recording_file(path);
    if (t->file == NULL)
        return false;
    (void)setvbuf(t->file, NULL, _IOLBF, BUFSIZ);
    t->is_on = true;
    t->is_json =
        strlen(path) >= strlen(JSON_LINES) && strcmp(path + strlen(path) - strlen(JSON_LINES), JSON_LINES) == 0;
    t->has_names = has_names;
    return true;
}

/* What cannot be written is said once; the emulator goes on without a trace. */
static void give_up(trace *t)
{
    (void)fprintf(stderr, "dryrig-emu: the trace ends here, %s cannot be written: %s\n", t->path, strerror(errno));
    t->is_incomplete = t->file != stderr;
    if (t->file != stderr)
        (void)fclose(t->file);
    t->file = NULL;
}

/* A pipe or a terminal that has room for anything has room for a line. */
static bool has_room(const trace *t)
{
    struct pollfd file = {.fd = fileno(t->file), .events = POLLOUT};
    return poll(&file, 1, 0) != 0;
}

static void put(trace *t, const char *name, uint64_t when_us, char direction, const char *hex, const char *text)
{
    const unsigned long long seconds = when_us / DR_US_PER_S;
    const unsigned micros = (unsigned)(when_us % DR_US_PER_S);
    const int width = hex[0] == '\0' ? 0 : HEX_WIDTH;
    const int named = t->has_names ? fprintf(t->file, "%-8s ", name) : 0;
    const int done = fprintf(t->file, "%5llu.%06u %c %-*s%s%s\n", seconds, micros, direction, width, hex,
                             width > 0 ? " " : "", text);
    if (named < 0 || done < 0)
        give_up(t);
}

/* Who starts a trace and does not read it does not hold the controller up, and can still end the emulator. */
static void tell(trace *t, const char *name, uint64_t when_us, char direction, const char *hex, const char *text)
{
    if (t->file != NULL && t->lost > 0 && has_room(t)) {
        char lost[TEXT];
        (void)snprintf(lost, sizeof lost, "%u lines of the trace are lost, nobody took them", (unsigned)t->lost);
        t->lost = 0;
        put(t, name, when_us, '-', "", lost);
    }
    if (t->file == NULL)
        return;
    if (has_room(t))
        put(t, name, when_us, direction, hex, text);
    else
        t->lost++;
}

static size_t add_hex(char *hex, size_t at, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++)
        at += (size_t)sprintf(hex + at, at == 0 ? "%02X" : " %02X", (unsigned)bytes[i]);
    return at;
}

static dr_words_context context_of(const instrument *ins, const dr_note *note)
{
    const dr_controller *c = &ins->controller;
    const dr_stage_id stage = note->drive < c->drive_count ? (dr_stage_id)c->drives[note->drive].stage : DR_STAGE_NONE;
    return (dr_words_context){(dr_kind)c->kind, c->firmware, stage};
}

static void tell_streamed(trace *t)
{
    if (t->streamed_count == 0)
        return;
    const dr_words_context context = context_of(t->streaming, &t->streamed);
    char hex[3 * DR_FRAME_MAX + 1] = "", last[TEXT], text[2 * TEXT];
    (void)add_hex(hex, 0, t->streamed.bytes, t->streamed.count);
    (void)dr_words_note(last, sizeof last, &context, &t->streamed);
    (void)snprintf(text, sizeof text, "%u streamed position%s, the last: %s", (unsigned)t->streamed_count,
                   t->streamed_count == 1 ? "" : "s", last);
    t->streamed_count = 0;
    tell(t, t->streaming_name, t->streamed_us, '<', hex, text);
}

static void tell_note(trace *t, const observation *seen)
{
    const dr_note *const note = seen->note;
    const instrument *const ins = seen->ins;
    const dr_words_context context = context_of(ins, note);
    const bool is_interrupt = note->op == DR_OP_MPC_INTERRUPT || note->op == DR_OP_TRIO_INTERRUPT;
    char hex[3 * (DR_FRAME_MAX + 1) + 1] = "", text[TEXT];
    char direction = '-';
    size_t at = 0, skip = 0;
    const char *changed = "";
    const bool is_stop = t->stopped == ins; /* by hand, and this is the CR of the move that it ended */
    const bool stops = note->what == DR_NOTE_HAND && note->value == DR_EFFECT_STOP;
    t->stopped = stops || (is_stop && note->what == DR_NOTE_STOPPED) ? ins : NULL;
    if (note->what == DR_NOTE_REQUEST || note->what == DR_NOTE_FILLER || note->what == DR_NOTE_UNKNOWN) {
        direction = '>';
    } else if (note->what == DR_NOTE_REPLY) {
        direction = '<';
        if ((ins->quirks & INSTRUMENT_STOP_SAYS_I) != 0 && (is_interrupt || is_stop)) {
            at = add_hex(hex, at, (const uint8_t *)"I", 1); /* before the CR, or in its place */
            skip = is_stop ? 1 : 0;
            changed = " (quirk stop-says-i)";
        } else if ((ins->quirks & INSTRUMENT_POSITION_13) != 0 && note->op == DR_OP_MPC_POSITION) {
            skip = 1;
            changed = " (quirk position-13: the drive is not sent)";
        }
    }
    (void)add_hex(hex, at, note->bytes + skip, note->count - skip);
    const size_t length = dr_words_note(text, sizeof text, &context, note);
    if (length < sizeof text)
        (void)snprintf(text + length, sizeof text - length, "%s", changed);
    tell(t, seen->name, seen->when_us, direction, hex, text);
}

static void tell_json(trace *t, const observation *seen)
{
    if (!has_room(t)) {
        t->lost++;
        return;
    }
    if (t->lost > 0)
        (void)fprintf(t->file, "{\"lost_lines\":%u}\n", (unsigned)t->lost);
    t->lost = 0;
    cJSON *const object = observe_json(seen);
    char *const text = cJSON_PrintUnformatted(object);
    if (text == NULL || fprintf(t->file, "%s\n", text) < 0)
        give_up(t);
    cJSON_free(text);
    cJSON_Delete(object);
}

static void see(observer *o, const observation *seen)
{
    trace *const t = (trace *)o;
    if (t->file == NULL || !t->is_on)
        return;
    if (t->is_json) {
        tell_json(t, seen);
        return;
    }
    const bool is_note = seen->what == OBSERVED_NOTE;
    if (is_note && seen->note->what == DR_NOTE_STREAM) {
        if (t->streaming != seen->ins)
            tell_streamed(t);
        t->streaming = seen->ins;
        t->streaming_name = seen->name;
        t->streamed_us = seen->when_us;
        t->streamed = *seen->note;
        t->streamed_count++;
        return;
    }
    switch (seen->what) {
    case OBSERVED_NOTE:
        tell_streamed(t);
        tell_note(t, seen);
        break;
    case OBSERVED_OPENED:
    case OBSERVED_CLOSED:
    case OBSERVED_FAULT:
    case OBSERVED_EVENT:
        tell_streamed(t);
        tell(t, seen->name, seen->when_us, '-', "", seen->text);
        break;
    case OBSERVED_TO_HOST:
    case OBSERVED_LOST: /* a NUL is no answer, so there is no note of it */
        if (seen->ins->sent != INSTRUMENT_NUL)
            break;
        tell_streamed(t);
        tell(t, seen->name, seen->when_us, '<', "00", "NUL during a move (quirk nul-heartbeat)");
        break;
    case OBSERVED_FROM_HOST: /* the notes tell what they mean */
    case OBSERVED_TTY:
    case OBSERVED_END:
        break;
    }
}

bool trace_close(trace *t)
{
    if (t->file != NULL)
        tell_streamed(t);  /* which may be what cannot be written */
    if (t->file == stderr) /* who has closed it does not want to know */
        (void)fflush(stderr);
    else if (t->file != NULL && fclose(t->file) != 0) {
        (void)fprintf(stderr, "dryrig-emu: %s is incomplete: %s\n", t->path, strerror(errno));
        t->is_incomplete = true;
    }
    t->file = NULL;
    return !t->is_incomplete;
}
