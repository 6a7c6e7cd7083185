/* The loop of a board with buttons, on a board of this test's own, whose clock is virtual and which sleeps whenever it may: that
 * the panel's times are kept although the board looks at its inputs only now and then. What each input does is asked of the
 * images (test_avr_hands.py). */
#include "emulator.h"
#include "hands.h"
#include "port.h"

#include "dr_guard.h" /* no name is in it and in hands.h */

#include "unity.h"

#include <string.h>

static dr_us now, end;
static uint16_t closed;
static uint8_t outputs, straps;
static uint8_t sent[64], said[256];
static size_t sent_count, said_count;
static dr_us sent_at;
static uint32_t waits, oversleep_us;
static uint8_t memory[4][DR_PORT_SLOT_BYTES];

uint8_t dr_port_begin(void) { return straps; }
void dr_port_open(uint32_t baud) { (void)baud; }
dr_us dr_port_now_us(void) { return now; }
bool dr_port_waits(void) { return true; }

void dr_port_wait(bool has_end, dr_us until)
{
    waits++;
    dr_us to = has_end && dr_us_before(until, end) ? until : end;
    to += oversleep_us;
    now = dr_us_before(now, to) ? to : now + 1u; /* a step takes its time */
}

size_t dr_port_read(uint8_t *bytes, size_t room)
{
    const size_t has_come = dr_us_before(now, sent_at) ? 0 : sent_count;
    const size_t count = has_come < room ? has_come : room;
    memcpy(bytes, sent, count);
    memmove(sent, sent + count, sent_count - count);
    sent_count -= count;
    return count;
}

size_t dr_port_room(void) { return DR_REPLY_MAX; }

void dr_port_write(const uint8_t *bytes, size_t count)
{
    TEST_ASSERT_LESS_OR_EQUAL(sizeof said - said_count, count);
    memcpy(said + said_count, bytes, count);
    said_count += count;
}

bool dr_port_has_pace(void) { return false; }
uint16_t dr_port_inputs(void) { return closed; }
void dr_port_outputs(uint8_t high) { outputs = high; }
uint16_t dr_port_slots(void) { return 4; }
void dr_port_slot_read(uint16_t slot, uint8_t *bytes, size_t count) { memcpy(bytes, memory[slot], count); }

bool dr_port_slot_write(uint16_t slot, const uint8_t *bytes, size_t count)
{
    memcpy(memory[slot], bytes, count);
    return true;
}

/* -- The person and the host ---------------------------------------------------------------------------------------- */

#define MS 1000u
#define BOUNCE_MS 8u /* as long as it takes until a button counts as closed or open */

static void run_ms(uint32_t span_ms)
{
    end = now + span_ms * MS;
    while (dr_us_before(now, end))
        dr_hands_step();
}

static void hold_ms(unsigned input, uint32_t span_ms)
{
    closed |= (uint16_t)(1u << input);
    run_ms(span_ms);
    closed &= (uint16_t) ~(1u << input);
    run_ms(BOUNCE_MS + 2u);
}

static void turn(unsigned input, int detents)
{
    for (int i = 0; i < (detents > 0 ? detents : -detents); i++)
        for (unsigned quarter = 0; quarter < 4; quarter++) {
            closed ^= (uint16_t)(1u << (input + ((quarter % 2u != 0) == (detents > 0) ? 1u : 0u)));
            run_ms(3);
        }
}

static const dr_controller *controller(void) { return dr_emulator_controller(); }
static const uint32_t *at(void) { return controller()->drives[controller()->active].position_steps; }

/* DR_STRAP_OTHER: the other controller than a TRIO. */
static void switch_on(uint8_t with_straps)
{
    straps = with_straps;
    sent_at = now;
    said_count = sent_count = 0;
    dr_hands_begin();
    run_ms(1000); /* a TRIO has calibrated */
}

void setUp(void)
{
    now = 99;
    closed = 0;
    outputs = 0;
    oversleep_us = 0;
    memset(memory, 0xFF, sizeof memory);
}

void tearDown(void) {}

