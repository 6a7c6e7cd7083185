/* journal: keeps what a guard did: the last records in memory, and all of them in a file.
 *
 * The file is a text, one line a record: time, event, words, and '#' with the record's DR_RECORD_BYTES in hexadecimal,
 * which are chained by their CRCs: a reader finds lines that were changed, left out or put in.
 * Thread-safety: one thread at a time per journal. */
#ifndef JOURNAL_H
#define JOURNAL_H

#include "dr_guard.h"
#include "rig.h"

#include <stdio.h>

#define JOURNAL_KEPT 500u /* records in memory */
#define JOURNAL_TIME_MAX 32u

typedef struct {
    uint64_t wall_us; /* since 1970 */
    dr_record record;
} journal_entry;

typedef struct {
    int fd;              /* -1: no file */
    bool has_failed;     /* the file could not be written */
    const char *created; /* a file that was not there before; it goes if nothing is ever written */
    uint64_t count;      /* entries so far; the last JOURNAL_KEPT are kept */
    journal_entry kept[JOURNAL_KEPT];
} journal;

/* path NULL: in memory only; it stays the caller's. A file is appended to. False: errno says why;
 * EBUSY: another guard writes it, and two chains of records would be none. */
bool journal_open(journal *j, const char *path);
void journal_close(journal *j);
/* False, from then on: the file cannot be written (errno says why); tries again at the next record. */
bool journal_add(journal *j, const rig *r, const dr_record *record, uint64_t wall_us);
/* After a failure: is there room again? As above; an empty line is nothing to its readers. */
bool journal_retry(journal *j);
/* The n-th last entry, from 0. NULL: there is none. */
const journal_entry *journal_last(const journal *j, uint64_t n);

/* "2026-05-04T13:02:01.123456Z" */
void journal_time(char text[JOURNAL_TIME_MAX], uint64_t wall_us);
/* out has room for 2 * DR_RECORD_BYTES + 1. */
void journal_hex(char *out, const dr_record *record);

/* -- Reading a file that a journal has written -------------------------------------------------------------------------- */

typedef struct {
    FILE *file;
    const char *path;
    char *text; /* the line */
    size_t room;
    uint64_t line, records, starts; /* so far; starts: of guards */
    uint32_t sequence, crc;         /* of the next record; of the last */
    char why[RIG_WHY_MAX];          /* what is wrong with this line: the chain breaks here */
} journal_reader;

/* False: why[] says what the system says. */
bool journal_start_reading(journal_reader *r, const char *path);
/* The next record. False: there is none; why[] is empty at the end of the file, and says what is wrong before it. */
bool journal_read(journal_reader *r, dr_record *out);
void journal_stop_reading(journal_reader *r);

#endif
