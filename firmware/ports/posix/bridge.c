#define _GNU_SOURCE /* ppoll, inotify, signalfd */
#include "bridge.h"

#include "link.h" /* the stable name of the host's port */
#include "say.h"

#include "dr_words.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define S_US UINT64_C(1000000)
#define TRY_AGAIN_US (S_US / 2)     /* while the controller's port is gone */
#define DRAIN_US (S_US / 1000)      /* a frame of 14 bytes takes 1.1 to 2.4 ms */
#define CHECK_US S_US               /* memory, while something may move */
#define REST_US (3 * S_US)          /* at the end; then it is left as it is */
#define STEP_US (UINT64_C(1) << 30) /* the guard tells instants apart up to 2^31 us */
#define CHUNK 256u
#define CHUNKS_MAX 64u

enum { FD_SIGNALS, FD_INOTIFY, FD_HOST, FD_DEVICE, FD_CONTROL, FDS = FD_CONTROL + CONTROL_FDS };

/* -- Time -------------------------------------------------------------------------------------------------------------- */

static uint64_t clock_us(clockid_t id)
{
    struct timespec now;
    (void)clock_gettime(id, &now);
    return (uint64_t)now.tv_sec * S_US + (uint64_t)now.tv_nsec / 1000u;
}

dr_us bridge_now(const bridge *b) { return (dr_us)b->now_us; }

/* Time goes on. A guard that was not looked at for very long (a suspended machine) still sees what was due in order. */
static void advance(bridge *b)
{
    const uint64_t now_us = clock_us(CLOCK_MONOTONIC) - b->epoch_us;
    while (now_us - b->now_us > STEP_US) {
        b->now_us += STEP_US;
        (void)dr_guard_self_check(&b->guard, bridge_now(b));
    }
    b->now_us = now_us;
}

/* -- What the guard wants to be done ----------------------------------------------------------------------------------- */

static void keep_records(bridge *b)
{
    dr_record record;
    bool is_kept = !b->journal.has_failed; /* until a record says otherwise */
    while (dr_guard_pull_log(&b->guard, &record)) {
        const uint64_t ago_us = (uint32_t)(bridge_now(b) - record.when);
        is_kept = journal_add(&b->journal, &b->rig, &record, clock_us(CLOCK_REALTIME) - ago_us);
    }
    if (!is_kept && !b->log_said)
        say("dryrig-guard: the log %s cannot be written: %s\n", b->options->log, strerror(errno));
    if (!is_kept != b->log_said) {
        b->log_said = !is_kept;
        dr_guard_input(&b->guard, bridge_now(b), DR_INPUT_LOG_FAILED, !is_kept);
        while (dr_guard_pull_log(&b->guard, &record)) /* what the input itself has to say; it may fail as well */
            (void)journal_add(&b->journal, &b->rig, &record, clock_us(CLOCK_REALTIME));
    }
}

/* -- The recording: what went over the controller's line --------------------------------------------------------------- */

static const char *recorded_name(const bridge *b) { return dr_words_kind((dr_kind)b->rig.limits.kind); }

static void record_bytes(bridge *b, char kind, const uint8_t *bytes, size_t count)
{
    recording_bytes(&b->recording, b->now_us, b->now_us, recorded_name(b), kind, bytes, count);
}

static void record_event(bridge *b, const char *text)
{
    recording_event(&b->recording, b->now_us, b->now_us, recorded_name(b), text);
}

/* What is known of the controller: what the configuration tells. */
static bool open_recording(bridge *b)
{
    char text[16];
    const dr_limits *const l = &b->rig.limits;
    const char *const name = recorded_name(b);
    if (b->options->record == NULL)
        return true;
    if (!recording_open(&b->recording, "dryrig-guard", b->options->record))
        return false;
    recording_set(&b->recording, name, "controller", name);
    (void)dr_words_firmware(text, sizeof text, l->firmware);
    recording_set(&b->recording, name, "firmware", text);
    for (uint8_t drive = 0; drive < rig_ports(l); drive++)
        recording_set(&b->recording, name, "device", dr_words_stage((dr_stage_id)l->drives[drive].stage));
    return true;
}

/* -- The controller's port --------------------------------------------------------------------------------------------- */

