#define _GNU_SOURCE /* epoll, inotify, ppoll */
#include "engine.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/inotify.h>
#include <sys/prctl.h>
#include <time.h>
#include <unistd.h>

#define NS_PER_US UINT64_C(1000)
#define NS_PER_S UINT64_C(1000000000)
#define EVENTS 32

/* -- Clocks ---------------------------------------------------------------------------------------------------------- */

static uint64_t real_ns(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * NS_PER_S + (uint64_t)now.tv_nsec;
}

static bool is_running(const engine *e) { return e->mode == CLOCK_REAL && !e->waits_for_client; }

/* The controllers' clock at a real instant, and the first real instant at which it shows a time. */
static uint64_t controller_us(const engine *e, uint64_t ns)
{
    const uint64_t gone_ns = ns - e->epoch_ns;
    return gone_ns / NS_PER_US * e->speedup + gone_ns % NS_PER_US * e->speedup / NS_PER_US;
}

static uint64_t real_instant_ns(const engine *e, uint64_t us)
{
    const uint64_t n = e->speedup;
    return e->epoch_ns + us / n * NS_PER_US + (us % n * NS_PER_US + n - 1u) / n;
}

static void look_at_clock(engine *e)
{
    e->now_ns = real_ns();
    if (is_running(e))
        e->now_us = controller_us(e, e->now_ns);
}

/* -- What is due ------------------------------------------------------------------------------------------------------- */

static bool station_due(const engine *e, uint64_t *when_us, station **whose)
{
    bool have = false;
    uint64_t when;
    for (unsigned i = 0; i < e->station_count; i++) {
        station *const s = &e->stations[i];
        bool is_due = instrument_due(&s->ins, &when);
        if (s->plug_at_us > 0 && (!is_due || s->plug_at_us < when)) {
            is_due = true;
            when = s->plug_at_us;
        }
        if (is_due && (!have || when < *when_us)) {
            have = true;
            *when_us = when;
            *whose = s;
        }
    }
    return have;
}

static const planned *next_plan(const engine *e, bool is_passive_too)
{
    const planned *p = e->plans;
    while (p != NULL && p->is_passive && !is_passive_too)
        p = p->next;
    return p;
}

static bool due(const engine *e, bool is_passive_too, uint64_t *when_us)
{
    station *whose;
    const bool have = station_due(e, when_us, &whose);
    const planned *const plan = next_plan(e, is_passive_too);
    if (plan != NULL && (!have || plan->when_us < *when_us))
        *when_us = plan->when_us;
    return have || plan != NULL;
}

bool engine_due(const engine *e, uint64_t *when_us) { return due(e, false, when_us); }

/* The plug goes in again by itself. */
static void plug_again(engine *e, station *s)
{
    char why[512];
    s->plug_at_us = 0;
    if (engine_plug_station(e, s, why, sizeof why))
        return;
    (void)fprintf(stderr, "dryrig-emu: the USB plug of %s stays out: %s\n", s->name, why);
    station_say(s, OBSERVED_EVENT, "the USB plug cannot be put in");
}

/* Brings a station to an instant, and its plug with it. */
static void run_station(engine *e, station *s, uint64_t until_us)
{
    for (bool is_there = false; !is_there;) {
        const bool plugs = s->plug_at_us > 0 && s->plug_at_us <= until_us;
        if (!station_run(s, plugs ? s->plug_at_us : until_us, e->now_ns))
            engine_unplug_station(e, s, s->ins.faults.unplug_us);
        else if (plugs)
            plug_again(e, s);
        else
            is_there = true;
    }
}

