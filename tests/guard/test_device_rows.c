/* What a controller may do: rows 39 to 57 and 83 to 89 of the fault matrix, on a controller that misbehaves to order. */
#include "bench.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/* A TRIO at 8 steps/um that does what the test says. */
static struct {
    uint32_t at[3], from[3], to[3];
    uint64_t began, lasts;
    bool moves;
    bool silent, ignores_stop, no_cr, stops_short;
    unsigned cr_at_percent; /* of the move; 100: at its end */
    bool cr_said;
    const char *stop_says; /* what ^C is answered with */
    unsigned extra_crs;
    int reply_length;        /* 14; fewer or more bytes of a position reply */
    int bad_byte, bad_value; /* of it: index and value; -1: none */
    unsigned bad_replies;    /* how many replies to spoil so */
    dr_framer framer;
} fake;

static void fake_at(uint32_t *steps)
{
    for (int axis = 0; axis < 3; axis++) {
        const uint64_t done = rig.now - fake.began;
        steps[axis] = !fake.moves || done >= fake.lasts
                          ? (fake.moves ? fake.to[axis] : fake.at[axis])
                          : (uint32_t)((int64_t)fake.from[axis] + ((int64_t)fake.to[axis] - (int64_t)fake.from[axis]) *
                                                                      (int64_t)done / (int64_t)fake.lasts);
    }
}

static void fake_rest(void)
{
    uint32_t steps[3];
    fake_at(steps);
    memcpy(fake.at, steps, sizeof steps);
    fake.moves = false;
}

static void fake_reply(void)
{
    uint32_t steps[3];
    uint8_t reply[20];
    fake_at(steps);
    for (int i = 0; i < 12; i++)
        reply[i] = (uint8_t)(steps[i / 4] >> (8 * (i % 4)));
    reply[12] = 30;
    reply[13] = reply[14] = reply[15] = '\r';
    size_t length = 14;
    if (fake.bad_replies > 0) {
        fake.bad_replies--;
        length = (size_t)fake.reply_length;
        if (fake.bad_byte >= 0)
            reply[fake.bad_byte] = (uint8_t)fake.bad_value;
    }
    device_says(reply, length);
}

static void fake_step(void)
{
    for (int byte = wire_next(); byte >= 0; byte = wire_next()) {
        dr_command command;
        if (dr_framer_push(&fake.framer, DR_TRIO, DR_FIRMWARE_TRIO, (uint8_t)byte, &command) != DR_FRAMED_WHOLE ||
            fake.silent)
            continue;
        const dr_request request = dr_wire_get_request(&command, fake.framer.bytes);
        if (command.op == DR_OP_TRIO_POSITION) {
            fake_reply();
        } else if ((command.is & DR_IS_INTERRUPT) != 0) {
            if (fake.moves && fake.ignores_stop)
                continue;
            fake_rest();
            device_says(fake.stop_says, strlen(fake.stop_says));
        } else if ((command.is & DR_IS_MOTION) != 0) {
            const uint8_t only = dr_wire_axis((dr_op)command.op);
            fake_rest();
            memcpy(fake.from, fake.at, sizeof fake.at);
            memcpy(fake.to, fake.at, sizeof fake.at);
            for (uint8_t axis = 0; axis < 3; axis++)
                if (only == DR_AXES || only == axis)
                    fake.to[axis] = request.steps[axis];
            if (fake.stops_short)
                fake.to[0] -= 3;
            fake.began = rig.now;
            fake.moves = true;
            fake.cr_said = false;
        } else {
            device_says("\r", 1);
        }
    }
    if (fake.moves && !fake.cr_said && rig.now - fake.began >= fake.lasts * fake.cr_at_percent / 100) {
        fake.cr_said = true;
        if (!fake.no_cr)
            for (unsigned i = 0; i <= fake.extra_crs; i++)
                device_says("\r", 1);
    }
    if (fake.moves && rig.now - fake.began >= fake.lasts)
        fake_rest();
}

static void fake_ms(unsigned ms)
{
    for (unsigned i = 0; i < ms * 10; i++) {
        run_us(100);
        fake_step();
    }
}

/* With what the test has added to bench_trio(). */
static void fake_rig_as_set(void)
{
    rig.by_hand = true;
    memset(&fake, 0, sizeof fake);
    fake.at[0] = fake.at[1] = fake.at[2] = 40000;
    fake.lasts = 200000;
    fake.cr_at_percent = 100;
    fake.stop_says = "\r";
    fake.bad_byte = -1;
    bench_start();
    fake_ms(1100);
    expect_state(DR_GUARD_DISARMED);
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    fake_ms(150);
    expect_state(DR_GUARD_IDLE);
}

static void fake_rig(void)
{
    bench_trio();
    fake_rig_as_set();
}

/* A line of 500 um, of which `ms` have passed. */
static void fake_move(unsigned ms)
{
    host_line(8, 44000, 40000, 40000);
    fake_ms(ms);
}

static void the_controller_to_order_works_when_nothing_is_ordered(void)
{
    fake_rig();
    fake_move(300);
    expect_cr();
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_EQUAL(44000, fake.at[0]);
}

static void row_39_a_lost_cr(void)
{
    fake_rig();
    fake.no_cr = true;
    fake_move(3000);
    expect_state(DR_GUARD_FAULT);
    TEST_ASSERT_EQUAL(DR_NEEDS_CLEAR, status().needs);
    expect_fault(DR_FAULT_NO_CR);
    expect_silence();
    TEST_ASSERT_TRUE(wire_stops() >= 1);
    TEST_ASSERT_TRUE(status().position_known);
    TEST_ASSERT_EQUAL(44000, status().position_steps[0]);
}

static void row_40_a_late_cr_is_not_forwarded(void)
{
    for (unsigned late_s = 1; late_s <= 10; late_s += 3) {
        fake_rig();
        fake.no_cr = true;
        fake_move(3000);
        fake_ms(late_s * 1000);
        device_says("\r", 1);
        fake_ms(1100);
        expect_silence();
        expect_fault(DR_FAULT_NO_CR);
        TEST_ASSERT_NOT_NULL(last_record(DR_EVENT_QUARANTINED));
    }
}

static void row_41_of_many_crs_one_is_forwarded(void)
{
    for (unsigned extra = 1; extra <= 5; extra++) {
        fake_rig();
        fake.extra_crs = extra;
        fake_move(400);
        expect_cr();
        expect_silence();
        expect_state(DR_GUARD_IDLE);
        host_code('c');
        fake_ms(10);
        TEST_ASSERT_EQUAL(14, rig.heard_count - rig.heard_taken);
    }
}

static void row_42_a_cr_before_the_end(void)
{
    for (unsigned percent = 0; percent < 50; percent += 5) {
        fake_rig();
        fake.lasts = 400000;
        fake.cr_at_percent = percent;
        fake_move(1000);
        expect_state(DR_GUARD_FAULT);
        expect_fault(DR_FAULT_EARLY_CR);
        expect_silence();
        TEST_ASSERT_TRUE(wire_stops() >= 1);
        TEST_ASSERT_FALSE(fake.moves);
        TEST_ASSERT_NOT_EQUAL(44000, fake.at[0]);
    }
    /* So late that the tip is there at the second look: not believed either, but nothing moves. */
    fake_rig();
    fake.cr_at_percent = 80;
    fake_move(1000);
    TEST_ASSERT_EQUAL(44000, fake.at[0]);
}

