/* torture: a controller that is treated badly, and what must hold of it all the same. Shared by the libFuzzer harness and
 * by the seeded streams. A breach ends the program, so that a sanitizer's or a fuzzer's usual machinery tells where. */
#ifndef TORTURE_H
#define TORTURE_H

#include "dr_controller.h"

typedef struct {
    dr_controller c;
    dr_drive drives[DR_PORTS];
    dr_note ring[8];
    dr_notes notes;
    dr_us now;
} torture;

/* A source of decisions: the next byte of a fuzzer's input, or of a random generator. */
typedef struct {
    const uint8_t *bytes;
    size_t count, at;
} torture_input;

uint8_t torture_next(torture_input *input); /* 0 when it is used up */

/* A controller of a kind, firmware, stages, positions and quirks that the input decides, switched on. */
void torture_begin(torture *t, torture_input *input);
/* Invariants, checked on the struct and through the public functions. */
void torture_check(const torture *t);
/* The same, for the quick ones after every byte. */
void torture_check_quick(const torture *t);
void torture_push(torture *t, const uint8_t *bytes, size_t count);
/* Takes at most so many bytes. */
void torture_pull(torture *t, size_t room);
/* Some hand does something. */
void torture_poke(torture *t, torture_input *input);
/* Goes to the next due instant, if there is one. */
void torture_wait(torture *t);
/* A power cycle brings back a controller that answers a position query with 14 right bytes. */
void torture_revive(torture *t);

#endif
