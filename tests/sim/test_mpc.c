/* The MPC-200 in virtual time: [M table 9, notes 10-16, tables 1-4] and PROTOCOL.md. MP-225: 16 steps/um, 3 mm/s. */
#include "scenario.h"

#include <string.h>

/* How long an MP-225 takes at full speed. */
static uint32_t full(uint32_t steps) { return takes_us(steps, 4, 3000); }

static uint32_t larger(uint32_t a, uint32_t b) { return a > b ? a : b; }

/* The reply that has just come, and nothing more. */
#define EXPECT(...)                                                                                                    \
    do {                                                                                                               \
        static const uint8_t bytes_[] = {__VA_ARGS__};                                                                 \
        expect(rig.now_us, bytes_, sizeof bytes_);                                                                     \
        expect_nothing();                                                                                              \
    } while (0)

static void set_up(uint16_t firmware, dr_stage_id a, dr_stage_id b, dr_stage_id c, dr_stage_id d)
{
    prepare(DR_MPC);
    rig.c.firmware = firmware;
    dr_drive_init(&rig.drives[0], a);
    dr_drive_init(&rig.drives[1], b);
    dr_drive_init(&rig.drives[2], c);
    dr_drive_init(&rig.drives[3], d);
    start();
}

#define MP225 DR_STAGE_MPC_MP225
#define NONE DR_STAGE_NONE

static void factory_settings(void)
{
    prepare(DR_MPC);
    start();
    send_code('K');
    EXPECT(0x01, 0x21, 0x03, 0x0D);
    send_code('U');
    EXPECT(2, 1, 1, 0, 0, 0x0D);
    send_code('C');
    expect_mpc_position(0, 1, 0, 0, 0);
    TEST_ASSERT_FALSE(rig.c.streaming);
    TEST_ASSERT_EQUAL(10, rig.drives[0].diagonal); /* 29 degrees */
    TEST_ASSERT_EQUAL(0, rig.drives[0].mode);
    TEST_ASSERT_TRUE(rig.drives[0].y_moves_home);
    TEST_ASSERT_EQUAL(DR_CALIBRATED, rig.drives[0].calibration);
    expect_idle();
}

static void what_is_connected_is_told_by_u_or_a(void)
{
    for (unsigned mask = 1; mask < 16; mask++) {
        unsigned count = 0;
        uint8_t flags[4], lowest = 0;
        for (unsigned port = 0; port < 4; port++) {
            flags[port] = mask >> port & 1;
            count += flags[port];
        }
        while (flags[lowest] == 0) {
            lowest++;
        }
        for (unsigned old = 0; old < 2; old++) {
            set_up(old ? 0x299 : 0x300, flags[0] ? MP225 : NONE, flags[1] ? MP225 : NONE, flags[2] ? MP225 : NONE,
                   flags[3] ? MP225 : NONE);
            const uint8_t u[6] = {(uint8_t)count, flags[0], flags[1], flags[2], flags[3], 0x0D};
            const uint8_t a[2] = {(uint8_t)count, 0x0D};
            const uint8_t k[4] = {(uint8_t)(lowest + 1), 0x00, 0x03, 0x0D}; /* the lowest connected one is active */
            const uint8_t k_old[2] = {(uint8_t)(lowest + 1), 0x0D};
            send_code('U');
            expect(0, u, old ? 0 : 6);
            send_code('A');
            expect(0, a, old ? 2 : 0);
            TEST_ASSERT_EQUAL(1, rig.c.unknown_bytes); /* the other one is an unknown byte */
            send_code('K');
            expect(0, old ? k_old : k, old ? 2 : 4);
            expect_idle();
        }
    }
}

static void nothing_is_answered_where_nothing_is_connected(void)
{
    static const uint16_t firmware[] = {0x100, 0x106, 0x299, 0x321};
    for (unsigned f = 0; f < 4; f++) {
        set_up(firmware[f], NONE, NONE, NONE, NONE);
        send_string("AUKCHYNFO\x03");
        send_value('I', 1);
        send_value('L', 2);
        send_point('M', 100, 100, 100);
        sim_run_out(&rig);
        if (firmware[f] >= 0x300) {
            send_line(15, 100, 100, 100);
        }
        sim_run(&rig, 60000000);
        expect_idle();
        (void)expect_note(DR_NOTE_NO_DRIVE);
        expect_at(0, 0, 0, 0);
    }
}

