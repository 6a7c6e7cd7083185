/* The loop of the bridge on a board of this test's own: virtual time, an emulated controller on one line, the test on the
 * others. What simulators of chips cannot show easily: a clock that stands still, a stack that overflows, lost bytes, a relay. */
#include "bridge_port.h"

#include "dr_controller.h"
#include "dr_guard.h"

#include "unity.h"

#include <string.h>

#define ROUND_US 100u
#define RELAY 4u
#define BUZZER 1u
#define LAMP 2u
enum { STOPS = 3, KEY = 4, ARM = 8, CONFIRM = 1 << 8, HOST = 1 << 9, AT_REST = STOPS | KEY | HOST };

/* -- The board ------------------------------------------------------------------------------------------------------ */

typedef struct {
    uint8_t bytes[65536];
    size_t at, count;
    uint32_t baud;
    bool lost;
} wire;

static dr_us now = UINT32_MAX - 5000000u; /* it wraps in the first test */
static bool clock_stands;
static uint16_t inputs;
static uint8_t outputs;
static uint32_t waves; /* changes of the relay's output */
static wire from_host, to_host, log_out, to_device;
static dr_controller controller;
static dr_drive drives[DR_PORTS];
static uint8_t configurations[DR_PORT_CONFIGURATIONS][DR_LIMITS_IMAGE_BYTES];
static dr_survivor survivor;
static bool watchdog_runs, stack_holds, device_sends;
static size_t device_room; /* bytes that its line takes, in all */
static uint32_t fed;

uint8_t dr_port_begin(void) { return 0; }
dr_us dr_port_now_us(void) { return now; }
uint16_t dr_port_inputs(void) { return inputs; }

void dr_port_outputs(uint8_t high)
{
    waves += ((high ^ outputs) & RELAY) != 0;
    outputs = high;
}

static wire *wire_of(dr_line line)
{
    return line == DR_LINE_HOST ? &to_host : line == DR_LINE_DEVICE ? &to_device : &log_out;
}

void dr_port_line_open(dr_line line, uint32_t baud) { wire_of(line)->baud = baud; }

size_t dr_port_line_read(dr_line line, uint8_t *bytes, size_t room, bool *lost)
{
    size_t count = 0;
    if (line == DR_LINE_DEVICE)
        return dr_controller_pull(&controller, now, bytes, room);
    if (from_host.lost)
        *lost = true;
    from_host.lost = false;
    while (count < room && from_host.at < from_host.count)
        bytes[count++] = from_host.bytes[from_host.at++];
    return count;
}

size_t dr_port_line_room(dr_line line) { return line == DR_LINE_DEVICE ? device_room : 16; }

void dr_port_line_write(dr_line line, const uint8_t *bytes, size_t count)
{
    wire *const w = wire_of(line);
    TEST_ASSERT_NOT_EQUAL_MESSAGE(0, w->baud, "a line that was not opened");
    TEST_ASSERT_LESS_OR_EQUAL(sizeof w->bytes - w->count, count);
    memcpy(w->bytes + w->count, bytes, count);
    w->count += count;
    if (line == DR_LINE_DEVICE) {
        device_room -= count;
        (void)dr_controller_push(&controller, now, bytes, count);
    }
}

bool dr_port_line_is_sent(dr_line line) { return line != DR_LINE_DEVICE || !device_sends; }

bool dr_port_host_is_open(void) { return (inputs & HOST) != 0; }

void dr_port_configuration(uint8_t which, uint8_t *image, size_t size)
{
    TEST_ASSERT_EQUAL(DR_LIMITS_IMAGE_BYTES, size);
    memcpy(image, configurations[which], size);
}

volatile dr_survivor *dr_port_survivor(void) { return &survivor; }
void dr_port_watchdog_start(void) { watchdog_runs = true; }
void dr_port_watchdog_feed(void) { fed += watchdog_runs; }
bool dr_port_stack_holds(void) { return stack_holds; }

/* -- What tests do -------------------------------------------------------------------------------------------------- */

static void run(dr_us time_us)
{
    for (dr_us end = now + time_us; dr_us_before(now, end) || clock_stands;) {
        dr_bridge_step();
        if (clock_stands)
            return;
        now += ROUND_US;
    }
}

static void press(uint16_t input)
{
    inputs |= input;
    run(100000);
    inputs &= (uint16_t)~input;
    run(100000);
}

