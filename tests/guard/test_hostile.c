/* The hostile host: random and structured frames at all times, on random rigs with tight limits. The monitors of bench.h
 * see to it that the tip never enters an obstacle or leaves its box and that no refused motion is answered.
 * test_hostile [FRAMES [SEED]]: session n of a seed depends on both alone. */
#include "hostile.h"

#include <stdio.h>
#include <stdlib.h>

#define FRAMES_OF_A_SESSION 200u

static unsigned long frames = 50000, seed = 1;

void setUp(void) {}
void tearDown(void) {}

static void nothing_unsafe_gets_through(void)
{
    unsigned long done = 0, forwarded = 0, refused = 0, motions = 0, latched = 0;
    for (unsigned long session = 0; done < frames; session++) {
        chance c = {NULL, 0, 0, seed * UINT64_C(1000003) + session};
        uint8_t state = DR_GUARD_LOCKED;
        for (unsigned i = 0; i < 8; i++)
            (void)any_below(&c, 2);
        hostile_begin(&c, false);
        for (unsigned i = 0; i < FRAMES_OF_A_SESSION; i++, done++) {
            hostile_act(&c);
            latched += status().state == DR_GUARD_FAULT && state != DR_GUARD_FAULT;
            state = status().state;
        }
        forwarded += status().forwarded;
        refused += status().refused;
        motions += rig.motions;
    }
    (void)printf("%lu frames: %lu commands passed, %lu of them motions; %lu refused; %lu faults\n", done, forwarded,
                 motions, refused, latched);
    TEST_ASSERT_TRUE(motions > frames / 100); /* it was allowed to move at all */
    TEST_ASSERT_TRUE(refused > frames / 100);
}

int main(int argc, char **argv)
{
    if (argc > 1)
        frames = strtoul(argv[1], NULL, 10);
    if (argc > 2)
        seed = strtoul(argv[2], NULL, 10);
    UNITY_BEGIN();
    RUN_TEST(nothing_unsafe_gets_through);
    return UNITY_END();
}