static void select_answers_by_firmware(void)
{
    static const uint16_t firmware[] = {0x100, 0x103, 0x105, 0x106, 0x299, 0x300, 0x321};
    for (unsigned f = 0; f < 7; f++) {
        set_up(firmware[f], NONE, MP225, NONE, DR_STAGE_MPC_MP285);
        uint8_t active = 1;
        for (unsigned value = 0; value < 256; value++) {
            const bool there = value == 2 || value == 4;
            active = there ? (uint8_t)(value - 1) : active;
            send_value('I', value);
            const uint8_t reply[2] = {there ? (uint8_t)value : 'E', 0x0D};
            if (firmware[f] >= 0x106) {
                expect(0, reply, 2);
            } else {
                expect_cr(0);
            }
            TEST_ASSERT_EQUAL(active, rig.c.active);
            send_code('C');
            expect_mpc_position(0, active + 1u, 0, 0, 0);
            if (!there) {
                TEST_ASSERT_EQUAL_UINT32(value, expect_note(DR_NOTE_BAD_VALUE).value);
            }
            dr_notes_init(&notes, noted, 256);
            rig.c.notes = &notes;
        }
        expect_idle();
    }
}

static void moves_act_on_the_active_drive_only(void)
{
    set_up(0x321, MP225, MP225, NONE, DR_STAGE_MPC_MP285);
    send_point('M', 160, 0, 0);
    sim_run_out(&rig);
    expect_cr(full(160));
    send_value('I', 4);
    EXPECT(4, 0x0D);
    const uint64_t t = rig.now_us;
    send_point('M', 320, 0, 0);
    sim_run_out(&rig);
    expect_cr(t + takes_us(320, 4, 5000)); /* each at its own speed */
    send_code('C');
    expect_mpc_position(rig.now_us, 4, 320, 0, 0);
    send_value('I', 2);
    EXPECT(2, 0x0D);
    send_code('C');
    expect_mpc_position(rig.now_us, 2, 0, 0, 0);
    send_value('L', 7);
    expect_cr(rig.now_us);
    TEST_ASSERT_EQUAL(7, rig.drives[1].mode);
    TEST_ASSERT_EQUAL(0, rig.drives[0].mode);
    expect_at(0, 160, 0, 0);
    expect_idle();
}

static void orthogonal_moves_run_each_axis_at_full_speed(void)
{
    static const struct {
        dr_stage_id stage;
        uint16_t firmware;
        uint32_t quanta, um_per_s;
    } stages[] = {
        {DR_STAGE_MPC_MP225, 0x321, 4, 3000}, {DR_STAGE_MPC_MP285, 0x321, 4, 5000},
        {DR_STAGE_MPC_MP265, 0x321, 4, 3000}, {DR_STAGE_MPC_MP845, 0x321, 3, 3000},
        {DR_STAGE_MPC_MP865, 0x321, 3, 3000}, {DR_STAGE_MPC_MT800, 0x321, 5, 5000},
        {DR_STAGE_MPC_MOM, 0x316, 4, 5000},
    };
    for (size_t i = 0; i < 7; i++) {
        const uint32_t q = stages[i].quanta, v = stages[i].um_per_s;
        set_up(stages[i].firmware, stages[i].stage, NONE, NONE, NONE);
        const uint32_t tx = takes_us(16000, q, v), ty = takes_us(4000, q, v), tz = takes_us(9001, q, v);
        send_point('M', 16000, 4000, 9001);
        sim_run_to(&rig, ty);
        expect_at(0, (uint32_t)(UINT64_C(16000) * ty / tx), 4000, (uint32_t)(UINT64_C(9001) * ty / tz));
        sim_run_to(&rig, tx - 1);
        expect_nothing();
        expect_at(0, (uint32_t)(UINT64_C(16000) * (tx - 1) / tx), 4000, 9001);
        sim_run_to(&rig, tx);
        expect_cr(tx);
        expect_at(0, 16000, 4000, 9001);
        expect_idle();
    }
}