static void test_a_hold_of_3_s_is_a_press_before_and_stores_after(void)
{
    switch_on(0);
    hold_ms(DR_HANDS_WORK, 2998);
    TEST_ASSERT_FALSE(controller()->drives[0].work_is_set);
    TEST_ASSERT_EQUAL(0, dr_hands_panel()->beeps);
    hold_ms(DR_HANDS_WORK, 3003 + BOUNCE_MS);
    TEST_ASSERT_TRUE(controller()->drives[0].work_is_set);
    TEST_ASSERT_EQUAL(1, dr_hands_panel()->beeps);
}

/* The board sleeps through the end of the hold, and a host's command arrives: what was due first happens first. */
static void test_who_sleeps_too_long_still_does_things_in_order(void)
{
    switch_on(0);
    closed = 1u << DR_HANDS_WORK;
    run_ms(3000);
    TEST_ASSERT_FALSE(controller()->drives[0].work_is_set);
    oversleep_us = 50u * MS;
    memcpy(sent, "x\0\0\0\0", sent_count = 5);
    sent_at = now + 20u * MS;
    run_ms(40);
    oversleep_us = 0;
    closed = 0;
    run_ms(400);
    TEST_ASSERT_EQUAL_STRING_LEN("\r", said, 1);
    TEST_ASSERT_EQUAL(0, at()[DR_X]);
    TEST_ASSERT_TRUE(controller()->drives[0].work_is_set);
    TEST_ASSERT_EQUAL(10667, controller()->drives[0].work_steps[DR_X]);
}

static void test_each_button_is_the_panels(void)
{
    switch_on(0);
    hold_ms(DR_HANDS_SPEED, 50);
    TEST_ASSERT_EQUAL(1, dr_hands_panel()->speed);
    hold_ms(DR_HANDS_RELATIVE, 50);
    TEST_ASSERT_TRUE(dr_hands_panel()->is_relative);
    hold_ms(DR_HANDS_PULSE, 50);
    TEST_ASSERT_EQUAL(10667 + 26, at()[DR_X]);
    hold_ms(DR_HANDS_PULSE, 3020);
    TEST_ASSERT_TRUE(dr_hands_panel()->is_setting_angle);
    turn(DR_HANDS_KNOB_D, 7);
    TEST_ASSERT_EQUAL(37, controller()->angle_deg);
    hold_ms(DR_HANDS_HOME, 50);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, controller()->state);
    hold_ms(DR_HANDS_HOME, 50);
    TEST_ASSERT_EQUAL(DR_STATE_PAUSED, controller()->state);
    hold_ms(DR_HANDS_MAINS, 50);
    TEST_ASSERT_EQUAL(DR_STATE_OFF, controller()->state);
    hold_ms(DR_HANDS_MAINS, 50);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, controller()->state); /* it calibrates */
}

static void test_each_button_of_an_mpc_is_the_panels(void)
{
    switch_on(DR_STRAP_OTHER);
    hold_ms(DR_HANDS_DIAGONAL, 50);
    TEST_ASSERT_TRUE(dr_hands_panel()->drives[0].is_diagonal);
    TEST_ASSERT_EQUAL(2, outputs); /* its LED */
    hold_ms(DR_HANDS_CALIBRATE, 10);
    TEST_ASSERT_EQUAL(DR_OP_MPC_CALIBRATE, controller()->move_op);
    hold_ms(DR_HANDS_STOP, 50);
    TEST_ASSERT_EQUAL(DR_STATE_REST, controller()->state);
    hold_ms(DR_HANDS_MANIPULATOR, 50);
    TEST_ASSERT_EQUAL(1, controller()->active);
    turn(DR_HANDS_KNOB_MANIPULATOR, -1);
    TEST_ASSERT_EQUAL(0, controller()->active);
    turn(DR_HANDS_KNOB_MODE, 9);
    TEST_ASSERT_EQUAL(9, controller()->drives[0].mode);
    hold_ms(DR_HANDS_WORK, 2020);
    TEST_ASSERT_TRUE(dr_hands_panel()->drives[0].is_locked);
}

static void test_manipulator_as_a_button_goes_up(void)
{
    switch_on(DR_STRAP_OTHER | DR_STRAP_STAGES); /* four devices */
    for (unsigned i = 1; i <= 4; i++) {
        hold_ms(DR_HANDS_MANIPULATOR, 50);
        TEST_ASSERT_EQUAL(i % 4u, controller()->active);
    }
}

