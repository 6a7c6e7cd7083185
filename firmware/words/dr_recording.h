/* dr_recording: recordings of what went over the line, both directions, with times. One line of text each:
 *
 *     dryrig-recording 1
 *     set mpc controller mpc
 *     set mpc firmware 3.21
 *     set mpc device MP-225
 *     0.002340 0.002391 mpc > 43
 *     0.003512 0.003570 mpc < 01 80 3E 00 00 00 00 00 00 00 7D 00 00 0D
 *     0.500000 0.500061 mpc - the port has been opened
 *
 * Line 1 is the format and its version. `set NAME KEY VALUE` says what a controller was at the beginning, in the words of
 * dryrig-emu's options (controller, firmware, device, position, work, home, angle, quirks, pace); a recording of a real
 * controller says what is known of it. The others have two times in seconds: of the controller's clock and of the machine,
 * both 0 at the beginning; they differ where an emulated clock did not go as the machine's. NAME is one word: a recording
 * may hold several controllers. Behind it
 *     >  bytes from the host          <  bytes for the host
 *     !  bytes for the host that it never got: nobody had the port open
 *     -  something else that happened, in words
 * Empty lines and lines that begin with # mean nothing. A line that is torn off at the end (power, kill) is an error there;
 * all before it is good.
 *
 * Not for small boards: stdio. Errors: false, and errno or why[] says. Thread-safety: one thread at a time per file. */
#ifndef DR_RECORDING_H
#define DR_RECORDING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DR_RECORDING_VERSION 1
#define DR_RECORDING_BYTES 64u /* in one line; more make more lines of the same instant */
#define DR_RECORDING_NAME 64u
#define DR_RECORDING_LINE 512u

typedef enum {
    DR_RECORDING_SETTING = 's',
    DR_RECORDING_FROM_HOST = '>',
    DR_RECORDING_TO_HOST = '<',
    DR_RECORDING_LOST = '!',
    DR_RECORDING_EVENT = '-'
} dr_recorded_kind;

/* -- Writing: false: errno says why -------------------------------------------------------------------------------------- */

bool dr_recording_begin(FILE *file);
bool dr_recording_set(FILE *file, const char *name, const char *key, const char *value);
bool dr_recording_bytes(FILE *file, uint64_t when_us, uint64_t real_us, const char *name, dr_recorded_kind kind,
                        const uint8_t *bytes, size_t count);
bool dr_recording_event(FILE *file, uint64_t when_us, uint64_t real_us, const char *name, const char *text);

/* -- Reading ------------------------------------------------------------------------------------------------------------- */

typedef struct {
    uint8_t kind; /* dr_recorded_kind */
    uint64_t when_us, real_us;
    char name[DR_RECORDING_NAME];
    uint8_t bytes[DR_RECORDING_BYTES];
    size_t count;
    char key[32];                 /* SETTING */
    char text[DR_RECORDING_LINE]; /* SETTING: its value; EVENT */
} dr_recorded;

typedef struct {
    FILE *file;
    unsigned line;
    char why[160]; /* what is wrong with this line */
} dr_recording_reader;

/* Reads line 1. False: reader->why says what this is instead. */
bool dr_recording_open(dr_recording_reader *reader, FILE *file);
/* The next record. False: there is none; reader->why is empty at the end of the file, and says what is wrong before it. */
bool dr_recording_next(dr_recording_reader *reader, dr_recorded *out);

#ifdef __cplusplus
}
#endif
#endif