static void lines_run_at_sixteen_speeds(void)
{
    for (uint32_t level = 0; level < 256; level++) {
        mpc_at(0, 1600, 0);
        send_line(level, 16000, 0, 320);
        /* 1 mm at 81.25 * (s + 1) um/s [M note 12] */
        const uint64_t speed = 8125 * ((level & 15) + 1), us = (UINT64_C(100000000000) + speed - 1) / speed;
        sim_run_to(&rig, us / 3);
        expect_at(0, (uint32_t)(16000 * (us / 3) / us), (uint32_t)(1600 - 1600 * (us / 3) / us),
                  (uint32_t)(320 * (us / 3) / us));
        sim_run_to(&rig, us - 1);
        expect_nothing();
        sim_run_to(&rig, us);
        expect_cr(us);
        expect_at(0, 16000, 0, 320);
        expect_idle();
        if (level > 15) {
            TEST_ASSERT_EQUAL_UINT32(level & 15, expect_note(DR_NOTE_SPEED_CUT).value);
        }
    }
}

/* -- Home and work ---------------------------------------------------------------------------------------------------- */

/* cos and sin of table 2, as PROTOCOL.md prints them. */
static const uint32_t cos_sin[16][2] = {
    {6252, 32166},  {7927, 31795},  {11743, 30592}, {14876, 29197}, {15886, 28660}, {18795, 26842},
    {20622, 25466}, {23170, 23170}, {25466, 20622}, {26842, 18795}, {28660, 15886}, {29197, 14876},
    {30592, 11743}, {31795, 7927},  {32166, 6252},  {32524, 3993},
};

static void corner_of(unsigned diagonal, const uint32_t start_at[3], uint32_t corner[3])
{
    const uint32_t c = cos_sin[diagonal][0], sn = cos_sin[diagonal][1], x = start_at[0], z = start_at[2];
    corner[1] = start_at[1];
    if (x * sn <= z * c) {
        corner[0] = 0;
        corner[2] = z - x * sn / c;
    } else {
        corner[0] = x - z * c / sn;
        corner[2] = 0;
    }
}

static void home_runs_along_the_diagonal(void)
{
    static const uint32_t from[][3] = {{16000, 3200, 16000}, {8000, 0, 16000}, {16000, 160, 800}, {0, 160, 1600},
                                       {1600, 160, 0},       {7, 0, 3},        {0, 320, 0}};
    for (unsigned diagonal = 0; diagonal < 16; diagonal++) {
        for (size_t i = 0; i < 7; i++) {
            uint32_t corner[3];
            corner_of(diagonal, from[i], corner);
            prepare(DR_MPC);
            memcpy(rig.drives[0].position_steps, from[i], sizeof from[i]);
            rig.drives[0].diagonal = (uint8_t)diagonal;
            start();
            send_code('H');
            const uint32_t leg1 = full(larger(from[i][0] - corner[0], from[i][2] - corner[2]));
            const uint32_t leg2 = full(larger(corner[1], larger(corner[0], corner[2])));
            sim_run_to(&rig, leg1 / 2);
            expect_at(
                0, from[i][0] - (leg1 == 0 ? 0 : (uint32_t)((uint64_t)(from[i][0] - corner[0]) * (leg1 / 2) / leg1)),
                from[i][1],
                from[i][2] - (leg1 == 0 ? 0 : (uint32_t)((uint64_t)(from[i][2] - corner[2]) * (leg1 / 2) / leg1)));
            sim_run_to(&rig, leg1);
            expect_at(0, corner[0], corner[1], corner[2]);
            if (leg2 > 0) {
                sim_run_to(&rig, leg1 + leg2 - 1);
                expect_nothing();
            }
            sim_run_to(&rig, leg1 + leg2);
            expect_cr(leg1 + leg2);
            expect_at(0, 0, 0, 0);
            expect_idle();
        }
    }
}

