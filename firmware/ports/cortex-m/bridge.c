/* The bridge's lines are UARTs 0, 1 and 2; its configurations lie in flash, at addresses of their own. */
#include "bridge_port.h"

#include "startup.h"
#include "uarts.h"

#include <string.h>

/* -- Lines --------------------------------------------------------------------------------------------------------- */

static dr_us written[DR_LINES];
static uint32_t byte_us[DR_LINES];

void dr_port_line_open(dr_line line, uint32_t baud)
{
    byte_us[line] = DR_US_PER_S * DR_BITS_PER_BYTE / baud + 1u;
    uart_open((uint8_t)line, baud);
}

size_t dr_port_line_read(dr_line line, uint8_t *bytes, size_t room, bool *lost)
{
    return uart_read((uint8_t)line, bytes, room, lost);
}

size_t dr_port_line_room(dr_line line) { return uart_room((uint8_t)line); }

void dr_port_line_write(dr_line line, const uint8_t *bytes, size_t count)
{
    if (count > 0)
        written[line] = dr_port_now_us();
    uart_write((uint8_t)line, bytes, count);
}

/* A CMSDK UART does not tell when its last bit has left: it has room for the next byte before. */
bool dr_port_line_is_sent(dr_line line)
{
    return uart_room((uint8_t)line) > 0 && dr_port_now_us() - written[line] > 2u * byte_us[line];
}

bool dr_port_host_is_open(void) { return (dr_port_inputs() >> 9 & 1u) != 0; }

/* -- Configuration ------------------------------------------------------------------------------------------------- */

#define CONFIGURATIONS 0x00380000u
#define CONFIGURATION_APART 0x1000u

void dr_port_configuration(uint8_t which, uint8_t *image, size_t size)
{
    memcpy(image, (const uint8_t *)(uintptr_t)(CONFIGURATIONS + which * CONFIGURATION_APART), size);
}

/* -- When the program stands still ---------------------------------------------------------------------------------- */

#define WATCHDOG_RELOAD REGISTER(0x40008000u)
#define WATCHDOG_CONTROL REGISTER(0x40008008u)
#define WATCHDOG_CLEAR REGISTER(0x4000800Cu) /* and begins anew */
#define WATCHDOG_ON 3u                       /* at 0 an interrupt (dr_fault), at the next 0 a reset */

volatile dr_survivor *dr_port_survivor(void)
{
    static dr_survivor survivor __attribute__((section(".noinit")));
    return &survivor;
}

void dr_port_watchdog_start(void)
{
    WATCHDOG_RELOAD = CLOCK_HZ / 20u; /* 50 ms, twice */
    WATCHDOG_CONTROL = WATCHDOG_ON;
}

void dr_port_watchdog_feed(void) { WATCHDOG_CLEAR = 1; }

#define CANARY 0xC0DEBA5Eu
extern uint32_t dr_canary; /* of the linker script: above the variables, far below the stack */

bool dr_port_stack_holds(void)
{
    static bool is_set;
    if (!is_set)
        dr_canary = CANARY;
    is_set = true;
    return dr_canary == CANARY;
}

int main(void)
{
    dr_bridge_begin();
    for (;;)
        dr_bridge_step();
}
