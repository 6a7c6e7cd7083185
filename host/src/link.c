/* Which link a port takes; the clock; who has a port that is in use. */
#define _GNU_SOURCE /* realpath, CLOCK_MONOTONIC, major */

#include "link.h"

#include <dirent.h>
#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <time.h>
#include <unistd.h>

uint64_t link_now_us(void *context)
{
    struct timespec now;
    (void)context;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

void link_sleep_us(void *context, uint32_t span_us)
{
    const uint64_t end_us = link_now_us(context) + span_us;
    for (uint64_t at_us; (at_us = link_now_us(context)) < end_us;) { /* a signal may wake us before */
        const uint64_t left_us = end_us - at_us;
        const struct timespec span = {(time_t)(left_us / 1000000u), (long)(left_us % 1000000u) * 1000};
        (void)nanosleep(&span, NULL);
    }
}

/* -- Ports in use -------------------------------------------------------------------------------------------------- */

/* A lock that ends with the process, however it ends. TIOCEXCL would outlive us on a PTY that the emulator keeps open.
 * */
int link_lock(int fd) { return flock(fd, LOCK_EX | LOCK_NB) == 0 ? DRYRIG_OK : DRYRIG_ERR_PORT_BUSY; }

static bool has_open(const char *pid, const struct stat *port)
{
    char path[PATH_MAX];
    (void)snprintf(path, sizeof path, "/proc/%.20s/fd", pid);
    DIR *files = opendir(path);
    bool found = false;
    for (const struct dirent *file; !found && files != NULL && (file = readdir(files)) != NULL;) {
        struct stat open_file;
        (void)snprintf(path, sizeof path, "/proc/%.20s/fd/%.20s", pid, file->d_name);
        found = stat(path, &open_file) == 0 && S_ISCHR(open_file.st_mode) && open_file.st_rdev == port->st_rdev &&
                (port->st_dev == open_file.st_dev);
    }
    if (files != NULL)
        (void)closedir(files);
    return found;
}

/* The emulator or guard behind a PTY keeps it open too; it also holds the other end. */
static bool holds_master(const char *pid, unsigned number)
{
    char path[PATH_MAX], line[128];
    (void)snprintf(path, sizeof path, "/proc/%.20s/fdinfo", pid);
    DIR *files = opendir(path);
    bool found = false;
    for (const struct dirent *file; !found && files != NULL && (file = readdir(files)) != NULL;) {
        (void)snprintf(path, sizeof path, "/proc/%.20s/fdinfo/%.20s", pid, file->d_name);
        FILE *info = fopen(path, "re");
        while (info != NULL && !found && fgets(line, sizeof line, info) != NULL)
            found = strncmp(line, "tty-index:", 10) == 0 && strtoul(line + 10, NULL, 10) == number;
        if (info != NULL)
            (void)fclose(info);
    }
    if (files != NULL)
        (void)closedir(files);
    return found;
}

/* UNIX 98 PTYs: majors 136 to 143 (Linux, Documentation/admin-guide/devices.txt). */
static bool is_pty(const struct stat *port)
{
    return S_ISCHR(port->st_mode) && major(port->st_rdev) >= 136u && major(port->st_rdev) <= 143u;
}

static void process_name(const char *pid, char *name, size_t room)
{
    char path[64];
    (void)snprintf(path, sizeof path, "/proc/%.20s/comm", pid);
    FILE *file = fopen(path, "re");
    if (file == NULL || fgets(name, (int)room, file) == NULL)
        (void)snprintf(name, room, "process");
    if (file != NULL)
        (void)fclose(file);
    name[strcspn(name, "\n")] = '\0';
}

int link_busy(const char *path, char *why, size_t room)
{
    struct stat port;
    size_t used = (size_t)snprintf(why, room, "%s is in use", path);
    const size_t without_names = used;
    DIR *processes = stat(path, &port) == 0 ? opendir("/proc") : NULL;
    for (const struct dirent *process; processes != NULL && (process = readdir(processes)) != NULL;) {
        char name[32];
        if (process->d_name[0] < '1' || process->d_name[0] > '9' ||
            strtol(process->d_name, NULL, 10) == (long)getpid() || !has_open(process->d_name, &port) ||
            (is_pty(&port) && holds_master(process->d_name, minor(port.st_rdev))))
            continue;
        process_name(process->d_name, name, sizeof name);
        if (used < room)
            used += (size_t)snprintf(why + used, room - used, "%s %s (process %.20s)",
                                     used == without_names ? " by" : ",", name, process->d_name);
    }
    if (processes != NULL)
        (void)closedir(processes);
    if (used < room)
        (void)snprintf(why + used, room - used,
                       used == without_names
                           ? " by another program that this user may not look into; as root: fuser -v %s"
                           : ": end it first%.0s",
                       path);
    return DRYRIG_ERR_PORT_BUSY;
}

/* -- Opening ------------------------------------------------------------------------------------------------------- */

typedef struct {
    char *text;
    size_t room, used, count;
} port_list;

static void add_port(void *context, const char *path, const char *description)
{
    port_list *list = context;
    (void)description;
    if (list->used < list->room)
        list->used += (size_t)snprintf(list->text + list->used, list->room - list->used, "%s %s",
                                       list->count == 0 ? "; serial ports here:" : ",", path);
    list->count++;
}

static int no_port(const char *port, const char *reason, char *why, size_t room)
{
    port_list list = {why, room, 0, 0};
    list.used = (size_t)snprintf(why, room, "%.100s: %s", port, reason);
    const int listed = dryrig_list_ports(add_port, &list);
    if (listed == DRYRIG_OK && list.count == 0 && list.used < room)
        (void)snprintf(why + list.used, room - list.used,
                       "; this machine has no serial ports now. Is the controller's USB "
                       "cable plugged in, or the emulator running?");
    return DRYRIG_ERR_NO_PORT;
}

int dryrig_link_open(dryrig_link *out, const char *port, unsigned baud, char *why, size_t room)
{
    char unheard[1], path[PATH_MAX];
    struct stat is;
    if (room == 0) {
        why = unheard;
        room = sizeof unheard;
    }
    if (out == NULL || port == NULL || why == NULL || baud == 0)
        return DRYRIG_ERR_ARGUMENT;
    why[0] = '\0';
    memset(out, 0, sizeof *out);
    /* libserialport knows devices by their own names; the emulator's link and /dev/serial/by-id are other names. */
    if (realpath(port, path) == NULL || stat(path, &is) != 0) {
        const int error = errno;
        if (error == EACCES) {
            (void)snprintf(why, room, "%.200s: %s", port, strerror(error));
            return DRYRIG_ERR_PORT;
        }
        struct stat link;
        return no_port(port, lstat(port, &link) == 0 ? "a link to a port that is gone" : "there is no such port", why,
                       room);
    }
    if (!S_ISCHR(is.st_mode)) {
        (void)snprintf(why, room, "%.200s is not a serial port", port);
        return DRYRIG_ERR_PORT;
    }
    return is_pty(&is) ? link_pty_open(out, path, baud, why, room) : link_serial_open(out, path, baud, why, room);
}

int link_descriptor(const dryrig_link *link)
{
    const int fd = link_pty_descriptor(link);
    return fd >= 0 ? fd : link_serial_descriptor(link);
}
