/* What a host may send: rows 18 to 38 and 89 of the fault matrix. The monitors of bench.h run under every row. */
#include "bench.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static void still_works_trio(void)
{
    run_ms(60); /* RESYNC waits for 50 ms of silence */
    rig.heard_taken = rig.heard_count;
    host_line(15, 40800, 40000, 40000);
    run_ms(200);
    expect_cr();
    expect_tip(0, 40800, 40000, 40000);
    place_tip(0, 40000, 40000, 40000);
    run_ms(20);
    host_code('C'); /* the guard learns of it; no jump: knobs are not locked in these rows */
    run_ms(20);
    rig.heard_taken = rig.heard_count;
}

static void armed_trio(void)
{
    bench_trio();
    rig.limits.rig = 0;
    bench_start();
    bench_arm();
}

static void row_18_a_frame_cut_off_anywhere_is_dropped_and_the_next_works(void)
{
    uint8_t frame[14];
    armed_trio();
    const size_t length = put_line_frame(frame, 15, 40800, 40000, 40000);
    for (size_t cut = 1; cut < length; cut++) {
        const uint32_t before = rig.wire_count;
        host_bytes(frame, cut);
        run_ms(99);
        TEST_ASSERT_NULL(last_record(DR_EVENT_DROPPED));
        run_ms(2);
        const dr_record *dropped = last_record(DR_EVENT_DROPPED);
        TEST_ASSERT_NOT_NULL(dropped);
        TEST_ASSERT_EQUAL(DR_REASON_TORN, dropped->code);
        TEST_ASSERT_EQUAL(cut, dropped->count);
        TEST_ASSERT_EQUAL(before, rig.wire_count);
        still_works_trio();
        rig.log_count = 0;
    }
}

static void row_18_after_a_frame_cut_off_the_host_must_pause(void)
{
    armed_trio();
    host_code('S');
    run_ms(101);
    const uint32_t before = rig.wire_count;
    host_code('C');
    run_ms(20);
    TEST_ASSERT_EQUAL(before, rig.wire_count);
    run_ms(60);
    TEST_ASSERT_EQUAL(DR_REASON_RESYNC, last_record(DR_EVENT_DROPPED)->code);
    host_code('C');
    run_ms(20);
    TEST_ASSERT_EQUAL(before + 1, rig.wire_count);
}

static void row_18_a_frame_that_trickles_is_dropped_after_300_ms(void)
{
    uint8_t frame[14];
    armed_trio();
    put_line_frame(frame, 15, 40800, 40000, 40000);
    for (size_t i = 0; i < 5; i++) {
        host_bytes(frame + i, 1);
        run_ms(70);
    }
    TEST_ASSERT_NOT_NULL(last_record(DR_EVENT_DROPPED));
    host_bytes(frame + 5, 9); /* swallowed by RESYNC */
    still_works_trio();
}

static void row_19_a_byte_too_many_is_caught(void)
{
    uint8_t frame[15];
    static const uint8_t extra[] = {0x00, 0x03, 0x0D, 0x20, 0x7F, 0x80, 0xFF, 'S', 'C'};
    for (size_t at = 1; at < 14; at++)
        for (size_t e = 0; e < sizeof extra; e++) {
            armed_trio();
            rig.watch_tip = true;
            put_line_frame(frame, 15, 40800, 40000, 40000);
            memmove(frame + at + 1, frame + at, 14 - at);
            frame[at] = extra[e];
            host_bytes(frame, 15);
            run_ms(400); /* refused, or a target within the limits: the monitors watch */
            TEST_ASSERT_TRUE(status().state == DR_GUARD_IDLE || status().state == DR_GUARD_STOPPING ||
                             status().state == DR_GUARD_MOVING_S);
        }
}

