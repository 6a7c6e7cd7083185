#include "uarts.h"

#include "startup.h" /* the interrupts */

#define UART(n) (0x40004000u + (n)*0x1000u)
#define UART_DATA(n) REGISTER(UART(n) + 0x00u)
#define UART_STATE(n) REGISTER(UART(n) + 0x04u) /* a 1 written to an overrun clears it */
#define UART_CONTROL(n) REGISTER(UART(n) + 0x08u)
#define UART_INTERRUPT(n) REGISTER(UART(n) + 0x0Cu)
#define UART_DIVISOR(n) REGISTER(UART(n) + 0x10u)
#define UART_STATE_SENDING 1u
#define UART_STATE_RECEIVED 2u
#define UART_STATE_OVERRUN 8u
#define UART_CONTROL_ON (1u | 2u | 8u) /* transmitter, receiver, interrupt of the receiver */

#define RING 64u /* bytes, a power of two */
static struct {
    volatile uint8_t ring[RING];
    volatile uint32_t arrived, taken;
    volatile bool lost;
} uarts[UARTS];

void uart_open(uint8_t n, uint32_t baud)
{
    static const uint8_t interrupts[UARTS] = {DR_INTERRUPT_UARTS};
    UART_DIVISOR(n) = (CLOCK_HZ + baud / 2u) / baud;
    UART_CONTROL(n) = UART_CONTROL_ON;
    NVIC_ENABLE = 1u << interrupts[n];
}

static void receive(uint8_t n)
{
    if ((UART_STATE(n) & UART_STATE_OVERRUN) != 0) {
        UART_STATE(n) = UART_STATE_OVERRUN;
        uarts[n].lost = true;
    }
    UART_INTERRUPT(n) = UART_STATE_RECEIVED; /* clears it */
    while ((UART_STATE(n) & UART_STATE_RECEIVED) != 0) {
        const uint8_t byte = (uint8_t)UART_DATA(n);
        if (uarts[n].arrived - uarts[n].taken < RING)
            uarts[n].ring[uarts[n].arrived++ % RING] = byte;
        else
            uarts[n].lost = true;
    }
}

void dr_interrupt_uart(void)
{
    for (uint8_t n = 0; n < UARTS; n++)
        receive(n);
}

bool uart_has_heard(uint8_t n) { return uarts[n].taken != uarts[n].arrived; }

size_t uart_read(uint8_t n, uint8_t *bytes, size_t room, bool *lost)
{
    size_t count = 0;
    if (uarts[n].lost) {
        uarts[n].lost = false;
        *lost = true;
    }
    while (count < room && uart_has_heard(n))
        bytes[count++] = uarts[n].ring[uarts[n].taken++ % RING];
    return count;
}

size_t uart_room(uint8_t n) { return (UART_STATE(n) & UART_STATE_SENDING) != 0 ? 0 : 1; }

void uart_write(uint8_t n, const uint8_t *bytes, size_t count)
{
    if (count > 0)
        UART_DATA(n) = bytes[0];
}
