/* 10,000 random byte streams of 10 kB: whatever arrives, nothing breaks, and after a power cycle the controller answers.
 * Seeded: stream n depends on n alone. With an argument, so many streams; with two, from the second on. */
#include "torture.h"

#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STREAM_BYTES 10240u

static unsigned long streams = 10000, first = 0;

void setUp(void) {}
void tearDown(void) {}

static uint64_t random_state;

static uint32_t any(void)
{
    random_state = random_state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(random_state >> 32);
}

static void one_stream(unsigned long n, uint64_t *taken)
{
    static torture t;
    static uint8_t bytes[STREAM_BYTES];
    static const char codes[] = "cChwHWSxyzXYZAR\x03KUIYNMFOL\r\n";
    random_state = n * 2 + 1;
    (void)any();
    for (size_t k = 0; k < STREAM_BYTES; k++) { /* a third of the streams is noise, the others are rich in commands */
        const uint32_t r = any();
        bytes[k] = n % 3 == 0 || (r & 3) == 0 ? (uint8_t)(r >> 8)
                   : (r & 3) == 1             ? 0
                                              : (uint8_t)codes[(r >> 8) % (sizeof codes - 1)];
    }
    torture_input input = {bytes, 64, 0};
    torture_begin(&t, &input);
    size_t at = 0;
    while (at < STREAM_BYTES) {
        const uint32_t r = any();
        size_t piece = 1 + (r & 63);
        piece = piece < STREAM_BYTES - at ? piece : STREAM_BYTES - at;
        torture_push(&t, bytes + at, piece);
        at += piece;
        switch (r >> 6 & 7) {
        case 0:
            break; /* nobody takes anything, no time goes by */
        case 1:
            t.now += r >> 12;
            break;
        case 2:
            torture_pull(&t, r >> 9 & 15);
            break;
        case 3:
            dr_controller_paused(&t.c, r >> 12);
            torture_poke(&t, &(torture_input){bytes, STREAM_BYTES, at});
            break;
        default:
            torture_wait(&t);
            torture_pull(&t, 255);
            *taken += 1;
        }
    }
    torture_pull(&t, 0);
    torture_check(&t);
    torture_revive(&t);
}

static void random_streams_break_nothing(void)
{
    uint64_t taken = 0;
    for (unsigned long n = first; n < first + streams; n++) {
        one_stream(n, &taken);
    }
    TEST_ASSERT_TRUE(taken > streams); /* they did get through */
    (void)printf("%lu streams of %u bytes\n", streams, STREAM_BYTES);
}

int main(int argc, char **argv)
{
    if (argc > 1) {
        streams = strtoul(argv[1], NULL, 10);
    }
    if (argc > 2) {
        first = strtoul(argv[2], NULL, 10);
    }
    UNITY_BEGIN();
    RUN_TEST(random_streams_break_nothing);
    return UNITY_END();
}
