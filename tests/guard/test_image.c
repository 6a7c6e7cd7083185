/* The image of the limits byte by byte, and the last quantum of what is right in them. */
#include "dr_limits.h"
#include "unity.h"

#include <string.h>

#define UM(um) ((int32_t)((um)*64))
#define OBSTACLE_BYTES 41u /* shape, drive, exit, two corners of 12 bytes, offset of 8, normal of 6 */
#define OBSTACLES_AT (DR_LIMITS_IMAGE_BYTES - 4u - DR_OBSTACLES_MAX * OBSTACLE_BYTES)

static dr_limits limits, read;
static uint8_t image[DR_LIMITS_IMAGE_BYTES];
static dr_limits_problem problem;

void setUp(void)
{
    dr_limits_init(&limits, DR_MPC);
    TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, 0, DR_STAGE_MPC_MP285)); /* 25 mm on each axis */
    memset(limits.obstacles, 0x5A, sizeof limits.obstacles);                /* what is not in force may be anything */
}

void tearDown(void) {}

/* Reflected, polynomial 0x1EDC6F41, a bit at a time [RFC 3720]. */
static uint32_t crc_by_bits(uint32_t crc, const uint8_t *bytes, size_t count)
{
    crc = ~crc;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0; bit < 8; bit++)
            crc = (crc & 1u) != 0 ? crc >> 1 ^ 0x82F63B78u : crc >> 1;
    }
    return ~crc;
}

static void the_crc_of_every_byte_is_the_one_by_bits(void)
{
    for (unsigned value = 0; value < 256; value++) {
        const uint8_t bytes[] = {(uint8_t)value, 0, (uint8_t)~value};
        TEST_ASSERT_EQUAL_HEX32(crc_by_bits(0, bytes, 1), dr_crc32c(0, bytes, 1));
        TEST_ASSERT_EQUAL_HEX32(crc_by_bits(0xDEADBEEFu, bytes, 3), dr_crc32c(0xDEADBEEFu, bytes, 3));
    }
}

static dr_obstacle *obstacle(uint8_t shape)
{
    dr_obstacle *o = &limits.obstacles[limits.obstacle_count++];
    memset(o, 0, sizeof *o);
    o->shape = shape;
    o->box_q = (dr_box){{UM(1000), UM(1000), UM(1000)}, {UM(2000), UM(2000), UM(2000)}};
    o->half_q = (dr_half){shape == DR_SHAPE_HALF ? UM(1000) : 0, {0, 0, (int16_t)(shape == DR_SHAPE_HALF)}};
    return o;
}

