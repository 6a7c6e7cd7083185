/* What PROTOCOL.md, section 1, settles for both controllers: every command in every state, early commands, fillers,
 * unknown bytes, interrupts, what is lost. */
#include "scenario.h"

#include <string.h>

/* -- Every command ---------------------------------------------------------------------------------------------------- */

typedef struct {
    dr_kind kind;
    uint16_t firmware;
    uint8_t frame[14];
    uint8_t length;
    uint8_t reply;     /* bytes of its reply */
    uint32_t lasts_us; /* from 160, 160, 160, home and targets being 0, 0, 0 */
} command;

#define ZERO 0, 0, 0, 0
#define ORIGIN ZERO, ZERO, ZERO

/* TRIO: MP-285, 25 us a step, angle 30. MPC-200: MP-225, 62.5/3 us a step; H, Y and N start from 0, 0, 0 below. */
static const command commands[] = {
    {DR_TRIO, 0x312, {'c'}, 1, 14, 0},
    {DR_TRIO, 0x312, {'C'}, 1, 14, 0},
    {DR_TRIO, 0x312, {'h'}, 1, 1, 12000},
    {DR_TRIO, 0x312, {'w'}, 1, 1, 0},
    {DR_TRIO, 0x312, {'H', ORIGIN}, 13, 1, 12000},
    {DR_TRIO, 0x312, {'W', ORIGIN}, 13, 1, 12000},
    {DR_TRIO, 0x312, {'S', 15, ORIGIN}, 14, 1, 4000},
    {DR_TRIO, 0x312, {'x', ZERO}, 5, 1, 4000},
    {DR_TRIO, 0x312, {'X', ZERO}, 5, 1, 4000},
    {DR_TRIO, 0x312, {'y', ZERO}, 5, 1, 4000},
    {DR_TRIO, 0x312, {'Y', ZERO}, 5, 1, 4000},
    {DR_TRIO, 0x312, {'z', ZERO}, 5, 1, 4000},
    {DR_TRIO, 0x312, {'Z', ZERO}, 5, 1, 4000},
    {DR_TRIO, 0x312, {'A', 44}, 2, 1, 0},
    {DR_TRIO, 0x312, {'R'}, 1, 1, 212000},
    {DR_MPC, 0x321, {'U'}, 1, 6, 0},
    {DR_MPC, 0x321, {'K'}, 1, 4, 0},
    {DR_MPC, 0x321, {'C'}, 1, 14, 0},
    {DR_MPC, 0x321, {'I', 1}, 2, 2, 0},
    {DR_MPC, 0x321, {'I', 0}, 2, 2, 0},
    {DR_MPC, 0x321, {'H'}, 1, 1, 3334 + 3334},
    {DR_MPC, 0x321, {'Y'}, 1, 1, 0},
    {DR_MPC, 0x321, {'N'}, 1, 1, 3334 + 3334 + 2 * 83334},
    {DR_MPC, 0x321, {'M', ORIGIN}, 13, 1, 3334},
    {DR_MPC, 0x321, {'S', 15, ORIGIN}, 14, 1, 7693},
    {DR_MPC, 0x321, {'F'}, 1, 1, 0},
    {DR_MPC, 0x321, {'O'}, 1, 1, 0},
    {DR_MPC, 0x321, {'L', 3}, 2, 1, 0},
    {DR_MPC, 0x200, {'A'}, 1, 2, 0},
    {DR_MPC, 0x200, {'K'}, 1, 2, 0},
    {DR_MPC, 0x105, {'I', 1}, 2, 1, 0},
    {DR_MPC, 0x103, {'N'}, 1, 1, 4163334}, /* 199,840 steps to the middle */
};

#define COMMANDS (sizeof commands / sizeof commands[0])

