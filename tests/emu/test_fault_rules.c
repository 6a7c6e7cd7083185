/* faults: what each does, in virtual time and without a line's pace. An MP-225 on an MPC-200 runs at 3,000 um/s and has 16
 * microsteps a um: 48,000 steps take one second [M tables 8 and 10]. */
#include "instrument.h"

#include "unity.h"

#include <string.h>

#define S DR_US_PER_S
#define MS UINT64_C(1000)
#define SECOND_STEPS 48000u /* an axis' way in one second */
#define SENT_MAX 100000u

static instrument ins;
static dr_drive drives[DR_PORTS];
static uint8_t sent[SENT_MAX]; /* since somebody looked */
static uint64_t sent_us[SENT_MAX];
static size_t sent_count;
static dr_note ring[64];
static dr_notes notes;

static void switch_on(dr_kind kind, uint64_t seed)
{
    memset(&ins, 0, sizeof ins);
    for (unsigned i = 0; i < DR_PORTS; i++)
        dr_drive_init(&drives[i], i > 0 ? DR_STAGE_NONE : kind == DR_TRIO ? DR_STAGE_TRIO_MP845 : DR_STAGE_MPC_MP225);
    dr_controller_init(&ins.controller, kind, drives, kind == DR_TRIO ? 1 : DR_PORTS);
    faults_init(&ins.faults, seed);
    instrument_start(&ins, 1000);
    dr_notes_init(&notes, ring, 64);
    sent_count = 0;
}

void setUp(void) { switch_on(DR_MPC, 1); }
void tearDown(void) {}

static void run_to(uint64_t until_us)
{
    uint8_t bytes[64];
    size_t count;
    while (instrument_run(&ins, until_us, bytes, sizeof bytes, &count)) {
        ins.faults.struck = 0;
        notes.count = 0;
        for (size_t i = 0; i < count && sent_count < SENT_MAX; i++) {
            sent_us[sent_count] = ins.now_us;
            sent[sent_count++] = bytes[i];
        }
    }
    TEST_ASSERT_EQUAL_UINT64(until_us, ins.now_us);
}

static void run(uint64_t span_us) { run_to(ins.now_us + span_us); }

/* Until nothing is due. */
static void run_out(void)
{
    uint64_t when_us;
    for (unsigned i = 0; i < SENT_MAX && instrument_due(&ins, &when_us); i++)
        run_to(when_us);
    TEST_ASSERT_FALSE(instrument_due(&ins, &when_us));
}

static void say(const void *bytes, size_t count)
{
    TEST_ASSERT_EQUAL(count, instrument_take(&ins, 50000, bytes, count));
    run(0);
}

static void say_move(char code, uint32_t x, uint32_t y, uint32_t z)
{
    const uint32_t point[DR_AXES] = {x, y, z};
    uint8_t frame[13] = {(uint8_t)code};
    for (unsigned i = 0; i < 12; i++)
        frame[1 + i] = (uint8_t)(point[i / 4] >> 8 * (i % 4));
    say(frame, sizeof frame);
}

static fault_rule *rule_of(fault_id id)
{
    static fault_rule rule;
    rule = (fault_rule){.id = (uint8_t)id, .left = 1, .chance_millionths = FAULT_SURE, .until_us = UINT64_MAX};
    rule.delay_us = faults_words(id)->delay_us;
    rule.times = faults_words(id)->times;
    return &rule;
}

static void add(const fault_rule *rule)
{
    faults_look(&ins.faults, ins.now_us, &ins.controller);
    TEST_ASSERT_TRUE(faults_add(&ins.faults, rule));
}

static void check_at(uint32_t x, uint32_t y, uint32_t z)
{
    uint32_t steps[DR_AXES];
    const uint32_t expected[DR_AXES] = {x, y, z};
    dr_controller_position(&ins.controller, 0, instrument_now(&ins), steps);
    TEST_ASSERT_EQUAL_UINT32_ARRAY(expected, steps, DR_AXES);
}

static int64_t tip(uint8_t axis)
{
    uint32_t steps[DR_AXES];
    dr_controller_position(&ins.controller, 0, instrument_now(&ins), steps);
    return (int64_t)steps[axis] - faults_slipped_steps(&ins.faults, &ins.controller, 0, axis, instrument_now(&ins));
}

