/* What the guard adds to a query, beside a program that passes bytes on between two ports and does nothing else, measured in
 * the same run.
 *
 *     bench_guard EMULATOR GUARD [QUERIES]
 *
 * Prints a table; passes no judgement. The two are asked in turns, so that a noisy machine disturbs both alike. */
#define _GNU_SOURCE /* posix_openpt, cfmakeraw, mkdtemp */
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define REPLY 14u
#define ROUNDS 20u
#define PROGRAMS_MAX 8u
#define WORDS_MAX 16u

static pid_t running[PROGRAMS_MAX];
static unsigned running_count;
static char folder[] = "/tmp/dryrig-bench-XXXXXX", config[64], recorded[64], logged[64];

static void end_programs(void)
{
    for (unsigned i = running_count; i > 0; i--) { /* the emulator after what is before it */
        (void)kill(running[i - 1], SIGTERM);
        (void)waitpid(running[i - 1], NULL, 0);
    }
    running_count = 0;
}

static void clean_up(void)
{
    end_programs();
    (void)unlink(config);
    (void)unlink(recorded);
    (void)unlink(logged);
    (void)rmdir(folder);
}

static void give_up(const char *what)
{
    (void)fprintf(stderr, "bench_guard: %s: %s\n", what, strerror(errno));
    clean_up();
    exit(1);
}

static double now_us(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e6 * (double)now.tv_sec + 1e-3 * (double)now.tv_nsec;
}

/* -- What stands between ------------------------------------------------------------------------------------------------- */

