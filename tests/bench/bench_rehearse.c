/* What rehearsing costs: 64 controllers in one process, beside one process that does nothing but read a byte from each of 64
 * pseudo-terminals and write 14 back; moves through the whole travel with --clock jump, beside moves of no length; and `run`,
 * beside a shell that runs the same command: from its end to theirs, and all in all.
 *
 *     bench_rehearse EMULATOR [ROUNDS [MOVES [RUNS]]]
 *
 * Prints a table; passes no judgement. What is compared is run in turns, so that a noisy machine disturbs both alike. */
#define _GNU_SOURCE /* posix_openpt, cfmakeraw, mkdtemp */
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define PORTS 64
#define REPLY 14
#define TURNS 10

typedef struct {
    pid_t pid;
    int fds[PORTS]; /* the host's ends */
    double spent_s;
} subject;

static void give_up(const char *what)
{
    (void)fprintf(stderr, "bench_rehearse: %s: %s\n", what, strerror(errno));
    exit(1);
}

static double now_s(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static pid_t fork_child(void)
{
    const pid_t pid = fork();
    if (pid < 0)
        give_up("fork");
    if (pid == 0)
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    return pid;
}

static int open_port(const char *path)
{
    const int fd = open(path, O_RDWR | O_NOCTTY);
    if (fd < 0)
        give_up(path);
    return fd;
}

/* -- The floor --------------------------------------------------------------------------------------------------------- */

static void respond(const int *masters)
{
    static const char reply[REPLY] = {1};
    const int all = epoll_create1(0);
    for (int i = 0; i < PORTS; i++) {
        struct epoll_event event = {.events = EPOLLIN, .data.fd = masters[i]};
        (void)epoll_ctl(all, EPOLL_CTL_ADD, masters[i], &event);
    }
    for (;;) {
        struct epoll_event events[PORTS];
        const int count = epoll_wait(all, events, PORTS, -1);
        for (int i = 0; i < count; i++) {
            char byte;
            if (read(events[i].data.fd, &byte, 1) != 1 || write(events[i].data.fd, reply, REPLY) != REPLY)
                _exit(0);
        }
    }
}

static void start_floor(subject *s)
{
    int masters[PORTS];
    for (int i = 0; i < PORTS; i++) {
        struct termios raw;
        masters[i] = posix_openpt(O_RDWR | O_NOCTTY);
        if (masters[i] < 0 || unlockpt(masters[i]) != 0)
            give_up("no pseudo-terminal to be had");
        s->fds[i] = open_port(ptsname(masters[i]));
        (void)tcgetattr(s->fds[i], &raw);
        cfmakeraw(&raw);
        (void)tcsetattr(s->fds[i], TCSANOW, &raw);
    }
    s->pid = fork_child();
    if (s->pid == 0)
        respond(masters);
    for (int i = 0; i < PORTS; i++)
        (void)close(masters[i]);
}

/* -- The emulator -------------------------------------------------------------------------------------------------------- */

/* Starts it and opens the ports that its line tells. */
static void start_emulator(subject *s, char **command, int ports)
{
    static char line[8192];
    int out[2];
    if (pipe(out) != 0)
        give_up("pipe");
    s->pid = fork_child();
    if (s->pid == 0) {
        (void)dup2(out[1], STDOUT_FILENO);
        (void)close(STDERR_FILENO);
        (void)execv(command[0], command);
        _exit(127);
    }
    (void)close(out[1]);
    FILE *const file = fdopen(out[0], "r");
    if (file == NULL || fgets(line, sizeof line, file) == NULL || strncmp(line, "ready", 5) != 0)
        give_up("the emulator is not ready");
    (void)fclose(file);
    char *at = line;
    for (int i = 0; i < ports; i++) {
        char path[32];
        at = strstr(at, "/dev/pts/");
        const int length = at == NULL ? 0 : (int)strcspn(at, " \n");
        if (length == 0 || length >= (int)sizeof path)
            give_up("the emulator told no port");
        (void)snprintf(path, sizeof path, "%.*s", length, at);
        s->fds[i] = open_port(path);
        at += length;
    }
}

static void stop(const subject *s, int ports)
{
    for (int i = 0; i < ports; i++)
        (void)close(s->fds[i]);
    (void)kill(s->pid, SIGTERM);
    (void)waitpid(s->pid, NULL, 0);
}

static double resident_mib(pid_t pid)
{
    char path[64], line[256];
    double kib = 0;
    (void)snprintf(path, sizeof path, "/proc/%d/status", (int)pid);
    FILE *const file = fopen(path, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, "VmRSS:", 6) == 0)
            kib = strtod(line + 6, NULL);
    if (file != NULL)
        (void)fclose(file);
    return kib / 1024;
}

