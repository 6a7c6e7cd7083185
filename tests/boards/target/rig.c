#include "rig.h"

void rig_begin(rig *r, dr_kind kind, dr_us now)
{
    static const uint8_t stages[2][DR_PORTS] = {{DR_STAGE_TRIO_MP845}, {DR_STAGE_MPC_MP225, DR_STAGE_MPC_MP225}};
    for (uint8_t i = 0; i < DR_PORTS; i++)
        dr_drive_init(&r->drives[i], (dr_stage_id)stages[kind][i]);
    dr_controller_init(&r->controller, kind, r->drives, kind == DR_TRIO ? 1 : DR_PORTS);
    r->now = r->line_free = now;
    r->byte_us = kind == DR_TRIO ? 174 : 78;
    dr_controller_start(&r->controller, now);
}

/* One byte, if the line is free. */
static void take(rig *r)
{
    uint8_t byte;
    if (dr_us_before(r->now, r->line_free)) {
        (void)dr_controller_pull(&r->controller, r->now, &byte, 0);
        return;
    }
    if (dr_controller_pull(&r->controller, r->now, &byte, 1) > 0) {
        r->line_free = r->now + r->byte_us;
        if (r->told != NULL)
            r->told(r->now, byte);
    } else {
        r->line_free = r->now;
    }
}

void rig_send(rig *r, const void *bytes, size_t count)
{
    const uint8_t *byte = bytes;
    for (size_t i = 0; i < count; i++) {
        dr_controller_push(&r->controller, r->now, byte + i, 1);
        rig_run_us(r, r->byte_us);
    }
}

void rig_run_us(rig *r, dr_us span_us)
{
    const dr_us end = r->now + span_us;
    for (;;) {
        dr_us next = end, due;
        take(r);
        if (dr_controller_due(&r->controller, &due) && dr_us_before(due, next))
            next = due;
        if (dr_controller_ready(&r->controller) > 0 && dr_us_before(r->line_free, next))
            next = r->line_free;
        if (!dr_us_before(r->now, end))
            return;
        if (dr_us_before(r->now, next))
            r->now = next;
    }
}
