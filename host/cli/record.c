#define _POSIX_C_SOURCE 200809L /* open, fdopen */
#include "record.h"

#include "dr_recording.h" /* the format */
#include "dr_words.h"     /* firmware as text */

#include <errno.h>
#include <fcntl.h>
#include <string.h>

/* What cannot be written is said once; the controller is more important. */
static void check(record *r, bool done)
{
    if (done)
        return;
    (void)fprintf(stderr, "dryrig: the recording ends here, %s cannot be written: %s\n", r->path, strerror(errno));
    (void)fclose(r->file);
    r->file = NULL;
}

static void keep(record *r, dr_recorded_kind kind, const void *bytes, size_t count)
{
    if (r->file == NULL)
        return;
    const uint64_t when_us = r->inner.now_us(r->inner.context) - r->epoch_us;
    check(r, dr_recording_bytes(r->file, when_us, when_us, r->name, kind, bytes, count));
}

static int read_kept(void *context, void *bytes, size_t room, uint32_t timeout_us)
{
    record *const r = context;
    const int count = r->inner.read(r->inner.context, bytes, room, timeout_us);
    if (count > 0)
        keep(r, DR_RECORDING_TO_HOST, bytes, (size_t)count);
    return count;
}

static int write_kept(void *context, const void *bytes, size_t count)
{
    record *const r = context;
    keep(r, DR_RECORDING_FROM_HOST, bytes, count); /* before the answer, also where writing takes its time */
    return r->inner.write(r->inner.context, bytes, count);
}

static int purge(void *context)
{
    record *const r = context;
    return r->inner.purge(r->inner.context);
}

static uint64_t now_us(void *context)
{
    record *const r = context;
    return r->inner.now_us(r->inner.context);
}

static void sleep_us(void *context, uint32_t span_us)
{
    record *const r = context;
    r->inner.sleep_us(r->inner.context, span_us);
}

static void close_all(void *context)
{
    record *const r = context;
    r->inner.close(r->inner.context);
    if (r->file != NULL && fclose(r->file) != 0)
        (void)fprintf(stderr, "dryrig: %s is incomplete: %s\n", r->path, strerror(errno));
    r->file = NULL;
}

/* What is known before anything has been said. */
static bool introduce(const record *r, const command_line *line)
{
    char firmware[16];
    bool done = dr_recording_begin(r->file) && dr_recording_set(r->file, r->name, "controller", r->name);
    if (line->open.firmware != 0) {
        (void)dr_words_firmware(firmware, sizeof firmware, (uint16_t)line->open.firmware);
        done = dr_recording_set(r->file, r->name, "firmware", firmware) && done;
    }
    for (int i = 0; i < DRYRIG_DRIVES && line->open.stage[i] != NULL; i++)
        done = dr_recording_set(r->file, r->name, "device", line->open.stage[i]) && done;
    return done;
}

/* A pipe without a reader is refused: opening it would wait for one, with the controller. */
static FILE *open_file(const char *path)
{
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_NONBLOCK | O_CLOEXEC, 0666);
    if (fd >= 0)
        (void)fcntl(fd, F_SETFL, O_WRONLY);
    return fd < 0 ? NULL : fdopen(fd, "w");
}

int record_open(record *r, const command_line *line, dryrig_link *out, char *why, size_t room)
{
    memset(r, 0, sizeof *r);
    r->path = line->record;
    r->name = line->open.controller == DRYRIG_TRIO ? "trio" : "mpc";
    r->file = open_file(r->path);
    if (r->file == NULL || !introduce(r, line)) {
        (void)snprintf(why, room, "--record %s: %s", r->path,
                       errno == ENXIO ? "nobody reads this pipe; start its reader first" : strerror(errno));
        if (r->file != NULL)
            (void)fclose(r->file);
        return DRYRIG_ERR_ARGUMENT;
    }
    const int result = dryrig_link_open(&r->inner, line->open.port, line->open.baud, why, room);
    if (result != DRYRIG_OK) {
        (void)fclose(r->file);
        return result;
    }
    r->epoch_us = r->inner.now_us(r->inner.context);
    *out = (dryrig_link){r, read_kept, write_kept, purge, now_us, sleep_us, close_all};
    return DRYRIG_OK;
}
