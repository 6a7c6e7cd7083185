#define _GNU_SOURCE /* strdup, fopen "e" */
#include "replay.h"

#include "setup.h" /* controllers as they are described */

#include "dr_recording.h" /* the recording */
#include "dr_words.h"     /* what bytes mean */

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEXT 512u
#define SETTINGS_MAX 32u  /* of one controller */
#define ANSWERS_MAX 4096u /* bytes between two commands, that are compared; a stream has more */
#define HEX_BYTES 20u     /* of a difference that are shown */
#define EXIT_DIFFERENT 1
#define EXIT_WRONG 2

/* Bytes for the host since its last ones. */
typedef struct {
    uint8_t bytes[ANSWERS_MAX];
    size_t count; /* more than fit are counted */
    uint64_t last_us;
} answers;

/* One controller of the recording, and what it does here. */
typedef struct {
    char name[DR_RECORDING_NAME];
    char *settings[SETTINGS_MAX]; /* where the texts of `text` are */
    unsigned setting_count;
    setup_text text;
    bool is_on;
    uint8_t places; /* bit per drive: where it is at the beginning is known, or does not matter any more */
    instrument ins;
    dr_drive drives[DR_PORTS];
    uint64_t shift_us; /* how much later things happen here */
    uint64_t real_us;  /* when the host's last bytes came */
    answers recorded, replayed;
    dr_framer framer;
    dr_command command; /* the last whole one */
    uint8_t frame[DR_FRAME_MAX];
    unsigned exchanges, differences, events;
    int64_t drift_us; /* the largest difference of time */
} actor;

typedef struct {
    const char *path;
    actor **actors;
    unsigned count;
} play;

/* -- Controllers --------------------------------------------------------------------------------------------------------- */

static actor *actor_of(play *p, const char *name)
{
    for (unsigned i = 0; i < p->count; i++)
        if (strcmp(p->actors[i]->name, name) == 0)
            return p->actors[i];
    actor **const more =
        realloc(p->actors, (p->count + 1u) * sizeof *more); /* NOLINT(bugprone-sizeof-expression): pointers they are */
    if (more == NULL)
        return NULL;
    p->actors = more;
    actor *const a = calloc(1, sizeof *a);
    if (a == NULL)
        return NULL;
    (void)snprintf(a->name, sizeof a->name, "%s", name);
    dr_framer_reset(&a->framer);
    p->actors[p->count++] = a;
    return a;
}

static bool repeat(const char **places, unsigned *count, const char *text)
{
    if (*count == DR_PORTS)
        return false;
    places[(*count)++] = text;
    return true;
}

/* False: no such setting, or too many. */
static bool take_setting(actor *a, const dr_recorded *r)
{
    const struct {
        const char *key;
        const char **place;
    } single[] = {{"controller", &a->text.controller}, {"firmware", &a->text.firmware}, {"home", &a->text.home},
                  {"angle", &a->text.angle},           {"quirks", &a->text.quirks},     {"pace", &a->text.pace}};
    char *const text = a->setting_count < SETTINGS_MAX ? strdup(r->text) : NULL;
    if (text == NULL)
        return false;
    a->settings[a->setting_count++] = text;
    for (unsigned i = 0; i < sizeof single / sizeof single[0]; i++)
        if (strcmp(r->key, single[i].key) == 0) {
            *single[i].place = text;
            return true;
        }
    if (strcmp(r->key, "device") == 0)
        return repeat(a->text.devices, &a->text.device_count, text);
    if (strcmp(r->key, "position") == 0)
        return repeat(a->text.positions, &a->text.position_count, text);
    return strcmp(r->key, "work") == 0 && repeat(a->text.works, &a->text.work_count, text);
}

