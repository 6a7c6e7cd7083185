#define _GNU_SOURCE /* poll, fileno, flock, fopen "e" */
#include "recording.h"

#include "say.h"

#include "dr_recording.h" /* the format */

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

FILE *recording_file(const char *path)
{
    struct stat is;
    const bool is_pipe = stat(path, &is) == 0 && S_ISFIFO(is.st_mode);
    const int pipe_fd = is_pipe ? open(path, O_RDWR | O_CLOEXEC) : -1; /* to write alone would wait for a reader */
    return !is_pipe ? fopen(path, "we") : pipe_fd < 0 ? NULL : fdopen(pipe_fd, "w");
}

bool recording_may_replace(const char *path)
{
    static const char begins[] = "dryrig-recording ";
    char start[sizeof begins - 1];
    struct stat is;
    if (stat(path, &is) != 0 || !S_ISREG(is.st_mode) || is.st_size == 0)
        return true;
    FILE *const file = fopen(path, "re");
    const bool is_ours =
        file != NULL && fread(start, sizeof start, 1, file) == 1 && memcmp(start, begins, sizeof start) == 0;
    if (file != NULL)
        (void)fclose(file);
    errno = EEXIST;
    return is_ours;
}

/* Emptied when nobody else writes it. NULL: errno says why; EBUSY: somebody does. */
static FILE *open_alone(const char *path)
{
    struct stat is;
    if (stat(path, &is) != 0 || !S_ISREG(is.st_mode))
        return recording_file(path);
    const int fd = open(path, O_WRONLY | O_CLOEXEC);
    const bool is_others = fd >= 0 && flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    FILE *const file = fd >= 0 && !is_others && ftruncate(fd, 0) == 0 ? fdopen(fd, "w") : NULL;
    if (file != NULL || fd < 0)
        return file;
    const int why = is_others ? EBUSY : errno;
    (void)close(fd);
    errno = why;
    return NULL;
}

bool recording_open(recording *r, const char *program, const char *path)
{
    struct stat is;
    *r = (recording){.program = program, .path = path};
    if (!recording_may_replace(path)) {
        say("%s: %s holds something else than a recording: it stays. Choose another path\n", program, path);
        errno = EEXIST;
        return false;
    }
    r->file = open_alone(path);
    if (r->file == NULL && errno == EBUSY)
        say("%s: another program records at %s: choose another path\n", program, path);
    if (r->file == NULL)
        return false;
    r->is_file = fstat(fileno(r->file), &is) == 0 && S_ISREG(is.st_mode);
    if (r->is_file)
        (void)flock(fileno(r->file), LOCK_EX | LOCK_NB); /* a new one; where there are no locks: without */
    if (!r->is_file)
        (void)setvbuf(r->file, NULL, _IOLBF, BUFSIZ);
    if (dr_recording_begin(r->file))
        return true;
    const int why = errno;
    (void)fclose(r->file);
    r->file = NULL;
    errno = why;
    return false;
}

static void check(recording *r, bool done)
{
    if (done)
        return;
    say("%s: the recording ends here, %s cannot be written: %s\n", r->program, r->path, strerror(errno));
    (void)fclose(r->file);
    r->file = NULL;
    r->is_incomplete = true;
}

/* A pipe or a terminal that has room for anything has room for what is written at once. */
static bool has_room(recording *r)
{
    if (r->file == NULL)
        return false;
    struct pollfd file = {.fd = fileno(r->file), .events = POLLOUT};
    if (r->is_file || poll(&file, 1, 0) != 0)
        return true;
    r->lost++;
    if (!r->told_loss)
        say("%s: nobody reads the recording %s: what it has no room for is lost\n", r->program, r->path);
    r->told_loss = true;
    return false;
}

/* Is there room, also behind the line that tells what was lost? */
static bool begin_line(recording *r, uint64_t when_us, uint64_t real_us, const char *name)
{
    char text[64];
    if (!has_room(r))
        return false;
    if (r->lost > 0) {
        (void)snprintf(text, sizeof text, "%u lines are lost here, nobody took them", (unsigned)r->lost);
        r->lost = 0;
        check(r, dr_recording_event(r->file, when_us, real_us, name, text));
    }
    return r->file != NULL;
}

void recording_set(recording *r, const char *name, const char *key, const char *value)
{
    if (has_room(r))
        check(r, dr_recording_set(r->file, name, key, value));
}

void recording_bytes(recording *r, uint64_t when_us, uint64_t real_us, const char *name, char kind,
                     const uint8_t *bytes, size_t count)
{
    if (begin_line(r, when_us, real_us, name))
        check(r, dr_recording_bytes(r->file, when_us, real_us, name, (dr_recorded_kind)kind, bytes, count));
}

void recording_event(recording *r, uint64_t when_us, uint64_t real_us, const char *name, const char *text)
{
    if (begin_line(r, when_us, real_us, name))
        check(r, dr_recording_event(r->file, when_us, real_us, name, text));
}

void recording_flush(recording *r)
{
    if (r->file != NULL)
        check(r, fflush(r->file) == 0);
}

bool recording_close(recording *r)
{
    if (r->file != NULL && r->lost > 0)
        say("%s: %s is incomplete: nobody took its last %u lines\n", r->program, r->path, (unsigned)r->lost);
    if (r->file != NULL && fclose(r->file) != 0) {
        say("%s: %s is incomplete: %s\n", r->program, r->path, strerror(errno));
        r->is_incomplete = true;
    }
    r->file = NULL;
    return !r->is_incomplete;
}
