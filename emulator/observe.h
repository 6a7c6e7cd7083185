/* observe: one stream of everything that happens at a port, for whoever judges it, keeps it or tells it.
 *
 * The trace, the control channel's `subscribe`, scenario triggers, the lint and the recorder are observers. Each is a struct
 * that begins with an `observer`, hangs in the list of one station, or of several, and looks at what it gets:
 *
 *     typedef struct { observer base; ... } recorder;
 *     static void see(observer *o, const observation *seen) { recorder *r = (recorder *)o; ... }
 *
 * Bytes are as the host knows them: what it has written, what it can read, faults and quirks included. Notes are what the
 * controller made of them. Order: everything is told in the order of the controller's clock, and of one instant in the
 * order in which it happened; so bytes from the host come before the notes that they cause, and the note of a reply before
 * its bytes. A station without observers makes no notes and costs nothing.
 *
 * Two clocks: when_us is the controller's and real_ns the machine's. They run apart as --speedup and --clock say. The host's
 * own timing (pauses, late reading) is judged by real_ns and pause_us alone; everything else by when_us, which is the same
 * in every run that has the same bytes at the same instants.
 *
 * An observer must not change what it observes, and must not keep pointers into an observation.
 * Thread-safety: one thread at a time per station. */
#ifndef OBSERVE_H
#define OBSERVE_H

#include "instrument.h" /* the controller, its clock, dr_note */

#include <termios.h>

typedef enum {
    OBSERVED_FROM_HOST, /* bytes were read from the port; pause_us before them. They reach the controller at the line's rate */
    OBSERVED_TO_HOST, /* bytes are in the port for the host to read */
    OBSERVED_LOST,    /* bytes left for the host, but nobody has the port open, or does not read */
    OBSERVED_NOTE,    /* the controller's: note */
    OBSERVED_OPENED,  /* somebody has opened the port, where nobody had */
    OBSERVED_CLOSED,  /* nobody has it open any more */
    OBSERVED_TTY,     /* the host has set the port: tty. Found when its next bytes are read */
    OBSERVED_FAULT,   /* a fault has struck: text */
    OBSERVED_EVENT,   /* anything else that the emulator has to say: text */
    OBSERVED_END      /* the program ends: write what is to be written */
} observed_kind;

typedef struct {
    observed_kind what;
    const char *name;      /* of the station: in a rig its name, else "trio" or "mpc" */
    const instrument *ins; /* as it is now */
    uint64_t when_us;      /* the controller's clock; for a note: when it happened */
    uint64_t real_ns;      /* CLOCK_MONOTONIC */
    const uint8_t *bytes;  /* FROM_HOST, TO_HOST, LOST */
    size_t count;
    uint32_t pause_us;    /* FROM_HOST: since the host's bytes before, in real time; UINT32_MAX: longer */
    uint32_t late_us;     /* FROM_HOST: of the time since they were told before, the emulator had no processor */
    uint32_t unread;      /* FROM_HOST, CLOSED: bytes for the host that it had not read when it did this */
    bool has_read_behind; /* FROM_HOST: but then it read what it should have read before, quicker than it was seen */
    const dr_note *note;  /* NOTE */
    const struct termios *tty; /* TTY */
    uint32_t baud;             /* TTY: the rate that the host has set; no standard one has a name in a termios */
    const char *text;          /* FAULT, EVENT: one line */
} observation;

typedef struct observer observer;
struct observer {
    void (*see)(observer *o, const observation *seen);
};

/* One hanging of an observer in a list; the same observer may hang in the lists of several stations. */
typedef struct observer_link observer_link;
struct observer_link {
    observer *who;
    observer_link *next;
};

static inline void observe(const observer_link *first, const observation *seen)
{
    for (; first != NULL; first = first->next)
        first->who->see(first->who, seen);
}

#endif
