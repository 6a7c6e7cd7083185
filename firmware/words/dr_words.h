/* dr_words: names and explanations. What people read about controllers, stages, commands, quirks, bytes and notes.
 *
 * The core holds numbers only; every word that a trace, an error message or a lesson says about the two protocols is
 * here, by the same index. For programs on a computer, not for small boards.
 *
 * Functions that compose text work like snprintf: they write at most `room` bytes, the closing 0 included, and return
 * the length of the whole text (a result >= room: it was cut). `out` may be NULL when room is 0. A text is one line
 * without a line feed. Lengths are given in microns and in microsteps where the stage is known, in microsteps alone
 * where it is not.
 *
 * Sources: [T] and [M] are the manuals (dr_device.h), [O] other manuals of the maker, [R] reports of users,
 * [P] PROTOCOL.md.
 * Thread-safety: constant tables and functions of their arguments only. */
#ifndef DR_WORDS_H
#define DR_WORDS_H

#include "dr_controller.h" /* dr_note, DR_QUIRK_*: its types only, nothing of it is called */
#include "dr_device.h"     /* dr_kind, dr_op, dr_stage_id */

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* -- Controllers --------------------------------------------------------------------------------------------------- */

const char *dr_words_kind(dr_kind kind);       /* as a program's argument: "trio", "mpc" */
const char *dr_words_controller(dr_kind kind); /* as on its label: "TRIO MP-245A", "MPC-200" */
/* Either of the two, whatever the case of its letters. False: no such controller. */
bool dr_words_kind_find(const char *name, dr_kind *out);

/* -- Stages -------------------------------------------------------------------------------------------------------- */

/* "MP-845"; the same for the stage of either controller. DR_STAGE_NONE: "none". */
const char *dr_words_stage(dr_stage_id id);
/* Knows every name that the manuals print for a stage of this controller. The case of letters, hyphens, and the "/M" at
 * the end do not matter. False: no such stage; "none" is not one. */
bool dr_words_stage_find(dr_kind kind, const char *name, dr_stage_id *out);
/* All names in one line: "MP-845 (also MP-845S, MP-245, ...), MP-865, ...". */
size_t dr_words_stages(char *out, size_t room, dr_kind kind);
/* Why dr_stage_fits() refuses: "MP-845 needs firmware 3.19 or later, this is 3.16". Empty when it fits. */
size_t dr_words_fit(char *out, size_t room, dr_stage_id id, dr_kind kind, uint16_t firmware, uint8_t port);

/* -- Commands ------------------------------------------------------------------------------------------------------ */

typedef struct {
    const char *name;    /* one word, unique in its controller: "home" */
    const char *asks;    /* what the host asks for: "go home" */
    const char *meaning; /* a whole sentence */
    const char *source;  /* manual and table */
} dr_command_words;

/* Never NULL: what is no command gets the words of DR_OP_NONE. */
const dr_command_words *dr_words_command(dr_op op);

/* -- Quirks: the one list of all, those of the core and those that a layer around it plays ------------------------- */

typedef enum {
    DR_QUIRK_ID_SMALL_MOVE_SILENT,
    DR_QUIRK_ID_S_NEEDS_PAUSE,
    DR_QUIRK_ID_MEASURED_SPEEDS,
    DR_QUIRK_ID_BOOT_SECOND,
    DR_QUIRK_ID_STOP_SAYS_I,
    DR_QUIRK_ID_POSITION_13,
    DR_QUIRK_ID_STREAM_AT_POWER_UP,
    DR_QUIRK_ID_NUL_HEARTBEAT,
    DR_QUIRK_ID_ENDLESS_NEGATIVE,
    DR_QUIRK_ID_PAUSE_ON_STOP,
    DR_QUIRK_ID_QUERY_WEDGES,
    DR_QUIRK_IDS
} dr_quirk_id;

typedef struct {
    const char *name;    /* as a program's argument: "small-move-silent" */
    const char *meaning; /* one line */
    const char *source;
    bool observed; /* one of those that people meet on real controllers: the set `observed` */
    bool mpc_only;
    uint16_t core; /* DR_QUIRK_*; 0: it changes bytes only and is not the core's */
} dr_quirk_words;

/* NULL: no such quirk. */
const dr_quirk_words *dr_words_quirk(dr_quirk_id id);
/* False: no such quirk; "documented" and "observed" are sets of quirks, not quirks. */
bool dr_words_quirk_find(const char *name, dr_quirk_id *out);

/* -- Numbers ------------------------------------------------------------------------------------------------------- */

/* A whole number with its thousands apart: "266,667". */
size_t dr_words_number(char *out, size_t room, uint64_t number);
/* Quanta (1/64 um) as microns, with one to four decimals, the fourth rounded: "25,000.0313". */
size_t dr_words_um(char *out, size_t room, uint64_t quanta);

/* "3.21" of 0x0321. */
size_t dr_words_firmware(char *out, size_t room, uint16_t firmware);
/* Reads "3.21". NULL, or what is wrong with the text; then *out is as it was. */
const char *dr_words_firmware_parse(const char *version_text, uint16_t *out);

/* -- Bytes into words ---------------------------------------------------------------------------------------------- */

/* Who is talking. The stage gives microns; DR_STAGE_NONE: not known. */
typedef struct {
    dr_kind kind;
    uint16_t firmware; /* binary-coded decimal */
    dr_stage_id stage;
} dr_words_context;

/* X, Y and Z: "X 1,000.0 um (16,000 steps), Y 0.0 um (0), Z 0.0 um (0)". */
size_t dr_words_point(char *out, size_t room, const dr_words_context *context, const uint32_t steps[DR_AXES]);
/* What a host asks with these bytes. They should be one whole command; if not, the text says what they are. */
size_t dr_words_request(char *out, size_t room, const dr_words_context *context, const uint8_t *bytes, size_t count);
/* What a controller answers to `op` with these bytes. */
size_t dr_words_reply(char *out, size_t room, const dr_words_context *context, dr_op op, const uint8_t *bytes,
                      size_t count);
/* What a streamed frame says [M note 16]. */
size_t dr_words_stream(char *out, size_t room, const dr_words_context *context, const uint8_t *bytes, size_t count);

/* Byte by byte, for learners: what byte `at` of a whole frame is, and what its field comes to where the byte ends one:
 * "X, byte 2 of 4: 0x3E x 256"; "X, byte 4 of 4: X = 16,000 steps = 1,000.0 um". */
size_t dr_words_request_byte(char *out, size_t room, const dr_words_context *context, const uint8_t *bytes,
                             size_t count, size_t at);
size_t dr_words_reply_byte(char *out, size_t room, const dr_words_context *context, dr_op op, const uint8_t *bytes,
                           size_t count, size_t at);
size_t dr_words_stream_byte(char *out, size_t room, const dr_words_context *context, const uint8_t *bytes, size_t count,
                            size_t at);

/* -- Notes --------------------------------------------------------------------------------------------------------- */

/* One word for the kind of a note: "request", "arrived". Never NULL. */
const char *dr_words_note_name(dr_note_kind kind);
/* What happened, in one line. context->stage is the stage of the note's drive. */
size_t dr_words_note(char *out, size_t room, const dr_words_context *context, const dr_note *note);

#ifdef __cplusplus
}
#endif
#endif
