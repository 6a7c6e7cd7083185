/* dryrig-emu: a controller on a pseudo-terminal.
 *
 *     options -> instrument (controller, quirks of bytes, paced line) <-> pty <-> a host program
 *                    |                                               link: its stable name
 *                  trace
 *
 * One loop: sleep until the port, a signal or the instrument's next instant; bring the instrument to the present; pass bytes
 * on. Between events nothing runs. */
#define _GNU_SOURCE     /* epoll, inotify, ppoll, signalfd */
#include "instrument.h" /* the controller as the host sees it */
#include "link.h"       /* the stable name */
#include "options.h"    /* what was asked for */
#include "pty.h"        /* the port */
#include "trace.h"      /* what happens, in words */

#include "dr_words.h" /* names for people */

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/inotify.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#define NS_PER_US UINT64_C(1000)
#define NS_PER_S UINT64_C(1000000000)
#define CHUNK 64u /* bytes that leave at one instant, at most: a reply and what was kept behind it */
#define ROOM_WORTH_READING (INSTRUMENT_LINE_MAX / 2u)

typedef struct {
    instrument ins;
    pty port;
    trace trace;
    bool has_unread;  /* the kernel holds bytes that the line had no room for */
    bool wants_write; /* waits for the host to read */
    bool told_loss;
    uint64_t read_ns; /* when the host's last bytes came */
} station;

typedef struct {
    int epoll, inotify, signals;
    uint64_t epoch_ns; /* real time of the controller's instant 0 */
    unsigned speedup;
} loop;

/* -- Clocks ---------------------------------------------------------------------------------------------------------- */

static uint64_t real_ns(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * NS_PER_S + (uint64_t)now.tv_nsec;
}

/* The controller's clock at a real instant, and the first real instant at which it shows a time. */
static uint64_t controller_us(const loop *l, uint64_t ns)
{
    const uint64_t gone_ns = ns - l->epoch_ns;
    return gone_ns / NS_PER_US * l->speedup + gone_ns % NS_PER_US * l->speedup / NS_PER_US;
}

static uint64_t real_instant_ns(const loop *l, uint64_t us)
{
    const uint64_t n = l->speedup;
    return l->epoch_ns + us / n * NS_PER_US + (us % n * NS_PER_US + n - 1u) / n;
}

/* -- One station: an instrument at its port ---------------------------------------------------------------------------- */

static void say(station *s, const char *text)
{
    if (s->trace.file != NULL)
        trace_event(&s->trace, &s->ins, text);
}

/* Brings the instrument to now_us and hands what leaves to the port. */
static void advance(station *s, uint64_t now_us)
{
    uint8_t bytes[CHUNK];
    size_t count;
    while (instrument_run(&s->ins, now_us, bytes, sizeof bytes, &count)) {
        if (s->ins.controller.notes != NULL)
            trace_tell(&s->trace, &s->ins);
        if (count > 0)
            (void)pty_put(&s->port, bytes, count);
    }
}

/* Takes what the host has sent, as far as the line has room. */
static void listen(station *s, uint64_t now_ns, uint64_t now_us)
{
    uint8_t bytes[INSTRUMENT_LINE_MAX];
    for (;;) {
        const size_t room = instrument_room(&s->ins);
        s->has_unread = room < ROOM_WORTH_READING;
        if (s->has_unread)
            return;
        const size_t count = pty_read(&s->port, bytes, room);
        if (count == 0)
            return;
        const uint64_t pause_us = (now_ns - s->read_ns) / NS_PER_US;
        s->read_ns = now_ns;
        (void)instrument_take(&s->ins, pause_us < UINT32_MAX ? (uint32_t)pause_us : UINT32_MAX, bytes, count);
        advance(s, now_us);
        if (count < room) /* the kernel has no more; it will say when it has */
            return;
    }
}

static void watch_writing(const loop *l, station *s, bool wants_write)
{
    if (s->wants_write == wants_write)
        return;
    struct epoll_event event = {.events = EPOLLIN | EPOLLET | (wants_write ? EPOLLOUT : 0), .data.ptr = s};
    (void)epoll_ctl(l->epoll, EPOLL_CTL_MOD, s->port.fd, &event);
    s->wants_write = wants_write;
}

static void tell_loss(station *s)
{
    if (s->told_loss || s->port.lost_bytes == 0)
        return;
    s->told_loss = true;
    (void)fprintf(stderr,
                  "dryrig-emu: the host does not read %s: what it is sent from now on is lost, as on a real port\n",
                  s->port.path);
    say(s, "the host does not read: bytes for it are lost");
}

