#define _GNU_SOURCE /* sigaction, fopen "e" */
#include "replay_port.h"

#include "dr_recording.h" /* the recording */
#include "dr_words.h"     /* what bytes mean */

#include "dryrig/dryrig.h" /* ports */

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TEXT 512u
#define KEPT 4096u             /* bytes between two commands, that are compared; a stream has more */
#define HEX_BYTES 20u          /* of a difference that are shown */
#define GRACE_US 2000000u      /* an answer may take three times as long as it did, and so much longer */
#define SLICE_US 50000u        /* how long a signal may go unseen */
#define SILENCE_US 200000u     /* nothing more comes: longer than any adapter holds bytes back */
#define STOP_LIMIT_US 5000000u /* for the CR of ^C [P] */
#define FIRST_PAUSE_US 2000u   /* [T note 2, M note 2] */
#define EXIT_DIFFERENT 1
#define EXIT_WRONG 2

/* Bytes for the host between two of its commands. */
typedef struct {
    uint8_t bytes[KEPT];
    size_t count; /* more than fit are counted */
} answers;

typedef struct {
    const char *path;
    dr_recording_reader reader;
    char name[DR_RECORDING_NAME]; /* "": none yet */
    dr_words_context context;
    uint16_t newest; /* firmware, where the recording does not say; 0: which controller is not known yet */
    dr_framer framer;
    dr_command command; /* the last whole one */
    uint8_t frame[DR_FRAME_MAX];
    unsigned commands, motions; /* of the host, in all */

    dryrig_link link;
    bool has_failed;                /* the port */
    const char *ended;              /* early, and why; NULL: it goes on */
    answers recorded, heard;        /* since the host's last bytes */
    uint64_t said_us, said_when_us; /* when these were sent, and when they were recorded, by the controller's clock */
    uint64_t answered_when_us;      /* when the last answer was recorded */
    uint64_t then_us, now_us;       /* what happened last: in the recording's real time, and here */
    unsigned exchanges, differences;
} player;

static volatile sig_atomic_t is_unwanted;

static void on_signal(int number)
{
    (void)number;
    is_unwanted = 1;
}

/* -- The recording ------------------------------------------------------------------------------------------------------- */

static bool take_setting(player *p, const dr_recorded *r, const char **why)
{
    if (strcmp(r->key, "controller") == 0) {
        if (!dr_words_kind_find(r->text, &p->context.kind))
            *why = "which controller? expected trio or mpc";
        p->newest = p->context.kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
        p->context.firmware = p->context.firmware == 0 ? p->newest : p->context.firmware;
    } else if (strcmp(r->key, "firmware") == 0) {
        *why = dr_words_firmware_parse(r->text, &p->context.firmware);
    } else if (strcmp(r->key, "device") == 0 && p->newest != 0 && p->context.stage == DR_STAGE_NONE) {
        (void)dr_words_stage_find(p->context.kind, r->text, &p->context.stage);
    }
    return *why == NULL;
}

/* The next bytes of the one controller. False: at the end, or *why says what is wrong. */
static bool next(player *p, dr_recorded *r, const char **why)
{
    *why = NULL;
    while (dr_recording_next(&p->reader, r)) {
        if (p->name[0] == '\0')
            (void)snprintf(p->name, sizeof p->name, "%s", r->name);
        if (strcmp(p->name, r->name) != 0) {
            *why = "a second controller: a port has one; keep the lines of that one alone";
            return false;
        }
        if (r->kind == DR_RECORDING_SETTING && !take_setting(p, r, why))
            return false;
        if (r->kind == DR_RECORDING_SETTING || r->kind == DR_RECORDING_EVENT)
            continue;
        if (p->newest == 0) {
            *why = "which controller? 'set NAME controller trio' or mpc is missing before this line";
            return false;
        }
        return true;
    }
    *why = p->reader.why[0] != '\0' ? p->reader.why : NULL;
    return false;
}

static void push(player *p, const dr_recorded *r)
{
    for (size_t i = 0; i < r->count; i++)
        if (dr_framer_push(&p->framer, p->context.kind, p->context.firmware, r->bytes[i], &p->command) ==
            DR_FRAMED_WHOLE) {
            memcpy(p->frame, p->framer.bytes, sizeof p->frame);
            p->commands++;
            p->motions += (p->command.is & DR_IS_MOTION) != 0;
        }
}

static bool begin(player *p, FILE *file)
{
    rewind(file);
    dr_framer_reset(&p->framer);
    memset(&p->command, 0, sizeof p->command);
    return dr_recording_open(&p->reader, file);
}

