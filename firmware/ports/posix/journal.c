#define _GNU_SOURCE /* gmtime_r, getline, flock */
#include "journal.h"

#include "guard_words.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define US_PER_S UINT64_C(1000000)
#define HEX_LENGTH (2u * DR_RECORD_BYTES)
#define LINE_ROOM (JOURNAL_TIME_MAX + GUARD_WORDS_MAX + HEX_LENGTH + 32u)

bool journal_open(journal *j, const char *path)
{
    struct stat is;
    memset(j, 0, sizeof *j);
    j->fd = -1;
    if (path == NULL)
        return true;
    j->created = access(path, F_OK) != 0 ? path : NULL;
    /* Not waiting: a pipe without a reader is refused, and so is what is no file. */
    j->fd = open(path, O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOCTTY | O_NONBLOCK, 0644);
    const bool is_file = j->fd >= 0 && fstat(j->fd, &is) == 0 && S_ISREG(is.st_mode);
    if (is_file &&
        (flock(j->fd, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)) /* where there are no locks: without */
        return true;
    const int why = j->fd < 0 ? errno : is_file ? EBUSY : EINVAL;
    journal_close(j);
    errno = why;
    return false;
}

void journal_close(journal *j)
{
    if (j->fd >= 0)
        (void)close(j->fd);
    if (j->fd >= 0 && j->created != NULL && j->count == 0)
        (void)unlink(j->created);
    j->fd = -1;
}

void journal_time(char text[JOURNAL_TIME_MAX], uint64_t wall_us)
{
    const time_t seconds = (time_t)(wall_us / US_PER_S);
    struct tm parts;
    char day[24] = "?";
    if (gmtime_r(&seconds, &parts) != NULL)
        (void)strftime(day, sizeof day, "%Y-%m-%dT%H:%M:%S", &parts);
    (void)snprintf(text, JOURNAL_TIME_MAX, "%s.%06uZ", day, (unsigned)(wall_us % US_PER_S));
}

void journal_hex(char *out, const dr_record *record)
{
    static const char digits[] = "0123456789abcdef";
    uint8_t bytes[DR_RECORD_BYTES];
    dr_record_put(record, bytes);
    for (unsigned i = 0; i < DR_RECORD_BYTES; i++) {
        *out++ = digits[bytes[i] >> 4];
        *out++ = digits[bytes[i] & 15u];
    }
    *out = '\0';
}

static bool write_line(const journal *j, const rig *r, const journal_entry *entry)
{
    char line[LINE_ROOM], time_text[JOURNAL_TIME_MAX], words[GUARD_WORDS_MAX], hex[HEX_LENGTH + 1u];
    journal_time(time_text, entry->wall_us);
    (void)guard_words_record(words, sizeof words, r, &entry->record);
    journal_hex(hex, &entry->record);
    const int length =
        snprintf(line, sizeof line, "%s %-11s %s #%s\n", time_text, guard_words_event(entry->record.event), words, hex);
    if (length < 0 || (size_t)length >= sizeof line)
        return false;
    if (j->has_failed && write(j->fd, "\n", 1) != 1) /* the last line may have been cut off */
        return false;
    const ssize_t written = write(j->fd, line, (size_t)length);
    if (written >= 0 && written < length)
        errno = ENOSPC;
    return written == length;
}

bool journal_add(journal *j, const rig *r, const dr_record *record, uint64_t wall_us)
{
    journal_entry *const entry = &j->kept[j->count++ % JOURNAL_KEPT];
    *entry = (journal_entry){wall_us, *record};
    j->has_failed = j->fd >= 0 && !write_line(j, r, entry);
    return !j->has_failed;
}

bool journal_retry(journal *j)
{
    if (j->has_failed)
        j->has_failed = write(j->fd, "\n", 1) != 1;
    return !j->has_failed;
}

const journal_entry *journal_last(const journal *j, uint64_t n)
{
    return n < j->count && n < JOURNAL_KEPT ? &j->kept[(j->count - 1u - n) % JOURNAL_KEPT] : NULL;
}

/* -- Reading ----------------------------------------------------------------------------------------------------------- */

static uint8_t nibble(char digit) { return (uint8_t)(digit <= '9' ? digit - '0' : digit - 'a' + 10); }

static bool get_bytes(const char *line, uint8_t bytes[DR_RECORD_BYTES])
{
    const char *hex = strrchr(line, '#');
    if (hex == NULL || strspn(hex + 1, "0123456789abcdef") != HEX_LENGTH || hex[HEX_LENGTH + 1u] != '\n')
        return false;
    hex++;
    for (unsigned i = 0; i < DR_RECORD_BYTES; i++)
        bytes[i] = (uint8_t)(nibble(hex[2u * i]) << 4 | nibble(hex[2u * i + 1u]));
    return true;
}

static uint32_t get_uint(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

/* As dr_record_put() has put it. */
static dr_record get_record(const uint8_t bytes[DR_RECORD_BYTES])
{
    dr_record r = {.sequence = get_uint(bytes), .when = get_uint(bytes + 4)};
    const uint8_t *const at = bytes + 8;
    r.event = at[0];
    r.before = at[1];
    r.after = at[2];
    r.code = at[3];
    r.axis = at[4];
    r.item = at[5];
    r.op = at[6];
    r.count = at[7];
    memcpy(r.bytes, bytes + 16, DR_RECORD_TEXT);
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        r.position_steps[axis] = get_uint(bytes + 16 + DR_RECORD_TEXT + 4u * axis);
    r.crc = get_uint(bytes + DR_RECORD_BYTES - 4u);
    return r;
}

bool journal_start_reading(journal_reader *r, const char *path)
{
    memset(r, 0, sizeof *r);
    r->path = path;
    r->file = fopen(path, "re");
    if (r->file == NULL)
        (void)snprintf(r->why, sizeof r->why, "%s: %s", path, strerror(errno));
    return r->file != NULL;
}

static bool wrong(journal_reader *r, const char *why)
{
    (void)snprintf(r->why, sizeof r->why, "%s:%llu: %s", r->path, (unsigned long long)r->line, why);
    return false;
}

/* The chain begins anew with every start of a guard, at sequence 0. */
bool journal_read(journal_reader *r, dr_record *out)
{
    uint8_t bytes[DR_RECORD_BYTES];
    do { /* an empty line: the log could not be written for a while */
        if (getline(&r->text, &r->room, r->file) <= 0)
            return ferror(r->file) != 0 ? wrong(r, strerror(errno)) : false;
        r->line++;
    } while (strcmp(r->text, "\n") == 0);
    if (!get_bytes(r->text, bytes))
        return wrong(r, "there is no whole record");
    *out = get_record(bytes);
    if (out->sequence != 0 && (r->records == 0 || out->sequence != r->sequence))
        return wrong(r, "records are missing before it");
    if (out->crc != dr_crc32c(out->sequence == 0 ? 0 : r->crc, bytes, DR_RECORD_BYTES - sizeof out->crc))
        return wrong(r, "the record was changed, or the one before it was");
    r->sequence = out->sequence + 1u;
    r->crc = out->crc;
    r->records++;
    r->starts += out->sequence == 0;
    return true;
}

void journal_stop_reading(journal_reader *r)
{
    free(r->text);
    if (r->file != NULL)
        (void)fclose(r->file);
    r->text = NULL;
    r->file = NULL;
}
