/* What hands do: power, plugs, knobs; and the notes that tell what happened. */
#include "scenario.h"

#include <string.h>

static void power_off_in_a_move_leaves_the_axes_where_they_are(void)
{
    mpc_at(0, 0, 0);
    send_string("O");
    expect_cr(0);
    send_line(15, 1600, 800, 0);
    send_string("CK");
    send_point('M', 1, 1, 1); /* waits */
    send_string("M12");       /* is arriving */
    const uint64_t us = takes_us(1600, 4, 1300);
    sim_run_to(&rig, 500);
    TEST_ASSERT_TRUE(power(false));
    const uint32_t x = (uint32_t)(1600 * 500 / us), y = (uint32_t)(800 * 500 / us);
    expect_at(0, x, y, 0);
    TEST_ASSERT_EQUAL_UINT32(x, rig.drives[0].position_steps[0]);
    TEST_ASSERT_EQUAL_UINT32(x, expect_note(DR_NOTE_STOPPED).steps[0]);
    (void)expect_note(DR_NOTE_POWER_OFF);
    sim_run(&rig, 1000000);
    expect_nothing();
    dr_us when;
    TEST_ASSERT_FALSE(dr_controller_due(&rig.c, &when));
    TEST_ASSERT_TRUE(power(true));
    (void)expect_note(DR_NOTE_POWER_ON);
    expect_idle(); /* nothing of what waited comes back */
    TEST_ASSERT_FALSE(rig.c.streaming);
    send_code('C');
    expect_mpc_position(rig.now_us, 1, x, y, 0);
    expect_idle();
}

static void power_off_takes_the_reply_with_it(void)
{
    mpc_at(0, 0, 0);
    rig.byte_us = 78;
    send_string("CK\x03");
    sim_run(&rig, 200);
    const size_t got = rig.count;
    TEST_ASSERT_TRUE(got > 0 && got < 14);
    TEST_ASSERT_TRUE(power(false));
    sim_run(&rig, 100000);
    TEST_ASSERT_EQUAL(got, rig.count);
    TEST_ASSERT_TRUE(power(true));
    sim_run(&rig, 100000);
    TEST_ASSERT_EQUAL(got, rig.count);
    send_code('K');
    sim_run_out(&rig);
    TEST_ASSERT_EQUAL(got + 4, rig.count);
}

static void a_switch_that_is_there_already_changes_nothing(void)
{
    mpc_at(0, 0, 0);
    send_code('O');
    expect_cr(0);
    send_point('M', 1600, 0, 0);
    sim_run(&rig, 100);
    const bool on_again = power(true);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state);
    TEST_ASSERT_TRUE(rig.c.streaming);
    sim_run_out(&rig);
    expect_cr(33334);
    expect_idle();
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_EQUAL(on_again, power(false)); /* one rule for both */
    TEST_ASSERT_EQUAL(DR_STATE_OFF, rig.c.state);
}

static void an_unplugged_trio_moves_nothing(void)
{
    trio_at(80, 80, 80);
    TEST_ASSERT_TRUE(plug(0, DR_STAGE_NONE));
    send_axis('x', 4000);
    send_code('h');
    send_code('R');
    sim_run(&rig, 100000000);
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_TRUE(power(true));
    sim_run(&rig, 100000000);
    dr_us when;
    TEST_ASSERT_FALSE(dr_controller_due(&rig.c, &when));
    TEST_ASSERT_TRUE(plug(0, DR_STAGE_TRIO_MP285));
    rig.seen = rig.count;
    send_code('c');
    TEST_ASSERT_EQUAL(rig.seen + 14, rig.count);
}

static void after_power_on_the_lowest_connected_drive_is_active(void)
{
    mpc_at(0, 0, 0);
    send_value('I', 2);
    TEST_ASSERT_EQUAL(1, rig.c.active);
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_TRUE(power(true));
    TEST_ASSERT_EQUAL(0, rig.c.active);
}

static void work_positions_outlive_power_off(void)
{
    mpc_at(0, 0, 0);
    rig.drives[0].work_is_set = true;
    rig.drives[0].work_steps[0] = 160;
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_TRUE(power(true));
    send_code('H');
    expect_cr(0);
    send_code('Y');
    sim_run_out(&rig);
    expect_cr(takes_us(160, 4, 3000));
    expect_at(0, 160, 0, 0);
}

