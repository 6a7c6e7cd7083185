#include "trace.h"

#include "dr_words.h" /* dr_words_note */

#include <errno.h>
#include <string.h>

#define TEXT 512
#define HEX_WIDTH ((int)(3u * DR_FRAME_MAX))

bool trace_open(trace *t, const char *path, instrument *ins)
{
    memset(t, 0, sizeof *t);
    const bool to_stderr = strcmp(path, "-") == 0;
    t->name = to_stderr ? "stderr" : path;
    t->file = to_stderr ? stderr : fopen(path, "we");
    if (t->file == NULL)
        return false;
    (void)setvbuf(t->file, NULL, _IOLBF, BUFSIZ);
    dr_notes_init(&t->notes, t->ring, TRACE_NOTES);
    ins->controller.notes = &t->notes;
    return true;
}

/* What cannot be written is said once; the emulator goes on without a trace. */
static void give_up(trace *t)
{
    (void)fprintf(stderr, "dryrig-emu: the trace ends here, %s cannot be written: %s\n", t->name, strerror(errno));
    if (t->file != stderr)
        (void)fclose(t->file);
    t->file = NULL;
}

static void tell(trace *t, uint64_t when_us, char direction, const char *hex, const char *text)
{
    if (t->file == NULL)
        return;
    const unsigned long long seconds = when_us / DR_US_PER_S;
    const unsigned micros = (unsigned)(when_us % DR_US_PER_S);
    const int done =
        hex[0] == '\0' ? fprintf(t->file, "%5llu.%06u %c %s\n", seconds, micros, direction, text)
                       : fprintf(t->file, "%5llu.%06u %c %-*s %s\n", seconds, micros, direction, HEX_WIDTH, hex, text);
    if (done < 0)
        give_up(t);
}

static size_t add_hex(char *hex, size_t at, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++)
        at += (size_t)sprintf(hex + at, at == 0 ? "%02X" : " %02X", (unsigned)bytes[i]);
    return at;
}

/* Notes carry the controller's 32-bit clock and are never from the future. */
static uint64_t when_of(const instrument *ins, const dr_note *note)
{
    return ins->now_us - (dr_us)((dr_us)ins->now_us - note->when);
}

static dr_words_context context_of(const instrument *ins, const dr_note *note)
{
    const dr_controller *c = &ins->controller;
    const dr_stage_id stage = note->drive < c->drive_count ? (dr_stage_id)c->drives[note->drive].stage : DR_STAGE_NONE;
    return (dr_words_context){(dr_kind)c->kind, c->firmware, stage};
}

static void tell_streamed(trace *t, const instrument *ins)
{
    if (t->streamed_count == 0)
        return;
    const dr_words_context context = context_of(ins, &t->streamed);
    char hex[3 * DR_FRAME_MAX + 1] = "", last[TEXT], text[2 * TEXT];
    (void)add_hex(hex, 0, t->streamed.bytes, t->streamed.count);
    (void)dr_words_note(last, sizeof last, &context, &t->streamed);
    (void)snprintf(text, sizeof text, "%u streamed position%s, the last: %s", (unsigned)t->streamed_count,
                   t->streamed_count == 1 ? "" : "s", last);
    tell(t, when_of(ins, &t->streamed), '<', hex, text);
    t->streamed_count = 0;
}

static void tell_note(trace *t, const instrument *ins, const dr_note *note)
{
    const dr_words_context context = context_of(ins, note);
    const bool is_interrupt = note->op == DR_OP_MPC_INTERRUPT || note->op == DR_OP_TRIO_INTERRUPT;
    char hex[3 * (DR_FRAME_MAX + 1) + 1] = "", text[TEXT];
    char direction = '-';
    size_t at = 0, skip = 0;
    const char *changed = "";
    if (note->what == DR_NOTE_REQUEST || note->what == DR_NOTE_FILLER || note->what == DR_NOTE_UNKNOWN) {
        direction = '>';
    } else if (note->what == DR_NOTE_REPLY) {
        direction = '<';
        if ((ins->quirks & INSTRUMENT_STOP_SAYS_I) != 0 && is_interrupt) {
            at = add_hex(hex, at, (const uint8_t *)"I", 1);
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
    tell(t, when_of(ins, note), direction, hex, text);
}

void trace_tell(trace *t, const instrument *ins)
{
    dr_note note;
    while (dr_notes_take(&t->notes, &note)) {
        if (note.what == DR_NOTE_STREAM) {
            t->streamed = note;
            t->streamed_count++;
            continue;
        }
        tell_streamed(t, ins);
        tell_note(t, ins, &note);
    }
    if (t->missed != t->notes.missed) {
        char text[64];
        (void)snprintf(text, sizeof text, "%u events are missing here", (unsigned)(t->notes.missed - t->missed));
        trace_event(t, ins, text);
        t->missed = t->notes.missed;
    }
}

void trace_event(trace *t, const instrument *ins, const char *text)
{
    tell_streamed(t, ins);
    tell(t, ins->now_us, '-', "", text);
}

void trace_close(trace *t)
{
    if (t->file == NULL)
        return;
    if (fflush(t->file) != 0 || (t->file != stderr && fclose(t->file) != 0))
        (void)fprintf(stderr, "dryrig-emu: %s is incomplete: %s\n", t->name, strerror(errno));
    t->file = NULL;
}