static void row_20_a_lost_byte_never_lets_the_next_command_complete_the_frame(void)
{
    static const char next[] = "SHWxyzcCA";
    uint8_t frame[14];
    for (size_t lost = 1; lost < 14; lost++)
        for (size_t n = 0; n < sizeof next - 1; n++) {
            armed_trio();
            put_line_frame(frame, 15, 40800, 40000, 40000);
            memmove(frame + lost, frame + lost + 1, 13 - lost);
            host_bytes(frame, 13);
            host_code(next[n]);
            /* The command byte becomes the highest of Z: 0x41 or more; where the speed is lost, X's lowest takes its place. */
            expect_refused(lost == 1 ? DR_REASON_LEVEL : DR_REASON_RANGE);
            host_bytes("abcdefghijkl", 12);
            run_ms(100);
            TEST_ASSERT_EQUAL(0, status().forwarded);
        }
}

static void row_21_one_bit_flipped_stays_within_the_policies(void)
{
    uint8_t frame[14];
    uint32_t refused = 0, moved = 0, other = 0;
    for (unsigned bit = 0; bit < 14 * 8; bit++) {
        bench_trio();
        const uint8_t wall = keep_out(5050, 5200, 4000, 6000, 4000, 6000);
        rig.limits.obstacles[wall].exit = DR_TO_NONE;
        rig.limits.margin_q = 0;
        bench_start();
        bench_arm();
        put_line_frame(frame, 15, 40300, 40000, 40000);
        frame[bit / 8] ^= (uint8_t)(1u << bit % 8);
        host_bytes(frame, 14);
        run_ms(3000);
        uint32_t steps[DR_AXES];
        dr_controller_position(&rig.controller, 0, 0, steps);
        if (steps[0] == 40000 && steps[1] == 40000 && steps[2] == 40000)
            refused++;
        else if (steps[0] == 40300 && steps[1] == 40000 && steps[2] == 40000)
            other++; /* only the speed was changed */
        else
            moved++;
    }
    /* 112 flips; more of them: test_flips.c. The monitors hold for all. */
    TEST_ASSERT_EQUAL(112, refused + moved + other);
    TEST_ASSERT_LESS_THAN(45, moved);
    TEST_ASSERT_GREATER_THAN(60, refused);
}

static void row_22_a_host_with_the_wrong_byte_order_moves_nothing(void)
{
    uint32_t seed = 1;
    armed_trio();
    for (int i = 0; i < 200; i++) {
        uint8_t frame[14] = {'S', 15};
        for (size_t axis = 0; axis < 3; axis++) {
            seed = seed * 1664525u + 1013904223u;
            const uint32_t steps = 38000u + (seed >> 8) % 4000u;
            for (size_t b = 0; b < 4; b++)
                frame[2 + 4 * axis + b] = (uint8_t)(steps >> (8 * (3 - b)));
        }
        host_bytes(frame, 14);
        expect_refused(DR_REASON_RANGE);
        run_ms(60);
    }
    TEST_ASSERT_EQUAL(0, status().forwarded);
    expect_tip(0, 40000, 40000, 40000);
}

typedef enum { AS_LOCKED, AS_DISARMED, AS_IDLE, AS_MOVING, AS_STOPPING, AS_FAULT, AS_STOPPED, AS_STATES } in_state;

static void rig_in(in_state state, dr_kind kind)
{
    if (kind == DR_TRIO)
        bench_trio();
    else
        bench_mpc();
    if (state == AS_LOCKED) {
        rig.by_hand = true;
        bench_start();
        run_ms(100);
        expect_state(DR_GUARD_LOCKED);
        return;
    }
    bench_start();
    if (state == AS_DISARMED)
        return;
    bench_arm();
    if (state == AS_MOVING || state == AS_STOPPING) {
        const uint32_t start = kind == DR_TRIO ? 40000 : 80000;
        host_line(0, start + 8000, start, start);
        run_ms(100);
        expect_state(DR_GUARD_MOVING_S);
    }
    if (state == AS_STOPPING) {
        host_code(3);
        run_ms(1);
        expect_state(DR_GUARD_STOPPING);
    }
    if (state == AS_STOPPED || state == AS_FAULT) {
        stop_input(true);
        run_ms(400);
        expect_state(DR_GUARD_STOPPED);
    }
    if (state == AS_FAULT) {
        input(DR_INPUT_STOP_2, false);
        run_ms(60);
        expect_fault(DR_FAULT_STOP_WIRING);
    }
    rig.heard_taken = rig.heard_count;
}

