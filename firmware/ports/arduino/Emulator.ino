// A TRIO MP-245A on the board's serial port. For an MPC-200: 128000 and DR_MPC.
#include <Dryrig.h>

void setup()
{
    Serial.begin(57600);
    Dryrig.begin(Serial, DR_TRIO);
}

void loop()
{
    Dryrig.step();
}
