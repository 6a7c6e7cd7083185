/* first: what is done when the controllers start: the lines of a rig file, scenarios, --do, in this order. They are checked
 * before anything starts.
 *
 * Thread-safety: one thread. */
#ifndef FIRST_H
#define FIRST_H

#include "options.h" /* who says what */
#include "script.h"  /* scenarios */

typedef struct {
    const options *o;
    script *scripts; /* of the rig's members, then the command line's */
    unsigned script_count;
} first;

/* Reads the scenarios, and looks whether all lines could be carried out. False: stderr says which one could not. */
bool first_check(first *f, const options *o, language *l);
/* Carries them out. False: stderr says which one cannot be. */
bool first_do(const first *f, language *l);
void first_close(first *f);

#endif
