/* trace: what happens in an instrument, in words: a line per command, per reply, per group of streamed positions and per
 * event. Times are seconds of the controller's clock.
 *
 *     0.002340 > 43                        position? ...          from the host
 *     0.002340 < 01 80 3E 00 00 ... 0D     drive 1 is at ...      to the host, when it is ready
 *     0.100000 - drive 1 runs to ...                              an event
 *
 * Thread-safety: one thread at a time per trace. */
#ifndef TRACE_H
#define TRACE_H

#include "instrument.h" /* whose notes it tells */

#include <stdio.h>

#define TRACE_NOTES 64u

typedef struct {
    FILE *file;
    const char *name; /* for messages */
    dr_notes notes;
    dr_note ring[TRACE_NOTES];
    dr_note streamed; /* the last of the group of streamed positions that is under way */
    uint32_t streamed_count;
    uint32_t missed; /* notes that did not fit the ring, told so far */
} trace;

/* Opens a file, or stderr where path is "-", and makes the instrument write notes. False: errno says why. */
bool trace_open(trace *t, const char *path, instrument *ins);
void trace_close(trace *t);
/* Tells what the instrument has noted, or, when the file is no more, forgets it. Call it whenever instrument_run() has returned true. */
void trace_tell(trace *t, const instrument *ins);
/* Tells an event that is not the controller's. */
void trace_event(trace *t, const instrument *ins, const char *text);

#endif
