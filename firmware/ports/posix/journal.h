/* journal: keeps what a guard did: the last records in memory, and all of them in a file.
 *
 * The file is a text, one line a record: time, event, words, and '#' with the record's DR_RECORD_BYTES in hexadecimal,
 * which are chained by their CRCs; journal_verify() finds lines that were changed, left out or put in.
 * Thread-safety: one thread at a time per journal. */
#ifndef JOURNAL_H
#define JOURNAL_H

#include "dr_guard.h"
#include "rig.h"

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

/* path NULL: in memory only; it stays the caller's. A file is appended to. False: errno says why. */
bool journal_open(journal *j, const char *path);
void journal_close(journal *j);
/* False, from then on: the file cannot be written (errno says why); tries again at the next record. */
bool journal_add(journal *j, const rig *r, const dr_record *record, uint64_t wall_us);
/* The n-th last entry, from 0. NULL: there is none. */
const journal_entry *journal_last(const journal *j, uint64_t n);

/* "2026-05-04T13:02:01.123456Z" */
void journal_time(char text[JOURNAL_TIME_MAX], uint64_t wall_us);
/* out has room for 2 * DR_RECORD_BYTES + 1. */
void journal_hex(char *out, const dr_record *record);

/* Reads a file that a journal has written. False: why[] says in which line the chain breaks; or that, and errno's reason.
 * records, starts: how many there are. */
bool journal_verify(const char *path, uint64_t *records, uint64_t *starts, char *why, size_t room);

#endif
