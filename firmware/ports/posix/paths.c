#define _GNU_SOURCE /* readlink */
#include "paths.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define LINKS_MAX 40 /* as the kernel's */

/* A name in a directory that is there. */
typedef struct {
    bool is_known;
    struct stat directory;
    char name[NAME_MAX + 1];
} place;

typedef struct {
    bool is_file; /* that is there */
    struct stat file;
    place given, last; /* the name itself, and the one that it leads to */
} findings;

/* Where the link at `path` leads, one step. False: it is none. */
static bool follow(char path[PATH_MAX])
{
    char target[PATH_MAX], next[2 * PATH_MAX];
    const ssize_t length = readlink(path, target, sizeof target - 1u);
    if (length < 0)
        return false;
    target[length] = '\0';
    const char *const slash = target[0] == '/' ? NULL : strrchr(path, '/');
    const int needed = snprintf(next, sizeof next, "%.*s%s", slash == NULL ? 0 : (int)(slash - path) + 1, path, target);
    if (needed < 0 || needed >= PATH_MAX)
        return false;
    memcpy(path, next, (size_t)needed + 1u);
    return true;
}

static void find_place(place *p, const char *path)
{
    char directory[PATH_MAX];
    const char *const slash = strrchr(path, '/');
    const char *const name = slash == NULL ? path : slash + 1;
    (void)snprintf(directory, sizeof directory, "%.*s", slash == NULL ? 0 : (int)(slash - path) + 1, path);
    p->is_known = strlen(name) < sizeof p->name && stat(slash == NULL ? "." : directory, &p->directory) == 0;
    if (p->is_known)
        memcpy(p->name, name, strlen(name) + 1u);
}

static void find(findings *f, const path_use *use)
{
    char path[PATH_MAX];
    memset(f, 0, sizeof *f);
    if (use->path == NULL || strlen(use->path) >= sizeof path)
        return;
    memcpy(path, use->path, strlen(use->path) + 1u);
    find_place(&f->given, path);
    if (use->is_name)
        return;
    f->is_file = stat(path, &f->file) == 0;
    for (unsigned n = 0; n < LINKS_MAX && follow(path); n++) {}
    find_place(&f->last, path);
}

static bool is_same(const struct stat *a, const struct stat *b)
{
    return a->st_dev == b->st_dev && a->st_ino == b->st_ino;
}

static bool is_same_place(const place *a, const place *b)
{
    return a->is_known && b->is_known && is_same(&a->directory, &b->directory) && strcmp(a->name, b->name) == 0;
}

bool paths_clash(const path_use *uses, size_t count, size_t *first, size_t *second)
{
    findings a, b;
    for (*second = 1; *second < count; ++*second)
        for (*first = 0; *first < *second; ++*first) {
            find(&a, &uses[*first]);
            find(&b, &uses[*second]);
            if ((a.is_file && b.is_file && is_same(&a.file, &b.file)) || is_same_place(&a.given, &b.given) ||
                is_same_place(&a.given, &b.last) || is_same_place(&a.last, &b.given) || is_same_place(&a.last, &b.last))
                return true;
        }
    return false;
}
