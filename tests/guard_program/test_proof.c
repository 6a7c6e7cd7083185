/* A guard that died while it sent the 'S' of an MPC-200 leaves a controller that waits for 12 bytes more. Whatever the next
 * guard sends before it is answered becomes part of that frame; were it whole, the tip would go to where 'C' and ^C are cut
 * to the travel. So a guard without an answer must fall silent before, and a person has to switch the controller off. */
#include "dr_guard.h"

#include "unity.h"

#define REST_OF_S 12u /* 14 bytes [M table 9], less the two that come before the pause */
#define S_US UINT32_C(1000000)

static dr_limits limits;
static dr_guard guard;
static dr_record ring[16];

void setUp(void)
{
    dr_limits_init(&limits, DR_MPC);
    TEST_ASSERT_TRUE(dr_limits_init_drive(&limits, 0, DR_STAGE_MPC_MP225));
    dr_guard_init(&guard, &limits, ring, 16);
}
void tearDown(void) {}

static unsigned pull(dr_us now)
{
    uint8_t bytes[64];
    return (unsigned)dr_guard_pull_device(&guard, now, bytes, sizeof bytes);
}

static unsigned bytes_until(dr_us *now, dr_us end)
{
    dr_us when;
    unsigned sent = pull(*now);
    while (dr_guard_due(&guard, &when) && !dr_us_before(end, when)) {
        *now = when;
        sent += pull(when);
    }
    *now = end;
    return sent;
}

static void without_an_answer_fewer_bytes_leave_than_end_a_torn_frame(void)
{
    dr_us now = 0;
    dr_guard_start(&guard, now, DR_START_AFTER_RESET);
    dr_guard_link(&guard, now, false, true);
    const unsigned sent = bytes_until(&now, 600 * S_US);
    TEST_ASSERT_GREATER_THAN_UINT(2, sent); /* ^C, and more than one query: a TRIO may be calibrating */
    TEST_ASSERT_LESS_THAN_UINT(REST_OF_S, sent);
    dr_guard_status status;
    dr_guard_get_status(&guard, &status);
    TEST_ASSERT_EQUAL(DR_GUARD_LOCKED, status.state);
    TEST_ASSERT_EQUAL(DR_FAULT_DEVICE_SILENT, status.fault);
}

/* A TRIO that calibrates when its power comes on takes a while to listen. */
static void a_controller_that_listens_after_fifty_seconds_is_found(void)
{
    static const uint8_t here[] = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, DR_CR};
    dr_us now = 0, when;
    dr_guard_status status;
    dr_guard_start(&guard, now, DR_START_AFTER_RESET);
    dr_guard_link(&guard, now, false, true);
    (void)bytes_until(&now, 50 * S_US);
    for (unsigned i = 0; i < 8 && dr_guard_due(&guard, &when); i++) {
        now = dr_us_before(when, now) ? now : when;
        if (pull(now) > 0)
            dr_guard_push_device(&guard, now, here, sizeof here);
    }
    dr_guard_get_status(&guard, &status);
    TEST_ASSERT_EQUAL(0, status.needs & DR_NEEDS_REST);
    TEST_ASSERT_TRUE(status.state == DR_GUARD_DISARMED || status.confirm_wanted);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(without_an_answer_fewer_bytes_leave_than_end_a_torn_frame);
    RUN_TEST(a_controller_that_listens_after_fifty_seconds_is_found);
    return UNITY_END();
}