static void say(const void *bytes, size_t count)
{
    memcpy(from_host.bytes + from_host.count, bytes, count);
    from_host.count += count;
}

static void say_line(uint8_t level, uint32_t x)
{
    const uint8_t frame[] = {'S',  level, (uint8_t)x, (uint8_t)(x >> 8), (uint8_t)(x >> 16), 0, 0x20, 0x4E, 0, 0, 0x20,
                             0x4E, 0,     0};
    say(frame, sizeof frame);
}

static uint32_t x_of_tip(void)
{
    uint32_t steps[DR_AXES];
    dr_controller_position(&controller, 0, now, steps);
    return steps[DR_X];
}

static dr_limits limits_of(uint32_t revision)
{
    dr_limits limits;
    dr_limits_init(&limits, DR_TRIO);
    TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, 0, DR_STAGE_TRIO_MP845));
    limits.revision = revision;
    limits.drives[0].max_move_q = UINT32_C(64) * 5000u;
    return limits;
}

static void store(uint8_t which, const dr_limits *limits) { dr_limits_put(limits, configurations[which]); }

static void start(void)
{
    from_host.at = from_host.count = to_host.count = log_out.count = to_device.count = 0;
    to_host.baud = to_device.baud = log_out.baud = 0;
    watchdog_runs = false;
    dr_bridge_begin();
}

static void start_armed(void)
{
    start();
    run(1200000);
    press(ARM);
    to_device.count = 0;
}

/* The revision that the log's first record tells; 0 without limits. */
static uint32_t told_revision(void)
{
    uint32_t value = 0;
    TEST_ASSERT_GREATER_OR_EQUAL(98, log_out.count);
    TEST_ASSERT_EQUAL_CHAR('#', log_out.bytes[0]);
    for (size_t i = 0; i < 8; i++) {
        const uint8_t digit = log_out.bytes[1 + 2 * 36 + (i ^ 1u)]; /* least significant byte first */
        value |= (uint32_t)(digit <= '9' ? digit - '0' : digit - 'a' + 10) << (4u * i);
    }
    return value;
}

void setUp(void)
{
    const dr_limits limits = limits_of(7);
    const dr_hand power_on = {.what = DR_HAND_POWER_ON};
    now += 12345u;
    for (uint8_t i = 0; i < DR_PORTS; i++)
        dr_drive_init(&drives[i], DR_STAGE_TRIO_MP845);
    dr_controller_init(&controller, DR_TRIO, drives, 1);
    controller.calibrates_at_power_on = false;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        drives[0].position_steps[axis] = 20000;
    (void)dr_controller_poke(&controller, now, &power_on);
    memset(configurations, 0xFF, sizeof configurations);
    store(0, &limits);
    memset(&survivor, 0x5A, sizeof survivor);
    inputs = AT_REST;
    stack_holds = true;
    clock_stands = device_sends = from_host.lost = false;
    device_room = SIZE_MAX;
    outputs = 0;
    fed = waves = 0;
}

void tearDown(void) {}

/* -- Configurations --------------------------------------------------------------------------------------------------- */

static void the_newer_one_counts_wherever_it_is(void)
{
    const dr_limits older = limits_of(7), newer = limits_of(8);
    store(1, &newer);
    start();
    run(50000);
    TEST_ASSERT_EQUAL(8, told_revision());
    store(0, &newer);
    store(1, &older);
    start();
    run(50000);
    TEST_ASSERT_EQUAL(8, told_revision());
}

static void a_damaged_one_makes_arming_wait_for_confirm(void)
{
    const dr_limits newer = limits_of(8);
    store(1, &newer);
    configurations[1][77] ^= 0x40;
    start_armed();
    TEST_ASSERT_EQUAL(7, told_revision());
    say_line(15, 20100);
    run(100000);
    TEST_ASSERT_EQUAL(20000, x_of_tip());
    press(CONFIRM);
    press(ARM);
    say_line(15, 20100);
    run(100000);
    TEST_ASSERT_EQUAL(20100, x_of_tip());
}