/* Who has opened and closed the port. */
static void read_hints(const loop *l, station *s)
{
    char hints[1024];
    ssize_t length;
    const bool was_open = s->port.opens > 0;
    while ((length = read(l->inotify, hints, sizeof hints)) > 0) {
        struct inotify_event hint;
        for (const char *at = hints; at < hints + length; at += sizeof hint + hint.len) {
            memcpy(&hint, at, sizeof hint);
            if (hint.wd == s->port.watch)
                pty_hint(&s->port, hint.mask);
        }
    }
    if (was_open && s->port.was_left)
        say(s, "nobody has the port open any more");
    if (s->port.opens > 0 && (!was_open || s->port.was_left))
        say(s, "the port has been opened");
    pty_look(&s->port);
}

/* What was due comes first, then who is there, then what they have sent. */
static void serve(const loop *l, station *s, uint32_t events, bool has_hints)
{
    const uint64_t now_ns = real_ns();
    const uint64_t now_us = controller_us(l, now_ns);
    advance(s, now_us);
    if (has_hints)
        read_hints(l, s);
    if ((events & EPOLLIN) != 0 || s->has_unread)
        listen(s, now_ns, now_us);
    watch_writing(l, s, !pty_flush(&s->port));
    tell_loss(s);
}

/* -- The loop -------------------------------------------------------------------------------------------------------- */

/* Sleeps until something happens. Returns how many events there are. */
static int wait_for_events(const loop *l, const station *s, struct epoll_event *events, int room)
{
    uint64_t due_us;
    if (!instrument_due(&s->ins, &due_us))
        return epoll_wait(l->epoll, events, room, -1);
    const uint64_t due_ns = real_instant_ns(l, due_us);
    const uint64_t now_ns = real_ns();
    if (due_ns > now_ns) { /* epoll_wait() counts milliseconds only */
        struct pollfd any = {.fd = l->epoll, .events = POLLIN};
        const uint64_t left_ns = due_ns - now_ns;
        const struct timespec left = {(time_t)(left_ns / NS_PER_S), (long)(left_ns % NS_PER_S)};
        if (ppoll(&any, 1, &left, NULL) <= 0)
            return 0;
    }
    return epoll_wait(l->epoll, events, room, 0);
}

static void run(loop *l, station *s)
{
    for (;;) {
        struct epoll_event events[4];
        uint32_t port_events = 0;
        bool has_hints = false;
        const int count = wait_for_events(l, s, events, 4);
        for (int i = 0; i < count; i++) {
            if (events[i].data.ptr == &l->signals)
                return;
            if (events[i].data.ptr == &l->inotify)
                has_hints = true;
            else
                port_events |= events[i].events;
        }
        serve(l, s, port_events, has_hints);
    }
}

/* -- Starting -------------------------------------------------------------------------------------------------------- */

/* A program that is started without stdin, stdout or stderr must not get the port under their numbers. */
static void fill_standard_fds(void)
{
    int fd;
    while ((fd = open("/dev/null", O_RDWR)) >= 0 && fd <= STDERR_FILENO) {}
    if (fd > STDERR_FILENO)
        (void)close(fd);
}

/* SIGINT and SIGTERM end the program even where they came in ignored, as in a background job; an ignored SIGHUP is somebody's
 * wish (nohup). */
static int open_signals(void)
{
    sigset_t ending;
    (void)sigemptyset(&ending);
    (void)sigaddset(&ending, SIGINT);
    (void)sigaddset(&ending, SIGTERM);
    struct sigaction hangup;
    if (sigaction(SIGHUP, NULL, &hangup) != 0 || hangup.sa_handler != SIG_IGN)
        (void)sigaddset(&ending, SIGHUP);
    (void)sigprocmask(SIG_BLOCK, &ending, NULL);
    (void)signal(SIGINT, SIG_DFL);
    (void)signal(SIGTERM, SIG_DFL);
    (void)signal(SIGPIPE, SIG_IGN);
    return signalfd(-1, &ending, SFD_NONBLOCK | SFD_CLOEXEC);
}

static void watch(const loop *l, int fd, uint32_t events, void *who)
{
    struct epoll_event event = {.events = events, .data.ptr = who};
    if (epoll_ctl(l->epoll, EPOLL_CTL_ADD, fd, &event) != 0) {
        (void)fprintf(stderr, "dryrig-emu: cannot wait for events: %s\n", strerror(errno));
        exit(1);
    }
}

static void set_up(station *s, options *o)
{
    dr_controller *c = &s->ins.controller;
    dr_controller_init(c, o->kind, o->drives, o->drive_count);
    c->firmware = o->firmware;
    c->quirks = o->quirks;
    c->angle_deg = o->angle_deg;
    memcpy(c->home_steps, o->home_steps, sizeof c->home_steps);
    s->ins.quirks = o->byte_quirks;
    s->ins.is_paced = o->is_paced;
}

