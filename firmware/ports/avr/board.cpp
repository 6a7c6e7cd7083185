/* Boards of Arduino's AVR core: the clock, and the pins. */
#include "port.h"

#include <Arduino.h>

static const uint8_t strap_pins[] = {2, 3, 4, 5}; /* DR_STRAP_* from the lowest bit on: closed is connected to ground */
static const uint8_t input_pins[] = {
    6,  7,  8,   9,   10, 11, A0, A1, A2, A3, A4, A5,
#ifdef ARDUINO_AVR_MEGA2560
    A8, A9, A10, A11,
#endif
};
static struct {
    const volatile uint8_t *levels;
    uint8_t bit;
} inputs[sizeof input_pins];
static const uint8_t output_pins[] = {
    12,
    LED_BUILTIN,
#ifdef ARDUINO_AVR_MEGA2560
    22,
#endif
};

uint8_t dr_port_begin(void)
{
    uint8_t straps = 0;
    for (uint8_t i = 0; i < sizeof strap_pins; i++)
        pinMode(strap_pins[i], INPUT_PULLUP);
    delayMicroseconds(100); /* the pull-ups against the pins' capacitance */
    for (uint8_t i = 0; i < sizeof strap_pins; i++)
        if (digitalRead(strap_pins[i]) == LOW)
            straps = (uint8_t)(straps | 1u << i);
    return straps;
}

dr_us dr_port_now_us(void) { return micros(); }

/* No board of these runs from a battery. */
bool dr_port_waits(void) { return false; }
void dr_port_wait(bool, dr_us) {}

/* What digitalRead() looks up each time is looked up once: they are read a thousand times a second. Not in dr_port_begin(), so
 * that an image without hands has none of it. */
static void prepare_inputs(void)
{
    for (uint8_t i = 0; i < sizeof input_pins; i++) {
        pinMode(input_pins[i], INPUT_PULLUP);
        inputs[i].levels = portInputRegister(digitalPinToPort(input_pins[i]));
        inputs[i].bit = digitalPinToBitMask(input_pins[i]);
    }
    delayMicroseconds(100);
}

uint16_t dr_port_inputs(void)
{
    if (inputs[0].levels == NULL)
        prepare_inputs();
    uint16_t closed = 0;
    /* Backwards: the bridge's stop contacts, which are first, as late as can be. */
    for (uint8_t i = sizeof input_pins; i > 0; i--) {
        closed <<= 1;
        if ((*inputs[i - 1].levels & inputs[i - 1].bit) == 0)
            closed |= 1;
    }
    return closed;
}

/* Only what changes: Arduino takes 7 us for a pin, and the bridge calls this each round. */
void dr_port_outputs(uint8_t high)
{
    static bool are_outputs;
    static uint8_t before;
    uint8_t changed = are_outputs ? high ^ before : 0xFF;
    for (uint8_t i = 0; i < sizeof output_pins; i++, changed >>= 1) {
        if ((changed & 1u) == 0)
            continue;
        pinMode(output_pins[i], OUTPUT);
        digitalWrite(output_pins[i], (high >> i & 1u) != 0 ? HIGH : LOW);
    }
    are_outputs = true;
    before = high;
}
