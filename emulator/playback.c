#define _GNU_SOURCE /* ppoll, signalfd, inotify, fopen "e" */
#include "playback.h"

#include "link.h" /* the port's stable name */
#include "pty.h"  /* the port */

#include "dr_recording.h" /* the recording */
#include "dr_words.h"     /* what bytes mean */

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#define US_PER_S UINT64_C(1000000)
#define NS_PER_US UINT64_C(1000)
#define TEXT 512u
#define CHUNK 256u /* bytes of the host that are read at once */
#define EXIT_DIFFERENT 1
#define EXIT_WRONG 2

/* A whole request of the host, which is shorter than a line of bytes; or bytes for it. */
typedef struct {
    uint64_t when_us;
    unsigned line; /* of the recording */
    bool is_request;
    uint8_t op; /* of a request: dr_op; DR_OP_NONE: a byte that is no command */
    uint8_t count;
    uint8_t bytes[DR_RECORDING_BYTES];
} item;

typedef struct {
    const playback_options *o;
    char name[DR_RECORDING_NAME]; /* "": none yet */
    dr_words_context context;
    uint16_t newest; /* firmware, where the recording does not say; 0: which controller is not known yet */
    bool has_stage;
    item *items;
    size_t count, room;

    size_t at;                     /* the next */
    const item *answered;          /* the request that was answered last; NULL: none yet */
    uint64_t then_us, now_us;      /* the recording's clock was at then_us when the machine's was at now_us */
    dr_framer framer;              /* the host's request that is arriving */
    uint64_t host_bytes;           /* that have been taken */
    unsigned requests;             /* that the host has made */
    unsigned differences, skipped; /* recorded ones, that it has not made */

    pty port;
    int lock, inotify, signals;
    bool was_opened;
    uint8_t chunk[CHUNK];
    size_t chunk_at, chunk_count;
} player;

/* -- The recording ------------------------------------------------------------------------------------------------------- */

static item *add_item(player *p)
{
    if (p->count == p->room) {
        const size_t room = p->room == 0 ? 256u : 2u * p->room;
        item *const more = realloc(p->items, room * sizeof *more);
        if (more == NULL)
            return NULL;
        p->items = more;
        p->room = room;
    }
    memset(&p->items[p->count], 0, sizeof *p->items);
    return &p->items[p->count++];
}

/* Is a request whole with this byte? */
static bool push(const player *p, dr_framer *framer, uint8_t byte, item *out)
{
    dr_command command;
    const dr_framed framed = dr_framer_push(framer, p->context.kind, p->context.firmware, byte, &command);
    if (framed == DR_FRAMED_PART)
        return false;
    memset(out, 0, sizeof *out);
    out->is_request = true;
    out->op = framed == DR_FRAMED_WHOLE ? command.op : (uint8_t)DR_OP_NONE;
    out->count = framed == DR_FRAMED_WHOLE ? (uint8_t)(1u + command.args) : 1u;
    memcpy(out->bytes, framed == DR_FRAMED_WHOLE ? framer->bytes : &byte, out->count);
    return true;
}

static const char *take_setting(player *p, const dr_recorded *r)
{
    dr_stage_id stage = DR_STAGE_NONE;
    if (strcmp(r->key, "controller") == 0) {
        if (!dr_words_kind_find(r->text, &p->context.kind))
            return "which controller? expected trio or mpc";
        p->newest = p->context.kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
        if (p->context.firmware == 0)
            p->context.firmware = p->newest;
    } else if (strcmp(r->key, "firmware") == 0) {
        return dr_words_firmware_parse(r->text, &p->context.firmware);
    } else if (strcmp(r->key, "device") == 0 && p->newest != 0 &&
               dr_words_stage_find(p->context.kind, r->text, &stage)) {
        p->context.stage = p->has_stage && stage != p->context.stage ? DR_STAGE_NONE : stage; /* whose, who knows? */
        p->has_stage = true;
    }
    return NULL;
}

