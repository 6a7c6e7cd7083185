/* Raspberry Pi Pico (RP2040): the clock, and the pins. */
#include "port.h"

#include "hardware/gpio.h"
#include "hardware/timer.h"
#include "pico/time.h"

static const uint8_t strap_pins[] = {2, 3, 4, 5}; /* GP numbers; DR_STRAP_* from the lowest bit on, closed to ground */

#define FIRST_INPUT 6u                             /* GP6 to GP21 */
static const uint8_t output_pins[] = {26, 25, 27}; /* GP26, the LED, GP27 */

uint8_t dr_port_begin(void)
{
    uint8_t straps = 0;
    for (uint8_t i = 0; i < sizeof strap_pins; i++) {
        gpio_init(strap_pins[i]);
        gpio_pull_up(strap_pins[i]);
    }
    busy_wait_us(100); /* the pull-ups against the pins' capacitance */
    for (uint8_t i = 0; i < sizeof strap_pins; i++)
        if (!gpio_get(strap_pins[i]))
            straps = (uint8_t)(straps | 1u << i);
    return straps;
}

dr_us dr_port_now_us(void) { return time_us_32(); }

/* TinyUSB wants to be called all the time. */
bool dr_port_waits(void) { return false; }

void dr_port_wait(bool has_end, dr_us until)
{
    (void)has_end;
    (void)until;
}

/* -- Inputs and outputs -------------------------------------------------------------------------------------------- */

uint16_t dr_port_inputs(void)
{
    static bool are_ready;
    for (uint8_t pin = FIRST_INPUT; !are_ready && pin < FIRST_INPUT + DR_PORT_INPUTS; pin++) {
        gpio_init(pin);
        gpio_pull_up(pin);
    }
    if (!are_ready)
        busy_wait_us(100);
    are_ready = true;
    return (uint16_t)(~gpio_get_all() >> FIRST_INPUT);
}

void dr_port_outputs(uint8_t high)
{
    for (uint8_t i = 0; i < sizeof output_pins; i++) {
        gpio_init(output_pins[i]);
        gpio_set_dir(output_pins[i], GPIO_OUT);
        gpio_put(output_pins[i], (high >> i & 1u) != 0);
    }
}