static bool switch_on(actor *a, char *why, size_t room)
{
    setup s;
    setup_problem problem;
    if (a->text.controller == NULL) {
        (void)snprintf(why, room, "which controller? 'set %s controller trio' or mpc is missing before it", a->name);
        return false;
    }
    if (!setup_read(&a->text, true, &s, &problem)) {
        (void)snprintf(why, room, "%s %s: %s", problem.what, problem.text == NULL ? "" : problem.text, problem.why);
        return false;
    }
    setup_apply(&s, &a->ins, a->drives);
    instrument_start(&a->ins, 0);
    a->places = a->text.position_count > 0 ? UINT8_MAX : 0;
    a->is_on = true;
    return true;
}

/* -- What a recording of a real controller does not say at its beginning, but soon ---------------------------------------- */

/* Which model hangs on a port that is not described does not matter unless it is moved. */
static void learn_drives(actor *a)
{
    dr_reply reply;
    const dr_controller *const c = &a->ins.controller;
    uint8_t stage = DR_STAGE_NONE;
    if (a->text.device_count == 0 || a->command.op != DR_OP_MPC_DRIVES ||
        !dr_wire_get_reply(&a->command, a->recorded.bytes, a->recorded.count, &reply))
        return;
    for (uint8_t i = 0; i < c->drive_count && stage == DR_STAGE_NONE; i++)
        stage = a->drives[i].stage;
    for (uint8_t i = (uint8_t)a->text.device_count; i < c->drive_count; i++)
        if (a->drives[i].stage == DR_STAGE_NONE && ((unsigned)reply.connected >> i & 1u) != 0)
            dr_drive_init(&a->drives[i], (dr_stage_id)stage);
}

static uint8_t place_of(uint8_t drive) { return (uint8_t)(1u << drive); }

static bool is_position(uint8_t op) { return op == DR_OP_TRIO_POSITION || op == DR_OP_MPC_POSITION; }

/* The first position that a drive tells is where it has been since then, unless it was moved before. It is looked at when it
 * has come whole in the recording, which is before the answer leaves here. */
static void learn_place(actor *a)
{
    dr_reply reply;
    dr_controller *const c = &a->ins.controller;
    if (!is_position(a->command.op) || c->state != DR_STATE_REST ||
        !dr_wire_get_reply(&a->command, a->recorded.bytes, a->recorded.count, &reply))
        return;
    const uint8_t drive = c->kind == DR_MPC ? (uint8_t)(reply.value - 1u) : 0;
    if (drive >= c->drive_count || a->drives[drive].stage == DR_STAGE_NONE || (a->places & place_of(drive)) != 0)
        return;
    memcpy(a->drives[drive].position_steps, reply.steps, sizeof reply.steps);
    if (c->kind == DR_TRIO)
        c->angle_deg = reply.value;
    else if (a->places == 0)
        c->active = drive;
    a->places = (uint8_t)(a->places | place_of(drive));
}

static void forget_place(actor *a)
{
    if ((a->command.is & DR_IS_MOTION) != 0)
        a->places = (uint8_t)(a->places | place_of(a->ins.controller.active));
}

/* -- Playing ------------------------------------------------------------------------------------------------------------- */

static void keep(answers *to, const uint8_t *bytes, size_t count, uint64_t when_us)
{
    for (size_t i = 0; i < count; i++, to->count++)
        if (to->count < ANSWERS_MAX)
            to->bytes[to->count] = bytes[i];
    to->last_us = when_us;
}

static void run_to(actor *a, uint64_t until_us)
{
    uint8_t bytes[64];
    size_t count;
    while (instrument_run(&a->ins, until_us, bytes, sizeof bytes, &count))
        keep(&a->replayed, bytes, count, a->ins.now_us);
}

/* To when_us of the recording, or until the answers that were recorded have come. */
static void settle(actor *a, uint64_t when_us)
{
    const uint64_t until_us = when_us + a->shift_us;
    uint64_t due_us;
    if (until_us > a->ins.now_us)
        run_to(a, until_us);
    while (a->replayed.count < a->recorded.count && instrument_due(&a->ins, &due_us)) /* moves end */
        run_to(a, due_us);
    if (a->ins.now_us > until_us)
        a->shift_us += a->ins.now_us - until_us;
}