static int open_raw(const char *path)
{
    struct termios raw;
    const int fd = open(path, O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (fd < 0 || tcgetattr(fd, &raw) != 0)
        give_up(path);
    cfmakeraw(&raw);
    if (tcsetattr(fd, TCSANOW, &raw) != 0)
        give_up(path);
    return fd;
}

static pid_t start_child(void)
{
    const pid_t pid = fork();
    if (pid < 0 || running_count == PROGRAMS_MAX)
        give_up("fork");
    if (pid > 0)
        running[running_count++] = pid;
    else
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    return pid;
}

static void pass_on(int a, int b)
{
    unsigned char bytes[256];
    struct pollfd both[2] = {{a, POLLIN, 0}, {b, POLLIN, 0}};
    (void)prctl(PR_SET_TIMERSLACK, 1ul, 0ul, 0ul, 0ul);
    while (poll(both, 2, -1) > 0)
        for (unsigned i = 0; i < 2; i++) {
            const ssize_t count = (both[i].revents & POLLIN) != 0 ? read(both[i].fd, bytes, sizeof bytes) : 0;
            if (count < 0 || (count > 0 && write(both[1 - i].fd, bytes, (size_t)count) != count))
                _exit(0);
        }
    _exit(0);
}

/* The host's end of a pass-through to `port`. */
static int start_pass_through(const char *port)
{
    struct termios raw;
    const int master = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0)
        give_up("pseudo-terminal");
    const int host = open(ptsname(master), O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (host < 0 || tcgetattr(host, &raw) != 0)
        give_up("pseudo-terminal");
    cfmakeraw(&raw);
    (void)tcsetattr(host, TCSANOW, &raw);
    const int device = open_raw(port);
    if (start_child() == 0) {
        (void)close(host);
        pass_on(master, device);
    }
    (void)close(master);
    (void)close(device);
    return host;
}

/* Starts a program that says "ready PATH". */
static void start_program(char path[64], ...)
{
    char *words[WORDS_MAX], line[80] = "";
    size_t length = 0, count = 0;
    int out[2];
    va_list arguments;
    va_start(arguments, path);
    for (const char *word; count + 1 < WORDS_MAX && (word = va_arg(arguments, const char *)) != NULL;)
        words[count++] = strdup(word); /* execv() wants its own */
    words[count] = NULL;
    if (count == 0 || words[0] == NULL)
        give_up("no memory");
    va_end(arguments);
    if (pipe(out) != 0)
        give_up("pipe");
    if (start_child() == 0) {
        const int null = open("/dev/null", O_RDWR);
        (void)dup2(null, STDIN_FILENO);
        (void)dup2(null, STDERR_FILENO);
        (void)dup2(out[1], STDOUT_FILENO);
        (void)close(out[0]);
        (void)execv(words[0], words);
        _exit(127);
    }
    (void)close(out[1]);
    while (strchr(line, '\n') == NULL && length + 1 < sizeof line) {
        const ssize_t got = read(out[0], line + length, sizeof line - 1 - length);
        if (got <= 0)
            give_up(words[0]);
        length += (size_t)got;
    }
    (void)close(out[0]);
    (void)sscanf(line, "ready %63s", path);
    while (count > 0)
        free(words[--count]);
}

static void write_config(const char *kind)
{
    const int is_mpc = strcmp(kind, "mpc") == 0;
    FILE *const file = fopen(config, "w");
    if (file == NULL)
        give_up(config);
    (void)fprintf(file,
                  "format = 1; revision = 1; %s drives = ( { number = 1; device = \"MP-845\"; microstep_um = %s\n"
                  "box_um = { x = (0, 20000); y = (0, 20000); z = (0, 20000); }; } );\n",
                  is_mpc ? "profile = \"mpc-200\"; firmware = \"3.21\";"
                         : "profile = \"trio-mp245a\"; firmware = \"3.12\"; external_switch5_on = true; "
                           "external_switch6_on = false;",
                  is_mpc ? "0.046875; switch8_on = true;" : "0.09375;");
    if (fclose(file) != 0)
        give_up(config);
}

/* -- Round trips ----------------------------------------------------------------------------------------------------------- */

/* Less than 0: no whole answer within the limit. */
static double ask(int fd, int limit_ms)
{
    unsigned char reply[REPLY];
    struct pollfd answers = {fd, POLLIN, 0};
    const double before = now_us();
    if (write(fd, "C", 1) != 1)
        give_up("write");
    for (size_t have = 0; have < sizeof reply;) {
        if (poll(&answers, 1, limit_ms) != 1)
            return -1;
        const ssize_t got = read(fd, reply + have, sizeof reply - have);
        if (got <= 0)
            give_up("read");
        have += (size_t)got;
    }
    return now_us() - before;
}

/* A guard takes a pause of 100 ms within a reply for its end, and a busy machine makes one now and then: it costs the answer,
 * not the run. */
static double ask_until_answered(int fd)
{
    double took_us = -1;
    for (unsigned tries = 0; took_us < 0; tries++) {
        if (tries == 10)
            give_up("no answer");
        took_us = ask(fd, 5000);
        if (took_us < 0)
            (void)tcflush(fd, TCIFLUSH);
    }
    return took_us;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void compare(const char *emulator, const char *guard, const char *kind, const char *pace, bool keeps,
                    unsigned queries)
{
    char ports[2][64] = {"", ""}, guarded[64] = "";
    static double times_us[2][100000];
    write_config(kind);
    for (unsigned i = 0; i < 2; i++)
        start_program(ports[i], emulator, kind, "--pace", pace, "--device", "MP-845", (char *)NULL);
    start_program(guarded, guard, "--port", ports[1], "--config", config, keeps ? "--record" : (char *)NULL, recorded,
                  "--log", logged, (char *)NULL);
    const int hosts[2] = {start_pass_through(ports[0]), open_raw(guarded)};
    for (unsigned tries = 0; ask(hosts[1], 1000) < 0; tries++) /* the guard proves first who the controller is */
        if (tries > 60)
            give_up("the guard does not let a query pass");
    for (unsigned round = 0; round < ROUNDS; round++)
        for (unsigned which = 0; which < 2; which++)
            for (unsigned i = round * queries / ROUNDS; i < (round + 1) * queries / ROUNDS; i++)
                times_us[which][i] = ask_until_answered(hosts[which]);
    for (unsigned which = 0; which < 2; which++) {
        qsort(times_us[which], queries, sizeof times_us[which][0], ascending);
        (void)close(hosts[which]);
    }
    end_programs();
    const double median[2] = {times_us[0][queries / 2], times_us[1][queries / 2]};
    const double late[2] = {times_us[0][queries * 99 / 100], times_us[1][queries * 99 / 100]};
    printf("%-5s %-6s %-9s %12.1f %12.1f %10.1f %8.2f %12.1f %12.1f\n", kind, pace, keeps ? "--record" : "", median[0],
           median[1], median[1] - median[0], median[1] / median[0], late[0], late[1]);
    (void)fflush(stdout);
}

int main(int argc, char **argv)
{
    const unsigned queries = argc > 3 ? (unsigned)strtoul(argv[3], NULL, 10) : 2000;
    if (argc < 3 || queries < ROUNDS || queries > 100000) {
        (void)fprintf(stderr, "usage: bench_guard EMULATOR GUARD [QUERIES, %u to 100000]\n", ROUNDS);
        return 2;
    }
    if (mkdtemp(folder) == NULL)
        give_up(folder);
    (void)snprintf(config, sizeof config, "%s/rig.conf", folder);
    printf("position query, %u times                                        (us; a byte takes 173.6 on a TRIO's line, "
           "78.1 on an "
           "MPC-200's)\n",
           queries);
    printf("%-5s %-6s %-9s %12s %12s %10s %8s %12s %12s\n", "", "pace", "", "pass-through", "guard", "added", "ratio",
           "99 % p.-th.", "99 % guard");
    (void)snprintf(recorded, sizeof recorded, "%s/line.rec", folder);
    (void)snprintf(logged, sizeof logged, "%s/rig.log", folder);
    compare(argv[1], argv[2], "mpc", "off", false, queries);
    compare(argv[1], argv[2], "mpc", "off", true, queries);
    compare(argv[1], argv[2], "mpc", "on", false, queries);
    compare(argv[1], argv[2], "trio", "on", false, queries);
    clean_up();
    return 0;
}