static void begin(const command *cmd)
{
    prepare(cmd->kind);
    if (cmd->kind == DR_TRIO) {
        dr_drive_init(&rig.drives[0], DR_STAGE_TRIO_MP285);
    }
    rig.c.firmware = cmd->firmware;
    for (unsigned axis = 0; axis < 3; axis++) {
        rig.drives[0].position_steps[axis] = 160;
    }
    start();
}

static void expect_reply(const command *cmd, uint64_t at)
{
    TEST_ASSERT_TRUE(rig.count >= rig.seen + cmd->reply);
    for (unsigned k = 0; k < cmd->reply; k++) {
        TEST_ASSERT_EQUAL_UINT64(at, rig.out[rig.seen + k].at_us);
    }
    rig.seen += cmd->reply;
    TEST_ASSERT_EQUAL_HEX8(0x0D, rig.out[rig.seen - 1].byte);
}

static void at_rest_every_command_answers_once(void)
{
    for (size_t i = 0; i < COMMANDS; i++) {
        begin(&commands[i]);
        send(commands[i].frame, commands[i].length);
        if (commands[i].lasts_us > 0) {
            sim_run_to(&rig, commands[i].lasts_us - 1);
            expect_nothing();
            TEST_ASSERT_EQUAL(DR_STATE_MOVING, rig.c.state);
            sim_run(&rig, 1);
        }
        expect_reply(&commands[i], commands[i].lasts_us);
        sim_run(&rig, 100000000);
        expect_idle();
        TEST_ASSERT_EQUAL(0, rig.c.kept_commands);
    }
}

/* A move that takes 4,000 us (TRIO 'x') or 3,334 us (MPC 'M' of X alone) and ends where it began on the other axes. */
static uint32_t move_x(dr_kind kind)
{
    if (kind == DR_TRIO) {
        send_axis('x', 320);
        return 4000;
    }
    send_point('M', 320, 160, 160);
    return 3334;
}

static void during_a_move_every_command_waits_for_its_end(void)
{
    for (size_t i = 0; i < COMMANDS; i++) {
        for (unsigned pieces = 0; pieces < 2; pieces++) {
            begin(&commands[i]);
            const uint32_t moving = move_x(commands[i].kind);
            sim_run(&rig, 100);
            for (unsigned k = 0; pieces && k < commands[i].length; k++) {
                send(&commands[i].frame[k], 1);
                sim_run(&rig, 100);
            }
            if (!pieces) {
                send(commands[i].frame, commands[i].length);
            }
            expect_nothing();
            TEST_ASSERT_EQUAL(1, rig.c.kept_commands);
            (void)expect_note(DR_NOTE_KEPT);
            sim_run_to(&rig, moving - 1);
            expect_nothing();
            sim_run_out(&rig);
            expect_cr(moving);
            expect_reply(&commands[i], rig.now_us); /* from where the move ended, at its end at the earliest */
            TEST_ASSERT_TRUE(rig.now_us >= moving);
            expect_idle();
        }
    }
}

static void while_a_reply_leaves_every_command_waits_for_its_last_byte(void)
{
    for (size_t i = 0; i < COMMANDS; i++) {
        begin(&commands[i]);
        rig.byte_us = 1000;
        send_code('C'); /* 14 bytes, the last of them at 13 ms */
        sim_run_to(&rig, 500);
        send(commands[i].frame, commands[i].length);
        TEST_ASSERT_EQUAL(1, rig.c.kept_commands);
        sim_run_to(&rig, 12999);
        TEST_ASSERT_EQUAL(13, rig.count);
        TEST_ASSERT_EQUAL(DR_STATE_REST, rig.c.state);
        sim_run_to(&rig, 13000);
        TEST_ASSERT_EQUAL(14, rig.count);
        TEST_ASSERT_EQUAL(commands[i].lasts_us > 0 ? DR_STATE_MOVING : DR_STATE_REST, rig.c.state);
        sim_run_out(&rig);
        TEST_ASSERT_EQUAL(14 + commands[i].reply, rig.count);
        const uint64_t over = commands[i].lasts_us > 1000 ? 13000 + commands[i].lasts_us : 14000;
        TEST_ASSERT_EQUAL_UINT64(over, rig.out[14].at_us);
        rig.seen = rig.count;
        expect_idle();
    }
}