static void row_43_answers_to_ctrl_c_of_all_kinds(void)
{
    static const char *const says[] = {"", "\r", "\r\r", "I", "I\r", "=", "=\r", "I\r\r", "=\r\r"};
    for (size_t i = 0; i < sizeof says / sizeof *says; i++) {
        fake_rig();
        fake.stop_says = says[i];
        fake_move(100);
        expect_state(DR_GUARD_MOVING_S);
        host_code(3);
        fake_ms(1200);
        expect_state(DR_GUARD_IDLE);
        expect_fault(DR_FAULT_NONE);
        if (strchr(says[i], '\r') != NULL)
            expect_cr();
        expect_silence(); /* one CR if there was one, never an 'I' or '=' */
    }
}

static void row_44_one_bad_position_reply_is_asked_for_again_two_are_a_fault(void)
{
    static const struct {
        int length, byte, value;
    } bad[] = {{13, -1, 0}, {1, -1, 0}, {14, 13, 'x'}, {14, 12, 91}, {14, 3, 0x0D}, {14, 7, 1}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        for (unsigned times = 1; times <= 2; times++) {
            fake_rig();
            fake.reply_length = bad[i].length;
            fake.bad_byte = bad[i].byte;
            fake.bad_value = bad[i].value;
            fake.bad_replies = times;
            fake_move(1000);
            if (times == 1) {
                expect_cr();
                expect_state(DR_GUARD_IDLE);
            } else {
                expect_silence();
                expect_fault(DR_FAULT_IMPLAUSIBLE);
                expect_refused(DR_REASON_NO_POSITION);
                TEST_ASSERT_EQUAL(40000, fake.at[0]);
            }
        }
}

static void row_44_a_reply_that_is_too_long_is_asked_for_again(void)
{
    fake_rig();
    fake.reply_length = 15;
    fake.bad_replies = 1;
    fake_move(1000);
    expect_cr();
    TEST_ASSERT_EQUAL(44000, fake.at[0]);
    fake_rig();
    fake.reply_length = 15;
    fake.bad_replies = 2;
    fake_move(1000);
    expect_silence();
    expect_fault(DR_FAULT_IMPLAUSIBLE);
    TEST_ASSERT_EQUAL(40000, fake.at[0]);
}

static void row_44_a_0x0d_within_a_coordinate_ends_nothing(void)
{
    fake_rig();
    fake.at[0] = fake.at[1] = 0x0D0D;
    fake_ms(25000); /* by knob */
    host_code('c');
    fake_ms(10);
    TEST_ASSERT_EQUAL(14, rig.heard_count - rig.heard_taken);
    rig.heard_taken = rig.heard_count;
}

static void row_44_a_host_gets_nonsense_and_the_guard_asks_itself(void)
{
    fake_rig();
    fake.reply_length = 14;
    fake.bad_byte = 12;
    fake.bad_value = 91;
    fake.bad_replies = 1;
    host_code('c');
    fake_ms(300);
    expect_state(DR_GUARD_IDLE);
    TEST_ASSERT_EQUAL(14, rig.heard_count - rig.heard_taken); /* as it came */
    fake.bad_replies = 3;
    host_code('c');
    fake_ms(500);
    expect_fault(DR_FAULT_IMPLAUSIBLE);
}

static void row_45_impossible_drives(void)
{
    static const uint8_t drives[] = {0, 5, 'E', 255};
    for (size_t i = 0; i < sizeof drives; i++) {
        bench_armed_mpc();
        rig.by_hand = true;
        host_point('M', 81000, 80000, 80000);
        for (int times = 0; times < 2; times++) {
            const uint8_t reply[14] = {drives[i], 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x0D};
            run_ms(120);
            device_says(reply, 14);
        }
        run_ms(10);
        expect_fault(DR_FAULT_IMPLAUSIBLE);
        expect_refused(DR_REASON_NO_POSITION);
    }
}

/* X of the next position reply arrives with one bit flipped: 80,000 is read as 96,384. */
static uint32_t flips_at;
static int flip_x(bench *b, uint8_t byte) { return b->said == flips_at ? byte ^ 0x40 : byte; }

static void row_45_a_flipped_bit_in_a_reading_lets_no_motion_through_an_obstacle(void)
{
    bench_mpc();
    rig.limits.rig = 0; /* a knob could have moved it there */
    keep_out(5100, 5200, 0, 25000, 0, 25000);
    bench_start();
    bench_arm();
    run_ms(5000);
    flips_at = rig.said + 3; /* drive, X's lowest byte, this one */
    rig.spoil = flip_x;
    host_point('M', 96000, 80000, 80000);
    run_ms(3000);
    expect_silence();
    expect_refused(DR_REASON_NO_POSITION);
    expect_fault(DR_FAULT_POSITION_JUMP);
    expect_tip(0, 80000, 80000, 80000);
}

/* The test is a TRIO at 40,000 on each axis and 30 degrees. */
static void arm_at_40000_by_hand(void)
{
    rig.by_hand = true;
    bench_start();
    run_ms(1000);
    device_at(40000, 40000, 40000, 30);
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    for (int reading = 0; reading < 2; reading++) {
        run_ms(102);
        device_at(40000, 40000, 40000, 30);
    }
}

static void row_58_a_knob_that_is_being_turned_is_read_twice(void)
{
    bench_trio();
    rig.limits.rig = 0;
    arm_at_40000_by_hand();
    host_axis('x', 41000);
    run_ms(4);
    device_at(40100, 40000, 40000, 30);
    expect_state(DR_GUARD_CHECKING);
    run_ms(4);
    device_at(40110, 40000, 40000, 30); /* 1.25 um on: as a knob can */
    run_ms(5);
    expect_state(DR_GUARD_MOVING_U);
    device_says("\r", 1);
    run_ms(4);
    device_at(41000, 40000, 40000, 30);
    expect_cr();
    host_axis('x', 40000); /* the next motion is not believed sooner */
    run_ms(4);
    device_at(41100, 40000, 40000, 30);
    run_ms(5);
    expect_state(DR_GUARD_CHECKING);
}

static void row_45_an_angle_that_is_news_is_read_until_two_agree(void)
{
    bench_trio();
    arm_at_40000_by_hand();
    expect_state(DR_GUARD_IDLE);
    host_axis('x', 40100);
    for (unsigned angle = 31; angle <= 33; angle++) { /* somebody turns the knob */
        run_ms(4);
        device_at(40000, 40000, 40000, angle);
        expect_state(DR_GUARD_CHECKING);
    }
    run_ms(4);
    device_at(40000, 40000, 40000, 33);
    run_ms(5);
    expect_state(DR_GUARD_MOVING_U);
    device_says("\r", 1);
    run_ms(4);
    device_at(40100, 40000, 40000, 33);
    expect_cr();
    host_axis('x', 40200);
    for (unsigned angle = 34; angle <= 54; angle++) { /* and goes on turning: 20 readings, and no more */
        expect_state(DR_GUARD_CHECKING);
        run_ms(4);
        device_at(40100, 40000, 40000, angle);
    }
    expect_refused(DR_REASON_NO_POSITION);
    expect_state(DR_GUARD_IDLE);
    expect_silence();
}

static void row_46_small_moves_may_be_ignored(void)
{
    for (unsigned quirk = 0; quirk < 2; quirk++)
        for (uint32_t steps = 0; steps <= 16; steps++) {
            bench_mpc();
            rig.controller.quirks = quirk == 0 ? 0 : DR_QUIRK_SMALL_MOVE_SILENT;
            bench_start();
            bench_arm();
            host_point('M', 80000 + steps, 80000 - steps, 80000);
            run_ms(500);
            expect_state(DR_GUARD_IDLE);
            expect_fault(DR_FAULT_NONE);
            if (quirk == 0 || steps == 16)
                expect_cr();
            expect_silence();
            const uint32_t x = quirk == 1 && steps < 16 ? 80000 : 80000 + steps;
            expect_tip(0, x, 160000 - x, 80000);
        }
}

static void row_47_an_end_elsewhere(void)
{
    fake_rig();
    fake.stops_short = true; /* by 3 microsteps */
    fake_move(600);
    expect_fault(DR_FAULT_WRONG_END);
    expect_state(DR_GUARD_FAULT);
    expect_silence();
}

static void row_47_y_that_is_locked_out_of_homing_is_no_wrong_end(void)
{
    for (unsigned locked_out = 0; locked_out < 2; locked_out++) {
        bench_trio();
        rig.limits.rig |= locked_out == 1 ? DR_RIG_Y_LOCKED_OUT : 0;
        rig.limits.unstoppable_ms = 60000;
        rig.limits.drives[0].max_move_q = (uint32_t)DR_FAR_Q;
        rig.limits.drives[0].box_q = (dr_box){{0, 0, 0}, {1600000, 1600000, 1600000}};
        rig.drives[0].y_moves_home = false;
        rig.drives[0].position_steps[DR_Y] = 40000;
        bench_start();
        bench_arm();
        host_code('h');
        run_ms(4000);
        expect_tip(0, 0, 40000, 0);
        expect_fault(DR_FAULT_NONE); /* a hidden target: anywhere in the travel */
        host_point('H', 800, 40000, 800);
        run_ms(2000);
        expect_fault(DR_FAULT_NONE);
    }
}

static void row_47_y_that_switch_8_leaves_out_is_no_wrong_end(void)
{
    for (unsigned locked_out = 0; locked_out < 3; locked_out++) { /* of no drive, of this one, of another */
        bench_mpc();
        rig.limits.rig |= DR_RIG_HOME_IS_ZERO;
        rig.limits.rig |= (uint16_t)(locked_out == 0 ? 0 : DR_RIG_Y_LOCKED_OUT << (locked_out - 1u));
        rig.limits.drives[0].max_move_q = (uint32_t)DR_FAR_Q;
        for (unsigned axis = 0; axis < DR_AXES; axis++)
            rig.limits.drives[0].box_q.min_q[axis] = 0;
        rig.drives[0].y_moves_home = false;
        bench_start();
        bench_arm();
        host_code('H');
        run_ms(6000);
        expect_tip(0, 0, 80000, 0);
        if (locked_out == 1) {
            expect_fault(DR_FAULT_NONE);
            expect_cr();
            expect_state(DR_GUARD_IDLE);
        } else {
            expect_fault(DR_FAULT_WRONG_END);
            expect_silence();
        }
    }
}

static void row_48_ctrl_c_that_is_ignored(void)
{
    fake_rig();
    rig.limits.rig |= DR_RIG_HAS_CUT;
    limits_changed();
    fake.ignores_stop = true;
    fake.lasts = 5000000;
    fake_move(100);
    host_code(3);
    fake_ms(200);
    expect_state(DR_GUARD_STOPPING);
    fake_ms(850);
    expect_fault(DR_FAULT_UNSTOPPABLE);
    TEST_ASSERT_EQUAL(3, wire_stops());
    TEST_ASSERT_TRUE(status().buzzer);
    TEST_ASSERT_TRUE(status().cut);
    fake_ms(6000); /* it comes to rest by itself */
    expect_state(DR_GUARD_FAULT);
    expect_fault(DR_FAULT_UNSTOPPABLE);
    TEST_ASSERT_FALSE(status().buzzer);
    TEST_ASSERT_TRUE(status().cut); /* until the fault is cleared */
    clear_fault();
    TEST_ASSERT_FALSE(status().cut);
    expect_state(DR_GUARD_LOCKED); /* power was off: who is there? */
    fake_ms(1200);
    expect_state(DR_GUARD_DISARMED);
}

static void a_rig_that_calibrates_at_power_on_gets_its_power_back_when_a_person_confirms(void)
{
    fake_rig();
    rig.limits.rig |= DR_RIG_HAS_CUT | DR_RIG_CALIBRATES_AT_POWER_ON;
    limits_changed();
    fake.ignores_stop = true;
    fake.lasts = 3000000;
    fake_move(100);
    host_code(3);
    fake_ms(5000);
    clear_fault();
    TEST_ASSERT_TRUE(status().cut);
    TEST_ASSERT_TRUE(status().confirm_wanted);
    press(DR_INPUT_CONFIRM);
    TEST_ASSERT_FALSE(status().cut);
    expect_state(DR_GUARD_LOCKED);
    fake_ms(1200);
    expect_state(DR_GUARD_DISARMED);
}

static void row_49_pause_on_stop(void)
{
    bench_mpc();
    rig.controller.quirks = DR_QUIRK_PAUSE_ON_STOP;
    keep_out(5600, 6000, 4000, 4900, 4000, 6000); /* beside the old way, below it in Y */
    bench_start();
    bench_arm();
    host_line(15, 96000, 80000, 80000); /* to 6,000 um */
    run_ms(200);
    host_code(3);
    run_ms(600);
    expect_state(DR_GUARD_IDLE);
    expect_cr();
    /* From here the hull to the old target is clear: allowed, and the controller does the old move instead. */
    host_point('M', 80000, 80000, 80000);
    run_ms(2000);
    expect_tip(0, 96000, 80000, 80000);
    expect_fault(DR_FAULT_RESUMED_OLD_MOVE);
    expect_silence();
}

static void row_49_the_old_target_is_kept_until_a_motion_has_ended_at_its_own(void)
{
    bench_mpc(); /* a controller that does forget */
    keep_out(5600, 5900, 5300, 5600, 4000, 6000);
    bench_start();
    bench_arm();
    host_line(4, 96000, 80000, 80000);
    run_ms(200);
    host_code(3);
    run_ms(600);
    expect_cr();
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    host_line(15, 80000, 88800, 80000); /* to Y = 5,550 um: its own way is clear */
    run_ms(2000);
    expect_cr();
    TEST_ASSERT_FALSE(rig.guard.scene.old[0].is_open);

    host_line(4, 80000, 80000, 80000);
    run_ms(200);
    host_code(3);
    run_ms(600);
    expect_cr();
    rig.guard.scene.old[0].target_q = (dr_box){{UM(6000), UM(5000), UM(5000)}, {UM(6000), UM(5000), UM(5000)}};
    rig.guard.sealed = false;
    host_line(15, 80000, 80000, 80000);
    run_ms(1000);
    expect_refused(DR_REASON_OLD_TARGET);
    expect_silence();
}

static void row_50_stop_during_motions_that_cannot_be_stopped(void)
{
    static const char codes[] = "HWxyz";
    for (size_t c = 0; c < sizeof codes - 1; c++) {
        bench_armed_trio();
        if (codes[c] == 'H' || codes[c] == 'W')
            host_point(codes[c], 40800, 40800, 40800);
        else
            host_axis(codes[c], 40800);
        run_ms(15);
        expect_state(DR_GUARD_MOVING_U);
        stop_input(true);
        expect_state(DR_GUARD_STOPPING);
        expect_fault(DR_FAULT_UNSTOPPABLE);
        TEST_ASSERT_TRUE(status().buzzer);
        TEST_ASSERT_EQUAL(1, wire_stops());
        run_ms(10);
        TEST_ASSERT_TRUE(status().buzzer); /* no false claim */
        run_ms(500);
        TEST_ASSERT_FALSE(status().buzzer);
        expect_state(DR_GUARD_FAULT);
        expect_silence(); /* the host asked for a move, and a person stopped it: no CR */
        TEST_ASSERT_EQUAL(1, wire_stops());
    }
}

static void row_50_a_hosts_ctrl_c_there_is_passed_on_and_changes_nothing(void)
{
    bench_armed_trio();
    host_axis('x', 44000);
    run_ms(30);
    host_code(3);
    run_us(400);
    TEST_ASSERT_EQUAL(1, wire_stops());
    run_ms(300);
    expect_cr();
    expect_silence();
    expect_state(DR_GUARD_IDLE);
    expect_tip(0, 44000, 40000, 40000);
}

/* Motors that go 20 um too far and come back: the margin has room for it, and the end is where the tip stays. */
static void row_51_an_overshoot_within_the_margin(void)
{
    for (unsigned told_early = 0; told_early < 2; told_early++) { /* the CR after it has come back, or before */
        bench_trio();
        const uint8_t wall = keep_out(5551, 5700, 4000, 6000, 4000, 6000); /* the target is as near as it may be */
        const int32_t wall_q = rig.limits.obstacles[wall].box_q.min_q[DR_X];
        fake_rig_as_set();
        fake_move(20);
        TEST_ASSERT_TRUE(fake.moves);
        fake.to[0] = 44000 + 160;
        fake.no_cr = told_early == 0;
        while (fake.moves)
            fake_ms(1);
        TEST_ASSERT_EQUAL(44160, fake.at[0]);
        TEST_ASSERT_TRUE((int32_t)(fake.at[0] * 8u) < wall_q - UM(30));
        fake_ms(10);
        fake.at[0] = 44000;
        if (told_early == 0)
            device_says("\r", 1);
        fake_ms(300);
        expect_cr();
        expect_fault(DR_FAULT_NONE);
        expect_state(DR_GUARD_IDLE);
        fake.no_cr = false;
        host_line(8, 44016, 40000, 40000); /* 2 um farther the overshoot has no room */
        fake_ms(50);
        expect_refused(DR_REASON_KEEP_OUT);
    }
}

static void row_52_real_speeds_are_other_than_documented(void)
{
    for (unsigned level = 0; level < 16; level += 5) {
        bench_mpc();
        rig.controller.quirks = DR_QUIRK_MEASURED_SPEEDS;
        bench_start();
        bench_arm();
        host_line(level, 88000, 80000, 80000);
        run_ms(3000);
        expect_cr();
        expect_state(DR_GUARD_IDLE);
    }
    fake_rig();
    fake.lasts = 260000; /* 2.6 times as long as level 8 should take */
    fake_move(2500);
    expect_cr();
    expect_state(DR_GUARD_IDLE);
}

static void row_53_silent_from_the_start_or_in_the_middle(void)
{
    bench_trio();
    rig.by_hand = true;
    memset(&fake, 0, sizeof fake);
    fake.silent = true;
    bench_start();
    fake_ms(5000);
    expect_state(DR_GUARD_LOCKED);
    expect_fault(DR_FAULT_DEVICE_SILENT);
    host_code('c');
    fake_ms(1);
    expect_silence();

    fake_rig();
    fake.silent = true;
    fake_move(2500); /* the query before the motion */
    expect_fault(DR_FAULT_DEVICE_SILENT);
    expect_refused(DR_REASON_NO_POSITION);

    fake_rig();
    fake_move(50);
    fake.silent = true;
    fake_ms(8000); /* the motion's CR, then the query after ^C */
    expect_fault(DR_FAULT_DEVICE_SILENT);
    expect_silence();
    TEST_ASSERT_EQUAL(3, wire_stops());

    fake_rig();
    fake.silent = true;
    host_code('c');
    fake_ms(2500); /* a host's query: the guard has no opinion */
    expect_fault(DR_FAULT_NONE);
    TEST_ASSERT_NOT_NULL(last_record(DR_EVENT_NO_REPLY));
}

static void proof_is_given_up_and_tried_again_by_the_key(void)
{
    bench_trio();
    rig.by_hand = true;
    memset(&fake, 0, sizeof fake);
    fake.silent = true;
    bench_start();
    run_ms(200000);
    expect_state(DR_GUARD_LOCKED);
    TEST_ASSERT_EQUAL(0, rig.guard.task);
    host_code('c'); /* nobody knows who would answer */
    expect_refused(DR_REASON_NOT_ARMED);
    rig.wire_taken = rig.wire_count;
    fake.at[0] = fake.at[1] = fake.at[2] = 40000;
    fake.silent = false;
    fake.stop_says = "\r";
    clear_fault();
    fake_ms(1200);
    expect_state(DR_GUARD_DISARMED);
}

static void row_54_unplugged_and_plugged_in_again(void)
{
    bench_armed_trio();
    host_line(0, 42000, 40000, 40000);
    run_ms(150);
    dr_guard_link(&rig.guard, (dr_us)(rig.clock_at_start + rig.now), true, false);
    run_ms(10);
    expect_state(DR_GUARD_LOCKED);
    expect_fault(DR_FAULT_NO_DEVICE);
    TEST_ASSERT_TRUE(rig.guard.scene.old[0].is_open);
    host_code('c');
    host_code(3);
    run_ms(2000);
    dr_guard_link(&rig.guard, (dr_us)(rig.clock_at_start + rig.now), true, true);
    run_ms(1200);
    expect_state(DR_GUARD_DISARMED);
    expect_fault(DR_FAULT_NONE);
}

static void row_54_another_firmware_locks(void)
{
    bench_armed_mpc();
    host_code('K');
    run_ms(10);
    expect_state(DR_GUARD_IDLE);
    rig.controller.firmware = 0x0320;
    host_code('K');
    run_ms(10);
    expect_state(DR_GUARD_LOCKED);
    expect_fault(DR_FAULT_IDENTITY);
    clear_fault();
    run_ms(1500);
    expect_state(DR_GUARD_LOCKED);
}

static void the_other_controller_is_not_taken_for_the_one_of_the_limits(void)
{
    static const uint8_t mpc[14] = {1, 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x0D};
    static const uint8_t zero[14] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x0D};
    static const uint8_t trio[14] = {0x40, 0x9C, 0, 0, 0x40, 0x9C, 0, 0, 0x40, 0x9C, 0, 0, 30, 0x0D};
    bench_trio();
    rig.by_hand = true;
    bench_start();
    for (int i = 0; i < 4; i++) {
        run_ms(1150);
        device_says(mpc, 14);
    }
    expect_state(DR_GUARD_LOCKED);
    bench_mpc();
    rig.by_hand = true;
    bench_start();
    for (int i = 0; i < 4; i++) {
        run_ms(1150);
        device_says(trio, 14);
    }
    expect_state(DR_GUARD_LOCKED);
    expect_fault(DR_FAULT_IDENTITY);
    bench_mpc();
    rig.by_hand = true;
    bench_start();
    run_ms(1001);
    device_says(zero, 14); /* an MPC-200 at 0,0,0 is one: a TRIO there would tell an angle */
    expect_state(DR_GUARD_DISARMED);
    bench_trio();
    rig.by_hand = true;
    bench_start();
    run_ms(1001);
    device_says(zero, 14); /* a TRIO at 0 degrees, or an MPC-200: a person decides */
    expect_state(DR_GUARD_LOCKED);
    TEST_ASSERT_TRUE(status().confirm_wanted);
    host_code('c');
    run_ms(1);
    TEST_ASSERT_EQUAL('c', rig.wire[rig.wire_count - 1]);
    device_says(zero, 14);
    press(DR_INPUT_CONFIRM);
    expect_state(DR_GUARD_DISARMED);
}

