/* rig: a controller and its line in virtual time, small enough for any target. */
#ifndef DR_RIG_H
#define DR_RIG_H

#include "dr_controller.h"

typedef struct {
    dr_controller controller;
    dr_drive drives[DR_PORTS];
    dr_us now, line_free;
    uint32_t byte_us;
    void (*told)(dr_us when, uint8_t byte); /* the controller's bytes, as they leave */
} rig;

/* On, at rest, documented: TRIO with an MP-845, or MPC-200 with two MP-225, the clock at `now`. */
void rig_begin(rig *r, dr_kind kind, dr_us now);
/* The host's bytes, and then so much time. */
void rig_send(rig *r, const void *bytes, size_t count);
void rig_run_us(rig *r, dr_us span_us);

#endif