/* -- Measuring ------------------------------------------------------------------------------------------------------------ */

static void take(int fd, size_t count)
{
    char bytes[REPLY];
    while (count > 0) {
        const ssize_t got = read(fd, bytes, count);
        if (got <= 0)
            give_up("no answer");
        count -= (size_t)got;
    }
}

static void ask_all(subject *s, unsigned rounds)
{
    const double began_s = now_s();
    for (unsigned round = 0; round < rounds; round++) {
        for (int i = 0; i < PORTS; i++)
            if (write(s->fds[i], "C", 1) != 1)
                give_up("write");
        for (int i = 0; i < PORTS; i++)
            take(s->fds[i], REPLY);
    }
    s->spent_s += now_s() - began_s;
}

static void many_controllers(char *emulator, unsigned rounds)
{
    static char directory[] = "/tmp/dryrig-XXXXXX";
    char rig[64];
    subject floor_ = {0}, rigged = {0};
    if (mkdtemp(directory) == NULL)
        give_up("mkdtemp");
    (void)snprintf(rig, sizeof rig, "%s/rig", directory);
    FILE *const file = fopen(rig, "w");
    if (file == NULL)
        give_up(rig);
    for (int i = 0; i < PORTS; i++)
        (void)fprintf(file, "%s{ controller = \"mpc\"; name = \"c%d\"; pace = \"off\"; }%s",
                      i == 0 ? "controllers = (" : ",\n", i, i + 1 == PORTS ? ");\n" : "");
    (void)fclose(file);
    char *command[] = {emulator, (char[]){"rig"}, rig, NULL};
    start_floor(&floor_);
    start_emulator(&rigged, command, PORTS);
    (void)unlink(rig);
    (void)rmdir(directory);
    for (unsigned turn = 0; turn < TURNS; turn++) {
        ask_all(&floor_, rounds / TURNS + 1);
        ask_all(&rigged, rounds / TURNS + 1);
    }
    const unsigned asked_each = rounds / TURNS + 1;
    const double asked = (double)PORTS * TURNS * asked_each;
    (void)printf("                                       floor dryrig-emu    ratio\n");
    (void)printf("commands a second, 64 ports     %12.0f %10.0f %8.2f\n", asked / floor_.spent_s,
                 asked / rigged.spent_s, floor_.spent_s / rigged.spent_s);
    (void)printf("resident memory, 64 ports  MiB  %12.2f %10.2f %8.2f\n", resident_mib(floor_.pid),
                 resident_mib(rigged.pid), resident_mib(rigged.pid) / resident_mib(floor_.pid));
    stop(&floor_, PORTS);
    stop(&rigged, PORTS);
}

static double move_all(int fd, unsigned moves, unsigned target_steps)
{
    const double began_s = now_s();
    for (unsigned i = 0; i < moves; i++) {
        unsigned char frame[13] = {'M'};
        for (unsigned at = 1; at < 13 && i % 2 == 0; at++)
            frame[at] = (unsigned char)(target_steps >> 8 * ((at - 1) % 4));
        if (write(fd, frame, sizeof frame) != (ssize_t)sizeof frame)
            give_up("write");
        take(fd, 1);
    }
    return now_s() - began_s;
}