/* For people. Stdout carries the one line that programs wait for. */
static void introduce(const options *o, const char *port)
{
    char firmware[16];
    const char *stage = NULL;
    (void)dr_words_firmware(firmware, sizeof firmware, o->firmware);
    (void)fprintf(stderr,
                  "dryrig-emu emulates a Sutter %s, firmware %s. It is not affiliated with Sutter Instrument.\n",
                  dr_words_controller(o->kind), firmware);
    (void)fprintf(stderr, "  devices: ");
    for (uint8_t i = 0; i < o->drive_count; i++) {
        const char *const name = dr_words_stage((dr_stage_id)o->drives[i].stage);
        (void)fprintf(stderr, "%s%s", i == 0 ? "" : ", ", name);
        if (stage == NULL && o->drives[i].stage != DR_STAGE_NONE)
            stage = name;
    }
    (void)fprintf(stderr, "\n  quirks:  ");
    for (unsigned i = 0, said = 0; i < DR_QUIRK_IDS; i++)
        if ((o->quirk_ids & 1u << i) != 0)
            (void)fprintf(stderr, "%s%s", said++ == 0 ? "" : ", ", dr_words_quirk((dr_quirk_id)i)->name);
    (void)fprintf(stderr, "%s\n  line:    ", o->quirk_ids == 0 ? "none, as documented" : "");
    if (o->is_paced)
        (void)fprintf(stderr, "%u baud", (unsigned)(o->kind == DR_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC));
    else
        (void)fprintf(stderr, "not paced");
    if (o->speedup > 1)
        (void)fprintf(stderr, ", %u times faster than real time", o->speedup);
    (void)fprintf(stderr, "\nIt listens at %s until it is interrupted. In another terminal:\n", port);
    if (stage == NULL)
        (void)fprintf(stderr, "  dryrig --port %s --controller %s info\n", port, dr_words_kind(o->kind));
    else
        (void)fprintf(stderr, "  dryrig --port %s --controller %s --stage %s position\n", port, dr_words_kind(o->kind),
                      stage);
}

static int fail(const char *what)
{
    (void)fprintf(stderr, "dryrig-emu: %s: %s\n", what, strerror(errno));
    return 1;
}

/* The port is open, the link is made. */
static int start_and_run(loop *l, station *s, const options *o)
{
    if (o->trace != NULL && !trace_open(&s->trace, o->trace, &s->ins)) {
        (void)fprintf(stderr, "dryrig-emu: --trace %s: %s\n", o->trace, strerror(errno));
        return 1;
    }
    introduce(o, o->link != NULL ? o->link : s->port.path);
    l->epoch_ns = s->read_ns = real_ns();
    instrument_start(&s->ins, 0);
    if (printf("ready %s\n", s->port.path) < 0 || fflush(stdout) != 0)
        return fail("cannot write the line 'ready' to stdout");
    run(l, s);
    if (s->trace.file != NULL)
        trace_close(&s->trace);
    return 0;
}

int main(int argc, char **argv)
{
    static station s;
    loop l = {.epoll = -1};
    fill_standard_fds();
    options o = options_read(argc, argv);
    set_up(&s, &o);
    l.speedup = o.speedup;

    l.signals = open_signals();
    l.epoll = epoll_create1(EPOLL_CLOEXEC);
    l.inotify = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    if (l.signals < 0 || l.epoll < 0 || l.inotify < 0)
        return fail("cannot wait for events (/proc/sys/fs/inotify and ulimit -n have limits)");
    (void)prctl(PR_SET_TIMERSLACK, 1ul, 0ul, 0ul, 0ul); /* bytes are 78 us apart, the usual slack is 50 us */

    const char *const wrong = pty_open(&s.port, l.inotify);
    if (wrong != NULL)
        return fail(wrong);
    watch(&l, l.signals, EPOLLIN, &l.signals);
    watch(&l, l.inotify, EPOLLIN, &l.inotify);
    watch(&l, s.port.fd, EPOLLIN | EPOLLET, &s);

    char why[512];
    const int lock = o.link == NULL ? -1 : link_make(o.link, s.port.path, why, sizeof why);
    if (o.link != NULL && lock < 0) {
        (void)fprintf(stderr, "dryrig-emu: --link: %s\n", why);
        return 1;
    }
    const int status = start_and_run(&l, &s, &o);
    if (o.link != NULL)
        link_remove(o.link, s.port.path, lock);
    return status;
}
