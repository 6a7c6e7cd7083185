/* Contacts that bounce, at every length of bouncing; encoders at every way their contacts can be seen. A look is a
 * millisecond. */
#include "contacts.h"

#include "unity.h"

static dr_contacts buttons;
static dr_encoder encoder;
static uint32_t chance;

/* 0 to below `range`; the same numbers in each run. */
static unsigned any(unsigned range)
{
    chance = chance * UINT32_C(1664525) + UINT32_C(1013904223);
    return (unsigned)(chance >> 16) % range;
}

void setUp(void)
{
    chance = 1;
    dr_contacts_init(&buttons, 0);
    encoder = (dr_encoder){0, 0};
}

void tearDown(void) {}

static void test_a_change_counts_at_the_eighth_look_in_a_row(void)
{
    for (unsigned look = 1; look < DR_LOOKS; look++)
        TEST_ASSERT_EQUAL_HEX16(0, dr_contacts_look(&buttons, 0x8001));
    TEST_ASSERT_EQUAL_HEX16(0x8001, dr_contacts_look(&buttons, 0x8001));
    TEST_ASSERT_EQUAL_HEX16(0x8001, buttons.closed);
    for (unsigned look = 1; look < DR_LOOKS; look++)
        TEST_ASSERT_EQUAL_HEX16(0, dr_contacts_look(&buttons, 0x0001));
    TEST_ASSERT_EQUAL_HEX16(0x8000, dr_contacts_look(&buttons, 0x0001));
    TEST_ASSERT_EQUAL_HEX16(0x0001, buttons.closed);
}

static void test_what_lasts_for_seven_looks_is_nothing(void)
{
    for (unsigned length = 1; length < DR_LOOKS; length++)
        for (unsigned look = 0; look < 100; look++)
            TEST_ASSERT_EQUAL_HEX16(0, dr_contacts_look(&buttons, look % (length + 1u) != 0 ? 0xFFFF : 0));
    TEST_ASSERT_EQUAL_HEX16(0, buttons.closed);
}

/* However a contact chatters between two states, it is told once, and when it has been quiet for eight looks. */
static void test_bouncing_of_any_pattern_is_one_change(void)
{
    for (unsigned round = 0; round < 1000; round++) {
        const bool closes = buttons.closed == 0;
        unsigned changes = 0, quiet = 0;
        for (unsigned look = 0; look < 6; look++)
            changes += dr_contacts_look(&buttons, (uint16_t)any(2)) != 0;
        TEST_ASSERT_EQUAL(0, changes);
        while (dr_contacts_look(&buttons, closes) == 0)
            TEST_ASSERT_LESS_THAN(DR_LOOKS, ++quiet);
        TEST_ASSERT_EQUAL(closes, buttons.closed);
        for (unsigned look = 0; look < 20; look++)
            TEST_ASSERT_EQUAL(0, dr_contacts_look(&buttons, closes));
    }
}

static void test_each_button_counts_for_itself(void)
{
    for (uint8_t input = 0; input < 16; input++)
        for (unsigned look = 1; look <= DR_LOOKS; look++) {
            const uint16_t seen = (uint16_t)((look % 2u != 0 ? 0xFFFFu : 0) | 1u << input); /* the others chatter */
            TEST_ASSERT_EQUAL_HEX16(look < DR_LOOKS ? 0 : 1u << input,
                                    dr_contacts_look(&buttons, (uint16_t)(seen ^ buttons.closed)) & 1u << input);
        }
}

static void test_what_is_closed_at_the_start_is_no_change(void)
{
    dr_contacts_init(&buttons, 0x00F0);
    for (unsigned look = 0; look < 20; look++)
        TEST_ASSERT_EQUAL_HEX16(0, dr_contacts_look(&buttons, 0x00F0));
}

/* -- Encoders ------------------------------------------------------------------------------------------------------ */

/* Where in the cycle: 0 both open, 1 A closed, 2 both, 3 B. */
static int see(unsigned at)
{
    return dr_encoder_look(&encoder, at % 4u == 1u || at % 4u == 2u, at % 4u == 2u || at % 4u == 3u);
}

static void test_a_detent_is_a_whole_cycle(void)
{
    for (unsigned at = 1; at <= 400; at++)
        TEST_ASSERT_EQUAL(at % 4u == 0 ? 1 : 0, see(at));
    for (unsigned at = 400; at-- > 0;)
        TEST_ASSERT_EQUAL(at % 4u == 0 ? -1 : 0, see(at));
}

static void test_half_a_detent_and_back_is_none(void)
{
    static const unsigned there_and_back[] = {1, 0, 1, 2, 1, 0, 3, 0, 3, 2, 3, 0};
    for (size_t i = 0; i < sizeof there_and_back / sizeof *there_and_back; i++)
        TEST_ASSERT_EQUAL(0, see(there_and_back[i]));
}

/* At each edge one contact may be seen either way any number of times: the sum is what was turned. */
static void test_bouncing_adds_nothing(void)
{
    long sum = 0;
    for (unsigned at = 0; at < 4000; at++) {
        for (unsigned bounces = any(6); bounces > 0; bounces--)
            sum += see(at + any(2));
        sum += see(at + 1u);
    }
    TEST_ASSERT_EQUAL(1000, sum);
}

static void test_a_missed_look_within_a_detent_loses_none(void)
{
    for (unsigned missed = 1; missed < 4; missed++) {
        int sum = 0;
        for (unsigned at = 1; at <= 40; at++)
            if (at % 4u != missed)
                sum += see(at);
        TEST_ASSERT_EQUAL(10, sum);
    }
}

static void test_an_encoder_that_stands_between_detents_at_the_start_counts_none_for_it(void)
{
    for (unsigned at = 1; at < 4; at++) {
        encoder = (dr_encoder){0, 0};
        (void)see(at);
        TEST_ASSERT_EQUAL(0, see(at));
        TEST_ASSERT_INT_WITHIN(1, 0, see(0)); /* at most the detent it was on its way to */
        TEST_ASSERT_EQUAL(0, encoder.quarters);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_change_counts_at_the_eighth_look_in_a_row);
    RUN_TEST(test_what_lasts_for_seven_looks_is_nothing);
    RUN_TEST(test_bouncing_of_any_pattern_is_one_change);
    RUN_TEST(test_each_button_counts_for_itself);
    RUN_TEST(test_what_is_closed_at_the_start_is_no_change);
    RUN_TEST(test_a_detent_is_a_whole_cycle);
    RUN_TEST(test_half_a_detent_and_back_is_none);
    RUN_TEST(test_bouncing_adds_nothing);
    RUN_TEST(test_a_missed_look_within_a_detent_loses_none);
    RUN_TEST(test_an_encoder_that_stands_between_detents_at_the_start_counts_none_for_it);
    return UNITY_END();
}