static void lose_device(bridge *b, const char *why)
{
    device_close(&b->device);
    (void)snprintf(b->device_says, sizeof b->device_says, "%s: %s", b->options->port, why);
    record_event(b, b->device_says);
    b->next_try_us = b->now_us + TRY_AGAIN_US;
    dr_guard_link(&b->guard, bridge_now(b), b->host.opens > 0, false);
}

static bool is_stop(const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++)
        if (bytes[i] != DR_INTERRUPT)
            return false;
    return true;
}

static void send_device(bridge *b, const uint8_t *bytes, size_t count)
{
    if (b->device.fd < 0)
        return;
    if (device_write(&b->device, bytes, count)) {
        b->unanswered += (uint32_t)count;
        record_bytes(b, '>', bytes, count);
    } else {
        lose_device(b, "it takes no more bytes, or is gone");
    }
}

static void set_mark(bridge *b, bool on)
{
    if (mark_set(&b->mark, on) || b->mark_lost)
        return;
    b->mark_lost = true;
    say("dryrig-guard: %s cannot be written: %s\n", b->mark.given.path, strerror(errno));
}

/* What is to be known after a kill. Half a frame may be in the controller: this guard has sent one, or was told so; or an
 * MPC-200 has not answered since it was started, and may have been waiting before (it is a guess, but a restart must not give it
 * as many bytes again). */
static void keep_mark(bridge *b, bool is_ending)
{
    dr_guard_status status;
    dr_guard_get_status(&b->guard, &status);
    if (status.state != DR_GUARD_LOCKED)
        b->unanswered = 0;
    const bool is_silent = b->rig.limits.kind == DR_MPC && status.state == DR_GUARD_LOCKED && b->unanswered > 0;
    const bool may_be_torn = dr_guard_is_mid_frame(&b->guard) || is_silent;
    const bool is_leaving =
        b->mark.is_set && !is_ending && !device_is_sent(&b->device); /* the kernel sends it at the end */
    b->mark_due_us = is_leaving && !may_be_torn ? b->now_us + DRAIN_US : 0;
    set_mark(b, may_be_torn || is_leaving);
}

/* A stop leaves at once; a reply next; anything else for the controller when its record is kept. */
void bridge_pump(bridge *b)
{
    uint8_t out[CHUNK], in[CHUNK];
    const size_t out_count = dr_guard_pull_device(&b->guard, bridge_now(b), out, sizeof out);
    const bool stops = is_stop(out, out_count);
    if (dr_guard_is_mid_frame(&b->guard)) /* before its first byte is out */
        set_mark(b, true);
    if (out_count > 0 && stops)
        send_device(b, out, out_count);
    const size_t in_count = dr_guard_pull_host(&b->guard, bridge_now(b), in, sizeof in);
    if (in_count > 0) {
        (void)pty_put(&b->host, in, in_count);
        (void)pty_flush(&b->host);
    }
    keep_records(b);
    if (out_count > 0 && !stops)
        send_device(b, out, out_count);
    (void)dr_guard_pull_device(&b->guard, bridge_now(b), out, 0); /* nothing is left to do: it seals its memory */
}

/* -- What comes in ----------------------------------------------------------------------------------------------------- */

static void tell_link(bridge *b)
{
    dr_guard_link(&b->guard, bridge_now(b), b->host.opens > 0, b->device.fd >= 0);
    bridge_pump(b);
}

/* False: there is nothing. */
static bool take_host_bytes(bridge *b)
{
    uint8_t bytes[CHUNK];
    const size_t count = pty_read(&b->host, bytes, sizeof bytes);
    if (count == 0)
        return false;
    dr_guard_push_host(&b->guard, bridge_now(b), bytes, count);
    bridge_pump(b);
    return true;
}