/* All first bytes in all states, on both controllers: those that are no command are dropped and cause RESYNC; none but
 * queries, settings where they may, and ^C go out. */
static void row_23_all_first_bytes_in_all_states(void)
{
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++)
        for (int state = AS_LOCKED; state < AS_STATES; state++)
            for (int byte = 0; byte < 256; byte++) {
                dr_command command;
                rig_in((in_state)state, (dr_kind)kind);
                const bool known = dr_command_find((dr_kind)kind, rig.limits.firmware, (uint8_t)byte, &command);
                const uint32_t before = rig.wire_count;
                host_code(byte);
                run_us(500); /* before anything else of the guard's own is due */
                uint32_t passed = rig.wire_count - before;
                if (known && (command.is & DR_IS_INTERRUPT) != 0) {
                    TEST_ASSERT_EQUAL_MESSAGE(1, passed, "^C passes in every state");
                } else if (known && command.args == DR_ARGS_NONE && (command.is & DR_IS_QUERY) != 0) {
                    const bool quiet =
                        state == AS_DISARMED || state == AS_IDLE || state == AS_FAULT || state == AS_STOPPED;
                    TEST_ASSERT_EQUAL_MESSAGE(quiet ? 1 : 0, passed, "queries pass when it is quiet");
                } else if (known && command.args == DR_ARGS_NONE && (command.is & DR_IS_SETTING) != 0 && byte != 'O') {
                    TEST_ASSERT_EQUAL(state == AS_DISARMED || state == AS_IDLE ? 1 : 0, passed);
                } else {
                    TEST_ASSERT_EQUAL_MESSAGE(0, passed, "nothing else begins to leave");
                }
                const bool filler = byte == 0 || byte == 0x0D || byte == 0x0A || byte == 0xF0 || byte == 0xFF;
                TEST_ASSERT_EQUAL((!known && !filler) || (known && byte == 'O'), rig.guard.resync);
            }
}

static void row_24_clients_that_append_cr(void)
{
    armed_trio();
    host_bytes("C\r", 2);
    run_ms(10);
    TEST_ASSERT_EQUAL(14, rig.heard_count - rig.heard_taken);
    rig.heard_taken = rig.heard_count;
    host_line(15, 40800, 40000, 40000);
    host_code('\r');
    run_ms(200);
    expect_cr();
    expect_silence();
    expect_tip(0, 40800, 40000, 40000);
    TEST_ASSERT_FALSE(rig.guard.resync);
}

static void row_25_junk_of_an_opening_port(void)
{
    static const uint8_t junk[] = {0xF0, 0xFF, 0x00, 0x0A, 0x0D};
    armed_trio();
    for (unsigned n = 1; n <= 512; n++)
        host_bytes(&junk[n % sizeof junk], 1);
    host_line(15, 40800, 40000, 40000);
    run_ms(200);
    expect_cr();
    TEST_ASSERT_EQUAL(0, status().refused);
}

static void row_26_a_client_of_a_trio_at_an_mpc(void)
{
    uint8_t frame[13];
    bench_armed_mpc();
    put_point_frame(frame, 'H', 81000, 80000, 80000);
    host_bytes(frame, 13); /* 'H' is a hidden target; the rest is eaten */
    run_ms(100);
    host_axis('Y', 81000);
    run_ms(100);
    host_axis('x', 81000);
    run_ms(100);
    host_value('A', 30);
    run_ms(100);
    TEST_ASSERT_EQUAL(0, status().forwarded);
    expect_tip(0, 80000, 80000, 80000);
    expect_silence();
}

static void row_27_a_client_of_an_mpc_at_a_trio(void)
{
    uint8_t frame[13];
    armed_trio();
    put_point_frame(frame, 'M', 0x48004868, 0x52777868, 0x03030303); /* its payload would be commands */
    host_bytes(frame, 13);
    run_ms(100);
    host_code('K');
    run_ms(100);
    host_code('U');
    run_ms(100);
    host_value('I', 1);
    run_ms(100);
    TEST_ASSERT_EQUAL(0, status().forwarded);
    TEST_ASSERT_EQUAL(0, wire_stops());
    still_works_trio();
}

