/* dr_device against the manuals. Every number here is typed from [T] or [M] in the manuals' own units (mm, um/s, decimal
 * factors), so that the arithmetic that leads to the core's integers is done here once more. */
#include "dr_device.h"

#include "unity.h"

#include <math.h>

void setUp(void) {}
void tearDown(void) {}

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* -- Instants ------------------------------------------------------------------------------------------------------ */

static void instants_are_ordered_across_the_wrap(void)
{
    TEST_ASSERT_TRUE(dr_us_before(0, 1));
    TEST_ASSERT_FALSE(dr_us_before(1, 0));
    TEST_ASSERT_FALSE(dr_us_before(7, 7));
    TEST_ASSERT_TRUE(dr_us_before(UINT32_MAX, 0));
    TEST_ASSERT_FALSE(dr_us_before(0, UINT32_MAX));
    TEST_ASSERT_TRUE(dr_us_before(UINT32_C(0x7FFFFFFF), UINT32_C(0x80000000)));
    for (uint32_t bit = 0; bit < 31; bit++) {
        const dr_us span = UINT32_C(1) << bit;
        for (uint32_t k = 0; k < 64; k++) {
            const dr_us at = k * UINT32_C(0x04000001) - 3u;
            TEST_ASSERT_TRUE(dr_us_before(at, at + span));
            TEST_ASSERT_FALSE(dr_us_before(at + span, at));
        }
    }
}

/* -- Speeds -------------------------------------------------------------------------------------------------------- */

/* [T table 7], column um/s; speed 0 is missing there and follows from note 11: (5000 / 16) * (0 + 1). */
static const double trio_um_per_s[16] = {312.5,  625.0,  937.5,  1250.0, 1562.5, 1875.0, 2187.5, 2500.0,
                                         2812.5, 3125.0, 3437.5, 3750.0, 4062.5, 4375.0, 4687.5, 5000.0};
/* [M table 10], column um/s. */
static const double mpc_um_per_s[16] = {81.25,  162.50, 243.75, 325.00, 406.25,  487.50,  568.75,  650.00,
                                        731.25, 812.50, 893.75, 975.00, 1056.25, 1137.50, 1218.75, 1300.00};
/* [P], quirk measured-speeds. */
static const uint32_t measured_um_per_s[16] = {338, 361, 383, 412, 441,  478,  523,  573,
                                               638, 718, 815, 958, 1139, 1404, 1890, 2767};

static void speeds_of_straight_lines_are_the_printed_ones(void)
{
    for (uint8_t stage = DR_STAGE_TRIO_MP845; stage < DR_STAGES; stage++) {
        const bool mpc = stage >= DR_STAGE_MPC_MP225;
        for (uint8_t level = 0; level < 16; level++) {
            const double um_per_s = mpc ? mpc_um_per_s[level] : trio_um_per_s[level];
            TEST_ASSERT_EQUAL_UINT32((uint32_t)(um_per_s * 64.0), dr_speed_quanta_per_s((dr_stage_id)stage, level));
            /* notes 11 and 12, and the column "% of Max." */
            const double most = mpc ? 1300.0 : 5000.0;
            TEST_ASSERT_TRUE(um_per_s == most / 16.0 * (level + 1.0));
        }
    }
}

static void full_speeds_are_those_of_the_stages(void)
{
    static const struct {
        dr_stage_id stage;
        uint32_t mm_per_s;
    } full[] = {
        {DR_STAGE_TRIO_MP845, 5}, {DR_STAGE_TRIO_MP865, 5}, {DR_STAGE_TRIO_MP285, 5}, /* [T note 11] */
        {DR_STAGE_TRIO_MP265, 5}, {DR_STAGE_MPC_MP225, 3},  {DR_STAGE_MPC_MP265, 3},
        {DR_STAGE_MPC_MP845, 3}, /* [M table 8] */
        {DR_STAGE_MPC_MP865, 3},  {DR_STAGE_MPC_MP285, 5},  {DR_STAGE_MPC_MT800, 5},
        {DR_STAGE_MPC_MOM, 5},
    };
    TEST_ASSERT_EQUAL(DR_STAGES - 1, COUNT(full));
    for (size_t i = 0; i < COUNT(full); i++) {
        dr_stage stage;
        TEST_ASSERT_TRUE(dr_stage_get(full[i].stage, &stage));
        TEST_ASSERT_EQUAL_UINT16(full[i].mm_per_s * 1000, stage.full_speed_um_per_s);
        TEST_ASSERT_EQUAL_UINT32(full[i].mm_per_s * 64000, dr_speed_quanta_per_s(full[i].stage, DR_SPEED_FULL));
    }
}

