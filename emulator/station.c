#include "station.h"

#include "link.h" /* the stable name */

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/inotify.h>

#define NS_PER_US UINT64_C(1000)
#define CHUNK 64u /* bytes that leave at one instant, at most: a reply and what was kept behind it */
#define ROOM_WORTH_READING (INSTRUMENT_LINE_MAX / 2u)

/* -- Telling ----------------------------------------------------------------------------------------------------------- */

static observation seen_now(const station *s, observed_kind what)
{
    return (observation){.what = what, .name = s->name, .ins = &s->ins, .when_us = s->ins.now_us, .real_ns = s->now_ns};
}

void station_say(station *s, observed_kind what, const char *text)
{
    observation seen = seen_now(s, what);
    seen.text = text;
    observe(s->observers, &seen);
}

void station_observe(station *s, observer_link *link)
{
    if (s->observers == NULL) {
        dr_notes_init(&s->notes, s->ring, STATION_NOTES);
        s->ins.controller.notes = &s->notes;
        s->missed = 0;
    }
    observer_link **last = &s->observers;
    while (*last != NULL)
        last = &(*last)->next;
    *last = link;
    link->next = NULL;
}

void station_unobserve(station *s, observer_link *link)
{
    for (observer_link **at = &s->observers; *at != NULL; at = &(*at)->next)
        if (*at == link) {
            *at = link->next;
            break;
        }
    if (s->observers == NULL)
        s->ins.controller.notes = NULL; /* without anybody to tell, none are made */
}

static void tell_bytes(const station *s, observed_kind what, const uint8_t *bytes, size_t count, uint32_t pause_us)
{
    if (s->observers == NULL)
        return;
    observation seen = seen_now(s, what);
    seen.bytes = bytes;
    seen.count = count;
    seen.pause_us = pause_us;
    observe(s->observers, &seen);
}

static void tell_notes(station *s)
{
    dr_note note;
    while (dr_notes_take(&s->notes, &note)) {
        observation seen = seen_now(s, OBSERVED_NOTE);
        seen.when_us -= (dr_us)((dr_us)s->ins.now_us - note.when); /* the controller's clock has 32 bits */
        seen.note = &note;
        observe(s->observers, &seen);
    }
    if (s->missed != s->notes.missed) {
        char text[64];
        (void)snprintf(text, sizeof text, "%u events are missing here", (unsigned)(s->notes.missed - s->missed));
        s->missed = s->notes.missed;
        station_say(s, OBSERVED_EVENT, text);
    }
}

/* -- Port and link ----------------------------------------------------------------------------------------------------- */

bool station_plug(station *s, int inotify_fd, char *why, size_t room)
{
    const char *const wrong = pty_open(&s->port, inotify_fd);
    s->link_lock = -1;
    s->told_loss = s->has_unread = s->wants_write = false;
    if (wrong != NULL) {
        (void)snprintf(why, room, "%s: %s", wrong, strerror(errno));
        return false;
    }
    s->tty = s->port.raw;
    if (s->link != NULL && (s->link_lock = link_make(s->link, s->port.path, why, room)) < 0) {
        (void)inotify_rm_watch(inotify_fd, s->port.watch);
        pty_close(&s->port);
        return false;
    }
    s->is_plugged = true;
    return true;
}

void station_unplug(station *s, int inotify_fd)
{
    if (!s->is_plugged)
        return;
    if (s->link != NULL)
        link_remove(s->link, s->port.path, s->link_lock);
    (void)inotify_rm_watch(inotify_fd, s->port.watch);
    pty_close(&s->port);
    s->port.opens = 0;
    s->port.waiting_count = 0;
    s->is_plugged = s->has_unread = s->wants_write = false;
}

void station_start(station *s, uint64_t now_us, uint64_t now_ns)
{
    s->read_ns = s->now_ns = now_ns;
    instrument_start(&s->ins, now_us);
}

/* -- Passing bytes ------------------------------------------------------------------------------------------------------ */

static void send_to_host(station *s, const uint8_t *bytes, size_t count)
{
    const bool done = s->is_plugged && pty_put(&s->port, bytes, count);
    tell_bytes(s, done ? OBSERVED_TO_HOST : OBSERVED_LOST, bytes, count, 0);
    if (s->is_plugged && !s->told_loss && s->port.lost_bytes > 0) {
        s->told_loss = true;
        (void)fprintf(stderr,
                      "dryrig-emu: the host does not read %s: what it is sent from now on is lost, as on a real port\n",
                      s->port.path);
        station_say(s, OBSERVED_EVENT, "the host does not read: bytes for it are lost");
    }
}

void station_run(station *s, uint64_t now_us, uint64_t now_ns)
{
    uint8_t bytes[CHUNK];
    size_t count;
    s->now_ns = now_ns;
    while (instrument_run(&s->ins, now_us, bytes, sizeof bytes, &count)) {
        if (s->ins.controller.notes != NULL && s->notes.count > 0)
            tell_notes(s);
        if (count > 0)
            send_to_host(s, bytes, count);
    }
}

static bool is_same_tty(const struct termios *a, const struct termios *b)
{
    return a->c_iflag == b->c_iflag && a->c_oflag == b->c_oflag && a->c_cflag == b->c_cflag &&
           a->c_lflag == b->c_lflag && cfgetispeed(a) == cfgetispeed(b) && cfgetospeed(a) == cfgetospeed(b);
}

/* A pseudo-terminal does not say when its host sets it; who looks on is told before the bytes that follow. */
static void tell_tty(station *s)
{
    struct termios tty;
    if (s->observers == NULL || tcgetattr(s->port.host_fd, &tty) != 0 || is_same_tty(&tty, &s->tty))
        return;
    s->tty = tty;
    observation seen = seen_now(s, OBSERVED_TTY);
    seen.tty = &s->tty;
    observe(s->observers, &seen);
}

void station_listen(station *s, uint64_t now_us, uint64_t now_ns)
{
    uint8_t bytes[INSTRUMENT_LINE_MAX];
    while (s->is_plugged) {
        const size_t room = instrument_room(&s->ins);
        s->has_unread = room < ROOM_WORTH_READING;
        if (s->has_unread)
            return;
        const size_t count = pty_read(&s->port, bytes, room);
        if (count == 0)
            return;
        tell_tty(s);
        const uint64_t pause_us = (now_ns - s->read_ns) / NS_PER_US;
        const uint32_t pause = pause_us < UINT32_MAX ? (uint32_t)pause_us : UINT32_MAX;
        s->read_ns = now_ns;
        tell_bytes(s, OBSERVED_FROM_HOST, bytes, count, pause);
        (void)instrument_take(&s->ins, pause, bytes, count);
        station_run(s, now_us, now_ns);
        if (count < room) /* the kernel has no more; it will say when it has */
            return;
    }
}

void station_look(station *s)
{
    if (!s->is_plugged)
        return;
    if (s->was_open && s->port.was_left)
        station_say(s, OBSERVED_CLOSED, "nobody has the port open any more");
    if (s->port.opens > 0 && (!s->was_open || s->port.was_left)) {
        s->tty = s->port.raw;
        station_say(s, OBSERVED_OPENED, "the port has been opened");
    }
    pty_look(&s->port);
}

bool station_flush(station *s) { return !s->is_plugged || pty_flush(&s->port); }