static void check_sent(const void *bytes, size_t count)
{
    TEST_ASSERT_EQUAL(count, sent_count);
    if (count > 0)
        TEST_ASSERT_EQUAL_HEX8_ARRAY(bytes, sent, count);
    sent_count = 0;
}

static void check_healthy(void)
{
    say("K", 1);
    check_sent("\x01\x21\x03\r", 4);
}

/* -- Rules --------------------------------------------------------------------------------------------------------------- */

static void every_fault_has_a_name_that_finds_it(void)
{
    fault_id id;
    for (unsigned i = 0; i < FAULTS; i++) {
        TEST_ASSERT_NOT_NULL(faults_words((fault_id)i)->name);
        TEST_ASSERT_NOT_NULL(faults_words((fault_id)i)->meaning);
        TEST_ASSERT_TRUE(faults_find(faults_words((fault_id)i)->name, &id));
        TEST_ASSERT_EQUAL(i, id);
    }
    TEST_ASSERT_FALSE(faults_find("tired", &id));
}

static void a_rule_strikes_as_often_as_it_says(void)
{
    fault_rule *const rule = rule_of(FAULT_DROP_CR);
    rule->left = 3;
    add(rule);
    for (unsigned i = 0; i < 3; i++) {
        say("K", 1);
        check_sent("\x01\x21\x03", 3);
    }
    TEST_ASSERT_EQUAL(0, ins.faults.count);
    check_healthy();
}

static void a_rule_that_always_strikes_ends_when_it_is_taken_back(void)
{
    fault_rule *const rule = rule_of(FAULT_DROP_CR);
    rule->left = FAULT_ALWAYS;
    add(rule);
    for (unsigned i = 0; i < 20; i++) {
        say("K", 1);
        check_sent("\x01\x21\x03", 3);
    }
    faults_remove(&ins.faults, FAULT_WEDGE);
    TEST_ASSERT_EQUAL(1, ins.faults.count);
    faults_remove(&ins.faults, FAULT_DROP_CR);
    check_healthy();
}

static void a_rule_for_one_command_spares_the_others(void)
{
    fault_rule *const rule = rule_of(FAULT_DROP_CR);
    rule->op = DR_OP_MPC_POSITION;
    add(rule);
    check_healthy();
    say("C", 1);
    TEST_ASSERT_EQUAL(13, sent_count);
    sent_count = 0;
    check_healthy();
}

static void a_rule_between_two_instants_begins_and_ends_with_them(void)
{
    fault_rule *const rule = rule_of(FAULT_DROP_CR);
    rule->left = FAULT_ALWAYS;
    rule->from_us = 1 * S;
    rule->until_us = 2 * S;
    add(rule);
    const struct {
        uint64_t when_us;
        size_t bytes;
    } at[] = {{1 * S - 1, 4}, {1 * S, 3}, {2 * S - 1, 3}, {2 * S, 4}};
    for (size_t i = 0; i < sizeof at / sizeof at[0]; i++) {
        run_to(at[i].when_us);
        say("K", 1);
        TEST_ASSERT_EQUAL(at[i].bytes, sent_count);
        sent_count = 0;
    }
}

static unsigned strikes_in_1000(uint64_t seed, uint32_t chance_millionths, uint64_t *digest)
{
    unsigned count = 0;
    switch_on(DR_MPC, seed);
    fault_rule *const rule = rule_of(FAULT_DROP_CR);
    rule->left = FAULT_ALWAYS;
    rule->chance_millionths = chance_millionths;
    add(rule);
    for (unsigned i = 0; i < 1000; i++) {
        say("K", 1);
        count += sent_count == 3;
        *digest = *digest * 31u + sent_count;
        sent_count = 0;
    }
    return count;
}