static void row_28_ctrl_c_within_a_frame_that_is_written_while_it_moves_stops(void)
{
    for (size_t at = 0; at <= 14; at++) {
        uint8_t frame[15];
        bench_armed_mpc();
        host_line(0, 88000, 80000, 80000);
        run_ms(100);
        expect_state(DR_GUARD_MOVING_S);
        put_line_frame(frame, 3, 81000, 80000, 80000);
        memmove(frame + at + 1, frame + at, 14 - at);
        frame[at] = 3;
        host_bytes(frame, 15);
        expect_state(DR_GUARD_STOPPING);
        run_ms(600);
        expect_state(DR_GUARD_IDLE);
        TEST_ASSERT_EQUAL(1, status().forwarded);
    }
}

static void row_28_ctrl_c_within_a_frame_at_rest_is_data_and_the_frame_is_refused(void)
{
    for (unsigned ms = 0; ms <= 30; ms++) { /* acq4: ^C from another thread in the pause after the speed */
        uint8_t frame[14];
        bench_armed_mpc();
        put_line_frame(frame, 3, 82000, 80000, 80000);
        host_bytes(frame, 2);
        run_ms(ms);
        host_code(3);
        run_ms(30 - ms);
        host_bytes(frame + 2, 12);
        run_ms(300);
        expect_refused(DR_REASON_RANGE); /* 82000 * 256 + 3 */
        expect_tip(0, 80000, 80000, 80000);
        TEST_ASSERT_EQUAL(0, status().forwarded);
    }
}

static void row_28_ctrl_c_while_a_motion_is_checked_cancels_it(void)
{
    for (unsigned us = 0; us < 8000; us += 100) {
        bench_armed_trio();
        host_line(15, 44000, 40000, 40000);
        run_us(us);
        const dr_guard_state state = (dr_guard_state)status().state;
        host_code(3);
        run_ms(600);
        expect_state(DR_GUARD_IDLE);
        expect_cr();
        expect_silence();
        if (state == DR_GUARD_CHECKING) {
            expect_refused(DR_REASON_CANCELLED);
            expect_tip(0, 40000, 40000, 40000);
        }
    }
}

static void row_29_0x03_as_data_is_data(void)
{
    armed_trio();
    host_line(3, 0x9C03, 0x9D03, 0x9C03);
    run_ms(700);
    expect_cr();
    expect_tip(0, 0x9C03, 0x9D03, 0x9C03);
    TEST_ASSERT_EQUAL(0, wire_stops());
}

static void row_30_fifteen_ctrl_c_running(void)
{
    static const uint8_t fifteen[15] = {3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3};
    bench_armed_mpc();
    host_bytes(fifteen, 15); /* idle */
    run_ms(50);
    expect_heard("\r\r\r\r\r\r\r\r\r\r\r\r\r\r\r", 15);
    expect_state(DR_GUARD_IDLE);
    host_line(0, 88000, 80000, 80000); /* moving */
    run_ms(100);
    host_bytes(fifteen, 15);
    run_ms(600);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_EQUAL(15, rig.heard_count - rig.heard_taken);
    rig.heard_taken = rig.heard_count;
    host_line(0, 84000, 80000, 80000); /* checking */
    host_bytes(fifteen, 15);
    run_ms(600);
    expect_state(DR_GUARD_IDLE);
    expect_fault(DR_FAULT_NONE);
    host_code('C');
    run_ms(10);
    const uint32_t heard = rig.heard_count - rig.heard_taken;
    TEST_ASSERT_EQUAL_HEX8(1, rig.heard[rig.heard_count - 14]); /* the query's answer is whole: drive 1 ... CR */
    TEST_ASSERT_TRUE(heard >= 15 && heard <= 29);
}

