/* A host, a lint and an instrument in virtual time: bytes pass as at a station, and the host reads what it says it reads.
 * Real time goes as the controller's does, but for what sleep_real_us() adds. */
#ifndef BENCH_H
#define BENCH_H

#include "lint.h"

typedef struct {
    instrument ins;
    dr_drive drives[DR_PORTS];
    dr_notes notes;
    dr_note ring[64];
    observer_link link;
    uint64_t real_ns, wrote_ns;
    uint32_t unread; /* what waits for the host */
    uint8_t got[64]; /* the newest of it */
    size_t got_count;
    uint32_t late_us;     /* of the next thing that the host says, once */
    bool has_read_behind; /* with the next thing that it says, once */
} bench;

/* An MPC-200 with two MP-225, or a TRIO with an MP-845, watched by `who`; the port has been opened. */
void bench_start(bench *b, dr_kind kind, uint16_t firmware, observer *who);
void bench_tell(bench *b, observed_kind what); /* OPENED, CLOSED, FAULT, END */
void bench_tty(bench *b, uint32_t baud);
void bench_say(bench *b, const void *bytes, size_t count); /* the host writes; the rest of the instant runs */
void bench_wait_us(bench *b, uint64_t us);                 /* both clocks */
void bench_sleep_real_us(bench *b, uint64_t us);           /* the host's only */
void bench_read(bench *b, uint32_t count);                 /* the host takes bytes that wait; UINT32_MAX: all */
/* As a correct program does: 3 ms, the command, until nothing more is due, all read. */
void bench_ask(bench *b, const void *bytes, size_t count);
/* A frame: `head`, then a point of three coordinates. Returns its length. */
size_t bench_frame(uint8_t *frame, const char *head, size_t head_count, uint32_t x, uint32_t y, uint32_t z);
/* The same for 'S', with 30 ms of pause behind the speed, and for a correct program to the end. */
void bench_line(bench *b, uint8_t speed, uint32_t x, uint32_t y, uint32_t z, uint64_t pause_us);

#endif
