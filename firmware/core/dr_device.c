#include "dr_device.h"

/* Where constant tables live and how a row is read. A build for a machine that keeps constants apart from data (AVR) names
 * a header with its own two macros; the tables stay the same. */
#ifdef DR_ROM_HEADER
#include DR_ROM_HEADER
#else
#define DR_ROM
#define DR_ROM_READ(to, from) (*(to) = *(from))
#endif

#define ALWAYS DR_FIRMWARE_FIRST, DR_FIRMWARE_LAST
#define SINCE(version) (version), DR_FIRMWARE_LAST
#define UNTIL(version) DR_FIRMWARE_FIRST, (version)

#define QUERY DR_IS_QUERY
#define SETTING DR_IS_SETTING
#define MOTION DR_IS_MOTION
#define TARGETED (DR_IS_MOTION | DR_IS_TARGETED)
#define STOPPABLE DR_IS_STOPPABLE

/* [T table 6]. The codes are those of ASCII: the table prints other hexadecimal values for 'R', 'S', 'A' and 'X', 'Y', 'Z',
 * which are slips [P]. Where two codes do the same, the first is the one to send. */
static const dr_command DR_ROM trio_commands[] = {
    {'c', DR_OP_TRIO_POSITION, DR_ARGS_NONE, 14, QUERY, ALWAYS},
    {'C', DR_OP_TRIO_POSITION, DR_ARGS_NONE, 14, QUERY, ALWAYS},
    {'h', DR_OP_TRIO_HOME, DR_ARGS_NONE, 1, MOTION, ALWAYS},
    {'w', DR_OP_TRIO_WORK, DR_ARGS_NONE, 1, MOTION, ALWAYS},
    {'H', DR_OP_TRIO_HOME_TO, DR_ARGS_POINT, 1, TARGETED, ALWAYS},
    {'W', DR_OP_TRIO_WORK_TO, DR_ARGS_POINT, 1, TARGETED, ALWAYS},
    {'S', DR_OP_TRIO_LINE, DR_ARGS_LINE, 1, TARGETED | STOPPABLE, ALWAYS},
    {'x', DR_OP_TRIO_X, DR_ARGS_AXIS, 1, TARGETED, ALWAYS},
    {'X', DR_OP_TRIO_X, DR_ARGS_AXIS, 1, TARGETED, ALWAYS},
    {'y', DR_OP_TRIO_Y, DR_ARGS_AXIS, 1, TARGETED, ALWAYS},
    {'Y', DR_OP_TRIO_Y, DR_ARGS_AXIS, 1, TARGETED, ALWAYS},
    {'z', DR_OP_TRIO_Z, DR_ARGS_AXIS, 1, TARGETED, ALWAYS},
    {'Z', DR_OP_TRIO_Z, DR_ARGS_AXIS, 1, TARGETED, ALWAYS},
    {'A', DR_OP_TRIO_ANGLE, DR_ARGS_BYTE, 1, SETTING, ALWAYS},
    {'R', DR_OP_TRIO_RECALIBRATE, DR_ARGS_NONE, 1, MOTION, SINCE(0x0262)},
    {DR_INTERRUPT, DR_OP_TRIO_INTERRUPT, DR_ARGS_NONE, 1, DR_IS_INTERRUPT, ALWAYS},
};

/* [M table 9] */
static const dr_command DR_ROM mpc_commands[] = {
    {'A', DR_OP_MPC_COUNT, DR_ARGS_NONE, 2, QUERY, UNTIL(0x0299)},
    {'U', DR_OP_MPC_DRIVES, DR_ARGS_NONE, 6, QUERY, SINCE(0x0300)},
    {'K', DR_OP_MPC_ACTIVE, DR_ARGS_NONE, 2, QUERY, UNTIL(0x0299)},
    {'K', DR_OP_MPC_ACTIVE, DR_ARGS_NONE, 4, QUERY, SINCE(0x0300)},
    {'C', DR_OP_MPC_POSITION, DR_ARGS_NONE, 14, QUERY, ALWAYS},
    {'I', DR_OP_MPC_SELECT, DR_ARGS_BYTE, 1, SETTING, UNTIL(0x0105)},
    {'I', DR_OP_MPC_SELECT, DR_ARGS_BYTE, 2, SETTING, SINCE(0x0106)},
    {'H', DR_OP_MPC_HOME, DR_ARGS_NONE, 1, MOTION | STOPPABLE, ALWAYS},
    {'Y', DR_OP_MPC_WORK, DR_ARGS_NONE, 1, MOTION | STOPPABLE, ALWAYS},
    {'N', DR_OP_MPC_CENTRE, DR_ARGS_NONE, 1, MOTION | STOPPABLE, UNTIL(0x0103)},
    {'N', DR_OP_MPC_CALIBRATE, DR_ARGS_NONE, 1, MOTION | STOPPABLE, SINCE(0x0104)},
    {'M', DR_OP_MPC_MOVE, DR_ARGS_POINT, 1, TARGETED | STOPPABLE, ALWAYS},
    {'S', DR_OP_MPC_LINE, DR_ARGS_LINE, 1, TARGETED | STOPPABLE, SINCE(0x0300)},
    {DR_INTERRUPT, DR_OP_MPC_INTERRUPT, DR_ARGS_NONE, 1, DR_IS_INTERRUPT, ALWAYS},
    {'F', DR_OP_MPC_STREAM_OFF, DR_ARGS_NONE, 1, SETTING, SINCE(0x0300)},
    {'O', DR_OP_MPC_STREAM_ON, DR_ARGS_NONE, 1, SETTING, SINCE(0x0300)},
    {'L', DR_OP_MPC_MODE, DR_ARGS_BYTE, 1, SETTING, ALWAYS},
};

