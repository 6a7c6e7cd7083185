#define _GNU_SOURCE /* realpath, O_CLOEXEC, fchmod */
#include "kept.h"

#include "kept_text.h" /* the text of the file */
#include "late.h"      /* writing takes its time */
#include "link.h"      /* a lock on its name */

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define NEW ".new" /* behind the name of a file that is being written */

/* -- An instrument ------------------------------------------------------------------------------------------------------- */

static unsigned switches_in(const kept_state *k, dr_switches bank)
{
    switch (bank) {
    case DR_SWITCHES_REAR:
        return k->kind == DR_TRIO ? 6 : 8;
    case DR_SWITCHES_INTERNAL:
        return k->kind == DR_TRIO ? 4 : 0;
    case DR_SWITCHES_ROE:
        return k->kind == DR_TRIO ? 0 : 4;
    case DR_SWITCHES_RIGHT:
    default:
        return k->kind == DR_TRIO ? 0 : 1;
    }
}

static uint8_t switches_of(const kept_state *k, const instrument *ins, dr_switches bank, uint8_t drive)
{
    uint8_t bits = 0;
    for (uint8_t number = 1; number <= switches_in(k, bank); number++)
        if (dr_panel_switch_is_on(&ins->panel, bank, drive, number))
            bits = (uint8_t)(bits | 1u << (number - 1u));
    return bits;
}

kept_state kept_of(const instrument *ins)
{
    const dr_controller *const c = &ins->controller;
    kept_state k = {.kind = (dr_kind)c->kind};
    if (k.kind == DR_TRIO) {
        memcpy(k.home_steps, c->home_steps, sizeof k.home_steps);
        k.angle_deg = c->angle_deg;
    }
    k.inside = switches_of(&k, ins, k.kind == DR_TRIO ? DR_SWITCHES_INTERNAL : DR_SWITCHES_ROE, 0);
    for (uint8_t i = 0; i < c->drive_count; i++) {
        kept_drive *const d = &k.drives[i];
        d->stage = c->drives[i].stage;
        d->rear = switches_of(&k, ins, DR_SWITCHES_REAR, i);
        d->right = switches_of(&k, ins, DR_SWITCHES_RIGHT, i);
        if (d->stage == DR_STAGE_NONE)
            continue;
        dr_controller_position(c, i, instrument_now(ins), d->position_steps);
        d->calibration = c->drives[i].calibration;
        d->work_is_set = c->drives[i].work_is_set;
        if (d->work_is_set)
            memcpy(d->work_steps, c->drives[i].work_steps, sizeof d->work_steps);
    }
    return k;
}

static void set_bank(const kept_state *k, instrument *ins, dr_switches bank, uint8_t drive, uint8_t bits)
{
    for (uint8_t number = 1; number <= switches_in(k, bank);
         number++) /* one that follows the device stays: it is right */
        (void)dr_panel_switch(&ins->panel, bank, drive, number, ((unsigned)bits >> (number - 1u) & 1u) != 0);
}

void kept_switches(const kept_state *k, instrument *ins)
{
    set_bank(k, ins, k->kind == DR_TRIO ? DR_SWITCHES_INTERNAL : DR_SWITCHES_ROE, 0, k->inside);
    for (uint8_t i = 0; i < ins->controller.drive_count; i++) {
        set_bank(k, ins, DR_SWITCHES_REAR, i, k->drives[i].rear);
        set_bank(k, ins, DR_SWITCHES_RIGHT, i, k->drives[i].right);
    }
    dr_panel_read_switches(&ins->panel);
}

/* -- The file ------------------------------------------------------------------------------------------------------------ */

static bool is_same_drive(const kept_drive *a, const kept_drive *b)
{
    return memcmp(a->position_steps, b->position_steps, sizeof a->position_steps) == 0 &&
           memcmp(a->work_steps, b->work_steps, sizeof a->work_steps) == 0 && a->stage == b->stage &&
           a->calibration == b->calibration && a->rear == b->rear && a->right == b->right &&
           a->work_is_set == b->work_is_set;
}

static bool is_same(const kept_state *a, const kept_state *b)
{
    for (unsigned i = 0; i < DR_PORTS; i++)
        if (!is_same_drive(&a->drives[i], &b->drives[i]))
            return false;
    return a->kind == b->kind && a->angle_deg == b->angle_deg && a->inside == b->inside &&
           memcmp(a->home_steps, b->home_steps, sizeof a->home_steps) == 0;
}

