/* replay_port: a recording (dr_recording.h) against whatever is at a port: a real controller, a board, another emulator.
 *
 * The host's bytes are sent as they were recorded, with the recorded pauses, and what comes back is compared. The next command
 * waits until as many bytes have come as were recorded. It MOVES THE STAGE as the recorded program did, from wherever the stage
 * is now: so nothing is sent until a person has said that it may.
 * Thread-safety: none; it takes SIGINT, SIGTERM and SIGHUP for itself. */
#ifndef REPLAY_PORT_H
#define REPLAY_PORT_H

#include <stdbool.h>

/* Tells what differs, and goes on; then sums up, on stdout. It ends early, with a ^C where something moves, when an answer does
 * not come within three times its recorded time and two seconds, when the port fails, or by a signal, but never within a command.
 * Returns an exit status: 0 all the same; 1 something differs, the port cannot be had, or it has ended early; 2 the recording is
 * not understood or cannot be played, or !may_move: nothing was sent (stderr says why). */
int replay_port(const char *recording, const char *port, bool may_move);

#endif
