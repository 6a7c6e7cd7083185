#include "bench.h"

bench b;

static dr_us clock_at_start;

void setUp(void) {}
void tearDown(void) {}

void bench_set_up(dr_kind kind)
{
    b = (bench){.clock = clock_at_start, .began = clock_at_start};
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        dr_drive_init(&b.drives[drive], kind == DR_TRIO ? DR_STAGE_TRIO_MP845
                                        : drive < 2     ? DR_STAGE_MPC_MP225
                                                        : DR_STAGE_NONE);
    dr_notes_init(&b.notes, b.ring, sizeof b.ring / sizeof b.ring[0]);
    dr_controller_init(&b.c, kind, b.drives, kind == DR_TRIO ? 1 : DR_PORTS);
    b.c.notes = &b.notes;
}

void bench_start(void)
{
    dr_controller_start(&b.c, b.clock);
    dr_panel_init(&b.p, &b.c, b.panels);
}

void bench_begin(dr_kind kind)
{
    bench_set_up(kind);
    bench_start();
}

dr_us bench_us(void) { return b.clock - b.began; }

/* The host reads whatever is there. */
static void read_all(void)
{
    do {
        b.stopped[b.count] = dr_controller_answers_stop(&b.c);
        b.got_at[b.count] = bench_us();
        b.count += dr_controller_pull(&b.c, b.clock, &b.got[b.count], 1);
        TEST_ASSERT_LESS_THAN(BENCH_BYTES, b.count);
    } while (dr_controller_ready(&b.c) > 0);
}

static bool due(dr_us *when)
{
    dr_us other;
    const bool panel = dr_panel_due(&b.p, when), controller = dr_controller_due(&b.c, &other);
    if (controller && (!panel || dr_us_before(other, *when)))
        *when = other;
    return panel || controller;
}

void bench_wait(dr_us span_us)
{
    const dr_us until = b.clock + span_us;
    dr_us when;
    while (due(&when) && !dr_us_before(until, when)) {
        TEST_ASSERT_FALSE_MESSAGE(dr_us_before(when, b.clock), "due in the past");
        b.clock = when;
        dr_panel_settle(&b.p, b.clock);
        read_all();
    }
    b.clock = until;
    dr_panel_settle(&b.p, b.clock);
    read_all();
}

void bench_wait_until_idle(void)
{
    dr_us when;
    bench_wait(0);
    while (due(&when))
        bench_wait(when - b.clock);
}

void bench_press(dr_button button)
{
    TEST_ASSERT_TRUE(dr_panel_press(&b.p, b.clock, button));
    read_all();
}

void bench_release(dr_button button)
{
    TEST_ASSERT_TRUE(dr_panel_release(&b.p, b.clock, button));
    read_all();
}

void bench_hold(dr_button button, dr_us span_us)
{
    bench_press(button);
    bench_wait(span_us);
    bench_release(button);
}

void bench_tap(dr_button button) { bench_hold(button, MS); }

void bench_turn(dr_knob knob, int detents)
{
    TEST_ASSERT_TRUE(dr_panel_turn(&b.p, b.clock, knob, (int16_t)detents));
    read_all();
}

void bench_switch(dr_switches bank, uint8_t drive, uint8_t number, bool on)
{
    TEST_ASSERT_TRUE(dr_panel_switch(&b.p, bank, drive, number, on));
    TEST_ASSERT_EQUAL(on, dr_panel_switch_is_on(&b.p, bank, drive, number));
}

void bench_power_cycle(void)
{
    dr_panel_power(&b.p, b.clock, false);
    bench_wait(S);
    dr_panel_power(&b.p, b.clock, true);
    read_all();
}

dr_look bench_look(void)
{
    dr_look look;
    dr_panel_look(&b.p, b.clock, &look);
    return look;
}

uint8_t bench_beeps(void) { return bench_look().beeps; }

void bench_host(const char *bytes, size_t count)
{
    dr_panel_settle(&b.p, b.clock);
    dr_controller_push(&b.c, b.clock, (const uint8_t *)bytes, count);
    read_all();
}

void bench_host_point(char command, int speed, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t steps[3] = {x, y, z};
    char frame[14] = {command};
    size_t count = 1;
    if (speed >= 0)
        frame[count++] = (char)speed;
    for (unsigned i = 0; i < 12; i++)
        frame[count++] = (char)(steps[i / 4] >> 8 * (i % 4) & 0xFF);
    bench_host(frame, count);
}

void bench_expect_bytes(const char *bytes, size_t count)
{
    TEST_ASSERT_EQUAL_size_t(count, b.count);
    if (count > 0)
        TEST_ASSERT_EQUAL_HEX8_ARRAY(bytes, b.got, count);
    b.count = 0;
}

void bench_expect_nothing(void) { bench_expect_bytes("", 0); }

void bench_expect_at(uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t expected[3] = {x, y, z};
    uint32_t steps[3];
    dr_panel_settle(&b.p, b.clock);
    dr_controller_position(&b.c, b.c.active, b.clock, steps);
    TEST_ASSERT_EQUAL_UINT32_ARRAY(expected, steps, 3);
}

/* TRIO: X, Y, Z, angle, CR [T table 6]; MPC: drive, X, Y, Z, CR [M table 9]. */
void bench_expect_answer_at(uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t steps[3] = {x, y, z};
    const size_t first = b.c.kind == DR_TRIO ? 0 : 1;
    bench_host("C", 1);
    TEST_ASSERT_EQUAL_size_t(14, b.count);
    for (size_t i = 0; i < 12; i++)
        TEST_ASSERT_EQUAL_HEX8(steps[i / 4] >> 8 * (i % 4) & 0xFF, b.got[first + i]);
    TEST_ASSERT_EQUAL_HEX8(0x0D, b.got[13]);
    b.count = 0;
}

void bench_place(uint32_t x, uint32_t y, uint32_t z)
{
    const dr_hand hand = {DR_HAND_PLACE, b.c.active, 0, {x, y, z}};
    TEST_ASSERT_TRUE(dr_controller_poke(&b.c, b.clock, &hand));
}

bool bench_moves(void) { return bench_look().moving != DR_OP_NONE; }

void bench_expect_note(dr_note_kind what)
{
    dr_note note = {.what = UINT8_MAX};
    while (dr_notes_take(&b.notes, &note)) {}
    TEST_ASSERT_EQUAL(what, note.what);
}

void bench_run(void (*test)(void), const char *name, int line)
{
    static const dr_us clocks[] = {0, UINT32_MAX - 5u * MS, UINT32_MAX - 2u * S, UINT32_MAX - 4u * S, 0x7FFFFFFFu};
    for (size_t i = 0; i < sizeof clocks / sizeof clocks[0]; i++) {
        clock_at_start = clocks[i];
        UnityDefaultTestRun(test, name, line);
    }
}
