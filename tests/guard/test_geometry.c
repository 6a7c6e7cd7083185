/* Exactness: a touch counts, one quantum beside it does not. */
#include "dr_geometry.h"
#include "unity.h"

#include <stdlib.h>

void setUp(void) {}
void tearDown(void) {}

static const dr_box cube = {{100, 100, 100}, {200, 200, 200}};

static bool line_hits(int32_t x0, int32_t y0, int32_t z0, int32_t x1, int32_t y1, int32_t z1)
{
    const dr_segment line = {{x0, y0, z0}, {x1, y1, z1}};
    const dr_segment back = {{x1, y1, z1}, {x0, y0, z0}};
    const bool hits = dr_segment_touches_box(&line, &cube);
    TEST_ASSERT_EQUAL(hits, dr_segment_touches_box(&back, &cube));
    return hits;
}

static void a_line_along_a_face_touches_at_0_and_not_at_1_quantum(void)
{
    TEST_ASSERT_TRUE(line_hits(0, 100, 150, 300, 100, 150));
    TEST_ASSERT_FALSE(line_hits(0, 99, 150, 300, 99, 150));
    TEST_ASSERT_TRUE(line_hits(150, 200, 0, 150, 200, 300));
    TEST_ASSERT_FALSE(line_hits(150, 201, 0, 150, 201, 300));
    TEST_ASSERT_TRUE(line_hits(150, 0, 100, 150, 300, 100));
    TEST_ASSERT_FALSE(line_hits(150, 0, 99, 150, 300, 99));
}

static void a_line_that_ends_on_a_face_touches(void)
{
    TEST_ASSERT_TRUE(line_hits(0, 150, 150, 100, 150, 150));
    TEST_ASSERT_FALSE(line_hits(0, 150, 150, 99, 150, 150));
    TEST_ASSERT_TRUE(line_hits(300, 150, 150, 200, 150, 150));
    TEST_ASSERT_FALSE(line_hits(300, 150, 150, 201, 150, 150));
}

static void a_slanting_line_grazes_an_edge_or_a_corner(void)
{
    TEST_ASSERT_TRUE(line_hits(0, 200, 150, 200, 0, 150)); /* through the edge x = y = 100 */
    TEST_ASSERT_FALSE(line_hits(0, 199, 150, 199, 0, 150));
    TEST_ASSERT_TRUE(line_hits(50, 150, 100, 150, 50, 100)); /* through the corner 100,100,100 */
    TEST_ASSERT_FALSE(line_hits(49, 150, 100, 150, 49, 100));
    TEST_ASSERT_TRUE(line_hits(0, 0, 0, 300, 300, 300));
    TEST_ASSERT_FALSE(line_hits(0, 0, 0, 300, 300, 100 - 1));
    /* One part in six million beside the corner, where floating point would round: 3 * 10^6 * 99 < 100 * (3 * 10^6 - 1). */
    TEST_ASSERT_TRUE(line_hits(-3000000, 3000200, 150, 3000200, -3000000, 150));
    TEST_ASSERT_FALSE(line_hits(-3000000, 3000199, 150, 3000200, -3000001, 150));
}

static void a_point_is_a_line_too(void)
{
    TEST_ASSERT_TRUE(line_hits(100, 200, 150, 100, 200, 150));
    TEST_ASSERT_FALSE(line_hits(99, 200, 150, 99, 200, 150));
}

static void boxes_touch_at_their_faces(void)
{
    const dr_box beside = {{200, 150, 150}, {300, 160, 160}}, apart = {{201, 150, 150}, {300, 160, 160}};
    const dr_box below = {{0, 150, 150}, {99, 160, 160}};
    TEST_ASSERT_TRUE(dr_box_touches_box(&cube, &beside));
    TEST_ASSERT_FALSE(dr_box_touches_box(&cube, &apart));
    TEST_ASSERT_FALSE(dr_box_touches_box(&cube, &below));
    const dr_box grown = dr_box_grown(&cube, 1);
    TEST_ASSERT_TRUE(dr_box_touches_box(&grown, &apart));
    TEST_ASSERT_TRUE(dr_box_is_in(&cube, &grown));
    TEST_ASSERT_FALSE(dr_box_is_in(&grown, &cube));
    TEST_ASSERT_TRUE(dr_box_is_in(&cube, &cube));
    const dr_box shifted = {{101, 100, 100}, {201, 200, 200}};
    TEST_ASSERT_FALSE(dr_box_is_in(&shifted, &cube));
}

