/* The bridge's host is a serial port on the Pico's USB; UART 0 (GP0, GP1) goes to the controller, UART 1 (GP4) tells the log. The
 * configurations are the last two sectors of the flash. */
#include "bridge_port.h"

#include "hardware/flash.h"
#include "hardware/gpio.h"
#include "hardware/uart.h"
#include "hardware/watchdog.h"
#include "tusb.h"

#include <string.h>

/* -- Lines --------------------------------------------------------------------------------------------------------- */

static uart_inst_t *const uarts[DR_LINES] = {[DR_LINE_DEVICE] = uart0, [DR_LINE_LOG] = uart1};

void dr_port_line_open(dr_line line, uint32_t baud)
{
    if (line == DR_LINE_HOST) {
        (void)tusb_init();
        return;
    }
    (void)uart_init(uarts[line], baud);
    gpio_set_function(line == DR_LINE_DEVICE ? 0 : 4, GPIO_FUNC_UART);
    if (line == DR_LINE_DEVICE)
        gpio_set_function(1, GPIO_FUNC_UART);
}

/* A UART holds 32 bytes, 2.5 ms at 128000 baud, which is longer than any round of the loop: no interrupt is needed. */
static size_t read_uart(uart_inst_t *uart, uint8_t *bytes, size_t room, bool *lost)
{
    size_t count = 0;
    while (count < room && uart_is_readable(uart)) {
        const uint32_t data = uart_get_hw(uart)->dr;
        if ((data & (UART_UARTDR_OE_BITS | UART_UARTDR_FE_BITS | UART_UARTDR_BE_BITS)) != 0)
            *lost = true;
        if ((data & (UART_UARTDR_FE_BITS | UART_UARTDR_BE_BITS)) == 0)
            bytes[count++] = (uint8_t)data;
    }
    return count;
}

size_t dr_port_line_read(dr_line line, uint8_t *bytes, size_t room, bool *lost)
{
    if (line != DR_LINE_HOST)
        return read_uart(uarts[line], bytes, room, lost);
    tud_task();
    return tud_cdc_read(bytes, (uint32_t)room);
}

size_t dr_port_line_room(dr_line line)
{
    if (line == DR_LINE_HOST)
        return tud_cdc_connected() ? tud_cdc_write_available() : CFG_TUD_CDC_TX_BUFSIZE;
    return uart_is_writable(uarts[line]) ? 1 : 0;
}

void dr_port_line_write(dr_line line, const uint8_t *bytes, size_t count)
{
    if (count > 0 && line != DR_LINE_HOST) {
        uart_get_hw(uarts[line])->dr = bytes[0];
    } else if (count > 0 && tud_cdc_connected()) {
        (void)tud_cdc_write(bytes, (uint32_t)count);
        (void)tud_cdc_write_flush();
    }
}

bool dr_port_line_is_sent(dr_line line)
{
    return line == DR_LINE_HOST || (uart_get_hw(uarts[line])->fr & UART_UARTFR_BUSY_BITS) == 0;
}

bool dr_port_host_is_open(void) { return tud_cdc_connected(); }

/* -- Configuration ------------------------------------------------------------------------------------------------- */

void dr_port_configuration(uint8_t which, uint8_t *image, size_t size)
{
    const uint32_t first = PICO_FLASH_SIZE_BYTES - DR_PORT_CONFIGURATIONS * FLASH_SECTOR_SIZE;
    memcpy(image, (const uint8_t *)(XIP_BASE + first + which * FLASH_SECTOR_SIZE), size);
}

/* -- When the program stands still ---------------------------------------------------------------------------------- */

volatile dr_survivor *dr_port_survivor(void)
{
    static dr_survivor __uninitialized_ram(survivor);
    return &survivor;
}

void dr_port_watchdog_start(void) { watchdog_enable(100, true); } /* ms; it stands while a debugger does */
void dr_port_watchdog_feed(void) { watchdog_update(); }

#define CANARY 0xC0DEBA5Eu
extern uint32_t __StackBottom; /* of the SDK's linker script */

bool dr_port_stack_holds(void)
{
    static bool is_set;
    volatile uint32_t *const lowest = &__StackBottom;
    if (!is_set)
        *lowest = CANARY;
    is_set = true;
    return *lowest == CANARY;
}

int main(void)
{
    dr_bridge_begin();
    for (;;)
        dr_bridge_step();
}
