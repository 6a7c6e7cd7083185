/* reports: what is written about a run: its trace, its recording, and which rules the host has broken.
 *
 * What cannot be written whole is said on stderr when that is known, and once more in what reports_finish() returns.
 * Thread-safety: one thread. */
#ifndef REPORTS_H
#define REPORTS_H

#include "lint.h"    /* which rules the host breaks */
#include "options.h" /* which reports are wanted, and where */
#include "record.h"  /* the bytes of the line, kept */
#include "station.h" /* whom they observe */
#include "trace.h"   /* what happens, in words */

#include <stdio.h>

typedef struct {
    const options *o;
    trace trace;
    recorder recorder;
    lint lint;
    FILE *lint_json, *lint_junit;
    observer_link *links; /* of each station, three */
    bool is_incomplete;
} reports;

/* Opens what o asks for, and begins to observe. False: stderr says which one there cannot be; reports_finish() comes all the
 * same. */
bool reports_open(reports *r, const options *o, station *stations, unsigned station_count);
/* Nothing more will happen: trace and recording are closed. */
void reports_stop(reports *r);
/* Tells what the lint has found, and closes. *findings: how many. False: not everything could be written. */
bool reports_finish(reports *r, unsigned long *findings);

#endif
