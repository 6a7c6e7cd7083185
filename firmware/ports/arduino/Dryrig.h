/* Dryrig as an Arduino library: an emulated TRIO MP-245A or MPC-200 on any board whose core has Stream.
 *
 *     #include <Dryrig.h>
 *     void setup() { Serial.begin(57600); Dryrig.begin(Serial, DR_TRIO); }
 *     void loop() { Dryrig.step(); }
 *
 * 57600 baud for a TRIO, 128000 for an MPC-200; on USB the number is of no consequence. step() returns at once and wants to
 * be called all the time: nothing else in loop() may take longer than 4 ms.
 *
 * With buttons and knobs of its own, see the example Hands: DryrigHands in place of Dryrig, on a board with 28 KB of flash. */
#ifndef DRYRIG_H
#define DRYRIG_H

#include <Arduino.h>

#include "emulator.h"
#include "hands.h"
#include "port.h"

class DryrigEmulator
{
  public:
    /* On a line that is open already. `straps`: DR_STRAP_STAGES and DR_STRAP_KEEP of port.h. */
    void begin(Stream &line, dr_kind kind, uint8_t straps = 0);
    void step() { dr_emulator_step(); }
};

/* Say what is wired where before begin(); a button and an encoder's common contact go to ground. */
class DryrigEmulatorWithHands
{
  public:
    void button(uint8_t input, uint8_t pin);                /* DR_HANDS_HOME and so on, of hands.h */
    void knob(uint8_t input, uint8_t pin_a, uint8_t pin_b); /* DR_HANDS_KNOB_X and so on */
    void buzzer(uint8_t pin);                               /* high for 0.1 s where the controller beeps */
    void led(uint8_t pin);                                  /* high while a TRIO's screen is red; NORM/DIAG */
    void begin(Stream &line, dr_kind kind, uint8_t straps = 0);
    void step() { dr_hands_step(); }
};

extern DryrigEmulator Dryrig;
extern DryrigEmulatorWithHands DryrigHands;

#endif
