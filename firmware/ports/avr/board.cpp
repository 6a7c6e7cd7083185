/* Boards of Arduino's AVR core: Uno and Mega (the line is their first UART), Leonardo and Micro (native USB). */
#include "emulator.h"
#include "hands.h"
#include "port.h"

#include <Arduino.h>

static const uint8_t strap_pins[] = {2, 3, 4, 5}; /* DR_STRAP_* from the lowest bit on: closed is connected to ground */
static const uint8_t input_pins[] = {
    6,  7,  8,   9,   10, 11, A0, A1, A2, A3, A4, A5,
#ifdef ARDUINO_AVR_MEGA2560
    A8, A9, A10, A11,
#endif
};
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
    for (uint8_t i = 0; i < sizeof input_pins; i++)
        pinMode(input_pins[i], INPUT_PULLUP);
    for (uint8_t i = 0; i < sizeof output_pins; i++)
        pinMode(output_pins[i], OUTPUT);
    delayMicroseconds(100); /* the pull-ups against the pins' capacitance */
    for (uint8_t i = 0; i < sizeof strap_pins; i++)
        if (digitalRead(strap_pins[i]) == LOW)
            straps = (uint8_t)(straps | 1u << i);
    return straps;
}

void dr_port_open(uint32_t baud) { Serial.begin(baud); }

dr_us dr_port_now_us(void) { return micros(); }

/* No board of these runs from a battery. */
bool dr_port_waits(void) { return false; }
void dr_port_wait(bool, dr_us) {}

size_t dr_port_read(uint8_t *bytes, size_t room)
{
    size_t count = 0;
    while (count < room && Serial.available() > 0)
        bytes[count++] = (uint8_t)Serial.read();
    return count;
}

#ifdef USBCON

/* Until the host opens the port (DTR), what is sent is lost, as on a line that nobody has plugged in. */
size_t dr_port_room(void) { return Serial.dtr() ? (size_t)Serial.availableForWrite() : DR_REPLY_MAX; }

void dr_port_write(const uint8_t *bytes, size_t count)
{
    if (count > 0 && Serial.dtr())
        (void)Serial.write(bytes, count); /* Arduino's core sends it with the next frame of USB, within 1 ms */
}

bool dr_port_has_pace(void) { return false; }

#else

#define AHEAD 8 /* and two more in the UART: what is computed meanwhile takes less than these take to leave */

size_t dr_port_room(void)
{
    const int waiting = SERIAL_TX_BUFFER_SIZE - 1 - Serial.availableForWrite();
    return waiting < AHEAD ? (size_t)(AHEAD - waiting) : 0;
}

void dr_port_write(const uint8_t *bytes, size_t count) { (void)Serial.write(bytes, count); }

bool dr_port_has_pace(void) { return true; }

#endif

uint16_t dr_port_inputs(void)
{
    uint16_t closed = 0;
    for (uint8_t i = 0; i < sizeof input_pins; i++)
        if (digitalRead(input_pins[i]) == LOW)
            closed = (uint16_t)(closed | 1u << i);
    return closed;
}

void dr_port_outputs(uint8_t high)
{
    for (uint8_t i = 0; i < sizeof output_pins; i++)
        digitalWrite(output_pins[i], (high >> i & 1u) != 0 ? HIGH : LOW);
}

void setup() { EMULATOR_HANDS ? dr_hands_begin() : dr_emulator_begin(); }
void loop() { EMULATOR_HANDS ? dr_hands_step() : dr_emulator_step(); }
