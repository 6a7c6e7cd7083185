/* record: keeps what goes over the line in a recording (dr_recording.h), at the controller's side of the library.
 *
 * Thread-safety: as the link that it wraps. */
#ifndef RECORD_H
#define RECORD_H

#include "options.h"

#include <stdio.h>

typedef struct {
    dryrig_link inner;
    const char *path;
    FILE *file; /* NULL: it could not be written any more; that has been said */
    const char *name;
    uint64_t epoch_us;
} record;

/* Opens the port of line->open, wrapped, and the file. `r` stays where it is until the link is closed; *out goes to
 * dryrig_options.link. DRYRIG_OK, or what dryrig_link_open() says, or DRYRIG_ERR_ARGUMENT where the file cannot be written. */
int record_open(record *r, const command_line *line, dryrig_link *out, char *why, size_t room);

#endif
