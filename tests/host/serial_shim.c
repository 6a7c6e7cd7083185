/* serial_shim: makes a PTY look like the serial port /dev/ttyEMU0 to one program, so that libserialport, and the
 * library's code on it, runs end to end against the emulator. For tests: LD_PRELOAD, with DRYRIG_SHIM_PTY naming the
 * PTY.
 *
 * It answers for the port's name where libserialport looks (sysfs, /dev), and for the modem lines that a PTY lacks. */
#define _GNU_SOURCE

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#define PORT "/dev/ttyEMU0"
#define SYSFS "/sys/class/tty/ttyEMU0"

int __lxstat(int version, const char *path, struct stat *out); /* what Debian's libserialport calls */
int __open_2(const char *path, int flags);
char *__realpath_chk(const char *path, char *resolved, size_t room);

/* The next definition of a function; a void pointer is no function pointer in ISO C. */
static void next(const char *name, void *function, size_t size)
{
    void *found = dlsym(RTLD_NEXT, name);
    if (found == NULL)
        abort();
    memcpy(function, &found, size);
}

static const char *real_path(const char *path)
{
    const char *pty = getenv("DRYRIG_SHIM_PTY");
    return pty != NULL && strcmp(path, PORT) == 0 ? pty : path;
}

int open(const char *path, int flags, ...)
{
    int (*call)(const char *, int, mode_t);
    va_list arguments;
    va_start(arguments, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(arguments, mode_t) : 0;
    va_end(arguments);
    next("open", &call, sizeof call);
    return call(real_path(path), flags, mode);
}

int __open_2(const char *path, int flags) { return open(path, flags); }

char *realpath(const char *restrict path, char *restrict resolved)
{
    char *(*call)(const char *, char *);
    if (strcmp(path, PORT) == 0 && resolved != NULL)
        return memcpy(resolved, PORT, sizeof PORT);
    next("realpath", &call, sizeof call);
    return call(path, resolved);
}

char *__realpath_chk(const char *path, char *resolved, size_t room)
{
    (void)room;
    return realpath(path, resolved);
}

int stat(const char *restrict path, struct stat *restrict out)
{
    int (*call)(const char *, struct stat *);
    next("stat", &call, sizeof call);
    const char *pty = getenv("DRYRIG_SHIM_PTY");
    struct stat real;
    const int result = call(real_path(path), out);
    if (result == 0 && pty != NULL && call(pty, &real) == 0 && out->st_rdev == real.st_rdev)
        out->st_rdev = makedev(188, 0); /* a USB serial port's, also where a process has it open */
    return result;
}

int __lxstat(int version, const char *path, struct stat *out)
{
    int (*call)(int, const char *, struct stat *);
    if (strcmp(path, SYSFS) == 0) {
        memset(out, 0, sizeof *out);
        out->st_mode = S_IFLNK | 0777;
        return 0;
    }
    next("__lxstat", &call, sizeof call);
    return call(version, path, out);
}

ssize_t readlink(const char *restrict path, char *restrict out, size_t room)
{
    static const char target[] = "../../devices/platform/emulated/tty/ttyEMU0";
    ssize_t (*call)(const char *, char *, size_t);
    if (strcmp(path, SYSFS) == 0 && room >= sizeof target) {
        memcpy(out, target, sizeof target - 1);
        return sizeof target - 1;
    }
    next("readlink", &call, sizeof call);
    return call(path, out, room);
}

int ioctl(int fd, unsigned long request, ...)
{
    int (*call)(int, unsigned long, void *);
    va_list arguments;
    va_start(arguments, request);
    void *argument = va_arg(arguments, void *);
    va_end(arguments);
    switch (request) {
    case TIOCMGET:
        *(int *)argument = TIOCM_CTS | TIOCM_DSR;
        return 0;
    case TIOCMSET:
    case TIOCMBIS:
    case TIOCMBIC:
        return 0;
    default:
        next("ioctl", &call, sizeof call);
        return call(fd, request, argument);
    }
}
