/* guard_words: what people read about a guard: states, faults, what is missing, reasons, records.
 *
 * The words of commands and stages are dr_words'; these are about the guard's own numbers, by the same index.
 * Functions that compose text work like those of dr_words.h. Thread-safety: constant tables and functions of their
 * arguments only. */
#ifndef GUARD_WORDS_H
#define GUARD_WORDS_H

#include "dr_guard.h"
#include "rig.h"

#define GUARD_WORDS_MAX 512u /* room for every text here */

/* One word each, for programs: "armed", "wrong-end", "keep-out", "stop-released". Never NULL. */
const char *guard_words_state(uint8_t state);
const char *guard_words_fault(uint8_t fault);
const char *guard_words_reason(uint8_t reason);
const char *guard_words_event(uint8_t event);
const char *guard_words_input(uint8_t input);

/* A sentence. Empty for DR_FAULT_NONE. */
const char *guard_words_fault_says(uint8_t fault);

/* What is missing for arming, one bit each: a word, and a sentence with what to do. NULL: no such bit. */
const char *guard_words_need(unsigned bit);
const char *guard_words_need_says(unsigned bit);

/* Why, with the numbers: "leaves the travel box: Z would be at 25,000.0 um, allowed is 24,900.0 um". */
size_t guard_words_verdict(char *out, size_t room, const rig *r, const dr_verdict *verdict);
/* Quanta as microns, with their sign. */
size_t guard_words_um(char *out, size_t room, int64_t quanta);
/* What a record says, in one line. */
size_t guard_words_record(char *out, size_t room, const rig *r, const dr_record *record);

#endif