static void row_55_a_controller_that_was_power_cycled(void)
{
    fake_rig();
    fake.at[0] = fake.at[1] = fake.at[2] = 8000; /* where a calibration ends */
    fake_move(100);
    expect_fault(DR_FAULT_POSITION_JUMP);
    expect_refused(DR_REASON_NO_POSITION);
    TEST_ASSERT_EQUAL(8000, fake.at[0]);
    fake_rig();
    fake.at[0] += 20 * 8;
    fake_move(400);
    expect_cr(); /* 20 um */
    fake_rig();
    fake.at[0] += 20 * 8 + 1;
    fake_move(400);
    expect_fault(DR_FAULT_POSITION_JUMP); /* the knobs are said to be locked */
    fake_rig();
    fake.at[0] = 8000;
    host_code('c'); /* a host's query tells it too */
    fake_ms(20);
    expect_fault(DR_FAULT_POSITION_JUMP);
}

/* A controller that has lost its count tells 0, 0, 0 wherever the tip is; a knob could have been there after a while. */
static void row_55_a_count_that_was_lost(void)
{
    for (int i = 0; i < 4; i++) {
        fake_rig();
        rig.limits.rig = 0;
        for (uint8_t axis = 0; axis < DR_AXES; axis++)
            rig.limits.drives[0].box_q.min_q[axis] = 0;
        limits_changed();
        host_code('c');
        fake_ms(10);
        run_ms(30000);
        for (int axis = 0; axis < 3; axis++)
            fake.at[axis] = axis == i ? 8u : 0;
        host_line(15, 800, 800, 800);
        fake_ms(400);
        expect_fault(i < 3 ? DR_FAULT_NONE : DR_FAULT_POSITION_JUMP);
        if (i == 3)
            expect_refused(DR_REASON_NO_POSITION);
    }
    fake_rig(); /* it was at 0, 0, 0 before */
    rig.limits.rig = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        rig.limits.drives[0].box_q.min_q[axis] = 0;
    limits_changed();
    input(DR_INPUT_KEY, false);
    fake.at[0] = fake.at[1] = fake.at[2] = 0;
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    fake_ms(150);
    expect_state(DR_GUARD_IDLE);
    host_code('c');
    fake_ms(100);
    expect_fault(DR_FAULT_NONE);
}

