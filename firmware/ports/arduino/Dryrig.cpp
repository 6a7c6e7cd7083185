#include "Dryrig.h"

DryrigEmulator Dryrig;
DryrigEmulatorWithHands DryrigHands;

static Stream *host;
static uint8_t chosen;
static uint8_t input_pins[DR_PORT_INPUTS], output_pins[2]; /* and one: 0 is none */

static void prepare(Stream &line, dr_kind kind, uint8_t straps)
{
    host = &line;
    chosen = (uint8_t)((straps & (DR_STRAP_STAGES | DR_STRAP_KEEP)) |
                       (kind == DR_MPC ? DR_STRAP_OTHER : 0)); /* than a TRIO */
}

void DryrigEmulator::begin(Stream &line, dr_kind kind, uint8_t straps)
{
    prepare(line, kind, straps);
    dr_emulator_begin();
}

void DryrigEmulatorWithHands::begin(Stream &line, dr_kind kind, uint8_t straps)
{
    prepare(line, kind, straps);
    dr_hands_begin();
}

void DryrigEmulatorWithHands::button(uint8_t input, uint8_t pin)
{
    pinMode(pin, INPUT_PULLUP);
    if (input < DR_PORT_INPUTS)
        input_pins[input] = pin + 1;
}

void DryrigEmulatorWithHands::knob(uint8_t input, uint8_t pin_a, uint8_t pin_b)
{
    button(input, pin_a);
    button(input + 1, pin_b);
}

static void output(uint8_t number, uint8_t pin)
{
    pinMode(pin, OUTPUT);
    output_pins[number] = pin + 1;
}

void DryrigEmulatorWithHands::buzzer(uint8_t pin) { output(0, pin); }
void DryrigEmulatorWithHands::led(uint8_t pin) { output(1, pin); }

uint8_t dr_port_begin(void) { return chosen; }
void dr_port_open(uint32_t) {}
dr_us dr_port_now_us(void) { return micros(); }
bool dr_port_waits(void) { return false; }
void dr_port_wait(bool, dr_us) {}

size_t dr_port_read(uint8_t *bytes, size_t room)
{
    size_t count = 0;
    while (count < room && host->available() > 0)
        bytes[count++] = (uint8_t)host->read();
    return count;
}

/* A class that does not tell its room says 0; then one byte is tried, and may wait. */
size_t dr_port_room(void)
{
    const int room = host->availableForWrite();
    return room > 0 ? (size_t)room : 1;
}

void dr_port_write(const uint8_t *bytes, size_t count)
{
    if (count > 0)
        (void)host->write(bytes, count);
}

/* A UART has one and USB has none: kept in software it is right for both. */
bool dr_port_has_pace(void) { return false; }

uint16_t dr_port_inputs(void)
{
    uint16_t closed = 0;
    for (uint8_t i = 0; i < DR_PORT_INPUTS; i++)
        if (input_pins[i] != 0 && digitalRead(input_pins[i] - 1) == LOW)
            closed = (uint16_t)(closed | 1u << i);
    return closed;
}

void dr_port_outputs(uint8_t high)
{
    for (uint8_t i = 0; i < sizeof output_pins; i++)
        if (output_pins[i] != 0)
            digitalWrite(output_pins[i] - 1, (high >> i & 1u) != 0 ? HIGH : LOW);
}

#ifndef __AVR__ /* no memory that every core has */
uint16_t dr_port_slots(void) { return 0; }
void dr_port_slot_read(uint16_t, uint8_t *, size_t) {}
bool dr_port_slot_write(uint16_t, const uint8_t *, size_t) { return true; }
#endif