/* Who has opened and closed the host's port. */
static void read_hints(bridge *b)
{
    char hints[1024];
    ssize_t length;
    const bool was_open = b->host.opens > 0;
    while ((length = read(b->inotify, hints, sizeof hints)) > 0) {
        struct inotify_event hint;
        for (const char *at = hints; at < hints + length; at += sizeof hint + hint.len) {
            memcpy(&hint, at, sizeof hint);
            if (hint.wd == b->host.watch)
                pty_hint(&b->host, hint.mask);
        }
    }
    if (b->host.was_left) { /* even if the next one is there already */
        for (unsigned i = 0; i < CHUNKS_MAX && take_host_bytes(b); i++)
            ; /* its last words are its own: half a command must not be for the next one to complete */
        dr_guard_link(&b->guard, bridge_now(b), false, b->device.fd >= 0);
        bridge_pump(b);
    }
    pty_look(&b->host);
    b->host_left = b->host_left || b->host.was_left || (was_open && b->host.opens == 0);
    tell_link(b);
}

static void listen_to_host(bridge *b)
{
    if (b->host.opens == 0) /* it was opened a moment ago */
        read_hints(b);
    (void)take_host_bytes(b);
}

static void listen_to_device(bridge *b)
{
    uint8_t bytes[CHUNK];
    const ssize_t count = device_read(&b->device, bytes, sizeof bytes);
    if (count > 0) {
        b->unanswered = 0;
        record_bytes(b, '<', bytes, (size_t)count);
    }
    if (count > 0)
        dr_guard_push_device(&b->guard, bridge_now(b), bytes, (size_t)count);
    else if (count < 0)
        lose_device(b, "it is gone (unplugged?)");
    if (count != 0)
        bridge_pump(b);
}

/* DRYRIG_OK, or a dryrig_error; b->device_says tells why. */
static int try_device(bridge *b)
{
    const int result = device_open(&b->device, &b->rig.limits, b->device_says, sizeof b->device_says);
    b->next_try_us = b->now_us + TRY_AGAIN_US;
    if (result != DRYRIG_OK)
        return result;
    if (!mark_follow(&b->mark, b->options->port, b->device_says, sizeof b->device_says)) {
        device_close(&b->device);
        if (!b->other_said)
            say("dryrig-guard: %s\n", b->device_says);
        b->other_said = true;
        return DRYRIG_ERR_NO_PORT;
    }
    b->other_said = false;
    b->device_says[0] = '\0';
    return DRYRIG_OK;
}

/* -- The loop ---------------------------------------------------------------------------------------------------------- */

static bool may_move(const bridge *b) { return b->was_armed; }

static void sooner(uint64_t *due_us, bool *any, uint64_t when_us)
{
    if (!*any || when_us < *due_us)
        *due_us = when_us;
    *any = true;
}

/* When something is to be done by itself. False: never, as things are. */
static bool next_due(const bridge *b, uint64_t *due_us)
{
    bool any = false;
    dr_us when;
    uint64_t order_us;
    if (dr_guard_due(&b->guard, &when)) {
        const uint32_t left_us = when - bridge_now(b);
        sooner(due_us, &any, dr_us_before(when, bridge_now(b)) ? b->now_us : b->now_us + left_us);
    }
    if (b->device.fd < 0)
        sooner(due_us, &any, b->next_try_us);
    if (orders_due(b, &order_us))
        sooner(due_us, &any, order_us);
    if (may_move(b))
        sooner(due_us, &any, b->next_check_us);
    if (b->mark_due_us != 0)
        sooner(due_us, &any, b->mark_due_us);
    return any;
}

static void wait(const bridge *b, struct pollfd *fds)
{
    uint64_t due_us = 0;
    struct timespec left = {0, 0};
    const bool is_due = next_due(b, &due_us);
    fds[FD_SIGNALS] = (struct pollfd){b->signals, POLLIN, 0};
    fds[FD_INOTIFY] = (struct pollfd){b->inotify, POLLIN, 0};
    fds[FD_HOST] = (struct pollfd){b->host.fd, (short)(POLLIN | (b->host.waiting_count > 0 ? POLLOUT : 0)), 0};
    fds[FD_DEVICE] = (struct pollfd){b->device.fd, POLLIN, 0};
    control_watch(&b->control, &fds[FD_CONTROL]);
    const uint64_t now_us = clock_us(CLOCK_MONOTONIC) - b->epoch_us;
    if (is_due && due_us > now_us)
        left = (struct timespec){(time_t)((due_us - now_us) / S_US), (long)((due_us - now_us) % S_US * 1000u)};
    if (ppoll(fds, FDS, is_due ? &left : NULL, NULL) < 0)
        for (unsigned i = 0; i < FDS; i++)
            fds[i].revents = 0;
}

