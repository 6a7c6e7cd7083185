/* The guard under libFuzzer: the input decides the rig, the host's bytes, the controller's, what people do and how time
 * goes. A monitor of bench.h that sees its rule broken is a crash. */
#include "hostile.h"

#include <stdlib.h>

#define ACTS_MAX 64u

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

void setUp(void) {}
void tearDown(void) {}

static void play(chance *c)
{
    hostile_begin(c, any_below(c, 2) != 0);
    for (unsigned i = 0; i < ACTS_MAX && c->at < c->count; i++)
        hostile_act(c);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    chance c = {data, size, 0, 0};
    Unity.CurrentTestName = "fuzz_guard";
    Unity.TestFile = __FILE__;
    if (TEST_PROTECT()) {
        play(&c);
    } else {
        abort(); /* Unity has told what failed */
    }
    return 0;
}