static void test_knobs_move_their_axes(void)
{
    switch_on(DR_STRAP_OTHER);
    turn(DR_HANDS_KNOB_MODE, 9);
    turn(DR_HANDS_KNOB_X, 5);
    turn(DR_HANDS_KNOB_Y, 4);
    turn(DR_HANDS_KNOB_Z, 3);
    turn(DR_HANDS_KNOB_X, -2);
    static const uint32_t there[DR_AXES] = {3, 4, 3};
    TEST_ASSERT_EQUAL_UINT32_ARRAY(there, at(), DR_AXES);
}

static void test_what_is_pressed_when_the_power_comes_is_not_pressed(void)
{
    closed = 1u << DR_HANDS_CALIBRATE | 1u << DR_HANDS_KNOB_X;
    straps = DR_STRAP_OTHER;
    dr_hands_begin();
    run_ms(3 * BOUNCE_MS);
    TEST_ASSERT_EQUAL(DR_STATE_REST, controller()->state);
    TEST_ASSERT_EQUAL(0, at()[DR_X]);
    closed = 0;
    run_ms(20);
    hold_ms(DR_HANDS_CALIBRATE, 10);
    TEST_ASSERT_EQUAL(DR_OP_MPC_CALIBRATE, controller()->move_op);
}

static void test_the_buzzer_sounds_for_a_tenth_of_a_second(void)
{
    switch_on(0);
    closed = 1u << DR_HANDS_HOME;
    run_ms(BOUNCE_MS + 2990);
    TEST_ASSERT_EQUAL(0, outputs & 1);
    run_ms(15);
    TEST_ASSERT_EQUAL(1, outputs & 1);
    run_ms(90);
    TEST_ASSERT_EQUAL(1, outputs & 1);
    run_ms(10);
    TEST_ASSERT_EQUAL(0, outputs & 1);
}

static void test_the_lamp_is_the_screens_red(void)
{
    switch_on(0);
    TEST_ASSERT_EQUAL(0, outputs);
    hold_ms(DR_HANDS_HOME, 20);
    TEST_ASSERT_EQUAL(2, outputs);
    run_ms(700);
    TEST_ASSERT_EQUAL(0, outputs);
    hold_ms(DR_HANDS_SPEED, 3020); /* LOCK */
    run_ms(200);
    TEST_ASSERT_EQUAL(2, outputs);
    hold_ms(DR_HANDS_MAINS, 20);
    TEST_ASSERT_EQUAL(0, outputs);
}

static void test_what_hands_did_is_kept_without_power(void)
{
    switch_on(DR_STRAP_OTHER);
    turn(DR_HANDS_KNOB_X, 3);
    hold_ms(DR_HANDS_STOP, 0);
    closed = 1u << DR_HANDS_STOP;
    run_ms(20);
    hold_ms(DR_HANDS_WORK, 20);
    closed = 0;
    run_ms(1100);
    const uint32_t was = at()[DR_X];
    switch_on(DR_STRAP_OTHER);
    TEST_ASSERT_EQUAL(was, at()[DR_X]);
    TEST_ASSERT_GREATER_THAN(0, was);
    TEST_ASSERT_TRUE(controller()->drives[0].work_is_set);
}

static void test_it_sleeps_between_two_looks(void)
{
    switch_on(DR_STRAP_OTHER);
    waits = 0;
    run_ms(1000);
    TEST_ASSERT_LESS_OR_EQUAL(1010, waits);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_hold_of_3_s_is_a_press_before_and_stores_after);
    RUN_TEST(test_who_sleeps_too_long_still_does_things_in_order);
    RUN_TEST(test_each_button_is_the_panels);
    RUN_TEST(test_each_button_of_an_mpc_is_the_panels);
    RUN_TEST(test_manipulator_as_a_button_goes_up);
    RUN_TEST(test_knobs_move_their_axes);
    RUN_TEST(test_what_is_pressed_when_the_power_comes_is_not_pressed);
    RUN_TEST(test_the_buzzer_sounds_for_a_tenth_of_a_second);
    RUN_TEST(test_the_lamp_is_the_screens_red);
    RUN_TEST(test_what_hands_did_is_kept_without_power);
    RUN_TEST(test_it_sleeps_between_two_looks);
    return UNITY_END();
}