/* People's orders first: a stop is among them. */
static void serve(bridge *b, const struct pollfd *fds)
{
    b->host_left = false;
    advance(b);
    bridge_pump(b);
    control_serve(&b->control, &fds[FD_CONTROL], orders_take, b);
    if (fds[FD_INOTIFY].revents != 0)
        read_hints(b);
    if ((fds[FD_HOST].revents & POLLIN) != 0)
        listen_to_host(b);
    if ((fds[FD_HOST].revents & POLLOUT) != 0)
        (void)pty_flush(&b->host);
    if (b->device.fd >= 0 && fds[FD_DEVICE].fd == b->device.fd && fds[FD_DEVICE].revents != 0)
        listen_to_device(b);
    if (b->device.fd < 0 && b->now_us >= b->next_try_us && try_device(b) == DRYRIG_OK) {
        record_event(b, "the port is there");
        tell_link(b);
    }
    if (may_move(b) && b->now_us >= b->next_check_us) {
        b->next_check_us = b->now_us + CHECK_US;
        (void)dr_guard_self_check(&b->guard, bridge_now(b));
        bridge_pump(b);
    }
    orders_continue(b);
    orders_tell(b);
    keep_mark(b, false);
    recording_flush(&b->recording); /* after everything that somebody waits for */
}

/* -- Starting ---------------------------------------------------------------------------------------------------------- */

static int fail(const char *what, const char *why)
{
    (void)fprintf(stderr, "dryrig-guard: %s%s%s\n", what, *what != '\0' ? ": " : "", why);
    return 1;
}

/* SIGINT and SIGTERM end the program even where they came in ignored, as in a background job; an ignored SIGHUP is somebody's
 * wish (nohup). */
static int open_signals(void)
{
    sigset_t ending;
    struct sigaction hangup;
    (void)sigemptyset(&ending);
    (void)sigaddset(&ending, SIGINT);
    (void)sigaddset(&ending, SIGTERM);
    (void)sigaddset(&ending, SIGQUIT); /* and others that would end it without a ^C */
    (void)sigaddset(&ending, SIGUSR1);
    (void)sigaddset(&ending, SIGUSR2);
    (void)sigaddset(&ending, SIGALRM);
    if (sigaction(SIGHUP, NULL, &hangup) != 0 || hangup.sa_handler != SIG_IGN)
        (void)sigaddset(&ending, SIGHUP);
    (void)sigprocmask(SIG_BLOCK, &ending, NULL);
    (void)signal(SIGINT, SIG_DFL);
    (void)signal(SIGTERM, SIG_DFL);
    (void)signal(SIGPIPE, SIG_IGN);
    (void)signal(SIGTSTP, SIG_IGN); /* Ctrl-Z: suspended, it would guard nothing while something moves */
    (void)signal(SIGXFSZ, SIG_IGN); /* a log that may not grow is an error to be told */
    return signalfd(-1, &ending, SFD_NONBLOCK | SFD_CLOEXEC);
}

static void introduce(const bridge *b)
{
    char firmware[16];
    const dr_limits *const l = &b->rig.limits;
    (void)dr_words_firmware(firmware, sizeof firmware, l->firmware);
    say("dryrig-guard guards a Sutter %s, firmware %s, at %s. It is not affiliated with Sutter Instrument.\n"
        "  limits:  %s, revision %u, hash %08X\n  host:    open %s instead of %s\n",
        dr_words_controller((dr_kind)l->kind), firmware, b->options->port, b->options->config, l->revision,
        dr_limits_crc(l), b->options->link != NULL ? b->options->link : b->host.path, b->options->port);
}

/* As when the key is turned off: a frame that has been begun is finished, so that the controller does not wait for the rest of
 * it; what moves is stopped, and proved to be at rest. Orders are not taken any more. */