static void a_drive_at(const uint32_t at[3], const uint32_t work[3], bool y_moves)
{
    prepare(DR_MPC);
    memcpy(rig.drives[0].position_steps, at, 3 * sizeof at[0]);
    memcpy(rig.drives[0].work_steps, work, 3 * sizeof work[0]);
    rig.drives[0].work_is_set = true;
    rig.drives[0].y_moves_home = y_moves;
    start();
}

static void work_retraces_home(void)
{
    static const uint32_t work[3] = {16000, 3200, 16000};
    uint32_t corner[3];
    a_drive_at(work, work, true);
    corner_of(10, work, corner);
    const uint32_t diagonal = full(16000), rest = full(larger(3200, corner[2]));
    send_code('H');
    sim_run_out(&rig);
    expect_cr(diagonal + rest);
    send_code('Y');
    sim_run(&rig, rest);
    expect_at(0, corner[0], corner[1], corner[2]);
    sim_run(&rig, diagonal - 1);
    expect_nothing();
    sim_run(&rig, 1);
    expect_cr(2 * (diagonal + rest));
    expect_at(0, 16000, 3200, 16000);
    expect_idle();
    send_code('Y'); /* the last completed move was no Home */
    expect_cr(rig.now_us);
    (void)expect_note(DR_NOTE_NOT_AT_HOME);
    expect_idle();
}

static void switch_8_leaves_y_out_of_home_and_work(void)
{
    static const uint32_t at[3] = {1600, 480, 0}, work[3] = {0, 3200, 1600};
    a_drive_at(at, work, false);
    send_code('H');
    sim_run_out(&rig);
    expect_cr(full(1600));
    expect_at(0, 0, 480, 0);
    send_code('Y');
    sim_run_out(&rig);
    expect_cr(2 * full(1600));
    expect_at(0, 0, 480, 1600);
    send_code('N'); /* calibration moves Y always */
    sim_run_out(&rig);
    expect_cr(3 * full(1600) + 2 * 83334);
    expect_at(0, 0, 0, 0);
    expect_idle();
}

static void work_needs_a_home_before_it(void)
{
    static const uint32_t zero[3] = {0, 0, 0}, work[3] = {160, 160, 160};
    a_drive_at(zero, work, true);
    send_code('Y'); /* not yet */
    expect_cr(0);
    (void)expect_note(DR_NOTE_NOT_AT_HOME);
    send_code('H'); /* of no length, but completed */
    expect_cr(0);
    TEST_ASSERT_TRUE(place(0, 16, 0, 0)); /* the knob clears it */
    send_code('Y');
    expect_cr(0);
    expect_at(0, 16, 0, 0);
    send_code('H');
    sim_run_out(&rig);
    expect_cr(full(16));
    send_value('I', 2); /* each drive has its own */
    EXPECT(2, 0x0D);
    send_code('Y');
    expect_cr(rig.now_us);
    send_value('I', 1);
    EXPECT(1, 0x0D);
    send_point('M', 32, 0, 0);
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    send_code('Y');
    expect_cr(rig.now_us);
    expect_at(0, 32, 0, 0);
    send_code('H'); /* interrupted: not completed */
    sim_run(&rig, 100);
    send_code(3);
    expect_cr(rig.now_us);
    send_code('Y');
    expect_cr(rig.now_us);
    send_code('H');
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    send_code('N');
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    send_code('Y'); /* calibration is no Home */
    expect_cr(rig.now_us);
    send_code('H');
    expect_cr(rig.now_us);
    send_string("CKU\r\n");
    sim_run_out(&rig);
    rig.seen = rig.count;
    const uint64_t t = rig.now_us;
    send_code('Y'); /* queries and settings do not count */
    sim_run_out(&rig);
    expect_at(0, 160, 160, 160);
    TEST_ASSERT_TRUE(rig.now_us > t);
    expect_cr(rig.now_us);

    mpc_at(0, 0, 0); /* and no work position: nothing moves */
    send_code('H');
    expect_cr(0);
    send_code('Y');
    expect_cr(0);
    (void)expect_note(DR_NOTE_NO_WORK);
    expect_idle();
}

