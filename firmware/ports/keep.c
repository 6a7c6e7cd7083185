#include "keep.h"

/* A record: format, serial number (2), controller, number of drives; then for each drive its stage, flags, position and
 * work position; then home and angle; then the check sum (4). Numbers least significant byte first, coordinates in three
 * bytes, as in the frames of a stream: no travel needs more. */
#define FORMAT 1u
#define HEAD_BYTES 5u
#define POINT_BYTES 9u
#define DRIVE_BYTES (2u + 2u * POINT_BYTES)
#define TAIL_BYTES (POINT_BYTES + 1u)
#define CHECK_BYTES 4u
#define WORK_IS_SET 1u
#define CALIBRATION_SHIFT 1u

typedef char
    a_record_fits_a_slot[HEAD_BYTES + DR_PORTS * DRIVE_BYTES + TAIL_BYTES + CHECK_BYTES <= DR_PORT_SLOT_BYTES ? 1 : -1];

static size_t record_bytes(uint8_t drive_count)
{
    return HEAD_BYTES + (size_t)drive_count * DRIVE_BYTES + TAIL_BYTES + CHECK_BYTES;
}

static uint8_t *put_uint(uint8_t *bytes, uint32_t value, uint8_t count)
{
    for (uint8_t i = 0; i < count; i++)
        *bytes++ = (uint8_t)(value >> (8u * i));
    return bytes;
}

static uint32_t get_uint(const uint8_t *bytes, uint8_t count)
{
    uint32_t value = 0;
    for (uint8_t i = 0; i < count; i++)
        value |= (uint32_t)bytes[i] << (8u * i);
    return value;
}

static uint8_t *put_point(uint8_t *bytes, const uint32_t steps[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        bytes = put_uint(bytes, steps[axis], 3);
    return bytes;
}

static void get_point(const uint8_t *bytes, uint32_t steps[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        steps[axis] = get_uint(bytes + 3u * axis, 3);
}

/* CRC-32, reflected, polynomial 0x04C11DB7: a record that was half written passes once in 4 thousand million times. */
static uint32_t check_sum(const uint8_t *bytes, size_t count)
{
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (uint8_t bit = 0; bit < 8; bit++)
            crc = (crc & 1u) != 0 ? crc >> 1 ^ UINT32_C(0xEDB88320) : crc >> 1;
    }
    return ~crc;
}

static size_t encode(const dr_controller *c, uint16_t serial, uint8_t *record)
{
    uint8_t *at = record;
    *at++ = FORMAT;
    at = put_uint(at, serial, 2);
    *at++ = c->kind;
    *at++ = c->drive_count;
    for (uint8_t i = 0; i < c->drive_count; i++) {
        const dr_drive *drive = &c->drives[i];
        *at++ = drive->stage;
        *at++ = (uint8_t)((uint8_t)(drive->calibration << CALIBRATION_SHIFT) | (drive->work_is_set ? WORK_IS_SET : 0u));
        at = put_point(at, drive->position_steps);
        at = put_point(at, drive->work_steps);
    }
    at = put_point(at, c->home_steps);
    *at++ = c->angle_deg;
    at = put_uint(at, check_sum(record, (size_t)(at - record)), CHECK_BYTES);
    return (size_t)(at - record);
}

/* Is it a whole record of this controller with these stages? */
static bool is_record_of(const dr_controller *c, const uint8_t *record)
{
    const size_t checked = record_bytes(c->drive_count) - CHECK_BYTES;
    if (record[0] != FORMAT || record[3] != c->kind || record[4] != c->drive_count)
        return false;
    for (uint8_t i = 0; i < c->drive_count; i++)
        if (record[HEAD_BYTES + (size_t)i * DRIVE_BYTES] != c->drives[i].stage)
            return false;
    return get_uint(record + checked, CHECK_BYTES) == check_sum(record, checked);
}

static void decode(dr_controller *c, const uint8_t *record)
{
    const uint8_t *at = record + HEAD_BYTES;
    for (uint8_t i = 0; i < c->drive_count; i++, at += DRIVE_BYTES) {
        dr_drive *drive = &c->drives[i];
        drive->work_is_set = (at[1] & WORK_IS_SET) != 0u;
        drive->calibration = at[1] >> CALIBRATION_SHIFT;
        get_point(at + 2, drive->position_steps);
        get_point(at + 2 + POINT_BYTES, drive->work_steps);
    }
    get_point(at, c->home_steps);
    c->angle_deg = at[POINT_BYTES];
}

bool dr_keep_load(dr_keep *keep, dr_controller *c)
{
    bool found = false;
    const uint16_t slots = dr_port_slots();
    *keep = (dr_keep){.newest = (uint16_t)(slots - 1u)};
    for (uint16_t slot = 0; slot < slots; slot++) {
        dr_port_slot_read(slot, keep->record, record_bytes(c->drive_count));
        const uint16_t serial = (uint16_t)get_uint(keep->record + 1, 2);
        /* Serial numbers wrap, and neighbours in time are never far apart. */
        if (!is_record_of(c, keep->record) || (found && (uint16_t)(serial - keep->serial) > INT16_MAX))
            continue;
        found = true;
        keep->newest = slot;
        keep->serial = serial;
        decode(c, keep->record);
    }
    return found;
}

void dr_keep_touch(dr_keep *keep, dr_us now)
{
    keep->is_changed = true;
    keep->since = now;
}

static bool is_as_kept(const dr_keep *keep, size_t count)
{
    uint8_t kept[DR_PORT_SLOT_BYTES];
    dr_port_slot_read(keep->newest, kept, count);
    for (size_t i = 0; i < count; i++)
        if (kept[i] != keep->record[i])
            return false;
    return true;
}

bool dr_keep_step(dr_keep *keep, const dr_controller *c, dr_us now, dr_us *when)
{
    *when = now;
    if (dr_port_slots() == 0)
        return false;
    if (keep->is_writing) {
        const size_t count = record_bytes(c->drive_count);
        const uint16_t next = (uint16_t)((keep->newest + 1u) % dr_port_slots());
        if (dr_port_slot_write(next, keep->record, count)) {
            keep->newest = next;
            const bool holds = is_as_kept(keep, count);
            if (holds)
                keep->serial++;
            keep->tries = holds ? 0u : (uint16_t)(keep->tries + 1u);
            keep->is_writing = !holds && keep->tries < dr_port_slots(); /* worn out: the next one */
        }
        return true;
    }
    if (!keep->is_changed)
        return false;
    const bool is_moving = c->state == DR_STATE_MOVING;
    if (is_moving || keep->is_moving)
        keep->since = now; /* the second begins when the move has ended */
    keep->is_moving = is_moving;
    *when = keep->since + DR_KEEP_AFTER_US;
    if (dr_us_before(now, *when))
        return true;
    keep->is_changed = false;
    if (!is_as_kept(keep, encode(c, keep->serial, keep->record))) {
        (void)encode(c, (uint16_t)(keep->serial + 1u), keep->record);
        keep->is_writing = true;
    }
    *when = now;
    return keep->is_writing;
}
