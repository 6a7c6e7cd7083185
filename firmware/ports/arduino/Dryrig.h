/* Dryrig as an Arduino library: an emulated TRIO MP-245A or MPC-200 on any board whose core has Stream.
 *
 *     #include <Dryrig.h>
 *     void setup() { Serial.begin(57600); Dryrig.begin(Serial, DR_TRIO); }
 *     void loop() { Dryrig.step(); }
 *
 * 57600 baud for a TRIO, 128000 for an MPC-200; on USB the number is of no consequence. step() returns at once and wants to
 * be called all the time: nothing else in loop() may take longer than 4 ms. */
#ifndef DRYRIG_H
#define DRYRIG_H

#include <Arduino.h>

#include "emulator.h"
#include "port.h"

class DryrigEmulator
{
  public:
    /* On a line that is open already. `straps`: DR_STRAP_STAGES and DR_STRAP_KEEP of port.h. */
    void begin(Stream &line, dr_kind kind, uint8_t straps = 0);
    void step() { dr_emulator_step(); }
};

extern DryrigEmulator Dryrig;

#endif