static void chance_is_as_large_as_it_says_and_the_same_for_the_same_seed(void)
{
    uint64_t first = 0, again = 0, other = 0;
    const unsigned count = strikes_in_1000(5, 200000, &first);
    TEST_ASSERT_UINT_WITHIN(60, 200, count); /* almost 5 standard deviations of a binomial distribution */
    TEST_ASSERT_EQUAL(count, strikes_in_1000(5, 200000, &again));
    TEST_ASSERT_EQUAL_UINT64(first, again);
    (void)strikes_in_1000(6, 200000, &other);
    TEST_ASSERT_TRUE(first != other);
    TEST_ASSERT_EQUAL(0, strikes_in_1000(5, 0, &other));
    TEST_ASSERT_EQUAL(1000, strikes_in_1000(5, FAULT_SURE, &other));
}

static void there_is_room_for_so_many_rules(void)
{
    for (unsigned i = 0; i < FAULT_RULES; i++)
        add(rule_of(FAULT_WEDGE));
    TEST_ASSERT_FALSE(faults_add(&ins.faults, rule_of(FAULT_WEDGE)));
    faults_remove(&ins.faults, FAULTS);
    TEST_ASSERT_EQUAL(0, ins.faults.count);
    check_healthy();
}

/* -- Answers -------------------------------------------------------------------------------------------------------------- */

static void each_byte_of_an_answer_can_be_struck(void)
{
    static const uint8_t right[4] = {1, 0x21, 3, 0x0D};
    bool dropped[4] = {false}, corrupted[4] = {false};
    for (unsigned turn = 0; turn < 200; turn++) {
        add(rule_of(FAULT_DROP_BYTE));
        say("K", 1);
        TEST_ASSERT_EQUAL(3, sent_count);
        unsigned at = 0;
        while (at < 3 && sent[at] == right[at])
            at++;
        for (unsigned i = at; i < 3; i++)
            TEST_ASSERT_EQUAL_HEX8(right[i + 1], sent[i]);
        dropped[at] = true;
        sent_count = 0;
        add(rule_of(FAULT_CORRUPT_BYTE));
        say("K", 1);
        TEST_ASSERT_EQUAL(4, sent_count);
        unsigned changed = 0;
        for (unsigned i = 0; i < 4; i++)
            for (unsigned bit = 0; bit < 8; bit++)
                if (((sent[i] ^ right[i]) >> bit & 1) != 0) {
                    changed++;
                    corrupted[i] = true;
                }
        TEST_ASSERT_EQUAL(1, changed);
        sent_count = 0;
    }
    for (unsigned i = 0; i < 4; i++)
        TEST_ASSERT_TRUE(dropped[i] && corrupted[i]);
}

static void a_late_answer_is_as_late_as_it_says(void)
{
    static const fault_id late[] = {FAULT_SLOW_ANSWER, FAULT_LATE_CR};
    for (unsigned i = 0; i < 2; i++) {
        fault_rule *const rule = rule_of(late[i]);
        rule->delay_us = 123456;
        add(rule);
        const uint64_t began_us = ins.now_us;
        say("K", 1);
        TEST_ASSERT_EQUAL(i == 0 ? 0 : 3, sent_count);
        run_out();
        TEST_ASSERT_EQUAL_UINT64(began_us + 123456, sent_us[3]);
        check_sent("\x01\x21\x03\r", 4);
    }
}

/* -- The host's bytes ----------------------------------------------------------------------------------------------------- */

static void a_wedge_ends_with_a_power_cycle(void)
{
    add(rule_of(FAULT_WEDGE));
    say("KKK", 3);
    run(10 * S);
    check_sent("", 0);
    dr_panel_power(&ins.panel, instrument_now(&ins), false);
    run(0);
    dr_panel_power(&ins.panel, instrument_now(&ins), true);
    check_healthy();
}

static void the_plug_comes_out_when_the_command_is_whole(void)
{
    fault_rule *const rule = rule_of(FAULT_USB_UNPLUG);
    rule->op = DR_OP_MPC_MOVE;
    rule->delay_us = 7 * S;
    add(rule);
    check_healthy();
    say("M\x80\xBB\0\0\0\0\0\0\0\0\0", 12); /* 48,000 and so on: one byte is missing */
    TEST_ASSERT_EQUAL_UINT64(0, ins.faults.unplug_us);
    say("", 1);
    TEST_ASSERT_EQUAL_UINT64(7 * S, ins.faults.unplug_us);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, ins.controller.state); /* the command counts all the same */
    ins.faults.unplug_us = 0;
    run_out();
    check_at(SECOND_STEPS, 0, 0);
    TEST_ASSERT_EQUAL_UINT64(0, ins.faults.unplug_us);
}

