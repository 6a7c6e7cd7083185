/* Exactness: a touch counts, one quantum beside it does not. */
#include "dr_geometry.h"
#include "unity.h"

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

static void a_step_of_one_quantum_is_a_line_too(void)
{
    static const int32_t inside = 150;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        for (int32_t face = 100; face <= 200; face += 100) {
            const int32_t out = face == 100 ? -1 : 1;
            int32_t from[DR_AXES] = {inside, inside, inside}, to[DR_AXES] = {inside, inside, inside};
            from[axis] = face + out;
            to[axis] = face;
            TEST_ASSERT_TRUE(line_hits(from[0], from[1], from[2], to[0], to[1], to[2]));
            from[axis] = face + 2 * out;
            to[axis] = face + out;
            TEST_ASSERT_FALSE(line_hits(from[0], from[1], from[2], to[0], to[1], to[2]));
        }
}

static void what_misses_on_any_axis_misses_wherever_it_is_on_the_others(void)
{
    static const int32_t where[] = {99, 100, 150, 200, 201};
    for (unsigned x = 0; x < 5; x++)
        for (unsigned y = 0; y < 5; y++)
            for (unsigned z = 0; z < 5; z++) {
                const bool in = x % 4 != 0 && y % 4 != 0 && z % 4 != 0;
                TEST_ASSERT_EQUAL(in, line_hits(where[x], where[y], where[z], where[x], where[y], where[z]));
                /* and as a line along one axis, past the whole cube, what counts is the other two */
                TEST_ASSERT_EQUAL(y % 4 != 0 && z % 4 != 0, line_hits(0, where[y], where[z], 300, where[y], where[z]));
                TEST_ASSERT_EQUAL(x % 4 != 0 && z % 4 != 0, line_hits(where[x], 0, where[z], where[x], 300, where[z]));
                TEST_ASSERT_EQUAL(x % 4 != 0 && y % 4 != 0, line_hits(where[x], where[y], 0, where[x], where[y], 300));
            }
}

/* On one axis: a way, an interval, and a bit for each sixth of the way that is in it. */
typedef struct {
    int32_t from, to, min, max;
    unsigned in;
} lane;

#define LAST 3 /* coordinates are 0 to 3 */
#define LANES (16u * 10u)

static void all_lanes(lane lanes[LANES])
{
    unsigned count = 0;
    for (int32_t from = 0; from <= LAST; from++)
        for (int32_t to = 0; to <= LAST; to++)
            for (int32_t min = 0; min <= LAST; min++)
                for (int32_t max = min; max <= LAST; max++) {
                    lane l = {from, to, min, max, 0};
                    for (int32_t sixth = 0; sixth <= 6; sixth++) {
                        const int32_t at = 6 * from + (to - from) * sixth;
                        l.in |= (unsigned)(6 * min <= at && at <= 6 * max) << sixth;
                    }
                    lanes[count++] = l;
                }
    TEST_ASSERT_EQUAL(LANES, count);
}

/* A line enters and leaves a box where it crosses a whole coordinate, which is at a sixth of such short ways: it touches the box
 * exactly if one of the sixths is in it. All lines and boxes of these coordinates, 4,096,000. */
static void every_small_line_touches_exactly_the_boxes_that_it_meets(void)
{
    static lane lanes[LANES];
    all_lanes(lanes);
    for (const lane *x = lanes; x < lanes + LANES; x++)
        for (const lane *y = lanes; y < lanes + LANES; y++)
            for (const lane *z = lanes; z < lanes + LANES; z++) {
                const dr_segment way = {{x->from, y->from, z->from}, {x->to, y->to, z->to}};
                const dr_box box = {{x->min, y->min, z->min}, {x->max, y->max, z->max}};
                if (dr_segment_touches_box(&way, &box) != ((x->in & y->in & z->in) != 0))
                    TEST_FAIL_MESSAGE("a line and a box");
            }
}

