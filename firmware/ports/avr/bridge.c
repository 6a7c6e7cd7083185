/* The bridge's lines, configuration and watchdog on a Mega 2560, by the registers: Arduino's Serial knows of no damaged byte. */
#include "bridge_port.h"

#include "dr_limits.h" /* DR_LIMITS_IMAGE_BYTES */

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

/* -- Lines: UART 0, 1 and 2 ---------------------------------------------------------------------------------------- */

typedef volatile struct {
    uint8_t status, control, format, unused;
    uint16_t divisor;
    uint8_t data, unused_too;
} registers;
#define UART(line) ((registers *)&UCSR0A + (line)) /* they follow one another */

/* Both rings: 256 bytes, so that their ends wrap by themselves. */
typedef struct {
    volatile uint8_t in[256], out[256];
    volatile uint8_t arrived, taken, given, left;
    volatile bool lost;
    bool has_sent;
} line;

static line lines[DR_LINES];

/* In each interrupt for itself: `which` is a constant there, and half of the time is saved. At 128000 baud both ways the
 * interrupts take a fifth of the processor. */
#define EACH static inline __attribute__((always_inline))

EACH void receive(dr_line which)
{
    line *const l = &lines[which];
    const uint8_t status = UART(which)->status, byte = UART(which)->data;
    if ((status & (_BV(FE0) | _BV(DOR0))) != 0)
        l->lost = true;
    if ((status & _BV(FE0)) != 0)
        return;
    if ((uint8_t)(l->arrived + 1u) == l->taken) {
        l->lost = true;
        return;
    }
    l->in[l->arrived] = byte;
    l->arrived++;
}

EACH void send(dr_line which)
{
    line *const l = &lines[which];
    registers *const uart = UART(which);
    if (l->left == l->given) {
        uart->control &= (uint8_t)~_BV(UDRIE0);
        return;
    }
    uart->data = l->out[l->left];
    uart->status = (uint8_t)((uart->status & _BV(U2X0)) | _BV(TXC0)); /* written, it is cleared */
    l->left++;
}

ISR(USART0_RX_vect) { receive(DR_LINE_HOST); }
ISR(USART0_UDRE_vect) { send(DR_LINE_HOST); }
ISR(USART1_RX_vect) { receive(DR_LINE_DEVICE); }
ISR(USART1_UDRE_vect) { send(DR_LINE_DEVICE); }
ISR(USART2_UDRE_vect) { send(DR_LINE_LOG); }

void dr_port_line_open(dr_line which, uint32_t baud)
{
    registers *const uart = UART(which);
    const uint16_t by_16 = (uint16_t)((F_CPU / 16u + baud / 2u) / baud),
                   by_8 = (uint16_t)((F_CPU / 8u + baud / 2u) / baud);
    const bool is_fast = by_8 != 2u * by_16; /* half the samples of a bit, where it brings the rate nearer */
    PORTD |= _BV(PD2) | _BV(PD3);            /* RX1 and TX1 are high where nothing drives them */
    uart->status = is_fast ? _BV(U2X0) : 0;
    uart->divisor = (uint16_t)((is_fast ? by_8 : by_16) - 1u);
    uart->format = _BV(UCSZ01) | _BV(UCSZ00);
    uart->control = which == DR_LINE_LOG ? _BV(TXEN0) : _BV(TXEN0) | _BV(RXEN0) | _BV(RXCIE0);
}

size_t dr_port_line_read(dr_line which, uint8_t *bytes, size_t room, bool *lost)
{
    line *const l = &lines[which];
    size_t count = 0;
    if (l->lost) {
        l->lost = false;
        *lost = true;
    }
    while (count < room && l->taken != l->arrived)
        bytes[count++] = l->in[l->taken++];
    return count;
}

size_t dr_port_line_room(dr_line which) { return (uint8_t)((unsigned)lines[which].left - lines[which].given - 1u); }

void dr_port_line_write(dr_line which, const uint8_t *bytes, size_t count)
{
    line *const l = &lines[which];
    for (size_t i = 0; i < count; i++) {
        l->out[l->given] = bytes[i];
        l->given++;
    }
    if (count > 0) {
        l->has_sent = true;
        UART(which)->control |= _BV(UDRIE0);
    }
}

bool dr_port_line_is_sent(dr_line which)
{
    const line *const l = &lines[which];
    return !l->has_sent || (l->left == l->given && (UART(which)->status & _BV(TXC0)) != 0);
}

bool dr_port_host_is_open(void) { return (PINF & _BV(PF3)) == 0; } /* A3, one of the inputs: it has its pull-up */

/* -- Configuration: the EEPROM, each in its half -------------------------------------------------------------------- */

void dr_port_configuration(uint8_t which, uint8_t *image, size_t size)
{
    const uint16_t half = (E2END + 1u) / DR_PORT_CONFIGURATIONS;
    eeprom_read_block(image, (const void *)(which * half), size);
}

/* -- When the program stands still ---------------------------------------------------------------------------------- */

volatile dr_survivor *dr_port_survivor(void)
{
    static dr_survivor survivor __attribute__((section(".noinit")));
    return &survivor;
}

/* 125 ms; the next one, 62 ms, is near to what a motion with 32 obstacles takes to judge. */
void dr_port_watchdog_start(void) { wdt_enable(WDTO_120MS); }
void dr_port_watchdog_feed(void) { wdt_reset(); }

extern uint8_t __heap_start; /* where the variables end; nothing is ever allocated */
#define CANARY 0xC5u

bool dr_port_stack_holds(void)
{
    static bool is_set;
    if (!is_set)
        __heap_start = CANARY;
    is_set = true;
    return __heap_start == CANARY;
}

/* Called by Arduino's main(), once its clock runs. */
void setup(void);
void loop(void);

void setup(void)
{
    MCUSR = 0; /* or the watchdog goes on after the reset that it has made, at its shortest time */
    wdt_disable();
    dr_bridge_begin();
}

void loop(void) { dr_bridge_step(); }
