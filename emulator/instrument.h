/* instrument: one instrument as a host and hands find it: the controller, its panel, quirks that change the bytes of its
 * replies, and a serial line that is paced in both directions.
 *
 * No OS calls and no clock: time is an argument, in whole microseconds of the controller's own clock, 64 bits wide so that
 * it never wraps (the controller inside gets the lower 32). The caller owns the struct; nothing is allocated.
 *
 *     take   the host has sent bytes              run   time goes on; bytes for the host come out
 *     due    when something will happen by itself
 *
 * The instrument visits every instant at which something happens, so how finely the caller steps changes nothing: the same
 * bytes leave at the same instants. Within one instant the order is: what the controller does by itself (legs end,
 * positions are streamed, a button has been held long enough), then the byte that leaves, then the heartbeat of its quirk, then the byte that arrives.
 *
 * The line: a byte takes 10 bits [T table 3, M table 5] and leaves, or arrives, at the end of them. The bytes of one busy
 * period are counted from its start, so 57,600 baud (173.61 us a byte) does not drift; instants are rounded up. Unpaced, a
 * byte takes no time at all.
 *
 * Thread-safety: one thread at a time per instrument. */
#ifndef INSTRUMENT_H
#define INSTRUMENT_H

#include "faults.h" /* what goes wrong, on demand */

#include "dr_panel.h" /* the controller inside, and its panel */

/* Quirks of reply bytes; the controller's own are in controller.quirks [P, quirks]. */
enum {
    INSTRUMENT_POSITION_13 = 1u << 0,  /* MPC: 'C' answers 13 bytes, without the drive */
    INSTRUMENT_STOP_SAYS_I = 1u << 1,  /* ^C answers 'I', CR; STOP on the ROE puts 'I' in the place of the move's CR */
    INSTRUMENT_NUL_HEARTBEAT = 1u << 2 /* MPC: 0x00 every 100 ms during 'M', where the line is free (chosen) */
};

#define INSTRUMENT_LINE_MAX 256u /* bytes on their way from the host; what is more stays with the host */

/* One direction of the line. */
typedef struct {
    uint64_t since_us; /* when the present busy period began */
    uint64_t bytes;    /* that it has carried since */
} instrument_line;

typedef enum { INSTRUMENT_NOTHING, INSTRUMENT_REPLY, INSTRUMENT_LETTER_I, INSTRUMENT_NUL } instrument_sending;

typedef struct {
    /* set by the owner before instrument_start() */
    dr_controller controller; /* as dr_controller_init() made it and the owner adjusted it */
    uint8_t quirks;           /* INSTRUMENT_*; may change at any time */
    bool is_paced;

    /* Hands: dr_panel_...(&panel, instrument_now(ins), ...) between two calls of instrument_run(), which then sends what the
     * controller answers. */
    dr_panel panel;

    /* What goes wrong. Set up with faults_init(); `struck` and `unplug_us` are for the caller to look at, and to clear. */
    faults faults;

    /* to be read by anybody, written by instrument only */
    dr_panel_drive panel_drives[DR_PORTS];
    uint64_t now_us;             /* how far it has run */
    uint32_t byte_num, byte_den; /* a byte takes byte_num / byte_den us */
    instrument_line to_host, from_host;
    uint64_t held_until_us; /* a fault delays what is to be sent; UINT64_MAX: for good */
    uint8_t sending;        /* instrument_sending: what the line to the host carries now */
    uint8_t sent;           /* ... and has carried last */
    bool said_i;            /* the 'I' of this ^C has left */
    uint64_t beat_us;       /* the last heartbeat */
    struct {
        uint8_t byte;
        uint32_t pause_us;           /* the host's pause before it */
    } arriving[INSTRUMENT_LINE_MAX]; /* a ring */
    uint16_t arriving_first, arriving_count;
} instrument;

/* Begins as one that has been on for a while. */
void instrument_start(instrument *ins, uint64_t now_us);

/* The present on the controller's clock of 32 bits. */
static inline dr_us instrument_now(const instrument *ins) { return (dr_us)ins->now_us; }

/* How many bytes it can take now. */
size_t instrument_room(const instrument *ins);
/* The host has written bytes at now_us, after a pause of so long on its own clock, whatever the controller's clock does.
 * Takes at most instrument_room() of them and returns how many. Run to the present first. */
size_t instrument_take(instrument *ins, uint32_t pause_us, const uint8_t *bytes, size_t count);

/* Goes on to until_us, or to the first instant at which there is something to tell: bytes have left for the host (*count
 * of them at bytes[], at ins->now_us) or, where the controller has notes, notes wait, or a fault has struck. False: nothing
 * to tell, and the instrument is at until_us. `room` is at least FAULT_BYTES_MAX. */
bool instrument_run(instrument *ins, uint64_t until_us, uint8_t *bytes, size_t room, size_t *count);
/* When something will happen next. False: nothing until the host sends or hands act. */
bool instrument_due(const instrument *ins, uint64_t *when_us);

#endif
