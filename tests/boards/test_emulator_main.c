/* The loop that every board runs, on a board of this test's own: its clock is virtual, its line has a pace or has none, its
 * memory can lose power at any byte. */
#include "emulator.h"
#include "keep.h"
#include "port.h"

#include "unity.h"

#include <string.h>

/* -- The board ------------------------------------------------------------------------------------------------------ */

#define SLOTS 6u
#define HEARD_MAX 4096u

static dr_us now;
static uint8_t straps;
static uint32_t line_baud;
static bool has_pace;
static size_t line_room;

static struct {
    dr_us when;
    uint8_t byte;
} input[256], output[HEARD_MAX];
static size_t input_at, input_count, output_count;

static uint8_t memory[SLOTS][DR_PORT_SLOT_BYTES];
static uint16_t slots;
static uint32_t writes_left; /* bytes until the power is cut */
static uint32_t writes;
static uint8_t garbage; /* what a byte holds whose writing was cut off */
static bool is_dead;
static uint16_t worn_slots; /* bits: what is written there does not stay */
static uint32_t waits;

uint8_t dr_port_begin(void) { return straps; }
void dr_port_open(uint32_t baud) { line_baud = baud; }
dr_us dr_port_now_us(void) { return now; }

static dr_us end_of_test;

bool dr_port_waits(void) { return true; }

void dr_port_wait(bool has_end, dr_us until)
{
    dr_us to = end_of_test;
    if (has_end && dr_us_before(until, to))
        to = until;
    if (input_at < input_count && dr_us_before(input[input_at].when, to))
        to = input[input_at].when;
    waits++;
    if (dr_us_before(now, to))
        now = to;
    else
        now++; /* a step takes its time */
}

size_t dr_port_read(uint8_t *bytes, size_t room)
{
    size_t count = 0;
    while (count < room && input_at < input_count && !dr_us_before(now, input[input_at].when))
        bytes[count++] = input[input_at++].byte;
    return count;
}

size_t dr_port_room(void) { return line_room; }

void dr_port_write(const uint8_t *bytes, size_t count)
{
    TEST_ASSERT_LESS_OR_EQUAL(line_room, count);
    for (size_t i = 0; i < count && output_count < HEARD_MAX; i++) {
        output[output_count].when = now;
        output[output_count++].byte = bytes[i];
    }
}

bool dr_port_has_pace(void) { return has_pace; }
uint16_t dr_port_slots(void) { return slots; }
void dr_port_slot_read(uint16_t slot, uint8_t *bytes, size_t count) { memcpy(bytes, memory[slot], count); }

bool dr_port_slot_write(uint16_t slot, const uint8_t *bytes, size_t count)
{
    static size_t at;
    if (at == 0 && is_dead)
        return false;
    if (writes_left == 0) {
        if (!is_dead)
            memory[slot][at] = garbage;
        is_dead = true;
        at = 0;
        return false;
    }
    writes_left--;
    writes++;
    memory[slot][at] = (uint8_t)((worn_slots >> slot & 1) != 0 ? 0 : bytes[at]);
    at = at + 1 < count ? at + 1 : 0;
    return at == 0;
}

/* -- The host ------------------------------------------------------------------------------------------------------- */

static void run_us(dr_us span)
{
    end_of_test = now + span;
    while (dr_us_before(now, end_of_test) && !is_dead)
        dr_emulator_step();
    TEST_ASSERT_EQUAL(input_count, input_at);
    input_at = input_count = 0;
}

static void send_after(dr_us span, const void *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        input[input_count].when = now + span;
        input[input_count++].byte = ((const uint8_t *)bytes)[i];
    }
}

static void ask(const void *bytes, size_t count, dr_us span)
{
    output_count = 0;
    send_after(0, bytes, count);
    run_us(span);
}

static void heard(const void *bytes, size_t count)
{
    const uint8_t *expected = bytes;
    TEST_ASSERT_EQUAL(count, output_count);
    for (size_t i = 0; i < count; i++)
        TEST_ASSERT_EQUAL_HEX8(expected[i], output[i].byte);
}

static void switch_on(void)
{
    output_count = input_at = input_count = 0;
    is_dead = false;
    dr_emulator_begin();
}

void setUp(void)
{
    now = 12345;
    straps = 0;
    has_pace = false;
    line_room = 14;
    slots = SLOTS;
    writes_left = UINT32_MAX;
    writes = 0;
    garbage = 0;
    worn_slots = 0;
    memset(memory, 0xFF, sizeof memory);
}

void tearDown(void) {}

/* 1,000 um in steps of 0.09375 um is 10,667 = 0x29AB on each axis, then 30 degrees [T tables 4, 6]. */
static const uint8_t trio_at_1000_um[14] = {0xAB, 0x29, 0, 0, 0xAB, 0x29, 0, 0, 0xAB, 0x29, 0, 0, 30, 13};
static const uint8_t trio_at_0[14] = {[12] = 30, [13] = 13};
static const uint8_t to_0[13] = {'H'};