static void row_55_a_knob_is_no_faster_than_a_knob(void)
{
    static const struct {
        unsigned after_ms;
        uint32_t steps;
        bool jumps;
    } turns[] = {{1000, 40000, false},  {1000, 41000, true},  {2000, 79000, false},  {2000, 81000, true},
                 {3000, 119000, false}, {3000, 121000, true}, {21000, 159000, false}};
    for (size_t i = 0; i < sizeof turns / sizeof *turns; i++) {
        fake_rig();
        rig.limits.rig = 0; /* 5 mm/s: 40 microsteps a ms */
        limits_changed();
        host_code('c');
        fake_ms(10);
        fake_ms(turns[i].after_ms - 10);
        fake.at[1] = 40000 + turns[i].steps;
        host_code('c');
        fake_ms(10);
        expect_fault(turns[i].jumps ? DR_FAULT_POSITION_JUMP : DR_FAULT_NONE);
    }
}

static void row_56_the_pause_that_the_controller_needs(void)
{
    bench_mpc();
    rig.controller.quirks = DR_QUIRK_S_NEEDS_PAUSE;
    bench_start();
    bench_arm();
    for (int i = 0; i < 5; i++) {
        host_line(15, 80000 + (i % 2 == 0 ? 1600u : 0u), 80000, 80000);
        run_ms(400);
        expect_cr();
        TEST_ASSERT_EQUAL(DR_STATE_REST, rig.controller.state);
    }
}

