/* What the emulator costs, beside the least that anything of its kind can cost, measured in the same run: a program that
 * reads a byte from a pseudo-terminal and writes 14 back, and does nothing else.
 *
 *     bench EMULATOR [COMMANDS]
 *
 * Prints a table; passes no judgement. The two are asked in turns, so that a noisy machine disturbs both alike. */
#define _GNU_SOURCE        /* posix_openpt, cfmakeraw, clock_getcpuclockid */
#include "dr_controller.h" /* moves of the bare core */

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
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
#define STARTS 20u
#define MOVES 1000000u

typedef struct {
    const char *name;
    pid_t pid;
    int fd;          /* the host's end of its port */
    double start_ms; /* until its port was there */
    double *rtt_us;  /* of each command */
    unsigned asked;
    double cpu_s;
} subject;

static void give_up(const char *what)
{
    (void)fprintf(stderr, "bench: %s: %s\n", what, strerror(errno));
    exit(1);
}

static double seconds(clockid_t clock)
{
    struct timespec now;
    if (clock_gettime(clock, &now) != 0)
        give_up("clock");
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* -- The two that are compared ----------------------------------------------------------------------------------------- */

static void respond(int master)
{
    static const unsigned char reply[REPLY] = {1};
    unsigned char byte;
    while (read(master, &byte, 1) == 1)
        if (write(master, reply, sizeof reply) != (ssize_t)sizeof reply)
            break;
    _exit(0);
}

static subject start_responder(void)
{
    subject s = {.name = "floor"};
    struct termios raw;
    const double before = seconds(CLOCK_MONOTONIC);
    const int master = posix_openpt(O_RDWR | O_NOCTTY);
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 || tcgetattr(master, &raw) != 0)
        give_up("pseudo-terminal");
    cfmakeraw(&raw);
    if (tcsetattr(master, TCSANOW, &raw) != 0)
        give_up("pseudo-terminal");
    s.fd = open(ptsname(master), O_RDWR | O_NOCTTY | O_CLOEXEC);
    s.pid = fork();
    if (s.fd < 0 || s.pid < 0)
        give_up("responder");
    if (s.pid == 0) {
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
        (void)close(s.fd);
        respond(master);
    }
    (void)close(master);
    s.start_ms = 1e3 * (seconds(CLOCK_MONOTONIC) - before);
    return s;
}