/* Every truncation and a bit of every byte: nothing leaves. The device's line is not even opened: its rate is not known. */
static void without_a_whole_one_nothing_leaves(void)
{
    for (size_t at = 0; at < DR_LIMITS_IMAGE_BYTES; at += 17) {
        const dr_limits limits = limits_of(7);
        store(0, &limits);
        if (at % 2 == 0)
            configurations[0][at] ^= 1;
        else
            memset(configurations[0] + at, 0xFF, DR_LIMITS_IMAGE_BYTES - at);
        start_armed();
        say("c\x03", 2);
        say_line(15, 20100);
        run(200000);
        TEST_ASSERT_EQUAL(0, told_revision());
        TEST_ASSERT_EQUAL(0, to_device.baud);
        TEST_ASSERT_EQUAL(0, to_host.count);
        TEST_ASSERT_EQUAL(0, outputs & RELAY);
    }
}

static void memory_that_was_never_written_is_no_damage(void)
{
    const dr_limits limits = limits_of(7);
    for (unsigned filler = 0; filler < 256; filler += 255) {
        memset(configurations, (int)filler, sizeof configurations);
        store(1, &limits);
        start_armed();
        say_line(15, 20100);
        run(100000);
        TEST_ASSERT_EQUAL(20100, x_of_tip());
        say_line(15, 20000);
        run(100000);
    }
}

/* -- The watchdog ----------------------------------------------------------------------------------------------------- */

static void it_is_fed_while_all_is_well(void)
{
    start_armed();
    fed = 0;
    run(1000000);
    TEST_ASSERT_GREATER_OR_EQUAL(1000000 / ROUND_US - 51, fed); /* a round that looks at the guard does nothing else */
}

static void a_clock_that_stands_or_jumps_does_not_feed_it(void)
{
    start_armed();
    fed = 0;
    clock_stands = true;
    run(1); /* the clock went on before these */
    run(1);
    fed = 0;
    for (int i = 0; i < 100; i++)
        run(1);
    TEST_ASSERT_EQUAL(0, fed);
    clock_stands = false;
    now += 150000;
    run(1000000);
    TEST_ASSERT_EQUAL(0, fed);
    start();
    now -= 1000000;
    run(1000000);
    TEST_ASSERT_EQUAL(0, fed);
}

static void a_stack_that_grew_too_far_does_not_feed_it(void)
{
    start_armed();
    stack_holds = false;
    fed = 0;
    run(100000);
    TEST_ASSERT_EQUAL(0, fed);
}

/* -- Resets ----------------------------------------------------------------------------------------------------------- */

static void a_reset_sends_an_interrupt_first_and_power_on_does_not(void)
{
    start();
    run(1500000);
    TEST_ASSERT_EQUAL('c', to_device.bytes[0]);
    start();
    TEST_ASSERT_EQUAL(1, to_device.count);
    TEST_ASSERT_EQUAL(DR_INTERRUPT, to_device.bytes[0]);
    run(1500000);
    TEST_ASSERT_EQUAL('c', to_device.bytes[1]);
}

/* Also while the last byte is still on the wire. */
static void a_reset_at_any_byte_of_a_frame_is_remembered(void)
{
    for (size_t left = 1; left <= 14; left++) {
        setUp();
        start_armed();
        say_line(0, 24000);
        device_sends = true;
        device_room = 1 + left; /* its own query, and so much of the frame */
        run(100000);
        TEST_ASSERT_EQUAL(1 + left, to_device.count);
        TEST_ASSERT_TRUE(survivor.mid_frame);
        device_room = SIZE_MAX;
        start();
        say("c\x03", 2);
        run(2000000);
        TEST_ASSERT_EQUAL(0, to_device.count);
        device_sends = false;
        press(CONFIRM);
        run(1500000);
        TEST_ASSERT_EQUAL('c', to_device.bytes[0]);
    }
}

static void a_frame_that_has_left_is_forgotten(void)
{
    start_armed();
    say_line(0, 24000);
    run(100000);
    TEST_ASSERT_NOT_EQUAL(20000, x_of_tip());
    TEST_ASSERT_FALSE(survivor.mid_frame);
    start();
    TEST_ASSERT_EQUAL(1, to_device.count); /* ^C: it is not within a frame */
    run(1500000);
    const uint32_t stopped = x_of_tip();
    TEST_ASSERT_LESS_THAN(24000, stopped);
}

/* -- People and lines --------------------------------------------------------------------------------------------------- */