#define ROWS(table) (sizeof(table) / sizeof(table)[0])

static uint8_t row_count(dr_kind kind) { return kind == DR_TRIO ? ROWS(trio_commands) : ROWS(mpc_commands); }

bool dr_command_row(dr_kind kind, uint8_t index, dr_command *out)
{
    if (index >= row_count(kind))
        return false;
    DR_ROM_READ(out, kind == DR_TRIO ? &trio_commands[index] : &mpc_commands[index]);
    return true;
}

static bool known(const dr_command *row, uint16_t firmware) { return row->since <= firmware && firmware <= row->until; }

bool dr_command_find(dr_kind kind, uint16_t firmware, uint8_t code, dr_command *out)
{
    const uint8_t rows = row_count(kind);
    for (uint8_t i = 0; i < rows; i++) {
        uint8_t row_code; /* alone at first: on an AVR to copy whole rows takes longer than the line's next byte */
        DR_ROM_READ(&row_code, kind == DR_TRIO ? &trio_commands[i].code : &mpc_commands[i].code);
        if (row_code == code && dr_command_row(kind, i, out) && known(out, firmware))
            return true;
    }
    return false;
}

bool dr_command_for(dr_kind kind, uint16_t firmware, dr_op op, dr_command *out)
{
    for (uint8_t i = 0; dr_command_row(kind, i, out); i++) /* at most the rows of the table */
        if (out->op == op && known(out, firmware))
            return true;
    return false;
}

/* TRIO: [T tables 4 and 5]; MP-265 [M table 7]. MPC-200: [M tables 6, 7 and 8], with 25 mm at 16 steps/um = 400,000 [P]. */
static const dr_stage DR_ROM stages[DR_STAGES] = {
    [DR_STAGE_TRIO_MP845] = {DR_TRIO, 6, 5000, DR_FIRMWARE_FIRST, {266667, 266667, 266667}},
    [DR_STAGE_TRIO_MP865] = {DR_TRIO, 6, 5000, DR_FIRMWARE_FIRST, {533333, 133333, 266667}},
    [DR_STAGE_TRIO_MP285] = {DR_TRIO, 8, 5000, DR_FIRMWARE_FIRST, {200000, 200000, 200000}},
    [DR_STAGE_TRIO_MP265] = {DR_TRIO, 8, 5000, DR_FIRMWARE_FIRST, {200000, 100000, 200000}},
    [DR_STAGE_MPC_MP225] = {DR_MPC, 4, 3000, DR_FIRMWARE_FIRST, {400000, 400000, 400000}},
    [DR_STAGE_MPC_MP285] = {DR_MPC, 4, 5000, DR_FIRMWARE_FIRST, {400000, 400000, 400000}},
    [DR_STAGE_MPC_MP265] = {DR_MPC, 4, 3000, DR_FIRMWARE_FIRST, {400000, 200000, 400000}},
    [DR_STAGE_MPC_MP845] = {DR_MPC, 3, 3000, 0x0319, {533333, 533333, 533333}},
    [DR_STAGE_MPC_MP865] = {DR_MPC, 3, 3000, 0x0321, {1066667, 266667, 533333}},
    [DR_STAGE_MPC_MT800] = {DR_MPC, 5, 5000, DR_FIRMWARE_FIRST, {281600, 281600, 281600}},
    [DR_STAGE_MPC_MOM] = {DR_MPC, 4, 5000, 0x0313, {344000, 344000, 344000}},
};

bool dr_stage_get(dr_stage_id id, dr_stage *out)
{
    if (id <= DR_STAGE_NONE || id >= DR_STAGES)
        return false;
    DR_ROM_READ(out, &stages[id]);
    return true;
}

