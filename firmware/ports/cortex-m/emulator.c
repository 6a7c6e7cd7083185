/* The emulator's line is UART 0. */
#include "emulator.h"
#include "port.h"

#include "uarts.h"

void dr_port_open(uint32_t baud) { uart_open(0, baud); }

size_t dr_port_read(uint8_t *bytes, size_t room)
{
    bool lost;
    return uart_read(0, bytes, room, &lost);
}

size_t dr_port_room(void) { return uart_room(0); }
void dr_port_write(const uint8_t *bytes, size_t count) { uart_write(0, bytes, count); }

/* QEMU's UART has none. That of a chip has. */
bool dr_port_has_pace(void) { return false; }

/* -- Memory: this board has none that survives ----------------------------------------------------------------------- */

uint16_t dr_port_slots(void) { return 0; }
void dr_port_slot_read(uint16_t slot, uint8_t *bytes, size_t count)
{
    (void)slot;
    (void)bytes;
    (void)count;
}
bool dr_port_slot_write(uint16_t slot, const uint8_t *bytes, size_t count)
{
    (void)slot;
    (void)bytes;
    (void)count;
    return true;
}

int main(void)
{
    dr_emulator_begin();
    for (;;)
        dr_emulator_step();
}
