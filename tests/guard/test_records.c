/* What each kind of record holds (dr_guard.h, dr_event), and what the host hears when a motion is refused by 'E'. */
#include "bench.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static void says_at(uint32_t x) { device_at(x, 40000, 40000, 30); }

static void proved(void)
{
    bench_trio();
    rig.by_hand = true;
    keep_out(10000, 11000, 0, 25000, 0, 25000);
    bench_start();
    run_us(1000000);
    says_at(40000);
    expect_state(DR_GUARD_DISARMED);
}

static void armed(void)
{
    proved();
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_us(2000);
    says_at(40001);
    run_us(100000);
    says_at(40002);
    expect_state(DR_GUARD_IDLE);
}

/* The newest record of an event, but for its instant and states; where nothing is said, position is 40,000 on Y and Z. */
static void records(dr_event event, uint8_t code, uint8_t op, uint8_t axis, uint8_t item, const char *bytes,
                    uint8_t count, uint32_t x)
{
    const dr_record *record = last_record(event);
    TEST_ASSERT_NOT_NULL(record);
    uint8_t text[DR_RECORD_TEXT] = {0};
    memcpy(text, bytes, count < DR_RECORD_TEXT ? count : DR_RECORD_TEXT);
    TEST_ASSERT_EQUAL_MESSAGE(code, record->code, "code");
    TEST_ASSERT_EQUAL_MESSAGE(op, record->op, "op");
    TEST_ASSERT_EQUAL_MESSAGE(axis, record->axis, "axis");
    TEST_ASSERT_EQUAL_MESSAGE(item, record->item, "item");
    TEST_ASSERT_EQUAL_MESSAGE(count, record->count, "count");
    TEST_ASSERT_EQUAL_HEX8_ARRAY(text, record->bytes, DR_RECORD_TEXT);
    TEST_ASSERT_EQUAL(x, record->position_steps[DR_X]);
    TEST_ASSERT_EQUAL(40000, record->position_steps[DR_Y]);
    TEST_ASSERT_EQUAL(40000, record->position_steps[DR_Z]);
}

static void what_the_host_sent_in_vain_is_kept_with_its_first_bytes_and_how_many(void)
{
    proved();
    host_code(0x99);
    for (unsigned i = 0; i < 299; i++)
        host_code((int)(i % 200 + 1));
    records(DR_EVENT_DROPPED, DR_REASON_UNKNOWN, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "\x99", 1, 40000);
    run_us(50000);
    records(DR_EVENT_DROPPED, DR_REASON_RESYNC, DR_OP_NONE, DR_AXES, DR_NO_ITEM,
            "\1\2\3\4\5\6\7\x8\x9\xA\xB\xC\xD\xE\xF\x10", 255, 40000);
    TEST_ASSERT_EQUAL(300, status().dropped_bytes);
    host_code(0x98);
    run_us(50000);
    records(DR_EVENT_DROPPED, DR_REASON_UNKNOWN, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "\x98", 1, 40000);
    host_code(0x98);
    host_bytes("ABCDEFGHIJKLMNOPQRST", 20);
    run_us(50000);
    records(DR_EVENT_DROPPED, DR_REASON_RESYNC, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "ABCDEFGHIJKLMNOP", 20, 40000);
    host_bytes("xab", 3);
    run_us(100000);
    records(DR_EVENT_DROPPED, DR_REASON_TORN, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "xab", 3, 40000);
}

static void a_query_is_kept_with_its_reply(void)
{
    proved();
    host_code('c');
    records(DR_EVENT_ALLOWED, 0, DR_OP_TRIO_POSITION, DR_AXES, DR_NO_ITEM, "c", 1, 40000);
    run_us(500);
    device_at(41000, 40000, 40000, 30);
    records(DR_EVENT_REPLY, DR_OP_TRIO_POSITION, DR_OP_TRIO_POSITION, DR_AXES, DR_NO_ITEM,
            "\x28\xA0\0\0\x40\x9C\0\0\x40\x9C\0\0\x1E\r", 14, 40000);
    host_code('c');
    run_us(2000000);
    records(DR_EVENT_NO_REPLY, DR_OP_TRIO_POSITION, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "", 0, 41000);
    TEST_ASSERT_NULL(last_record(DR_EVENT_DROPPED));
    TEST_ASSERT_NULL(last_record(DR_EVENT_QUARANTINED));
}

static void what_the_controller_says_unasked_is_kept(void)
{
    proved();
    device_says("xyz", 3);
    run_us(1000000);
    records(DR_EVENT_QUARANTINED, 0, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "xyz", 3, 40000);
    TEST_ASSERT_EQUAL(3, status().quarantined_bytes);
    input(DR_INPUT_KEY, true);
    press(DR_INPUT_ARM);
    run_us(2000);
    device_says("nonsense", 8);
    run_us(100000);
    records(DR_EVENT_IMPLAUSIBLE, 0, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "nonsense", 8, 40000);
    proved();
    device_says("ABCDEFGHIJKLMNOPQRST", 20);
    run_us(1000000);
    records(DR_EVENT_QUARANTINED, 0, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "ABCDEFGHIJKLMNOP", 20, 40000);
}