/* -- Centre and calibrate --------------------------------------------------------------------------------------------- */

static void centre_goes_straight_to_the_middle(void)
{
    static const uint16_t firmware[] = {0x100, 0x102, 0x103};
    for (unsigned f = 0; f < 3; f++) {
        set_up(firmware[f], DR_STAGE_MPC_MP265, NONE, NONE, NONE);
        send_code('N');
        const uint32_t us = full(200000); /* 12.5 mm */
        sim_run_to(&rig, us / 2);
        expect_at(0, (uint32_t)(UINT64_C(200000) * (us / 2) / us), (uint32_t)(UINT64_C(100000) * (us / 2) / us),
                  (uint32_t)(UINT64_C(200000) * (us / 2) / us));
        sim_run_to(&rig, us - 1);
        expect_nothing();
        sim_run_to(&rig, us);
        expect_cr(us);
        expect_at(0, 200000, 100000, 200000);
        expect_idle();
    }
}

static void calibration_takes_the_home_path_and_goes_beyond(void)
{
    static const uint16_t firmware[] = {0x104, 0x105, 0x106, 0x321};
    static const uint32_t at[3] = {16000, 3200, 16000};
    for (unsigned f = 0; f < 4; f++) {
        uint32_t corner[3];
        corner_of(10, at, corner);
        prepare(DR_MPC);
        rig.c.firmware = firmware[f];
        memcpy(rig.drives[0].position_steps, at, sizeof at);
        start();
        send_code('N');
        const uint32_t home = full(16000) + full(larger(3200, corner[2]));
        sim_run_to(&rig, full(16000));
        expect_at(0, corner[0], corner[1], corner[2]);
        for (unsigned k = 0; k <= 4; k++) { /* 250 um beyond, 83,334 us each way; never less than 0 */
            sim_run_to(&rig, home + k * 41667);
            expect_at(0, 0, 0, 0);
        }
        expect_cr(home + 2 * 83334);
        expect_idle();
    }
}

static void calibration_beyond_zero_lasts_by_length_not_by_steps(void)
{
    set_up(0x321, DR_STAGE_MPC_MP845, NONE, NONE, NONE); /* 250 um are no whole number of its steps */
    send_code('N');
    sim_run_out(&rig);
    expect_cr(2 * 83334);
    set_up(0x321, DR_STAGE_MPC_MT800, NONE, NONE, NONE);
    send_code('N');
    sim_run_out(&rig);
    expect_cr(2 * 50000);
}

static void an_interrupted_calibration_is_remembered(void)
{
    mpc_at(1600, 1600, 1600);
    send_code('N');
    sim_run(&rig, 1000);
    send_code(3);
    expect_cr(1000);
    TEST_ASSERT_EQUAL(DR_UNCALIBRATED, rig.drives[0].calibration);
    send_code('C'); /* commands go on working */
    expect_mpc_position(1000, 1, 1600 - 1600 * 1000 / full(1600), 1600,
                        1600 - (1600 * 15886 / 28660) * 1000 / full(1600));
    send_code('N'); /* a whole one alone is not enough */
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    TEST_ASSERT_NOT_EQUAL(DR_CALIBRATED, rig.drives[0].calibration);
    TEST_ASSERT_TRUE(power(false));
    TEST_ASSERT_TRUE(power(true));
    TEST_ASSERT_NOT_EQUAL(DR_CALIBRATED, rig.drives[0].calibration); /* nor is a power cycle */
    send_code('N');
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    TEST_ASSERT_EQUAL(DR_CALIBRATED, rig.drives[0].calibration);
    TEST_ASSERT_EQUAL(DR_CALIBRATED, rig.drives[1].calibration); /* the other drive was never spoilt */
}

/* -- Interrupt -------------------------------------------------------------------------------------------------------- */

