#include "sim.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void sim_die(const char *why)
{
    (void)fprintf(stderr, "sim: %s\n", why);
    abort();
}

void sim_init(sim *s, dr_kind kind)
{
    memset(s, 0, sizeof *s);
    dr_drive_init(&s->drives[0], kind == DR_TRIO ? DR_STAGE_TRIO_MP845 : DR_STAGE_MPC_MP225);
    dr_drive_init(&s->drives[1], kind == DR_TRIO ? DR_STAGE_NONE : DR_STAGE_MPC_MP225);
    dr_drive_init(&s->drives[2], DR_STAGE_NONE);
    dr_drive_init(&s->drives[3], DR_STAGE_NONE);
    dr_controller_init(&s->c, kind, s->drives, kind == DR_TRIO ? 1 : DR_PORTS);
}

void sim_start(sim *s, dr_us clock)
{
    s->clock = clock;
    dr_controller_start(&s->c, sim_clock(s));
}

void sim_free(sim *s)
{
    free(s->out);
    s->out = NULL;
    s->count = s->room = s->seen = 0;
}

dr_us sim_clock(const sim *s) { return s->clock + (uint32_t)(s->now_us & UINT32_MAX); }

static void keep(sim *s, uint8_t byte)
{
    if (s->count == s->room) {
        s->room = s->room == 0 ? 256 : 2 * s->room;
        sim_byte *more = realloc(s->out, s->room * sizeof *more);
        if (more == NULL) {
            sim_die("no memory");
        }
        s->out = more;
    }
    s->out[s->count].at_us = s->now_us;
    s->out[s->count].byte = byte;
    s->count++;
}

void sim_pump(sim *s)
{
    for (;;) {
        uint8_t byte;
        const size_t room = s->line_free_us <= s->now_us ? 1 : 0; /* without room it only settles */
        const size_t got = dr_controller_pull(&s->c, sim_clock(s), &byte, room);
        if (got > room) {
            sim_die("more bytes pulled than there was room for");
        }
        if (got == 0) {
            return;
        }
        keep(s, byte);
        s->line_free_us = s->now_us + s->byte_us;
    }
}

/* The next instant after now at which somebody has to come. False: none. */
static bool next_visit(const sim *s, uint64_t *at)
{
    bool any = false;
    dr_us when;
    if (dr_controller_due(&s->c, &when)) {
        if (!dr_us_before(sim_clock(s), when)) {
            sim_die("what is due is not in the future");
        }
        *at = s->now_us + (uint32_t)(when - sim_clock(s));
        any = true;
    }
    if (dr_controller_ready(&s->c) > 0) {
        if (s->line_free_us <= s->now_us) {
            sim_die("bytes are ready, the line is free, and none leaves");
        }
        if (!any || s->line_free_us < *at) {
            *at = s->line_free_us;
        }
        any = true;
    }
    return any;
}

void sim_run_to(sim *s, uint64_t until_us)
{
    for (;;) {
        sim_pump(s);
        uint64_t at;
        if (!next_visit(s, &at) || at > until_us) {
            break;
        }
        s->now_us = at;
        s->visits++;
    }
    if (s->now_us < until_us) {
        s->now_us = until_us;
        sim_pump(s);
    }
}

void sim_run(sim *s, uint64_t span_us) { sim_run_to(s, s->now_us + span_us); }

void sim_run_out(sim *s)
{
    uint64_t at;
    sim_pump(s);
    while (next_visit(s, &at)) {
        s->now_us = at;
        s->visits++;
        sim_pump(s);
    }
}

void sim_jump(sim *s, uint64_t span_us) { s->now_us += span_us; }

void sim_push(sim *s, const uint8_t *bytes, size_t count) { dr_controller_push(&s->c, sim_clock(s), bytes, count); }

bool sim_poke(sim *s, const dr_hand *hand) { return dr_controller_poke(&s->c, sim_clock(s), hand); }
