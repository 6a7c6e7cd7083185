#include "dr_recording.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#define US_PER_S UINT64_C(1000000)
#define MAGIC "dryrig-recording "
#define SECONDS_MAX UINT64_C(1000000000) /* 31 years */

/* -- Writing ------------------------------------------------------------------------------------------------------------- */

bool dr_recording_begin(FILE *file) { return fprintf(file, MAGIC "%d\n", DR_RECORDING_VERSION) > 0; }

bool dr_recording_set(FILE *file, const char *name, const char *key, const char *value)
{
    return fprintf(file, "set %s %s %s\n", name, key, value) > 0;
}

static bool put_head(FILE *file, uint64_t when_us, uint64_t real_us, const char *name, dr_recorded_kind kind)
{
    return fprintf(file, "%llu.%06u %llu.%06u %s %c", (unsigned long long)(when_us / US_PER_S),
                   (unsigned)(when_us % US_PER_S), (unsigned long long)(real_us / US_PER_S),
                   (unsigned)(real_us % US_PER_S), name, (char)kind) > 0;
}

bool dr_recording_bytes(FILE *file, uint64_t when_us, uint64_t real_us, const char *name, dr_recorded_kind kind,
                        const uint8_t *bytes, size_t count)
{
    bool done = true;
    for (size_t at = 0; at < count; at++) {
        if (at % DR_RECORDING_BYTES == 0)
            done = put_head(file, when_us, real_us, name, kind) && done;
        done = fprintf(file, " %02X", (unsigned)bytes[at]) > 0 && done;
        if (at % DR_RECORDING_BYTES == DR_RECORDING_BYTES - 1u || at == count - 1u)
            done = fputc('\n', file) != EOF && done;
    }
    return done;
}

bool dr_recording_event(FILE *file, uint64_t when_us, uint64_t real_us, const char *name, const char *text)
{
    return put_head(file, when_us, real_us, name, DR_RECORDING_EVENT) && fprintf(file, " %s\n", text) > 0;
}

/* -- Reading ------------------------------------------------------------------------------------------------------------- */

#if defined(__GNUC__)
static bool wrong(dr_recording_reader *reader, const char *format, ...) __attribute__((format(printf, 2, 3)));
#endif

static bool wrong(dr_recording_reader *reader, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    /* NOLINTNEXTLINE(clang-analyzer-valist.Uninitialized): the analyzer of LLVM 14 overlooks va_start() */
    (void)vsnprintf(reader->why, sizeof reader->why, format, arguments);
    va_end(arguments);
    return false;
}

/* A line without its line feed. False: the end, or why[]. */
static bool get_line(dr_recording_reader *reader, char line[DR_RECORDING_LINE])
{
    if (fgets(line, (int)DR_RECORDING_LINE, reader->file) == NULL)
        return ferror(reader->file) != 0 ? wrong(reader, "it cannot be read") : false;
    reader->line++;
    const size_t length = strlen(line);
    if (length == 0 || line[length - 1u] != '\n')
        return feof(reader->file) != 0 ? wrong(reader, "the line is torn off: the recording ended in it")
                                       : wrong(reader, "the line is longer than %u characters", DR_RECORDING_LINE - 2u);
    line[length - 1u] = '\0';
    if (length > 1 && line[length - 2u] == '\r')
        line[length - 2u] = '\0';
    return true;
}

bool dr_recording_open(dr_recording_reader *reader, FILE *file)
{
    char line[DR_RECORDING_LINE];
    memset(reader, 0, sizeof *reader);
    reader->file = file;
    if (!get_line(reader, line))
        return reader->why[0] != '\0' ? false : wrong(reader, "it is empty; a recording begins with '" MAGIC "1'");
    if (strncmp(line, MAGIC, strlen(MAGIC)) != 0)
        return wrong(reader, "it is no recording: one begins with '" MAGIC "1'");
    if (strcmp(line + strlen(MAGIC), "1") != 0)
        return wrong(reader, "its version is '%.16s'; this program knows version %d", line + strlen(MAGIC),
                     DR_RECORDING_VERSION);
    return true;
}

