#define _POSIX_C_SOURCE 200809L /* O_CLOEXEC */
#include "say.h"

#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

/* Stderr once more, as a description of our own: not to wait is no business of the shell's, which has it too. A terminal that is
 * nearly full says that it can be written to, and makes a long line wait. -1: it is a file, or cannot be opened. */
static int open_own(void)
{
    struct stat is;
    if (fstat(STDERR_FILENO, &is) != 0 || (!S_ISCHR(is.st_mode) && !S_ISFIFO(is.st_mode)))
        return -1;
    return open("/proc/self/fd/2", O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
}

void say(const char *format, ...)
{
    static int own = -2;
    char text[2048];
    va_list arguments;
    va_start(arguments, format);
    const int length = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (length <= 0)
        return;
    const size_t count = (size_t)length < sizeof text ? (size_t)length : sizeof text - 1;
    if (own == -2)
        own = open_own();
    if (own >= 0) {
        (void)!write(own, text, count);
        return;
    }
    const int flags = fcntl(STDERR_FILENO, F_GETFL);
    (void)fcntl(STDERR_FILENO, F_SETFL, flags | O_NONBLOCK); /* for this moment; a terminal of another user */
    (void)!write(STDERR_FILENO, text, count);
    (void)fcntl(STDERR_FILENO, F_SETFL, flags);
}