static uint64_t now_us(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000u + (uint64_t)now.tv_nsec / 1000u;
}

/* Writes all of it to path; whoever may read the old one may read it. */
static bool write_file(const char *path, const char *old_path, const kept_state *k)
{
    struct stat old;
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
    FILE *const file = fd < 0 ? NULL : fdopen(fd, "w");
    if (file == NULL)
        return false;
    kept_print(file, k);
    bool done = fflush(file) == 0 && ferror(file) == 0 && fsync(fd) == 0;
    if (done && stat(old_path, &old) == 0)
        done = fchmod(fd, old.st_mode & 07777u) == 0;
    const int error = errno;
    if (fclose(file) != 0 && done)
        return false;
    errno = error;
    return done;
}

/* The old one or the new one, at any instant. False: errno says why; the old one is there. */
static bool replace(kept_file *f, const kept_state *k)
{
    char path[PATH_MAX];
    const uint64_t began_us = now_us();
    (void)snprintf(path, sizeof path, "%s" NEW, f->path);
    const bool done = write_file(path, f->path, k) && rename(path, f->path) == 0;
    if (!done) {
        const int error = errno;
        (void)unlink(path);
        errno = error;
    }
    late_add(now_us() - began_us);
    if (done)
        f->last = *k;
    return done;
}

static bool is_as_expected(const kept_file *f, const kept_state *expected, char why[WHY_ROOM])
{
    kept_state present;
    bool is_there;
    struct stat is;
    if (stat(f->path, &is) == 0 && !S_ISREG(is.st_mode)) {
        (void)snprintf(why, WHY_ROOM, "%s is no file", f->path);
        return false;
    }
    if (!kept_read(f->path, &present, &is_there, why))
        return false;
    if (is_there == (expected != NULL) && (!is_there || is_same(&present, expected)))
        return true;
    (void)snprintf(why, WHY_ROOM, "%s has changed just now; start again", f->path);
    return false;
}

bool kept_open(kept_file *f, const char *path, const kept_state *expected, char why[WHY_ROOM])
{
    memset(f, 0, sizeof *f);
    f->lock = -1;
    f->path = expected == NULL ? strdup(path) : realpath(path, NULL); /* behind a symbolic link is the file itself */
    if (f->path == NULL || strlen(f->path) + sizeof NEW > PATH_MAX) {
        (void)snprintf(why, WHY_ROOM, "%s: %s", path, f->path == NULL ? strerror(errno) : strerror(ENAMETOOLONG));
    } else if ((f->lock = link_lock_name(f->path)) < 0) {
        if (errno == EADDRINUSE)
            (void)snprintf(why, WHY_ROOM,
                           "%s: another emulator keeps its state there; stop that, or choose another file", path);
        else
            (void)snprintf(why, WHY_ROOM, "%s: %s", path, strerror(errno));
    } else if (is_as_expected(f, expected, why)) {
        if (expected != NULL)
            f->last = *expected;
        return true;
    }
    if (f->lock >= 0)
        (void)close(f->lock);
    free(f->path);
    f->path = NULL;
    return false;
}

bool kept_begin(kept_file *f, const instrument *ins, char why[WHY_ROOM])
{
    const kept_state present = kept_of(ins);
    f->has_begun = f->path != NULL && (is_same(&present, &f->last) || replace(f, &present));
    if (f->path != NULL && !f->has_begun)
        (void)snprintf(why, WHY_ROOM, "%s cannot be written: %s", f->path, strerror(errno));
    return f->path == NULL || f->has_begun;
}

static bool write_changes(kept_file *f, const instrument *ins)
{
    const kept_state present = kept_of(ins);
    if (is_same(&present, &f->last) || replace(f, &present))
        return true;
    if (!f->told)
        (void)fprintf(stderr, "dryrig-emu: the state cannot be kept, %s stays as it was: %s\n", f->path,
                      strerror(errno));
    f->told = true;
    return false;
}

void kept_update(kept_file *f, const instrument *ins)
{
    const uint8_t state = ins->controller.state;
    if (f->has_begun && state != DR_STATE_MOVING && state != DR_STATE_PAUSED)
        (void)write_changes(f, ins);
}

bool kept_close(kept_file *f, const instrument *ins)
{
    const bool done = !f->has_begun || write_changes(f, ins);
    if (f->path != NULL)
        (void)close(f->lock);
    free(f->path);
    memset(f, 0, sizeof *f);
    return done;
}
