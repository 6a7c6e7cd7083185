/* mps2-an385: CMSDK UART 0 is the line, TIMER 0 wakes from sleep, TIMER 1 is the clock. Everything about another chip that
 * differs is in here. */
#include "emulator.h"
#include "port.h"

#include "startup.h" /* the interrupts */

#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))

#define CLOCK_HZ 25000000u
#define TICKS_PER_US (CLOCK_HZ / DR_US_PER_S)

#define UART 0x40004000u
#define UART_DATA REGISTER(UART + 0x00u)
#define UART_STATE REGISTER(UART + 0x04u)
#define UART_CONTROL REGISTER(UART + 0x08u)
#define UART_INTERRUPT REGISTER(UART + 0x0Cu)
#define UART_DIVISOR REGISTER(UART + 0x10u)
#define UART_STATE_SENDING 1u
#define UART_STATE_RECEIVED 2u
#define UART_CONTROL_ON (1u | 2u | 8u) /* transmitter, receiver, interrupt of the receiver */

#define TIMER(n) (0x40000000u + (n)*0x1000u)
#define TIMER_CONTROL(n) REGISTER(TIMER(n) + 0x00u)
#define TIMER_VALUE(n) REGISTER(TIMER(n) + 0x04u) /* counts down */
#define TIMER_RELOAD(n) REGISTER(TIMER(n) + 0x08u)
#define TIMER_INTERRUPT(n) REGISTER(TIMER(n) + 0x0Cu)
#define TIMER_ON 1u
#define TIMER_INTERRUPTS 8u

#define SWITCHES REGISTER(0x4002F00Cu) /* SCC CFG_REG3: the board's user switches */
#define BUTTONS REGISTER(0x40028008u)  /* FPGAIO: the board's two user buttons; QEMU has none and says 0 */
#define LEDS REGISTER(0x40028000u)     /* and its two user LEDs */
#define NVIC_ENABLE REGISTER(0xE000E100u)

/* -- Start --------------------------------------------------------------------------------------------------------- */

uint8_t dr_port_begin(void)
{
    TIMER_RELOAD(1) = UINT32_MAX;
    TIMER_VALUE(1) = UINT32_MAX;
    TIMER_CONTROL(1) = TIMER_ON;
    NVIC_ENABLE = 1u << DR_INTERRUPT_UART | 1u << DR_INTERRUPT_TIMER;
    return (uint8_t)(SWITCHES & (DR_STRAP_OTHER | DR_STRAP_STAGES | DR_STRAP_KEEP));
}

void dr_port_open(uint32_t baud)
{
    UART_DIVISOR = (CLOCK_HZ + baud / 2u) / baud;
    UART_CONTROL = UART_CONTROL_ON;
}

/* -- Time ---------------------------------------------------------------------------------------------------------- */

/* The timer wraps after 171 s; whole microseconds that went by since the last look are added up. dr_port_wait() looks in
 * time. */
dr_us dr_port_now_us(void)
{
    static uint32_t looked = UINT32_MAX;
    static dr_us now;
    const uint32_t elapsed_us = (looked - TIMER_VALUE(1)) / TICKS_PER_US;
    looked -= elapsed_us * TICKS_PER_US;
    now += elapsed_us;
    return now;
}

/* -- The line ------------------------------------------------------------------------------------------------------ */

#define RING 256u /* bytes, a power of two */
static volatile uint8_t ring[RING];
static volatile uint32_t arrived, taken;

void dr_interrupt_uart(void)
{
    UART_INTERRUPT = UART_STATE_RECEIVED; /* clears it */
    while ((UART_STATE & UART_STATE_RECEIVED) != 0) {
        const uint8_t byte = (uint8_t)UART_DATA;
        if (arrived - taken < RING)
            ring[arrived++ % RING] = byte;
    }
}

size_t dr_port_read(uint8_t *bytes, size_t room)
{
    size_t count = 0;
    while (count < room && taken != arrived)
        bytes[count++] = ring[taken++ % RING];
    return count;
}

size_t dr_port_room(void) { return (UART_STATE & UART_STATE_SENDING) != 0 ? 0 : 1; }

void dr_port_write(const uint8_t *bytes, size_t count)
{
    if (count > 0)
        UART_DATA = bytes[0];
}

/* QEMU's UART has none. That of a chip has. */
bool dr_port_has_pace(void) { return false; }

/* -- Inputs and outputs -------------------------------------------------------------------------------------------- */

uint16_t dr_port_inputs(void) { return (uint16_t)(BUTTONS & 3u); }
void dr_port_outputs(uint8_t high) { LEDS = high & 3u; }

/* -- Sleep --------------------------------------------------------------------------------------------------------- */

#define LONGEST_SLEEP_US (60u * DR_US_PER_S)

void dr_interrupt_timer(void)
{
    TIMER_CONTROL(0) = 0;
    TIMER_INTERRUPT(0) = 1; /* clears it */
}

bool dr_port_waits(void) { return true; }

void dr_port_wait(bool has_end, dr_us until)
{
    const dr_us now = dr_port_now_us();
    uint32_t sleep_us = LONGEST_SLEEP_US;
    if (has_end && !dr_us_before(now, until))
        return;
    if (has_end && until - now < sleep_us)
        sleep_us = until - now;
    TIMER_RELOAD(0) = 0;
    TIMER_VALUE(0) = sleep_us * TICKS_PER_US;
    TIMER_CONTROL(0) = TIMER_ON | TIMER_INTERRUPTS;
    /* With interrupts masked none can come between the look and the sleep; a pending one ends the sleep all the same. */
    __asm__ volatile("cpsid i" ::: "memory");
    if (taken == arrived)
        __asm__ volatile("wfi" ::: "memory");
    __asm__ volatile("cpsie i" ::: "memory");
    TIMER_CONTROL(0) = 0;
}

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