static void a_box_is_in_another_only_if_none_of_its_faces_sticks_out(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        dr_box inner = cube;
        inner.min_q[axis] = 99;
        TEST_ASSERT_FALSE(dr_box_is_in(&inner, &cube));
        inner = cube;
        inner.max_q[axis] = 201;
        TEST_ASSERT_FALSE(dr_box_is_in(&inner, &cube));
        inner.max_q[axis] = inner.min_q[axis];
        TEST_ASSERT_TRUE(dr_box_is_in(&inner, &cube));
    }
}

static void boxes_that_are_apart_on_one_axis_do_not_touch(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        dr_box beside = cube;
        beside.min_q[axis] = 200, beside.max_q[axis] = 300;
        TEST_ASSERT_TRUE(dr_box_touches_box(&cube, &beside));
        TEST_ASSERT_TRUE(dr_box_touches_box(&beside, &cube));
        beside.min_q[axis] = 201;
        TEST_ASSERT_FALSE(dr_box_touches_box(&cube, &beside));
        TEST_ASSERT_FALSE(dr_box_touches_box(&beside, &cube));
    }
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

/* Of every direction along an axis, and off it by the tolerance on one or both of the others. */
static void the_distance_from_an_axis_is_euclidean(void)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        int16_t direction[DR_AXES] = {0, 0, 0};
        direction[axis] = 1;
        for (uint8_t off = 1; off < DR_AXES; off++) {
            const uint8_t side = (uint8_t)((axis + off) % DR_AXES), other = (uint8_t)((axis + DR_AXES - off) % DR_AXES);
            int32_t move[DR_AXES] = {0, 0, 0};
            move[axis] = -30000;
            move[side] = 5;
            TEST_ASSERT_TRUE(dr_is_along(move, direction, 5));
            TEST_ASSERT_FALSE(dr_is_along(move, direction, 4));
            move[other] = 1; /* sqrt(26) */
            TEST_ASSERT_FALSE(dr_is_along(move, direction, 5));
            move[side] = 4, move[other] = -3;
            TEST_ASSERT_TRUE(dr_is_along(move, direction, 5));
            move[side] = 1, move[other] = 1;
            TEST_ASSERT_FALSE(dr_is_along(move, direction, 1));
        }
    }
}

static void a_half_space_grows_by_the_corner_of_a_cube(void)
{
    const dr_half slope = {-200, {3, -5, 0}};
    const dr_half grown = dr_half_grown(&slope, 7), shrunk = dr_half_grown(&slope, -7);
    TEST_ASSERT_EQUAL_INT64(-200 + 7 * 8, grown.offset_q);
    TEST_ASSERT_EQUAL_INT64(-200 - 7 * 8, shrunk.offset_q);
    TEST_ASSERT_EQUAL_INT16_ARRAY(slope.normal, grown.normal, DR_AXES);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_line_along_a_face_touches_at_0_and_not_at_1_quantum);
    RUN_TEST(a_line_that_ends_on_a_face_touches);
    RUN_TEST(a_slanting_line_grazes_an_edge_or_a_corner);
    RUN_TEST(a_point_is_a_line_too);
    RUN_TEST(a_step_of_one_quantum_is_a_line_too);
    RUN_TEST(what_misses_on_any_axis_misses_wherever_it_is_on_the_others);
    RUN_TEST(every_small_line_touches_exactly_the_boxes_that_it_meets);
    RUN_TEST(a_box_is_in_another_only_if_none_of_its_faces_sticks_out);
    RUN_TEST(boxes_that_are_apart_on_one_axis_do_not_touch);
    RUN_TEST(boxes_touch_at_their_faces);
    RUN_TEST(a_half_space_holds_its_plane);
    RUN_TEST(along_a_line_is_judged_by_the_distance_from_it);
    RUN_TEST(the_distance_from_an_axis_is_euclidean);
    RUN_TEST(a_half_space_grows_by_the_corner_of_a_cube);
    return UNITY_END();
}
