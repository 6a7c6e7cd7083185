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

#include "observe.h" /* whose observations it tells */

#include <stdio.h>

typedef struct {
    observer base;
    FILE *file;
    const char *path; /* for messages */
    bool is_on;       /* as opened, and `trace on`, `trace off` */
    bool is_json;     /* an object a line, as `subscribe` sends them */
    bool has_names;   /* a line begins with the station's name */
    dr_note streamed; /* the last of the group of streamed positions that is under way */
    uint64_t streamed_us;
    const instrument *streaming; /* whose they are */
    const char *streaming_name;
    uint32_t streamed_count;
    const instrument *stopped; /* STOP on its ROE has just ended a move */
    uint32_t lost;             /* lines that nobody took, since one was */
    bool is_incomplete;        /* the file could not be written */
} trace;

/* Opens a file, or stderr where path is "-"; one whose name ends in .jsonl gets JSON lines. False: errno says why. */
bool trace_open(trace *t, const char *path, bool has_names);
/* False: the file could not be written whole, which stderr has been told. */
bool trace_close(trace *t);

#endif
