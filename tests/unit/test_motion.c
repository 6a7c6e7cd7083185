/* dr_motion: properties, and the arithmetic of PROTOCOL.md done once more in another way (by comparison of products,
 * without a division). */
#include "dr_motion.h"

#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

static uint64_t seed;

static uint32_t any(uint32_t below)
{
    seed = seed * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)((seed >> 32) % below);
}

static uint32_t way(const dr_leg *leg, unsigned axis)
{
    return leg->from[axis] < leg->to[axis] ? leg->to[axis] - leg->from[axis] : leg->from[axis] - leg->to[axis];
}

static uint32_t longest(const dr_leg *leg)
{
    uint32_t most = 0;
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        most = way(leg, axis) > most ? way(leg, axis) : most;
    }
    return most;
}

/* Is `us` the whole microseconds that `steps` take, rounded up? */
static void check_duration(uint32_t us, uint32_t steps, uint8_t quanta, uint32_t speed)
{
    const uint64_t length = (uint64_t)steps * quanta * 1000000u;
    TEST_ASSERT_TRUE((uint64_t)us * speed >= length);
    TEST_ASSERT_TRUE(us == 0 ? length == 0 : (uint64_t)(us - 1) * speed < length);
}

/* Is `at` where an axis is: from +- floor(steps * elapsed / duration)? */
static void check_position(const dr_leg *leg, unsigned axis, uint32_t elapsed, uint32_t lasts, uint32_t at)
{
    if (elapsed >= lasts) {
        TEST_ASSERT_EQUAL_UINT32(leg->to[axis], at);
        return;
    }
    const uint64_t gone =
        leg->to[axis] >= leg->from[axis] ? (uint64_t)at - leg->from[axis] : (uint64_t)leg->from[axis] - at;
    const uint64_t share = (uint64_t)way(leg, axis) * elapsed;
    TEST_ASSERT_TRUE(gone * lasts <= share);
    TEST_ASSERT_TRUE((gone + 1) * lasts > share);
}

static const uint8_t all_quanta[] = {3, 4, 5, 6, 8};
static const uint32_t all_speeds[] = {5200, 83200, 20000, 320000, 192000, 338 * 64, 4650 * 64};

static dr_leg any_leg(bool straight, uint8_t *quanta, uint32_t *speed, uint32_t most)
{
    uint32_t from[DR_AXES], to[DR_AXES];
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        from[axis] = any(most + 1);
        to[axis] = any(4) == 0 ? from[axis] : any(most + 1);
    }
    *quanta = all_quanta[any(COUNT(all_quanta))];
    *speed = all_speeds[any(COUNT(all_speeds))];
    return straight ? dr_leg_straight(from, to, *quanta, *speed) : dr_leg_each(from, to, *quanta, *speed);
}

static void ends_are_exact_and_durations_round_up(void)
{
    seed = 2;
    for (int round = 0; round < 20000; round++) {
        uint8_t quanta;
        uint32_t speed;
        const bool straight = round % 2 == 0;
        const dr_leg leg = any_leg(straight, &quanta, &speed, any(3) == 0 ? 40 : 1066667);
        const dr_us lasts = dr_leg_lasts_us(&leg);
        check_duration(lasts, longest(&leg), quanta, speed);
        uint32_t at[DR_AXES];
        dr_leg_at(&leg, 0, at);
        TEST_ASSERT_EQUAL_UINT32_ARRAY(leg.from, at, DR_AXES);
        dr_leg_at(&leg, lasts, at);
        TEST_ASSERT_EQUAL_UINT32_ARRAY(leg.to, at, DR_AXES);
        dr_leg_at(&leg, UINT32_MAX, at); /* and ever after */
        TEST_ASSERT_EQUAL_UINT32_ARRAY(leg.to, at, DR_AXES);
        for (unsigned axis = 0; axis < DR_AXES; axis++) {
            if (straight) {
                TEST_ASSERT_EQUAL_UINT32(way(&leg, axis) == 0 ? 0 : lasts, leg.lasts_us[axis]);
            } else {
                check_duration(leg.lasts_us[axis], way(&leg, axis), quanta, speed);
            }
        }
    }
}

