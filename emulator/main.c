/* dryrig-emu: controllers on pseudo-terminals.
 *
 *     options -> rig: setups of controllers -> stations: instrument (controller, quirks of bytes, paced line) <-> pty
 *                                                 |                                    link: its stable name
 *                                             observers: reports (trace, lint, recording), ...
 *     engine: the loop and the clock            control: commands while it runs      child: the command of `run`
 */
#define _GNU_SOURCE   /* signalfd, mkdtemp */
#include "child.h"    /* the command of `run` */
#include "desk.h"     /* what it is told while it runs */
#include "engine.h"   /* the loop */
#include "first.h"    /* what is done at the start */
#include "options.h"  /* what was asked for */
#include "playback.h" /* the controller's side of a recording, for a host */
#include "replay.h"   /* the host's side, for a controller */
#include "replay_port.h"
#include "reports.h"  /* what is written about it */
#include "terminal.h" /* leaving it as it was */

#include "dr_words.h" /* names for people */

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define PATH_ROOM 512u
#define EXIT_FINDINGS 3 /* --strict */

typedef struct {
    source signals; /* the first, see on_signal() */
    options *o;
    engine e;
    reports reports;
    desk desk;
    kept_file *kept; /* one for each station */
    bool is_kept;    /* all that was to be kept */
    first first;     /* what is done at the start */
    int signal_fd;
    sigset_t mask_before;
    pid_t child;       /* 0: none */
    terminal terminal; /* TASK_PANEL: as it was */
    int status;
    char directory[PATH_ROOM]; /* for the command of `run`: links and socket; "": none */
} program;

static int fail(const char *what)
{
    (void)fprintf(stderr, "dryrig-emu: %s: %s\n", what, strerror(errno));
    return 1;
}

/* It lives as long as another program. */
static bool has_command(const program *p) { return p->o->task == TASK_RUN || p->o->task == TASK_PANEL; }

/* -- Signals --------------------------------------------------------------------------------------------------------- */

/* Without a command, a signal ends the program. With one, it is the command's to decide, and its end is ours. The terminal
 * has sent its own to both of us. */
static void on_signal(source *who, uint32_t events)
{
    (void)events;
    program *const p = (program *)who;
    struct signalfd_siginfo signal;
    while (read(p->signal_fd, &signal, sizeof signal) == (ssize_t)sizeof signal) {
        const bool is_child = signal.ssi_signo == (uint32_t)SIGCHLD;
        if (is_child && p->child > 0 && child_has_ended(p->child, &p->status)) {
            p->child = 0;
            p->e.is_over = true;
        } else if (!is_child && p->child > 0 && signal.ssi_code != SI_KERNEL) {
            (void)kill(p->child, (int)signal.ssi_signo);
        } else if (!is_child && p->child == 0) {
            p->e.is_over = true;
        }
    }
}

/* SIGINT and SIGTERM end the program even where they came in ignored, as in a background job; an ignored SIGHUP is somebody's
 * wish (nohup). */
static bool open_signals(program *p)
{
    sigset_t caught;
    (void)sigemptyset(&caught);
    (void)sigaddset(&caught, SIGINT);
    (void)sigaddset(&caught, SIGTERM);
    struct sigaction hangup;
    if (sigaction(SIGHUP, NULL, &hangup) != 0 || hangup.sa_handler != SIG_IGN)
        (void)sigaddset(&caught, SIGHUP);
    if (has_command(p)) {
        (void)sigaddset(&caught, SIGCHLD);
        (void)sigaddset(&caught, SIGQUIT);
        (void)sigaddset(&caught, SIGUSR1);
        (void)sigaddset(&caught, SIGUSR2);
        (void)signal(SIGCHLD, SIG_DFL); /* where it came in ignored, the command's end would go unseen */
    }
    (void)sigprocmask(SIG_BLOCK, &caught, &p->mask_before);
    if (!has_command(p)) {
        (void)signal(SIGINT, SIG_DFL);
        (void)signal(SIGTERM, SIG_DFL);
    }
    (void)signal(SIGPIPE, SIG_IGN);
    p->signal_fd = signalfd(-1, &caught, SFD_NONBLOCK | SFD_CLOEXEC);
    p->signals.ready = on_signal;
    return p->signal_fd >= 0 && engine_watch(&p->e, &p->signals, p->signal_fd, EPOLLIN);
}

/* -- Telling --------------------------------------------------------------------------------------------------------- */