/* Brings everything to now_us, in order of time. What is planned for an instant comes after what controllers do then. */
static void run_to_now(engine *e)
{
    const uint64_t until_us = e->now_us;
    for (;;) {
        uint64_t when_us = 0;
        station *whose = NULL;
        planned *const plan = e->plans;
        const bool have_plan = plan != NULL && plan->when_us <= until_us;
        if (station_due(e, &when_us, &whose) && when_us <= (have_plan ? plan->when_us : until_us)) {
            const bool is_alone = e->station_count == 1 && !have_plan; /* nobody to wait for */
            run_station(e, whose, is_alone ? until_us : when_us);
        } else if (have_plan) {
            e->now_us = plan->when_us;
            for (unsigned i = 0; i < e->station_count; i++)
                run_station(e, &e->stations[i], plan->when_us);
            engine_unplan(e, plan);
            plan->strike(plan);
            e->now_us = until_us;
        } else {
            break;
        }
    }
    for (unsigned i = 0; i < e->station_count; i++)
        run_station(e, &e->stations[i], until_us);
}

/* -- Ports ------------------------------------------------------------------------------------------------------------- */

static station *station_of(engine *e, const source *who) { return &e->stations[who - e->station_sources]; }

static void flush(engine *e, station *s)
{
    const bool wants_write = !station_flush(s);
    if (s->wants_write == wants_write || !s->is_plugged)
        return;
    engine_change(e, &e->station_sources[s - e->stations], s->port.fd,
                  EPOLLIN | EPOLLET | (wants_write ? (uint32_t)EPOLLOUT : 0u));
    s->wants_write = wants_write;
}

static void flush_all(engine *e)
{
    for (unsigned i = 0; i < e->station_count; i++)
        if (e->stations[i].port.waiting_count > 0 || e->stations[i].wants_write)
            flush(e, &e->stations[i]);
}

static void take_in(engine *e, station *s)
{
    e->now_ns = real_ns(); /* not before it was written: pauses never look shorter for that */
    station_take(s, e->now_ns);
    run_station(e, s, e->now_us);
}

static void collect_hints(engine *e)
{
    char hints[4096];
    ssize_t length;
    while ((length = read(e->inotify, hints, sizeof hints)) > 0) {
        struct inotify_event hint;
        for (const char *at = hints; at < hints + length; at += sizeof hint + hint.len) {
            memcpy(&hint, at, sizeof hint);
            for (unsigned i = 0; i < e->station_count; i++)
                if (e->stations[i].is_plugged && hint.wd == e->stations[i].port.watch)
                    pty_hint(&e->stations[i].port, hint.mask);
        }
    }
}

/* Who has left the port has written before. What is there now is its own, where nobody has opened the port since: what a next
 * one has written comes when the port has been looked at. */
static void hear_out(engine *e, station *s)
{
    while (s->was_open && s->port.opens == 0 && (s->chunk_count > 0 || station_read(s))) {
        collect_hints(e);
        if (s->port.opens == 0)
            take_in(e, s);
    }
}

/* Who has opened and closed ports. */
static void read_hints(engine *e)
{
    collect_hints(e);
    for (unsigned i = 0; i < e->station_count; i++)
        hear_out(e, &e->stations[i]);
    for (unsigned i = 0; i < e->station_count; i++) {
        station_look(&e->stations[i]);
        if (e->waits_for_client && e->stations[i].port.opens > 0) {
            e->waits_for_client = false;
            e->epoch_ns = e->now_ns;
        }
    }
    for (unsigned i = 0; i < e->station_count; i++)
        if (e->stations[i].chunk_count > 0)
            take_in(e, &e->stations[i]);
}

/* Takes what a host has sent, as far as the line has room. */
static void listen_to(engine *e, station *s)
{
    while (station_read(s)) {
        const bool has_more = s->chunk_is_full; /* if not, the kernel will say when it has */
        read_hints(e);                          /* see station_take() */
        if (!has_more)
            return;
    }
}

static void hints_ready(source *who, uint32_t events)
{
    (void)who; /* read ahead of everything else, see engine_run() */
    (void)events;
}

static void station_ready(source *who, uint32_t events)
{
    (void)who; /* the engine knows its stations, see engine_run() */
    (void)events;
}

static bool is_station(const engine *e, const source *who)
{
    return who >= e->station_sources && who < e->station_sources + e->station_count;
}