static void tell_side(const actor *a, const char *side, const answers *what)
{
    const dr_words_context context = {(dr_kind)a->ins.controller.kind, a->ins.controller.firmware,
                                      (dr_stage_id)a->drives[a->ins.controller.active].stage};
    char text[TEXT] = "";
    const size_t kept = what->count < ANSWERS_MAX ? what->count : ANSWERS_MAX;
    if (kept == 0)
        (void)snprintf(text, sizeof text, "nothing");
    else if (kept == a->command.reply) /* of a stream the bytes must do */
        (void)dr_words_reply(text, sizeof text, &context, (dr_op)a->command.op, what->bytes, kept);
    (void)printf("  %s ", side);
    for (size_t i = 0; i < kept && i < HEX_BYTES; i++)
        (void)printf(" %02X", (unsigned)what->bytes[i]);
    (void)printf("%s  %s\n", kept > HEX_BYTES ? " ..." : "", text);
}

static void tell_difference(const actor *a)
{
    const dr_words_context context = {(dr_kind)a->ins.controller.kind, a->ins.controller.firmware,
                                      (dr_stage_id)a->drives[a->ins.controller.active].stage};
    char text[TEXT] = "nothing";
    if (a->command.reply > 0)
        (void)dr_words_request(text, sizeof text, &context, a->frame, 1u + (size_t)a->command.args);
    (void)printf("%s, %llu.%06u s: after '%s'\n", a->name, (unsigned long long)(a->ins.now_us / DR_US_PER_S),
                 (unsigned)(a->ins.now_us % DR_US_PER_S), text);
    tell_side(a, "recorded:", &a->recorded);
    tell_side(a, "replayed:", &a->replayed);
    size_t at = 0;
    while (at < a->recorded.count && at < a->replayed.count && at < ANSWERS_MAX &&
           a->recorded.bytes[at] == a->replayed.bytes[at])
        at++;
    (void)printf("  the first difference is in byte %zu; recorded were %zu bytes, replayed %zu\n", at + 1u,
                 a->recorded.count, a->replayed.count);
}

/* Behind a difference: what is still to come belongs to it. */
static void go_on_afresh(actor *a)
{
    const uint64_t began_us = a->ins.now_us;
    uint64_t due_us;
    while (instrument_due(&a->ins, &due_us)) /* moves end */
        run_to(a, due_us);
    a->shift_us += a->ins.now_us - began_us;
    a->replayed.count = 0;
}

/* What came between two writes of the host. What comes here before it came in the recording is kept for the next time. */
static void compare(actor *a, bool is_last)
{
    answers *const was = &a->recorded, *const is = &a->replayed;
    const bool comes_early = !is_last && is->count > was->count && is->count <= ANSWERS_MAX;
    const size_t compared = comes_early ? was->count : is->count;
    if (was->count == 0 && compared == 0)
        return;
    a->exchanges++;
    const size_t kept = was->count < ANSWERS_MAX ? was->count : ANSWERS_MAX;
    if (was->count != compared || memcmp(was->bytes, is->bytes, kept) != 0) {
        a->differences++;
        tell_difference(a);
        go_on_afresh(a);
    } else {
        const int64_t drift_us = (int64_t)(is->last_us - a->shift_us) - (int64_t)was->last_us;
        if (!comes_early && llabs(drift_us) > llabs(a->drift_us))
            a->drift_us = drift_us;
        is->count -= compared;
        memmove(is->bytes, is->bytes + compared, is->count < ANSWERS_MAX ? is->count : 0);
    }
    was->count = 0;
}

static void host_writes(actor *a, const dr_recorded *r)
{
    settle(a, r->when_us);
    compare(a, false);
    const uint64_t pause_us = r->real_us - a->real_us;
    size_t at = 0;
    a->real_us = r->real_us;
    for (size_t i = 0; i < r->count; i++)
        if (dr_framer_push(&a->framer, (dr_kind)a->ins.controller.kind, a->ins.controller.firmware, r->bytes[i],
                           &a->command) == DR_FRAMED_WHOLE) {
            memcpy(a->frame, a->framer.bytes, sizeof a->frame);
            forget_place(a);
        }
    while (at < r->count) { /* the line takes 64 bytes within a few ms */
        uint64_t due_us;
        at += instrument_take(&a->ins, at == 0 && pause_us < UINT32_MAX ? (uint32_t)pause_us : 0, r->bytes + at,
                              r->count - at);
        run_to(a, a->ins.now_us);
        if (at < r->count && instrument_due(&a->ins, &due_us))
            run_to(a, due_us);
    }
}

