/* The limits as an image, and what must be right in them. Rows 70 and 71 of the fault matrix. */
#include "dr_limits.h"
#include "unity.h"

#include <string.h>

#define UM(um) ((int32_t)((um)*64))

static dr_limits good, read;
static uint8_t image[DR_LIMITS_IMAGE_BYTES + 1];
static dr_limits_problem problem;

void setUp(void)
{
    dr_limits_init(&good, DR_MPC);
    TEST_ASSERT_TRUE(dr_limits_init_drive(&good, 0, DR_STAGE_MPC_MP225));
    TEST_ASSERT_TRUE(dr_limits_init_drive(&good, 2, DR_STAGE_MPC_MP285));
    good.revision = 7;
    memcpy(good.serial, "A1", 2);
    good.drives[2].retract = DR_TO_MORE_Z;
    good.drives[2].surface_q = UM(8000);
    good.drives[2].clearance_q = (uint32_t)UM(500);
    good.drives[2].approach[DR_X] = 707;
    good.drives[2].approach[DR_Z] = -707;
    good.obstacle_count = 2;
    good.obstacles[0].shape = DR_SHAPE_BOX;
    good.obstacles[0].exit = DR_TO_LESS_Z;
    good.obstacles[0].box_q = (dr_box){{UM(9000), UM(9000), UM(17000)}, {UM(16000), UM(16000), UM(25000)}};
    good.obstacles[1].shape = DR_SHAPE_HALF;
    good.obstacles[1].drive = 2;
    good.obstacles[1].half_q = (dr_half){UM(3000), {0, 0, 1}};
}

void tearDown(void) {}

static void the_crc_is_castagnolis(void)
{
    TEST_ASSERT_EQUAL_HEX32(0xE3069283u,
                            dr_crc32c(0, (const uint8_t *)"123456789", 9)); /* the check value of RFC 3720 */
    TEST_ASSERT_EQUAL_HEX32(0xE3069283u,
                            dr_crc32c(dr_crc32c(0, (const uint8_t *)"1234", 4), (const uint8_t *)"56789", 5));
}

static void what_is_put_is_read(void)
{
    dr_limits_put(&good, image);
    TEST_ASSERT_EQUAL_STRING_LEN("DRLM\1", image, 5);
    TEST_ASSERT_TRUE(dr_limits_get(image, DR_LIMITS_IMAGE_BYTES, &read, &problem));
    TEST_ASSERT_EQUAL_HEX32(dr_limits_crc(&good), dr_limits_crc(&read));
    TEST_ASSERT_EQUAL(7, read.revision);
    TEST_ASSERT_EQUAL(-707, read.drives[2].approach[DR_Z]);
    TEST_ASSERT_EQUAL(UM(25000), read.obstacles[0].box_q.max_q[DR_Z]);
    TEST_ASSERT_EQUAL_INT64(UM(3000), read.obstacles[1].half_q.offset_q);
    TEST_ASSERT_EQUAL_HEX8(image[DR_LIMITS_IMAGE_BYTES - 1], dr_limits_crc(&read) >> 24);
}

static void what_is_beyond_the_count_does_not_count(void)
{
    const uint32_t crc = dr_limits_crc(&good);
    good.obstacles[5].drive = 3;
    TEST_ASSERT_EQUAL_HEX32(crc, dr_limits_crc(&good));
}

