/* recording: a file of dr_recording.h that is written while something more important goes on.
 *
 * It never holds its writer up: what a pipe has no room for, because nobody reads it, is lost, and the recording says how
 * much. What cannot be written (a full disk) ends the recording. Both are said once, on stderr; every function may be
 * called afterwards. Thread-safety: one thread at a time per recording. */
#ifndef RECORDING_H
#define RECORDING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

typedef struct {
    FILE *file;                 /* NULL: none, or not any more */
    const char *program, *path; /* for messages */
    bool is_file;               /* which always has room */
    uint32_t lost;              /* lines that nobody took, since one was */
    bool told_loss;
    bool is_incomplete; /* the file could not be written */
} recording;

/* A file to be written. A pipe may wait for its reader. NULL: errno says why. */
FILE *recording_file(const char *path);

/* May it be written over? A slip must not cost a configuration or a log: only what is empty, a recording, or no file. False:
 * errno is EEXIST. */
bool recording_may_replace(const char *path);

/* Both texts stay the caller's. A pipe may wait for its reader. False: errno says why. */
bool recording_open(recording *r, const char *program, const char *path);
/* What was lost at the end is told. False: something could not be written, which stderr has been told. */
bool recording_close(recording *r);

void recording_set(recording *r, const char *name, const char *key, const char *value);
/* kind: a dr_recorded_kind of bytes. The times are those of dr_recording.h. */
void recording_bytes(recording *r, uint64_t when_us, uint64_t real_us, const char *name, char kind,
                     const uint8_t *bytes, size_t count);
void recording_event(recording *r, uint64_t when_us, uint64_t real_us, const char *name, const char *text);
/* What is kept back goes into the file: who is killed later has recorded what came before. */
void recording_flush(recording *r);

#endif
