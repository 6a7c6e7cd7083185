/* Where constant tables live (see dr_device.c): an Arduino library is compiled for any machine. */
#ifdef __AVR__
#include "rom_avr.h"
#else
#define DR_ROM
#define DR_ROM_READ(to, from) (*(to) = *(from))
#endif
