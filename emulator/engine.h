/* engine: the one loop of the program: stations, their clock, and whatever else has a descriptor or an instant.
 *
 * It sleeps until a port, a signal, a source or the next instant of the controllers' clock; brings the stations to the
 * present; lets them listen. Between events nothing runs.
 *
 * The controllers' clock, in microseconds from 0, is one for all stations, and goes as its mode says:
 *     real  with the machine's, `speedup` times faster
 *     step  only in engine_advance()
 *     jump  to the next instant at which a controller does something by itself, whenever there is nothing else to do and the
 *           host has taken what it was sent; and in engine_advance()
 * What is planned passively (scenarios) happens when the clock comes by, and does not make it jump.
 *
 * Thread-safety: one thread. */
#ifndef ENGINE_H
#define ENGINE_H

#include "station.h" /* instruments at their ports */

typedef enum { CLOCK_REAL, CLOCK_STEP, CLOCK_JUMP } clock_mode;

/* What has a descriptor: the struct of whoever it is begins with this. */
typedef struct source source;
struct source {
    void (*ready)(source *who, uint32_t epoll_events);
};

/* What has an instant of the controllers' clock. */
typedef struct planned planned;
struct planned {
    void (*strike)(planned *what); /* called once, at when_us; the owner may plan or free it again */
    uint64_t when_us;
    bool is_passive;
    planned *next; /* the engine's */
};

typedef struct {
    /* set by the owner before engine_open() */
    station *stations;
    unsigned station_count;
    clock_mode mode;
    unsigned speedup;
    bool waits_for_client;        /* the clock stands until somebody has opened a port */
    void (*after)(void *context); /* called when all has been done that was to be done; NULL: nobody */
    void *context;

    /* to be read by anybody */
    int epoll, inotify;
    source hints, *station_sources;
    uint64_t now_us;   /* the controllers' clock */
    uint64_t now_ns;   /* the machine's, CLOCK_MONOTONIC, when the loop last looked */
    uint64_t epoch_ns; /* CLOCK_REAL: when the controllers' clock was 0 */
    planned *plans;    /* in order */
    bool is_over;      /* the owner sets it to end engine_run() */
} engine;

/* False: errno says why. */
bool engine_open(engine *e);
/* Opens the ports of all stations. False: why[] says what cannot be done; nothing is left behind. */
bool engine_plug(engine *e, char *why, size_t room);
/* Switches all instruments on. The clock begins at 0. */
void engine_start(engine *e);
/* Runs until is_over; then observers are told that it is. */
void engine_run(engine *e);
/* Takes ports and links away. */
void engine_close(engine *e);

bool engine_watch(engine *e, source *who, int fd, uint32_t epoll_events);
void engine_change(engine *e, source *who, int fd, uint32_t epoll_events);
void engine_forget(engine *e, int fd);
void engine_plan(engine *e, planned *what);
void engine_unplan(engine *e, planned *what);

/* A station's USB plug: out for so long (0: until it is put in), and in again: false: why[] tells. */
void engine_unplug_station(engine *e, station *s, uint64_t span_us);
bool engine_plug_station(engine *e, station *s, char *why, size_t room);

/* Everything that has happened until now has happened when this returns: bytes that wait in the ports have been taken in. */
void engine_catch_up(engine *e);
/* Moves the clock of step or jump: to until_us, or less far where nothing more is due and `until_idle`. What waits in the
 * ports comes first. */
void engine_advance(engine *e, uint64_t until_us, bool until_idle);
/* When a controller, or what is planned actively, is due next. False: never, as things are. */
bool engine_due(const engine *e, uint64_t *when_us);

#endif
