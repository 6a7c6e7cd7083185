#include "scenario.h"

#include <string.h>

sim rig;
dr_us clock_at_start;
dr_note noted[256];
dr_notes notes;

void setUp(void) {}

void tearDown(void) { sim_free(&rig); }

void prepare(dr_kind kind)
{
    sim_free(&rig);
    sim_init(&rig, kind);
    dr_notes_init(&notes, noted, 256);
    rig.c.notes = &notes;
}

void start(void) { sim_start(&rig, clock_at_start); }

static void place_before_start(uint32_t x, uint32_t y, uint32_t z)
{
    rig.drives[0].position_steps[DR_X] = x;
    rig.drives[0].position_steps[DR_Y] = y;
    rig.drives[0].position_steps[DR_Z] = z;
}

void trio_at(uint32_t x, uint32_t y, uint32_t z)
{
    prepare(DR_TRIO);
    dr_drive_init(&rig.drives[0], DR_STAGE_TRIO_MP285);
    place_before_start(x, y, z);
    start();
}

void mpc_at(uint32_t x, uint32_t y, uint32_t z)
{
    prepare(DR_MPC);
    place_before_start(x, y, z);
    start();
}

void send(const uint8_t *bytes, size_t count)
{
    sim_push(&rig, bytes, count);
    sim_pump(&rig);
}

void send_code(int code)
{
    const uint8_t byte = (uint8_t)code;
    send(&byte, 1);
}

void send_string(const char *codes)
{
    uint8_t bytes[256];
    const size_t count = strlen(codes);
    TEST_ASSERT_TRUE(count <= sizeof bytes);
    memcpy(bytes, codes, count);
    send(bytes, count);
}

void send_value(int code, unsigned value)
{
    const uint8_t bytes[2] = {(uint8_t)code, (uint8_t)value};
    send(bytes, 2);
}

static void put32(uint8_t *bytes, uint32_t steps)
{
    for (unsigned k = 0; k < 4; k++) {
        bytes[k] = (uint8_t)(steps >> (8 * k) & 0xFF);
    }
}

static void put_point(uint8_t *bytes, uint32_t x, uint32_t y, uint32_t z)
{
    put32(bytes, x);
    put32(bytes + 4, y);
    put32(bytes + 8, z);
}

void send_axis(int code, uint32_t steps)
{
    uint8_t bytes[5] = {(uint8_t)code};
    put32(bytes + 1, steps);
    send(bytes, 5);
}

void send_point(int code, uint32_t x, uint32_t y, uint32_t z)
{
    uint8_t bytes[13] = {(uint8_t)code};
    put_point(bytes + 1, x, y, z);
    send(bytes, 13);
}

void send_line(unsigned level, uint32_t x, uint32_t y, uint32_t z)
{
    uint8_t bytes[14] = {'S', (uint8_t)level};
    put_point(bytes + 2, x, y, z);
    send(bytes, 14);
}

static bool poke(dr_hand_kind what, uint8_t drive, dr_stage_id stage, uint32_t x, uint32_t y, uint32_t z)
{
    const dr_hand hand = {(uint8_t)what, drive, (uint8_t)stage, {x, y, z}};
    const bool done = sim_poke(&rig, &hand);
    sim_pump(&rig);
    return done;
}

bool power(bool on) { return poke(on ? DR_HAND_POWER_ON : DR_HAND_POWER_OFF, 0, DR_STAGE_NONE, 0, 0, 0); }

bool place(uint8_t drive, uint32_t x, uint32_t y, uint32_t z)
{
    return poke(DR_HAND_PLACE, drive, DR_STAGE_NONE, x, y, z);
}

bool plug(uint8_t drive, dr_stage_id stage) { return poke(DR_HAND_CONNECT, drive, stage, 0, 0, 0); }

void expect(uint64_t at_us, const uint8_t *bytes, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        TEST_ASSERT_TRUE_MESSAGE(rig.seen < rig.count, "the host waits for a byte that has not come");
        TEST_ASSERT_EQUAL_HEX8_MESSAGE(bytes[k], rig.out[rig.seen].byte, "byte");
        TEST_ASSERT_EQUAL_UINT64_MESSAGE(at_us, rig.out[rig.seen].at_us, "instant");
        rig.seen++;
    }
}

void expect_cr(uint64_t at_us)
{
    static const uint8_t cr = 0x0D;
    expect(at_us, &cr, 1);
}

void expect_trio_position(uint64_t at_us, uint32_t x, uint32_t y, uint32_t z, unsigned angle)
{
    uint8_t bytes[14];
    put_point(bytes, x, y, z);
    bytes[12] = (uint8_t)angle;
    bytes[13] = 0x0D;
    expect(at_us, bytes, 14);
}

void expect_mpc_position(uint64_t at_us, unsigned drive, uint32_t x, uint32_t y, uint32_t z)
{
    uint8_t bytes[14] = {(uint8_t)drive};
    put_point(bytes + 1, x, y, z);
    bytes[13] = 0x0D;
    expect(at_us, bytes, 14);
}

void expect_stream(uint64_t at_us, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t steps[3] = {x, y, z};
    uint8_t bytes[12] = {0xFF, 0xFF, 0xFF};
    for (unsigned k = 0; k < 9; k++) {
        bytes[3 + k] = (uint8_t)(steps[k / 3] >> (8 * (k % 3)) & 0xFF);
    }
    expect(at_us, bytes, 12);
}

void expect_nothing(void)
{
    TEST_ASSERT_EQUAL_UINT64_MESSAGE(rig.count, rig.seen, "the host has got bytes that it did not wait for");
}

void expect_idle(void)
{
    dr_us when;
    expect_nothing();
    TEST_ASSERT_EQUAL(DR_STATE_REST, rig.c.state);
    TEST_ASSERT_FALSE(dr_controller_due(&rig.c, &when));
    TEST_ASSERT_EQUAL(0, dr_controller_ready(&rig.c));
}

void expect_at(uint8_t drive, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t want[3] = {x, y, z};
    uint32_t at[3];
    dr_controller_position(&rig.c, drive, sim_clock(&rig), at);
    TEST_ASSERT_EQUAL_UINT32_ARRAY(want, at, 3);
}

dr_note expect_note(dr_note_kind what)
{
    dr_note note;
    memset(&note, 0, sizeof note);
    while (dr_notes_take(&notes, &note)) {
        if (note.what == (uint8_t)what) {
            return note;
        }
    }
    TEST_FAIL_MESSAGE("a note is missing");
    return note;
}

void expect_no_note(dr_note_kind what)
{
    dr_note note;
    while (dr_notes_take(&notes, &note)) {
        TEST_ASSERT_NOT_EQUAL(what, note.what);
    }
}

uint32_t takes_us(uint32_t steps, uint32_t quanta, uint32_t um_per_s)
{
    const uint64_t length = (uint64_t)steps * quanta * 1000000, speed = (uint64_t)um_per_s * 64;
    return (uint32_t)((length + speed - 1) / speed);
}

void at_every_clock(void (*tests)(void))
{
    static const dr_us clocks[] = {0, UINT32_C(0x7FFFFFFB), UINT32_MAX - 300000, UINT32_MAX - 1000, UINT32_MAX};
    for (size_t i = 0; i < sizeof clocks / sizeof clocks[0]; i++) {
        clock_at_start = clocks[i];
        tests();
    }
}
