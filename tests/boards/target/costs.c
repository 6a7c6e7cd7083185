/* Says what the core's calls cost at most, one line a call: "NAME WORK". */
#include "rig.h"
#include "target.h"

static rig r;
static uint32_t most;

static uint32_t began;
static void begin(void) { began = target_work(); }

static uint32_t empty_work;
static void end(void)
{
    const uint32_t work = ((target_work() - began) & TARGET_WORK_MASK) - empty_work;
    if (work > most)
        most = work;
}

static void say(const char *name)
{
    target_say(name);
    target_put(' ');
    target_say_uint(most);
    target_put('\n');
    most = 0;
}

static void push(uint8_t byte)
{
    begin();
    dr_controller_push(&r.controller, r.now, &byte, 1);
    end();
}

/* All but the last byte goes unmeasured. */
static void push_frame(const char *bytes, size_t count)
{
    rig_send(&r, bytes, count - 1);
    push((uint8_t)bytes[count - 1]);
}

#define LAST_BYTE_OF(bytes) push_frame(bytes, sizeof(bytes) - 1)

static void due(void)
{
    dr_us when;
    begin();
    (void)dr_controller_due(&r.controller, &when);
    end();
}

static void pull(dr_us now, size_t room)
{
    uint8_t bytes[DR_REPLY_MAX];
    begin();
    (void)dr_controller_pull(&r.controller, now, bytes, room);
    end();
}

#define FAR "\xA3\x81\x01\0\xA7\x1D\x03\0\x11\x3D\x05\0"

static void bytes_that_begin_or_go_on(void)
{
    for (uint8_t kind = DR_TRIO; kind <= DR_MPC; kind++) {
        for (uint16_t byte = 0; byte < 256; byte++) {
            rig_begin(&r, (dr_kind)kind, 1);
            push((uint8_t)byte);
        }
    }
    say("push-first-byte"); /* whole commands of one byte among them */
    rig_begin(&r, DR_MPC, 1);
    push('M');
    most = 0;
    for (uint8_t i = 0; i < 11; i++)
        push(0xFF);
    say("push-byte-inside");
}

static void accepted(void)
{
    rig_begin(&r, DR_MPC, 1);
    LAST_BYTE_OF("M" FAR);
    say("push-accepts-M");
    rig_begin(&r, DR_MPC, 1);
    LAST_BYTE_OF("S\x0F" FAR);
    say("push-accepts-S");
    rig_begin(&r, DR_MPC, 1);
    rig_send(&r, "M" FAR, 13);
    rig_run_us(&r, 9000000);
    LAST_BYTE_OF("H");
    say("push-accepts-H");
    rig_begin(&r, DR_TRIO, 1);
    LAST_BYTE_OF("H" FAR);
    say("push-accepts-trio-H");
    rig_begin(&r, DR_TRIO, 1);
    LAST_BYTE_OF("S\x00" FAR);
    say("push-accepts-trio-S");
    rig_begin(&r, DR_TRIO, 1);
    LAST_BYTE_OF("c");
    say("push-position");
}

static void moving(void)
{
    rig_begin(&r, DR_MPC, 1);
    due();
    say("due-at-rest");
    pull(r.now, 14);
    say("pull-at-rest");
    rig_send(&r, "M" FAR, 13);
    for (uint8_t i = 0; i < 20; i++) {
        rig_run_us(&r, 98765);
        due();
    }
    say("due-moving");
    for (uint8_t i = 0; i < 20; i++) {
        rig_run_us(&r, 98765);
        pull(r.now, 14);
    }
    say("pull-moving");
    push(3);
    say("push-interrupt");
    pull(r.now, 1);
    say("pull-a-byte");
}

static void streaming(void)
{
    rig_begin(&r, DR_MPC, 1);
    rig_send(&r, "O", 1);
    rig_run_us(&r, 1000);
    rig_send(&r, "S\x03" FAR, 14); /* 3 ms a micron: between two frames the line is free for 2 ms */
    uint32_t most_frame = 0;
    for (uint8_t i = 0; i < 200; i++) {
        dr_us when = r.now;
        rig_run_us(&r, 1500);
        due();
        (void)dr_controller_due(&r.controller, &when);
        r.now = when;
        const uint32_t most_due = most;
        most = 0;
        pull(r.now, 0); /* makes the frame */
        most_frame = most > most_frame ? most : most_frame;
        most = most_due;
    }
    say("due-streaming");
    most = most_frame;
    say("pull-makes-a-frame");
    push(3);
    say("push-interrupt-streaming");
}

int target_main(void)
{
    begin();
    empty_work = (target_work() - began) & TARGET_WORK_MASK;
    bytes_that_begin_or_go_on();
    accepted();
    moving();
    streaming();
    return 0;
}