static void the_image_is_its_head_its_fields_and_zeroes_where_nothing_is_in_force(void)
{
    static const uint8_t head[] = {'D', 'R', 'L', 'M', DR_LIMITS_VERSION_NOW, 0, 0, 0, DR_MPC, 1};
    dr_obstacle *o = obstacle(DR_SHAPE_BOX);
    o->exit = DR_TO_MORE_Y;
    o->box_q = (dr_box){{-1, UM(2), 0x00332211}, {0x00665544, UM(25), UM(26)}};
    dr_limits_put(&limits, image);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(head, image, sizeof head);
    static const uint8_t first[OBSTACLE_BYTES] = {
        DR_SHAPE_BOX, 0, DR_TO_MORE_Y, 0xFF, 0xFF, 0xFF, 0xFF, 0x80, 0, 0, 0,    0x11, 0x22,
        0x33,         0, 0x44,         0x55, 0x66, 0,    0x40, 0x06, 0, 0, 0x80, 0x06};
    TEST_ASSERT_EQUAL_HEX8_ARRAY(first, image + OBSTACLES_AT, OBSTACLE_BYTES);
    for (size_t at = OBSTACLES_AT + OBSTACLE_BYTES; at < DR_LIMITS_IMAGE_BYTES - 4u; at++)
        TEST_ASSERT_EQUAL_HEX8(0, image[at]);
    const uint32_t crc = crc_by_bits(0, image, DR_LIMITS_IMAGE_BYTES - 4u);
    TEST_ASSERT_EQUAL_HEX32(crc, dr_limits_crc(&limits));
    for (unsigned i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL_HEX8(crc >> 8 * i, image[DR_LIMITS_IMAGE_BYTES - 4u + i]);
}

static void every_field_comes_back_and_nothing_else_is_touched(void)
{
    struct {
        dr_limits limits;
        uint8_t behind[16];
    } out;
    for (uint8_t i = 0; i < DR_OBSTACLES_MAX; i++)
        *obstacle(i % 2u == 0 ? DR_SHAPE_HALF : DR_SHAPE_BOX) =
            i % 2u == 0
                ? (dr_obstacle){DR_SHAPE_HALF, 0, 0, {{i, 0, 0}, {0, 0, -i}}, {UM(1000) + i, {i, -1, 512}}}
                : (dr_obstacle){DR_SHAPE_BOX, 0, DR_TO_LESS_X, {{i, 0, 0}, {UM(1), UM(1), UM(2)}}, {0, {0, 0, 0}}};
    limits.obstacles[DR_OBSTACLES_MAX - 1u] =
        (dr_obstacle){DR_SHAPE_HALF, 0, 0, {{0, 0, 0}, {0, 0, 0}}, {UM(1000), {1, -2, 1024}}};
    dr_limits_put(&limits, image);
    memset(&out, 0xA5, sizeof out);
    TEST_ASSERT_TRUE(dr_limits_get(image, sizeof image, &out.limits, &problem));
    for (uint8_t i = 0; i < DR_OBSTACLES_MAX; i++) {
        TEST_ASSERT_EQUAL_HEX8(limits.obstacles[i].shape, out.limits.obstacles[i].shape);
        TEST_ASSERT_EQUAL_INT32_ARRAY(limits.obstacles[i].box_q.min_q, out.limits.obstacles[i].box_q.min_q, DR_AXES);
        TEST_ASSERT_EQUAL_INT32_ARRAY(limits.obstacles[i].box_q.max_q, out.limits.obstacles[i].box_q.max_q, DR_AXES);
        TEST_ASSERT_EQUAL_INT64(limits.obstacles[i].half_q.offset_q, out.limits.obstacles[i].half_q.offset_q);
        TEST_ASSERT_EQUAL_INT16_ARRAY(limits.obstacles[i].half_q.normal, out.limits.obstacles[i].half_q.normal,
                                      DR_AXES);
    }
    TEST_ASSERT_EACH_EQUAL_HEX8(0xA5, out.behind, sizeof out.behind);
}

static void a_bad_image_tells_what_is_bad_about_it(void)
{
    static const struct {
        size_t at;
        uint8_t error;
    } damages[] = {{0, DR_LIMITS_MAGIC},
                   {4, DR_LIMITS_VERSION},
                   {5, DR_LIMITS_VERSION},
                   {7, DR_LIMITS_VERSION},
                   {8, DR_LIMITS_CRC},
                   {700, DR_LIMITS_CRC},
                   {DR_LIMITS_IMAGE_BYTES - 1u, DR_LIMITS_CRC}};
    dr_limits_put(&limits, image);
    for (size_t i = 0; i < sizeof damages / sizeof damages[0]; i++) {
        memset(&problem, 0xEE, sizeof problem);
        image[damages[i].at] ^= 0x40;
        TEST_ASSERT_FALSE(dr_limits_get(image, sizeof image, &read, &problem));
        TEST_ASSERT_EQUAL(damages[i].error, problem.error);
        TEST_ASSERT_EQUAL(0, problem.item);
        TEST_ASSERT_EQUAL(DR_AXES, problem.axis);
        image[damages[i].at] ^= 0x40;
    }
    TEST_ASSERT_FALSE(dr_limits_get(image, sizeof image - 1u, &read, &problem));
    TEST_ASSERT_EQUAL(DR_LIMITS_SIZE, problem.error);
    TEST_ASSERT_EQUAL(0, problem.item);
    TEST_ASSERT_TRUE(dr_limits_get(image, sizeof image, &read, &problem));
}

static void a_drive_that_is_set_up_anew_keeps_nothing(void)
{
    limits.drives[0].retract = DR_TO_MORE_Z;
    limits.drives[0].surface_q = UM(1000);
    limits.drives[0].clearance_q = 1;
    limits.drives[0].approach[DR_Z] = 1;
    TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, 0, DR_STAGE_MPC_MP285));
    TEST_ASSERT_EQUAL(DR_TO_NONE, limits.drives[0].retract);
    TEST_ASSERT_EQUAL(0, limits.drives[0].surface_q);
    TEST_ASSERT_EQUAL(0, limits.drives[0].clearance_q);
    TEST_ASSERT_EQUAL(0, limits.drives[0].approach[DR_Z]);
}

static void expect(dr_limits_error error, uint8_t item, uint8_t axis)
{
    TEST_ASSERT_EQUAL(error == DR_LIMITS_GOOD, dr_limits_check(&limits, &problem));
    TEST_ASSERT_EQUAL(error, problem.error);
    TEST_ASSERT_EQUAL(item, problem.item);
    TEST_ASSERT_EQUAL(axis, problem.axis);
    setUp();
}

static void the_first_version_and_the_first_and_last_printable_character(void)
{
    limits.firmware = DR_FIRMWARE_FIRST, expect(DR_LIMITS_GOOD, 0, DR_AXES);
    limits.firmware = DR_FIRMWARE_FIRST - 1, expect(DR_LIMITS_FIRMWARE, 0, DR_AXES);
    for (unsigned character = 1; character < 256; character++) {
        limits.serial[0] = (uint8_t)character;
        expect(character > ' ' && character <= '~' ? DR_LIMITS_GOOD : DR_LIMITS_SERIAL, 0, DR_AXES);
    }
    limits.serial[1] = 'x', expect(DR_LIMITS_SERIAL, 0, DR_AXES); /* padding comes last */
}