static void row_31_a_command_while_moving_is_dropped_whole_and_not_done_later(void)
{
    static const char codes[] = "SMCKULFOIHYN";
    for (size_t c = 0; c < sizeof codes - 1; c++)
        for (unsigned ms = 45; ms < 130; ms += 7) {
            uint8_t frame[14] = {(uint8_t)codes[c]};
            dr_command command;
            bench_armed_mpc();
            host_line(8, 81600, 80000, 80000); /* 100 um at 731 um/s: 137 ms */
            run_ms(ms);
            TEST_ASSERT_TRUE(status().state == DR_GUARD_MOVING_S);
            const uint32_t before = rig.wire_count;
            TEST_ASSERT_TRUE(dr_command_find(DR_MPC, 0x0321, frame[0], &command));
            if (codes[c] == 'I')
                frame[1] = 2;
            if (codes[c] == 'L')
                frame[1] = 5;
            host_bytes(frame, 1u + command.args);
            TEST_ASSERT_EQUAL(before, rig.wire_count);
            TEST_ASSERT_TRUE(status().refused > 0);
            run_ms(500);
            expect_tip(0, 81600, 80000, 80000);
            expect_cr();
            expect_silence();
            TEST_ASSERT_EQUAL(1, status().forwarded);
        }
}

static void row_31_on_a_trio_too(void)
{
    static const char codes[] = "SHWxyzhwcCAR";
    for (int stoppable = 0; stoppable < 2; stoppable++)
        for (size_t c = 0; c < sizeof codes - 1; c++)
            for (unsigned ms = 12; ms < 120; ms++) {
                uint8_t frame[14] = {(uint8_t)codes[c], 37};
                dr_command command;
                bench_armed_trio();
                if (stoppable == 1)
                    host_line(4, 41600, 40000, 40000); /* 200 um at 1,563 um/s: 128 ms */
                else
                    host_axis('x', 44800); /* 600 um at 5 mm/s: 120 ms */
                run_ms(ms);
                TEST_ASSERT_EQUAL(stoppable == 1 ? DR_GUARD_MOVING_S : DR_GUARD_MOVING_U, status().state);
                const uint32_t before = rig.wire_count;
                const uint8_t angle_deg = rig.controller.angle_deg;
                TEST_ASSERT_TRUE(dr_command_find(DR_TRIO, DR_FIRMWARE_TRIO, frame[0], &command));
                host_bytes(frame, 1u + command.args);
                TEST_ASSERT_EQUAL(before, rig.wire_count);
                TEST_ASSERT_EQUAL(1, status().refused);
                run_ms(400);
                expect_tip(0, stoppable == 1 ? 41600 : 44800, 40000, 40000);
                TEST_ASSERT_EQUAL(angle_deg, rig.controller.angle_deg); /* row 36: no angle while it moves */
                expect_cr();
                expect_silence();
                TEST_ASSERT_EQUAL(1, status().forwarded);
            }
}

static void row_32_a_flood_of_random_bytes(void)
{
    uint32_t seed = 7;
    bench_armed_mpc();
    for (uint32_t i = 0; i < 60000; i++) {
        seed = seed * 1664525u + 1013904223u;
        const uint8_t byte = (uint8_t)(seed >> 24);
        rig.sent_count = rig.sent_count > 60000 ? 0 : rig.sent_count;
        rig.wire_count = rig.wire_taken = 0; /* the monitors have seen it */
        rig.heard_count = rig.heard_taken = 0;
        host_bytes(&byte, 1);
        run_us(i % 1000 == 0 ? 60000 : 1);
    }
    run_ms(1000);
    expect_fault(DR_FAULT_NONE);
    expect_state(DR_GUARD_IDLE);
}