static void row_70_every_flipped_bit_and_every_truncation_is_rejected(void)
{
    dr_limits_put(&good, image);
    for (uint32_t bit = 0; bit < DR_LIMITS_IMAGE_BYTES * 8u; bit++) {
        image[bit / 8] ^= (uint8_t)(1u << bit % 8);
        TEST_ASSERT_FALSE(dr_limits_get(image, DR_LIMITS_IMAGE_BYTES, &read, &problem));
        TEST_ASSERT_TRUE(problem.error == DR_LIMITS_CRC || problem.error == DR_LIMITS_MAGIC ||
                         problem.error == DR_LIMITS_VERSION);
        image[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    for (size_t size = 0; size <= DR_LIMITS_IMAGE_BYTES + 1u; size++)
        TEST_ASSERT_EQUAL(size == DR_LIMITS_IMAGE_BYTES, dr_limits_get(image, size, &read, &problem));
    TEST_ASSERT_EQUAL(DR_LIMITS_SIZE, problem.error);
    memset(image, 0xFF, sizeof image); /* an empty EEPROM */
    TEST_ASSERT_FALSE(dr_limits_get(image, DR_LIMITS_IMAGE_BYTES, &read, &problem));
    TEST_ASSERT_EQUAL(DR_LIMITS_MAGIC, problem.error);
}

static void another_version_is_told_from_damage(void)
{
    dr_limits_put(&good, image);
    image[4] = DR_LIMITS_VERSION_NOW + 1;
    TEST_ASSERT_FALSE(dr_limits_get(image, DR_LIMITS_IMAGE_BYTES, &read, &problem));
    TEST_ASSERT_EQUAL(DR_LIMITS_VERSION, problem.error);
    image[4] = DR_LIMITS_VERSION_NOW;
    image[0] = 'd';
    TEST_ASSERT_FALSE(dr_limits_get(image, DR_LIMITS_IMAGE_BYTES, &read, &problem));
    TEST_ASSERT_EQUAL(DR_LIMITS_MAGIC, problem.error);
}

static void a_good_crc_does_not_make_nonsense_good(void)
{
    good.drives[0].box_q.min_q[DR_Y] = good.drives[0].box_q.max_q[DR_Y];
    dr_limits_put(&good, image);
    TEST_ASSERT_FALSE(dr_limits_get(image, DR_LIMITS_IMAGE_BYTES, &read, &problem));
    TEST_ASSERT_EQUAL(DR_LIMITS_BOX, problem.error);
}

static void expect(dr_limits_error error, uint8_t item, uint8_t axis)
{
    const bool is_good = dr_limits_check(&good, &problem);
    TEST_ASSERT_EQUAL(error == DR_LIMITS_GOOD, is_good);
    TEST_ASSERT_EQUAL(error, problem.error);
    TEST_ASSERT_EQUAL(item, problem.item);
    TEST_ASSERT_EQUAL(axis, problem.axis);
    setUp();
}

static void row_71_nonsense_in_the_head(void)
{
    expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.kind = 2, expect(DR_LIMITS_KIND, 0, DR_AXES);
    good.firmware = 0x032A, expect(DR_LIMITS_FIRMWARE, 0, DR_AXES);
    good.firmware = 0x03A1, expect(DR_LIMITS_FIRMWARE, 0, DR_AXES);
    good.firmware = 0x0A21, expect(DR_LIMITS_FIRMWARE, 0, DR_AXES);
    good.firmware = 0xA321, expect(DR_LIMITS_FIRMWARE, 0, DR_AXES);
    good.firmware = 0x0099, expect(DR_LIMITS_FIRMWARE, 0, DR_AXES);
    good.rig = DR_RIG_CALIBRATES_AT_POWER_ON, expect(DR_LIMITS_RIG, 0, DR_AXES);
    good.rig = 0x0001, expect(DR_LIMITS_RIG, 0, DR_AXES);
    good.rig = 0x2000, expect(DR_LIMITS_RIG, 0, DR_AXES);
    for (unsigned drive = 0; drive < DR_PORTS; drive++) /* switch 8 of each drive */
        good.rig = (uint16_t)(DR_RIG_Y_LOCKED_OUT << drive), expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.rig = DR_RIG_MAY_STREAM | DR_RIG_HOME_IS_ZERO | DR_RIG_HAS_CUT, expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.serial[3] = 'x', expect(DR_LIMITS_SERIAL, 0, DR_AXES);
    good.serial[2] = 0x07, expect(DR_LIMITS_SERIAL, 0, DR_AXES);
    good.serial[2] = 0x7F, expect(DR_LIMITS_SERIAL, 0, DR_AXES);
    memset(good.serial, 'S', DR_SERIAL_MAX), expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.refusal = 2, expect(DR_LIMITS_CHOICE, 0, DR_AXES);
    good.host_loss = 2, expect(DR_LIMITS_CHOICE, 0, DR_AXES);
    good.angle_min_deg = 0, expect(DR_LIMITS_ANGLES, 0, DR_AXES);
    good.angle_min_deg = 81, expect(DR_LIMITS_ANGLES, 0, DR_AXES);
    good.angle_max_deg = 90, expect(DR_LIMITS_ANGLES, 0, DR_AXES);
    good.angle_max_deg = 89, expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.mode_min = 10, expect(DR_LIMITS_MODE, 0, DR_AXES);
    good.unstoppable_ms = 60001, expect(DR_LIMITS_UNSTOPPABLE, 0, DR_AXES);
    good.arm_idle_s = 0, expect(DR_LIMITS_ARM_IDLE, 0, DR_AXES);
    good.arm_idle_s = 2001, expect(DR_LIMITS_ARM_IDLE, 0, DR_AXES);
    good.margin_q = -1, expect(DR_LIMITS_MARGIN, 0, DR_AXES);
    good.margin_q = UM(10000) + 1, expect(DR_LIMITS_MARGIN, 0, DR_AXES);
    good.knob_q_per_s = 0, expect(DR_LIMITS_KNOB, 0, DR_AXES);
    good.knob_q_per_s = 0, good.rig = DR_RIG_KNOBS_LOCKED, expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.knob_q_per_s = UM(20000) + 1, expect(DR_LIMITS_KNOB, 0, DR_AXES);
    good.beyond_zero_q = -1, expect(DR_LIMITS_BEYOND_ZERO, 0, DR_AXES);
}

static void the_last_good_values(void)
{
#define GOOD(change) (change, expect(DR_LIMITS_GOOD, 0, DR_AXES))
    GOOD(good.firmware = 0x0321);
    GOOD(good.firmware = 0x9999);
    GOOD(good.refusal = DR_REFUSE_E);
    GOOD(good.host_loss = DR_HOST_LOSS_FINISH);
    GOOD(good.angle_min_deg = 1);
    GOOD(good.angle_min_deg = 80);
    GOOD(good.mode_min = 9);
    GOOD(good.unstoppable_ms = 60000);
    GOOD(good.unstoppable_ms = 0);
    GOOD(good.arm_idle_s = 1);
    GOOD(good.arm_idle_s = 2000);
    GOOD(good.margin_q = 0);
    GOOD(good.knob_q_per_s = 1);
    GOOD(good.knob_q_per_s = UM(20000));
    GOOD(good.beyond_zero_q = 0);
    GOOD(good.beyond_zero_q = UM(10000));
    GOOD(good.drives[0].box_q.min_q[DR_X] = 0);
    GOOD(good.drives[0].box_q.min_q[DR_X] = good.drives[0].box_q.max_q[DR_X] - 1);
    GOOD(good.drives[0].max_move_q = 1);
    GOOD(good.drives[0].max_move_q = (uint32_t)DR_FAR_Q);
    GOOD(good.drives[0].fast_level = good.drives[0].slow_level = 0);
    GOOD(good.drives[2].approach[DR_Y] = DR_NORMAL_MAX);
    GOOD(good.drives[2].approach[DR_Y] = -DR_NORMAL_MAX);
    GOOD(good.obstacles[0].exit = DR_TO_MORE_Z);
    GOOD(good.obstacles[0].box_q.min_q[DR_X] = -DR_FAR_Q);
    GOOD(good.obstacles[0].box_q.max_q[DR_X] = DR_FAR_Q);
    GOOD(good.obstacles[0].box_q.min_q[DR_X] = good.obstacles[0].box_q.max_q[DR_X]);
    GOOD(good.obstacles[1].half_q.offset_q = -UM(500) - UM(300) - UM(50)); /* where a reading may still be */
    GOOD((good.drives[2].surface_q = 0, good.drives[2].clearance_q = 0));
    GOOD((good.margin_q = UM(10000), good.obstacle_count = 0));
    memset(&good.obstacles[2], 0, sizeof good.obstacles[2]);
    for (good.obstacle_count = 2; good.obstacle_count < DR_OBSTACLES_MAX; good.obstacle_count++)
        good.obstacles[good.obstacle_count] = good.obstacles[0];
    expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.beyond_zero_q = UM(10000) + 1, expect(DR_LIMITS_BEYOND_ZERO, 0, DR_AXES);
    good.obstacles[1].half_q.offset_q = -UM(850) - 1, expect(DR_LIMITS_OBSTACLE_OUTSIDE, 1, DR_AXES);
    good.drives[2].retract = DR_TO_LESS_Z, good.drives[2].clearance_q = (uint32_t)UM(7900) - 1;
    expect(DR_LIMITS_GOOD, 0, DR_AXES);
}

static void defaults_are_careful(void)
{
    dr_limits trio;
    dr_limits_init(&trio, DR_TRIO);
    TEST_ASSERT_EQUAL(DR_FIRMWARE_TRIO, trio.firmware);
    TEST_ASSERT_EQUAL(10, trio.angle_min_deg);
    TEST_ASSERT_EQUAL(80, trio.angle_max_deg);
    TEST_ASSERT_EQUAL(200, trio.unstoppable_ms);
    TEST_ASSERT_EQUAL(900, trio.arm_idle_s);
    TEST_ASSERT_EQUAL(UM(50), trio.margin_q);
    TEST_ASSERT_EQUAL(UM(5000), trio.knob_q_per_s);
    TEST_ASSERT_EQUAL(UM(300), trio.beyond_zero_q);
    TEST_ASSERT_EQUAL(0, trio.rig);
    TEST_ASSERT_TRUE(dr_limits_init_drive(&trio, 0, DR_STAGE_TRIO_MP865));
    TEST_ASSERT_EQUAL(UM(100), trio.drives[0].box_q.min_q[DR_Y]);
    TEST_ASSERT_EQUAL(533333 * 6 - UM(100), trio.drives[0].box_q.max_q[DR_X]);
    TEST_ASSERT_EQUAL(133333 * 6 - UM(100), trio.drives[0].box_q.max_q[DR_Y]);
    TEST_ASSERT_EQUAL(UM(5000), trio.drives[0].max_move_q);
    TEST_ASSERT_EQUAL(DR_SPEED_FULL, trio.drives[0].fast_level);
    TEST_ASSERT_EQUAL(DR_SPEED_FULL, trio.drives[0].slow_level);
    TEST_ASSERT_EQUAL(DR_FIRMWARE_MPC, good.firmware);
}

static void row_71_nonsense_in_a_drive(void)
{
    good.drives[0].stage = good.drives[2].stage = DR_STAGE_NONE, good.obstacle_count = 0;
    expect(DR_LIMITS_NO_DRIVE, 0, DR_AXES);
    good.drives[0].stage = DR_STAGE_TRIO_MP285, expect(DR_LIMITS_STAGE, 0, DR_AXES);
    good.drives[0].stage = DR_STAGES, expect(DR_LIMITS_STAGE, 0, DR_AXES);
    good.drives[2].stage = DR_STAGE_MPC_MOM, expect(DR_LIMITS_STAGE, 2, DR_AXES); /* firmware 3.13 or 3.16 only */
    good.firmware = 0x0318, good.drives[0].stage = DR_STAGE_MPC_MP845, expect(DR_LIMITS_STAGE, 0, DR_AXES);
    good.drives[2].box_q.min_q[DR_Z] = good.drives[2].box_q.max_q[DR_Z], expect(DR_LIMITS_BOX, 2, DR_Z);
    good.drives[2].box_q.min_q[DR_X] = -1, expect(DR_LIMITS_BOX_OUTSIDE, 2, DR_X);
    good.drives[2].box_q.max_q[DR_Y] = 400000 * 4 + 1, expect(DR_LIMITS_BOX_OUTSIDE, 2, DR_Y);
    good.drives[2].box_q.max_q[DR_Y] = 400000 * 4, expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.drives[0].max_move_q = 0, expect(DR_LIMITS_MAX_MOVE, 0, DR_AXES);
    good.drives[0].max_move_q = (uint32_t)DR_FAR_Q + 1, expect(DR_LIMITS_MAX_MOVE, 0, DR_AXES);
    good.drives[0].fast_level = 17, expect(DR_LIMITS_SPEED, 0, DR_AXES);
    good.drives[0].fast_level = 3, expect(DR_LIMITS_SPEED, 0, DR_AXES); /* slower than slow_level */
    good.drives[2].retract = 7, expect(DR_LIMITS_SURFACE, 2, DR_AXES);
    good.drives[2].surface_q = -1, expect(DR_LIMITS_SURFACE, 2, DR_Z);
    good.drives[2].surface_q = 400000 * 4 + 1, expect(DR_LIMITS_SURFACE, 2, DR_Z);
    good.drives[2].clearance_q = (uint32_t)UM(16900), expect(DR_LIMITS_CLEARANCE, 2, DR_Z);
    good.drives[2].clearance_q = (uint32_t)UM(16900) - 1, expect(DR_LIMITS_GOOD, 0, DR_AXES);
    good.drives[2].retract = DR_TO_LESS_Z, good.drives[2].clearance_q = (uint32_t)UM(7900),
    expect(DR_LIMITS_CLEARANCE, 2, DR_Z);
    good.drives[2].approach[DR_Z] = 0, expect(DR_LIMITS_APPROACH, 2, DR_Z);
    good.drives[2].approach[DR_Y] = 1025, expect(DR_LIMITS_APPROACH, 2, DR_Z);
    good.drives[0].approach[DR_Y] = 1, expect(DR_LIMITS_APPROACH, 0, DR_AXES); /* of nothing: no surface */
    good.drives[0].approach[DR_X] = 1, expect(DR_LIMITS_APPROACH, 0, DR_AXES);
    good.drives[0].approach[DR_Z] = 1, expect(DR_LIMITS_APPROACH, 0, DR_AXES);
    TEST_ASSERT_FALSE(dr_limits_init_drive(&good, 0, DR_STAGE_NONE));
}

static void a_trio_has_one_drive_and_switches(void)
{
    dr_limits_init(&good, DR_TRIO);
    TEST_ASSERT_TRUE(dr_limits_init_drive(&good, 0, DR_STAGE_TRIO_MP845));
    good.rig = DR_RIG_Y_LOCKED_OUT | DR_RIG_CALIBRATES_AT_POWER_ON;
    TEST_ASSERT_TRUE(dr_limits_check(&good, &problem));
    good.rig = DR_RIG_MAY_STREAM;
    TEST_ASSERT_FALSE(dr_limits_check(&good, &problem));
    good.rig = DR_RIG_Y_LOCKED_OUT << 1;
    TEST_ASSERT_FALSE(dr_limits_check(&good, &problem));
    good.rig = 0;
    TEST_ASSERT_TRUE(dr_limits_init_drive(&good, 1, DR_STAGE_TRIO_MP845));
    expect(DR_LIMITS_STAGE, 1, DR_AXES);
}

static void row_71_nonsense_in_an_obstacle(void)
{
    dr_obstacle *box = &good.obstacles[0], *half = &good.obstacles[1];
    good.obstacle_count = 33, expect(DR_LIMITS_OBSTACLES, 0, DR_AXES);
    box->shape = 0, expect(DR_LIMITS_SHAPE, 0, DR_AXES);
    box->drive = 1, expect(DR_LIMITS_OBSTACLE_DRIVE, 0, DR_AXES);
    half->drive = 4, expect(DR_LIMITS_OBSTACLE_DRIVE, 1, DR_AXES);
    box->box_q.min_q[DR_Y] = box->box_q.max_q[DR_Y] + 1, expect(DR_LIMITS_OBSTACLE_BOX, 0, DR_Y);
    box->box_q.min_q[DR_Y] = -DR_FAR_Q - 1, expect(DR_LIMITS_OBSTACLE_BOX, 0, DR_Y);
    box->box_q.max_q[DR_Z] = DR_FAR_Q + 1, expect(DR_LIMITS_OBSTACLE_BOX, 0, DR_Z);
    box->exit = 7, expect(DR_LIMITS_OBSTACLE_EXIT, 0, DR_AXES);
    half->exit = DR_TO_MORE_Z, expect(DR_LIMITS_OBSTACLE_EXIT, 1, DR_AXES);
    half->half_q.normal[DR_Z] = 0, expect(DR_LIMITS_OBSTACLE_NORMAL, 1, DR_AXES);
    half->half_q.normal[DR_X] = -1025, expect(DR_LIMITS_OBSTACLE_NORMAL, 1, DR_AXES);
    half->half_q.offset_q = INT64_MAX, expect(DR_LIMITS_OBSTACLE_NORMAL, 1, DR_AXES);
    half->half_q.offset_q = UM(-5000), expect(DR_LIMITS_OBSTACLE_OUTSIDE, 1, DR_AXES);
    box->box_q = (dr_box){{UM(26000), 0, 0}, {UM(27000), 100, 100}}, expect(DR_LIMITS_OBSTACLE_OUTSIDE, 0, DR_AXES);
    half->half_q.offset_q = UM(24900), expect(DR_LIMITS_NO_ROOM, 2, DR_AXES);
    half->half_q.normal[DR_Z] = -1, half->half_q.offset_q = UM(-100), expect(DR_LIMITS_NO_ROOM, 2, DR_AXES);
    box->box_q = (dr_box){{0, 0, 0}, {UM(25000), UM(25000), UM(25000)}}, expect(DR_LIMITS_NO_ROOM, 0, DR_AXES);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_crc_is_castagnolis);
    RUN_TEST(what_is_put_is_read);
    RUN_TEST(what_is_beyond_the_count_does_not_count);
    RUN_TEST(row_70_every_flipped_bit_and_every_truncation_is_rejected);
    RUN_TEST(a_good_crc_does_not_make_nonsense_good);
    RUN_TEST(row_71_nonsense_in_the_head);
    RUN_TEST(another_version_is_told_from_damage);
    RUN_TEST(the_last_good_values);
    RUN_TEST(defaults_are_careful);
    RUN_TEST(row_71_nonsense_in_a_drive);
    RUN_TEST(a_trio_has_one_drive_and_switches);
    RUN_TEST(row_71_nonsense_in_an_obstacle);
    return UNITY_END();
}