static void a_mom_is_on_port_1_or_3(void)
{
    for (uint8_t drive = 0; drive < DR_PORTS; drive++) {
        limits.firmware = 0x0313;
        memset(&limits.drives[0], 0, sizeof limits.drives[0]);
        TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, drive, DR_STAGE_MPC_MOM));
        expect(drive % 2 == 0 ? DR_LIMITS_GOOD : DR_LIMITS_STAGE, drive % 2 == 0 ? 0 : drive, DR_AXES);
    }
}

static void a_direction_beyond_the_last_is_none(void)
{
    for (unsigned retract = DR_TO_MORE_Z + 1u; retract < 256; retract++) {
        limits.drives[0].retract = (uint8_t)retract;
        expect(DR_LIMITS_SURFACE, 0, DR_AXES);
    }
}

static void an_obstacles_corners_are_in_order_on_every_axis(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        dr_obstacle *o = obstacle(DR_SHAPE_BOX);
        o->box_q.min_q[axis] = o->box_q.max_q[axis] + 1;
        expect(DR_LIMITS_OBSTACLE_BOX, 0, axis);
        o = obstacle(DR_SHAPE_BOX);
        o->box_q.min_q[axis] = o->box_q.max_q[axis];
        expect(DR_LIMITS_GOOD, 0, DR_AXES);
    }
}

/* 500 um beyond the travel, what a calibration goes below 0 (300 um) and the margin (50 um): there a tip may yet be. */
static void an_obstacle_may_be_as_far_out_as_a_tip(void)
{
    const int32_t below = -UM(850), above = UM(25000) + UM(850);
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        dr_obstacle *o = obstacle(DR_SHAPE_BOX);
        o->box_q.min_q[axis] = o->box_q.max_q[axis] = below;
        expect(DR_LIMITS_GOOD, 0, DR_AXES);
        o = obstacle(DR_SHAPE_BOX);
        o->box_q.min_q[axis] = o->box_q.max_q[axis] = below - 1;
        expect(DR_LIMITS_OBSTACLE_OUTSIDE, 0, DR_AXES);
        o = obstacle(DR_SHAPE_BOX);
        o->box_q.min_q[axis] = o->box_q.max_q[axis] = above;
        expect(DR_LIMITS_GOOD, 0, DR_AXES);
        o = obstacle(DR_SHAPE_BOX);
        o->box_q.min_q[axis] = o->box_q.max_q[axis] = above + 1;
        expect(DR_LIMITS_OBSTACLE_OUTSIDE, 0, DR_AXES);
    }
}

/* The box is 100 um to 24,900 um on each axis, the margin 50 um. */
static void an_obstacle_that_leaves_nothing_of_the_box_with_its_margin(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        dr_obstacle *o = obstacle(DR_SHAPE_BOX);
        o->box_q = (dr_box){{UM(150), UM(150), UM(150)}, {UM(24850), UM(24850), UM(24850)}};
        expect(DR_LIMITS_NO_ROOM, 0, DR_AXES);
        o = obstacle(DR_SHAPE_BOX);
        o->box_q = (dr_box){{UM(150), UM(150), UM(150)}, {UM(24850), UM(24850), UM(24850)}};
        o->box_q.max_q[axis]--;
        expect(DR_LIMITS_GOOD, 0, DR_AXES);
        for (int16_t sign = -1; sign <= 1; sign = (int16_t)(sign + 2)) {
            o = obstacle(DR_SHAPE_HALF);
            o->half_q = (dr_half){sign > 0 ? UM(24850) : -UM(150), {0, 0, 0}}; /* grown by 50 um: all of the box */
            o->half_q.normal[axis] = sign;
            expect(DR_LIMITS_NO_ROOM, 0, DR_AXES);
            o = obstacle(DR_SHAPE_HALF);
            o->half_q = (dr_half){(sign > 0 ? UM(24850) : -UM(150)) - 1, {0, 0, 0}};
            o->half_q.normal[axis] = sign;
            expect(DR_LIMITS_GOOD, 0, DR_AXES);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_crc_of_every_byte_is_the_one_by_bits);
    RUN_TEST(the_image_is_its_head_its_fields_and_zeroes_where_nothing_is_in_force);
    RUN_TEST(every_field_comes_back_and_nothing_else_is_touched);
    RUN_TEST(a_bad_image_tells_what_is_bad_about_it);
    RUN_TEST(a_drive_that_is_set_up_anew_keeps_nothing);
    RUN_TEST(the_first_version_and_the_first_and_last_printable_character);
    RUN_TEST(a_mom_is_on_port_1_or_3);
    RUN_TEST(a_direction_beyond_the_last_is_none);
    RUN_TEST(an_obstacles_corners_are_in_order_on_every_axis);
    RUN_TEST(an_obstacle_may_be_as_far_out_as_a_tip);
    RUN_TEST(an_obstacle_that_leaves_nothing_of_the_box_with_its_margin);
    return UNITY_END();
}