static void row_33_two_hosts_on_one_port(void)
{
    uint32_t seed = 3;
    bench_armed_mpc();
    for (int i = 0; i < 300; i++) {
        uint8_t first[14], second[13];
        put_line_frame(first, 9, 80000 + (unsigned)i, 80000, 80000);
        put_point_frame(second, 'M', 80000, 80000 + (unsigned)i, 80000);
        for (size_t a = 0, b = 0; a < 14 || b < 13;) {
            seed = seed * 1664525u + 1013904223u;
            rig.wire_count = rig.wire_taken = 0;
            rig.heard_count = rig.heard_taken = 0;
            if (((seed >> 28) & 1u) != 0 && a < 14)
                host_bytes(&first[a++], 1);
            else if (b < 13)
                host_bytes(&second[b++], 1);
            run_us(seed >> 18);
        }
    }
    run_ms(2000);
    TEST_ASSERT_EQUAL(DR_GUARD_IDLE, status().state);
    host_code('C');
    run_ms(10);
    TEST_ASSERT_EQUAL(14, rig.heard_count - rig.heard_taken);
}

static void row_34_a_frame_in_fourteen_usb_packets(void)
{
    uint8_t frame[14];
    armed_trio();
    put_line_frame(frame, 15, 40800, 40000, 40000);
    for (size_t i = 0; i < 14; i++) {
        host_bytes(frame + i, 1);
        run_ms(16);
    }
    run_ms(200);
    expect_cr();
    expect_tip(0, 40800, 40000, 40000);
}

static void row_37_streamed_positions_do_not_end_the_move(void)
{
    bench_mpc();
    rig.limits.rig |= DR_RIG_MAY_STREAM;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        rig.drives[0].position_steps[axis] = 0x0D0D0; /* 0x0D in the data */
    rig.watch_tip = true;
    rig.limits.drives[0].box_q = (dr_box){{0, 0, 0}, {1600000, 1600000, 1600000}};
    bench_start();
    bench_arm();
    host_code('O');
    run_ms(10);
    expect_cr();
    host_line(3, 0x0D0D0 + 320, 0x0D0D0, 0x0D0D0); /* 20 um */
    run_ms(400);
    TEST_ASSERT_EQUAL(20 * 12 + 1, rig.heard_count - rig.heard_taken);
    expect_tip(0, 0x0D0D0 + 320, 0x0D0D0, 0x0D0D0);
    expect_state(DR_GUARD_IDLE);
}

static void row_37_a_stream_that_was_not_allowed_is_kept_from_the_host(void)
{
    bench_mpc();
    rig.controller.quirks = DR_QUIRK_STREAM_AT_POWER_UP;
    bench_start();
    bench_arm();
    host_line(3, 80320, 80000, 80000);
    run_ms(400);
    expect_cr();
    expect_silence();
    expect_state(DR_GUARD_IDLE);
}

static void row_38_drives_that_may_not_be_chosen_are_answered_by_e_cr(void)
{
    static const uint8_t drives[] = {0, 3, 4, 5, 255, '1'};
    bench_armed_mpc();
    for (size_t i = 0; i < sizeof drives; i++) {
        const uint32_t before = rig.wire_count;
        host_value('I', drives[i]);
        run_ms(10);
        expect_heard("E\r", 2);
        TEST_ASSERT_EQUAL(before, rig.wire_count);
        TEST_ASSERT_EQUAL(0, rig.controller.active);
    }
    host_value('I', 2);
    run_ms(10);
    expect_heard("\2\r", 2);
    host_point('M', 80160, 80000, 80000);
    run_ms(300);
    expect_cr();
    expect_tip(1, 80160, 80000, 80000);
}

static void row_89_a_query_while_moving_never_reaches_the_controller(void)
{
    bench_mpc();
    rig.controller.quirks = DR_QUIRK_QUERY_WEDGES;
    bench_start();
    bench_arm();
    host_point('M', 88000, 80000, 80000);
    run_ms(50);
    for (int i = 0; i < 10; i++) {
        host_code('C');
        run_ms(10);
    }
    run_ms(500);
    expect_cr();
    expect_silence();
    TEST_ASSERT_EQUAL(DR_STATE_REST, rig.controller.state);
}

