/* bench: a controller with its panel, a host that reads at once, and hands; in virtual time.
 *
 * Every test of the hands is run several times, with the controller's clock beginning at 0 and so that it wraps in the
 * middle: bench_run() sees to that. Instants are microseconds since the test began. */
#ifndef BENCH_H
#define BENCH_H

#include "dr_panel.h"

#include <unity.h>

#define MS 1000u
#define S 1000000u
#define BENCH_BYTES 65536u

typedef struct {
    dr_controller c;
    dr_drive drives[DR_PORTS];
    dr_panel p;
    dr_panel_drive panels[DR_PORTS];
    dr_us clock;               /* the controller's clock now */
    dr_us began;               /* and when the test began */
    uint8_t got[BENCH_BYTES];  /* what the host has got */
    dr_us got_at[BENCH_BYTES]; /* and when, in microseconds since the test began */
    size_t count;
    bool stopped[BENCH_BYTES]; /* dr_controller_answers_stop() before that byte */
    dr_note ring[64];
    dr_notes notes;
} bench;

extern bench b;

/* A TRIO with an MP-845 at 1,000 um on each axis; an MPC-200 with MP-225 on ports 1 and 2, both at 0,0,0. Not switched on. */
void bench_set_up(dr_kind kind);
/* On for a while, and its panel. */
void bench_begin(dr_kind kind);
void bench_start(void);

/* Lets time pass; comes at every instant that is due. */
void bench_wait(dr_us span_us);
/* Until nothing is due any more. */
void bench_wait_until_idle(void);
/* Microseconds since the test began. */
dr_us bench_us(void);

/* Down, and up again after 1 ms. */
void bench_tap(dr_button button);
/* Down, and up again after so long. */
void bench_hold(dr_button button, dr_us span_us);
void bench_press(dr_button button);
void bench_release(dr_button button);
void bench_turn(dr_knob knob, int detents);
void bench_switch(dr_switches bank, uint8_t drive, uint8_t number, bool on);
void bench_power_cycle(void);
dr_look bench_look(void);
uint8_t bench_beeps(void);

/* The host's bytes arrive now. */
void bench_host(const char *bytes, size_t count);
/* A command byte, an optional speed byte (-1: none) and a point. */
void bench_host_point(char command, int speed, uint32_t x, uint32_t y, uint32_t z);
/* What the host has got since the last time. */
void bench_expect_bytes(const char *bytes, size_t count);
void bench_expect_nothing(void);
/* Where the active drive is now. */
void bench_expect_at(uint32_t x, uint32_t y, uint32_t z);
void bench_expect_answer_at(uint32_t x, uint32_t y, uint32_t z);
void bench_place(uint32_t x, uint32_t y, uint32_t z);
bool bench_moves(void);

/* The newest note is this one; all are forgotten. */
void bench_expect_note(dr_note_kind what);

/* Runs one test with each clock. */
void bench_run(void (*test)(void), const char *name, int line);
#define RUN(test) bench_run(test, #test, __LINE__)

#endif
