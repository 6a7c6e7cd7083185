/* hostile: a host that does what it can to make the guard let something unsafe through, on rigs of every kind.
 *
 * One session is one rig (bench.h, its monitors running): a controller, stages, places, quirks and tight limits that chance
 * decides, armed; then acts, each one frame or what is left of it, at any time, with a person who arms again. Chance is a
 * random generator (test_hostile.c) or the input of a fuzzer (fuzz_guard.c). */
#ifndef HOSTILE_H
#define HOSTILE_H

#include "bench.h"

typedef struct {
    const uint8_t *bytes; /* decide what happens; NULL: the generator does */
    size_t count, at;
    uint64_t state;
} chance;

/* Any number below n; n >= 1. 0 where the bytes are used up. */
uint32_t any_below(chance *c, uint32_t n);

/* A rig, armed. lies: the controller's bytes get lost, change or come unasked; M3 is then not watched, as the guard cannot
 * know better than the controller where the tip is. */
void hostile_begin(chance *c, bool lies);
void hostile_act(chance *c);

#endif
