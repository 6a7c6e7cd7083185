/* rig: the controllers of one emulator: the one that the options ask for, or those of a rig file.
 *
 * A rig file is in libconfig's language:
 *
 *     controllers = (
 *         { name = "left";  controller = "mpc"; link = "/tmp/left"; devices = [ "MP-845", "none", "MP-285" ];
 *           positions = [ "1000um,0um,500um" ]; quirks = "observed"; do = [ "fault drop-cr next" ]; },
 *         { name = "right"; controller = "trio"; angle = "30"; home = "0,0,0"; works = [ "0,0,1000" ]; }
 *     );
 *
 * Thread-safety: one thread. */
#ifndef RIG_H
#define RIG_H

#include "setup.h" /* one controller */

#define RIG_NAME_MAX 32u
#define RIG_MAX 256u
#define RIG_DO_MAX 32u

typedef struct {
    char name[RIG_NAME_MAX];
    const char *link;            /* NULL: none */
    const char *scenario;        /* a file of what is done; NULL: none */
    const char *do_[RIG_DO_MAX]; /* what is done at the start, in the control channel's language */
    unsigned do_line[RIG_DO_MAX], do_column[RIG_DO_MAX]; /* where that stands in the file */
    unsigned do_count;
    setup setup;
} rig_member;

typedef struct {
    rig_member *members;
    unsigned count;
} rig;

/* Reads a file. False: why[] begins with the file's name, the line and the column. What is read stays until the program ends. */
bool rig_read(rig *r, const char *path, bool is_paced_by_default, char *why, size_t room);
/* A rig of one. False: no memory. */
bool rig_of_one(rig *r, const setup *s, const char *link);

#endif
