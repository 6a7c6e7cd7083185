/* dr_guard_rooms: private to the rooms of dr_guard. Nobody else includes it.
 *
 * The guard is one struct and one library in several rooms, each with one subject. A room may call those above it in this
 * list and never those below; tests/core_rules has the order from CMakeLists.txt.
 *
 *     dr_guard_state     who may do what now, timers, and the log of it
 *     dr_guard_seal      has memory kept what it was given?
 *     dr_guard_out       what goes out: bytes for the host, refusals, frames, queries and ^C for the controller
 *     dr_guard_place     who the controller is, and where its tip is
 *     dr_guard_stop      faults, stops, and the proof of rest
 *     dr_guard_motion    one motion, from the reading before it to the proof of its end
 *     dr_guard_people    key, ARM, STOP and the other inputs; cables
 *     dr_guard_device    the conversation with the controller: readings, replies to the host, noise
 *     dr_guard_host      the host's bytes: frames, and what may become of them
 *     dr_guard           time, and the calls of dr_guard.h
 *
 * What rooms share is called dr_g_*. Except where it says otherwise, g->limits is not NULL. */
#ifndef DR_GUARD_ROOMS_H
#define DR_GUARD_ROOMS_H

#include "dr_guard.h"

#include <string.h>

/* Who may do what. Less safe only by a person: LOCKED -> DISARMED by proof, DISARMED -> ARMED by key and ARM,
 * FAULT and STOPPED -> DISARMED by the key. */
typedef enum { MODE_LOCKED, MODE_DISARMED, MODE_ARMED, MODE_FAULT, MODE_STOPPED } dr_mode;

/* What is under way on the controller's side. One thing at a time. */
typedef enum {
    TASK_NONE,
    TASK_PROVE,   /* is it the controller of the limits? READ or, between two tries, DR_TIMER_TASK runs */
    TASK_ARM,     /* two readings that must agree */
    TASK_PASS,    /* the host's query, setting or idle ^C: its reply goes through byte by byte */
    TASK_RECHECK, /* the host's query got nonsense: a reading of the guard's own decides */
    TASK_CHECK,   /* a motion waits for a reading */
    TASK_SEND,    /* a motion was allowed and waits for its turn, or is leaving */
    TASK_MOVE,    /* its CR is awaited */
    TASK_VERIFY,  /* the CR is there and kept back: is the tip where it should be? */
    TASK_STOP     /* ^C was sent: quiet, then two readings that agree prove rest */
} dr_task;

typedef enum {
    READ_OFF,
    READ_WAITS, /* for DR_TIMER_READ: the gap between frames */
    READ_SENT,  /* DR_TIMER_READ is its deadline */
    READ_QUIETS /* after nonsense: 100 ms without a byte, then once more */
} dr_read_phase;

typedef enum { NEWS_NONE, NEWS_MOVED, NEWS_OTHER /* angle or drive */ } dr_news;

#define MS(ms) ((dr_us)(ms)*1000u)
#define FRAME_GAP_US MS(2)   /* between two frames to the controller */
#define LINE_HEAD 2u         /* bytes of an 'S' before its pause: 'S' and the speed */
#define LINE_PAUSE_US MS(35) /* within the 'S' of an MPC-200: 30 ms [M note 10], and some */
#define REPLY_TIMEOUT_US MS(2000)
#define QUIET_US MS(100)
#define REST_APART_US MS(100) /* between two readings that must agree */
#define PROOF_OF_REST_US MS(1000)
#define REPEAT_STOP_US MS(150)
#define RATE_US MS(50) /* for one more motion */
/* A TRIO may be calibrating by itself: a minute, in pauses that grow by a second. Ten queries and the ^C after a reset are
 * what an MPC-200 may get unanswered; see may_send(). */
#define PROVE_RETRY_US MS(1000)
#define PROVE_ATTEMPTS 10u

/* -- Small questions, asked everywhere ---------------------------------------------------------------------------------- */

static inline dr_kind kind_of(const dr_guard *g) { return (dr_kind)g->limits->kind; }
static inline bool has_rig(const dr_guard *g, uint16_t rig) { return (g->limits->rig & rig) != 0; }
static inline bool is_on(const dr_guard *g, dr_input input) { return (g->inputs >> input & 1u) != 0; }
static inline bool is_stoppable(const dr_guard *g) { return (g->command.is & DR_IS_STOPPABLE) != 0; }
static inline bool is_leaving(const dr_guard *g) { return g->out_at > 0 && g->out_at < g->out_count; }

static inline bool is_calibration(uint8_t op)
{
    return op == DR_OP_TRIO_RECALIBRATE || op == DR_OP_MPC_CALIBRATE || op == DR_OP_MPC_CENTRE;
}

static inline void copy_point(uint32_t to[DR_AXES], const uint32_t from[DR_AXES])
{
    memcpy(to, from, DR_AXES * sizeof *to);
}
static inline void clear_timer(dr_guard *g, uint8_t timer) { g->running = (uint16_t)(g->running & ~(1u << timer)); }
static inline bool is_running(const dr_guard *g, uint8_t timer) { return (g->running >> timer & 1u) != 0; }

/* -- dr_guard_state: with or without limits ------------------------------------------------------------------------- */

void dr_g_set_timer(dr_guard *g, uint8_t timer, dr_us when);
void dr_g_set_mode(dr_guard *g, dr_mode mode);
void dr_g_start_idling(dr_guard *g, dr_us now); /* with limits */
dr_guard_state dr_g_state_of(const dr_guard *g);
dr_record dr_g_record_of(const dr_guard *g, dr_us now, dr_event event, uint8_t code);
void dr_g_log_bytes(dr_guard *g, dr_us now, dr_event event, uint8_t code, uint8_t op, const uint8_t *bytes,
                    uint8_t count);
