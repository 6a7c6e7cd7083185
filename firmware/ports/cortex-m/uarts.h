/* uarts: the first four CMSDK UARTs of mps2-an385: received by interrupt, sent a byte at a time. */
#ifndef DR_UARTS_H
#define DR_UARTS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define NVIC_ENABLE REGISTER(0xE000E100u) /* a bit written as 0 changes nothing */
#define CLOCK_HZ 25000000u
#define UARTS 4u

void uart_open(uint8_t n, uint32_t baud);
/* Sets *lost when bytes were lost since the last call, and leaves it otherwise. */
size_t uart_read(uint8_t n, uint8_t *bytes, size_t room, bool *lost);
bool uart_has_heard(uint8_t n);
size_t uart_room(uint8_t n);
void uart_write(uint8_t n, const uint8_t *bytes, size_t count);

#endif
