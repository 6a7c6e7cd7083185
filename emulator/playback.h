/* playback: the controller's side of a recording (dr_recording.h), for a host program at a pseudo-terminal.
 *
 * The host leads: when it has made the recorded request, the recorded answer follows, as much later as it did then. The
 * clock stands before somebody has opened the port, and while a request is still to come.
 *
 * Another request than the recorded one is told on stderr, with both, and so is where it goes on: the one before, made once
 * more, is answered once more; else at the next recorded one that is the same, and what is between is left out; else the
 * same command with other values gets the recorded answer; else there is none.
 * Thread-safety: none needed. */
#ifndef PLAYBACK_H
#define PLAYBACK_H

#include <stdbool.h>

typedef struct {
    const char *path; /* of the recording */
    const char *link; /* stable name of the port; NULL: none */
    unsigned speedup; /* how much shorter the answers take; 1 or more */
    bool jumps;       /* they take no time; nothing is sent while the host has not read */
} playback_options;

/* Runs until the recording is through and the host has closed the port, or until a signal. Returns an exit status: 0 the host
 * made the recorded requests, and no others; 1 it did not, or there is no port; 2 the recording is not understood. */
int playback(const playback_options *o);

#endif