static void row_57_bytes_that_nobody_asked_for(void)
{
    for (int byte = 0; byte < 256; byte++) {
        const uint8_t noise = (uint8_t)byte;
        bench_armed_trio();
        for (int i = 0; i < 16; i++)
            device_says(&noise, 1);
        expect_state(DR_GUARD_IDLE);
        run_ms(1100);
        for (int i = 0; i < 16; i++)
            device_says(&noise, 1);
        expect_fault(DR_FAULT_NONE);
        device_says(&noise, 1);
        expect_fault(DR_FAULT_DEVICE_NOISE);
        run_ms(1100);
        expect_silence();
        TEST_ASSERT_EQUAL(33, status().quarantined_bytes);
    }
}

static void noise_is_counted_on_while_motions_are_rationed(void)
{
    bench_armed_trio();
    host_line(15, 40008, 40000, 40000);
    run_ms(5);
    run_until_state(DR_GUARD_IDLE, 40); /* one more motion is granted 50 ms after it began */
    for (int i = 0; i < 16; i++)
        device_says("?", 1);
    run_ms(60);
    expect_state(DR_GUARD_IDLE);
    device_says("?", 1);
    expect_fault(DR_FAULT_DEVICE_NOISE);
}

static void noise_while_it_moves_stops(void)
{
    bench_armed_trio();
    host_line(0, 44000, 40000, 40000);
    run_ms(100);
    for (int i = 0; i < 17; i++)
        device_says("?", 1);
    expect_state(DR_GUARD_STOPPING);
    run_ms(600);
    expect_state(DR_GUARD_FAULT);
    expect_fault(DR_FAULT_DEVICE_NOISE);
    expect_silence();
}