void engine_unplug_station(engine *e, station *s, uint64_t span_us)
{
    s->ins.faults.unplug_us = 0;
    if (!s->is_plugged)
        return;
    s->plug_at_us = span_us > 0 ? s->ins.now_us + span_us : 0;
    engine_forget(e, s->port.fd);
    station_say(s, OBSERVED_EVENT, "the USB plug is out");
    station_unplug(s, e->inotify);
}

bool engine_plug_station(engine *e, station *s, char *why, size_t room)
{
    if (s->is_plugged)
        return true;
    s->plug_at_us = 0;
    if (!station_plug(s, e->inotify, why, room))
        return false;
    if (!engine_watch(e, &e->station_sources[s - e->stations], s->port.fd, EPOLLIN | EPOLLET)) {
        (void)snprintf(why, room, "the port cannot be watched: %s", strerror(errno));
        station_unplug(s, e->inotify);
        return false;
    }
    station_say(s, OBSERVED_EVENT, "the USB plug is in");
    return true;
}

/* -- Sources and plans --------------------------------------------------------------------------------------------------- */

bool engine_watch(engine *e, source *who, int fd, uint32_t epoll_events)
{
    struct epoll_event event = {.events = epoll_events, .data.ptr = who};
    return epoll_ctl(e->epoll, EPOLL_CTL_ADD, fd, &event) == 0;
}

void engine_change(engine *e, source *who, int fd, uint32_t epoll_events)
{
    struct epoll_event event = {.events = epoll_events, .data.ptr = who};
    (void)epoll_ctl(e->epoll, EPOLL_CTL_MOD, fd, &event);
}

void engine_forget(engine *e, int fd) { (void)epoll_ctl(e->epoll, EPOLL_CTL_DEL, fd, NULL); }

void engine_plan(engine *e, planned *what)
{
    planned **at = &e->plans;
    while (*at != NULL && (*at)->when_us <= what->when_us)
        at = &(*at)->next;
    what->next = *at;
    *at = what;
}

void engine_unplan(engine *e, planned *what)
{
    for (planned **at = &e->plans; *at != NULL; at = &(*at)->next)
        if (*at == what) {
            *at = what->next;
            return;
        }
}

/* -- The loop -------------------------------------------------------------------------------------------------------- */

/* The host has something that it does not read. */
static bool is_held_up(const engine *e)
{
    for (unsigned i = 0; i < e->station_count; i++)
        if (e->stations[i].wants_write)
            return true;
    return false;
}

static bool may_jump(const engine *e, uint64_t *when_us)
{
    return e->mode == CLOCK_JUMP && !e->waits_for_client && !is_held_up(e) && due(e, false, when_us);
}

/* Sleeps until something happens. Returns how many events there are. */
static int wait_for_events(const engine *e, struct epoll_event *events)
{
    uint64_t due_us;
    if (may_jump(e, &due_us))
        return epoll_wait(e->epoll, events, EVENTS, 0);
    if (!is_running(e) || !due(e, true, &due_us))
        return epoll_wait(e->epoll, events, EVENTS, -1);
    const uint64_t due_ns = real_instant_ns(e, due_us);
    const uint64_t now_ns = real_ns();
    if (due_ns > now_ns) { /* epoll_wait() counts milliseconds only */
        struct pollfd any = {.fd = e->epoll, .events = POLLIN};
        const uint64_t left_ns = due_ns - now_ns;
        const struct timespec left = {(time_t)(left_ns / NS_PER_S), (long)(left_ns % NS_PER_S)};
        if (ppoll(&any, 1, &left, NULL) <= 0)
            return 0;
    }
    return epoll_wait(e->epoll, events, EVENTS, 0);
}

static void tell_owner(const engine *e)
{
    if (e->after != NULL)
        e->after(e->context);
}