static void measured_speeds_are_those_of_the_protocol(void)
{
    for (uint8_t level = 0; level < 16; level++) {
        TEST_ASSERT_EQUAL_UINT32(measured_um_per_s[level] * 64, dr_measured_quanta_per_s(level));
    }
    TEST_ASSERT_EQUAL_UINT32(4650u * 64, dr_measured_quanta_per_s(DR_SPEED_FULL));
}

/* -- Stages -------------------------------------------------------------------------------------------------------- */

/* Length of travel in mm and of a microstep in um: [T tables 4, 5], [M tables 6, 7]. The MP-265 on a TRIO: [P]. */
static const struct {
    dr_stage_id stage;
    dr_kind kind;
    double um_per_step;
    double steps_per_um; /* as printed */
    double mm[3];
    uint32_t steps[3]; /* as printed, but for [M table 7], which is wrong: [P] */
} stages[] = {
    {DR_STAGE_TRIO_MP845, DR_TRIO, 0.09375, 10.66666666667, {25, 25, 25}, {266667, 266667, 266667}},
    {DR_STAGE_TRIO_MP865, DR_TRIO, 0.09375, 10.66666666667, {50, 12.5, 25}, {533333, 133333, 266667}},
    {DR_STAGE_TRIO_MP285, DR_TRIO, 0.125, 8, {25, 25, 25}, {200000, 200000, 200000}},
    {DR_STAGE_TRIO_MP265, DR_TRIO, 0.125, 8, {25, 12.5, 25}, {200000, 100000, 200000}},
    {DR_STAGE_MPC_MP225, DR_MPC, 0.0625, 16, {25, 25, 25}, {400000, 400000, 400000}},
    {DR_STAGE_MPC_MP285, DR_MPC, 0.0625, 16, {25, 25, 25}, {400000, 400000, 400000}},
    {DR_STAGE_MPC_MP265, DR_MPC, 0.0625, 16, {25, 12.5, 25}, {400000, 200000, 400000}},
    {DR_STAGE_MPC_MP845, DR_MPC, 0.046875, 21.33333333, {25, 25, 25}, {533333, 533333, 533333}},
    {DR_STAGE_MPC_MP865, DR_MPC, 0.046875, 21.33333333, {50, 12.5, 25}, {1066667, 266667, 533333}},
    {DR_STAGE_MPC_MT800, DR_MPC, 0.078125, 12.8, {22, 22, 22}, {281600, 281600, 281600}},
    {DR_STAGE_MPC_MOM, DR_MPC, 0.0625, 16, {21.5, 21.5, 21.5}, {344000, 344000, 344000}},
};

static void microsteps_are_those_of_the_conversion_tables(void)
{
    TEST_ASSERT_EQUAL(DR_STAGES - 1, COUNT(stages));
    for (size_t i = 0; i < COUNT(stages); i++) {
        dr_stage stage;
        TEST_ASSERT_TRUE(dr_stage_get(stages[i].stage, &stage));
        TEST_ASSERT_EQUAL(stages[i].kind, stage.kind);
        TEST_ASSERT_TRUE(stages[i].um_per_step * 64.0 == stage.quanta_per_step);
        TEST_ASSERT_TRUE(fabs(stages[i].steps_per_um * stages[i].um_per_step - 1.0) < 1e-9);
    }
}

static void travels_are_the_printed_integers_and_fit_the_lengths(void)
{
    for (size_t i = 0; i < COUNT(stages); i++) {
        dr_stage stage;
        TEST_ASSERT_TRUE(dr_stage_get(stages[i].stage, &stage));
        for (uint8_t axis = 0; axis < DR_AXES; axis++) {
            const double um = stages[i].mm[axis] * 1000.0;
            TEST_ASSERT_EQUAL_UINT32(stages[i].steps[axis], stage.travel_steps[axis]);
            TEST_ASSERT_EQUAL_UINT32(lround(um / stages[i].um_per_step), stage.travel_steps[axis]);
            TEST_ASSERT_EQUAL_UINT32(stage.travel_steps[axis], dr_um_to_steps((uint32_t)um, stage.quanta_per_step));
        }
    }
}