static void without_power_nothing_answers(void)
{
    for (size_t i = 0; i < COMMANDS; i++) {
        begin(&commands[i]);
        rig.c.calibrates_at_power_on = false;
        TEST_ASSERT_TRUE(power(false));
        send(commands[i].frame, commands[i].length);
        send_code(3);
        sim_run(&rig, 1000000);
        expect_nothing();
        TEST_ASSERT_EQUAL(DR_STATE_OFF, rig.c.state);
        TEST_ASSERT_TRUE(power(true));
        expect_idle(); /* and none of it comes back */
        expect_at(0, 160, 160, 160);
        send_code('C');
        TEST_ASSERT_EQUAL(rig.seen + 14, rig.count);
    }
}

static void a_partial_command_waits_for_ever(void)
{
    for (size_t i = 0; i < COMMANDS; i++) {
        for (unsigned part = 1; part < commands[i].length; part++) {
            begin(&commands[i]);
            send(commands[i].frame, part);
            for (unsigned hour = 0; hour < 100; hour++) {
                sim_jump(&rig, UINT64_C(3600000000));
                sim_pump(&rig);
                expect_idle();
            }
            const uint64_t t = rig.now_us;
            send(commands[i].frame + part, (size_t)commands[i].length - part);
            sim_run_out(&rig);
            expect_reply(&commands[i], t + commands[i].lasts_us);
            expect_idle();

            begin(&commands[i]); /* only a power cycle clears it [M note 3] */
            rig.c.calibrates_at_power_on = false;
            send(commands[i].frame, part);
            TEST_ASSERT_TRUE(power(false));
            TEST_ASSERT_TRUE(power(true));
            send_code('C');
            TEST_ASSERT_EQUAL(14, rig.count);
            rig.seen = rig.count;
            expect_idle();
        }
    }
}

static void one_byte_at_a_time_is_the_same(void)
{
    for (size_t i = 0; i < COMMANDS; i++) {
        begin(&commands[i]);
        for (unsigned k = 0; k < commands[i].length; k++) {
            send(&commands[i].frame[k], 1);
        }
        sim_run_out(&rig);
        expect_reply(&commands[i], commands[i].lasts_us);
        expect_idle();
    }
}

/* -- Fillers and unknown bytes ---------------------------------------------------------------------------------------- */

static const dr_kind kinds[] = {DR_TRIO, DR_MPC};

static void at_160(dr_kind kind)
{
    if (kind == DR_TRIO) {
        trio_at(160, 160, 160);
    } else {
        mpc_at(160, 160, 160);
    }
}

static void cr_and_lf_between_commands_are_swallowed(void)
{
    for (unsigned i = 0; i < 2; i++) {
        at_160(kinds[i]);
        send_string("\r\n\r\r\n");
        expect_idle();
        TEST_ASSERT_EQUAL(0, rig.c.unknown_bytes);
        TEST_ASSERT_EQUAL_HEX8(0x0D, expect_note(DR_NOTE_FILLER).bytes[0]);
        TEST_ASSERT_EQUAL_HEX8(0x0A, expect_note(DR_NOTE_FILLER).bytes[0]);
        const uint32_t moving = move_x(kinds[i]);
        sim_run(&rig, 1);
        send_string("\r\n"); /* during a move too: no breach */
        TEST_ASSERT_EQUAL(0, rig.c.kept_commands);
        sim_run_out(&rig);
        expect_cr(moving);
        send_string("C\r");
        TEST_ASSERT_EQUAL(rig.seen + 14, rig.count);
    }
}

