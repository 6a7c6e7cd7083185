#include "Dryrig.h"

DryrigEmulator Dryrig;

static Stream *host;
static uint8_t chosen;

void DryrigEmulator::begin(Stream &line, dr_kind kind, uint8_t straps)
{
    host = &line;
    chosen = (uint8_t)((straps & (DR_STRAP_STAGES | DR_STRAP_KEEP)) | (kind == DR_MPC ? DR_STRAP_OTHER : 0)); /* than a TRIO */
    dr_emulator_begin();
}

uint8_t dr_port_begin(void) { return chosen; }
void dr_port_open(uint32_t) {}
dr_us dr_port_now_us(void) { return micros(); }
bool dr_port_waits(void) { return false; }
void dr_port_wait(bool, dr_us) {}

size_t dr_port_read(uint8_t *bytes, size_t room)
{
    size_t count = 0;
    while (count < room && host->available() > 0)
        bytes[count++] = (uint8_t)host->read();
    return count;
}

/* A class that does not tell its room says 0; then one byte is tried, and may wait. */
size_t dr_port_room(void)
{
    const int room = host->availableForWrite();
    return room > 0 ? (size_t)room : 1;
}

void dr_port_write(const uint8_t *bytes, size_t count)
{
    if (count > 0)
        (void)host->write(bytes, count);
}

/* A UART has one and USB has none: kept in software it is right for both. */
bool dr_port_has_pace(void) { return false; }

#ifndef __AVR__ /* no memory that every core has */
uint16_t dr_port_slots(void) { return 0; }
void dr_port_slot_read(uint16_t, uint8_t *, size_t) {}
bool dr_port_slot_write(uint16_t, const uint8_t *, size_t) { return true; }
#endif
