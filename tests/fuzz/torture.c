#include "torture.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void breach(const char *what, int line)
{
    (void)fprintf(stderr, "torture.c:%d: %s does not hold\n", line, what);
    abort();
}

#define MUST(condition)                                                                                                \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            breach(#condition, __LINE__);                                                                              \
        }                                                                                                              \
    } while (0)

uint8_t torture_next(torture_input *input) { return input->at < input->count ? input->bytes[input->at++] : 0; }

void torture_begin(torture *t, torture_input *input)
{
    static const uint16_t firmware[] = {0x100, 0x103, 0x104, 0x105, 0x106, 0x261, 0x262, 0x299,
                                        0x300, 0x312, 0x313, 0x316, 0x319, 0x321, 0x321, 0x321};
    memset(t, 0, sizeof *t);
    const uint8_t kind = torture_next(input);
    const bool trio = kind & 1;
    t->now = (dr_us)torture_next(input) << 24 | (dr_us)torture_next(input) << 16 | (kind & 2 ? 0xFFFFu : 0u);
    const uint16_t version = firmware[torture_next(input) & 15];
    const uint8_t drives = trio ? 1 : DR_PORTS;
    for (uint8_t k = 0; k < drives; k++) {
        const uint8_t stage = trio ? (uint8_t)(DR_STAGE_TRIO_MP845 + torture_next(input) % 4)
                                   : (uint8_t)(DR_STAGE_MPC_MP225 + torture_next(input) % 8); /* the eighth: none */
        const bool fits = stage < DR_STAGES && dr_stage_fits((dr_stage_id)stage, trio ? DR_TRIO : DR_MPC, version,
                                                             (uint8_t)(k + 1)) == DR_FIT_YES;
        dr_drive_init(&t->drives[k], fits ? (dr_stage_id)stage : trio ? DR_STAGE_TRIO_MP845 : DR_STAGE_NONE);
        const uint8_t more = torture_next(input);
        t->drives[k].diagonal = more & 15;
        t->drives[k].y_moves_home = more & 16;
        t->drives[k].work_is_set = more & 32;
        dr_stage fitted;
        if (dr_stage_get((dr_stage_id)t->drives[k].stage, &fitted)) {
            t->drives[k].work_steps[more % 3] = torture_next(input) * 4200u % (fitted.travel_steps[more % 3] + 1);
        }
    }
    dr_controller_init(&t->c, trio ? DR_TRIO : DR_MPC, t->drives, drives);
    t->c.firmware = version;
    t->c.quirks = kind & 4 ? torture_next(input) : 0;
    t->c.angle_deg = (uint8_t)(torture_next(input) % 91);
    dr_stage first;
    if (trio && dr_stage_get((dr_stage_id)t->drives[0].stage, &first)) {
        t->c.home_steps[kind % 3] = torture_next(input) * 4200u % (first.travel_steps[kind % 3] + 1);
    }
    t->c.calibrates_at_power_on = kind & 8;
    if (kind & 16) {
        dr_notes_init(&t->notes, t->ring, 8);
        t->c.notes = &t->notes;
    }
    dr_controller_start(&t->c, t->now);
    torture_check(t);
}

void torture_check_quick(const torture *t)
{
    const dr_controller *c = &t->c;
    MUST((c->framer.have == 0 && c->framer.want == 0) ||
         (0 < c->framer.have && c->framer.have < c->framer.want && c->framer.want <= DR_FRAME_MAX));
    MUST(c->kept_bytes <= DR_KEPT_MAX);
    MUST(c->out_at <= c->out_bytes && c->out_bytes <= DR_REPLY_MAX);
    MUST(c->state <= DR_STATE_PAUSED);
    MUST(c->active < c->drive_count);
    MUST(c->angle_deg <= DR_ANGLE_MAX_DEG);
    if (c->state == DR_STATE_OFF || c->state == DR_STATE_BOOTING || c->state == DR_STATE_WEDGED) {
        MUST(dr_controller_ready(c) == 0);
    }
}

void torture_check(const torture *t)
{
    const dr_controller *c = &t->c;
    torture_check_quick(t);
    dr_us when;
    if (dr_controller_due(c, &when)) {
        MUST(c->state == DR_STATE_MOVING || c->state == DR_STATE_BOOTING);
        MUST((uint32_t)(when - t->now) <=
             UINT32_C(1300000000)); /* the longest move: 50 mm at the lowest speed, and twice that */
    } else {
        MUST(c->state != DR_STATE_MOVING && c->state != DR_STATE_BOOTING);
    }
    for (uint8_t k = 0; k < c->drive_count; k++) {
        dr_stage stage;
        uint32_t at[DR_AXES];
        dr_controller_position(c, k, t->now, at);
        if (dr_stage_get((dr_stage_id)t->drives[k].stage, &stage)) {
            for (unsigned axis = 0; axis < DR_AXES; axis++) {
                MUST(at[axis] <= stage.travel_steps[axis]);
            }
        }
        MUST(t->drives[k].mode <= 9);
    }
    bool first;
    MUST((dr_controller_answering(c, &first) == DR_OP_NONE) == (dr_controller_ready(c) == 0));
}

