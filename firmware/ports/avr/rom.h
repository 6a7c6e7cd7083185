/* Constant tables stay in flash (see dr_device.c): an AVR would copy them to its RAM at the start. */
#include <avr/pgmspace.h>

#define DR_ROM PROGMEM
#define DR_ROM_READ(to, from) ((void)memcpy_P((to), (from), sizeof *(to)))
