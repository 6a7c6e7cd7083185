/* Raspberry Pi Pico (RP2040): the line is a serial port on its USB, the memory two sectors of its flash. */
#include "emulator.h"
#include "hands.h"
#include "port.h"

#include "hardware/flash.h"
#include "hardware/gpio.h"
#include "hardware/sync.h"
#include "hardware/timer.h"
#include "pico/time.h"
#include "tusb.h"

#include <string.h>

static const uint8_t strap_pins[] = {2, 3, 4, 5}; /* GP numbers; DR_STRAP_* from the lowest bit on, closed to ground */

#define FIRST_INPUT 6u                         /* GP6 to GP21 */
static const uint8_t output_pins[] = {26, 25}; /* GP26, and the LED */

uint8_t dr_port_begin(void)
{
    uint8_t straps = 0;
    for (uint8_t i = 0; i < sizeof strap_pins; i++) {
        gpio_init(strap_pins[i]);
        gpio_pull_up(strap_pins[i]);
    }
    busy_wait_us(100); /* the pull-ups against the pins' capacitance */
    for (uint8_t i = 0; i < sizeof strap_pins; i++)
        if (!gpio_get(strap_pins[i]))
            straps = (uint8_t)(straps | 1u << i);
    return straps;
}

void dr_port_open(uint32_t baud)
{
    (void)baud;
    (void)tusb_init();
}

dr_us dr_port_now_us(void) { return time_us_32(); }

/* TinyUSB wants to be called all the time. */
bool dr_port_waits(void) { return false; }

void dr_port_wait(bool has_end, dr_us until)
{
    (void)has_end;
    (void)until;
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

/* -- Inputs and outputs -------------------------------------------------------------------------------------------- */

uint16_t dr_port_inputs(void)
{
    static bool are_ready;
    for (uint8_t pin = FIRST_INPUT; !are_ready && pin < FIRST_INPUT + DR_PORT_INPUTS; pin++) {
        gpio_init(pin);
        gpio_pull_up(pin);
    }
    if (!are_ready)
        busy_wait_us(100);
    are_ready = true;
    return (uint16_t)(~gpio_get_all() >> FIRST_INPUT);
}

void dr_port_outputs(uint8_t high)
{
    for (uint8_t i = 0; i < sizeof output_pins; i++) {
        gpio_init(output_pins[i]);
        gpio_set_dir(output_pins[i], GPIO_OUT);
        gpio_put(output_pins[i], (high >> i & 1u) != 0);
    }
}

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
