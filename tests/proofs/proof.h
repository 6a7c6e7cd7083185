/* What a proof assumes and asks of the model checker (ESBMC). A value from anything_*() may be any of its type. */
#ifndef DR_PROOF_H
#define DR_PROOF_H

#include <assert.h>
#include <stdbool.h>
#include <stdint.h>

/* The model checker knows these names; nothing defines them. */
unsigned char nondet_uchar(void);
unsigned short nondet_ushort(void);
unsigned int nondet_uint(void);
void __ESBMC_assume(bool condition);

static inline uint8_t anything_8(void) { return nondet_uchar(); }
static inline uint16_t anything_16(void) { return nondet_ushort(); }
static inline uint32_t anything_32(void) { return nondet_uint(); }
static inline void assume(bool condition) { __ESBMC_assume(condition); }

/* At the end of every proof. With DR_PROOF_MUST_FAIL it is an error to get here, so that a proof whose assumptions nothing
 * meets, which would prove anything, is found out. */
static inline void proved(void)
{
#ifdef DR_PROOF_MUST_FAIL
    assert(false);
#endif
}

#endif
