/* Constant tables stay in flash (see dr_device.c): an AVR would copy them to its RAM at the start. */
#include <avr/pgmspace.h>

#define DR_ROM PROGMEM
#define DR_ROM_READ(to, from)                                                                                          \
    ((void)(sizeof *(to) == 1 ? (*(uint8_t *)(to) = pgm_read_byte(from), (void *)0)                                    \
                              : memcpy_P((to), (from), sizeof *(to))))