/* -- Moves ---------------------------------------------------------------------------------------------------------------- */

static void a_stalled_axis_gets_half_of_its_way_and_says_so(void)
{
    fault_rule *const rule = rule_of(FAULT_STALL_AXIS);
    rule->axis = DR_Y;
    add(rule);
    const uint64_t began_us = ins.now_us;
    say_move('M', SECOND_STEPS, SECOND_STEPS + 1, 0);
    run_out();
    check_at(SECOND_STEPS, SECOND_STEPS / 2, 0);
    TEST_ASSERT_EQUAL_UINT64(began_us + 1 * S, sent_us[0]);
    check_sent("\r", 1);
    say_move('M', 0, 0, 0); /* once */
    run_out();
    check_at(0, 0, 0);
}

/* At 30 degrees a TRIO's W runs Y, then Z, then X [T page 1]: X and Z are struck in the leg in which they move. */
static void an_axis_is_struck_in_the_leg_in_which_it_moves(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        for (unsigned slips = 0; slips < 2; slips++) {
            const uint32_t from = 10667, to = from + 1000;
            switch_on(DR_TRIO, 1);
            run_out();
            fault_rule *const rule = rule_of(slips ? FAULT_SLIP_AXIS : FAULT_STALL_AXIS);
            rule->axis = axis;
            add(rule);
            say_move('W', from, from, from); /* nothing moves: the rule waits */
            run_out();
            say_move('W', to, to, to);
            run_out();
            uint32_t expected[DR_AXES] = {to, to, to};
            if (slips)
                TEST_ASSERT_EQUAL_INT64(from, tip(axis));
            else
                expected[axis] = from + 500;
            check_at(expected[DR_X], expected[DR_Y], expected[DR_Z]);
            check_sent("\r\r", 2);
        }
}

static void a_slow_move_lasts_as_many_times_as_long(void)
{
    fault_rule *const rule = rule_of(FAULT_SLOW_MOTION);
    rule->times = 4;
    add(rule);
    uint64_t began_us = ins.now_us;
    say_move('M', SECOND_STEPS, 0, SECOND_STEPS / 2);
    run(1 * S);
    check_at(SECOND_STEPS / 4, 0, SECOND_STEPS / 4);
    run(3 * S - 1);
    check_sent("", 0);
    run(1);
    TEST_ASSERT_EQUAL_UINT64(began_us + 4 * S, sent_us[0]);
    check_sent("\r", 1);
    began_us = ins.now_us;
    say_move('M', 0, 0, SECOND_STEPS / 2); /* and the next one as ever */
    run_out();
    TEST_ASSERT_EQUAL_UINT64(began_us + 1 * S, sent_us[0]);
}

static void all_legs_of_a_slow_move_are_slow(void)
{
    drives[0].diagonal = 7; /* 45 degrees: X and Z come to 0 together, then Y, [M table 2] */
    say_move('M', SECOND_STEPS, SECOND_STEPS, SECOND_STEPS);
    run_out();
    sent_count = 0;
    uint64_t began_us = ins.now_us;
    say("H", 1);
    run_out();
    const uint64_t takes_us = sent_us[0] - began_us;
    TEST_ASSERT_TRUE(takes_us > 1 * S);
    say_move('M', SECOND_STEPS, SECOND_STEPS, SECOND_STEPS);
    run_out();
    sent_count = 0;
    add(rule_of(FAULT_SLOW_MOTION));
    began_us = ins.now_us;
    say("H", 1);
    run_out();
    TEST_ASSERT_EQUAL_UINT64(began_us + 3 * takes_us, sent_us[0]);
    check_at(0, 0, 0);
}

static void a_slow_move_is_stopped_where_it_is(void)
{
    add(rule_of(FAULT_SLOW_MOTION));
    say_move('M', SECOND_STEPS, 0, 0);
    run(1500 * MS);
    say("\x03", 1);
    check_at(SECOND_STEPS / 2, 0, 0);
    check_sent("\r", 1);
    const uint64_t began_us = ins.now_us;
    say_move('M', SECOND_STEPS, 0, 0);
    run_out();
    TEST_ASSERT_EQUAL_UINT64(began_us + 500 * MS, sent_us[0]); /* the next one is not slow */
}

