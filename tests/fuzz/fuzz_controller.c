/* The controller under libFuzzer: the input decides what it is, what the host sends, how time goes and what hands do. */
#include "torture.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static torture t;
    torture_input input = {data, size, 0};
    torture_begin(&t, &input);
    while (input.at < input.count) {
        const uint8_t act = torture_next(&input);
        uint8_t bytes[32];
        size_t count = 0;
        switch (act & 7) {
        case 0: /* time goes by: 0..31 times 1, 32, 1,024 or 32,768 us */
            t.now += (dr_us)(act >> 3) << 5 * (torture_next(&input) & 3);
            break;
        case 1:
            torture_wait(&t);
            break;
        case 2:
            torture_pull(&t, act >> 3);
            break;
        case 3:
            torture_pull(&t, 255);
            break;
        case 4:
            if (act >> 3 == 0) {
                torture_poke(&t, &input);
            } else {
                dr_controller_paused(&t.c, (uint32_t)(act >> 3) * 1000u);
            }
            break;
        default: /* 1..32 bytes from the host */
            while (count < 1u + (act >> 3) && input.at < input.count) {
                bytes[count++] = torture_next(&input);
            }
            torture_push(&t, bytes, count);
        }
        if (act & 1) {
            torture_pull(&t, 0); /* settled, so that what is due lies in the future */
            torture_check(&t);
        }
    }
    torture_revive(&t);
    return 0;
}
