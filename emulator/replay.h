/* replay: a recording (dr_recording.h) against the controllers that it describes.
 *
 * The host's side is played and the controllers' answers are compared, in their own time: nothing waits, no port is opened.
 * What was recorded at a real controller may have taken more or less time than here; so a command is played when the
 * answers before it are there, and not before the recorded pause is over.
 * Thread-safety: none needed. */
#ifndef REPLAY_H
#define REPLAY_H

/* Tells what differs, and goes on; then sums up, on stdout. Returns an exit status: 0 all the same, 1 something differs, 2 the
 * recording is not understood (stderr says where). */
int replay(const char *path);

#endif