static void come_to_rest(bridge *b)
{
    struct pollfd fds[FDS];
    dr_guard_status status;
    advance(b);
    const uint64_t until_us = b->now_us + REST_US;
    (void)close(b->signals);
    b->signals = -1;
    dr_guard_input(&b->guard, bridge_now(b), DR_INPUT_KEY, false);
    bridge_pump(b);
    for (dr_guard_get_status(&b->guard, &status); (status.needs & DR_NEEDS_REST) != 0 && b->now_us < until_us;
         dr_guard_get_status(&b->guard, &status)) {
        wait(b, fds);
        for (unsigned i = FD_CONTROL; i < FDS; i++)
            fds[i].revents = 0;
        serve(b, fds);
    }
}

/* Everything is open. The guard wakes up, and so does the controller if the last guard died over it: it gets a ^C first. */
static int start_and_run(bridge *b, bool after_crash)
{
    struct pollfd fds[FDS];
    introduce(b);
    dr_guard_init(&b->guard, &b->rig.limits, b->ring, BRIDGE_RING);
    dr_guard_start(&b->guard, bridge_now(b),
                   b->mark.is_set ? DR_START_MID_FRAME
                   : after_crash  ? DR_START_AFTER_RESET
                                  : DR_START_POWER_ON);
    if (printf("ready %s\n", b->host.path) < 0 || fflush(stdout) != 0)
        return fail("cannot write the line 'ready' to stdout", strerror(errno));
    if (after_crash || b->mark.is_set)
        b->disarmed_says = "the guard before did not end in order";
    read_hints(b);
    orders_tell(b);
    for (;;) {
        wait(b, fds);
        if (fds[FD_SIGNALS].revents != 0)
            break;
        serve(b, fds);
    }
    come_to_rest(b);
    orders_end(b);
    keep_mark(b, true);
    return 0;
}

static int open_rest(bridge *b)
{
    const bridge_options *const o = b->options;
    char why[RIG_WHY_MAX];
    struct stat is;
    if (!control_open(&b->control, o->control, why, sizeof why))
        return fail("--control", why);
    const bool had_link = o->link != NULL && lstat(o->link, &is) == 0;
    const int link_lock = o->link == NULL ? -1 : link_make(o->link, b->host.path, why, sizeof why);
    if (o->link != NULL && link_lock < 0) {
        control_close(&b->control);
        return fail("--link", why);
    }
    const bool after_crash = had_link || b->control.replaced;
    int status;
    if (!journal_open(&b->journal, o->log))
        status = fail(o->log, errno == EINVAL  ? "is no file"
                              : errno == EBUSY ? "another guard keeps its log there; choose another file"
                                               : strerror(errno));
    else if (!open_recording(b)) /* last: it may empty a file */
        status = fail(o->record, strerror(errno));
    else
        status = start_and_run(b, after_crash);
    journal_close(&b->journal);
    (void)recording_close(&b->recording);
    if (o->link != NULL)
        link_remove(o->link, b->host.path, link_lock);
    control_close(&b->control);
    return status;
}

int bridge_run(bridge *b, const bridge_options *options)
{
    b->options = options;
    b->device = (device){.path = options->port, .fd = -1};
    b->epoch_us = clock_us(CLOCK_MONOTONIC);
    b->signals = open_signals();
    b->inotify = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    if (b->signals < 0 || b->inotify < 0)
        return fail("cannot wait for events (/proc/sys/fs/inotify and ulimit -n have limits)", strerror(errno));
    (void)prctl(PR_SET_TIMERSLACK, 1ul, 0ul, 0ul, 0ul); /* the usual slack is 50 us, half a byte time */

    /* A port that is not there yet is waited for; one that is somebody else's, or no port, is an error now. */
    char why[RIG_WHY_MAX];
    if (!mark_open(&b->mark, options->port, why, sizeof why))
        return fail("--port", why);
    const int result = try_device(b);
    if (result != DRYRIG_OK && result != DRYRIG_ERR_NO_PORT) {
        mark_close(&b->mark);
        return fail("--port", b->device_says);
    }
    const char *const wrong = pty_open(&b->host, b->inotify);
    const int status = wrong != NULL ? fail(wrong, strerror(errno)) : open_rest(b);
    if (wrong == NULL)
        pty_close(&b->host);
    device_close(&b->device);
    mark_close(&b->mark);
    return status;
}