static void what_people_do_is_kept(void)
{
    proved();
    input(DR_INPUT_KEY, true);
    records(DR_EVENT_INPUT, DR_INPUT_KEY, DR_OP_NONE, DR_AXES, 1, "", 0, 40000);
    input(DR_INPUT_KEY, false);
    records(DR_EVENT_INPUT, DR_INPUT_KEY, DR_OP_NONE, DR_AXES, 0, "", 0, 40000);
    stop_input(true);
    records(DR_EVENT_STOP, DR_STOP_INPUT, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "", 0, 40000);
    cables(false, true);
    records(DR_EVENT_LINK, 2, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "", 0, 40000);
    cables(true, false);
    records(DR_EVENT_LINK, 1, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "", 0, 40000);
    records(DR_EVENT_STATE, DR_FAULT_NO_DEVICE, DR_OP_NONE, DR_AXES, DR_NO_ITEM, "", 0, 40000);
}

static void refusals_are_kept_with_what_they_are_about(void)
{
    proved();
    host_axis('x', 40008);
    records(DR_EVENT_REFUSED, DR_REASON_NOT_ARMED, DR_OP_TRIO_X, DR_AXES, DR_NO_ITEM, "x\x48\x9C\0\0", 5, 40000);
    TEST_ASSERT_EQUAL_INT64(0, status().last_refusal.measured);
    TEST_ASSERT_EQUAL_INT64(0, status().last_refusal.limit);
    armed();
    host_axis('x', 199999);
    run_us(2000);
    says_at(40002);
    records(DR_EVENT_REFUSED, DR_REASON_LIMIT, DR_OP_TRIO_X, DR_X, DR_NO_ITEM, "x\x3F\x0D\x03\0", 5, 40002);
    host_axis('x', 80000);
    run_us(2000);
    says_at(40002);
    records(DR_EVENT_REFUSED, DR_REASON_KEEP_OUT, DR_OP_TRIO_X, DR_AXES, 0, "x\x80\x38\x01\0", 5, 40002);
}

static void a_motion_is_kept_with_its_readings_and_its_end(void)
{
    armed();
    records(DR_EVENT_READING, 0, DR_OP_NONE, DR_AXES, 30, "", 0, 40002);
    host_axis('x', 40802);
    run_us(2000);
    says_at(40002);
    records(DR_EVENT_ALLOWED, 0, DR_OP_TRIO_X, DR_AXES, DR_NO_ITEM, "x\x62\x9F\0\0", 5, 40002);
    run_us(100000);
    device_says("\r", 1);
    run_us(2000);
    says_at(40803);
    records(DR_EVENT_ENDED, DR_OP_TRIO_X, DR_OP_NONE, DR_AXES, 0, "\r", 1, 40803);
    expect_cr();
}

/* What was allowed and taken back before it left was not forwarded; a refusal that follows takes nothing more back. */
static void what_is_cancelled_before_it_leaves_was_not_forwarded(void)
{
    armed();
    const uint32_t before = status().forwarded;
    host_axis('x', 40802);
    run_us(2000);
    says_at(40002);
    TEST_ASSERT_EQUAL(before + 1, status().forwarded);
    host_code(3);
    expect_refused(DR_REASON_CANCELLED);
    TEST_ASSERT_EQUAL(before, status().forwarded);
    run_us(500);
    device_says("\r", 1);
    run_us(100000);
    says_at(40002);
    run_us(100000);
    says_at(40002);
    expect_state(DR_GUARD_IDLE);
    host_axis('x', 199999);
    run_us(2000);
    says_at(40002);
    expect_refused(DR_REASON_LIMIT);
    TEST_ASSERT_EQUAL(before, status().forwarded);
    expect_cr();
}

/* 'E' tells that nothing will be done. Not while something else is, nor for what the host took back itself. */
static void e_is_no_answer_to_what_came_while_moving_or_was_cancelled(void)
{
    bench_trio();
    rig.limits.refusal = DR_REFUSE_E;
    bench_start();
    host_axis('x', 40008);
    expect_heard("E", 1); /* not armed */
    bench_arm();
    host_axis('x', 199999);
    run_ms(20);
    expect_heard("E", 1); /* beyond the limits */
    host_line(15, 44000, 40000, 40000);
    host_axis('x', 40008);
    expect_refused(DR_REASON_BUSY);
    expect_silence();
    host_code(3);
    expect_refused(DR_REASON_CANCELLED);
    run_ms(500);
    expect_cr(); /* of ^C */
    expect_silence();
    expect_state(DR_GUARD_IDLE);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(what_the_host_sent_in_vain_is_kept_with_its_first_bytes_and_how_many);
    RUN_TEST(a_query_is_kept_with_its_reply);
    RUN_TEST(what_the_controller_says_unasked_is_kept);
    RUN_TEST(what_people_do_is_kept);
    RUN_TEST(refusals_are_kept_with_what_they_are_about);
    RUN_TEST(a_motion_is_kept_with_its_readings_and_its_end);
    RUN_TEST(what_is_cancelled_before_it_leaves_was_not_forwarded);
    RUN_TEST(e_is_no_answer_to_what_came_while_moving_or_was_cancelled);
    return UNITY_END();
}
