/* bench: a host, the guard and an emulated controller in virtual time, with the seven monitors running all the while.
 *
 *     host  --host_*()-->  guard  --paced line-->  controller
 *           <--heard[]---         <--paced line--
 *
 * Bytes between guard and controller take their time on the line, one by one. A test may sit in for the controller
 * (by_hand) and may change what the controller says (spoil). A monitor that sees its rule broken fails the test:
 *   M1 no byte reaches the controller but a whole frame of the host's, a position query or ^C
 *   M2 no motion begins to leave but in CHECKING      M3 the tip never enters an obstacle or leaves the box by command
 *   M4 every refused frame is one record with a reason  M5 nothing answers a refused motion but 'E' where that is chosen
 *   M6 0x03 or STOP in MOVING_S: ^C leaves at once       M7 only a person's inputs make the state less safe */
#ifndef BENCH_H
#define BENCH_H

#include "dr_controller.h"
#include "dr_guard.h"
#include "unity.h"

#define UM(um) ((int32_t)((um)*64))
#define HEARD_MAX 65536u
#define WIRE_MAX 65536u

typedef struct bench bench;
struct bench {
    dr_limits limits;
    dr_guard guard;
    dr_record ring[64];
    dr_controller controller;
    dr_drive drives[DR_PORTS];
    uint64_t now;            /* us */
    uint32_t clock_at_start; /* what the guard's clock showed then */
    uint32_t byte_us;

    bool is_damaged; /* the test has flipped a bit of the guard's memory: no M4, its counts are gone */
    bool by_hand;    /* the test is the controller: device_says(), wire[] */
    int (*spoil)(bench *b, uint8_t byte); /* what arrives instead of a byte that the controller sends; -1: nothing */
    uint32_t said;                        /* bytes that the controller has sent so far */

    uint8_t heard[HEARD_MAX]; /* by the host */
    uint32_t heard_count, heard_taken;
    uint8_t wire[WIRE_MAX]; /* what the guard sent to the controller */
    uint64_t wire_at[WIRE_MAX];
    uint32_t wire_count, wire_taken;

    /* lines: one byte each is on its way */
    bool to_device_busy, to_guard_busy;
    uint8_t to_device_byte, to_guard_byte;
    uint64_t to_device_at, to_guard_at;
    uint64_t device_heard_at;

    dr_record log[512]; /* the newest records */
    uint32_t log_count;
    uint32_t crc, next_sequence;
    uint32_t frames_refused; /* M4: records of it */

    uint8_t sent[WIRE_MAX]; /* by the host, M1 */
    uint32_t sent_count;
    uint32_t motions;    /* that left for the controller, since the start */
    dr_framer framer;    /* of the controller's bytes, M1 */
    uint8_t frame_state; /* M2: the guard's state before the frame's first byte */
    bool refused_open;   /* M5: a motion was refused, nothing was allowed since */
    uint32_t owed;       /* M5: bytes to the host that answer something else */
    bool watch_tip;      /* M3 */
    uint64_t tip_checked;
    uint8_t state; /* M7 */
    bool person;   /* an input was given since the state was looked at last */
    uint64_t arm_pressed;
};

extern bench rig;

/* A rig with careful limits and a controller of the manual: TRIO with an MP-285 (8 steps/um, 8 quanta/step) or an MPC-200
 * with two MP-225 (16 steps/um, 4 quanta/step), all at 5 mm on each axis. Limits: travel less 100 um, margin 50 um, knobs
 * locked. Adjust rig.limits and rig.controller, then bench_start(). */
void bench_trio(void);
void bench_mpc(void);
/* Starts both, links up, waits for the proof of identity. */
void bench_start(void);
void bench_arm(void); /* key and ARM: IDLE afterwards */
void bench_armed_trio(void);
void bench_armed_mpc(void);
/* After the test has changed rig.limits behind the guard's back, or has poked into rig.guard. */
void limits_changed(void);
/* Adds an obstacle to the limits of drive 0: um. */
uint8_t keep_out(int32_t x0, int32_t x1, int32_t y0, int32_t y1, int32_t z0, int32_t z1);

/* Makes room for more, between frames: drops what was sent and heard long ago. */
void bench_forget(void);
void run_us(uint64_t us);
void run_ms(uint64_t ms);
void run_until_state(dr_guard_state state, uint64_t at_most_ms);

void host_bytes(const void *bytes, size_t count);
void host_code(int code);
void host_value(int code, unsigned value);
void host_axis(int code, uint32_t steps);
void host_point(int code, uint32_t x, uint32_t y, uint32_t z);
void host_line(unsigned level, uint32_t x, uint32_t y, uint32_t z);
size_t put_line_frame(uint8_t *frame, unsigned level, uint32_t x, uint32_t y, uint32_t z);
size_t put_point_frame(uint8_t *frame, int code, uint32_t x, uint32_t y, uint32_t z);
void input(dr_input what, bool on);
void press(dr_input what);
void cables(bool host_open, bool device_present);
void stop_input(bool on); /* both contacts */
void clear_fault(void);   /* key off and on */

/* The test as the controller. */
void device_says(const void *bytes, size_t count);
void device_at(uint32_t x, uint32_t y, uint32_t z, unsigned last);        /* a TRIO's position reply */
void device_at_drive(unsigned drive, uint32_t x, uint32_t y, uint32_t z); /* an MPC-200's */
void device_at_home(void);                                                /* of either: 5 mm on each axis, drive 1 */
/* As bench_start() and bench_arm(), with the test as a controller that stands where `says` says. */
void bench_start_by_hand(void (*says)(void));
void bench_arm_by_hand(void (*says)(void));
/* A rig with locked knobs and these facts of DR_RIG_..., proved at home. */
void bench_proved_by_hand(dr_kind kind, uint16_t facts);
/* Nothing more leaves the guard, in the middle of a frame or before it, until the line goes on. */
void line_hangs(void);
void line_goes_on(void);
/* The next byte that the guard sent; -1: none. */
int wire_next(void);
/* How many bytes of this value, frames of this code, the guard has sent so far. */
uint32_t wire_stops(void);

void expect_heard(const void *bytes, size_t count);
void expect_cr(void);
void expect_silence(void); /* the host has heard nothing that was not taken yet */
void expect_state(dr_guard_state state);
void expect_refused(dr_reason reason); /* the last refusal */
void expect_fault(dr_fault fault);
void expect_tip(uint8_t drive, uint32_t x, uint32_t y, uint32_t z);
dr_guard_status status(void);
const dr_record *last_record(dr_event event); /* NULL: none */
void place_tip(uint8_t drive, uint32_t x, uint32_t y, uint32_t z);

#endif
