/* station: one instrument at its port: bytes pass between the two, and observers see them.
 *
 * A station knows no clock and does not wait: whoever runs it (engine.h) says what time it is and when its port has
 * something to read or room to write.
 * Thread-safety: one thread at a time per station. */
#ifndef STATION_H
#define STATION_H

#include "instrument.h" /* the controller as a host sees it */
#include "observe.h"    /* who looks on */
#include "pty.h"        /* the port */

#define STATION_NOTES 64u

typedef struct station station;
struct station {
    /* set by the owner before station_start() */
    const char *name;
    instrument ins; /* as setup_apply() made it */
    dr_drive drives[DR_PORTS];
    const char *link;   /* the port's stable name; NULL: none */
    bool watches_reads; /* when the host reads is told, too */

    /* to be read by anybody */
    observer_link *observers;
    pty port;
    uint8_t unplugged[DR_PORTS]; /* dr_stage_id: what hands have last taken from each port */
    bool is_plugged;             /* it has a port; false while its USB plug is out */
    uint64_t plug_at_us;         /* it is put in again then, by whoever runs the station; 0: not by itself */
    int link_lock;               /* -1: no link */
    bool was_open;               /* when station_look() last looked */
    bool has_unread;             /* the kernel holds bytes that the line had no room for */
    bool wants_write;            /* waits for the host to read */
    bool told_loss;
    bool told_wedge;
    int reads;          /* of the host, see reads.h */
    bool was_sent;      /* something, since the host's last bytes came */
    uint64_t late_us;   /* as late_us() said then */
    uint64_t read_ns;   /* when the host's last bytes came */
    uint64_t now_ns;    /* real time, as the last call said */
    uint32_t missed;    /* notes that did not fit the ring, told so far */
    struct termios tty; /* how the host had set the port when its last bytes came */
    uint32_t baud;
    uint32_t raw_baud;                  /* of a port that nobody has open */
    uint32_t unread;                    /* by the host, when its last bytes came */
    uint8_t chunk[INSTRUMENT_LINE_MAX]; /* between station_read() and station_take() */
    size_t chunk_count;                 /* 0: taken */
    bool chunk_is_full;                 /* there may be more */
    dr_notes notes;
    dr_note ring[STATION_NOTES];
};

/* Opens the port and makes the link. False: why[] says what cannot be done; nothing is left behind. */
bool station_plug(station *s, int inotify_fd, char *why, size_t room);
/* Takes port and link away: for the host the cable is out. */
void station_unplug(station *s, int inotify_fd);
/* Switches the instrument on, at now_us of the controller's clock. */
void station_start(station *s, uint64_t now_us, uint64_t now_ns);

/* Brings the instrument to now_us and hands what leaves to the port. False: a fault takes the plug out at ins.now_us, for
 * ins.faults.unplug_us; when that is done, go on. */
bool station_run(station *s, uint64_t now_us, uint64_t now_ns);
/* Reads what the host has sent, as far as the line has room. False: nothing now. */
bool station_read(station *s);
/* Takes it; station_run() comes next. Between the two comes station_look(), but where all of it is from one that has left: what is
 * on its way to a host that has gone must not meet the answer to the next. */
void station_take(station *s, uint64_t now_ns);
/* Somebody may have opened or closed the port: pty_hint() has been called. */
void station_look(station *s);
/* Gives the kernel what the host is to read. True: all of it. */
bool station_flush(station *s);

/* From now on an observer sees what happens; and no more. The caller owns the link. */
void station_observe(station *s, observer_link *link);
void station_unobserve(station *s, observer_link *link);
/* Tells observers something that is not the controller's. */
void station_say(station *s, observed_kind what, const char *text);

#endif