static void long_moves(char *emulator, unsigned moves)
{
    char *command[] = {emulator, (char[]){"mpc"}, (char[]){"--clock"}, (char[]){"jump"}, NULL};
    subject s = {0};
    double none_s = 0, whole_s = 0;
    start_emulator(&s, command, 1);
    for (unsigned turn = 0; turn < TURNS; turn++) { /* an even number of moves each: they end where they began, at 0 */
        none_s += move_all(s.fds[0], moves / TURNS / 2 * 2 + 2, 0);
        whole_s += move_all(s.fds[0], moves / TURNS / 2 * 2 + 2, 400000);
    }
    (void)printf("\n                                   no length     travel    ratio\n");
    (void)printf("%5u moves, --clock jump    ms  %12.1f %10.1f %8.2f\n", TURNS * (moves / TURNS / 2 * 2 + 2),
                 1e3 * none_s, 1e3 * whole_s, whole_s / none_s);
    stop(&s, 1);
}

/* -- run ------------------------------------------------------------------------------------------------------------------ */

#define STAMP "--stamp" /* this program as the command: it tells the time and ends */

static int stamp(void)
{
    const double at_s = now_s();
    return fwrite(&at_s, sizeof at_s, 1, stdout) == 1 && fflush(stdout) == 0 ? 0 : 1;
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* How long it ran, and how much of that after its command's end. */
static void time_one(char **command, double *whole_s, double *behind_s)
{
    int out[2];
    double at_s = 0;
    if (pipe(out) != 0)
        give_up("pipe");
    const double began_s = now_s();
    const pid_t pid = fork_child();
    if (pid == 0) {
        (void)dup2(out[1], STDOUT_FILENO);
        (void)close(out[0]);
        (void)close(out[1]);
        (void)execv(command[0], command);
        _exit(127);
    }
    (void)close(out[1]);
    (void)waitpid(pid, NULL, 0);
    const double ended_s = now_s();
    if (read(out[0], &at_s, sizeof at_s) != (ssize_t)sizeof at_s)
        give_up(command[0]);
    (void)close(out[0]);
    *whole_s = ended_s - began_s;
    *behind_s = ended_s - at_s;
}

static void ends(char *emulator, char *self, unsigned runs)
{
    char *by_shell[] = {(char[]){"/bin/sh"}, (char[]){"-c"}, (char[]){"\"$0\" " STAMP "; exit $?"}, self, NULL};
    char *by_run[] = {emulator, (char[]){"run"}, (char[]){"mpc"}, (char[]){"--"}, self, (char[]){STAMP}, NULL};
    double *const times = calloc(4u * (size_t)runs, sizeof *times);
    if (times == NULL)
        give_up("memory");
    double *const shell = times, *const shell_behind = shell + runs, *const run = shell_behind + runs,
                  *const run_behind = run + runs;
    for (unsigned i = 0; i < runs; i++) {
        time_one(by_shell, &shell[i], &shell_behind[i]);
        time_one(by_run, &run[i], &run_behind[i]);
    }
    for (unsigned i = 0; i < 4; i++)
        qsort(times + (size_t)i * runs, runs, sizeof *times, compare);
    const unsigned half = runs / 2;
    (void)printf("\n                                       sh -c        run    ratio\n");
    (void)printf("a command, all in all       ms  %12.2f %10.2f %8.2f\n", 1e3 * shell[half], 1e3 * run[half],
                 run[half] / shell[half]);
    (void)printf("from its end to the end     ms  %12.2f %10.2f %8.2f\n", 1e3 * shell_behind[half],
                 1e3 * run_behind[half], run_behind[half] / shell_behind[half]);
    (void)printf("... the slowest of %-4u     ms  %12.2f %10.2f %8.2f\n", runs, 1e3 * shell_behind[runs - 1],
                 1e3 * run_behind[runs - 1], run_behind[runs - 1] / shell_behind[runs - 1]);
    free(times);
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], STAMP) == 0)
        return stamp();
    if (argc < 2) {
        (void)fprintf(stderr, "bench_rehearse EMULATOR [ROUNDS [MOVES [RUNS]]]\n");
        return 2;
    }
    many_controllers(argv[1], argc > 2 ? (unsigned)strtoul(argv[2], NULL, 10) : 2000);
    long_moves(argv[1], argc > 3 ? (unsigned)strtoul(argv[3], NULL, 10) : 1000);
    ends(argv[1], argv[0], argc > 4 ? (unsigned)strtoul(argv[4], NULL, 10) : 200);
    return 0;
}