static const char *take(player *p, const dr_recorded *r, unsigned line, dr_framer *framer)
{
    static const char no_memory[] = "no memory";
    if (p->name[0] == '\0')
        (void)snprintf(p->name, sizeof p->name, "%s", r->name);
    if (strcmp(p->name, r->name) != 0)
        return "a second controller: one can be played to a host; keep the lines of that one alone";
    if (r->kind == DR_RECORDING_SETTING)
        return take_setting(p, r);
    if (p->newest == 0)
        return "which controller? 'set NAME controller trio' or mpc is missing before this line";
    if (r->kind == DR_RECORDING_TO_HOST) {
        item *const reply = add_item(p);
        if (reply == NULL)
            return no_memory;
        reply->count = (uint8_t)r->count;
        memcpy(reply->bytes, r->bytes, r->count);
        reply->when_us = r->when_us;
        reply->line = line;
    }
    for (size_t i = 0; r->kind == DR_RECORDING_FROM_HOST && i < r->count; i++) {
        item request;
        if (!push(p, framer, r->bytes[i], &request))
            continue;
        item *const kept = add_item(p);
        if (kept == NULL)
            return no_memory;
        *kept = request;
        kept->when_us = r->when_us;
        kept->line = line;
    }
    return NULL;
}

static bool read_recording(player *p)
{
    dr_recording_reader reader;
    dr_recorded r;
    dr_framer framer;
    const char *why = NULL;
    FILE *const file = fopen(p->o->path, "re");
    if (file == NULL) {
        (void)fprintf(stderr, "dryrig-emu: replay: %s: %s\n", p->o->path, strerror(errno));
        return false;
    }
    dr_framer_reset(&framer);
    bool is_right = dr_recording_open(&reader, file);
    while (is_right && why == NULL && dr_recording_next(&reader, &r))
        why = take(p, &r, reader.line, &framer);
    if (why == NULL && reader.why[0] != '\0')
        why = reader.why;
    if (why == NULL && p->newest == 0)
        why = "it says of no controller what it is";
    if (why != NULL)
        (void)fprintf(stderr, "dryrig-emu: %s:%u: %s\n", p->o->path, reader.line, why);
    (void)fclose(file);
    return why == NULL;
}

/* -- What the host asks for ---------------------------------------------------------------------------------------------- */

static uint64_t machine_us(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * US_PER_S + (uint64_t)now.tv_nsec / NS_PER_US;
}

static bool is_same(const item *a, const item *b)
{
    return a->is_request && b->is_request && a->count == b->count && memcmp(a->bytes, b->bytes, a->count) == 0;
}

static void tell_side(const player *p, const char *side, const item *request)
{
    char text[TEXT] = "nothing more";
    if (request != NULL)
        (void)dr_words_request(text, sizeof text, &p->context, request->bytes, request->count);
    (void)fprintf(stderr, "  %s ", side);
    for (unsigned i = 0; request != NULL && i < request->count; i++)
        (void)fprintf(stderr, " %02X", (unsigned)request->bytes[i]);
    (void)fprintf(stderr, "%s%s\n", request == NULL ? " " : "  ", text);
}

/* Where it goes on behind a request that is not the next: the place of the recorded one that it is taken for. NULL:
 * nowhere. */
static const item *find(const player *p, const item *request, const char **how)
{
    const bool has_next = p->at < p->count;
    *how = "the one before, once more: it gets the same answer again";
    if (p->answered != NULL && is_same(p->answered, request))
        return p->answered;
    *how = "it comes later in the recording, which goes on there";
    for (size_t i = p->at; i < p->count; i++)
        if (is_same(&p->items[i], request))
            return &p->items[i];
    *how = "the same command, otherwise: it gets the recorded answer";
    if (has_next && request->op != (uint8_t)DR_OP_NONE && request->op == p->items[p->at].op)
        return &p->items[p->at];
    *how = "it is not in the rest of the recording: no answer";
    return NULL;
}