static void row_83_position_replies_of_13_bytes(void)
{
    static const uint8_t thirteen[13] = {0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x80, 0x38, 1, 0, 0x0D};
    bench_armed_mpc();
    rig.by_hand = true;
    host_point('M', 81000, 80000, 80000);
    for (int i = 0; i < 2; i++) {
        run_ms(250);
        device_says(thirteen, 13);
    }
    run_ms(200);
    expect_fault(DR_FAULT_IMPLAUSIBLE);
    TEST_ASSERT_EQUAL(80000, status().position_steps[0]);
}

static void row_84_filler_during_a_long_move(void)
{
    fake_rig();
    fake.lasts = 800000;
    fake_move(20);
    for (int i = 0; i < 7; i++) {
        device_says("\0", 1);
        fake_ms(100);
    }
    expect_state(DR_GUARD_MOVING_S);
    expect_silence();
    fake_ms(300);
    expect_cr();
    expect_silence();
    expect_state(DR_GUARD_IDLE);
}

static void row_85_stop_at_the_roe_puts_an_i_on_the_line_and_no_cr(void)
{
    fake_rig();
    fake.no_cr = true;
    fake_move(100);
    fake_rest();
    device_says("I", 1);
    fake_ms(3500);
    expect_fault(DR_FAULT_NO_CR);
    expect_silence();
}

static void row_86_a_calibration_that_was_broken_off(void)
{
    for (unsigned percent = 10; percent < 100; percent += 20) {
        bench_mpc();
        rig.limits.rig |= DR_RIG_MAY_CALIBRATE;
        bench_start();
        bench_arm();
        rig.watch_tip = false; /* a calibration leaves the box by leave */
        host_code('N');
        run_ms(100);
        expect_refused(DR_REASON_CALIBRATE);
        input(DR_INPUT_MAY_CALIBRATE, true);
        host_code('N');
        run_ms(3500 * percent / 100);
        expect_state(DR_GUARD_MOVING_S);
        host_code(3);
        run_ms(600);
        expect_state(DR_GUARD_FAULT);
        expect_fault(DR_FAULT_FRAME_LOST);
        rig.heard_taken = rig.heard_count;
        clear_fault();
        input(DR_INPUT_ESCAPE, true);
        press(DR_INPUT_ARM);
        run_ms(150);
        expect_state(DR_GUARD_IDLE);
        host_line(3, 1600, 1600, 1600);
        run_ms(100);
        expect_refused(DR_REASON_FRAME_LOST);
        host_code('N');
        run_ms(10000);
        expect_cr();
        expect_state(DR_GUARD_IDLE);
        TEST_ASSERT_FALSE(rig.guard.scene.frame_lost);
    }
}

static void row_17_a_trio_calibrates_with_leave(void)
{
    bench_trio();
    rig.limits.rig |= DR_RIG_MAY_CALIBRATE;
    bench_start();
    bench_arm();
    rig.watch_tip = false;
    input(DR_INPUT_MAY_CALIBRATE, true);
    host_code('R');
    run_ms(6000);
    expect_cr();
    expect_tip(0, 8000, 8000, 8000);
    expect_state(DR_GUARD_IDLE);
}

static void row_88_no_manipulator_connected(void)
{
    bench_armed_mpc();
    dr_hand unplug = {DR_HAND_CONNECT, 0, DR_STAGE_NONE, {0, 0, 0}};
    TEST_ASSERT_TRUE(dr_controller_poke(&rig.controller, (dr_us)(rig.clock_at_start + rig.now), &unplug));
    unplug.drive = 1;
    TEST_ASSERT_TRUE(dr_controller_poke(&rig.controller, (dr_us)(rig.clock_at_start + rig.now), &unplug));
    host_code('U');
    run_ms(2100);
    expect_fault(DR_FAULT_NONE);
    expect_silence();
    host_point('M', 81000, 80000, 80000);
    run_ms(2100);
    expect_fault(DR_FAULT_DEVICE_SILENT);
    expect_refused(DR_REASON_NO_POSITION);
}

/* The controller waits for the rest of the frame and takes it from whatever comes: a query, a ^C. */
static void a_cable_pulled_within_a_frame_leaves_nothing_that_completes_it(void)
{
    for (uint8_t cut = 1; cut < 14; cut++) {
        bench_trio();
        rig.controller.calibrates_at_power_on = false;
        (void)keep_out(9000, 9500, 9000, 9500, 9000, 9500); /* nothing else then asks for CONFIRM */
        bench_start();
        bench_arm();
        host_line(15, 40800, 40000, 40000);
        while (rig.guard.out_at < cut || rig.guard.out_count < 14) /* until so much of it has left */
            run_us(10);
        cables(true, false);
        expect_fault(DR_FAULT_TORN);
        const uint32_t sent = rig.wire_count;
        run_ms(10);
        cables(true, true);
        host_code(0x03);
        host_code('C');
        stop_input(true);
        run_ms(70000);
        stop_input(false);
        clear_fault();
        run_ms(70000);
        TEST_ASSERT_EQUAL(sent, rig.wire_count);
        expect_state(DR_GUARD_LOCKED);
        expect_tip(0, 40000, 40000, 40000);
        TEST_ASSERT_TRUE(status().confirm_wanted);

        const dr_hand off = {DR_HAND_POWER_OFF, 0, 0, {0, 0, 0}}, on = {DR_HAND_POWER_ON, 0, 0, {0, 0, 0}};
        const dr_us now = (dr_us)(rig.clock_at_start + rig.now);
        TEST_ASSERT_TRUE(dr_controller_poke(&rig.controller, now, &off));
        TEST_ASSERT_TRUE(dr_controller_poke(&rig.controller, now, &on));
        if (cut % 2 == 0) { /* confirmed with the cable in, or before */
            press(DR_INPUT_CONFIRM);
        } else {
            cables(true, false);
            press(DR_INPUT_CONFIRM);
            cables(true, true);
        }
        run_ms(1100);
        expect_state(DR_GUARD_DISARMED);
        TEST_ASSERT_FALSE(status().confirm_wanted);
        expect_tip(0, 40000, 40000, 40000);
    }
}

/* Somebody presses HOME, WORK or CENTER at the ROE. In mid-move: the controller goes there instead, and its CR is true of
 * that. Right behind the end, before the guard has looked: an MPC-200 answers its query when it is home. */