static void knobs_move_what_is_at_rest(void)
{
    mpc_at(0, 0, 0);
    TEST_ASSERT_TRUE(place(1, 11, 22, 33)); /* the other drive */
    TEST_ASSERT_EQUAL_UINT32(22, expect_note(DR_NOTE_PLACED).steps[1]);
    expect_at(1, 11, 22, 33);
    expect_at(0, 0, 0, 0);
    TEST_ASSERT_TRUE(place(0, 160, 0, 0));
    send_code('C');
    expect_mpc_position(0, 1, 160, 0, 0);
    send_point('M', 0, 0, 0);
    TEST_ASSERT_FALSE(place(0, 1, 1, 1)); /* the knobs are dead during moves */
    sim_run_out(&rig);
    expect_cr(takes_us(160, 4, 3000));
    expect_at(0, 0, 0, 0);
    TEST_ASSERT_FALSE(place(3, 1, 1, 1)); /* nothing is there */
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_FALSE(place(0, 1, 1, 1));
    expect_at(0, 0, 0, 0);
}

static void knobs_end_where_the_travel_ends(void)
{
    mpc_at(0, 0, 0);
    TEST_ASSERT_TRUE(place(0, 400001, UINT32_MAX, 399999));
    expect_at(0, 400000, 400000, 399999);
    expect_idle();
}

static void hands_find_nothing_that_is_not_there(void)
{
    mpc_at(0, 0, 0);
    TEST_ASSERT_FALSE(place(4, 1, 1, 1));
    TEST_ASSERT_FALSE(plug(4, DR_STAGE_MPC_MP225));
    const dr_hand strange = {200, 0, 0, {1, 1, 1}}; /* whatever it answers, it does nothing */
    (void)sim_poke(&rig, &strange);
    (void)dr_controller_apply(&rig.c, sim_clock(&rig), (dr_effect)200, 0);
    expect_at(0, 0, 0, 0);
    expect_idle();
}

static void a_drive_can_be_plugged_in(void)
{
    mpc_at(0, 0, 0);
    send_value('I', 4);
    static const uint8_t no[] = {'E', 0x0D}, yes[] = {4, 0x0D}, drives[] = {3, 1, 1, 0, 1, 0x0D};
    expect(0, no, 2);
    TEST_ASSERT_TRUE(plug(3, DR_STAGE_MPC_MP285));
    TEST_ASSERT_EQUAL_UINT32(DR_STAGE_MPC_MP285, expect_note(DR_NOTE_CONNECTED).value);
    send_code('U');
    expect(0, drives, 6);
    send_value('I', 4);
    expect(0, yes, 2);
    send_point('M', 1600, 0, 0);
    sim_run_out(&rig);
    expect_cr(takes_us(1600, 4, 5000));
    expect_idle();
}

static void an_empty_controller_wakes_up_with_its_first_drive(void)
{
    prepare(DR_MPC);
    dr_drive_init(&rig.drives[0], DR_STAGE_NONE);
    dr_drive_init(&rig.drives[1], DR_STAGE_NONE);
    start();
    send_string("CU\x03");
    expect_idle();
    TEST_ASSERT_TRUE(plug(2, DR_STAGE_MPC_MP225));
    send_code('C');
    expect_mpc_position(0, 3, 0, 0, 0);
    expect_idle();
}

static void a_drive_that_is_unplugged_in_a_move_never_answers(void)
{
    mpc_at(0, 0, 0);
    send_point('M', 1600, 0, 0);
    sim_run(&rig, 10000);
    TEST_ASSERT_TRUE(plug(1, DR_STAGE_NONE)); /* the other one does not matter */
    sim_run(&rig, 10000);
    TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state);
    TEST_ASSERT_TRUE(plug(0, DR_STAGE_NONE));
    TEST_ASSERT_EQUAL(DR_STATE_STRANDED, rig.c.state);
    TEST_ASSERT_EQUAL_UINT32(1600 * 20000 / 33334, expect_note(DR_NOTE_STOPPED).steps[0]);
    sim_run(&rig, 100000000);
    expect_nothing();
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_TRUE(plug(0, DR_STAGE_MPC_MP225));
    TEST_ASSERT_TRUE(power(true));
    send_code('K');
    static const uint8_t k[] = {1, 0x21, 3, 0x0D};
    expect(rig.now_us, k, 4);
    expect_idle();
}