static void take_request(player *p, const item *request)
{
    const item *const next = p->at < p->count ? &p->items[p->at] : NULL;
    const item *found = next;
    p->requests++;
    if (next == NULL || !is_same(next, request)) {
        const char *how;
        const uint64_t first = p->host_bytes - request->count + 1u;
        found = find(p, request, &how);
        p->differences++;
        (void)fprintf(stderr, "dryrig-emu: %s", p->o->path);
        if (next != NULL)
            (void)fprintf(stderr, ":%u, %llu.%06u s", next->line, (unsigned long long)(next->when_us / US_PER_S),
                          (unsigned)(next->when_us % US_PER_S));
        (void)fprintf(stderr, ", byte %llu of the host: another request than recorded\n", (unsigned long long)first);
        tell_side(p, "recorded:", next);
        tell_side(p, "the host:", request);
        (void)fprintf(stderr, "  %s\n", how);
        if (found == NULL)
            return;
    }
    for (const item *left_out = next; left_out != NULL && left_out < found; left_out++)
        p->skipped += left_out->is_request ? 1u : 0u;
    p->answered = found;
    p->at = (size_t)(found - p->items) + 1u;
    p->then_us = found->when_us;
    p->now_us = machine_us();
}

/* Who has opened and closed the port. */
static void read_hints(player *p)
{
    char hints[4096];
    ssize_t length;
    while ((length = read(p->inotify, hints, sizeof hints)) > 0) {
        struct inotify_event hint;
        for (const char *at = hints; at < hints + length; at += sizeof hint + hint.len) {
            memcpy(&hint, at, sizeof hint);
            if (hint.wd == p->port.watch)
                pty_hint(&p->port, hint.mask);
        }
    }
    if (!p->was_opened && (p->port.opens > 0 || p->port.was_left)) {
        p->was_opened = true;
        p->now_us = machine_us();
        p->then_us = p->count > 0 ? p->items[0].when_us : 0;
    }
    pty_look(&p->port);
}

/* Is there a whole request? Who has opened or closed the port has done so before the bytes that are there now, and what is on
 * its way to a host that has gone must not meet the answer to the next. */
static bool listen_to(player *p, item *out)
{
    for (;;) {
        while (p->chunk_at < p->chunk_count) {
            p->host_bytes++;
            if (push(p, &p->framer, p->chunk[p->chunk_at++], out))
                return true;
        }
        p->chunk_at = 0;
        p->chunk_count = pty_read(&p->port, p->chunk, sizeof p->chunk);
        if (p->chunk_count == 0)
            return false;
        read_hints(p);
    }
}

/* -- Playing ------------------------------------------------------------------------------------------------------------- */

static uint64_t due_us(const player *p, const item *reply)
{
    return reply->when_us <= p->then_us ? p->now_us : p->now_us + (reply->when_us - p->then_us) / p->o->speedup;
}

/* As far as it goes now: to a request that has not been made, an answer that is not due, or a host that does not read. */
static void play(player *p)
{
    item request;
    while (p->was_opened) {
        const item *const next = p->at < p->count ? &p->items[p->at] : NULL;
        if (next == NULL || next->is_request) {
            if (!listen_to(p, &request))
                return;
            take_request(p, &request);
            continue;
        }
        if (p->o->jumps ? !pty_flush(&p->port) : machine_us() < due_us(p, next))
            return;
        (void)pty_put(&p->port, next->bytes, next->count);
        p->at++;
    }
}

static void wait_for_something(player *p)
{
    const item *const next = p->at < p->count ? &p->items[p->at] : NULL;
    const bool is_reply = next != NULL && !next->is_request;
    const bool is_full = p->port.waiting_count > 0;
    struct pollfd what[] = {
        {.fd = p->signals, .events = POLLIN}, {.fd = p->inotify, .events = POLLIN}, {.fd = p->port.fd, .events = 0}};
    struct timespec limit = {0, 0};
    what[2].events = (short)((is_reply ? 0 : POLLIN) | (is_full ? POLLOUT : 0));
    if (is_reply && p->was_opened && !p->o->jumps) {
        const uint64_t now_us = machine_us(), then_us = due_us(p, next);
        const uint64_t left_us = then_us > now_us ? then_us - now_us : 0;
        limit.tv_sec = (time_t)(left_us / US_PER_S);
        limit.tv_nsec = (long)(left_us % US_PER_S * NS_PER_US);
        (void)ppoll(what, 3, &limit, NULL);
    } else {
        (void)ppoll(what, 3, NULL, NULL);
    }
}