/* Everything that is wrong is found before anything is sent. */
static bool survey(player *p, FILE *file)
{
    dr_recorded r;
    const char *why = NULL;
    if (begin(p, file))
        while (next(p, &r, &why))
            if (r.kind == DR_RECORDING_FROM_HOST)
                push(p, &r);
    if (why == NULL && p->reader.why[0] != '\0')
        why = p->reader.why;
    if (why == NULL && p->framer.have > 0)
        why = "it ends within a command, and a controller would take what it is sent next for the rest";
    if (why == NULL && p->newest == 0)
        why = "there is nothing to play";
    if (why != NULL)
        (void)fprintf(stderr, "dryrig-emu: %s:%u: %s\n", p->path, p->reader.line, why);
    return why == NULL;
}

/* -- The port ------------------------------------------------------------------------------------------------------------ */

static uint64_t clock_us(const player *p) { return p->link.now_us(p->link.context); }

static void keep(answers *to, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++, to->count++)
        if (to->count < KEPT)
            to->bytes[to->count] = bytes[i];
}

static void end(player *p, const char *why) { p->ended = p->ended == NULL ? why : p->ended; }

static void fail(player *p)
{
    p->has_failed = true;
    end(p, "the port has failed");
}

static size_t hear_some(player *p, uint8_t *bytes, size_t room, uint64_t until_us)
{
    const uint64_t at_us = clock_us(p), left_us = until_us > at_us ? until_us - at_us : 0;
    const int count = p->link.read(p->link.context, bytes, room, (uint32_t)(left_us < SLICE_US ? left_us : SLICE_US));
    if (count < 0)
        fail(p);
    return count > 0 ? (size_t)count : 0;
}

/* Until so many bytes have come in all, or an instant, or it is to end. */
static void hear(player *p, size_t wanted, uint64_t until_us)
{
    uint8_t bytes[256];
    while (p->ended == NULL && p->heard.count < wanted && clock_us(p) < until_us) {
        const size_t missing = wanted - p->heard.count;
        keep(&p->heard, bytes, hear_some(p, bytes, missing < sizeof bytes ? missing : sizeof bytes, until_us));
        if (is_unwanted != 0)
            end(p, "a signal came");
    }
}

static void say(player *p, const dr_recorded *r)
{
    if (p->link.write(p->link.context, r->bytes, r->count) < 0)
        fail(p);
    p->said_us = p->now_us = clock_us(p);
    p->said_when_us = p->answered_when_us = r->when_us;
    p->then_us = r->real_us;
}

/* What moves is stopped. */
static void stop(player *p)
{
    static const uint8_t stop_byte = 0x03;
    uint8_t byte = 0;
    const uint64_t limit_us = clock_us(p) + STOP_LIMIT_US;
    if ((p->command.is & DR_IS_MOTION) == 0 || p->heard.count >= p->command.reply)
        return;
    if (p->has_failed || p->link.write(p->link.context, &stop_byte, 1) < 0) {
        (void)printf("%s: look at the stage: it may move\n", p->name);
        return;
    }
    while (byte != DR_CR && !p->has_failed && clock_us(p) < limit_us)
        (void)hear_some(p, &byte, 1, limit_us);
    (void)printf("%s: ^C was sent, %s\n", p->name,
                 byte == DR_CR ? "and a CR has come" : "and no CR has come: look at the stage, it may move");
}

/* -- Comparing ----------------------------------------------------------------------------------------------------------- */

static void tell_side(const player *p, const char *side, const answers *what)
{
    char text[TEXT] = "";
    const size_t kept = what->count < KEPT ? what->count : KEPT;
    if (kept == 0)
        (void)snprintf(text, sizeof text, "nothing");
    else if (kept == p->command.reply) /* of a stream the bytes must do */
        (void)dr_words_reply(text, sizeof text, &p->context, (dr_op)p->command.op, what->bytes, kept);
    (void)printf("  %s ", side);
    for (size_t i = 0; i < kept && i < HEX_BYTES; i++)
        (void)printf(" %02X", (unsigned)what->bytes[i]);
    (void)printf("%s  %s\n", kept > HEX_BYTES ? " ..." : "", text);
}

static void tell_difference(const player *p)
{
    char text[TEXT] = "nothing";
    if (p->command.reply > 0)
        (void)dr_words_request(text, sizeof text, &p->context, p->frame, 1u + (size_t)p->command.args);
    (void)printf("%s:%u: after '%s'\n", p->path, p->reader.line, text);
    tell_side(p, "recorded:", &p->recorded);
    tell_side(p, "replayed:", &p->heard);
    (void)fflush(stdout);
}

static bool is_same(const answers *a, const answers *b)
{
    return a->count == b->count && memcmp(a->bytes, b->bytes, a->count < KEPT ? a->count : KEPT) == 0;
}

static void compare(player *p)
{
    if (p->recorded.count + p->heard.count == 0)
        return;
    p->exchanges++;
    if (is_same(&p->recorded, &p->heard))
        return;
    p->differences++;
    tell_difference(p);
}

