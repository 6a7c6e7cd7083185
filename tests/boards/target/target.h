/* target: what a test program needs of the machine it runs on: a place to say things, an end, and a count of its work.
 * target_avr.c runs in simavr (avr_board --program), target_cortex_m.c in QEMU (semihosting), target_host.c here. */
#ifndef DR_TARGET_H
#define DR_TARGET_H

#include <stdint.h>

/* A test program's main() under another name (the build renames it): the target's own main() calls it. */
int target_main(void);

void target_put(int character);
void target_say(const char *text);
void target_say_uint(uint32_t value);
void target_say_hex(uint8_t value);

/* Work done so far, whatever it takes: AVR: clock cycles; Cortex-M: instructions; here: nothing. Exact and reproducible,
 * wraps after 2^24 at the earliest. The price of asking is not taken off. */
uint32_t target_work(void);
#define TARGET_WORK_MASK UINT32_C(0xFFFFFF)

#endif