dr_fit dr_stage_fits(dr_stage_id id, dr_kind kind, uint16_t firmware, uint8_t port)
{
    dr_stage stage;
    if (!dr_stage_get(id, &stage) || stage.kind != kind)
        return DR_FIT_OTHER_CONTROLLER;
    if (id == DR_STAGE_MPC_MOM && firmware != 0x0313u && firmware != 0x0316u)
        return DR_FIT_FIRMWARE_EXACTLY;
    if (firmware < stage.since)
        return DR_FIT_FIRMWARE_TOO_OLD;
    if (id == DR_STAGE_MPC_MOM && port != 1u && port != 3u)
        return DR_FIT_PORT;
    return DR_FIT_YES;
}

uint32_t dr_um_to_steps(uint32_t um, uint8_t quanta_per_step)
{
    return (um * DR_QUANTA_PER_UM + quanta_per_step / 2u) / quanta_per_step;
}

uint32_t dr_speed_quanta_per_s(dr_stage_id id, uint8_t level)
{
    dr_stage stage;
    if (!dr_stage_get(id, &stage))
        return 0;
    if (level >= DR_SPEED_LEVELS)
        return (uint32_t)stage.full_speed_um_per_s * DR_QUANTA_PER_UM;
    const uint32_t fastest_um_per_s = stage.kind == DR_TRIO ? 5000u : 1300u; /* [T note 11], [M note 12] */
    return fastest_um_per_s * DR_QUANTA_PER_UM / DR_SPEED_LEVELS * (level + 1u);
}

/* um/s by level, then full speed: measured on one MPC-200 by the author of a public program [P]. */
static const uint16_t DR_ROM measured_um_per_s[DR_SPEED_LEVELS + 1u] = {338, 361, 383, 412,  441,  478,  523,  573, 638,
                                                                        718, 815, 958, 1139, 1404, 1890, 2767, 4650};

uint32_t dr_measured_quanta_per_s(uint8_t level)
{
    uint16_t um_per_s;
    DR_ROM_READ(&um_per_s, &measured_um_per_s[level < DR_SPEED_LEVELS ? level : DR_SPEED_FULL]);
    return (uint32_t)um_per_s * DR_QUANTA_PER_UM;
}

/* [M table 2]: 79, 76, 69, 63, 61, 55, 51, 45, 39, 35, 29, 27, 21, 14, 11 and 7 degrees against the horizontal [P]. */
static const dr_diagonal DR_ROM diagonals[DR_DIAGONALS] = {
    {6252, 32166},  {7927, 31795},  {11743, 30592}, {14876, 29197}, {15886, 28660}, {18795, 26842},
    {20622, 25466}, {23170, 23170}, {25466, 20622}, {26842, 18795}, {28660, 15886}, {29197, 14876},
    {30592, 11743}, {31795, 7927},  {32166, 6252},  {32524, 3993},
};

dr_diagonal dr_diagonal_get(uint8_t value)
{
    dr_diagonal direction;
    DR_ROM_READ(&direction, &diagonals[value % DR_DIAGONALS]);
    return direction;
}

/* 32768 * sin(degrees), rounded. */
static const uint16_t DR_ROM sines[DR_ANGLE_MAX_DEG + 1u] = {
    0,     572,   1144,  1715,  2286,  2856,  3425,  3993,  4560,  5126,  5690,  6252,  6813,  7371,  7927,  8481,
    9032,  9580,  10126, 10668, 11207, 11743, 12275, 12803, 13328, 13848, 14365, 14876, 15384, 15886, 16384, 16877,
    17364, 17847, 18324, 18795, 19261, 19720, 20174, 20622, 21063, 21498, 21926, 22348, 22763, 23170, 23571, 23965,
    24351, 24730, 25102, 25466, 25822, 26170, 26510, 26842, 27166, 27482, 27789, 28088, 28378, 28660, 28932, 29197,
    29452, 29698, 29935, 30163, 30382, 30592, 30792, 30983, 31164, 31336, 31499, 31651, 31795, 31928, 32052, 32166,
    32270, 32365, 32449, 32524, 32588, 32643, 32688, 32723, 32748, 32763, 32768,
};

dr_diagonal dr_angle_get(uint8_t angle_deg)
{
    const uint8_t deg = angle_deg < DR_ANGLE_MAX_DEG ? angle_deg : DR_ANGLE_MAX_DEG;
    dr_diagonal direction;
    DR_ROM_READ(&direction.cos, &sines[DR_ANGLE_MAX_DEG - deg]);
    DR_ROM_READ(&direction.sin, &sines[deg]);
    return direction;
}