static void a_stranded_controller_listens_again_after_an_interrupt(void)
{
    mpc_at(0, 0, 0);
    send_point('M', 1600, 0, 0);
    sim_run(&rig, 10000);
    TEST_ASSERT_TRUE(plug(0, DR_STAGE_NONE));
    send_code('U');
    expect_nothing();
    send_code(3);
    expect_cr(10000);
    static const uint8_t drives[] = {1, 0, 1, 0, 0, 0x0D};
    expect(10000, drives, 6);
    expect_idle();
}

static void a_new_drive_knows_nothing_of_a_paused_move(void)
{
    for (unsigned unplugged_before = 0; unplugged_before < 2; unplugged_before++) {
        prepare(DR_MPC);
        rig.c.quirks = DR_QUIRK_PAUSE_ON_STOP;
        start();
        send_point('M', 0, 400000, 0);
        sim_run(&rig, 1000);
        send_code(3);
        expect_cr(1000);
        TEST_ASSERT_TRUE(!unplugged_before || plug(0, DR_STAGE_NONE));
        TEST_ASSERT_TRUE(plug(0, DR_STAGE_MPC_MP865)); /* whose Y ends at 266,667 */
        send_value('I', 1);
        rig.seen = rig.count;
        uint32_t at[DR_AXES];
        dr_controller_position(&rig.c, 0, sim_clock(&rig), at);
        send_point('M', 100, at[DR_Y], 0);
        sim_run_out(&rig);
        expect_cr(rig.now_us);
        expect_at(0, 100, at[DR_Y], 0);
        expect_idle();
    }
}

static void a_smaller_drive_does_not_leave_its_travel(void)
{
    prepare(DR_MPC);
    dr_drive_init(&rig.drives[0], DR_STAGE_MPC_MP865);
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        rig.drives[0].position_steps[axis] = axis == DR_X ? 1066667 : 0;
        rig.drives[0].work_steps[axis] = axis == DR_X ? 1066667 : 0;
    }
    rig.drives[0].work_is_set = true;
    start();
    TEST_ASSERT_TRUE(plug(0, DR_STAGE_MPC_MP225));
    uint32_t at[DR_AXES];
    dr_controller_position(&rig.c, 0, sim_clock(&rig), at);
    TEST_ASSERT_TRUE(at[DR_X] <= 400000);
    send_code('H');
    sim_run_out(&rig);
    send_code('Y');
    sim_run_out(&rig);
    dr_controller_position(&rig.c, 0, sim_clock(&rig), at);
    TEST_ASSERT_TRUE(at[DR_X] <= 400000);
    rig.seen = rig.count;
    expect_idle();

    prepare(DR_TRIO);
    dr_drive_init(&rig.drives[0], DR_STAGE_TRIO_MP845);
    rig.c.home_steps[DR_Y] = 266667;
    start();
    TEST_ASSERT_TRUE(plug(0, DR_STAGE_TRIO_MP265)); /* Y ends at 100,000 */
    send_code('h');
    sim_run_out(&rig);
    dr_controller_position(&rig.c, 0, sim_clock(&rig), at);
    TEST_ASSERT_TRUE(at[DR_Y] <= 100000);
}

/* -- Notes ------------------------------------------------------------------------------------------------------------ */