static subject start_emulator(const char *program)
{
    subject s = {.name = "dryrig-emu"};
    int out[2];
    char line[64] = "";
    size_t length = 0;
    const double before = seconds(CLOCK_MONOTONIC);
    if (pipe(out) != 0 || (s.pid = fork()) < 0)
        give_up("emulator");
    if (s.pid == 0) {
        const int null = open("/dev/null", O_RDWR);
        (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
        (void)dup2(null, STDERR_FILENO);
        (void)dup2(out[1], STDOUT_FILENO);
        (void)close(out[0]);
        (void)execl(program, program, "mpc", "--pace", "off", (char *)NULL);
        _exit(127);
    }
    (void)close(out[1]);
    while (strchr(line, '\n') == NULL && length + 1 < sizeof line) {
        const ssize_t count = read(out[0], line + length, sizeof line - 1 - length);
        if (count <= 0)
            give_up("the emulator does not get ready");
        length += (size_t)count;
    }
    s.start_ms = 1e3 * (seconds(CLOCK_MONOTONIC) - before);
    (void)close(out[0]);
    *strchr(line, '\n') = '\0';
    s.fd = open(line + strlen("ready "), O_RDWR | O_NOCTTY | O_CLOEXEC);
    if (s.fd < 0)
        give_up(line);
    return s;
}

static void stop(const subject *s)
{
    (void)close(s->fd);
    (void)kill(s->pid, SIGTERM);
    (void)waitpid(s->pid, NULL, 0);
}

/* -- Round trips --------------------------------------------------------------------------------------------------------- */

static void ask(subject *s, unsigned count)
{
    clockid_t cpu;
    if (clock_getcpuclockid(s->pid, &cpu) != 0)
        give_up("processor time");
    const double cpu_before = seconds(cpu);
    for (unsigned i = 0; i < count; i++) {
        unsigned char reply[REPLY];
        const double before = seconds(CLOCK_MONOTONIC);
        if (write(s->fd, "C", 1) != 1)
            give_up("write");
        for (size_t have = 0; have < sizeof reply;) {
            const ssize_t got = read(s->fd, reply + have, sizeof reply - have);
            if (got <= 0)
                give_up("read");
            have += (size_t)got;
        }
        s->rtt_us[s->asked++] = 1e6 * (seconds(CLOCK_MONOTONIC) - before);
    }
    s->cpu_s += seconds(cpu) - cpu_before;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double quantile(const subject *s, double share) { return s->rtt_us[(size_t)(share * (double)(s->asked - 1))]; }

/* Kilobytes of a field of /proc/PID/status. */
static double kilobytes(const subject *s, const char *field)
{
    char path[64], line[256];
    double kb = 0;
    (void)snprintf(path, sizeof path, "/proc/%d/status", (int)s->pid);
    FILE *const file = fopen(path, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL)
        if (strncmp(line, field, strlen(field)) == 0)
            kb = strtod(line + strlen(field) + 1, NULL);
    if (file != NULL)
        (void)fclose(file);
    return kb;
}

static void print_row(const char *what, const char *unit, double of_floor, double of_emulator)
{
    printf("%-34s %-3s %10.2f %10.2f %8.2f\n", what, unit, of_floor, of_emulator, of_emulator / of_floor);
}

/* -- The bare core ------------------------------------------------------------------------------------------------------- */

/* Moves to and fro, each with its CR, in virtual time. */
static double moves_per_second(void)
{
    dr_drive drive;
    dr_controller c;
    dr_us now = 0;
    uint8_t byte = 0;
    unsigned answered = 0;
    dr_drive_init(&drive, DR_STAGE_MPC_MP225);
    dr_controller_init(&c, DR_MPC, &drive, 1);
    dr_controller_start(&c, now);
    const double before = seconds(CLOCK_PROCESS_CPUTIME_ID);
    for (unsigned i = 0; i < MOVES; i++) {
        uint8_t frame[DR_FRAME_MAX];
        const dr_request move = {DR_OP_MPC_MOVE, 0, {i % 2u * 16000u, i % 3u * 8000u, 4000}};
        const size_t length = dr_wire_put_request(DR_MPC, c.firmware, &move, frame);
        dr_controller_push(&c, now, frame, length);
        (void)dr_controller_due(&c, &now);
        answered += dr_controller_pull(&c, now, &byte, 1) == 1 && byte == DR_CR;
    }
    const double taken = seconds(CLOCK_PROCESS_CPUTIME_ID) - before;
    if (answered != MOVES) {
        (void)fprintf(stderr, "bench: %u of %u moves were answered\n", answered, MOVES);
        exit(1);
    }
    return MOVES / taken;
}

int main(int argc, char **argv)
{
    if (argc < 2 || argc > 3) {
        (void)fprintf(stderr, "usage: %s EMULATOR [COMMANDS]\n", argv[0]);
        return 2;
    }
    const unsigned long wanted = argc == 3 ? strtoul(argv[2], NULL, 10) : 100000ul;
    const unsigned a_round = (unsigned)(wanted < ROUNDS ? 1 : wanted / ROUNDS);

    double start_ms = 0;
    for (unsigned i = 0; i < STARTS; i++) {
        const subject once = start_emulator(argv[1]);
        start_ms += once.start_ms / STARTS;
        stop(&once);
    }
    subject bare = start_responder(), emulator = start_emulator(argv[1]);
    bare.rtt_us = malloc(ROUNDS * a_round * sizeof(double));
    emulator.rtt_us = malloc(ROUNDS * a_round * sizeof(double));
    if (bare.rtt_us == NULL || emulator.rtt_us == NULL)
        give_up("memory");
    for (unsigned i = 0; i < ROUNDS; i++) {
        ask(&bare, a_round);
        ask(&emulator, a_round);
    }
    qsort(bare.rtt_us, bare.asked, sizeof(double), ascending);
    qsort(emulator.rtt_us, emulator.asked, sizeof(double), ascending);

    printf("%-34s %-3s %10s %10s %8s\n", "", "", bare.name, emulator.name, "ratio");
    print_row("round trip of C, median", "us", quantile(&bare, 0.5), quantile(&emulator, 0.5));
    print_row("round trip of C, 99th percentile", "us", quantile(&bare, 0.99), quantile(&emulator, 0.99));
    print_row("processor time, 100,000 commands", "s", 1e5 * bare.cpu_s / bare.asked,
              1e5 * emulator.cpu_s / emulator.asked);
    print_row("resident memory", "MiB", kilobytes(&bare, "VmRSS") / 1024, kilobytes(&emulator, "VmRSS") / 1024);
    printf("%-34s %-3s %10s %10.2f\n", "from start to 'ready', mean", "ms", "", start_ms);
    printf("%-34s %-3s %10s %10.2f\n", "moves of the bare core, virtual time", "M/s", "", 1e-6 * moves_per_second());
    stop(&bare);
    stop(&emulator);
    free(bare.rtt_us);
    free(emulator.rtt_us);
    return 0;
}
