/* mps2-an385: TIMER 0 wakes from sleep, TIMER 1 is the clock. Everything about another chip that differs is in here and in
 * uarts.c. */
#include "port.h"

#include "startup.h" /* the interrupts */
#include "uarts.h"

#define TICKS_PER_US (CLOCK_HZ / DR_US_PER_S)

#define TIMER(n) (0x40000000u + (n)*0x1000u)
#define TIMER_CONTROL(n) REGISTER(TIMER(n) + 0x00u)
#define TIMER_VALUE(n) REGISTER(TIMER(n) + 0x04u) /* counts down */
#define TIMER_RELOAD(n) REGISTER(TIMER(n) + 0x08u)
#define TIMER_INTERRUPT(n) REGISTER(TIMER(n) + 0x0Cu)
#define TIMER_ON 1u
#define TIMER_INTERRUPTS 8u

#define SWITCHES REGISTER(0x4002F00Cu) /* SCC CFG_REG3: the board's user switches */
#define BUTTONS REGISTER(0x40028008u)  /* FPGAIO: the board's two user buttons */
#define LEDS REGISTER(0x40028000u)     /* and its two user LEDs */

#define PINS 3u /* a UART, see dr_port_inputs() */

/* -- Start --------------------------------------------------------------------------------------------------------- */

uint8_t dr_port_begin(void)
{
    TIMER_RELOAD(1) = UINT32_MAX;
    TIMER_VALUE(1) = UINT32_MAX;
    TIMER_CONTROL(1) = TIMER_ON;
    NVIC_ENABLE = 1u << DR_INTERRUPT_TIMER;
    uart_open(PINS, 115200);
    return (uint8_t)(SWITCHES & (DR_STRAP_OTHER | DR_STRAP_STAGES | DR_STRAP_KEEP));
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

/* -- Inputs and outputs -------------------------------------------------------------------------------------------- */

/* QEMU's board has neither buttons nor pins. What arrives on this UART stands for them: a byte of 0PPPPPPP (binary) sets
 * inputs 0 to 6, one of 1PPPPPPP sets 7 to 13. */
uint16_t dr_port_inputs(void)
{
    static uint16_t pins;
    uint8_t byte;
    bool lost;
    while (uart_read(PINS, &byte, 1, &lost) == 1)
        pins = (uint16_t)(byte < 0x80u ? (pins & ~0x7Fu) | byte : (pins & 0x7Fu) | (byte & 0x7Fu) << 7);
    return (uint16_t)(pins | (BUTTONS & 3u));
}

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
    if (!uart_has_heard(0))
        __asm__ volatile("wfi" ::: "memory");
    __asm__ volatile("cpsie i" ::: "memory");
    TIMER_CONTROL(0) = 0;
}
