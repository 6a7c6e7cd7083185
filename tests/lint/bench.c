#include "bench.h"

#include <string.h>

#define NS_PER_US UINT64_C(1000)
#define US_PER_MS UINT64_C(1000)

static observation seen_now(const bench *b, observed_kind what)
{
    return (observation){.what = what,
                         .name = b->ins.controller.kind == DR_TRIO ? "trio" : "mpc",
                         .ins = &b->ins,
                         .when_us = b->ins.now_us,
                         .real_ns = b->real_ns,
                         .unread = b->unread};
}

void bench_tell(bench *b, observed_kind what)
{
    observation seen = seen_now(b, what);
    seen.text = "told by the test";
    observe(&b->link, &seen);
    if (what == OBSERVED_CLOSED)
        b->unread = 0;
}

void bench_tty(bench *b, uint32_t baud)
{
    observation seen = seen_now(b, OBSERVED_TTY);
    seen.baud = baud;
    observe(&b->link, &seen);
}

static void run_to(bench *b, uint64_t until_us)
{
    uint8_t bytes[64];
    size_t count;
    while (instrument_run(&b->ins, until_us, bytes, sizeof bytes, &count)) {
        dr_note note;
        while (dr_notes_take(&b->notes, &note)) {
            observation seen = seen_now(b, OBSERVED_NOTE);
            seen.note = &note;
            observe(&b->link, &seen);
        }
        if (count == 0)
            continue;
        observation seen = seen_now(b, OBSERVED_TO_HOST);
        seen.bytes = bytes;
        seen.count = count;
        observe(&b->link, &seen);
        b->unread += (uint32_t)count;
        b->got_count = count;
        memcpy(b->got, bytes, count);
    }
}

void bench_start(bench *b, dr_kind kind, uint16_t firmware, observer *who)
{
    memset(b, 0, sizeof *b);
    for (unsigned i = 0; i < DR_PORTS; i++)
        dr_drive_init(&b->drives[i],
                      kind == DR_TRIO ? DR_STAGE_TRIO_MP845 : (i < 2 ? DR_STAGE_MPC_MP225 : DR_STAGE_NONE));
    dr_controller_init(&b->ins.controller, kind, b->drives, kind == DR_TRIO ? 1 : DR_PORTS);
    b->ins.controller.firmware = firmware;
    dr_notes_init(&b->notes, b->ring, sizeof b->ring / sizeof b->ring[0]);
    b->ins.controller.notes = &b->notes;
    b->link.who = who;
    b->real_ns = b->wrote_ns = UINT64_C(1000000000);
    instrument_start(&b->ins, 0);
    run_to(b, 0);
    bench_tell(b, OBSERVED_OPENED);
}

void bench_say(bench *b, const void *bytes, size_t count)
{
    observation seen = seen_now(b, OBSERVED_FROM_HOST);
    seen.bytes = bytes;
    seen.count = count;
    seen.pause_us = (uint32_t)((b->real_ns - b->wrote_ns) / NS_PER_US);
    seen.late_us = b->late_us;
    seen.has_read_behind = b->has_read_behind;
    b->has_read_behind = false;
    b->late_us = 0;
    b->wrote_ns = b->real_ns;
    observe(&b->link, &seen);
    (void)instrument_take(&b->ins, seen.pause_us, bytes, count);
    run_to(b, b->ins.now_us);
}

void bench_wait_us(bench *b, uint64_t us)
{
    b->real_ns += us * NS_PER_US;
    run_to(b, b->ins.now_us + us);
}

void bench_sleep_real_us(bench *b, uint64_t us) { b->real_ns += us * NS_PER_US; }

void bench_read(bench *b, uint32_t count) { b->unread -= count < b->unread ? count : b->unread; }

void bench_ask(bench *b, const void *bytes, size_t count)
{
    uint64_t when_us;
    bench_wait_us(b, 3u * US_PER_MS);
    bench_say(b, bytes, count);
    while (instrument_due(&b->ins, &when_us))
        bench_wait_us(b, when_us - b->ins.now_us);
    bench_read(b, UINT32_MAX);
}

size_t bench_frame(uint8_t *frame, const char *head, size_t head_count, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t point[DR_AXES] = {x, y, z};
    size_t at = head_count;
    memcpy(frame, head, head_count);
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        for (unsigned byte = 0; byte < 4; byte++)
            frame[at++] = (uint8_t)(point[axis] >> 8 * byte);
    return at;
}

void bench_line(bench *b, uint8_t speed, uint32_t x, uint32_t y, uint32_t z, uint64_t pause_us)
{
    uint8_t frame[DR_FRAME_MAX];
    const char head[] = {'S', (char)speed};
    const size_t count = bench_frame(frame, head, sizeof head, x, y, z);
    uint64_t when_us;
    bench_wait_us(b, 3u * US_PER_MS);
    if (pause_us > 0) {
        bench_say(b, frame, 2);
        bench_wait_us(b, pause_us);
        bench_say(b, frame + 2, count - 2);
    } else {
        bench_say(b, frame, count);
    }
    while (instrument_due(&b->ins, &when_us))
        bench_wait_us(b, when_us - b->ins.now_us);
    bench_read(b, UINT32_MAX);
}