static void notes_tell_what_happened_in_order(void)
{
    mpc_at(0, 0, 0);
    (void)expect_note(DR_NOTE_STARTED);
    send_point('M', 16, 32, 0);
    sim_run(&rig, 10);
    send_code('K');
    sim_run_out(&rig);
    static const dr_note_kind order[] = {DR_NOTE_REQUEST, DR_NOTE_LEG,   DR_NOTE_REQUEST, DR_NOTE_KEPT,
                                         DR_NOTE_ARRIVED, DR_NOTE_REPLY, DR_NOTE_REPLY};
    static const uint8_t move[13] = {'M', 16, 0, 0, 0, 32}, k[4] = {1, 0x21, 3, 0x0D};
    const uint32_t us = takes_us(32, 4, 3000);
    for (size_t i = 0; i < sizeof order / sizeof order[0]; i++) {
        dr_note note;
        TEST_ASSERT_TRUE(dr_notes_take(&notes, &note));
        TEST_ASSERT_EQUAL_MESSAGE(order[i], note.what, "note");
        const dr_us at = i < 2 ? 0 : i < 4 ? 10 : us;
        TEST_ASSERT_EQUAL_UINT32(clock_at_start + at, note.when);
        TEST_ASSERT_EQUAL(0, note.drive);
        if (i == 0) {
            TEST_ASSERT_EQUAL(DR_OP_MPC_MOVE, note.op);
            TEST_ASSERT_EQUAL(13, note.count);
            TEST_ASSERT_EQUAL_HEX8_ARRAY(move, note.bytes, 13);
        } else if (i == 1 || i == 4) {
            TEST_ASSERT_EQUAL_UINT32(16, note.steps[0]);
            TEST_ASSERT_EQUAL_UINT32(32, note.steps[1]);
            TEST_ASSERT_EQUAL_UINT32(i == 1 ? us : 0, i == 1 ? note.value : 0);
        } else if (i == 6) {
            TEST_ASSERT_EQUAL(DR_OP_MPC_ACTIVE, note.op);
            TEST_ASSERT_EQUAL(4, note.count);
            TEST_ASSERT_EQUAL_HEX8_ARRAY(k, note.bytes, 4);
        }
    }
    dr_note none;
    TEST_ASSERT_FALSE(dr_notes_take(&notes, &none));
}

static void a_full_ring_drops_the_oldest_and_counts(void)
{
    dr_note few[3], note;
    dr_notes small;
    dr_notes_init(&small, few, 3);
    TEST_ASSERT_FALSE(dr_notes_take(&small, &note));
    mpc_at(0, 0, 0);
    rig.c.notes = &small;
    const uint8_t bytes[] = {1, 2, 4, 5, 6};
    sim_push(&rig, bytes, 5); /* five unknown bytes */
    TEST_ASSERT_EQUAL_UINT32(2, small.missed);
    for (unsigned k = 2; k < 5; k++) {
        TEST_ASSERT_TRUE(dr_notes_take(&small, &note));
        TEST_ASSERT_EQUAL_HEX8(bytes[k], note.bytes[0]);
    }
    TEST_ASSERT_FALSE(dr_notes_take(&small, &note));
    sim_push(&rig, bytes, 1); /* and it goes on */
    TEST_ASSERT_TRUE(dr_notes_take(&small, &note));
    TEST_ASSERT_EQUAL_HEX8(1, note.bytes[0]);
}

static void without_notes_all_is_the_same(void)
{
    mpc_at(0, 0, 0);
    rig.c.notes = NULL;
    send_point('M', 16, 32, 0);
    send_string("K\xEE\r\x03");
    sim_run_out(&rig);
    TEST_ASSERT_EQUAL(5, rig.count);
}

static void tests(void)
{
    RUN_TEST(power_off_in_a_move_leaves_the_axes_where_they_are);
    RUN_TEST(power_off_takes_the_reply_with_it);
    RUN_TEST(a_switch_that_is_there_already_changes_nothing);
    RUN_TEST(an_unplugged_trio_moves_nothing);
    RUN_TEST(after_power_on_the_lowest_connected_drive_is_active);
    RUN_TEST(work_positions_outlive_power_off);
    RUN_TEST(knobs_move_what_is_at_rest);
    RUN_TEST(knobs_end_where_the_travel_ends);
    RUN_TEST(hands_find_nothing_that_is_not_there);
    RUN_TEST(a_drive_can_be_plugged_in);
    RUN_TEST(an_empty_controller_wakes_up_with_its_first_drive);
    RUN_TEST(a_drive_that_is_unplugged_in_a_move_never_answers);
    RUN_TEST(a_stranded_controller_listens_again_after_an_interrupt);
    RUN_TEST(a_new_drive_knows_nothing_of_a_paused_move);
    RUN_TEST(a_smaller_drive_does_not_leave_its_travel);
    RUN_TEST(notes_tell_what_happened_in_order);
    RUN_TEST(a_full_ring_drops_the_oldest_and_counts);
    RUN_TEST(without_notes_all_is_the_same);
}

int main(void)
{
    UNITY_BEGIN();
    at_every_clock(tests);
    return UNITY_END();
}
