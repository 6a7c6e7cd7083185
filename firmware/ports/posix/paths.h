/* paths: which of the paths that somebody has given name the same file, however they are spelled: ./x, a hard link, a
 * symbolic link, also to a file that is not there yet.
 *
 * Thread-safety: functions of their arguments only. */
#ifndef PATHS_H
#define PATHS_H

#include <stdbool.h>
#include <stddef.h>

typedef struct {
    const char *option, *path; /* NULL: not given */
    bool is_name;              /* a symbolic link that stands there is replaced, not followed */
} path_use;

/* Two that are the same? Their numbers. */
bool paths_clash(const path_use *uses, size_t count, size_t *first, size_t *second);

#endif
