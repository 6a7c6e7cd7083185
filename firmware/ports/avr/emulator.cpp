/* The emulator's line by Arduino's Serial: Uno and Mega (their first UART), Leonardo and Micro (native USB); and the start. */
#include "emulator.h"
#include "hands.h"
#include "port.h"

#include <Arduino.h>

void dr_port_open(uint32_t baud) { Serial.begin(baud); }

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

void setup() { EMULATOR_HANDS ? dr_hands_begin() : dr_emulator_begin(); }
void loop() { EMULATOR_HANDS ? dr_hands_step() : dr_emulator_step(); }
