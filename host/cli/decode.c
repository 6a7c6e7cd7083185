#include "decode.h"

#include "dr_recording.h" /* recordings */
#include "dr_wire.h"      /* frames */
#include "dr_words.h"     /* what bytes mean */

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEXT 512u
#define ASKED_MAX 32u /* commands that wait for their answer; more only where nothing answers */
#define US_PER_S UINT64_C(1000000)

/* One controller and its host, as far as their bytes tell. */
typedef struct {
    char name[DR_RECORDING_NAME];
    dr_words_context context;
    dr_stage_id stages[DR_PORTS]; /* of the ports, in order */
    unsigned stage_count, drive;  /* drive: index of the one that seems to be active */
    uint8_t select_to;
    bool knows_controller;
    dr_framer framer;
    dr_op asked[ASKED_MAX];
    unsigned asked_count;
    uint8_t answer[DR_REPLY_MAX];
    unsigned answer_count;
} talk;

typedef struct {
    talk *talks;
    unsigned count;
    bool has_times;
    char when[48]; /* before the line of a frame */
} decoder;

/* -- Telling ----------------------------------------------------------------------------------------------------------- */

static void tell_frame(const decoder *d, const talk *t, char direction, const char *text)
{
    (void)printf("%s%s%s%c %s\n", d->when, d->count > 1 ? t->name : "", d->count > 1 ? " " : "", direction, text);
}

static void tell_byte(unsigned at, uint8_t byte, const char *text)
{
    (void)printf("    %2u  %02X  %s\n", at, byte, text);
}

static dr_words_context context_of(const talk *t)
{
    dr_words_context context = t->context;
    context.stage = t->drive < t->stage_count ? t->stages[t->drive] : DR_STAGE_NONE;
    return context;
}

/* -- From the host ------------------------------------------------------------------------------------------------------- */

static void take_command(const decoder *d, talk *t, const dr_command *command)
{
    const dr_words_context context = context_of(t);
    const size_t count = 1u + (size_t)command->args;
    char text[TEXT];
    (void)dr_words_request(text, sizeof text, &context, t->framer.bytes, count);
    tell_frame(d, t, '>', text);
    for (unsigned at = 0; at < count; at++) {
        (void)dr_words_request_byte(text, sizeof text, &context, t->framer.bytes, count, at);
        tell_byte(at, t->framer.bytes[at], text);
    }
    if (command->op == DR_OP_MPC_SELECT)
        t->select_to = t->framer.bytes[1];
    if (t->asked_count < ASKED_MAX)
        t->asked[t->asked_count++] = (dr_op)command->op;
}

static void take_from_host(const decoder *d, talk *t, uint8_t byte)
{
    dr_command command;
    char text[TEXT];
    switch (dr_framer_push(&t->framer, t->context.kind, t->context.firmware, byte, &command)) {
    case DR_FRAMED_WHOLE:
        take_command(d, t, &command);
        break;
    case DR_FRAMED_FILLER:
        tell_frame(d, t, '>', "between commands: means nothing");
        tell_byte(0, byte, byte == DR_LF ? "LF" : "CR");
        break;
    case DR_FRAMED_UNKNOWN:
        (void)dr_words_request(text, sizeof text, &t->context, &byte, 1);
        tell_frame(d, t, '>', text);
        tell_byte(0, byte, "ignored, without an answer");
        break;
    case DR_FRAMED_PART:
        break;
    }
}

/* -- From the controller ------------------------------------------------------------------------------------------------- */

static bool is_interrupt(dr_op op) { return op == DR_OP_MPC_INTERRUPT || op == DR_OP_TRIO_INTERRUPT; }

/* One CR answers a move and the ^C that has stopped it. */
static dr_op answered(const talk *t)
{
    for (unsigned i = 1; i < t->asked_count; i++)
        if (is_interrupt(t->asked[i]))
            return t->asked[i];
    return t->asked[0];
}

static void forget_answered(talk *t, dr_op op)
{
    unsigned gone = 0;
    while (gone < t->asked_count && t->asked[gone] != op)
        gone++;
    gone += gone < t->asked_count ? 1 : 0;
    memmove(t->asked, t->asked + gone, (t->asked_count - gone) * sizeof t->asked[0]);
    t->asked_count -= gone;
}