static void row_61_a_button_of_the_roe_during_a_hosts_move(void)
{
    static const uint32_t to[][3] = {{0, 0, 0}, {60000, 20000, 40000}, {100000, 100000, 100000}};
    for (size_t button = 0; button < sizeof to / sizeof *to; button++) {
        fake_rig();
        fake_move(100);
        expect_state(DR_GUARD_MOVING_S);
        fake_rest();
        memcpy(fake.from, fake.at, sizeof fake.at);
        memcpy(fake.to, to[button], sizeof fake.to);
        fake.began = rig.now;
        fake.moves = true;
        fake_ms(600);
        expect_fault(DR_FAULT_WRONG_END);
        expect_state(DR_GUARD_FAULT);
        expect_silence();
    }
    bench_mpc();
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        rig.drives[0].position_steps[axis] = 16000; /* 1 mm from there */
    bench_start();
    bench_arm();
    host_point('M', 17600, 16000, 16000);
    run_ms(30);
    while (rig.controller.state == DR_STATE_MOVING)
        run_us(100);
    rig.watch_tip = false; /* a hand moves it: no guard can see that */
    TEST_ASSERT_TRUE(dr_controller_apply(&rig.controller, (dr_us)(rig.clock_at_start + rig.now), DR_EFFECT_HOME, 0));
    run_ms(3000);
    expect_fault(DR_FAULT_WRONG_END);
    expect_silence();
    TEST_ASSERT_NOT_EQUAL(DR_STATE_MOVING, rig.controller.state);
}

/* What a board does: it asks after each byte, keeps the answer over the reset, and starts again. */
static void row_74_a_reset_within_a_frame_leaves_nothing_that_completes_it(void)
{
    for (uint32_t cut = 0; cut <= 14; cut++) {
        bench_mpc();
        bench_start();
        bench_arm();
        const uint32_t before = rig.wire_count + 1; /* the guard's own query goes first */
        host_line(15, 80800, 80000, 80000);
        while (rig.wire_count < before + cut)
            run_us(10);
        const bool torn = dr_guard_is_mid_frame(&rig.guard);
        TEST_ASSERT_EQUAL(cut > 0 && cut < 14, torn);
        rig.framer.have = rig.framer.want = 0;
        rig.crc = rig.next_sequence = rig.frames_refused = 0;
        rig.state = DR_GUARD_LOCKED;
        dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
        const dr_us now = (dr_us)(rig.clock_at_start + rig.now);
        dr_guard_start(&rig.guard, now, torn ? DR_START_MID_FRAME : DR_START_AFTER_RESET);
        const uint32_t sent = rig.wire_count;
        cables(true, true);
        TEST_ASSERT_EQUAL(torn ? DR_START_MID_FRAME : DR_START_AFTER_RESET, last_record(DR_EVENT_START)->code);
        if (!torn) {
            run_ms(1500);
            expect_state(DR_GUARD_DISARMED);
            TEST_ASSERT_EQUAL(0x03, rig.wire[sent]);
            continue;
        }
        expect_state(DR_GUARD_LOCKED);
        expect_fault(DR_FAULT_TORN);
        TEST_ASSERT_TRUE(status().confirm_wanted);
        host_code(0x03);
        stop_input(true);
        stop_input(false);
        clear_fault();
        press(DR_INPUT_ARM);
        run_ms(70000);
        TEST_ASSERT_EQUAL(sent, rig.wire_count);
        expect_state(DR_GUARD_LOCKED);
        expect_tip(0, 80000, 80000, 80000);
        const dr_hand off = {DR_HAND_POWER_OFF, 0, 0, {0, 0, 0}}, on = {DR_HAND_POWER_ON, 0, 0, {0, 0, 0}};
        const dr_us later = (dr_us)(rig.clock_at_start + rig.now);
        TEST_ASSERT_TRUE(dr_controller_poke(&rig.controller, later, &off));
        TEST_ASSERT_TRUE(dr_controller_poke(&rig.controller, later, &on));
        press(DR_INPUT_CONFIRM);
        run_ms(1100);
        expect_state(DR_GUARD_DISARMED);
        expect_tip(0, 80000, 80000, 80000);
    }
}

/* Without limits too: whoever does not know that a frame was torn would let ^C pass. */
static void a_torn_frame_is_remembered_without_limits(void)
{
    bench_mpc();
    dr_guard_init(&rig.guard, NULL, rig.ring, 64);
    dr_guard_start(&rig.guard, 0, DR_START_MID_FRAME);
    dr_guard_link(&rig.guard, 0, true, true);
    host_code(0x03);
    TEST_ASSERT_EQUAL(0, rig.wire_count);
    expect_fault(DR_FAULT_LIMITS);
    TEST_ASSERT_TRUE(status().confirm_wanted);
    press(DR_INPUT_CONFIRM);
    host_code(0x03);
    TEST_ASSERT_EQUAL(1, rig.wire_count);
}

/* A guard that lost its power within the pause of an 'S' left a controller that waits for 12 bytes more; the next one knows
 * of nothing. All that may send a ^C or a query to it, in all together: it must not get the twelfth. */
static void row_74_nobody_completes_an_s_that_nobody_remembers(void)
{
    for (unsigned who = 0; who < 5; who++) {
        bench_mpc();
        rig.by_hand = true; /* it says nothing */
        bench_start();
        input(DR_INPUT_KEY, true);
        for (unsigned i = 0; i < 30; i++) {
            run_ms(3000);
            if (who == 0)
                host_code(0x03);
            stop_input(who == 1);
            if (who == 2)
                clear_fault();
            if (who == 3) { /* plugged in anew */
                cables(true, false);
                cables(true, true);
            }
            run_ms(100);
            stop_input(false);
        }
        run_ms(200000);
        TEST_ASSERT_EQUAL(who == 4 ? 10 : 11, rig.wire_count);
        expect_state(DR_GUARD_LOCKED);
        expect_fault(who == 4 ? DR_FAULT_DEVICE_SILENT : DR_FAULT_TORN);
        if (who == 4)
            continue;
        TEST_ASSERT_TRUE(status().confirm_wanted);
        TEST_ASSERT_TRUE(dr_guard_is_mid_frame(&rig.guard)); /* to be remembered over the next reset, too */
        rig.by_hand = false;                                 /* somebody has switched it off and on */
        press(DR_INPUT_CONFIRM);
        TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
        run_ms(1100);
        clear_fault();
        run_ms(1100);
        expect_state(DR_GUARD_DISARMED);
        expect_fault(DR_FAULT_NONE);
    }
}

/* One byte of the controller's shows that it is not within a frame. A TRIO has no pause in which a frame tears. */
static void a_controller_that_says_something_is_not_torn(void)
{
    bench_mpc();
    rig.by_hand = true;
    bench_start();
    for (unsigned i = 0; i < 40; i++) {
        host_code(0x03);
        run_ms(1);
        device_says("\r", 1);
        run_ms(100);
    }
    expect_state(DR_GUARD_LOCKED);
    TEST_ASSERT_GREATER_OR_EQUAL(40, wire_stops());
    TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
    bench_trio();
    rig.by_hand = true;
    bench_start();
    for (unsigned i = 0; i < 40; i++) {
        host_code(0x03);
        run_ms(3000);
    }
    TEST_ASSERT_GREATER_OR_EQUAL(40, wire_stops());
    TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
}