void torture_push(torture *t, const uint8_t *bytes, size_t count)
{
    dr_controller_push(&t->c, t->now, bytes, count);
    torture_check_quick(t);
}

void torture_pull(torture *t, size_t room)
{
    uint8_t bytes[300];
    memset(bytes, 0xA5, sizeof bytes);
    room = room < sizeof bytes ? room : sizeof bytes - 1;
    const size_t got = dr_controller_pull(&t->c, t->now, bytes, room);
    MUST(got <= room);
    MUST(bytes[got] == 0xA5); /* no byte beyond what was told */
    MUST(got == room || dr_controller_ready(&t->c) == 0);
    torture_check_quick(t);
}

void torture_poke(torture *t, torture_input *input)
{
    dr_hand hand;
    memset(&hand, 0, sizeof hand);
    const uint8_t what = torture_next(input);
    if (what & 128) { /* a button of the panel */
        (void)dr_controller_apply(&t->c, t->now, (dr_effect)((what & 15) % (DR_EFFECT_STORE_WORK + 1)),
                                  torture_next(input));
        torture_check(t);
        return;
    }
    hand.what = what & 3;
    hand.drive = (uint8_t)((what >> 2 & 3) % t->c.drive_count);
    hand.stage = (uint8_t)((what >> 4 & 7) + (t->c.kind == DR_TRIO ? 0 : DR_STAGE_TRIO_MP265));
    dr_stage stage;
    if (hand.what == DR_HAND_CONNECT && dr_stage_fits((dr_stage_id)hand.stage, (dr_kind)t->c.kind, t->c.firmware,
                                                      (uint8_t)(hand.drive + 1)) != DR_FIT_YES) {
        hand.stage = DR_STAGE_NONE;
        if (t->c.kind == DR_TRIO) {
            return; /* its manipulator is not unplugged */
        }
    }
    if (dr_stage_get((dr_stage_id)t->drives[hand.drive].stage, &stage)) {
        for (unsigned axis = 0; axis < DR_AXES; axis++) {
            hand.steps[axis] = (torture_next(input) * 4200u) % (stage.travel_steps[axis] + 1);
        }
    }
    (void)dr_controller_poke(&t->c, t->now, &hand);
    torture_check(t);
}

void torture_wait(torture *t)
{
    dr_us when;
    if (dr_controller_due(&t->c, &when)) {
        t->now = when;
        torture_pull(t, 0); /* settles: without room nothing leaves */
        dr_us next;
        MUST(!dr_controller_due(&t->c, &next) || dr_us_before(t->now, next));
    }
}

void torture_revive(torture *t)
{
    static const dr_hand off = {DR_HAND_POWER_OFF, 0, DR_STAGE_NONE, {0}},
                         on = {DR_HAND_POWER_ON, 0, DR_STAGE_NONE, {0}};
    (void)dr_controller_poke(&t->c, t->now, &off);
    torture_check(t);
    MUST(dr_controller_poke(&t->c, t->now, &on));
    for (int k = 0; k < 20 && t->c.state != DR_STATE_REST; k++) { /* the boot and the calibration */
        torture_wait(t);
    }
    MUST(t->c.state == DR_STATE_REST);
    MUST(dr_controller_ready(&t->c) == 0);
    bool connected = false;
    for (uint8_t k = 0; k < t->c.drive_count; k++) {
        connected = connected || t->drives[k].stage != DR_STAGE_NONE;
    }
    const uint8_t query = 'C';
    uint8_t reply[16] = {0};
    torture_push(t, &query, 1);
    const size_t got = dr_controller_pull(&t->c, t->now, reply, sizeof reply);
    MUST(got == (connected ? 14u : 0u));
    if (connected) {
        uint32_t at[DR_AXES];
        dr_controller_position(&t->c, t->c.active, t->now, at);
        const uint8_t *xyz = t->c.kind == DR_MPC ? reply + 1 : reply;
        for (unsigned axis = 0; axis < DR_AXES; axis++, xyz += 4) {
            MUST(((uint32_t)xyz[0] | (uint32_t)xyz[1] << 8 | (uint32_t)xyz[2] << 16 | (uint32_t)xyz[3] << 24) ==
                 at[axis]);
        }
        MUST(t->c.kind == DR_MPC ? reply[0] == t->c.active + 1 : reply[12] == t->c.angle_deg);
        MUST(reply[13] == 0x0D);
    }
    torture_check(t);
}