static void a_half_space_holds_its_plane(void)
{
    const dr_half floor = {100, {0, 0, 1}}, slope = {-200, {-1, -1, 0}}; /* z <= 100; x + y >= 200 */
    const dr_segment on = {{0, 0, 100}, {50, 0, 300}}, above = {{0, 0, 101}, {50, 0, 300}};
    const dr_segment dips = {{0, 0, 300}, {0, 0, 99}}, up_to = {{0, 0, 300}, {100, 100, 300}};
    const dr_segment short_of = {{0, 0, 300}, {100, 99, 300}};
    TEST_ASSERT_TRUE(dr_segment_touches_half(&on, &floor));
    TEST_ASSERT_FALSE(dr_segment_touches_half(&above, &floor));
    TEST_ASSERT_TRUE(dr_segment_touches_half(&dips, &floor));
    TEST_ASSERT_TRUE(dr_segment_touches_half(&up_to, &slope));
    TEST_ASSERT_FALSE(dr_segment_touches_half(&short_of, &slope));
    const dr_box box = dr_box_around(&short_of);
    TEST_ASSERT_FALSE(dr_box_touches_half(&box, &slope));
    TEST_ASSERT_FALSE(dr_box_touches_half(&box, &floor));
    const dr_half grown = dr_half_grown(&slope, 1); /* a cube's corner reaches 1 + 1 along the normal */
    TEST_ASSERT_EQUAL_INT64(-198, grown.offset_q);
    TEST_ASSERT_TRUE(dr_box_touches_half(&box, &grown));
}

static void along_a_line_is_judged_by_the_distance_from_it(void)
{
    const int16_t down[DR_AXES] = {0, 0, -1}, slant[DR_AXES] = {707, 0, -707}, skew[DR_AXES] = {1, 2, 2};
    const int32_t straight[DR_AXES] = {0, 0, -64000}, off_by_2_um[DR_AXES] = {128, 0, 5000},
                  off_more[DR_AXES] = {129, 0, 5000};
    const int32_t on_slant[DR_AXES] = {10000, 0, -10000}, off_slant[DR_AXES] = {10000, 0, 10000};
    const int32_t far_off[DR_AXES] = {DR_FAR_Q, -DR_FAR_Q, DR_FAR_Q};
    TEST_ASSERT_TRUE(dr_is_along(straight, down, 0));
    TEST_ASSERT_TRUE(dr_is_along(off_by_2_um, down, 128));
    TEST_ASSERT_FALSE(dr_is_along(off_more, down, 128));
    TEST_ASSERT_TRUE(dr_is_along(on_slant, slant, 0));
    TEST_ASSERT_FALSE(dr_is_along(off_slant, slant, 128));
    TEST_ASSERT_FALSE(dr_is_along(far_off, slant, 65535));
    /* 3,0,0 from the line along 1,2,2: its distance is 3 * sqrt(8) / 3 = 2.83 */
    const int32_t three[DR_AXES] = {3, 0, 0};
    TEST_ASSERT_FALSE(dr_is_along(three, skew, 2));
    TEST_ASSERT_TRUE(dr_is_along(three, skew, 3));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_line_along_a_face_touches_at_0_and_not_at_1_quantum);
    RUN_TEST(a_line_that_ends_on_a_face_touches);
    RUN_TEST(a_slanting_line_grazes_an_edge_or_a_corner);
    RUN_TEST(a_point_is_a_line_too);
    RUN_TEST(boxes_touch_at_their_faces);
    RUN_TEST(a_half_space_holds_its_plane);
    RUN_TEST(along_a_line_is_judged_by_the_distance_from_it);
    return UNITY_END();
}