/* The ^C that a host asked for while the cable was out are counted too; when there are too many, the waiting ones do not leave. */
static void what_waits_for_a_torn_controller_is_forgotten(void)
{
    uint8_t bytes[16];
    bench_mpc();
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
    dr_guard_start(&rig.guard, 0, DR_START_POWER_ON);
    dr_guard_link(&rig.guard, 0, true, false);
    for (unsigned i = 0; i < 11; i++)
        dr_guard_push_host(&rig.guard, 0, (const uint8_t *)"\x03", 1);
    TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
    dr_guard_push_host(&rig.guard, 0, (const uint8_t *)"\x03", 1);
    TEST_ASSERT_TRUE(dr_guard_is_mid_frame(&rig.guard));
    TEST_ASSERT_EQUAL(0, dr_guard_pull_device(&rig.guard, 0, bytes, sizeof bytes));
    dr_guard_input(&rig.guard, 0, DR_INPUT_CONFIRM, true); /* its power was off: it counts from the start */
    for (unsigned i = 0; i < 11; i++)
        dr_guard_push_host(&rig.guard, 0, (const uint8_t *)"\x03", 1);
    TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
    dr_guard_push_host(&rig.guard, 0, (const uint8_t *)"\x03", 1);
    TEST_ASSERT_TRUE(dr_guard_is_mid_frame(&rig.guard));
}

/* CONFIRM in the very call that finds the frame torn: who was cycled is asked who it is. */
static void confirmed_when_it_is_found_torn(void)
{
    uint8_t bytes[16];
    bench_mpc();
    dr_guard_init(&rig.guard, &rig.limits, rig.ring, 64);
    dr_guard_start(&rig.guard, 0, DR_START_POWER_ON);
    dr_guard_link(&rig.guard, 0, true, true);
    for (unsigned i = 0; i < 11; i++)
        dr_guard_push_host(&rig.guard, 0, (const uint8_t *)"\x03", 1);
    TEST_ASSERT_EQUAL(11, dr_guard_pull_device(&rig.guard, 0, bytes, sizeof bytes));
    dr_guard_input(&rig.guard, 2000000, DR_INPUT_CONFIRM, true); /* a query, the twelfth byte, was due after 1 s */
    TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
    TEST_ASSERT_EQUAL(0, dr_guard_pull_device(&rig.guard, 2900000, bytes, sizeof bytes));
    TEST_ASSERT_EQUAL(1, dr_guard_pull_device(&rig.guard, 3100000, bytes, sizeof bytes));
    TEST_ASSERT_EQUAL_HEX8('C', bytes[0]);
}

/* One that has been proved hears each ^C, answered or not. */
static void a_controller_that_is_proved_is_told_to_stop_as_often_as_wanted(void)
{
    bench_armed_mpc();
    rig.by_hand = true;
    for (unsigned i = 0; i < 15; i++)
        host_code(0x03);
    run_ms(10);
    TEST_ASSERT_EQUAL(15, wire_stops());
    TEST_ASSERT_FALSE(dr_guard_is_mid_frame(&rig.guard));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(row_74_nobody_completes_an_s_that_nobody_remembers);
    RUN_TEST(a_controller_that_says_something_is_not_torn);
    RUN_TEST(what_waits_for_a_torn_controller_is_forgotten);
    RUN_TEST(confirmed_when_it_is_found_torn);
    RUN_TEST(a_controller_that_is_proved_is_told_to_stop_as_often_as_wanted);
    RUN_TEST(the_controller_to_order_works_when_nothing_is_ordered);
    RUN_TEST(row_74_a_reset_within_a_frame_leaves_nothing_that_completes_it);
    RUN_TEST(a_torn_frame_is_remembered_without_limits);
    RUN_TEST(row_51_an_overshoot_within_the_margin);
    RUN_TEST(row_61_a_button_of_the_roe_during_a_hosts_move);
    RUN_TEST(row_39_a_lost_cr);
    RUN_TEST(row_40_a_late_cr_is_not_forwarded);
    RUN_TEST(row_41_of_many_crs_one_is_forwarded);
    RUN_TEST(row_42_a_cr_before_the_end);
    RUN_TEST(row_43_answers_to_ctrl_c_of_all_kinds);
    RUN_TEST(row_44_one_bad_position_reply_is_asked_for_again_two_are_a_fault);
    RUN_TEST(row_44_a_reply_that_is_too_long_is_asked_for_again);
    RUN_TEST(row_44_a_0x0d_within_a_coordinate_ends_nothing);
    RUN_TEST(row_44_a_host_gets_nonsense_and_the_guard_asks_itself);
    RUN_TEST(row_45_impossible_drives);
    RUN_TEST(row_45_a_flipped_bit_in_a_reading_lets_no_motion_through_an_obstacle);
    RUN_TEST(row_58_a_knob_that_is_being_turned_is_read_twice);
    RUN_TEST(row_45_an_angle_that_is_news_is_read_until_two_agree);
    RUN_TEST(row_46_small_moves_may_be_ignored);
    RUN_TEST(row_47_an_end_elsewhere);
    RUN_TEST(row_47_y_that_is_locked_out_of_homing_is_no_wrong_end);
    RUN_TEST(row_47_y_that_switch_8_leaves_out_is_no_wrong_end);
    RUN_TEST(row_48_ctrl_c_that_is_ignored);
    RUN_TEST(a_rig_that_calibrates_at_power_on_gets_its_power_back_when_a_person_confirms);
    RUN_TEST(row_49_pause_on_stop);
    RUN_TEST(row_49_the_old_target_is_kept_until_a_motion_has_ended_at_its_own);
    RUN_TEST(row_50_stop_during_motions_that_cannot_be_stopped);
    RUN_TEST(row_50_a_hosts_ctrl_c_there_is_passed_on_and_changes_nothing);
    RUN_TEST(row_52_real_speeds_are_other_than_documented);
    RUN_TEST(row_53_silent_from_the_start_or_in_the_middle);
    RUN_TEST(proof_is_given_up_and_tried_again_by_the_key);
    RUN_TEST(row_54_unplugged_and_plugged_in_again);
    RUN_TEST(row_54_another_firmware_locks);
    RUN_TEST(the_other_controller_is_not_taken_for_the_one_of_the_limits);
    RUN_TEST(row_55_a_controller_that_was_power_cycled);
    RUN_TEST(row_55_a_count_that_was_lost);
    RUN_TEST(row_55_a_knob_is_no_faster_than_a_knob);
    RUN_TEST(row_56_the_pause_that_the_controller_needs);
    RUN_TEST(row_57_bytes_that_nobody_asked_for);
    RUN_TEST(noise_is_counted_on_while_motions_are_rationed);
    RUN_TEST(noise_while_it_moves_stops);
    RUN_TEST(row_83_position_replies_of_13_bytes);
    RUN_TEST(row_84_filler_during_a_long_move);
    RUN_TEST(row_85_stop_at_the_roe_puts_an_i_on_the_line_and_no_cr);
    RUN_TEST(row_86_a_calibration_that_was_broken_off);
    RUN_TEST(row_17_a_trio_calibrates_with_leave);
    RUN_TEST(row_88_no_manipulator_connected);
    RUN_TEST(a_cable_pulled_within_a_frame_leaves_nothing_that_completes_it);
    return UNITY_END();
}