static void positions_on_the_way_are_the_floor_of_the_share(void)
{
    seed = 3;
    for (int round = 0; round < 5000; round++) {
        uint8_t quanta;
        uint32_t speed;
        const dr_leg leg = any_leg(round % 2 == 0, &quanta, &speed, 1066667);
        const dr_us lasts = dr_leg_lasts_us(&leg);
        for (int k = 0; k < 20; k++) {
            const dr_us elapsed = k == 0 ? lasts - (lasts > 0) : any(lasts + 2);
            uint32_t at[DR_AXES];
            dr_leg_at(&leg, elapsed, at);
            for (unsigned axis = 0; axis < DR_AXES; axis++) {
                check_position(&leg, axis, elapsed, leg.lasts_us[axis], at[axis]);
            }
        }
    }
}

static void motion_is_monotone_and_stays_between_the_ends(void)
{
    const uint32_t from[3] = {500, 90, 70}, to[3] = {120, 90, 200};
    for (int straight = 0; straight < 2; straight++) {
        const dr_leg leg = straight ? dr_leg_straight(from, to, 4, 83200) : dr_leg_each(from, to, 4, 83200);
        uint32_t before[3] = {500, 90, 70}, at[3];
        for (dr_us t = 0; t <= dr_leg_lasts_us(&leg) + 10; t++) {
            dr_leg_at(&leg, t, at);
            TEST_ASSERT_TRUE(at[0] <= before[0] && before[0] - at[0] <= 1 && at[0] >= 120);
            TEST_ASSERT_EQUAL_UINT32(90, at[1]);
            TEST_ASSERT_TRUE(at[2] >= before[2] && at[2] - before[2] <= 1 && at[2] <= 200);
            before[0] = at[0];
            before[2] = at[2];
        }
    }
}

static void known_moves_take_their_time(void)
{
    const uint32_t zero[3] = {0, 0, 0}, one[3] = {1, 0, 0};
    const uint32_t mm[3] = {16000, 0, 0}, cube[3] = {16000, 16000, 8000}, all[3] = {1066667, 266667, 533333};
    /* 1 mm at 1,300 um/s: 769,230.77 us */
    TEST_ASSERT_EQUAL_UINT32(769231, dr_leg_straight(zero, mm, 4, 83200).lasts_us[DR_X]);
    /* a straight line through the cube lasts no longer than its longest axis [O v1.10; M note 13] */
    const dr_leg straight = dr_leg_straight(zero, cube, 4, 192000);
    TEST_ASSERT_EQUAL_UINT32(333334, dr_leg_lasts_us(&straight));
    TEST_ASSERT_EQUAL_UINT32(333334, straight.lasts_us[DR_Z]);
    const dr_leg each = dr_leg_each(zero, cube, 4, 192000);
    TEST_ASSERT_EQUAL_UINT32(333334, each.lasts_us[DR_Y]);
    TEST_ASSERT_EQUAL_UINT32(166667, each.lasts_us[DR_Z]);
    /* the longest of all moves: 50 mm at 81.25 um/s */
    const dr_leg slow = dr_leg_straight(zero, all, 3, 5200);
    TEST_ASSERT_EQUAL_UINT32(615384808, dr_leg_lasts_us(&slow)); /* ceil(1066667 * 3 * 10^6 / 5200) */
    /* the shortest: a step of 3/64 um at 5 mm/s, 9.375 us */
    TEST_ASSERT_EQUAL_UINT32(10, dr_leg_straight(zero, one, 3, 320000).lasts_us[DR_X]);
    TEST_ASSERT_EQUAL_UINT32(0, dr_leg_straight(one, one, 3, 320000).lasts_us[DR_X]);
    const dr_leg none = dr_leg_each(one, one, 3, 320000);
    TEST_ASSERT_EQUAL_UINT32(0, dr_leg_lasts_us(&none));
}

