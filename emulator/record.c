#define _GNU_SOURCE /* poll, fileno, fopen "e" */
#include "record.h"

#include "dr_record.h" /* the format */
#include "dr_words.h"  /* names of stages and quirks */

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <sys/stat.h>

#define NS_PER_US UINT64_C(1000)
#define TEXT 512u

static void see(observer *o, const observation *seen);

bool recorder_open(recorder *r, const char *path)
{
    memset(r, 0, sizeof *r);
    r->base.see = see;
    r->path = path;
    struct stat is;
    const bool is_pipe = stat(path, &is) == 0 && S_ISFIFO(is.st_mode);
    const int pipe_fd = is_pipe ? open(path, O_RDWR | O_CLOEXEC) : -1; /* to write alone would wait for a reader */
    r->file = is_pipe ? (pipe_fd < 0 ? NULL : fdopen(pipe_fd, "w")) : fopen(path, "we");
    if (r->file == NULL)
        return false;
    r->is_file = fstat(fileno(r->file), &is) == 0 && S_ISREG(is.st_mode);
    if (!r->is_file)
        (void)setvbuf(r->file, NULL, _IOLBF, BUFSIZ);
    return dr_record_begin(r->file);
}

/* A pipe or a terminal that has room for anything has room for what is seen at once. */
static bool has_room(recorder *r)
{
    struct pollfd file = {.fd = fileno(r->file), .events = POLLOUT};
    if (r->is_file || poll(&file, 1, 0) != 0)
        return true;
    r->lost++;
    if (!r->told_loss)
        (void)fprintf(stderr, "dryrig-emu: nobody reads the recording %s: what it has no room for is lost\n", r->path);
    r->told_loss = true;
    return false;
}

/* What cannot be written is said once; the emulator goes on without. */
static void check(recorder *r, bool done)
{
    if (done)
        return;
    (void)fprintf(stderr, "dryrig-emu: the recording ends here, %s cannot be written: %s\n", r->path, strerror(errno));
    (void)fclose(r->file);
    r->file = NULL;
}

static void set(recorder *r, const char *name, const char *key, const char *value)
{
    if (r->file != NULL && has_room(r))
        check(r, dr_record_set(r->file, name, key, value));
}

static void set_point(recorder *r, const char *name, const char *key, const uint32_t steps[DR_AXES])
{
    char text[64];
    (void)snprintf(text, sizeof text, "%lu,%lu,%lu", (unsigned long)steps[DR_X], (unsigned long)steps[DR_Y],
                   (unsigned long)steps[DR_Z]);
    set(r, name, key, text);
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
        set(r, name, "quirks", text);
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
    set(r, name, "controller", dr_words_kind((dr_kind)c->kind));
    (void)dr_words_firmware(text, sizeof text, c->firmware);
    set(r, name, "firmware", text);
    for (uint8_t i = 0; i < c->drive_count; i++) {
        const dr_drive *const d = &c->drives[i];
        set(r, name, "device", dr_words_stage((dr_stage_id)d->stage));
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
        set(r, name, "angle", text);
    } else {
        set(r, name, "angle", diagonal_name(c->drives[0].diagonal));
    }
    set_quirks(r, name, ins);
    set(r, name, "pace", ins->is_paced ? "on" : "off");
}

static bool is_kept(observed_kind what)
{
    return what != OBSERVED_NOTE && what != OBSERVED_TTY && what != OBSERVED_END;
}

static void see(observer *o, const observation *seen)
{
    recorder *const r = (recorder *)o;
    if (r->file == NULL)
        return;
    if (!r->has_begun) {
        r->has_begun = true;
        r->epoch_ns = seen->real_ns;
    }
    const uint64_t real_us = (seen->real_ns - r->epoch_ns) / NS_PER_US;
    if (!is_kept(seen->what) || !has_room(r))
        return;
    if (r->lost > 0) {
        char text[64];
        (void)snprintf(text, sizeof text, "%u lines are lost here, nobody took them", (unsigned)r->lost);
        r->lost = 0;
        check(r, dr_record_event(r->file, seen->when_us, real_us, seen->name, text));
    }
    if (r->file == NULL)
        return;
    switch (seen->what) {
    case OBSERVED_FROM_HOST:
        check(r, dr_record_bytes(r->file, seen->when_us, real_us, seen->name, DR_RECORD_FROM_HOST, seen->bytes,
                                 seen->count));
        break;
    case OBSERVED_TO_HOST:
    case OBSERVED_LOST:
        check(r, dr_record_bytes(r->file, seen->when_us, real_us, seen->name,
                                 seen->what == OBSERVED_LOST ? DR_RECORD_LOST : DR_RECORD_TO_HOST, seen->bytes,
                                 seen->count));
        break;
    case OBSERVED_OPENED:
    case OBSERVED_CLOSED:
    case OBSERVED_FAULT:
    case OBSERVED_EVENT:
        check(r, dr_record_event(r->file, seen->when_us, real_us, seen->name, seen->text));
        break;
    case OBSERVED_NOTE:
    case OBSERVED_TTY:
    case OBSERVED_END:
        break;
    }
}

void recorder_close(recorder *r)
{
    if (r->file != NULL && r->lost > 0)
        (void)fprintf(stderr, "dryrig-emu: %s is incomplete: nobody took its last %u lines\n", r->path,
                      (unsigned)r->lost);
    if (r->file != NULL && fclose(r->file) != 0)
        (void)fprintf(stderr, "dryrig-emu: %s is incomplete: %s\n", r->path, strerror(errno));
    r->file = NULL;
}
