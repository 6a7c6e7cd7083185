#include "avr_controller.h"

#include "dr_controller.h"

#include <simavr/avr_uart.h>
#include <simavr/sim_irq.h>

#include <stdio.h>
#include <string.h>

static avr_t *board;
static bool is_printing;
static dr_controller controller;
static dr_drive drives[DR_PORTS];
static avr_irq_t *input;
static uint32_t byte_cycles;
static avr_cycle_count_t line_free; /* when the controller's next byte may begin */
static char log_line[256];          /* a reset may cut one off, and the next follows */
static size_t log_length;

static dr_us now(void) { return (dr_us)(board->cycle / CYCLES_PER_US); }

static void say(char direction, uint8_t byte)
{
    if (is_printing)
        (void)printf("%u %c%02x\n", now(), direction, byte);
}

static void from_board(avr_irq_t *irq, uint32_t value, void *unused)
{
    const uint8_t byte = (uint8_t)value;
    (void)irq;
    (void)unused;
    say('>', byte);
    (void)dr_controller_push(&controller, now(), &byte, 1);
}

static void log_byte(avr_irq_t *irq, uint32_t value, void *unused)
{
    (void)irq;
    (void)unused;
    if ((char)value != '\n' && log_length < sizeof log_line - 1u) {
        log_line[log_length++] = (char)value;
        return;
    }
    log_line[log_length] = '\0';
    log_length = 0;
    if (is_printing)
        (void)printf("%u %s\n", now(), log_line);
}

static avr_irq_t *uart(uint32_t name, int irq)
{
    uint32_t flags = 0;
    (void)avr_ioctl(board, AVR_IOCTL_UART_SET_FLAGS(name), &flags);
    return avr_io_getirq(board, AVR_IOCTL_UART_GETIRQ(name), irq);
}

bool avr_controller_begin(avr_t *avr, const char *kind, bool prints)
{
    const bool is_trio = strcmp(kind, "trio") == 0;
    const dr_hand power_on = {.what = DR_HAND_POWER_ON};
    if (!is_trio && strcmp(kind, "mpc") != 0)
        return false;
    board = avr;
    is_printing = prints;
    for (uint8_t i = 0; i < DR_PORTS; i++)
        dr_drive_init(&drives[i], is_trio ? DR_STAGE_TRIO_MP845 : i < 2 ? DR_STAGE_MPC_MP225 : DR_STAGE_NONE);
    dr_controller_init(&controller, is_trio ? DR_TRIO : DR_MPC, drives, is_trio ? 1 : DR_PORTS);
    controller.calibrates_at_power_on = false;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        drives[0].position_steps[axis] = 20000;
    (void)dr_controller_poke(&controller, 0, &power_on);
    byte_cycles = CYCLES_PER_US * DR_US_PER_S / ((is_trio ? DR_BAUD_TRIO : DR_BAUD_MPC) / DR_BITS_PER_BYTE);
    avr_irq_register_notify(uart('1', UART_IRQ_OUTPUT), from_board, NULL);
    avr_irq_register_notify(uart('2', UART_IRQ_OUTPUT), log_byte, NULL);
    input = uart('1', UART_IRQ_INPUT);
    return true;
}

void avr_controller_exchange(void)
{
    uint8_t byte;
    if (board == NULL || board->cycle < line_free || dr_controller_pull(&controller, now(), &byte, 1) == 0)
        return;
    say('<', byte);
    avr_raise_irq(input, byte);
    line_free = board->cycle + byte_cycles;
}

void avr_controller_end(void)
{
    uint32_t at[DR_AXES];
    if (board == NULL)
        return;
    dr_controller_position(&controller, 0, now(), at);
    if (is_printing)
        (void)printf("%u tip %u %u %u\n", now(), at[DR_X], at[DR_Y], at[DR_Z]);
}
