#include "record.h"

#include "dr_recording.h" /* which kinds of lines there are */
#include "dr_words.h"     /* names of stages and quirks */

#include <string.h>

#define NS_PER_US UINT64_C(1000)
#define TEXT 512u

static void see(observer *o, const observation *seen);

bool recorder_open(recorder *r, const char *path)
{
    memset(r, 0, sizeof *r);
    r->base.see = see;
    return recording_open(&r->to, "dryrig-emu", path);
}

static void set_point(recorder *r, const char *name, const char *key, const uint32_t steps[DR_AXES])
{
    char text[64];
    (void)snprintf(text, sizeof text, "%lu,%lu,%lu", (unsigned long)steps[DR_X], (unsigned long)steps[DR_Y],
                   (unsigned long)steps[DR_Z]);
    recording_set(&r->to, name, key, text);
}

static void set_quirks(recorder *r, const char *name, const instrument *ins)
{
    static const struct {
        dr_quirk_id id;
        uint8_t bit;
    } of_bytes[] = {{DR_QUIRK_ID_POSITION_13, INSTRUMENT_POSITION_13},
                    {DR_QUIRK_ID_STOP_SAYS_I, INSTRUMENT_STOP_SAYS_I},
                    {DR_QUIRK_ID_NUL_HEARTBEAT, INSTRUMENT_NUL_HEARTBEAT}};
    char text[TEXT] = "";
    size_t at = 0;
    for (unsigned i = 0; i < DR_QUIRK_IDS; i++) {
        const dr_quirk_words *const w = dr_words_quirk((dr_quirk_id)i);
        bool is_on = (w->core & ins->controller.quirks) != 0;
        for (unsigned k = 0; k < sizeof of_bytes / sizeof of_bytes[0]; k++)
            is_on = is_on || (of_bytes[k].id == (dr_quirk_id)i && (of_bytes[k].bit & ins->quirks) != 0);
        if (is_on)
            at += (size_t)snprintf(text + at, sizeof text - at, "%s%s", at == 0 ? "" : ",", w->name);
    }
    if (at > 0)
        recording_set(&r->to, name, "quirks", text);
}

/* How steep the diagonal is, as --angle has it [M table 2]. */
static const char *diagonal_name(uint8_t value)
{
    static const char *const names[DR_DIAGONALS] = {"11more", "14more", "21more", "27more", "29more", "35more",
                                                    "39more", "45",     "39",     "35",     "29",     "27",
                                                    "21",     "14",     "11",     "7"};
    return names[value % DR_DIAGONALS];
}

void recorder_introduce(recorder *r, const char *name, const instrument *ins)
{
    const dr_controller *const c = &ins->controller;
    char text[16];
    recording_set(&r->to, name, "controller", dr_words_kind((dr_kind)c->kind));
    (void)dr_words_firmware(text, sizeof text, c->firmware);
    recording_set(&r->to, name, "firmware", text);
    for (uint8_t i = 0; i < c->drive_count; i++) {
        const dr_drive *const d = &c->drives[i];
        recording_set(&r->to, name, "device", dr_words_stage((dr_stage_id)d->stage));
    }
    bool has_work = true; /* as with --work: the first so many of those that are connected */
    for (uint8_t i = 0; i < c->drive_count; i++) {
        const dr_drive *const d = &c->drives[i];
        if (d->stage == DR_STAGE_NONE)
            continue;
        set_point(r, name, "position", d->position_steps);
        has_work = has_work && d->work_is_set;
        if (has_work)
            set_point(r, name, "work", d->work_steps);
    }
    if (c->kind == DR_TRIO) {
        set_point(r, name, "home", c->home_steps);
        (void)snprintf(text, sizeof text, "%u", (unsigned)c->angle_deg);
        recording_set(&r->to, name, "angle", text);
    } else {
        recording_set(&r->to, name, "angle", diagonal_name(c->drives[0].diagonal));
    }
    set_quirks(r, name, ins);
    recording_set(&r->to, name, "pace", ins->is_paced ? "on" : "off");
}

static void see(observer *o, const observation *seen)
{
    recorder *const r = (recorder *)o;
    if (!r->has_begun) {
        r->has_begun = true;
        r->epoch_ns = seen->real_ns;
    }
    const uint64_t real_us = (seen->real_ns - r->epoch_ns) / NS_PER_US;
    switch (seen->what) {
    case OBSERVED_FROM_HOST:
        recording_bytes(&r->to, seen->when_us, real_us, seen->name, DR_RECORDING_FROM_HOST, seen->bytes, seen->count);
        break;
    case OBSERVED_TO_HOST:
        recording_bytes(&r->to, seen->when_us, real_us, seen->name, DR_RECORDING_TO_HOST, seen->bytes, seen->count);
        break;
    case OBSERVED_LOST:
        recording_bytes(&r->to, seen->when_us, real_us, seen->name, DR_RECORDING_LOST, seen->bytes, seen->count);
        break;
    case OBSERVED_OPENED:
    case OBSERVED_CLOSED:
    case OBSERVED_FAULT:
    case OBSERVED_EVENT:
        recording_event(&r->to, seen->when_us, real_us, seen->name, seen->text);
        break;
    case OBSERVED_NOTE:
    case OBSERVED_TTY:
    case OBSERVED_END:
        break;
    }
}

bool recorder_close(recorder *r) { return recording_close(&r->to); }