static void unknown_bytes_are_ignored_and_counted(void)
{
    for (unsigned i = 0; i < 2; i++) {
        at_160(kinds[i]);
        static const uint8_t strange[] = {0xEE, 0x22, 0x00, 0xFF, 0x5B, 0x5C, 0x20};
        send(strange, sizeof strange);
        expect_idle();
        TEST_ASSERT_EQUAL(7, rig.c.unknown_bytes);
        TEST_ASSERT_EQUAL_HEX8(0xEE, expect_note(DR_NOTE_UNKNOWN).bytes[0]);
        send_code('C'); /* the next byte starts a new frame */
        TEST_ASSERT_EQUAL(14, rig.count);
        rig.seen = rig.count;
        for (unsigned k = 0; k < 70000; k++) {
            sim_push(&rig, strange, 1);
        }
        TEST_ASSERT_EQUAL(65535, rig.c.unknown_bytes); /* stops counting */
        expect_idle();
    }
}

static void control_bytes_inside_a_frame_are_data(void)
{
    trio_at(0, 0, 0);
    send_axis('x', 0x0303);
    sim_run_out(&rig);
    expect_at(0, 0x0303, 0, 0);
    expect_cr(0x0303 * 25);
    send_axis('y', 0x0D0A);
    sim_run_out(&rig);
    expect_at(0, 0x0303, 0x0D0A, 0);
    expect_cr(rig.now_us);
    send_value('A', 13);
    expect_cr(rig.now_us);
    send_value('A', 3);
    expect_cr(rig.now_us);
    TEST_ASSERT_EQUAL(3, rig.c.angle_deg);
    expect_idle();

    mpc_at(0, 0, 0);
    send_point('M', 0x030303, 0, 0x0D0D);
    sim_run(&rig, 10);
    expect_nothing();                    /* nothing was interrupted */
    send_point('M', 0x03, 0x0D, 0x0303); /* nor while it waits */
    sim_run_out(&rig);
    expect_at(0, 0x03, 0x0D, 0x0303);
    TEST_ASSERT_EQUAL(2, rig.count);
}

/* -- Early commands --------------------------------------------------------------------------------------------------- */

static void early_commands_start_in_order_when_the_last_reply_has_left(void)
{
    mpc_at(0, 0, 0);
    rig.byte_us = 78;
    send_point('M', 16, 0, 0);
    send_string("CUK");
    send_point('M', 32, 0, 0);
    send_code('C');
    TEST_ASSERT_EQUAL(5, rig.c.kept_commands);
    sim_run_out(&rig);
    const uint64_t first = takes_us(16, 4, 3000);
    static const uint8_t between[] = {0x0D, 1,    16, 0, 0, 0, 0, 0,    0, 0,    0, 0,   0,
                                      0,    0x0D, 2,  1, 1, 0, 0, 0x0D, 1, 0x21, 3, 0x0D};
    for (unsigned k = 0; k < sizeof between; k++) {
        TEST_ASSERT_EQUAL_HEX8(between[k], rig.out[k].byte);
        TEST_ASSERT_EQUAL_UINT64(first + 78 * k, rig.out[k].at_us);
    }
    const uint64_t second = first + 78 * (sizeof between - 1) + first;
    TEST_ASSERT_EQUAL_UINT64(second, rig.out[25].at_us);
    TEST_ASSERT_EQUAL(26 + 14, rig.count);
    TEST_ASSERT_EQUAL_HEX8(32, rig.out[27].byte);
    rig.seen = rig.count;
    expect_idle();
}

