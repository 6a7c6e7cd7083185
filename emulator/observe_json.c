#include "observe_json.h"

#include "dr_words.h" /* names, sentences */

#include <stdio.h>
#include <string.h>

static const char *const names[] = {[OBSERVED_FROM_HOST] = "from-host",
                                    [OBSERVED_TO_HOST] = "to-host",
                                    [OBSERVED_LOST] = "lost",
                                    [OBSERVED_NOTE] = "note",
                                    [OBSERVED_OPENED] = "opened",
                                    [OBSERVED_CLOSED] = "closed",
                                    [OBSERVED_TTY] = "tty",
                                    [OBSERVED_FAULT] = "fault",
                                    [OBSERVED_EVENT] = "event",
                                    [OBSERVED_END] = "end"};

static void add_bytes(cJSON *out, const uint8_t *bytes, size_t count)
{
    char hex[3 * 256 + 1] = "";
    for (size_t i = 0; i < count && i < 256; i++)
        (void)snprintf(hex + 3 * i, 4, "%02X ", (unsigned)bytes[i]);
    if (count > 0)
        hex[3 * (count < 256 ? count : 256) - 1] = '\0';
    (void)cJSON_AddStringToObject(out, "bytes", hex);
}

static bool has_steps(dr_note_kind what)
{
    return what == DR_NOTE_LEG || what == DR_NOTE_ARRIVED || what == DR_NOTE_STOPPED || what == DR_NOTE_RESUMED ||
           what == DR_NOTE_PLACED;
}

static void add_note(cJSON *out, const observation *seen)
{
    const dr_note *const note = seen->note;
    const dr_controller *const c = &seen->ins->controller;
    const dr_stage_id stage = note->drive < c->drive_count ? (dr_stage_id)c->drives[note->drive].stage : DR_STAGE_NONE;
    const dr_words_context context = {(dr_kind)c->kind, c->firmware, stage};
    char text[512];
    (void)cJSON_AddStringToObject(out, "note", dr_words_note_name((dr_note_kind)note->what));
    if (note->op != DR_OP_NONE)
        (void)cJSON_AddStringToObject(out, "command", dr_words_command((dr_op)note->op)->name);
    (void)cJSON_AddNumberToObject(out, "device", note->drive + 1);
    if (note->count > 0)
        add_bytes(out, note->bytes, note->count);
    (void)cJSON_AddNumberToObject(out, "value", note->value);
    if (has_steps((dr_note_kind)note->what)) {
        cJSON *const steps = cJSON_AddArrayToObject(out, "steps");
        for (unsigned axis = 0; axis < DR_AXES; axis++)
            (void)cJSON_AddItemToArray(steps, cJSON_CreateNumber(note->steps[axis]));
    }
    (void)dr_words_note(text, sizeof text, &context, note);
    (void)cJSON_AddStringToObject(out, "text", text);
}

cJSON *observe_json(const observation *seen)
{
    cJSON *const out = cJSON_CreateObject();
    (void)cJSON_AddStringToObject(out, "event", names[seen->what]);
    (void)cJSON_AddStringToObject(out, "controller", seen->name);
    (void)cJSON_AddNumberToObject(out, "when_us", (double)seen->when_us);
    if (seen->what == OBSERVED_NOTE)
        add_note(out, seen);
    if (seen->bytes != NULL)
        add_bytes(out, seen->bytes, seen->count);
    if (seen->what == OBSERVED_FROM_HOST)
        (void)cJSON_AddNumberToObject(out, "pause_us", seen->pause_us);
    if (seen->what == OBSERVED_FROM_HOST || seen->what == OBSERVED_CLOSED)
        (void)cJSON_AddNumberToObject(out, "unread", seen->unread);
    if (seen->what == OBSERVED_TTY)
        (void)cJSON_AddNumberToObject(out, "baud", seen->baud);
    if (seen->text != NULL && *seen->text != '\0')
        (void)cJSON_AddStringToObject(out, "text", seen->text);
    return out;
}