/* -- Power-on ------------------------------------------------------------------------------------------------------- */

static void a_trio_calibrates_at_power_on_and_then_answers(void)
{
    switch_on();
    TEST_ASSERT_EQUAL_UINT32(57600, line_baud);
    /* Home order to the beginning, 1 mm an axis at 5 mm/s one after the other, then out on all axes together. */
    ask("c", 1, 790000);
    TEST_ASSERT_EQUAL(0, output_count);
    run_us(20000);
    heard(trio_at_1000_um, 14);
}

static void straps_choose_the_controller_and_its_stages(void)
{
    static const uint8_t two[6] = {2, 1, 1, 0, 0, 13}, four[6] = {4, 1, 1, 1, 1, 13};
    straps = DR_STRAP_OTHER;
    switch_on();
    TEST_ASSERT_EQUAL_UINT32(128000, line_baud);
    ask("U", 1, 10000);
    heard(two, 6);
    straps = DR_STRAP_OTHER | DR_STRAP_STAGES;
    switch_on();
    ask("U", 1, 10000);
    heard(four, 6);
    straps = 2u << DR_STRAP_STAGES_SHIFT; /* MP-285: 8,000 steps of 0.125 um are 1,000 um */
    switch_on();
    run_us(DR_US_PER_S);
    ask("c", 1, 10000);
    static const uint8_t mp285[14] = {0x40, 0x1F, 0, 0, 0x40, 0x1F, 0, 0, 0x40, 0x1F, 0, 0, 30, 13};
    heard(mp285, 14);
}

/* -- The line's pace ------------------------------------------------------------------------------------------------ */

static void a_line_without_a_pace_gets_the_controllers(void)
{
    switch_on();
    run_us(DR_US_PER_S);
    const dr_us asked = now;
    ask("c", 1, 10000);
    heard(trio_at_1000_um, 14);
    for (uint32_t i = 0; i < 14; i++) { /* 10 bits at 57600 a second are 173.6 us */
        const uint32_t whole_us = (uint32_t)((i + 1) * 10 * 1000000ull / 57600);
        TEST_ASSERT_UINT32_WITHIN(4 + i, whole_us + 2, output[i].when - asked);
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32(whole_us, output[i].when - asked);
    }
}

static void two_replies_take_the_time_of_their_bytes(void)
{
    straps = DR_STRAP_OTHER;
    switch_on();
    const dr_us asked = now;
    ask("CC", 2, 10000);
    TEST_ASSERT_EQUAL(28, output_count);
    TEST_ASSERT_UINT32_WITHIN(40, 28 * 78125 / 1000, output[27].when - asked);
}

static void a_line_with_a_pace_gets_what_it_has_room_for(void)
{
    has_pace = true;
    switch_on();
    run_us(DR_US_PER_S);
    line_room = 3;
    ask("c", 1, 1000);
    heard(trio_at_1000_um, 14);
    line_room = 0;
    ask("c", 1, 1000);
    TEST_ASSERT_EQUAL(0, output_count);
    line_room = 14;
    run_us(1000);
    heard(trio_at_1000_um, 14);
}

static void a_stream_keeps_a_line_full_that_is_too_slow_for_it(void)
{
    straps = DR_STRAP_OTHER;
    switch_on();
    ask("O", 1, 10000);
    ask("S", 1, 40000);
    TEST_ASSERT_EQUAL(0, output_count);
    const dr_us began = now;
    ask("\x0F\x00\x10\x00\x00\x00\x00\x00\x00\x00\x00\x00\x00", 13, 300000); /* 256 um at 1300 um/s: 197 ms */
    const size_t frames = output_count / 12;
    TEST_ASSERT_EQUAL(frames * 12 + 1, output_count);
    TEST_ASSERT_GREATER_OR_EQUAL(208, frames); /* 197 ms hold 210 frames of 937.5 us */
    for (size_t k = 0; k < frames; k++) {
        TEST_ASSERT_EQUAL_HEX8(0xFF, output[12 * k].byte);
        /* In X: where it was at most a frame's time before its first byte left (16 steps a um, 1300 um/s). */
        const uint32_t x = output[12 * k + 3].byte | (uint32_t)output[12 * k + 4].byte << 8;
        const uint32_t crossed_us = (uint32_t)(x * 1000000ull / (16 * 1300));
        TEST_ASSERT_UINT32_WITHIN(938 / 2 + 500, crossed_us + 938 / 2, output[12 * k].when - began - 78);
    }
    TEST_ASSERT_EQUAL_HEX8(13, output[output_count - 1].byte);
    TEST_ASSERT_UINT32_WITHIN(938 + 160, 196924, output[output_count - 1].when - began);
}