static void interrupt_stops_every_move_with_one_cr(void)
{
    static const char codes[] = "HYNMS";
    for (unsigned i = 0; i < 5; i++) {
        for (unsigned later = 0; later < 2; later++) {
            static const uint32_t home[3] = {0, 0, 0}, there[3] = {1600, 1600, 1600};
            a_drive_at(codes[i] == 'Y' ? home : there, there, true);
            if (codes[i] == 'Y') {
                send_code('H');
                expect_cr(0);
            }
            if (codes[i] == 'M') {
                send_point('M', 0, 0, 0);
            } else if (codes[i] == 'S') {
                send_line(15, 0, 0, 0);
            } else {
                send_code(codes[i]);
            }
            sim_run(&rig, later ? 20000 : 7);
            uint32_t at[3];
            dr_controller_position(&rig.c, 0, sim_clock(&rig), at);
            send_code(3);
            expect_cr(rig.now_us);
            sim_run(&rig, 10000000);
            expect_idle(); /* the interrupted move sends none of its own */
            expect_at(0, at[0], at[1], at[2]);
            send_code(3);
            expect_cr(rig.now_us);
            expect_idle();
        }
    }
}

/* -- Streaming [M note 16] -------------------------------------------------------------------------------------------- */

static void streaming_sends_each_whole_micron(void)
{
    mpc_at(1600, 0, 0);
    send_code('O');
    expect_cr(0);
    send_line(15, 1600 - 16 * 5 - 7, 3, 0); /* 87 steps: 5.44 um at 1,300 um/s */
    const uint64_t us = takes_us(87, 4, 1300);
    sim_run_out(&rig);
    for (uint64_t k = 1; k <= 5; k++) { /* micron k = 16 k steps of 87 */
        const uint64_t at = (k * 16 * us + 86) / 87;
        expect_stream(at, (uint32_t)(1600 - 87 * at / us), (uint32_t)(3 * at / us), 0);
    }
    expect_cr(us);
    expect_idle();
    send_line(15, 1600 - 80, 3, 0); /* 7 steps: no whole micron */
    sim_run_out(&rig);
    expect_cr(us + takes_us(7, 4, 1300));
    const uint64_t t = rig.now_us;
    send_point('M', 1600, 3, 0); /* other moves do not stream */
    sim_run_out(&rig);
    expect_cr(t + full(80));
    send_code('F');
    expect_cr(rig.now_us);
    send_line(15, 0, 0, 0);
    sim_run_out(&rig);
    expect_cr(t + full(80) + takes_us(1600, 4, 1300));
    expect_idle();
}

static void the_last_micron_comes_before_the_cr(void)
{
    mpc_at(0, 0, 0);
    send_code('O');
    expect_cr(0);
    send_line(0, 0, 0, 32);
    sim_run_out(&rig);
    const uint64_t us = (UINT64_C(2) * 100000000 + 8124) / 8125; /* 2 um at 81.25 um/s */
    expect_stream((us + 1) / 2, 0, 0, 16);
    expect_stream(us, 0, 0, 32);
    expect_cr(us);
    expect_idle();
}

static void interrupt_ends_a_stream_at_a_whole_frame(void)
{
    mpc_at(0, 0, 0);
    send_code('O');
    sim_run_out(&rig);
    expect_cr(0);
    rig.byte_us = 78; /* 128,000 baud */
    sim_run_to(&rig, 1000);
    send_line(7, 160, 0, 0); /* 10 um at 650 um/s: a micron every 1,538.5 us; a frame takes 12 * 78 = 936 us */
    const uint64_t us = takes_us(160, 4, 650), first = 1000 + (us + 9) / 10;
    sim_run_to(&rig, first + 200);
    send_code(3);
    sim_run_out(&rig);
    TEST_ASSERT_EQUAL(14, rig.count);
    for (unsigned k = 0; k < 12; k++) {
        TEST_ASSERT_EQUAL_UINT64(first + k * 78, rig.out[1 + k].at_us);
    }
    TEST_ASSERT_EQUAL_HEX8(0x0D, rig.out[13].byte);
    TEST_ASSERT_EQUAL_UINT64(first + 12 * 78, rig.out[13].at_us);
    expect_at(0, (uint32_t)(160 * (first + 200 - 1000) / us), 0, 0);
    rig.seen = rig.count;
    expect_idle();
}