static void sixty_four_bytes_are_kept_whole_or_lost_whole(void)
{
    mpc_at(0, 0, 0);
    send_point('M', 160, 0, 0);
    for (unsigned k = 0; k < 4; k++) {
        send_point('M', 160 + k, 0, 0);
    }
    TEST_ASSERT_EQUAL(52, rig.c.kept_bytes);
    send_point('M', 1, 1, 1); /* 65 with it: lost whole */
    TEST_ASSERT_EQUAL(52, rig.c.kept_bytes);
    TEST_ASSERT_EQUAL(13, rig.c.lost_bytes);
    TEST_ASSERT_EQUAL_UINT32(13, expect_note(DR_NOTE_LOST).value);
    send_string("CCCCCCCCCCCC"); /* 64: there was still room for these */
    TEST_ASSERT_EQUAL(64, rig.c.kept_bytes);
    TEST_ASSERT_EQUAL(13, rig.c.lost_bytes);
    send_code('C');
    TEST_ASSERT_EQUAL(14, rig.c.lost_bytes);
    send_string("M12345678901"); /* part of a frame takes no room; it is lost when it is whole */
    TEST_ASSERT_EQUAL(14, rig.c.lost_bytes);
    send_code('2');
    TEST_ASSERT_EQUAL(27, rig.c.lost_bytes);
    TEST_ASSERT_EQUAL(16, rig.c.kept_commands);
    sim_run_out(&rig);
    TEST_ASSERT_EQUAL(5 + 12 * 14, rig.count);
    expect_at(0, 163, 0, 0);
    rig.seen = rig.count;
    expect_idle();
    TEST_ASSERT_EQUAL(0, rig.c.kept_bytes);
    send_code('C'); /* and the line is as before */
    TEST_ASSERT_EQUAL(rig.seen + 14, rig.count);
}

static void counters_stop_at_65535(void)
{
    mpc_at(0, 0, 0);
    send_point('M', 400000, 0, 0);
    for (unsigned k = 0; k < 70000; k++) {
        const uint8_t c = 'C';
        sim_push(&rig, &c, 1);
    }
    TEST_ASSERT_EQUAL(65535, rig.c.lost_bytes);
    TEST_ASSERT_EQUAL(64, rig.c.kept_commands);
    TEST_ASSERT_EQUAL(64, rig.c.kept_bytes);
}

/* -- Interrupts between other things ---------------------------------------------------------------------------------- */

static void interrupt_goes_ahead_of_kept_commands(void)
{
    mpc_at(0, 0, 0);
    send_point('M', 1600, 0, 0);
    sim_run(&rig, 3334);
    send_string("CK\x03");
    expect_cr(3334);
    expect_mpc_position(3334, 1, 1600 * 3334 / 33334, 0, 0);
    static const uint8_t k[] = {1, 0x21, 3, 0x0D};
    expect(3334, k, 4);
    expect_idle();

    trio_at(0, 0, 0);
    send_line(15, 400, 0, 0);
    sim_run(&rig, 5000);
    send_string("c\x03");
    expect_cr(5000);
    expect_trio_position(5000, 200, 0, 0, 30);
    expect_idle();
}

static void an_idle_interrupt_gets_one_cr_after_the_reply_that_leaves(void)
{
    for (unsigned i = 0; i < 2; i++) {
        at_160(kinds[i]);
        rig.byte_us = 100;
        send_code('C');
        sim_run(&rig, 50);
        send_string("C\x03\x03"); /* ahead of the second C */
        sim_run_out(&rig);
        TEST_ASSERT_EQUAL(14 + 2 + 14, rig.count);
        TEST_ASSERT_EQUAL_HEX8(0x0D, rig.out[14].byte);
        TEST_ASSERT_EQUAL_HEX8(0x0D, rig.out[15].byte);
        TEST_ASSERT_EQUAL_HEX8(rig.out[0].byte, rig.out[16].byte);
        rig.seen = rig.count;
        expect_idle();
    }
}

static void an_interrupt_after_the_end_is_idle(void)
{
    for (unsigned late = 0; late < 3; late++) {
        mpc_at(0, 0, 0);
        send_point('M', 1600, 0, 0);
        const uint64_t end = 33334;
        sim_run_to(&rig, end - 1 + late);
        send_code(3);
        sim_run_out(&rig);
        if (late == 0) {
            expect_cr(end - 1); /* one in all */
            expect_at(0, 1599, 0, 0);
        } else {
            expect_cr(end);
            expect_cr(end - 1 + late); /* its own */
            expect_at(0, 1600, 0, 0);
        }
        expect_idle();
    }
}