static void slow_and_stalled_go_together(void)
{
    fault_rule *rule = rule_of(FAULT_STALL_AXIS);
    rule->axis = DR_X;
    add(rule);
    add(rule_of(FAULT_SLOW_MOTION));
    const uint64_t began_us = ins.now_us;
    say_move('M', SECOND_STEPS, 0, 0);
    run_out();
    check_at(SECOND_STEPS / 2, 0, 0);
    TEST_ASSERT_EQUAL_UINT64(began_us + 1500 * MS, sent_us[0]);
}

static void a_leg_is_never_slower_than_the_clock_can_tell(void)
{
    fault_rule *const rule = rule_of(FAULT_SLOW_MOTION);
    rule->times = 100;
    add(rule);
    const uint64_t began_us = ins.now_us;
    say("S\0\0\x1A\x06\0\0\0\0\0\0\0\0\0", 14); /* speed 0: 25 mm at a sixteenth of 1,300 um/s, 5 minutes */
    say("", 0);
    run_out();
    check_at(399872, 0, 0);
    TEST_ASSERT_TRUE(sent_us[0] - began_us <= INT32_MAX);
    TEST_ASSERT_TRUE(sent_us[0] - began_us > 1000 * S);
}

static void a_rule_spares_the_leg_that_has_begun(void)
{
    say_move('M', SECOND_STEPS, 0, 0);
    add(rule_of(FAULT_SLOW_MOTION));
    const uint64_t began_us = ins.now_us;
    run_out();
    TEST_ASSERT_EQUAL_UINT64(began_us + 1 * S, sent_us[0]);
    TEST_ASSERT_EQUAL(1, ins.faults.count);
}

static void a_move_that_hands_begin_is_struck_as_well(void)
{
    say_move('M', SECOND_STEPS, 0, 0);
    run_out();
    add(rule_of(FAULT_SLOW_MOTION));
    TEST_ASSERT_TRUE(dr_panel_press(&ins.panel, instrument_now(&ins), DR_BUTTON_HOME));
    (void)dr_panel_release(&ins.panel, instrument_now(&ins), DR_BUTTON_HOME);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, ins.controller.state);
    run(2999 * MS);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, ins.controller.state);
    run(1 * MS);
    TEST_ASSERT_EQUAL(DR_STATE_REST, ins.controller.state);
}

static void a_tip_that_slips_is_right_again_after_a_calibration(void)
{
    fault_rule *const rule = rule_of(FAULT_SLIP_AXIS);
    rule->axis = DR_X;
    add(rule);
    say_move('M', SECOND_STEPS, 0, 0);
    run(500 * MS);
    check_at(SECOND_STEPS / 2, 0, 0);
    TEST_ASSERT_EQUAL_INT64(0, tip(DR_X));
    run_out();
    check_at(SECOND_STEPS, 0, 0);
    TEST_ASSERT_EQUAL_INT64(0, tip(DR_X));
    say_move('M', 0, 0, 0); /* the next move is whole */
    run_out();
    TEST_ASSERT_EQUAL_INT64(-(int64_t)SECOND_STEPS, tip(DR_X));
    say("N", 1);
    run(1 * MS);
    say("\x03", 1); /* not a whole one */
    run_out();
    TEST_ASSERT_EQUAL_INT64(-(int64_t)SECOND_STEPS, tip(DR_X));
    dr_panel_power(&ins.panel, instrument_now(&ins), false);
    dr_panel_power(&ins.panel, instrument_now(&ins), true);
    say("N", 1);
    run_out();
    TEST_ASSERT_EQUAL_INT64(0, tip(DR_X));
}

/* -- Power ---------------------------------------------------------------------------------------------------------------- */