static bool has_signal(const player *p)
{
    struct signalfd_siginfo signal;
    return read(p->signals, &signal, sizeof signal) == (ssize_t)sizeof signal;
}

static void run(player *p)
{
    while (!has_signal(p)) {
        read_hints(p);
        play(p);
        (void)pty_flush(&p->port);
        if (p->at == p->count && p->was_opened && p->port.opens == 0)
            return; /* what it wrote before it closed has been read */
        wait_for_something(p);
    }
}

/* -- From beginning to end ----------------------------------------------------------------------------------------------- */

/* As the emulator proper: SIGINT and SIGTERM end it in any case, SIGHUP where nobody wished otherwise. */
static bool open_signals(player *p)
{
    sigset_t caught;
    struct sigaction hangup;
    (void)sigemptyset(&caught);
    (void)sigaddset(&caught, SIGINT);
    (void)sigaddset(&caught, SIGTERM);
    if (sigaction(SIGHUP, NULL, &hangup) != 0 || hangup.sa_handler != SIG_IGN)
        (void)sigaddset(&caught, SIGHUP);
    (void)sigprocmask(SIG_BLOCK, &caught, NULL);
    (void)signal(SIGINT, SIG_DFL);
    (void)signal(SIGTERM, SIG_DFL);
    (void)signal(SIGPIPE, SIG_IGN);
    p->signals = signalfd(-1, &caught, SFD_NONBLOCK | SFD_CLOEXEC);
    p->inotify = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    return p->signals >= 0 && p->inotify >= 0;
}

static bool open_port(player *p)
{
    char why[TEXT];
    const char *const wrong = open_signals(p) ? pty_open(&p->port, p->inotify) : "cannot wait for events";
    if (wrong != NULL) {
        (void)fprintf(stderr, "dryrig-emu: replay: %s: %s\n", wrong, strerror(errno));
        return false;
    }
    if (p->o->link == NULL || (p->lock = link_make(p->o->link, p->port.path, why, sizeof why)) >= 0)
        return true;
    (void)fprintf(stderr, "dryrig-emu: %s\n", why);
    pty_close(&p->port);
    return false;
}

static int sum_up(player *p)
{
    for (; p->at < p->count; p->at++)
        p->skipped += p->items[p->at].is_request ? 1u : 0u;
    (void)fprintf(stderr, "%s: %u of the host's %u requests differ, %u of the recording %s not made.\n", p->name,
                  p->differences, p->requests, p->skipped, p->skipped == 1 ? "was" : "were");
    return p->differences + p->skipped == 0 ? 0 : EXIT_DIFFERENT;
}

static int play_at_port(player *p)
{
    int status = EXIT_DIFFERENT;
    if (!open_port(p))
        return status;
    (void)fprintf(stderr,
                  "dryrig-emu plays what a Sutter %s sent in %s, at %s. It is not affiliated with Sutter Instrument.\n",
                  dr_words_controller(p->context.kind), p->o->path, p->o->link != NULL ? p->o->link : p->port.path);
    if (printf("ready %s\n", p->port.path) > 0 && fflush(stdout) == 0) {
        run(p);
        status = sum_up(p);
    } else {
        (void)fprintf(stderr, "dryrig-emu: cannot write the line 'ready' to stdout: %s\n", strerror(errno));
    }
    if (p->o->link != NULL)
        link_remove(p->o->link, p->port.path, p->lock);
    pty_close(&p->port);
    return status;
}

int playback(const playback_options *o)
{
    static player p;
    p.o = o;
    dr_framer_reset(&p.framer);
    const int status = read_recording(&p) ? play_at_port(&p) : EXIT_WRONG;
    free(p.items);
    return status;
}
