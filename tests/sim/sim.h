/* sim: a host, a line and a controller in virtual time. Used by the scenarios here, by tests/oracle and by tests/fuzz.
 *
 * It is the caller that dr_controller.h describes: it comes at each due instant, and takes bytes whenever the line to
 * the host is free. Time is 64 bits wide here and 32 bits wide there, so that a scenario can begin just before the wrap.
 * Failures of its own (no memory, a due instant that has passed) end the program: sim_die(). */
#ifndef SIM_H
#define SIM_H

#include "dr_controller.h"

typedef struct {
    uint64_t at_us;
    uint8_t byte;
} sim_byte;

typedef struct {
    dr_controller c;
    dr_drive drives[DR_PORTS];
    dr_us clock; /* what the controller's clock shows at now_us == 0 */
    uint64_t now_us;
    uint32_t byte_us; /* for how long a byte holds the line to the host; 0: not at all */
    uint64_t line_free_us;
    sim_byte *out; /* all that the host has got */
    size_t count, room;
    size_t seen;     /* of which the test has looked at so many */
    uint64_t visits; /* due instants at which it came */
} sim;

/* The documented controller, not yet started: TRIO with an MP-845; MPC-200 with two MP-225 on ports 1 and 2. */
void sim_init(sim *s, dr_kind kind);
/* Starts it with the controller's clock at `clock`. */
void sim_start(sim *s, dr_us clock);
void sim_free(sim *s);

/* The controller's clock now. */
dr_us sim_clock(const sim *s);
/* Runs until now_us == until_us, everything that is due then included. */
void sim_run_to(sim *s, uint64_t until_us);
void sim_run(sim *s, uint64_t span_us);
/* Runs until nothing is due and nothing leaves any more. */
void sim_run_out(sim *s);
/* Jumps: nobody comes in between, whatever is due. */
void sim_jump(sim *s, uint64_t span_us);

/* The host's bytes arrive now, in one piece. */
void sim_push(sim *s, const uint8_t *bytes, size_t count);
bool sim_poke(sim *s, const dr_hand *hand);
/* Takes what may leave now. */
void sim_pump(sim *s);

void sim_die(const char *why);

#endif
