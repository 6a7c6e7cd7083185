#define _GNU_SOURCE
#include "child.h"

#include <errno.h>
#include <spawn.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

pid_t child_start(char **command, const sigset_t *mask, int *exit_status)
{
    posix_spawnattr_t attributes;
    pid_t child = 0;
    sigset_t usual; /* what this program has changed for itself */
    (void)sigemptyset(&usual);
    (void)sigaddset(&usual, SIGPIPE);
    (void)posix_spawnattr_init(&attributes);
    (void)posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    (void)posix_spawnattr_setsigmask(&attributes, mask);
    (void)posix_spawnattr_setsigdefault(&attributes, &usual);
    const int wrong = posix_spawnp(&child, command[0], NULL, &attributes, command, environ);
    (void)posix_spawnattr_destroy(&attributes);
    if (wrong == 0)
        return child;
    (void)fprintf(stderr, "dryrig-emu: run: %s: %s\n", command[0], strerror(wrong));
    *exit_status = wrong == ENOENT || wrong == ENOTDIR ? 127 : 126;
    return 0;
}

bool child_has_ended(pid_t child, int *exit_status)
{
    int how;
    if (waitpid(child, &how, WNOHANG) != child)
        return false;
    *exit_status = WIFEXITED(how) ? WEXITSTATUS(how) : 128 + WTERMSIG(how);
    return true;
}