void dr_g_log_event(dr_guard *g, dr_us now, dr_event event, uint8_t code, uint8_t item);
void dr_g_show_state(dr_guard *g, dr_us now);

/* -- dr_guard_seal: with or without limits -------------------------------------------------------------------------- */

void dr_g_seal(dr_guard *g);
bool dr_g_is_damaged(const dr_guard *g);
void dr_g_unseal(dr_guard *g); /* before anything is changed; on damage an empty guard, LOCKED, is left */

/* -- dr_guard_out ------------------------------------------------------------------------------------------------------ */

void dr_g_put_host(dr_guard *g, uint8_t byte);
void dr_g_drop(dr_guard *g, dr_us now, dr_reason reason, uint8_t byte); /* a byte of the host's; limits or not */
void dr_g_flush_dropped(dr_guard *g, dr_us now);
dr_verdict dr_g_because(dr_reason reason);
void dr_g_refuse(dr_guard *g, dr_us now, const dr_command *command, const uint8_t *frame, dr_verdict verdict);
void dr_g_refuse_pending(dr_guard *g, dr_us now, dr_verdict verdict); /* the motion that waits in CHECKING */

void dr_g_put_out(dr_guard *g, const uint8_t *bytes, uint8_t count, uint8_t ready); /* ready: may leave at once */
void dr_g_withdraw(dr_guard *g);
void dr_g_send_stop(dr_guard *g, dr_us now, dr_stop_cause cause); /* limits or not */
dr_command dr_g_position_query(const dr_guard *g);
void dr_g_start_reading(dr_guard *g, dr_us now, dr_us after_us); /* a query of the guard's own; see use_reading() */
void dr_g_stop_reading(dr_guard *g);
void dr_g_send_query(dr_guard *g, dr_us now);
void dr_g_end_task(dr_guard *g);

/* -- dr_guard_place ---------------------------------------------------------------------------------------------------- */

uint32_t dr_g_apart(uint32_t a, uint32_t b);
bool dr_g_is_plausible(const dr_guard *g, const uint8_t *bytes, dr_reply *reply);
bool dr_g_has_jumped(const dr_guard *g, dr_us now, const dr_reply *reply);
dr_news dr_g_news(const dr_guard *g, const dr_reply *reply); /* against what is known */
bool dr_g_has_two(dr_guard *g, dr_us now, const dr_reply *reply, bool *agree);
bool dr_g_is_at(const dr_guard *g, const dr_reply *reply, const dr_box *target_q); /* of the drive that moved last */
void dr_g_know_place(dr_guard *g, dr_us now, const dr_reply *reply);
void dr_g_start_proof(dr_guard *g, dr_us now);
void dr_g_read_for_proof(dr_guard *g, dr_us now, const dr_reply *reply);
void dr_g_identity_proved(dr_guard *g);

/* -- dr_guard_stop ----------------------------------------------------------------------------------------------------- */

void dr_g_latch(dr_guard *g, dr_fault fault);
void dr_g_lock(dr_guard *g, dr_fault fault);
void dr_g_fail(dr_guard *g, dr_us now, dr_fault fault);
void dr_g_begin_stop(dr_guard *g, dr_us now, dr_stop_cause cause, dr_fault fault, uint8_t owed);
void dr_g_stop_by_host(dr_guard *g, dr_us now);
void dr_g_disarm(dr_guard *g, dr_us now, dr_stop_cause cause);
void dr_g_keep_old_target(dr_guard *g);
void dr_g_break_off_unproved(dr_guard *g);
void dr_g_read_for_rest(dr_guard *g, dr_us now, const dr_reply *reply);
void dr_g_repeat_due(dr_guard *g, dr_us now);
bool dr_g_is_intact(const dr_guard *g);
void dr_g_fall_back(dr_guard *g, dr_us now); /* no limits afterwards */

/* -- dr_guard_motion --------------------------------------------------------------------------------------------------- */

void dr_g_read_for_motion(dr_guard *g, dr_us now, const dr_reply *reply);
/* A motion that is about to leave, or an 'S' after its pause: is its reading too old by now? */
bool dr_g_is_late(const dr_guard *g, dr_us now);
void dr_g_come_late(dr_guard *g, dr_us now); /* then: reads anew, refuses, or stops what has begun */
dr_us dr_g_longest_us(const dr_guard *g);
void dr_g_read_for_end(dr_guard *g, dr_us now, const dr_reply *reply);

/* -- dr_guard_people: with or without limits --------------------------------------------------------------------------- */

uint16_t dr_g_needs_of(const dr_guard *g);
void dr_g_input_changed(dr_guard *g, dr_us now, dr_input what, bool on);
void dr_g_read_for_arming(dr_guard *g, dr_us now, const dr_reply *reply);
void dr_g_link(dr_guard *g, dr_us now, bool host_open, bool device_present);

/* -- dr_guard_device --------------------------------------------------------------------------------------------------- */

void dr_g_push_device_byte(dr_guard *g, dr_us now, uint8_t byte); /* limits or not */
void dr_g_pass(dr_guard *g, dr_us now, const dr_command *command, const dr_request *request, const uint8_t *frame);
void dr_g_task_due(dr_guard *g, dr_us now);
void dr_g_read_due(dr_guard *g, dr_us now);
void dr_g_flush_quarantined(dr_guard *g, dr_us now);

/* -- dr_guard_host ----------------------------------------------------------------------------------------------------- */

void dr_g_push_host_byte(dr_guard *g, dr_us now, uint8_t byte); /* limits or not */
void dr_g_drop_frame(dr_guard *g, dr_us now);                   /* limits or not */

#endif
