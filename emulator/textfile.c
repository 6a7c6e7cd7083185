#define _GNU_SOURCE /* getdelim, fopen "e" */
#include "textfile.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *what_is_wrong = "";

const char *textfile_why(void) { return what_is_wrong; }

char *textfile_read(const char *path)
{
    FILE *const file = fopen(path, "re");
    char *text = NULL;
    size_t size = 0;
    errno = file == NULL ? errno : 0;
    const ssize_t length = file == NULL ? -1 : getdelim(&text, &size, '\0', file);
    const int error = errno;
    const bool is_text = length <= 0 || text[length - 1] != '\0';
    if (file != NULL)
        (void)fclose(file);
    if (length < 0 || !is_text) {
        free(text);
        what_is_wrong = error != 0 ? strerror(error) : "it is no text, there is a byte 0 in it";
        return length < 0 && error == 0 ? calloc(1, 1) : NULL; /* an empty one */
    }
    return text;
}

unsigned textfile_column(const char *text, unsigned line, const char *word)
{
    const char *at = text;
    for (unsigned i = 1; i < line && at != NULL; i++)
        at = strchr(at, '\n') == NULL ? NULL : strchr(at, '\n') + 1;
    if (at == NULL)
        return 1;
    const size_t length = strcspn(at, "\n");
    const char *const found = word == NULL || *word == '\0' ? NULL : strstr(at, word);
    if (found != NULL && found < at + length)
        return (unsigned)(found - at) + 1u;
    return (unsigned)strspn(at, " \t") + 1u;
}
