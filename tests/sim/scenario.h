/* scenario: one rig in virtual time, and what the scenarios in this directory say about it. Instants are us since the
 * start of the scenario; frames are written out here, not by dr_wire. */
#ifndef SCENARIO_H
#define SCENARIO_H

#include "sim.h"
#include "unity.h"

extern sim rig;
extern dr_us clock_at_start; /* where the controller's clock stands when a scenario begins */
extern dr_note noted[256];
extern dr_notes notes;

/* A new documented rig, with notes, not started yet: `rig` may be adjusted. */
void prepare(dr_kind kind);
void start(void);
/* The TRIO with an MP-285 (8 steps/um, 5 mm/s: 25 us a step), the MPC-200 with an MP-225 (16 steps/um, 3 mm/s), at rest at x, y, z. */
void trio_at(uint32_t x, uint32_t y, uint32_t z);
void mpc_at(uint32_t x, uint32_t y, uint32_t z);

/* The host sends; what can leave at once leaves. */
void send(const uint8_t *bytes, size_t count);
void send_code(int code);
void send_value(int code, unsigned value);
void send_axis(int code, uint32_t steps);
void send_point(int code, uint32_t x, uint32_t y, uint32_t z);
void send_line(unsigned level, uint32_t x, uint32_t y, uint32_t z);
void send_string(const char *codes);
bool power(bool on);
bool place(uint8_t drive, uint32_t x, uint32_t y, uint32_t z);
bool plug(uint8_t drive, dr_stage_id stage);

/* The next bytes that the host has got, all at one instant. */
void expect(uint64_t at_us, const uint8_t *bytes, size_t count);
void expect_cr(uint64_t at_us);
/* A position reply: MPC: drive first; TRIO: angle last. */
void expect_trio_position(uint64_t at_us, uint32_t x, uint32_t y, uint32_t z, unsigned angle);
void expect_mpc_position(uint64_t at_us, unsigned drive, uint32_t x, uint32_t y, uint32_t z);
void expect_stream(uint64_t at_us, uint32_t x, uint32_t y, uint32_t z);
void expect_nothing(void);
/* Nothing is due and the controller listens. */
void expect_idle(void);
void expect_at(uint8_t drive, uint32_t x, uint32_t y, uint32_t z);
/* The oldest note of this kind; those before it are dropped. */
dr_note expect_note(dr_note_kind what);
void expect_no_note(dr_note_kind what);

/* Whole microseconds that a way takes, rounded up: steps of so many quanta at so many um/s. */
uint32_t takes_us(uint32_t steps, uint32_t quanta, uint32_t um_per_s);

/* Runs a program's tests once for each clock: from 0, and from shortly before the two places where 32 bits wrap. */
void at_every_clock(void (*tests)(void));

#endif
