/* Which interrupts of the chip are used; mps2-an385: its CMSDK UARTs 0 to 3 (receive) and TIMER 0. */
#ifndef DR_STARTUP_H
#define DR_STARTUP_H

#define DR_INTERRUPTS 32
#define DR_INTERRUPT_UARTS 0, 2, 4, 18
#define DR_INTERRUPT_TIMER 8

void dr_interrupt_uart(void);
void dr_interrupt_timer(void);
void dr_fault(void);

#endif
