/* dr_log: what a guard did, as a ring of records that are chained by their CRCs.
 *
 * A ring of the owner's memory; when it is full the oldest record gives way and is counted. Whoever keeps the records can
 * show that none was changed, left out or put in. Thread-safety: one thread at a time per log. */
#ifndef DR_LOG_H
#define DR_LOG_H

#include "dr_limits.h" /* dr_us, dr_crc32c */

#ifdef __cplusplus
extern "C" {
#endif

#define DR_RECORD_TEXT 16u
#define DR_RECORD_BYTES 48u

typedef struct {
    uint32_t sequence; /* from 0 at start */
    dr_us when;
    uint8_t event;            /* dr_event of dr_guard.h */
    uint8_t before, after;    /* dr_guard_state */
    uint8_t code, axis, item; /* see the event */
    uint8_t op;               /* dr_op that it is about */
    uint8_t count;            /* of bytes; stops at 255; DR_RECORD_TEXT of them are kept */
    uint8_t bytes[DR_RECORD_TEXT];
    uint32_t position_steps[DR_AXES];
    uint32_t crc; /* CRC-32C of the record before, chained over all of this but crc */
} dr_record;

typedef struct {
    dr_record *ring;
    uint16_t size, first, count;
    uint32_t missed;        /* overwritten unread */
    uint32_t sequence, crc; /* of the next to be put in; of the last that has left */
} dr_log;

/* ring NULL or size 0: keeps nothing. */
void dr_log_init(dr_log *log, dr_record *ring, uint16_t size);
/* Numbers the record and keeps it. */
void dr_log_put(dr_log *log, dr_record *record);
/* The oldest record, completed (crc). False: there is none. */
bool dr_log_take(dr_log *log, dr_record *out);

/* The record as stored or sent: DR_RECORD_BYTES, fields in the order above, little-endian. */
void dr_record_put(const dr_record *record, uint8_t *bytes);
/* The crc that the record must have after one with crc `before` (0 before the first). */
uint32_t dr_record_crc(uint32_t before, const dr_record *record);

#ifdef __cplusplus
}
#endif
#endif
