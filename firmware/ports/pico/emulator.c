/* The emulator's line is a serial port on the Pico's USB, its memory two sectors of the flash. */
#include "emulator.h"
#include "hands.h"
#include "port.h"

#include "hardware/flash.h"
#include "hardware/sync.h"
#include "tusb.h"

#include <string.h>

void dr_port_open(uint32_t baud)
{
    (void)baud;
    (void)tusb_init();
}

size_t dr_port_read(uint8_t *bytes, size_t room)
{
    tud_task();
    return tud_cdc_read(bytes, (uint32_t)room);
}

/* Not every program sets DTR, and those that do not want answers too: what nobody fetches is overwritten by what is newer,
 * and forgotten when somebody opens the port. */
size_t dr_port_room(void) { return tud_cdc_connected() ? tud_cdc_write_available() : DR_REPLY_MAX; }

void tud_cdc_line_state_cb(uint8_t port, bool dtr, bool rts)
{
    (void)port;
    (void)rts;
    if (dtr)
        (void)tud_cdc_write_clear();
}

void dr_port_write(const uint8_t *bytes, size_t count)
{
    if (count > 0) {
        (void)tud_cdc_write(bytes, (uint32_t)count);
        (void)tud_cdc_write_flush();
    }
}

bool dr_port_has_pace(void) { return false; }

/* -- Memory: the last two sectors of the flash, a page for each slot ------------------------------------------------- */

#define SECTORS 2u
#define SLOTS_PER_SECTOR (FLASH_SECTOR_SIZE / FLASH_PAGE_SIZE)
#define FIRST_BYTE (PICO_FLASH_SIZE_BYTES - SECTORS * FLASH_SECTOR_SIZE)

uint16_t dr_port_slots(void) { return SECTORS * SLOTS_PER_SECTOR; }

void dr_port_slot_read(uint16_t slot, uint8_t *bytes, size_t count)
{
    memcpy(bytes, (const uint8_t *)(XIP_BASE + FIRST_BYTE + slot * FLASH_PAGE_SIZE), count);
}

/* Nothing runs from flash meanwhile, interrupts included: some 0.4 ms for a page, some 45 ms more at the start of a sector.
 * The controller is at rest then, and USB's own hardware makes the host wait. */
bool dr_port_slot_write(uint16_t slot, const uint8_t *bytes, size_t count)
{
    static uint8_t page[FLASH_PAGE_SIZE];
    const uint32_t at = FIRST_BYTE + slot * FLASH_PAGE_SIZE;
    memset(page, 0xFF, sizeof page);
    memcpy(page, bytes, count);
    const uint32_t interrupts = save_and_disable_interrupts();
    if (slot % SLOTS_PER_SECTOR == 0)
        flash_range_erase(at, FLASH_SECTOR_SIZE);
    flash_range_program(at, page, sizeof page);
    restore_interrupts(interrupts);
    return true;
}

int main(void)
{
    EMULATOR_HANDS ? dr_hands_begin() : dr_emulator_begin();
    for (;;)
        EMULATOR_HANDS ? dr_hands_step() : dr_emulator_step();
}