static void refusal_by_e_answers_refused_motions_only(void)
{
    bench_mpc();
    rig.limits.refusal = DR_REFUSE_E;
    bench_start();
    bench_arm();
    host_point('M', 400000, 80000, 80000); /* beyond the box */
    run_ms(50);
    expect_heard("E", 1);
    host_code('O');
    run_ms(100);
    expect_silence();
    host_point('M', 88000, 80000, 80000);
    run_ms(20);
    host_point('M', 80000, 80000, 80000); /* busy: an 'E' would look like the first one's answer */
    run_ms(400);
    expect_cr();
    expect_silence();
}

static void rate_no_more_than_twenty_motions_at_once(void)
{
    bench_armed_mpc();
    for (unsigned i = 0; i < 20; i++) {
        host_point('M', 80000 + 32 * (i % 2 + 1), 80000, 80000);
        run_ms(25);
    }
    uint32_t refused = 0;
    for (unsigned i = 0; i < 60; i++) {
        host_point('M', 80000 + 32 * (i % 2 + 1), 80000, 80000);
        run_ms(25);
        refused += status().last_refusal.reason == DR_REASON_RATE ? 1 : 0;
    }
    TEST_ASSERT_GREATER_THAN(0, refused);
    run_ms(1000);
    host_point('M', 81000, 80000, 80000);
    run_ms(200);
    expect_tip(0, 81000, 80000, 80000);
}

static void row_79_an_error_of_the_line_drops_the_frame(void)
{
    uint8_t frame[14];
    armed_trio();
    put_line_frame(frame, 15, 40800, 40000, 40000);
    host_bytes(frame, 7);
    dr_guard_host_line_error(&rig.guard, (dr_us)(rig.clock_at_start + rig.now));
    host_bytes(frame + 7, 7);
    still_works_trio();
    TEST_ASSERT_EQUAL(1, last_record(DR_EVENT_DROPPED) != NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(row_18_a_frame_cut_off_anywhere_is_dropped_and_the_next_works);
    RUN_TEST(row_18_after_a_frame_cut_off_the_host_must_pause);
    RUN_TEST(row_18_a_frame_that_trickles_is_dropped_after_300_ms);
    RUN_TEST(row_19_a_byte_too_many_is_caught);
    RUN_TEST(row_20_a_lost_byte_never_lets_the_next_command_complete_the_frame);
    RUN_TEST(row_21_one_bit_flipped_stays_within_the_policies);
    RUN_TEST(row_22_a_host_with_the_wrong_byte_order_moves_nothing);
    RUN_TEST(row_23_all_first_bytes_in_all_states);
    RUN_TEST(row_24_clients_that_append_cr);
    RUN_TEST(row_25_junk_of_an_opening_port);
    RUN_TEST(row_26_a_client_of_a_trio_at_an_mpc);
    RUN_TEST(row_27_a_client_of_an_mpc_at_a_trio);
    RUN_TEST(row_28_ctrl_c_within_a_frame_that_is_written_while_it_moves_stops);
    RUN_TEST(row_28_ctrl_c_within_a_frame_at_rest_is_data_and_the_frame_is_refused);
    RUN_TEST(row_28_ctrl_c_while_a_motion_is_checked_cancels_it);
    RUN_TEST(row_29_0x03_as_data_is_data);
    RUN_TEST(row_30_fifteen_ctrl_c_running);
    RUN_TEST(row_31_a_command_while_moving_is_dropped_whole_and_not_done_later);
    RUN_TEST(row_31_on_a_trio_too);
    RUN_TEST(row_32_a_flood_of_random_bytes);
    RUN_TEST(row_33_two_hosts_on_one_port);
    RUN_TEST(row_34_a_frame_in_fourteen_usb_packets);
    RUN_TEST(row_37_streamed_positions_do_not_end_the_move);
    RUN_TEST(row_37_a_stream_that_was_not_allowed_is_kept_from_the_host);
    RUN_TEST(row_38_drives_that_may_not_be_chosen_are_answered_by_e_cr);
    RUN_TEST(row_89_a_query_while_moving_never_reaches_the_controller);
    RUN_TEST(refusal_by_e_answers_refused_motions_only);
    RUN_TEST(rate_no_more_than_twenty_motions_at_once);
    RUN_TEST(row_79_an_error_of_the_line_drops_the_frame);
    return UNITY_END();
}
