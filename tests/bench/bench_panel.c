/* What dryrig-panel costs in a terminal of 80 x 24, in per cent of a core, beside a client of the same control channel that
 * reads what it is told and does nothing: at rest, while a device moves, and while the wire carries 1,000 positions a second.
 *
 *     bench_panel EMULATOR PANEL [SECONDS]
 *
 * Prints a table; passes no judgement. Both are attached at the same time, so that a noisy machine disturbs both alike. */
#define _GNU_SOURCE /* wait4, forkpty, mkdtemp */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#define COLUMNS 80
#define ROWS 24

static void give_up(const char *what)
{
    (void)fprintf(stderr, "bench_panel: %s: %s\n", what, strerror(errno));
    exit(1);
}

static double now_s(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* -- Who takes part -------------------------------------------------------------------------------------------------- */

/* Returns its port, opened. */
static int start_emulator(char *program, char *control, pid_t *pid)
{
    char *command[] = {program, (char[]){"mpc"}, (char[]){"--control"}, control, NULL};
    char line[256] = "";
    int out[2];
    if (pipe(out) != 0 || (*pid = fork()) < 0)
        give_up("fork");
    if (*pid == 0) {
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
        (void)dup2(out[1], STDOUT_FILENO);
        (void)close(STDERR_FILENO);
        (void)execv(program, command);
        _exit(127);
    }
    (void)close(out[1]);
    const ssize_t count = read(out[0], line, sizeof line - 1);
    char *const path = count > 0 ? strstr(line, "/dev/pts/") : NULL;
    if (path == NULL)
        give_up("the emulator is not ready");
    (void)close(out[0]);
    path[strcspn(path, " \n")] = '\0';
    const int port = open(path, O_RDWR | O_NOCTTY);
    if (port < 0)
        give_up(path);
    return port;
}

static pid_t start_floor(const char *control)
{
    struct sockaddr_un where = {.sun_family = AF_UNIX};
    (void)snprintf(where.sun_path, sizeof where.sun_path, "%s", control);
    const pid_t pid = fork();
    if (pid != 0)
        return pid;
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    static char bytes[65536];
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (connect(fd, (struct sockaddr *)&where, sizeof where) != 0 || write(fd, "subscribe\n", 10) != 10)
        _exit(1);
    while (read(fd, bytes, sizeof bytes) > 0) {}
    _exit(0);
}

static pid_t start_panel(char *program, char *control, int *terminal)
{
    char *command[] = {program, control, NULL};
    const struct winsize size = {.ws_col = COLUMNS, .ws_row = ROWS};
    const pid_t pid = forkpty(terminal, NULL, NULL, &size);
    if (pid != 0)
        return pid;
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    (void)setenv("TERM", "xterm-256color", 1);
    (void)execv(program, command);
    _exit(127);
}

/* -- Measuring ------------------------------------------------------------------------------------------------------- */

/* Reads what comes, as a terminal and as a host do. */
static void attend(const int fds[2], double seconds)
{
    static char bytes[65536];
    const double end_s = now_s() + seconds;
    for (double left_s; (left_s = end_s - now_s()) > 0;) {
        struct pollfd all[] = {{fds[0], POLLIN, 0}, {fds[1], POLLIN, 0}};
        (void)poll(all, 2, (int)(left_s * 1000) + 1);
        for (int i = 0; i < 2; i++)
            if (all[i].revents != 0 && read(fds[i], bytes, sizeof bytes) <= 0)
                give_up(i == 0 ? "the panel has ended" : "the emulator has ended");
    }
}

/* Ends it. Returns the processor time that it has used. */
static double end(pid_t pid)
{
    struct rusage used;
    (void)kill(pid, SIGTERM);
    if (wait4(pid, NULL, 0, &used) != pid)
        give_up("wait4");
    return (double)used.ru_utime.tv_sec + (double)used.ru_stime.tv_sec +
           1e-6 * (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

static void say(int port, const void *bytes, size_t count)
{
    if (write(port, bytes, count) != (ssize_t)count)
        give_up("write");
    const struct timespec pause = {0, 30000000}; /* [M table 9, 'S'] */
    (void)nanosleep(&pause, NULL);
}

static void measure(char *const programs[2], char *control, const char *what, const char *command, double seconds)
{
    static const unsigned char far_away[12] = {0x80, 0x1A, 0x06, 0,    0x80, 0x1A,
                                               0x06, 0,    0x80, 0x1A, 0x06, 0}; /* 400,000 */
    pid_t emulator;
    int fds[2];
    fds[1] = start_emulator(programs[0], control, &emulator);
    const pid_t floor_ = start_floor(control), panel = start_panel(programs[1], control, &fds[0]);
    if (floor_ < 0 || panel < 0)
        give_up("fork");
    for (const char *at = command; *at != '\0'; at++)
        say(fds[1], at, 1);
    if (command[0] != '\0')
        say(fds[1], far_away, sizeof far_away);
    const double began_s = now_s();
    attend(fds, seconds);
    const double spent_s = now_s() - began_s, panel_s = end(panel), floor_s = end(floor_);
    (void)printf("%-24s %12.2f %12.2f %8.1f\n", what, 100 * floor_s / spent_s, 100 * panel_s / spent_s,
                 floor_s > 0 ? panel_s / floor_s : 0.0);
    (void)close(fds[0]);
    (void)close(fds[1]);
    (void)end(emulator);
}

int main(int argc, char **argv)
{
    char directory[] = "/tmp/dryrig-XXXXXX", control[64];
    if (argc < 3) {
        (void)fprintf(stderr, "bench_panel EMULATOR PANEL [SECONDS]\n");
        return 2;
    }
    const double seconds = argc > 3 ? strtod(argv[3], NULL) : 8; /* a move through the whole travel takes 8.3 s */
    if (mkdtemp(directory) == NULL)
        give_up("mkdtemp");
    (void)snprintf(control, sizeof control, "%s/control", directory);
    (void)printf("%% of a core                     floor dryrig-panel    ratio\n");
    measure(argv + 1, control, "at rest", "", seconds);
    measure(argv + 1, control, "moving", "M", seconds);
    measure(argv + 1, control, "streaming at speed 15", "OS\x0f", seconds);
    (void)rmdir(directory);
    return 0;
}
