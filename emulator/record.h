/* record: an observer that writes what went over the line into a recording (dr_recording.h).
 *
 * A pipe that nobody reads does not hold the controller up: what it has no room for is lost, and the recording says how much.
 * Thread-safety: one thread at a time per recorder. */
#ifndef RECORD_H
#define RECORD_H

#include "observe.h"   /* whose observations it keeps */
#include "recording.h" /* where they go */

typedef struct {
    observer base;
    recording to;
    uint64_t epoch_ns;
    bool has_begun;
} recorder;

/* A pipe may wait for its reader. False: errno says why. */
bool recorder_open(recorder *r, const char *path);
/* What a controller is at the beginning: called once for each, when it is set up and before anything has happened. */
void recorder_introduce(recorder *r, const char *name, const instrument *ins);
/* False: the file could not be written whole, which stderr has been told. */
bool recorder_close(recorder *r);

#endif