static void introduce_one(const setup *s, unsigned speedup)
{
    char firmware[16];
    (void)dr_words_firmware(firmware, sizeof firmware, s->firmware);
    (void)fprintf(stderr,
                  "dryrig-emu emulates a Sutter %s, firmware %s. It is not affiliated with Sutter Instrument.\n",
                  dr_words_controller(s->kind), firmware);
    (void)fprintf(stderr, "  devices: ");
    for (uint8_t i = 0; i < s->drive_count; i++)
        (void)fprintf(stderr, "%s%s", i == 0 ? "" : ", ", dr_words_stage((dr_stage_id)s->drives[i].stage));
    (void)fprintf(stderr, "\n  quirks:  ");
    for (unsigned i = 0, said = 0; i < DR_QUIRK_IDS; i++)
        if ((s->quirk_ids & 1u << i) != 0)
            (void)fprintf(stderr, "%s%s", said++ == 0 ? "" : ", ", dr_words_quirk((dr_quirk_id)i)->name);
    (void)fprintf(stderr, "%s\n  line:    ", s->quirk_ids == 0 ? "none, as documented" : "");
    if (s->is_paced)
        (void)fprintf(stderr, "%u baud", (unsigned)(s->kind == DR_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC));
    else
        (void)fprintf(stderr, "not paced");
    if (speedup > 1)
        (void)fprintf(stderr, ", %u times faster than real time", speedup);
    if (s->state != NULL)
        (void)fprintf(stderr, "\n  state:   %s%s", s->state, s->was_kept ? ", as it was left" : ", new");
}

static void suggest(const setup *s, const char *port)
{
    const char *stage = NULL;
    for (uint8_t i = 0; i < s->drive_count && stage == NULL; i++)
        if (s->drives[i].stage != DR_STAGE_NONE)
            stage = dr_words_stage((dr_stage_id)s->drives[i].stage);
    if (stage == NULL)
        (void)fprintf(stderr, "  dryrig --port %s --controller %s info\n", port, dr_words_kind(s->kind));
    else
        (void)fprintf(stderr, "  dryrig --port %s --controller %s --stage %s position\n", port, dr_words_kind(s->kind),
                      stage);
}

static const char *name_of_port(const station *s) { return s->link != NULL ? s->link : s->port.path; }

/* For people. Stdout carries the one line that programs wait for. */
static void introduce(const program *p)
{
    const engine *const e = &p->e;
    const rig_member *const members = p->o->rig.members;
    if (p->o->rig_file == NULL) {
        introduce_one(&members[0].setup, e->speedup);
        (void)fprintf(stderr, "\nIt listens at %s until it is interrupted. In another terminal:\n",
                      name_of_port(&e->stations[0]));
    } else {
        (void)fprintf(stderr,
                      "dryrig-emu emulates %u controllers. It is not affiliated with Sutter Instrument.\n"
                      "They listen until it is interrupted. In another terminal, for instance:\n",
                      e->station_count);
    }
    suggest(&members[0].setup, name_of_port(&e->stations[0]));
}

static bool say_ready(const program *p)
{
    bool done = printf("ready") > 0;
    for (unsigned i = 0; i < p->e.station_count; i++) {
        const station *const s = &p->e.stations[i];
        done = (p->o->rig_file == NULL ? printf(" %s", s->port.path) : printf(" %s=%s", s->name, s->port.path)) > 0 &&
               done;
    }
    return printf("\n") > 0 && fflush(stdout) == 0 && done;
}

/* -- The command of `run` ---------------------------------------------------------------------------------------------- */

/* A directory of its own for links and socket: their paths stay when a plug is pulled and put in again. TMPDIR may be too long
 * for a socket. */
static bool make_directory(program *p)
{
    static const char in_it[] = "/dryrig-XXXXXX/control";
    const char *const where = getenv("TMPDIR");
    const bool will_do =
        where != NULL && *where == '/' && strlen(where) + sizeof in_it <= sizeof((struct sockaddr_un *)NULL)->sun_path;
    const int length = snprintf(p->directory, sizeof p->directory, "%s/dryrig-XXXXXX", will_do ? where : "/tmp");
    if (length >= 0 && (size_t)length < sizeof p->directory && mkdtemp(p->directory) != NULL)
        return true;
    p->directory[0] = '\0';
    return false;
}

static char *in_directory(const program *p, const char *name)
{
    char *const path = malloc(PATH_ROOM + RIG_NAME_MAX);
    if (path != NULL)
        (void)snprintf(path, PATH_ROOM + RIG_NAME_MAX, "%s/%s", p->directory, name);
    return path;
}

static bool prepare_run(program *p)
{
    if (!make_directory(p))
        return false;
    for (unsigned i = 0; i < p->e.station_count && p->o->task == TASK_RUN; i++)
        if (p->e.stations[i].link == NULL && (p->e.stations[i].link = in_directory(p, p->e.stations[i].name)) == NULL)
            return false;
    if (p->o->control == NULL)
        p->o->control = in_directory(p, "control");
    return p->o->control != NULL;
}

