// A TRIO MP-245A with the buttons of its front and a knob: each button from its pin to GND, the encoder's contacts A and B
// to theirs and its common one to GND. No resistors. Leave out what you do not have. For an MPC-200: 128000, DR_MPC, and
// DR_HANDS_STOP, DR_HANDS_DIAGONAL, DR_HANDS_CALIBRATE, DR_HANDS_MANIPULATOR for the third to the sixth button.
#include <Dryrig.h>

void setup()
{
    DryrigHands.button(DR_HANDS_HOME, 6);
    DryrigHands.button(DR_HANDS_WORK, 7);
    DryrigHands.button(DR_HANDS_PULSE, 8);
    DryrigHands.button(DR_HANDS_RELATIVE, 9);
    DryrigHands.button(DR_HANDS_SPEED, 10);
    DryrigHands.button(DR_HANDS_MAINS, 11);
    DryrigHands.knob(DR_HANDS_KNOB_X, A0, A1);
    DryrigHands.buzzer(12);
    DryrigHands.led(LED_BUILTIN);
    Serial.begin(57600);
    DryrigHands.begin(Serial, DR_TRIO);
}

void loop()
{
    DryrigHands.step();
}
