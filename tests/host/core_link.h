/* core_link: a link whose other end is the emulated controller, in virtual time, on a line that a test can spoil.
 *
 * Nothing sleeps: reading, writing and pausing move the clock. Whoever tests sets up `ins` (the controller within it,
 * quirks) between core_link_init() and core_link_start(). */
#ifndef CORE_LINK_H
#define CORE_LINK_H

#include "dryrig/dryrig.h"
#include "instrument.h"

typedef struct core_link core_link;

/* What happens to a byte on its way. */
typedef enum { PASS, DROP, TWICE, CORRUPT, AFTER_EXTRA, HOLD } core_fate;

struct core_link {
    instrument ins;
    dr_drive drives[DR_PORTS];
    dr_note ring[256];
    dr_notes notes;
    uint64_t now_us;
    uint64_t quiet_since_us; /* when the last byte went or came, as the host sees it */

    struct {
        uint64_t at_us;
        uint8_t byte;
    } inbox[8192]; /* bytes for the host, and when they arrive */
    size_t first, count;

    /* Spoils the line: asked for every byte, counted from 0 over the life of the link. */
    core_fate (*to_host)(core_link *link, unsigned long number, uint8_t *byte);
    core_fate (*from_host)(core_link *link, unsigned long number, uint8_t *byte);
    unsigned long to_host_count, from_host_count;
    uint64_t hold_us; /* HOLD: it, and all behind it, come so much later */
    uint64_t held_until_us;
    uint8_t extra;        /* AFTER_EXTRA: this byte comes before it */
    unsigned long target; /* for the test's own use */

    /* Done when the clock gets there. */
    uint64_t event_us;
    void (*event)(core_link *link);
    dryrig *d;    /* for the event */
    bool is_gone; /* the port has been unplugged */
    bool is_closed;

    uint32_t furthest_steps; /* that an axis of drive 1 has ever been seen */

    /* What the host has done; see core_link_breaches(). */
    uint64_t writes;
    uint32_t shortest_pause_us; /* between what came or went and the next command, ^C not counted */
    uint32_t line_pause_us;     /* the last pause within a command */
    unsigned breaches;
};

void core_link_init(core_link *link, dr_kind kind);
void core_link_start(core_link *link);
dryrig_link core_link_link(core_link *link);
/* Opens a handle on it, with the stages that the controller has. */
dryrig *core_link_open(core_link *link, const dryrig_options *options);
/* Lets time pass with nobody reading. */
void core_link_pass(core_link *link, uint64_t span_us);
/* Where a drive really is. */
void core_link_truth(core_link *link, unsigned drive, int32_t steps[3]);
/* How often the host broke a rule of the protocol: a command before the answer to the one before, a target beyond the
 * travel, an unknown byte, a pause too short. */
unsigned core_link_breaches(core_link *link);

#endif
