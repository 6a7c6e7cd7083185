/* retell: a guard's log as a recording (dr_recording.h) of the controller's line, for `dryrig-emu replay`.
 *
 * The log has what the line carried: the guard's own queries are known by their answers, the end of a motion by its CR; a
 * motion's frame left when the state became "moving", and one that was withdrawn is not told. Streamed positions are not in
 * the log, and no more than 16 bytes of what nobody asked for.
 * Thread-safety: none needed. */
#ifndef RETELL_H
#define RETELL_H

#include "journal.h"
#include "rig.h"

#include <stdio.h>

/* Writes what the log tells of all starts with this configuration; each is a controller of its own in the recording. False:
 * there is no such start, or the log breaks (reader->why), or the file cannot be written (errno); why[] says it. */
bool retell(journal_reader *reader, const rig *r, FILE *to, char *why, size_t room);

#endif
