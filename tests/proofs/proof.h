/* What a proof assumes and asks of the model checker (CBMC). A value from anything_*() may be any of its type. */
#ifndef DR_PROOF_H
#define DR_PROOF_H

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>

/* The model checker knows these names; nothing defines them. */
unsigned char nondet_uchar(void);
unsigned short nondet_ushort(void);
unsigned int nondet_uint(void);
unsigned long nondet_ulong(void);
void __CPROVER_assume(_Bool condition);

static inline bool anything(void) { return (nondet_uchar() & 1u) != 0; }
static inline uint8_t anything_8(void) { return nondet_uchar(); }
static inline uint16_t anything_16(void) { return nondet_ushort(); }
static inline uint32_t anything_32(void) { return nondet_uint(); }
static inline int32_t anything_between(int32_t min, int32_t max)
{
    const int32_t value = (int32_t)nondet_uint();
    __CPROVER_assume(min <= value && value <= max);
    return value;
}
static inline void assume(bool condition) { __CPROVER_assume(condition); }

/* At the end of every proof: the one assertion that must fail. Where it cannot, nothing meets what the proof assumes, and it
 * would prove anything. */
static inline void proved(void) { assert(false); }

#endif