/* What was due comes first, then who is there, then what they have sent. */
void engine_run(engine *e)
{
    while (!e->is_over) {
        struct epoll_event events[EVENTS];
        uint64_t when_us;
        const int count = wait_for_events(e, events);
        look_at_clock(e);
        if (count == 0 && may_jump(e, &when_us) && when_us > e->now_us)
            e->now_us = when_us;
        run_to_now(e);
        for (int i = 0; i < count; i++)
            if (events[i].data.ptr == &e->hints)
                read_hints(e);
        for (int i = 0; i < count; i++)
            if (is_station(e, events[i].data.ptr) && (events[i].events & EPOLLIN) != 0)
                listen_to(e, station_of(e, events[i].data.ptr));
        for (unsigned i = 0; i < e->station_count; i++)
            if (e->stations[i].has_unread)
                listen_to(e, &e->stations[i]);
        for (int i = 0; i < count && !e->is_over; i++)
            if (events[i].data.ptr != NULL && !is_station(e, events[i].data.ptr))
                ((source *)events[i].data.ptr)->ready(events[i].data.ptr, events[i].events);
        run_to_now(e); /* hands may have made a controller answer */
        for (int i = 0; i < count; i++)
            if (is_station(e, events[i].data.ptr))
                flush(e, station_of(e, events[i].data.ptr));
        flush_all(e);
        tell_owner(e);
    }
    for (unsigned i = 0; i < e->station_count; i++)
        station_say(&e->stations[i], OBSERVED_END, "");
}

void engine_catch_up(engine *e)
{
    look_at_clock(e);
    run_to_now(e);
    read_hints(e);
    for (unsigned i = 0; i < e->station_count; i++)
        while (station_read(&e->stations[i])) /* until a read finds nothing: it has waited for what was on its way */
            read_hints(e);
    flush_all(e); /* what is answered next comes behind what the host was sent */
}

void engine_advance(engine *e, uint64_t until_us, bool until_idle)
{
    uint64_t when_us = 0;
    engine_catch_up(e);
    while (due(e, !until_idle, &when_us) && when_us <= until_us) {
        if (when_us > e->now_us)
            e->now_us = when_us;
        run_to_now(e);
        for (unsigned i = 0; i < e->station_count; i++) /* the line has room again for what it left in the port */
            if (e->stations[i].has_unread)
                listen_to(e, &e->stations[i]);
        flush_all(e);
    }
    if (!until_idle && until_us > e->now_us)
        e->now_us = until_us;
    run_to_now(e);
    flush_all(e);
    tell_owner(e);
}

/* -- Beginning and end --------------------------------------------------------------------------------------------------- */

bool engine_open(engine *e)
{
    e->hints.ready = hints_ready;
    e->epoll = epoll_create1(EPOLL_CLOEXEC);
    e->inotify = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    e->station_sources = calloc(e->station_count, sizeof *e->station_sources);
    if (e->epoll < 0 || e->inotify < 0 || e->station_sources == NULL)
        return false;
    for (unsigned i = 0; i < e->station_count; i++)
        e->station_sources[i].ready = station_ready;
    (void)prctl(PR_SET_TIMERSLACK, 1ul, 0ul, 0ul, 0ul); /* bytes are 78 us apart, the usual slack is 50 us */
    return engine_watch(e, &e->hints, e->inotify, EPOLLIN);
}

bool engine_plug(engine *e, char *why, size_t room)
{
    for (unsigned i = 0; i < e->station_count; i++)
        if (!engine_plug_station(e, &e->stations[i], why, room)) {
            while (i-- > 0)
                station_unplug(&e->stations[i], e->inotify);
            return false;
        }
    return true;
}

void engine_start(engine *e)
{
    e->epoch_ns = e->now_ns = real_ns();
    e->now_us = 0;
    for (unsigned i = 0; i < e->station_count; i++)
        station_start(&e->stations[i], 0, e->now_ns);
}

void engine_close(engine *e)
{
    for (unsigned i = 0; i < e->station_count; i++)
        station_unplug(&e->stations[i], e->inotify);
    free(e->station_sources);
    (void)close(e->inotify);
    (void)close(e->epoll);
}