static void set_environment(const program *p)
{
    for (unsigned i = 0; i < p->e.station_count; i++) {
        const station *const s = &p->e.stations[i];
        char variable[sizeof "DRYRIG_PORT_" + RIG_NAME_MAX];
        (void)snprintf(variable, sizeof variable, "DRYRIG_PORT_%s", s->name);
        (void)setenv(p->o->rig_file == NULL ? "DRYRIG_PORT" : variable, s->link, 1);
    }
    (void)setenv("DRYRIG_CONTROL", p->o->control, 1);
    if (p->o->clock != CLOCK_REAL || p->o->speedup > 1)
        (void)setenv("DRYRIG_FAST", "1", 1); /* dryrig then believes moves that end before their time */
}

/* -- From beginning to end ----------------------------------------------------------------------------------------------- */

/* A program that is started without stdin, stdout or stderr must not get a port under their numbers. The command of `run` is
 * without them as well. */
static void fill_standard_fds(void)
{
    int fd;
    while ((fd = open("/dev/null", O_RDWR | O_CLOEXEC)) >= 0 && fd <= STDERR_FILENO) {}
    if (fd > STDERR_FILENO)
        (void)close(fd);
}

static bool set_up(program *p)
{
    const options *const o = p->o;
    engine *const e = &p->e;
    e->mode = o->clock;
    e->speedup = o->speedup;
    e->waits_for_client = o->waits_for_client;
    e->station_count = o->rig.count;
    e->stations = calloc(o->rig.count, sizeof *e->stations);
    p->kept = calloc(o->rig.count, sizeof *p->kept);
    if (e->stations == NULL || p->kept == NULL)
        return false;
    for (unsigned i = 0; i < e->station_count; i++) {
        station *const s = &e->stations[i];
        s->name = o->rig.members[i].name;
        s->link = o->rig.members[i].link;
        s->watches_reads = o->lints;
        setup_apply(&o->rig.members[i].setup, &s->ins, s->drives);
        faults_init(&s->ins.faults, o->seed + i);
    }
    return true;
}

/* -- What is kept -------------------------------------------------------------------------------------------------------- */

static void update_kept(void *context)
{
    program *const p = context;
    for (unsigned i = 0; i < p->e.station_count; i++)
        kept_update(&p->kept[i], &p->e.stations[i].ins);
}

static bool open_kept(program *p)
{
    char why[WHY_ROOM];
    for (unsigned i = 0; i < p->e.station_count; i++) {
        const setup *const s = &p->o->rig.members[i].setup;
        if (s->state == NULL)
            continue;
        if (!kept_open(&p->kept[i], s->state, s->was_kept ? &s->kept : NULL, why)) {
            (void)fprintf(stderr, "dryrig-emu: --state: %s\n", why);
            return false;
        }
        p->e.after = update_kept;
        p->e.context = p;
    }
    return true;
}

static bool begin_kept(program *p)
{
    char why[WHY_ROOM];
    for (unsigned i = 0; i < p->e.station_count; i++)
        if (!kept_begin(&p->kept[i], &p->e.stations[i].ins, why)) {
            (void)fprintf(stderr, "dryrig-emu: --state: %s\n", why);
            return false;
        }
    return true;
}

static void close_kept(program *p)
{
    p->is_kept = true;
    for (unsigned i = 0; i < p->e.station_count; i++)
        p->is_kept = kept_close(&p->kept[i], &p->e.stations[i].ins) && p->is_kept;
    free(p->kept);
}

/* -- The command ---------------------------------------------------------------------------------------------------------- */

/* The panel is beside this program, or wherever programs are. */
static bool start_panel(program *p)
{
    static char name[] = "dryrig-panel", own[] = "--own";
    char path[PATH_ROOM], socket[PATH_ROOM + RIG_NAME_MAX];
    const ssize_t length = readlink("/proc/self/exe", path, sizeof path - sizeof name);
    path[length > 0 ? length : 0] = '\0';
    char *const slash = strrchr(path, '/');
    memcpy(slash == NULL ? path : slash + 1, name, sizeof name);
    (void)snprintf(socket, sizeof socket, "%s", p->o->control);
    char *command[] = {access(path, X_OK) == 0 ? path : name, own, socket, NULL};
    terminal_keep(&p->terminal);
    p->child = child_start(command, &p->mask_before, &p->status);
    return p->child > 0;
}

static bool start_command(program *p)
{
    if (p->o->task == TASK_PANEL)
        return start_panel(p);
    set_environment(p);
    p->child = child_start(p->o->command, &p->mask_before, &p->status);
    return p->child > 0;
}