static void tell_answer(const decoder *d, talk *t, dr_op op, bool is_stream)
{
    dr_words_context context = context_of(t);
    char text[TEXT];
    if (op == DR_OP_MPC_POSITION && t->answer[0] >= 1 && t->answer[0] <= DR_PORTS) {
        t->drive = t->answer[0] - 1u; /* now it is known */
        context = context_of(t);
    }
    if (is_stream)
        (void)dr_words_stream(text, sizeof text, &context, t->answer, t->answer_count);
    else
        (void)dr_words_reply(text, sizeof text, &context, op, t->answer, t->answer_count);
    tell_frame(d, t, '<', text);
    for (unsigned at = 0; at < t->answer_count; at++) {
        if (is_stream)
            (void)dr_words_stream_byte(text, sizeof text, &context, t->answer, t->answer_count, at);
        else
            (void)dr_words_reply_byte(text, sizeof text, &context, op, t->answer, t->answer_count, at);
        tell_byte(at, t->answer[at], text);
    }
    if ((op == DR_OP_MPC_SELECT || op == DR_OP_MPC_ACTIVE) && t->answer[0] >= 1 && t->answer[0] <= DR_PORTS)
        t->drive = t->answer[0] - 1u;
    else if (op == DR_OP_MPC_SELECT && t->answer_count == 1 && t->select_to >= 1 && t->select_to <= DR_PORTS)
        t->drive = t->select_to - 1u; /* up to 1.05 */
    t->answer_count = 0;
}

static void take_from_controller(const decoder *d, talk *t, uint8_t byte)
{
    dr_command command;
    if (t->asked_count == 0) {
        tell_frame(d, t, '<', "nothing has been asked for");
        tell_byte(0, byte, byte == DR_CR ? "CR" : "");
        return;
    }
    t->answer[t->answer_count++] = byte;
    const dr_op op = answered(t);
    const bool is_stream = t->answer[0] == 0xFFu && t->asked[0] == DR_OP_MPC_LINE;
    if (is_stream && t->answer_count == DR_STREAM_FRAME) {
        tell_answer(d, t, t->asked[0], true);
    } else if (!is_stream && (!dr_command_for(t->context.kind, t->context.firmware, op, &command) ||
                              t->answer_count == command.reply)) {
        tell_answer(d, t, op, false);
        forget_answered(t, op);
    }
}

/* What has begun and not ended. */
static void tell_rest(const decoder *d, const talk *t)
{
    dr_command command;
    char text[TEXT];
    if (t->framer.have > 0 && dr_command_find(t->context.kind, t->context.firmware, t->framer.bytes[0], &command)) {
        (void)snprintf(text, sizeof text, "%s: %u byte%s of %u, the rest is missing",
                       dr_words_command((dr_op)command.op)->name, (unsigned)t->framer.have,
                       t->framer.have == 1 ? "" : "s", command.args + 1u);
        tell_frame(d, t, '>', text);
        for (unsigned at = 0; at < t->framer.have; at++)
            tell_byte(at, t->framer.bytes[at], "");
    }
    if (t->answer_count > 0) {
        (void)snprintf(text, sizeof text, "%u byte%s of the answer to %s, the rest is missing", t->answer_count,
                       t->answer_count == 1 ? "" : "s", dr_words_command(t->asked[0])->name);
        tell_frame(d, t, '<', text);
        for (unsigned at = 0; at < t->answer_count; at++)
            tell_byte(at, t->answer[at], "");
    }
}

/* -- Hexadecimal text ---------------------------------------------------------------------------------------------------- */

static bool is_hex(const char *text) { return text[strspn(text, "0123456789abcdefABCDEFxX,<> \t\n")] == '\0'; }

static int decode_hex(const command_line *line, const char *text)
{
    talk t;
    memset(&t, 0, sizeof t);
    const decoder d = {&t, 1, false, ""};
    t.context.kind = line->open.controller == DRYRIG_TRIO ? DR_TRIO : DR_MPC;
    t.context.firmware = (uint16_t)line->open.firmware;
    if (t.context.firmware == 0)
        t.context.firmware = t.context.kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
    for (unsigned i = 0; i < DR_PORTS && line->open.stage[i] != NULL; i++)
        if (dr_words_stage_find(t.context.kind, line->open.stage[i], &t.stages[i]))
            t.stage_count = i + 1u;
    dr_framer_reset(&t.framer);
    bool from_host = true;
    for (const char *at = text; *at != '\0';) {
        if (strchr("<>, \t\n", *at) != NULL) {
            from_host = *at == '>' || (*at != '<' && from_host);
            at++;
            continue;
        }
        if (at[0] == '0' && (at[1] == 'x' || at[1] == 'X'))
            at += 2;
        char digits[3] = {at[0], '\0', '\0'};
        if (at[0] != '\0')
            digits[1] = at[1];
        char *end;
        const unsigned long byte = strtoul(digits, &end, 16);
        if (end != digits + 2)
            usage_error(line->command, "decode: '%s' is no byte: two hexadecimal digits each", digits);
        at += 2;
        if (from_host)
            take_from_host(&d, &t, (uint8_t)byte);
        else
            take_from_controller(&d, &t, (uint8_t)byte);
    }
    tell_rest(&d, &t);
    return EXIT_DONE;
}