static void a_busy_line_skips_microns_and_delays_the_cr_by_a_frame_at_most(void)
{
    for (unsigned level = 10; level < 16; level++) {
        mpc_at(0, 0, 0);
        send_code('O');
        expect_cr(0);
        rig.byte_us = 79; /* 948 us a frame; s = 12 has a micron every 946.7 us */
        sim_run_to(&rig, 1);
        send_line(level, 16 * 500, 0, 0);
        sim_run_out(&rig);
        const uint64_t us = (UINT64_C(500) * 100000000 + 8125 * (level + 1) - 1) / (8125 * (level + 1));
        uint64_t taken = 0, line_free = 0, micron = 0; /* when the last frame's last byte was taken, and had left */
        size_t frames = 0;
        while (taken < 1 + us) {
            /* made of the newest micron at the instant when the last byte was taken, else of the next one */
            uint64_t newest = taken < 1 ? 0 : (taken - 1) * 500 / us, made = taken;
            if (newest <= micron) {
                newest = micron + 1;
                made = 1 + (newest * us + 499) / 500;
            }
            if (newest > 500) {
                break;
            }
            const uint64_t at = made > line_free ? made : line_free;
            const size_t k = 1 + 12 * frames;
            TEST_ASSERT_TRUE(k + 12 <= rig.count);
            TEST_ASSERT_EQUAL_UINT64(at, rig.out[k].at_us);
            TEST_ASSERT_EQUAL_HEX8(0xFF, rig.out[k].byte);
            const uint32_t x =
                rig.out[k + 3].byte | (uint32_t)rig.out[k + 4].byte << 8 | (uint32_t)rig.out[k + 5].byte << 16;
            TEST_ASSERT_EQUAL_UINT32(16 * newest, x);
            micron = newest;
            taken = at + 11 * 79;
            line_free = at + 12 * 79;
            frames++;
        }
        TEST_ASSERT_TRUE(level < 12 ? frames == 500 : frames < 500);
        TEST_ASSERT_EQUAL(1 + 12 * frames + 1, rig.count);
        const sim_byte last = rig.out[rig.count - 1];
        TEST_ASSERT_EQUAL_HEX8(0x0D, last.byte);
        TEST_ASSERT_EQUAL_UINT64(larger((uint32_t)line_free, (uint32_t)us + 1), last.at_us);
        TEST_ASSERT_TRUE(last.at_us <= 1 + us + 12 * 79);
        rig.seen = rig.count;
        expect_idle();
    }
}

static void streamed_bytes_may_be_anything(void)
{
    prepare(DR_MPC);
    dr_drive_init(&rig.drives[0], DR_STAGE_MPC_MP865);
    rig.drives[0].position_steps[0] = 0x0D0D00; /* CR, CR */
    start();
    send_code('O');
    expect_cr(0);
    send_line(15, 0x0D0D00 + 13, 0, 0); /* 13 * 3/64 = 0.6 um */
    sim_run_out(&rig);
    expect_cr(rig.now_us);
    send_line(15, 0x0D0D0D + 64, 0, 0); /* 3 um: 21.33 steps each */
    const uint64_t t = rig.now_us, us = takes_us(64, 3, 1300);
    sim_run_out(&rig);
    for (uint64_t k = 1; k <= 3; k++) {
        const uint64_t at = (k * us + 2) / 3;
        expect_stream(t + at, (uint32_t)(0x0D0D0D + 64 * at / us), 0, 0);
    }
    expect_cr(t + us);
    expect_idle();
}

/* -- Mode ------------------------------------------------------------------------------------------------------------- */