/* -- Time ----------------------------------------------------------------------------------------------------------- */

static void the_hosts_pause_is_told(void)
{
    straps = DR_STRAP_OTHER;
    switch_on();
    ask("S", 1, 10000);
    ask("\x0F", 1, 10000);
    ask("\x00", 1, 10);
    TEST_ASSERT_UINT32_WITHIN(100, 20000, dr_emulator_controller()->pause_us);
}

static void an_idle_board_wakes_no_more_than_its_contract_says_and_a_month_changes_nothing(void)
{
    switch_on();
    run_us(3 * DR_US_PER_S);
    waits = 0;
    for (uint32_t minute = 0; minute < 30u * 24u * 60u; minute++)
        run_us(60 * DR_US_PER_S);
    TEST_ASSERT_EQUAL_UINT32(30u * 24u * 60u, waits);
    ask("c", 1, 10000);
    heard(trio_at_1000_um, 14);
    ask("S\x00\x00", 3, 10);
    TEST_ASSERT_UINT32_WITHIN(20, 0, dr_emulator_controller()->pause_us);
}

static void the_clock_may_wrap_at_any_moment_of_a_move(void)
{
    for (uint32_t before_us = 0; before_us < 820000; before_us += 1009) {
        now = 0u - before_us - 1000000u;
        switch_on();
        run_us(1000000);
        ask(to_0, 13, 590000); /* three axes one after the other, 200 ms each, and the CR */
        TEST_ASSERT_EQUAL(0, output_count);
        run_us(20000);
        heard("\r", 1);
        ask("c", 1, 10000);
        heard(trio_at_0, 14);
    }
}

/* -- What is kept --------------------------------------------------------------------------------------------------- */

static void positions_are_kept_where_switch_6_says_none(void)
{
    straps = DR_STRAP_KEEP;
    switch_on();
    ask(to_0, 13, DR_US_PER_S);
    heard("\r", 1);
    run_us(2 * DR_US_PER_S);
    switch_on();
    ask("c", 1, 10000);
    heard(trio_at_0, 14);
    straps = 0;
    switch_on(); /* calibrates again */
    run_us(DR_US_PER_S);
    ask("c", 1, 10000);
    heard(trio_at_1000_um, 14);
}

static void the_angle_is_kept(void)
{
    switch_on();
    run_us(DR_US_PER_S);
    ask("A\x2D", 2, 3 * DR_US_PER_S);
    switch_on();
    ask("c", 1, 2 * DR_US_PER_S);
    TEST_ASSERT_EQUAL(45, output[12].byte);
}

static void an_mpc_keeps_each_drives_position(void)
{
    static const uint8_t there[14] = {2, 0x10, 0, 0, 0, 0x20, 0, 0, 0, 0x30, 0, 0, 0, 13};
    straps = DR_STRAP_OTHER;
    switch_on();
    ask("I\x02", 2, 10000);
    ask("M\x10\0\0\0\x20\0\0\0\x30\0\0\0", 13, 3 * DR_US_PER_S);
    switch_on();
    ask("I\x02", 2, 10000);
    ask("C", 1, 10000);
    heard(there, 14);
}

static void the_record_of_another_set_of_stages_does_not_count(void)
{
    straps = DR_STRAP_KEEP;
    switch_on();
    ask(to_0, 13, 3 * DR_US_PER_S);
    straps = DR_STRAP_KEEP | 1u << DR_STRAP_STAGES_SHIFT;
    switch_on();
    ask("c", 1, 10000);
    heard(trio_at_1000_um, 14); /* MP-865: the same microstep */
}

static void nothing_is_written_while_nothing_changes_or_something_moves(void)
{
    switch_on();
    run_us(3 * DR_US_PER_S);
    writes = 0;
    ask("cccc\r\n\x22", 7, 10 * DR_US_PER_S);
    TEST_ASSERT_EQUAL_UINT32(0, writes);
    ask(to_0, 13, 1500000);
    TEST_ASSERT_EQUAL_UINT32(0, writes);
    run_us(200000); /* a second after it has come to rest */
    TEST_ASSERT_GREATER_THAN_UINT32(0, writes);
}

static void slots_are_written_in_turn_and_serial_numbers_wrap(void)
{
    straps = DR_STRAP_KEEP;
    switch_on();
    for (uint32_t i = 1; i <= 70000; i++) {
        uint8_t axis_to[5] = {'x', (uint8_t)i, (uint8_t)(i >> 8), (uint8_t)(i >> 16), 0};
        ask(axis_to, 5, 8 * DR_US_PER_S);
        if (i % 1000 == 0 || i > 65530) {
            switch_on();
            ask("c", 1, 10000);
            TEST_ASSERT_EQUAL_HEX8_MESSAGE(axis_to[1], output[0].byte, "not the newest");
            TEST_ASSERT_EQUAL_HEX8(axis_to[2], output[1].byte);
            TEST_ASSERT_EQUAL_HEX8(axis_to[3], output[2].byte);
        }
    }
    for (uint16_t slot = 0; slot < SLOTS; slot++)
        TEST_ASSERT_EQUAL_HEX8(1, memory[slot][0]);
}

