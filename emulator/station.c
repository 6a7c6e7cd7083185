#include "station.h"

#include "late.h"  /* how far pauses can be believed */
#include "link.h"  /* the stable name */
#include "reads.h" /* when the host reads */
#include "tty.h"   /* the rate that the host has set */

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/inotify.h>
#include <sys/ioctl.h>
#include <unistd.h>

#define NS_PER_US UINT64_C(1000)
#define CHUNK 64u /* bytes that leave at one instant, at most: a reply and what was kept behind it */
#define ROOM_WORTH_READING (INSTRUMENT_LINE_MAX / 2u)

/* -- Telling ----------------------------------------------------------------------------------------------------------- */

static observation seen_now(const station *s, observed_kind what)
{
    return (observation){.what = what, .name = s->name, .ins = &s->ins, .when_us = s->ins.now_us, .real_ns = s->now_ns};
}

/* What is there for the host to read. */
static uint32_t count_unread(const station *s)
{
    int in_kernel = 0;
    (void)ioctl(s->port.host_fd, FIONREAD, &in_kernel);
    return (uint32_t)in_kernel + (uint32_t)s->port.waiting_count;
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

static void tell_faults(station *s)
{
    const uint32_t struck = s->ins.faults.struck;
    s->ins.faults.struck = 0;
    for (unsigned id = 0; id < FAULTS; id++) {
        char text[128];
        const fault_words *const words = faults_words((fault_id)id);
        (void)snprintf(text, sizeof text, "fault %s: %s", words->name, words->meaning);
        if ((struck & UINT32_C(1) << id) != 0)
            station_say(s, OBSERVED_FAULT, text);
    }
}

/* -- Port and link ----------------------------------------------------------------------------------------------------- */

bool station_plug(station *s, int inotify_fd, char *why, size_t room)
{
    const char *const wrong = pty_open(&s->port, inotify_fd);
    s->link_lock = s->reads = -1;
    s->told_loss = s->has_unread = s->wants_write = false;
    if (wrong != NULL) {
        (void)snprintf(why, room, "%s: %s", wrong, strerror(errno));
        return false;
    }
    s->tty = s->port.raw;
    s->baud = s->raw_baud = tty_baud(s->port.host_fd);
    if (s->link != NULL && (s->link_lock = link_make(s->link, s->port.path, why, room)) < 0) {
        (void)inotify_rm_watch(inotify_fd, s->port.watch);
        pty_close(&s->port);
        return false;
    }
    if (s->watches_reads)
        s->reads = reads_open(s->port.path);
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
    if (s->reads >= 0)
        (void)close(s->reads);
    pty_close(&s->port);
    s->port.opens = 0;
    s->port.waiting_count = 0;
    s->chunk_count = 0;
    s->is_plugged = s->was_open = s->has_unread = s->wants_write = false;
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
    s->was_sent = s->was_sent || done;
    if (s->observers != NULL) {
        observation seen = seen_now(s, done ? OBSERVED_TO_HOST : OBSERVED_LOST);
        seen.bytes = bytes;
        seen.count = count;
        observe(s->observers, &seen);
    }
    if (s->is_plugged && !s->told_loss && s->port.lost_bytes > 0) {
        s->told_loss = true;
        (void)fprintf(stderr,
                      "dryrig-emu: the host does not read %s: what it is sent from now on is lost, as on a real port\n",
                      s->port.path);
        station_say(s, OBSERVED_EVENT, "the host does not read: bytes for it are lost");
    }
}

bool station_run(station *s, uint64_t now_us, uint64_t now_ns)
{
    uint8_t bytes[CHUNK];
    size_t count;
    s->now_ns = now_ns;
    while (instrument_run(&s->ins, now_us, bytes, sizeof bytes, &count)) {
        if (s->ins.controller.notes != NULL && s->notes.count > 0)
            tell_notes(s);
        if (s->ins.faults.struck != 0)
            tell_faults(s);
        if (count > 0)
            send_to_host(s, bytes, count);
        if (s->ins.faults.unplug_us > 0)
            return false;
    }
    if (s->ins.controller.state == DR_STATE_WEDGED && !s->told_wedge) {
        s->told_wedge = true;
        (void)fprintf(stderr,
                      "dryrig-emu: %s hangs, as real ones have done: it is silent until its power is cycled ('power "
                      "cycle' on the control channel)\n",
                      s->name);
    }
    return true;
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
    const uint32_t baud = tty_baud(s->port.host_fd);
    if (tcgetattr(s->port.host_fd, &tty) != 0 || (is_same_tty(&tty, &s->tty) && baud == s->baud))
        return;
    s->tty = tty;
    s->baud = baud;
    observation seen = seen_now(s, OBSERVED_TTY);
    seen.tty = &s->tty;
    seen.baud = baud;
    observe(s->observers, &seen);
}

bool station_read(station *s)
{
    const size_t room = instrument_room(&s->ins);
    s->has_unread = room < ROOM_WORTH_READING;
    if (s->has_unread || !s->is_plugged)
        return false;
    s->chunk_count = pty_read(&s->port, s->chunk, room);
    s->chunk_is_full = s->chunk_count == room;
    if (s->chunk_count > 0 && s->observers != NULL)
        s->unread = count_unread(s);
    return s->chunk_count > 0;
}

void station_take(station *s, uint64_t now_ns)
{
    const uint64_t pause_us = (now_ns - s->read_ns) / NS_PER_US;
    const uint32_t pause = pause_us < UINT32_MAX ? (uint32_t)pause_us : UINT32_MAX;
    s->read_ns = s->now_ns = now_ns;
    if (s->observers != NULL) {
        tell_tty(s);
        observation seen = seen_now(s, OBSERVED_FROM_HOST);
        seen.bytes = s->chunk;
        seen.count = s->chunk_count;
        seen.pause_us = pause;
        const uint64_t late = late_us();
        seen.late_us = (uint32_t)(late - s->late_us < UINT32_MAX ? late - s->late_us : UINT32_MAX);
        s->late_us = late;
        const uint32_t unread = count_unread(s); /* with what has been due since: it had not read that either */
        seen.unread = unread > s->unread ? unread : s->unread;
        seen.has_read_behind = reads_look(s->reads, s->was_sent) && seen.unread == 0;
        s->was_sent = false;
        observe(s->observers, &seen);
    }
    (void)instrument_take(&s->ins, pause, s->chunk, s->chunk_count);
    s->chunk_count = 0;
}

/* First what is to be done, then telling: who is told acts on it. */
void station_look(station *s)
{
    if (!s->is_plugged)
        return;
    const bool was_left = s->port.was_left;
    observation left = seen_now(s, OBSERVED_CLOSED);
    if (was_left)
        left.unread = count_unread(s);
    pty_look(&s->port);
    left.text = "nobody has the port open any more";
    if (s->was_open && was_left)
        observe(s->observers, &left);
    if (was_left || !s->was_open) { /* as it is made raw for the next one */
        s->tty = s->port.raw;
        s->baud = s->raw_baud;
    }
    const bool was_open = s->was_open && !was_left;
    s->was_open = s->port.opens > 0;
    if (s->was_open && !was_open)
        station_say(s, OBSERVED_OPENED, "the port has been opened");
}

bool station_flush(station *s) { return !s->is_plugged || pty_flush(&s->port); }