static void modes_are_0_to_9(void)
{
    mpc_at(0, 0, 0);
    unsigned mode = 0;
    for (unsigned value = 0; value < 256; value++) {
        send_value('L', value);
        expect_cr(0);
        mode = value <= 9 ? value : mode;
        TEST_ASSERT_EQUAL(mode, rig.drives[0].mode);
        if (value > 9) {
            TEST_ASSERT_EQUAL_UINT32(value, expect_note(DR_NOTE_BAD_VALUE).value);
        } else {
            expect_no_note(DR_NOTE_BAD_VALUE);
        }
    }
    expect_idle();
}

static void targets_are_clipped_to_the_travel(void)
{
    static const struct {
        dr_stage_id stage;
        uint16_t firmware;
        uint32_t end[3];
    } stages[] = {
        {DR_STAGE_MPC_MP225, 0x321, {400000, 400000, 400000}},  {DR_STAGE_MPC_MP285, 0x321, {400000, 400000, 400000}},
        {DR_STAGE_MPC_MP265, 0x321, {400000, 200000, 400000}},  {DR_STAGE_MPC_MP845, 0x321, {533333, 533333, 533333}},
        {DR_STAGE_MPC_MP865, 0x321, {1066667, 266667, 533333}}, {DR_STAGE_MPC_MT800, 0x321, {281600, 281600, 281600}},
        {DR_STAGE_MPC_MOM, 0x313, {344000, 344000, 344000}},
    };
    for (size_t i = 0; i < 7; i++) {
        const uint32_t *end = stages[i].end;
        set_up(stages[i].firmware, stages[i].stage, NONE, NONE, NONE);
        send_point('M', end[0], end[1], end[2]);
        sim_run_out(&rig);
        expect_no_note(DR_NOTE_CLIPPED);
        expect_at(0, end[0], end[1], end[2]);
        expect_cr(rig.now_us);
        send_point('M', end[0] - 100, end[1] + 1, UINT32_MAX);
        TEST_ASSERT_EQUAL_UINT32(DR_Y, expect_note(DR_NOTE_CLIPPED).value);
        TEST_ASSERT_EQUAL_UINT32(DR_Z, expect_note(DR_NOTE_CLIPPED).value);
        sim_run_out(&rig);
        expect_at(0, end[0] - 100, end[1], end[2]);
        expect_cr(rig.now_us);
        send_line(15, UINT32_C(0x80000000), end[1] - 5, end[2]);
        sim_run_out(&rig);
        expect_at(0, end[0], end[1] - 5, end[2]);
        expect_cr(rig.now_us);
        expect_idle();
    }
}

static void tests(void)
{
    RUN_TEST(factory_settings);
    RUN_TEST(what_is_connected_is_told_by_u_or_a);
    RUN_TEST(nothing_is_answered_where_nothing_is_connected);
    RUN_TEST(select_answers_by_firmware);
    RUN_TEST(moves_act_on_the_active_drive_only);
    RUN_TEST(orthogonal_moves_run_each_axis_at_full_speed);
    RUN_TEST(lines_run_at_sixteen_speeds);
    RUN_TEST(home_runs_along_the_diagonal);
    RUN_TEST(work_retraces_home);
    RUN_TEST(switch_8_leaves_y_out_of_home_and_work);
    RUN_TEST(work_needs_a_home_before_it);
    RUN_TEST(centre_goes_straight_to_the_middle);
    RUN_TEST(calibration_takes_the_home_path_and_goes_beyond);
    RUN_TEST(calibration_beyond_zero_lasts_by_length_not_by_steps);
    RUN_TEST(an_interrupted_calibration_is_remembered);
    RUN_TEST(interrupt_stops_every_move_with_one_cr);
    RUN_TEST(streaming_sends_each_whole_micron);
    RUN_TEST(the_last_micron_comes_before_the_cr);
    RUN_TEST(interrupt_ends_a_stream_at_a_whole_frame);
    RUN_TEST(a_busy_line_skips_microns_and_delays_the_cr_by_a_frame_at_most);
    RUN_TEST(streamed_bytes_may_be_anything);
    RUN_TEST(modes_are_0_to_9);
    RUN_TEST(targets_are_clipped_to_the_travel);
}

int main(void)
{
    UNITY_BEGIN();
    at_every_clock(tests);
    return UNITY_END();
}