/* The power is cut at every byte of a record's writing, and the byte itself may become anything. */
static void a_power_cut_leaves_the_old_record_or_the_new_one(void)
{
    static const uint8_t garbages[] = {0x00, 0xFF, 0x55, 0x01};
    for (size_t g = 0; g < sizeof garbages; g++)
        for (uint32_t start = 0; start < SLOTS + 2; start++) { /* the record that is cut goes to each slot once */
            memset(memory, 0xFF, sizeof memory);
            straps = DR_STRAP_KEEP;
            writes_left = UINT32_MAX;
            switch_on();
            for (uint8_t i = 1; i <= start; i++) {
                const uint8_t x_to[5] = {'x', i};
                ask(x_to, 5, 4 * DR_US_PER_S);
            }
            uint8_t before[SLOTS][DR_PORT_SLOT_BYTES];
            memcpy(before, memory, sizeof memory);
            bool was_new = false;
            uint32_t cut = 0;
            for (; !was_new && cut < 200; cut++) {
                memcpy(memory, before, sizeof memory);
                garbage = garbages[g];
                writes_left = UINT32_MAX;
                switch_on();
                writes_left = cut;
                ask("x\xEE\0\0\0", 5, 4 * DR_US_PER_S);
                heard("\r", 1);
                writes_left = UINT32_MAX;
                switch_on();
                ask("c", 1, 10000);
                TEST_ASSERT_EQUAL(14, output_count);
                was_new = output[0].byte == 0xEE;
                if (!was_new)
                    TEST_ASSERT_EQUAL_HEX8(start > 0 ? start : 0xAB, output[0].byte);
            }
            TEST_ASSERT_TRUE_MESSAGE(was_new, "the new record never came");
            TEST_ASSERT_GREATER_THAN_UINT32(30, cut);
        }
}

static void a_worn_out_slot_is_passed_over_and_a_dead_memory_is_left_alone(void)
{
    straps = DR_STRAP_KEEP;
    worn_slots = 1u << 0 | 1u << 2;
    for (uint8_t i = 1; i < 20; i++) {
        const uint8_t x_to[5] = {'x', i};
        switch_on();
        ask(x_to, 5, 4 * DR_US_PER_S);
        switch_on();
        ask("c", 1, 10000);
        TEST_ASSERT_EQUAL_HEX8(i, output[0].byte);
    }
    worn_slots = (1u << SLOTS) - 1u;
    writes = 0;
    ask("x\xEE\0\0\0", 5, 9 * DR_US_PER_S);
    TEST_ASSERT_GREATER_THAN_UINT32(0, writes);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(SLOTS * DR_PORT_SLOT_BYTES, writes);
}

static void a_board_without_memory_works_all_the_same(void)
{
    slots = 0;
    switch_on();
    run_us(3 * DR_US_PER_S);
    ask("c", 1, 10000);
    heard(trio_at_1000_um, 14);
    TEST_ASSERT_EQUAL_UINT32(0, writes);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_trio_calibrates_at_power_on_and_then_answers);
    RUN_TEST(straps_choose_the_controller_and_its_stages);
    RUN_TEST(a_line_without_a_pace_gets_the_controllers);
    RUN_TEST(two_replies_take_the_time_of_their_bytes);
    RUN_TEST(a_line_with_a_pace_gets_what_it_has_room_for);
    RUN_TEST(a_stream_keeps_a_line_full_that_is_too_slow_for_it);
    RUN_TEST(the_hosts_pause_is_told);
    RUN_TEST(an_idle_board_wakes_no_more_than_its_contract_says_and_a_month_changes_nothing);
    RUN_TEST(the_clock_may_wrap_at_any_moment_of_a_move);
    RUN_TEST(positions_are_kept_where_switch_6_says_none);
    RUN_TEST(the_angle_is_kept);
    RUN_TEST(an_mpc_keeps_each_drives_position);
    RUN_TEST(the_record_of_another_set_of_stages_does_not_count);
    RUN_TEST(nothing_is_written_while_nothing_changes_or_something_moves);
    RUN_TEST(slots_are_written_in_turn_and_serial_numbers_wrap);
    RUN_TEST(a_power_cut_leaves_the_old_record_or_the_new_one);
    RUN_TEST(a_worn_out_slot_is_passed_over_and_a_dead_memory_is_left_alone);
    RUN_TEST(a_board_without_memory_works_all_the_same);
    return UNITY_END();
}