static void microns_become_the_nearest_microstep(void)
{
    static const uint8_t quanta[] = {3, 4, 5, 6, 8};
    for (size_t q = 0; q < COUNT(quanta); q++) {
        for (uint32_t um = 0; um <= 50000; um += um < 2000 ? 1u : 17u) {
            const uint32_t steps = dr_um_to_steps(um, quanta[q]);
            /* nearest: half a step off at most, in whole quanta: 2 * |steps * q - um * 64| <= q */
            const int64_t off = (int64_t)steps * quanta[q] - (int64_t)um * 64;
            TEST_ASSERT_TRUE(2 * (off < 0 ? -off : off) <= quanta[q]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(10667, dr_um_to_steps(1000, 6)); /* where the TRIO's calibration ends [P] */
    TEST_ASSERT_EQUAL_UINT32(8000, dr_um_to_steps(1000, 8));
    TEST_ASSERT_EQUAL_UINT32(11, dr_um_to_steps(1, 6)); /* the trap: the same MP-845 on the two controllers */
    TEST_ASSERT_EQUAL_UINT32(21, dr_um_to_steps(1, 3));
}

static void there_is_no_other_stage(void)
{
    dr_stage stage;
    TEST_ASSERT_FALSE(dr_stage_get(DR_STAGE_NONE, &stage));
    TEST_ASSERT_FALSE(dr_stage_get(DR_STAGES, &stage));
    TEST_ASSERT_FALSE(dr_stage_get((dr_stage_id)255, &stage));
    TEST_ASSERT_NOT_EQUAL(DR_FIT_YES, dr_stage_fits(DR_STAGES, DR_MPC, 0x321, 1));
    TEST_ASSERT_EQUAL_UINT32(0, dr_speed_quanta_per_s(DR_STAGE_NONE, DR_SPEED_FULL)); /* it does not move */
}

static void stages_fit_by_controller_firmware_and_port(void)
{
    static const uint16_t firmware[] = {0x100, 0x103, 0x105, 0x106, 0x262, 0x299, 0x300, 0x312, 0x313, 0x314,
                                        0x315, 0x316, 0x317, 0x318, 0x319, 0x320, 0x321, 0x322, 0x9999};
    for (uint8_t id = DR_STAGE_TRIO_MP845; id < DR_STAGES; id++) {
        const dr_kind home = id >= DR_STAGE_MPC_MP225 ? DR_MPC : DR_TRIO;
        for (size_t f = 0; f < COUNT(firmware); f++) {
            for (uint8_t port = 1; port <= 4; port++) {
                dr_fit fit = DR_FIT_YES;
                if (id == DR_STAGE_MPC_MP845 && firmware[f] < 0x319) {
                    fit = DR_FIT_FIRMWARE_TOO_OLD; /* "Requires firmware v3.19+" */
                } else if (id == DR_STAGE_MPC_MP865 && firmware[f] < 0x321) {
                    fit = DR_FIT_FIRMWARE_TOO_OLD; /* "Requires firmware v3.21+" */
                } else if (id == DR_STAGE_MPC_MOM && firmware[f] != 0x313 && firmware[f] != 0x316) {
                    fit = DR_FIT_FIRMWARE_EXACTLY; /* "firmware v3.13 or 3.16, and device Port A only" */
                } else if (id == DR_STAGE_MPC_MOM && port != 1 && port != 3) {
                    fit = DR_FIT_PORT;
                }
                TEST_ASSERT_EQUAL(fit, dr_stage_fits((dr_stage_id)id, home, firmware[f], port));
                TEST_ASSERT_EQUAL(DR_FIT_OTHER_CONTROLLER,
                                  dr_stage_fits((dr_stage_id)id, home == DR_MPC ? DR_TRIO : DR_MPC, firmware[f], port));
            }
        }
    }
}

/* -- Diagonals ----------------------------------------------------------------------------------------------------- */

/* [M table 2] as printed: the steepness relative to 45 degrees, the angle, the four switches. */
static const struct {
    char steepness; /* more, none, less */
    int angle_deg;
    uint8_t switches[4];
} table_2[16] = {
    {'m', 11, {0, 0, 0, 0}}, {'m', 14, {1, 0, 0, 0}}, {'m', 21, {0, 1, 0, 0}}, {'m', 27, {1, 1, 0, 0}},
    {'m', 29, {0, 0, 1, 0}}, {'m', 35, {1, 0, 1, 0}}, {'m', 39, {0, 1, 1, 0}}, {'n', 45, {1, 1, 1, 0}},
    {'l', 39, {0, 0, 0, 1}}, {'l', 35, {1, 0, 0, 1}}, {'l', 29, {0, 1, 0, 1}}, {'l', 27, {1, 1, 0, 1}},
    {'l', 21, {0, 0, 1, 1}}, {'l', 14, {1, 0, 1, 1}}, {'l', 11, {0, 1, 1, 1}}, {'l', 7, {1, 1, 1, 1}},
};

static void diagonals_are_those_of_table_2(void)
{
    static const int steepness_deg[16] = {79, 76, 69, 63, 61, 55, 51, 45, 39, 35, 29, 27, 21, 14, 11, 7}; /* [P] */
    for (uint8_t value = 0; value < 16; value++) {
        const uint8_t *on = table_2[value].switches;
        TEST_ASSERT_EQUAL(value, on[0] + 2 * on[1] + 4 * on[2] + 8 * on[3]);
        const int deg = table_2[value].steepness == 'm' ? 90 - table_2[value].angle_deg : table_2[value].angle_deg;
        TEST_ASSERT_EQUAL(steepness_deg[value], deg);
        const double radians = deg * acos(-1.0) / 180.0;
        const dr_diagonal diagonal = dr_diagonal_get(value);
        TEST_ASSERT_EQUAL_UINT16(lround(32768.0 * cos(radians)), diagonal.cos);
        TEST_ASSERT_EQUAL_UINT16(lround(32768.0 * sin(radians)), diagonal.sin);
    }
    TEST_ASSERT_EQUAL(10, DR_DIAGONAL_DEFAULT); /* switches 0,1,0,1: 29 degrees */
}

static void angles_of_the_trio_have_a_direction_each(void)
{
    for (uint8_t deg = 0; deg <= 90; deg++) {
        const double radians = deg * acos(-1.0) / 180.0;
        const dr_diagonal direction = dr_angle_get(deg);
        TEST_ASSERT_EQUAL_UINT16(lround(32768.0 * cos(radians)), direction.cos);
        TEST_ASSERT_EQUAL_UINT16(lround(32768.0 * sin(radians)), direction.sin);
    }
}

/* -- Commands ------------------------------------------------------------------------------------------------------ */

typedef struct {
    uint8_t code;
    dr_op op;
    int total; /* bytes of the command, "Total Bytes" of the Tx row */
    int reply; /* bytes of the reply, "Total Bytes" of the Rx row */
    int is;
    uint16_t since, until;
} expected;

#define MOVE DR_IS_MOTION
#define STOP DR_IS_STOPPABLE
#define GOTO DR_IS_TARGETED

/* [T table 6]; 0x58, 0x59, 0x5A for X, Y, Z: [P]. ^C stops 'S' only. */
static const expected trio_commands[] = {
    {0x63, DR_OP_TRIO_POSITION, 1, 14, DR_IS_QUERY, 0, 0xFFFF},
    {0x43, DR_OP_TRIO_POSITION, 1, 14, DR_IS_QUERY, 0, 0xFFFF},
    {0x68, DR_OP_TRIO_HOME, 1, 1, MOVE, 0, 0xFFFF},
    {0x77, DR_OP_TRIO_WORK, 1, 1, MOVE, 0, 0xFFFF},
    {0x48, DR_OP_TRIO_HOME_TO, 13, 1, MOVE | GOTO, 0, 0xFFFF},
    {0x57, DR_OP_TRIO_WORK_TO, 13, 1, MOVE | GOTO, 0, 0xFFFF},
    {0x53, DR_OP_TRIO_LINE, 14, 1, MOVE | GOTO | STOP, 0, 0xFFFF},
    {0x78, DR_OP_TRIO_X, 5, 1, MOVE | GOTO, 0, 0xFFFF},
    {0x58, DR_OP_TRIO_X, 5, 1, MOVE | GOTO, 0, 0xFFFF},
    {0x79, DR_OP_TRIO_Y, 5, 1, MOVE | GOTO, 0, 0xFFFF},
    {0x59, DR_OP_TRIO_Y, 5, 1, MOVE | GOTO, 0, 0xFFFF},
    {0x7A, DR_OP_TRIO_Z, 5, 1, MOVE | GOTO, 0, 0xFFFF},
    {0x5A, DR_OP_TRIO_Z, 5, 1, MOVE | GOTO, 0, 0xFFFF},
    {0x41, DR_OP_TRIO_ANGLE, 2, 1, DR_IS_SETTING, 0, 0xFFFF},
    {0x52, DR_OP_TRIO_RECALIBRATE, 1, 1, MOVE, 0x262, 0xFFFF},
    {0x03, DR_OP_TRIO_INTERRUPT, 1, 1, DR_IS_INTERRUPT, 0, 0xFFFF},
};

/* [M table 9], column "Ver."; ^C stops any move. */
static const expected mpc_commands[] = {
    {0x41, DR_OP_MPC_COUNT, 1, 2, DR_IS_QUERY, 0, 0x299},
    {0x55, DR_OP_MPC_DRIVES, 1, 6, DR_IS_QUERY, 0x300, 0xFFFF},
    {0x4B, DR_OP_MPC_ACTIVE, 1, 2, DR_IS_QUERY, 0, 0x299},
    {0x4B, DR_OP_MPC_ACTIVE, 1, 4, DR_IS_QUERY, 0x300, 0xFFFF},
    {0x43, DR_OP_MPC_POSITION, 1, 14, DR_IS_QUERY, 0, 0xFFFF},
    {0x49, DR_OP_MPC_SELECT, 2, 1, DR_IS_SETTING, 0, 0x105},
    {0x49, DR_OP_MPC_SELECT, 2, 2, DR_IS_SETTING, 0x106, 0xFFFF},
    {0x48, DR_OP_MPC_HOME, 1, 1, MOVE | STOP, 0, 0xFFFF},
    {0x59, DR_OP_MPC_WORK, 1, 1, MOVE | STOP, 0, 0xFFFF},
    {0x4E, DR_OP_MPC_CENTRE, 1, 1, MOVE | STOP, 0, 0x103},
    {0x4E, DR_OP_MPC_CALIBRATE, 1, 1, MOVE | STOP, 0x104, 0xFFFF},
    {0x4D, DR_OP_MPC_MOVE, 13, 1, MOVE | STOP | GOTO, 0, 0xFFFF},
    {0x53, DR_OP_MPC_LINE, 14, 1, MOVE | STOP | GOTO, 0x300, 0xFFFF},
    {0x03, DR_OP_MPC_INTERRUPT, 1, 1, DR_IS_INTERRUPT, 0, 0xFFFF},
    {0x46, DR_OP_MPC_STREAM_OFF, 1, 1, DR_IS_SETTING, 0x300, 0xFFFF},
    {0x4F, DR_OP_MPC_STREAM_ON, 1, 1, DR_IS_SETTING, 0x300, 0xFFFF},
    {0x4C, DR_OP_MPC_MODE, 2, 1, DR_IS_SETTING, 0, 0xFFFF},
};

static const struct {
    dr_kind kind;
    const expected *rows;
    size_t count;
} tables[] = {{DR_TRIO, trio_commands, COUNT(trio_commands)}, {DR_MPC, mpc_commands, COUNT(mpc_commands)}};

static const uint16_t firmware[] = {0x100, 0x102, 0x103, 0x104, 0x105, 0x106, 0x200, 0x261, 0x262,
                                    0x299, 0x300, 0x312, 0x313, 0x316, 0x319, 0x321, 0x9999};

static const expected *look_up(size_t table, uint16_t version, int code, int op)
{
    for (size_t i = 0; i < tables[table].count; i++) {
        const expected *row = &tables[table].rows[i];
        if (version >= row->since && version <= row->until && (code < 0 || row->code == code) &&
            (op < 0 || (int)row->op == op)) {
            return row;
        }
    }
    return NULL;
}

static void check_row(const expected *want, const dr_command *got)
{
    TEST_ASSERT_EQUAL(want->op, got->op);
    TEST_ASSERT_EQUAL(want->total - 1, got->args);
    TEST_ASSERT_EQUAL(want->reply, got->reply);
    TEST_ASSERT_EQUAL(want->is, got->is);
}

static void every_byte_is_the_command_that_the_firmware_knows(void)
{
    for (size_t t = 0; t < COUNT(tables); t++) {
        for (size_t f = 0; f < COUNT(firmware); f++) {
            for (int code = 0; code < 256; code++) {
                const expected *want = look_up(t, firmware[f], code, -1);
                dr_command got;
                TEST_ASSERT_EQUAL(want != NULL, dr_command_find(tables[t].kind, firmware[f], (uint8_t)code, &got));
                if (want != NULL) {
                    TEST_ASSERT_EQUAL(code, got.code);
                    check_row(want, &got);
                    TEST_ASSERT_TRUE(got.since <= firmware[f] && firmware[f] <= got.until);
                }
            }
        }
    }
}

static void every_operation_has_the_byte_that_a_host_sends(void)
{
    for (size_t t = 0; t < COUNT(tables); t++) {
        for (size_t f = 0; f < COUNT(firmware); f++) {
            for (int op = DR_OP_NONE; op <= DR_OPS; op++) {
                const expected *want = look_up(t, firmware[f], -1, op); /* the first row: lower case for c, x, y, z */
                dr_command got;
                TEST_ASSERT_EQUAL(want != NULL, dr_command_for(tables[t].kind, firmware[f], (dr_op)op, &got));
                if (want != NULL) {
                    TEST_ASSERT_EQUAL(want->code, got.code);
                    check_row(want, &got);
                }
            }
        }
    }
}

static void rows_come_in_turn_and_end(void)
{
    for (size_t t = 0; t < COUNT(tables); t++) {
        uint8_t rows = 0;
        dr_command row;
        while (dr_command_row(tables[t].kind, rows, &row)) {
            TEST_ASSERT_TRUE(row.since <= row.until);
            const expected *want = look_up(t, row.since < 0x100 ? 0x100 : row.since, row.code, row.op);
            TEST_ASSERT_NOT_NULL(want);
            check_row(want, &row);
            rows++;
            TEST_ASSERT_TRUE(rows < 64);
        }
        TEST_ASSERT_EQUAL(tables[t].count, rows);
        TEST_ASSERT_FALSE(dr_command_row(tables[t].kind, 255, &row));
    }
}

/* -- The line and the constants ------------------------------------------------------------------------------------- */

static void constants_are_those_of_the_manuals(void)
{
    TEST_ASSERT_EQUAL_UINT32(57600, DR_BAUD_TRIO); /* [T table 3] */
    TEST_ASSERT_EQUAL_UINT32(128000, DR_BAUD_MPC); /* [M table 5] */
    TEST_ASSERT_EQUAL(13, DR_CR);
    TEST_ASSERT_EQUAL('E', DR_NO_SUCH_DRIVE);
    TEST_ASSERT_EQUAL_HEX16(0x0312, DR_FIRMWARE_TRIO);
    TEST_ASSERT_EQUAL_HEX16(0x0321, DR_FIRMWARE_MPC);
    TEST_ASSERT_EQUAL(14, DR_FRAME_MAX);
    TEST_ASSERT_EQUAL(14, DR_REPLY_MAX);
    TEST_ASSERT_EQUAL(12, DR_STREAM_FRAME);
    TEST_ASSERT_EQUAL(30, DR_ANGLE_DEFAULT_DEG);
    TEST_ASSERT_EQUAL(90, DR_ANGLE_MAX_DEG);
    TEST_ASSERT_EQUAL(4, DR_PORTS);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(instants_are_ordered_across_the_wrap);
    RUN_TEST(speeds_of_straight_lines_are_the_printed_ones);
    RUN_TEST(full_speeds_are_those_of_the_stages);
    RUN_TEST(measured_speeds_are_those_of_the_protocol);
    RUN_TEST(microsteps_are_those_of_the_conversion_tables);
    RUN_TEST(travels_are_the_printed_integers_and_fit_the_lengths);
    RUN_TEST(microns_become_the_nearest_microstep);
    RUN_TEST(there_is_no_other_stage);
    RUN_TEST(stages_fit_by_controller_firmware_and_port);
    RUN_TEST(diagonals_are_those_of_table_2);
    RUN_TEST(angles_of_the_trio_have_a_direction_each);
    RUN_TEST(every_byte_is_the_command_that_the_firmware_knows);
    RUN_TEST(every_operation_has_the_byte_that_a_host_sends);
    RUN_TEST(rows_come_in_turn_and_end);
    RUN_TEST(constants_are_those_of_the_manuals);
    return UNITY_END();
}