static void the_power_goes_in_the_middle_of_a_move_and_comes_back(void)
{
    fault_rule *const rule = rule_of(FAULT_POWER_LOSS);
    rule->delay_us = 3 * S;
    add(rule);
    const uint64_t began_us = ins.now_us;
    say_move('M', SECOND_STEPS, 0, 0);
    run(500 * MS - 1);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, ins.controller.state);
    run(1);
    TEST_ASSERT_EQUAL(DR_STATE_OFF, ins.controller.state);
    say("K", 1);
    run_to(began_us + 3500 * MS - 1);
    TEST_ASSERT_EQUAL(DR_STATE_OFF, ins.controller.state);
    run(1);
    TEST_ASSERT_EQUAL(DR_STATE_REST, ins.controller.state);
    check_sent("", 0); /* neither the CR of the move nor what was said to nobody */
    check_at(SECOND_STEPS / 2, 0, 0);
    TEST_ASSERT_EQUAL_INT64(SECOND_STEPS / 2, tip(DR_X));
    TEST_ASSERT_EQUAL(DR_CALIBRATED, drives[0].calibration);
    check_healthy();
}

static void the_power_takes_the_positions_with_it(void)
{
    add(rule_of(FAULT_POWER_LOSS_FORGET));
    say_move('M', SECOND_STEPS, 0, SECOND_STEPS);
    run_out();
    TEST_ASSERT_EQUAL(DR_STATE_REST, ins.controller.state);
    check_at(0, 0, 0);
    TEST_ASSERT_EQUAL_INT64(SECOND_STEPS / 2, tip(DR_X));
    TEST_ASSERT_EQUAL_INT64(SECOND_STEPS / 2, tip(DR_Z));
    TEST_ASSERT_EQUAL(DR_UNCALIBRATED_CYCLED, drives[0].calibration);
    say_move('M', 1600, 0, 0); /* counts from where it stands */
    run_out();
    check_at(1600, 0, 0);
    TEST_ASSERT_EQUAL_INT64(SECOND_STEPS / 2 + 1600, tip(DR_X));
    say("N", 1);
    run_out();
    TEST_ASSERT_EQUAL(DR_CALIBRATED, drives[0].calibration);
    TEST_ASSERT_EQUAL_INT64(0, tip(DR_X));
}

static void a_trio_calibrates_when_the_power_is_back(void)
{
    switch_on(DR_TRIO, 1);
    add(rule_of(FAULT_POWER_LOSS_FORGET));
    say_move('H', 100000, 0, 0);
    run_out();
    check_at(10667, 10667, 10667); /* 1,000 um, where a calibration ends [O] */
    TEST_ASSERT_EQUAL_INT64(10667, tip(DR_X));
    TEST_ASSERT_EQUAL(DR_CALIBRATED, drives[0].calibration);
    check_sent("", 0);
}

static void the_calibration_at_power_on_keeps_its_power(void)
{
    switch_on(DR_TRIO, 1);
    fault_rule *const rule = rule_of(FAULT_POWER_LOSS);
    rule->left = FAULT_ALWAYS;
    add(rule);
    say_move('H', 100000, 0, 0);
    run_out();
    TEST_ASSERT_EQUAL(DR_STATE_REST, ins.controller.state);
    check_at(10667, 10667, 10667);
}

static void somebody_may_be_faster_with_the_mains_switch(void)
{
    add(rule_of(FAULT_POWER_LOSS));
    say_move('M', SECOND_STEPS, 0, 0);
    run(600 * MS);
    TEST_ASSERT_EQUAL(DR_STATE_OFF, ins.controller.state);
    dr_panel_power(&ins.panel, instrument_now(&ins), true);
    run(100 * MS);
    dr_panel_power(&ins.panel, instrument_now(&ins), false);
    run_out();
    TEST_ASSERT_EQUAL(DR_STATE_OFF, ins.controller.state); /* what comes back by itself has come back */
    dr_panel_power(&ins.panel, instrument_now(&ins), true);
    add(rule_of(FAULT_POWER_LOSS));
    say_move('M', 0, 0, 0);
    run(100 * MS);
    dr_panel_power(&ins.panel, instrument_now(&ins), false);
    run_out();
    TEST_ASSERT_EQUAL(DR_STATE_OFF, ins.controller.state); /* and what is off cannot go off */
}