static void what_is_held_at_the_start_is_no_press(void)
{
    inputs |= ARM | CONFIRM;
    survivor.alive = 0;
    start();
    survivor.mid_frame = true;
    start();
    run(1500000);
    TEST_ASSERT_EQUAL(0, to_device.count); /* torn: CONFIRM would let it go on */
    inputs &= (uint16_t)~CONFIRM;
    run(100000);
    inputs |= CONFIRM;
    run(1500000);
    TEST_ASSERT_EQUAL('c', to_device.bytes[0]);
}

static void a_lost_byte_drops_the_frame(void)
{
    start_armed();
    say("S\x0f\x84\x4e\0\0\x20", 7);
    run(5000);
    from_host.lost = true;
    say("\x4e\0\0\x20\x4e\0\0", 7);
    run(100000);
    TEST_ASSERT_EQUAL(20000, x_of_tip());
    say_line(15, 20100);
    run(100000);
    TEST_ASSERT_EQUAL(20100, x_of_tip());
}

static void the_relay_swings_until_the_power_is_cut(void)
{
    dr_limits limits = limits_of(7);
    limits.rig = DR_RIG_HAS_CUT;
    store(0, &limits);
    start_armed();
    waves = 0;
    run(100000);
    TEST_ASSERT_EQUAL(100000 / ROUND_US, waves);
    const uint8_t move[] = {'x', 0x30, 0x75, 0, 0}; /* 937.5 um: ^C does not stop it */
    say(move, sizeof move);
    run(50000);
    TEST_ASSERT_NOT_EQUAL(20000, x_of_tip());
    inputs &= (uint16_t)~STOPS;
    run(50000);
    TEST_ASSERT_EQUAL(BUZZER, outputs & BUZZER);
    waves = 0;
    run(50000);
    TEST_ASSERT_EQUAL(0, waves);
    TEST_ASSERT_EQUAL(0, outputs & RELAY);
}

static void a_controller_that_moves_when_it_gets_power_gets_it_after_confirm(void)
{
    dr_limits limits = limits_of(7);
    limits.rig = DR_RIG_HAS_CUT | DR_RIG_CALIBRATES_AT_POWER_ON;
    store(0, &limits);
    start();
    run(200000);
    TEST_ASSERT_EQUAL(0, waves);
    press(CONFIRM);
    TEST_ASSERT_GREATER_THAN(0, waves);
}

static void the_lamp_is_lit_when_armed_and_counts_faults(void)
{
    uint32_t flashes = 0;
    start_armed();
    run(131072);
    const uint8_t before = outputs;
    run(131072); /* there are no obstacles, which somebody must confirm: it flickers */
    TEST_ASSERT_NOT_EQUAL(before & LAMP, outputs & LAMP);
    press(CONFIRM);
    for (dr_us end = now + 3000000; dr_us_before(now, end); run(ROUND_US))
        TEST_ASSERT_EQUAL(LAMP, outputs & LAMP);
    memset(configurations, 0xFF, sizeof configurations);
    start();
    run(2000000);
    uint8_t was = outputs;
    for (dr_us end = now + 6 * 1310720; dr_us_before(now, end); was = outputs) {
        run(ROUND_US);
        flashes += ((was ^ outputs) & outputs & LAMP) != 0;
    }
    TEST_ASSERT_EQUAL(6, flashes); /* fault 1, no limits: once in 1.3 s */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_newer_one_counts_wherever_it_is);
    RUN_TEST(a_damaged_one_makes_arming_wait_for_confirm);
    RUN_TEST(without_a_whole_one_nothing_leaves);
    RUN_TEST(memory_that_was_never_written_is_no_damage);
    RUN_TEST(it_is_fed_while_all_is_well);
    RUN_TEST(a_clock_that_stands_or_jumps_does_not_feed_it);
    RUN_TEST(a_stack_that_grew_too_far_does_not_feed_it);
    RUN_TEST(a_reset_sends_an_interrupt_first_and_power_on_does_not);
    RUN_TEST(a_reset_at_any_byte_of_a_frame_is_remembered);
    RUN_TEST(a_frame_that_has_left_is_forgotten);
    RUN_TEST(what_is_held_at_the_start_is_no_press);
    RUN_TEST(a_lost_byte_drops_the_frame);
    RUN_TEST(the_relay_swings_until_the_power_is_cut);
    RUN_TEST(a_controller_that_moves_when_it_gets_power_gets_it_after_confirm);
    RUN_TEST(the_lamp_is_lit_when_armed_and_counts_faults);
    return UNITY_END();
}
