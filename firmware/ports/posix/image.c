#define _GNU_SOURCE /* mkostemp, fopen "e" */
#include "image.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char magic[] = {'D', 'R', 'L', 'M'};

bool image_is(const void *bytes, size_t size)
{
    return size >= sizeof magic && memcmp(bytes, magic, sizeof magic) == 0;
}

const char *image_problem(uint8_t error)
{
    switch (error) {
    case DR_LIMITS_SIZE:
        return "a compiled configuration that is cut off, or has something behind it";
    case DR_LIMITS_VERSION:
        return "a compiled configuration of another version of this program: compile it anew from its text";
    case DR_LIMITS_CRC:
        return "a compiled configuration that is damaged: its check sum is wrong";
    default:
        return "a compiled configuration whose content makes no sense: it was not made by this program";
    }
}

/* Is it a file of somebody's that is no compiled configuration? The text itself, by a slip. */
static bool is_other_file(const char *path)
{
    char begins[sizeof magic];
    struct stat is;
    FILE *const file = stat(path, &is) == 0 && S_ISREG(is.st_mode) ? fopen(path, "re") : NULL;
    if (file == NULL)
        return false;
    const size_t size = fread(begins, 1, sizeof begins, file);
    (void)fclose(file);
    return size > 0 && !image_is(begins, size);
}

/* The configuration that the file holds now. False: none that is whole. */
static bool read_present(const char *path, dr_limits *out)
{
    uint8_t bytes[DR_LIMITS_IMAGE_BYTES + 1u];
    dr_limits_problem problem;
    FILE *const file = fopen(path, "re");
    if (file == NULL)
        return false;
    const size_t size = fread(bytes, 1, sizeof bytes, file);
    (void)fclose(file);
    return dr_limits_get(bytes, size, out, &problem);
}

/* A board takes the newest revision that it finds: two contents of one number would be a matter of luck. */
static bool is_newer(const char *path, const dr_limits *limits, char *why, size_t room)
{
    dr_limits present;
    if (!read_present(path, &present) || limits->revision > present.revision ||
        dr_limits_crc(limits) == dr_limits_crc(&present))
        return true;
    (void)snprintf(why, room,
                   "%s holds revision %lu of another configuration: this one needs a higher 'revision' than %lu", path,
                   (unsigned long)present.revision, (unsigned long)limits->revision);
    return false;
}

static bool write_all(int fd, const uint8_t *bytes)
{
    const ssize_t written = write(fd, bytes, DR_LIMITS_IMAGE_BYTES);
    if (written >= 0 && written < (ssize_t)DR_LIMITS_IMAGE_BYTES)
        errno = ENOSPC;
    return written == (ssize_t)DR_LIMITS_IMAGE_BYTES && fchmod(fd, 0644) == 0 && fsync(fd) == 0;
}

image_result image_write(const char *path, const dr_limits *limits, char *why, size_t room)
{
    uint8_t bytes[DR_LIMITS_IMAGE_BYTES];
    char aside[PATH_MAX];
    struct stat is;
    if (is_other_file(path)) {
        (void)snprintf(why, room,
                       "%s holds something else than a compiled configuration: it stays. Choose another path", path);
        return IMAGE_CANNOT;
    }
    if (!is_newer(path, limits, why, room))
        return IMAGE_NOT_NEWER;
    const bool is_other = stat(path, &is) == 0 && !S_ISREG(is.st_mode);
    const bool fits = snprintf(aside, sizeof aside, "%s.XXXXXX", path) < (int)sizeof aside;
    errno = is_other ? EEXIST : ENAMETOOLONG;
    const int fd = is_other || !fits ? -1 : mkostemp(aside, O_CLOEXEC);
    dr_limits_put(limits, bytes);
    const bool is_written = fd >= 0 && write_all(fd, bytes);
    const bool is_done = fd >= 0 && (close(fd) == 0) && is_written && rename(aside, path) == 0;
    if (is_done)
        return IMAGE_WRITTEN;
    (void)snprintf(why, room, "%s: %s", path, is_other ? "is no file; it stays" : strerror(errno));
    if (fd >= 0)
        (void)unlink(aside);
    return IMAGE_CANNOT;
}
