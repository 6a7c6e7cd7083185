/* The log by itself: a ring whose oldest record gives way, chained so that a change or a gap shows. */
#include "dr_log.h"
#include "unity.h"

#include <string.h>

static dr_record ring[3];
static dr_log guard_log;
static uint32_t last_crc;

void setUp(void)
{
    memset(ring, 0, sizeof ring);
    last_crc = 0;
}

void tearDown(void) {}

static void put(uint8_t code)
{
    dr_record record;
    memset(&record, 0, sizeof record);
    record.code = code;
    dr_log_put(&guard_log, &record);
}

/* The oldest is this one, and the chain goes on from the record before. */
static void oldest_is(uint8_t code, uint32_t sequence)
{
    dr_record record;
    TEST_ASSERT_TRUE(dr_log_take(&guard_log, &record));
    TEST_ASSERT_EQUAL(code, record.code);
    TEST_ASSERT_EQUAL(sequence, record.sequence);
    TEST_ASSERT_EQUAL_HEX32(dr_record_crc(last_crc, &record), record.crc);
    last_crc = record.crc;
}

static void is_empty(void)
{
    dr_record record;
    memset(&record, 0x77, sizeof record);
    TEST_ASSERT_FALSE(dr_log_take(&guard_log, &record));
    TEST_ASSERT_EQUAL_HEX8(0x77, record.code);
}

static void records_come_out_in_order_and_chained(void)
{
    dr_log_init(&guard_log, ring, 3);
    is_empty();
    for (uint8_t round = 0; round < 5; round++) { /* past the end of the ring, wherever it stands */
        put((uint8_t)(2 * round));
        put((uint8_t)(2 * round + 1));
        oldest_is((uint8_t)(2 * round), 2u * round);
        oldest_is((uint8_t)(2 * round + 1), 2u * round + 1);
        is_empty();
    }
    TEST_ASSERT_EQUAL(0, guard_log.missed);
}

static void a_full_ring_loses_the_oldest_and_counts_it(void)
{
    dr_log_init(&guard_log, ring, 3);
    for (uint8_t code = 0; code < 5; code++)
        put(code);
    TEST_ASSERT_EQUAL(2, guard_log.missed);
    dr_record record;
    TEST_ASSERT_TRUE(dr_log_take(&guard_log, &record));
    TEST_ASSERT_EQUAL(2, record.code);
    TEST_ASSERT_EQUAL(2, record.sequence);
    /* It is chained to those that were lost: nobody can take its predecessors for missing by chance. */
    dr_record lost;
    memset(&lost, 0, sizeof lost);
    for (uint8_t code = 0; code < 2; code++) {
        lost.code = code;
        lost.sequence = code;
        lost.crc = last_crc = dr_record_crc(last_crc, &lost);
    }
    TEST_ASSERT_EQUAL_HEX32(dr_record_crc(last_crc, &record), record.crc);
    last_crc = record.crc;
    oldest_is(3, 3);
    oldest_is(4, 4);
    is_empty();
}

static void a_ring_of_one_keeps_the_newest(void)
{
    dr_log_init(&guard_log, ring, 1);
    put(1);
    oldest_is(1, 0);
    put(2);
    put(3);
    TEST_ASSERT_EQUAL(1, guard_log.missed);
    dr_record record;
    TEST_ASSERT_TRUE(dr_log_take(&guard_log, &record));
    TEST_ASSERT_EQUAL(3, record.code);
    is_empty();
    TEST_ASSERT_EACH_EQUAL_HEX8(0, &ring[1], 2 * sizeof ring[1]);
}

static void without_memory_every_record_is_counted_as_missed(void)
{
    for (unsigned round = 0; round < 2; round++) {
        dr_record record;
        memset(&record, 0, sizeof record);
        dr_log_init(&guard_log, round == 0 ? NULL : ring, round == 0 ? 3 : 0);
        dr_log_put(&guard_log, &record);
        TEST_ASSERT_EQUAL(0, record.sequence);
        TEST_ASSERT_EQUAL_HEX32(dr_record_crc(0, &record), record.crc);
        const uint32_t first = record.crc;
        dr_log_put(&guard_log, &record);
        TEST_ASSERT_EQUAL(1, record.sequence);
        TEST_ASSERT_EQUAL_HEX32(dr_record_crc(first, &record), record.crc);
        TEST_ASSERT_EQUAL(2, guard_log.missed);
        is_empty();
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(records_come_out_in_order_and_chained);
    RUN_TEST(a_full_ring_loses_the_oldest_and_counts_it);
    RUN_TEST(a_ring_of_one_keeps_the_newest);
    RUN_TEST(without_memory_every_record_is_counted_as_missed);
    return UNITY_END();
}
