/* script: a scenario file: lines of the control channel's language, for a controller or for a rig.
 *
 * A line is carried out when the controllers start, in order; what is to come later says so (`at`, `after`, `on`). A '#'
 * begins a comment. What is wrong is told as FILE:LINE:COLUMN before anything starts.
 * Thread-safety: one thread. */
#ifndef SCRIPT_H
#define SCRIPT_H

#include "language.h" /* what can be said */

typedef struct {
    const char *path;
    const char
        *whose; /* the controller's name: whose lines they are, where they name nobody; NULL: as on the command line */
    char *text; /* the file */
} script;

/* Reads a file. False: why[] tells. */
bool script_open(script *s, const char *path, const char *whose, char *why, size_t room);
/* Could every line be carried out? False: why[] tells about the first that could not. */
bool script_check(const script *s, language *l, char *why, size_t room);
/* Carries them out. False: why[] tells; the lines behind it are not carried out. */
bool script_do(const script *s, language *l, char *why, size_t room);
void script_close(script *s);

#endif