static void crossings_are_exact(void)
{
    seed = 4;
    for (int round = 0; round < 3000; round++) {
        uint8_t quanta;
        uint32_t speed;
        const dr_leg leg = any_leg(true, &quanta, &speed, any(2) ? 1066667 : 1000);
        const dr_us lasts = dr_leg_lasts_us(&leg);
        const uint64_t length = (uint64_t)longest(&leg) * quanta; /* in quanta */
        const uint32_t microns = dr_leg_microns(&leg, quanta);
        TEST_ASSERT_TRUE((uint64_t)microns * 64 <= length && ((uint64_t)microns + 1) * 64 > length);
        for (int i = 0; i < 20 && microns > 0; i++) {
            const uint32_t k = i == 0 ? 1 : i == 1 ? microns : 1 + any(microns);
            const dr_us at = dr_leg_micron_at_us(&leg, quanta, k);
            /* at = ceil(k um * duration / length) */
            TEST_ASSERT_TRUE((uint64_t)at * length >= (uint64_t)k * 64 * lasts);
            TEST_ASSERT_TRUE((uint64_t)(at - 1) * length < (uint64_t)k * 64 * lasts);
            TEST_ASSERT_TRUE(at <= lasts);
            TEST_ASSERT_TRUE(dr_leg_microns_by(&leg, quanta, at) >= k);
            TEST_ASSERT_TRUE(dr_leg_microns_by(&leg, quanta, at - 1) < k);
            if (k > 1) {
                TEST_ASSERT_TRUE(dr_leg_micron_at_us(&leg, quanta, k - 1) <= at);
            }
        }
        TEST_ASSERT_EQUAL_UINT32(0, dr_leg_microns_by(&leg, quanta, 0));
        TEST_ASSERT_EQUAL_UINT32(microns, dr_leg_microns_by(&leg, quanta, lasts));
        TEST_ASSERT_EQUAL_UINT32(microns, dr_leg_microns_by(&leg, quanta, UINT32_MAX));
        const dr_us between = any(lasts + 1);
        const uint32_t by = dr_leg_microns_by(&leg, quanta, between);
        TEST_ASSERT_TRUE(by == 0 || dr_leg_micron_at_us(&leg, quanta, by) <= between);
        TEST_ASSERT_TRUE(by == microns || dr_leg_micron_at_us(&leg, quanta, by + 1) > between);
    }
}

static void a_whole_stream_neither_drifts_nor_skips(void)
{
    /* 25,000 um at 1,300 um/s: micron k is reached after k/1300 s, to the microsecond, also the last one. */
    const uint32_t from[3] = {400000, 0, 0}, to[3] = {0, 0, 0};
    const dr_leg leg = dr_leg_straight(from, to, 4, 83200);
    const uint64_t lasts = 19230770; /* ceil(25000 * 10^6 / 1300) */
    TEST_ASSERT_EQUAL_UINT32(lasts, dr_leg_lasts_us(&leg));
    TEST_ASSERT_EQUAL_UINT32(25000, dr_leg_microns(&leg, 4));
    for (uint32_t k = 1; k <= 25000; k++) {
        const dr_us at = dr_leg_micron_at_us(&leg, 4, k);
        TEST_ASSERT_EQUAL_UINT32((k * lasts + 24999) / 25000, at);
        uint32_t steps[3];
        dr_leg_at(&leg, at, steps);
        TEST_ASSERT_EQUAL_UINT32(400000 - 16 * k, steps[DR_X]);
    }
}

static void less_than_a_micron_has_no_crossing(void)
{
    const uint32_t from[3] = {0, 0, 0}, to[3] = {15, 15, 0}, same[3] = {0, 0, 0}, just[3] = {16, 0, 0};
    const dr_leg shorter = dr_leg_straight(from, to, 4, 5200), none = dr_leg_straight(from, same, 4, 5200);
    const dr_leg whole = dr_leg_straight(from, just, 4, 5200);
    TEST_ASSERT_EQUAL_UINT32(0, dr_leg_microns(&shorter, 4));
    TEST_ASSERT_EQUAL_UINT32(0, dr_leg_microns_by(&shorter, 4, UINT32_MAX));
    TEST_ASSERT_EQUAL_UINT32(0, dr_leg_microns(&none, 4));
    TEST_ASSERT_EQUAL_UINT32(0, dr_leg_microns_by(&none, 4, 0));
    TEST_ASSERT_EQUAL_UINT32(1, dr_leg_microns(&whole, 4));
    TEST_ASSERT_EQUAL_UINT32(dr_leg_lasts_us(&whole), dr_leg_micron_at_us(&whole, 4, 1));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(ends_are_exact_and_durations_round_up);
    RUN_TEST(positions_on_the_way_are_the_floor_of_the_share);
    RUN_TEST(motion_is_monotone_and_stays_between_the_ends);
    RUN_TEST(known_moves_take_their_time);
    RUN_TEST(crossings_are_exact);
    RUN_TEST(a_whole_stream_neither_drifts_nor_skips);
    RUN_TEST(less_than_a_micron_has_no_crossing);
    return UNITY_END();
}
