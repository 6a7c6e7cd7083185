/* Start of a Cortex-M: the vector table, and what has to be done before main(). The same for every chip, but for how many
 * interrupts it has and which of them are used. */
#include "startup.h"

#include <stdint.h>

extern uint32_t dr_stack_top, dr_data, dr_data_end, dr_data_image, dr_bss, dr_bss_end; /* of the linker script */
int main(void);
void dr_reset(void);

void dr_reset(void)
{
    const uint32_t *image = &dr_data_image;
    for (uint32_t *at = &dr_data; at < &dr_data_end; at++)
        *at = *image++;
    for (uint32_t *at = &dr_bss; at < &dr_bss_end; at++)
        *at = 0;
    (void)main();
    for (;;) {}
}

/* Nothing here can go on after a fault; a watchdog or a debugger finds it. A test program has its own. */
__attribute__((weak)) void dr_fault(void)
{
    for (;;) {}
}

__attribute__((weak)) void dr_interrupt_uart(void) {}
__attribute__((weak)) void dr_interrupt_timer(void) {}

#define FIRST_INTERRUPT 16
enum { RESET = 1, NMI = 2, HARD_FAULT = 3, MEMORY_FAULT = 4, BUS_FAULT = 5, USAGE_FAULT = 6 };

typedef union {
    const void *stack;
    void (*handler)(void);
} vector;

__attribute__((section(".vectors"), used)) static const vector vectors[FIRST_INTERRUPT + DR_INTERRUPTS] = {
    [0] = {.stack = &dr_stack_top},
    [RESET] = {.handler = dr_reset},
    [NMI] = {.handler = dr_fault},
    [HARD_FAULT] = {.handler = dr_fault},
    [MEMORY_FAULT] = {.handler = dr_fault},
    [BUS_FAULT] = {.handler = dr_fault},
    [USAGE_FAULT] = {.handler = dr_fault},
    [FIRST_INTERRUPT + 0] = {.handler = dr_interrupt_uart},
    [FIRST_INTERRUPT + 2] = {.handler = dr_interrupt_uart},
    [FIRST_INTERRUPT + 4] = {.handler = dr_interrupt_uart},
    [FIRST_INTERRUPT + 18] = {.handler = dr_interrupt_uart},
    [FIRST_INTERRUPT + DR_INTERRUPT_TIMER] = {.handler = dr_interrupt_timer},
};
