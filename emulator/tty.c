#include "tty.h"

#include <asm/termbits.h> /* struct termios2; not to be had together with <termios.h> */
#include <sys/ioctl.h>

#include <asm/ioctls.h>

uint32_t tty_baud(int fd)
{
    struct termios2 settings;
    return ioctl(fd, TCGETS2, &settings) == 0 ? settings.c_ospeed : 0;
}