/* The answers that were recorded since the host's last bytes may take their time; what comes beyond them shows within the pause
 * before the next. A controller of which one does not come is sent nothing more. */
static void settle(player *p, uint64_t pause_us)
{
    const uint64_t lasted_us = p->answered_when_us > p->said_when_us ? p->answered_when_us - p->said_when_us : 0;
    hear(p, p->recorded.count, p->said_us + 3 * lasted_us + GRACE_US);
    const bool is_mute = p->heard.count < p->recorded.count;
    if (p->recorded.count > 0)
        p->now_us = clock_us(p);
    if (!is_mute)
        hear(p, SIZE_MAX, p->now_us + pause_us);
    if (p->ended != NULL)
        return;
    const unsigned before = p->differences;
    compare(p);
    if (is_mute)
        end(p, "an answer has not come");
    else if (p->differences > before)
        hear(p, SIZE_MAX, clock_us(p) + SILENCE_US); /* the rest of it */
}

/* The host's next bytes. What has been begun is finished, whoever wants it to end: a controller that waits for the rest of a
 * command would take it from whatever comes. */
static void host_writes(player *p, const dr_recorded *r)
{
    const bool is_within = p->framer.have > 0;
    const uint64_t pause_us = r->real_us > p->then_us ? r->real_us - p->then_us : 0;
    settle(p, pause_us);
    if (p->has_failed || (p->ended != NULL && !is_within))
        return;
    const uint64_t at_us = clock_us(p);
    if (at_us < p->now_us + pause_us)
        p->link.sleep_us(p->link.context, (uint32_t)(p->now_us + pause_us - at_us));
    p->recorded.count = p->heard.count = 0;
    push(p, r);
    say(p, r);
}

static void play(player *p)
{
    dr_recorded r;
    const char *why;
    bool is_first = true;
    p->link.sleep_us(p->link.context, FIRST_PAUSE_US);
    p->now_us = p->said_us = clock_us(p);
    while ((p->ended == NULL || (p->framer.have > 0 && !p->has_failed)) && next(p, &r, &why)) {
        p->then_us = is_first ? r.real_us : p->then_us;
        is_first = false;
        if (r.kind == DR_RECORDING_FROM_HOST) {
            host_writes(p, &r);
        } else {
            keep(&p->recorded, r.bytes, r.count);
            p->answered_when_us = r.when_us;
            p->then_us = r.real_us;
        }
    }
    settle(p, SILENCE_US);
}

/* -- From beginning to end ----------------------------------------------------------------------------------------------- */

static void take_signals(void)
{
    struct sigaction ending; /* waiting ends with the signal */
    memset(&ending, 0, sizeof ending);
    ending.sa_handler = on_signal;
    (void)sigaction(SIGINT, &ending, NULL);
    (void)sigaction(SIGTERM, &ending, NULL);
    (void)sigaction(SIGHUP, &ending, NULL);
}

static int play_file(player *p, FILE *file, const char *port, bool may_move)
{
    char why[DRYRIG_WHY_MAX];
    if (!survey(p, file))
        return EXIT_WRONG;
    if (!may_move) {
        (void)fprintf(
            stderr,
            "dryrig-emu: replay: nothing was sent. The recording has %u command%s for what is at %s, of which "
            "%u move%s it, from wherever it is now. If it may: --may-move\n",
            p->commands, p->commands == 1 ? "" : "s", port, p->motions, p->motions == 1 ? "s" : "");
        return EXIT_WRONG;
    }
    take_signals();
    const unsigned baud = p->context.kind == DR_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC;
    if (dryrig_link_open(&p->link, port, baud, why, sizeof why) != DRYRIG_OK) {
        (void)fprintf(stderr, "dryrig-emu: replay: %s\n", why);
        return EXIT_DIFFERENT;
    }
    (void)p->link.purge(p->link.context);
    (void)begin(p, file);
    play(p);
    if (p->ended != NULL) {
        (void)printf("%s: it ended at line %u of %s: %s\n", p->name, p->reader.line, p->path, p->ended);
        stop(p);
    }
    p->link.close(p->link.context);
    (void)printf("%s: %u of %u answers differ.\n", p->name, p->differences, p->exchanges);
    return p->ended != NULL || p->differences > 0 ? EXIT_DIFFERENT : 0;
}

int replay_port(const char *recording, const char *port, bool may_move)
{
    FILE *const file = fopen(recording, "re");
    player *const p = calloc(1, sizeof *p);
    int status = EXIT_WRONG;
    if (file == NULL || p == NULL) {
        (void)fprintf(stderr, "dryrig-emu: replay: %s: %s\n", recording, strerror(errno));
    } else {
        p->path = recording;
        status = play_file(p, file, port, may_move);
    }
    if (file != NULL)
        (void)fclose(file);
    free(p);
    return status;
}
