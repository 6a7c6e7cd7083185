// A TRIO MP-245A with the buttons of its front and a knob: each button from its pin to GND, the encoder's contacts A and B
// to theirs and its common one to GND. No resistors. Leave out what you do not have. For an MPC-200: 128000, DR_MPC, and
// DR_INPUT_STOP, DR_INPUT_DIAGONAL, DR_INPUT_CALIBRATE, DR_INPUT_MANIPULATOR for the third to the sixth button.
#include <Dryrig.h>

void setup()
{
    DryrigHands.button(DR_INPUT_HOME, 6);
    DryrigHands.button(DR_INPUT_WORK, 7);
    DryrigHands.button(DR_INPUT_PULSE, 8);
    DryrigHands.button(DR_INPUT_RELATIVE, 9);
    DryrigHands.button(DR_INPUT_SPEED, 10);
    DryrigHands.button(DR_INPUT_MAINS, 11);
    DryrigHands.knob(DR_INPUT_KNOB_X, A0, A1);
    DryrigHands.buzzer(12);
    DryrigHands.led(LED_BUILTIN);
    Serial.begin(57600);
    DryrigHands.begin(Serial, DR_TRIO);
}

void loop()
{
    DryrigHands.step();
}