/* `quit` ends the controllers; the command goes on without them, and its end is ours. The panel ends with the control channel;
 * one that was killed has left the terminal as it was drawn on. */
static void await_command(program *p)
{
    struct pollfd signals = {.fd = p->signal_fd, .events = POLLIN};
    while (p->child > 0)
        if (poll(&signals, 1, -1) > 0)
            on_signal(&p->signals, 0);
    if (p->o->task == TASK_PANEL && p->status > 128)
        terminal_restore(&p->terminal);
}

/* The ports are open, the links are made. */
static void start_and_run(program *p)
{
    char why[PATH_ROOM + 256];
    p->status = 1;
    if (!reports_open(&p->reports, p->o, p->e.stations, p->e.station_count))
        return;
    trace *const t = p->o->trace == NULL ? NULL : &p->reports.trace;
    if (!desk_open(&p->desk, &p->e, t, p->o->control, why, sizeof why)) {
        (void)fprintf(stderr, "dryrig-emu: --control: %s\n", why);
        return;
    }
    if (!has_command(p))
        introduce(p);
    engine_start(&p->e);
    for (unsigned i = 0; i < p->e.station_count; i++)
        setup_started(&p->o->rig.members[i].setup, &p->e.stations[i].ins);
    if (!first_do(&p->first, &p->desk.language)) {
        p->status = 2;
        return;
    }
    if (!begin_kept(p))
        return;
    if (!has_command(p) && !say_ready(p)) {
        (void)fail("cannot write the line 'ready' to stdout");
        return;
    }
    if (has_command(p) && !start_command(p))
        return;
    p->status = 0;
    engine_run(&p->e);
}

/* Where chance has had a say, the same again must be possible. */
static void tell_seed(const program *p)
{
    bool has_chanced = false;
    for (unsigned i = 0; i < p->e.station_count; i++)
        has_chanced = has_chanced || p->e.stations[i].ins.faults.has_chanced;
    if (has_chanced && p->o->seed_is_chosen)
        (void)fprintf(stderr, "dryrig-emu: chance began with --seed %llu\n", (unsigned long long)p->o->seed);
}

/* The last word: the command's, or our own, where that says that all went well. */
static void finish(program *p)
{
    unsigned long findings;
    const bool is_written = reports_finish(&p->reports, &findings);
    if (p->status == 0 && p->o->is_strict && findings > 0)
        p->status = EXIT_FINDINGS;
    else if (p->status == 0 && (!is_written || !p->is_kept))
        p->status = 1;
}

static int run(program *p)
{
    char why[PATH_ROOM + 256];
    if (!set_up(p))
        return fail("no memory");
    language reader = {.e = &p->e, .trace = p->o->trace == NULL ? NULL : &p->reports.trace};
    if (!first_check(&p->first, p->o, &reader))
        return 2;
    if (p->o->task == TASK_CHECK) {
        const unsigned count = p->o->rig.count;
        (void)printf("%s: %u controller%s, nothing wrong\n", p->o->rig_file, count, count == 1 ? "" : "s");
        return 0;
    }
    if (!engine_open(&p->e) || !open_signals(p))
        return fail("cannot wait for events (/proc/sys/fs/inotify and ulimit -n have limits)");
    if (has_command(p) && !prepare_run(p))
        return fail("run: cannot make a directory for the command's ports (TMPDIR says where)");
    if (!open_kept(p)) {
        p->status = 1;
    } else if (engine_plug(&p->e, why, sizeof why)) {
        start_and_run(p);
        tell_seed(p);
        desk_close(&p->desk);
        close_kept(p);
        engine_close(&p->e);
        reports_stop(&p->reports);
        await_command(p);
        finish(p);
    } else {
        (void)fprintf(stderr, "dryrig-emu: %s\n", why);
        p->status = 1;
    }
    first_close(&p->first);
    if (p->directory[0] != '\0')
        (void)rmdir(p->directory);
    return p->status;
}

int main(int argc, char **argv)
{
    static program p;
    fill_standard_fds();
    if (argc > 1 && strcmp(argv[1], "ctl") == 0) {
        if (argc > 3)
            return desk_ctl(argv[2], argv + 3);
        (void)fprintf(stderr, "dryrig-emu: ctl: expected a path and a command: dryrig-emu ctl PATH help\n");
        return 2;
    }
    static options o;
    o = options_read(argc, argv);
    p.o = &o;
    if (o.task == TASK_REPLAY)
        return o.replay_port == NULL ? replay(o.replay) : replay_port(o.replay, o.replay_port, o.may_move);
    if (o.task == TASK_PLAYBACK)
        return playback(&(playback_options){o.replay, o.playback_link, o.speedup, o.clock != CLOCK_REAL});
    return run(&p);
}