/* -- Recordings ---------------------------------------------------------------------------------------------------------- */

static talk *talk_of(decoder *d, const char *name)
{
    for (unsigned i = 0; i < d->count; i++)
        if (strcmp(d->talks[i].name, name) == 0)
            return &d->talks[i];
    talk *const more = realloc(d->talks, (d->count + 1u) * sizeof *more);
    if (more == NULL)
        return NULL;
    d->talks = more;
    talk *const t = &more[d->count++];
    memset(t, 0, sizeof *t);
    (void)snprintf(t->name, sizeof t->name, "%s", name);
    dr_framer_reset(&t->framer);
    return t;
}

/* What does not matter here is left to others. False: it is not understood. */
static bool take_setting(talk *t, const dr_recorded *r)
{
    if (strcmp(r->key, "controller") == 0) {
        t->knows_controller = dr_words_kind_find(r->text, &t->context.kind);
        t->context.firmware = t->context.kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
        return t->knows_controller;
    }
    if (strcmp(r->key, "firmware") == 0)
        return dr_words_firmware_parse(r->text, &t->context.firmware) == NULL;
    if (strcmp(r->key, "device") == 0 && t->stage_count < DR_PORTS) {
        dr_stage_id *const stage = &t->stages[t->stage_count++];
        *stage = DR_STAGE_NONE;
        return strcmp(r->text, "none") == 0 || dr_words_stage_find(t->context.kind, r->text, stage);
    }
    return true;
}

static bool take_record(decoder *d, talk *t, const dr_recorded *r, const char **why)
{
    if (r->kind == DR_RECORDING_SETTING) {
        *why = "this setting is not understood";
        return take_setting(t, r);
    }
    (void)snprintf(d->when, sizeof d->when, "%5llu.%06u ", (unsigned long long)(r->when_us / US_PER_S),
                   (unsigned)(r->when_us % US_PER_S));
    *why = "which controller? 'set NAME controller trio' or mpc is missing before it";
    if (!t->knows_controller)
        return false;
    switch ((dr_recorded_kind)r->kind) {
    case DR_RECORDING_FROM_HOST:
        for (size_t i = 0; i < r->count; i++)
            take_from_host(d, t, r->bytes[i]);
        break;
    case DR_RECORDING_TO_HOST:
        for (size_t i = 0; i < r->count; i++)
            take_from_controller(d, t, r->bytes[i]);
        break;
    case DR_RECORDING_LOST:
        tell_frame(d, t, '!', "bytes for the host that it never got");
        for (size_t i = 0; i < r->count; i++)
            tell_byte((unsigned)i, r->bytes[i], "");
        break;
    case DR_RECORDING_EVENT:
    case DR_RECORDING_SETTING:
        tell_frame(d, t, '-', r->text);
        break;
    }
    return true;
}

static int refuse_file(const char *path, const dr_recording_reader *reader, const char *why)
{
    (void)fflush(stdout);
    (void)fprintf(stderr, "dryrig: %s:%u: %s\n", path, reader->line, why);
    return EXIT_USAGE;
}

static int decode_recording(const char *path, FILE *file)
{
    decoder d = {NULL, 0, true, ""};
    dr_recording_reader reader;
    dr_recorded r;
    int status = EXIT_DONE;
    if (!dr_recording_open(&reader, file))
        return refuse_file(path, &reader, reader.why);
    while (status == EXIT_DONE && dr_recording_next(&reader, &r)) {
        const char *why = "no memory";
        talk *const t = talk_of(&d, r.name);
        if (t == NULL || !take_record(&d, t, &r, &why))
            status = refuse_file(path, &reader, why);
    }
    for (unsigned i = 0; i < d.count; i++)
        tell_rest(&d, &d.talks[i]);
    if (reader.why[0] != '\0')
        status = refuse_file(path, &reader, reader.why);
    free(d.talks);
    return status;
}

int decode(const command_line *line)
{
    const char *const what = line->argument[0];
    if (is_hex(what)) {
        if (!line->has_controller)
            usage_error(line->command, "decode: bytes are those of which controller? --controller trio or mpc");
        return decode_hex(line, what);
    }
    FILE *const file = fopen(what, "r");
    if (file == NULL) {
        (void)fprintf(stderr, "dryrig: decode: %s is neither hexadecimal bytes nor a file: %s\n", what,
                      strerror(errno));
        return EXIT_USAGE;
    }
    const int status = decode_recording(what, file);
    (void)fclose(file);
    return status;
}
