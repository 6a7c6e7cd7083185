/* The EEPROM of an AVR as the memory that survives power-off. (Nothing, on another machine: the Arduino library has it.) */
#include "port.h"

#ifdef __AVR__
#include <avr/eeprom.h>
#include <avr/io.h>

uint16_t dr_port_slots(void) { return (E2END + 1u) / DR_PORT_SLOT_BYTES; }

static uint8_t *address(uint16_t slot) { return (uint8_t *)(slot * DR_PORT_SLOT_BYTES); }

void dr_port_slot_read(uint16_t slot, uint8_t *bytes, size_t count) { eeprom_read_block(bytes, address(slot), count); }

/* A byte takes 3.4 ms, which is longer than the line may be left alone: one a call, and only when the last one is done. */
bool dr_port_slot_write(uint16_t slot, const uint8_t *bytes, size_t count)
{
    static uint8_t at;
    if (!eeprom_is_ready())
        return false;
    if (at == count) {
        at = 0;
        return true;
    }
    eeprom_update_byte(address(slot) + at, bytes[at]);
    at++;
    return false;
}
#endif