static void a_power_loss_that_is_taken_back_does_not_come(void)
{
    add(rule_of(FAULT_POWER_LOSS));
    say_move('M', SECOND_STEPS, 0, 0);
    run(100 * MS);
    faults_remove(&ins.faults, FAULTS);
    run_out();
    check_sent("\r", 1);
    check_at(SECOND_STEPS, 0, 0);
}

/* -- Determinism ---------------------------------------------------------------------------------------------------------- */

/* All faults by chance at once, through a session of moves, streams and queries. */
static uint64_t digest_of_a_session(uint64_t seed, uint64_t grain_us)
{
    uint64_t digest = 0;
    switch_on(DR_MPC, seed);
    for (unsigned id = 0; id < FAULTS; id++) {
        fault_rule *const rule = rule_of((fault_id)id);
        rule->left = FAULT_ALWAYS;
        rule->chance_millionths = id == FAULT_WEDGE ? 5000 : 100000;
        add(rule);
    }
    say("O", 1);
    for (unsigned i = 0; i < 200; i++) {
        say_move('M', 1600 * (i % 7), 1600 * (i % 5), 800 * (i % 3));
        say("CKU\x03", 4);
        const uint64_t until_us = ins.now_us + 700 * MS;
        while (ins.now_us < until_us)
            run(until_us - ins.now_us < grain_us ? until_us - ins.now_us : grain_us);
        ins.faults.unplug_us = 0;
        for (size_t k = 0; k < sent_count; k++)
            digest = (digest ^ sent[k] ^ sent_us[k] << 8) * UINT64_C(0x9E3779B97F4A7C15);
        digest ^= digest >> 29;
        sent_count = 0;
    }
    return digest;
}

static void the_same_seed_gives_the_same_bytes_at_the_same_instants(void)
{
    const uint64_t first = digest_of_a_session(42, 700 * MS);
    for (unsigned i = 0; i < 20; i++)
        TEST_ASSERT_EQUAL_UINT64(first, digest_of_a_session(42, i % 2 == 0 ? 700 * MS : 1000 + 777 * i));
    TEST_ASSERT_TRUE(first != digest_of_a_session(43, 700 * MS));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_fault_has_a_name_that_finds_it);
    RUN_TEST(a_rule_strikes_as_often_as_it_says);
    RUN_TEST(a_rule_that_always_strikes_ends_when_it_is_taken_back);
    RUN_TEST(a_rule_for_one_command_spares_the_others);
    RUN_TEST(a_rule_between_two_instants_begins_and_ends_with_them);
    RUN_TEST(chance_is_as_large_as_it_says_and_the_same_for_the_same_seed);
    RUN_TEST(there_is_room_for_so_many_rules);
    RUN_TEST(each_byte_of_an_answer_can_be_struck);
    RUN_TEST(a_late_answer_is_as_late_as_it_says);
    RUN_TEST(a_wedge_ends_with_a_power_cycle);
    RUN_TEST(the_plug_comes_out_when_the_command_is_whole);
    RUN_TEST(a_stalled_axis_gets_half_of_its_way_and_says_so);
    RUN_TEST(an_axis_is_struck_in_the_leg_in_which_it_moves);
    RUN_TEST(a_slow_move_lasts_as_many_times_as_long);
    RUN_TEST(all_legs_of_a_slow_move_are_slow);
    RUN_TEST(a_slow_move_is_stopped_where_it_is);
    RUN_TEST(slow_and_stalled_go_together);
    RUN_TEST(a_leg_is_never_slower_than_the_clock_can_tell);
    RUN_TEST(a_rule_spares_the_leg_that_has_begun);
    RUN_TEST(a_move_that_hands_begin_is_struck_as_well);
    RUN_TEST(a_tip_that_slips_is_right_again_after_a_calibration);
    RUN_TEST(the_power_goes_in_the_middle_of_a_move_and_comes_back);
    RUN_TEST(the_power_takes_the_positions_with_it);
    RUN_TEST(a_trio_calibrates_when_the_power_is_back);
    RUN_TEST(the_calibration_at_power_on_keeps_its_power);
    RUN_TEST(somebody_may_be_faster_with_the_mains_switch);
    RUN_TEST(a_power_loss_that_is_taken_back_does_not_come);
    RUN_TEST(the_same_seed_gives_the_same_bytes_at_the_same_instants);
    return UNITY_END();
}