static void many_interrupts_do_no_harm(void)
{
    for (unsigned i = 0; i < 2; i++) {
        at_160(kinds[i]);
        const uint8_t etx = 3;
        for (unsigned k = 0; k < 1000; k++) {
            sim_push(&rig, &etx, 1); /* nobody takes the replies */
        }
        TEST_ASSERT_TRUE(dr_controller_ready(&rig.c) > 0);
        sim_run_out(&rig);
        for (size_t k = 0; k < rig.count; k++) {
            TEST_ASSERT_EQUAL_HEX8(0x0D, rig.out[k].byte);
        }
        rig.seen = rig.count;
        send_code('C');
        TEST_ASSERT_EQUAL(rig.seen + 14, rig.count);
    }
}

/* -- What is told about the bytes that wait ----------------------------------------------------------------------------- */

static void answering_tells_whose_byte_is_next(void)
{
    mpc_at(0, 0, 0);
    bool first = false;
    TEST_ASSERT_EQUAL(DR_OP_NONE, dr_controller_answering(&rig.c, &first));
    const uint8_t bytes[] = {'C', 3, 'U'};
    sim_push(&rig, bytes, 3);
    TEST_ASSERT_EQUAL(15, dr_controller_ready(&rig.c));
    for (unsigned k = 0; k < 21; k++) {
        const dr_op op = dr_controller_answering(&rig.c, &first);
        TEST_ASSERT_EQUAL(k < 14 ? DR_OP_MPC_POSITION : k == 14 ? DR_OP_MPC_INTERRUPT : DR_OP_MPC_DRIVES, op);
        TEST_ASSERT_EQUAL(k == 0 || k == 14 || k == 15, first);
        uint8_t byte;
        TEST_ASSERT_EQUAL(1, dr_controller_pull(&rig.c, sim_clock(&rig), &byte, 1));
    }
    TEST_ASSERT_EQUAL(0, dr_controller_ready(&rig.c));
    send_point('M', 16, 0, 0);
    sim_jump(&rig, 1000);
    TEST_ASSERT_EQUAL(0, dr_controller_pull(&rig.c, sim_clock(&rig), NULL, 0));
    TEST_ASSERT_EQUAL(DR_OP_MPC_MOVE, dr_controller_answering(&rig.c, &first));
    TEST_ASSERT_TRUE(first);
}

static void tests(void)
{
    RUN_TEST(at_rest_every_command_answers_once);
    RUN_TEST(during_a_move_every_command_waits_for_its_end);
    RUN_TEST(while_a_reply_leaves_every_command_waits_for_its_last_byte);
    RUN_TEST(without_power_nothing_answers);
    RUN_TEST(a_partial_command_waits_for_ever);
    RUN_TEST(one_byte_at_a_time_is_the_same);
    RUN_TEST(cr_and_lf_between_commands_are_swallowed);
    RUN_TEST(unknown_bytes_are_ignored_and_counted);
    RUN_TEST(control_bytes_inside_a_frame_are_data);
    RUN_TEST(early_commands_start_in_order_when_the_last_reply_has_left);
    RUN_TEST(sixty_four_bytes_are_kept_whole_or_lost_whole);
    RUN_TEST(counters_stop_at_65535);
    RUN_TEST(interrupt_goes_ahead_of_kept_commands);
    RUN_TEST(an_idle_interrupt_gets_one_cr_after_the_reply_that_leaves);
    RUN_TEST(an_interrupt_after_the_end_is_idle);
    RUN_TEST(many_interrupts_do_no_harm);
    RUN_TEST(answering_tells_whose_byte_is_next);
}

int main(void)
{
    UNITY_BEGIN();
    at_every_clock(tests);
    return UNITY_END();
}