/* The next word of a line, up to the next blank, and where what follows begins. */
static char *next_word(char **at)
{
    char *const word = *at;
    *at += strcspn(*at, " ");
    if (**at == ' ')
        *(*at)++ = '\0';
    return word;
}

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

/* "12.000345", exactly six decimals. */
static bool read_time(const char *text, uint64_t *us)
{
    uint64_t seconds = 0, micros = 0;
    const char *at = text;
    for (; is_digit(*at) && seconds < SECONDS_MAX; at++)
        seconds = seconds * 10u + (uint64_t)(*at - '0');
    if (at == text || *at++ != '.')
        return false;
    for (int i = 0; i < 6; i++, at++) {
        if (!is_digit(*at))
            return false;
        micros = micros * 10u + (uint64_t)(*at - '0');
    }
    *us = seconds * US_PER_S + micros;
    return *at == '\0';
}

static int hex_digit(char c)
{
    if (is_digit(c))
        return c - '0';
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static bool read_bytes(dr_recording_reader *reader, char *text, dr_recorded *out)
{
    while (*text != '\0') {
        const char *const word = next_word(&text);
        const int high = hex_digit(word[0]), low = high < 0 ? -1 : hex_digit(word[1]);
        if (low < 0 || word[2] != '\0')
            return wrong(reader, "'%.16s' is no byte: two hexadecimal digits, with a blank between bytes", word);
        if (out->count == DR_RECORDING_BYTES)
            return wrong(reader, "more than %u bytes in one line", DR_RECORDING_BYTES);
        out->bytes[out->count++] = (uint8_t)(high * 16 + low);
    }
    return out->count > 0 || wrong(reader, "bytes are missing");
}

static bool read_name(dr_recording_reader *reader, const char *word, dr_recorded *out)
{
    if (*word == '\0' || strlen(word) >= sizeof out->name)
        return wrong(reader, "a controller's name is missing, or longer than %u characters", DR_RECORDING_NAME - 1u);
    (void)snprintf(out->name, sizeof out->name, "%s", word);
    return true;
}

static bool read_setting(dr_recording_reader *reader, char *at, dr_recorded *out)
{
    out->kind = DR_RECORDING_SETTING;
    if (!read_name(reader, next_word(&at), out))
        return false;
    const char *const key = next_word(&at);
    if (*key == '\0' || strlen(key) >= sizeof out->key || *at == '\0')
        return wrong(reader, "expected: set NAME KEY VALUE");
    (void)snprintf(out->key, sizeof out->key, "%s", key);
    (void)snprintf(out->text, sizeof out->text, "%s", at);
    return true;
}

static bool read_line(dr_recording_reader *reader, char *at, dr_recorded *out)
{
    const char *const first = next_word(&at);
    if (strcmp(first, "set") == 0)
        return read_setting(reader, at, out);
    if (!read_time(first, &out->when_us) || !read_time(next_word(&at), &out->real_us))
        return wrong(reader, "expected two times in seconds, with six decimals each, or 'set'");
    if (!read_name(reader, next_word(&at), out))
        return false;
    const char *const kind = next_word(&at);
    if (strlen(kind) != 1 || strchr("<>!-", kind[0]) == NULL)
        return wrong(reader, "'%.16s' is none of > < ! -", kind);
    out->kind = (uint8_t)kind[0];
    if (out->kind != DR_RECORDING_EVENT)
        return read_bytes(reader, at, out);
    (void)snprintf(out->text, sizeof out->text, "%s", at);
    return true;
}

bool dr_recording_next(dr_recording_reader *reader, dr_recorded *out)
{
    char line[DR_RECORDING_LINE];
    while (get_line(reader, line)) { /* to the first that means something */
        if (line[0] == '\0' || line[0] == '#')
            continue;
        memset(out, 0, sizeof *out);
        return read_line(reader, line, out);
    }
    return false;
}