/* False: why[] says what is wrong with this line. */
static bool take(play *p, const dr_recorded *r, char *why, size_t room)
{
    actor *const a = actor_of(p, r->name);
    if (a == NULL) {
        (void)snprintf(why, room, "no memory");
        return false;
    }
    if (r->kind == DR_RECORDING_SETTING) {
        (void)snprintf(why, room, "no such setting, or too many of them, or it comes too late");
        return !a->is_on && take_setting(a, r);
    }
    if (!a->is_on && !switch_on(a, why, room))
        return false;
    switch ((dr_recorded_kind)r->kind) {
    case DR_RECORDING_FROM_HOST:
        host_writes(a, r);
        break;
    case DR_RECORDING_TO_HOST:
    case DR_RECORDING_LOST:
        keep(&a->recorded, r->bytes, r->count, r->when_us);
        learn_drives(a);
        learn_place(a);
        break;
    case DR_RECORDING_EVENT:
    case DR_RECORDING_SETTING:
        a->events++;
        break;
    }
    return true;
}

/* -- Summing up ---------------------------------------------------------------------------------------------------------- */

static bool sum_up(actor *a)
{
    if (!a->is_on)
        return true;
    uint64_t due_us;
    while (a->replayed.count < a->recorded.count && instrument_due(&a->ins, &due_us))
        run_to(a, due_us);
    compare(a, true);
    (void)printf("%s: %u of %u answers differ", a->name, a->differences, a->exchanges);
    if (a->exchanges > a->differences && a->drift_us == 0)
        (void)printf("%s came when recorded", a->differences == 0 ? "; they" : "; the others");
    else if (a->exchanges > a->differences)
        (void)printf("%s came up to %lld us %s than recorded", a->differences == 0 ? "; they" : "; the others",
                     llabs(a->drift_us), a->drift_us < 0 ? "earlier" : "later");
    (void)printf(".\n");
    if (a->events > 0)
        (void)printf("%s: %u line%s of events are told in the recording, not played.\n", a->name, a->events,
                     a->events == 1 ? "" : "s");
    return a->differences == 0;
}

static void forget(play *p)
{
    for (unsigned i = 0; i < p->count; i++) {
        for (unsigned k = 0; k < p->actors[i]->setting_count; k++)
            free(p->actors[i]->settings[k]);
        free(p->actors[i]);
    }
    free(p->actors);
}

int replay(const char *path)
{
    play p = {path, NULL, 0};
    dr_recording_reader reader;
    dr_recorded r;
    char why[1024] = "";
    FILE *const file = fopen(path, "re");
    if (file == NULL) {
        (void)fprintf(stderr, "dryrig-emu: replay: %s: %s\n", path, strerror(errno));
        return EXIT_WRONG;
    }
    bool is_right = dr_recording_open(&reader, file), is_same = true;
    while (is_right && dr_recording_next(&reader, &r))
        is_right = take(&p, &r, why, sizeof why);
    for (unsigned i = 0; i < p.count; i++)
        is_same = sum_up(p.actors[i]) && is_same;
    if (!is_right || reader.why[0] != '\0') {
        (void)fflush(stdout);
        (void)fprintf(stderr, "dryrig-emu: %s:%u: %s\n", path, reader.line, reader.why[0] != '\0' ? reader.why : why);
    }
    const int status = !is_right || reader.why[0] != '\0' ? EXIT_WRONG : is_same ? 0 : EXIT_DIFFERENT;
    forget(&p);
    (void)fclose(file);
    return status;
}
