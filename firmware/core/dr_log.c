#include "dr_log.h"

#define CRC_BYTES 4u

static uint8_t *put_uint(uint8_t *bytes, uint32_t value)
{
    for (uint8_t i = 0; i < 4; i++, value >>= 8)
        *bytes++ = (uint8_t)value;
    return bytes;
}

void dr_record_put(const dr_record *record, uint8_t *bytes)
{
    const uint8_t codes[] = {record->event, record->before, record->after, record->code,
                             record->axis,  record->item,   record->op,    record->count};
    bytes = put_uint(bytes, record->sequence);
    bytes = put_uint(bytes, record->when);
    for (uint8_t i = 0; i < sizeof codes; i++)
        *bytes++ = codes[i];
    for (uint8_t i = 0; i < DR_RECORD_TEXT; i++)
        *bytes++ = record->bytes[i];
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        bytes = put_uint(bytes, record->position_steps[axis]);
    (void)put_uint(bytes, record->crc);
}

uint32_t dr_record_crc(uint32_t before, const dr_record *record)
{
    uint8_t bytes[DR_RECORD_BYTES];
    dr_record_put(record, bytes);
    return dr_crc32c(before, bytes, DR_RECORD_BYTES - CRC_BYTES);
}

void dr_log_init(dr_log *log, dr_record *ring, uint16_t size)
{
    *log = (dr_log){ring, ring == NULL ? (uint16_t)0 : size, 0, 0, 0, 0, 0};
}

/* A record is chained when it leaves: nothing waits for that while a stop is under way. */
static void chain(dr_log *log, dr_record *oldest) { oldest->crc = log->crc = dr_record_crc(log->crc, oldest); }

static dr_record *drop_oldest(dr_log *log)
{
    dr_record *const oldest = &log->ring[log->first];
    chain(log, oldest);
    log->first = (uint16_t)(log->first + 1u < log->size ? log->first + 1u : 0u);
    log->count--;
    return oldest;
}

void dr_log_put(dr_log *log, dr_record *record)
{
    record->sequence = log->sequence++;
    if (log->size == 0) {
        chain(log, record);
        log->missed++;
        return;
    }
    if (log->count == log->size) {
        (void)drop_oldest(log);
        log->missed++;
    }
    const uint32_t at = (uint32_t)log->first + log->count;
    log->ring[at < log->size ? at : at - log->size] = *record;
    log->count++;
}

bool dr_log_take(dr_log *log, dr_record *out)
{
    if (log->count == 0)
        return false;
    *out = *drop_oldest(log);
    return true;
}
