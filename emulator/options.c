#define _GNU_SOURCE /* argp, getrandom */
#include "options.h"

#include <argp.h>
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>

/* What was typed. It is understood when all of it is known. */
typedef struct {
    options *o;
    setup_text one; /* the controller */
    const char *words[3];
    unsigned word_count;
    const char *link, *clock, *speedup, *seed, *rig, *lint;
    bool has_panel, to_host;
} typed;

const char *argp_program_version = "dryrig-emu " DRYRIG_VERSION;

__attribute__((format(printf, 1, 2), noreturn)) static void refuse(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    (void)fputs("dryrig-emu: ", stderr);
    /* NOLINTNEXTLINE(clang-analyzer-valist.Uninitialized): the analyzer of LLVM 14 overlooks va_start() */
    (void)vfprintf(stderr, format, arguments);
    (void)fputs("\nTry 'dryrig-emu --help'.\n", stderr);
    va_end(arguments);
    exit(2);
}

/* -- Reading --------------------------------------------------------------------------------------------------------- */

enum {
    LINK = 256,
    DEVICE,
    FIRMWARE,
    POSITION,
    HOME,
    WORK,
    ANGLE,
    QUIRKS,
    PACE,
    TRACE,
    SPEEDUP,
    CLOCK,
    WAIT_CLIENT,
    CONTROL,
    DO,
    SCENARIO,
    STATE,
    SEED,
    RIG_FILE,
    PANEL,
    LINT,
    LINT_JSON,
    LINT_JUNIT,
    STRICT,
    RECORD,
    TO_HOST,
    PORT,
    MAY_MOVE
};

static const struct argp_option known[] = {
    {"link", LINK, "PATH", 0, "Make a symbolic link PATH to the port; it is removed at the end", 1},
    {"device", DEVICE, "MODEL", 0,
     "What is connected: the first --device to port 1, and so on; 'none' leaves a port empty. "
     "Once for trio (default MP-845), up to four times for mpc (default: MP-225 at ports 1 and 2)",
     2},
    {"firmware", FIRMWARE, "X.YY", 0, "Version of the controller's firmware (default: 3.12 for trio, 3.21 for mpc)", 2},
    {"position", POSITION, "X,Y,Z", 0,
     "Where a device is at the start, in microsteps, or in microns: 100um,200um,300um. "
     "The first --position is for the first device, and so on "
     "(default: 1,000 um on each axis for trio, 0,0,0 for mpc)",
     2},
    {"home", HOME, "X,Y,Z", 0, "trio: the stored home position (default 0,0,0)", 2},
    {"work", WORK, "X,Y,Z", 0, "The stored work position of a device, repeated as --position (default: none)", 2},
    {"angle", ANGLE, "DEG", 0,
     "trio: 0 to 90 (default 30). "
     "mpc: how steep the diagonal of all devices is: "
     "7, 11, 14, 21, 27, 29, 35, 39 or 45 degrees off the horizontal; "
     "'29more' for the steep side of 45 (default 29, that is 29less)",
     2},
    {"quirks", QUIRKS, "LIST", 0,
     "'documented' (default): as the manuals say; "
     "'observed': and what people meet on real controllers; "
     "or names with commas between, see the manual page",
     3},
    {"pace", PACE, "on|off", 0,
     "Take and send bytes at the rate of the serial line (default with --clock real), or as fast as they come", 4},
    {"clock", CLOCK, "real|step|jump", 0,
     "How the controller's time goes: with real time (default); "
     "only when told (control channel: advance); "
     "or on to the next event whenever the controller only waits",
     4},
    {"speedup", SPEEDUP, "N", 0, "Run the controller's clock and its line N times faster, 1 to 1000", 4},
    {"wait-client", WAIT_CLIENT, NULL, 0, "The controller's clock stands until somebody has opened the port", 4},
    {"state", STATE, "FILE", 0,
     "Begin where the controller was left, and keep positions, home, work, angle and switches in FILE; "
     "what other options say counts more",
     5},
    {"trace", TRACE, "FILE", 0,
     "Write what happens, in words, to FILE; '-' is stderr; FILE.jsonl gets JSON, an object a line", 5},
    {"record", RECORD, "FILE", 0, "Write the bytes of both directions, with times, to FILE", 5},
    {"control", CONTROL, "PATH", 0,
     "Make a socket PATH that takes commands: 'dryrig-emu ctl PATH help', see dryrig-control(7)", 5},
    {"panel", PANEL, NULL, 0, "Show the controller's panel in this terminal; it ends with it. See dryrig-panel(1)", 5},
    {"do", DO, "COMMAND", 0, "Do this at the start, in the same language; may be repeated", 5},
    {"scenario", SCENARIO, "FILE", 0,
     "Do the lines of FILE at the start, before --do; they are checked before anything starts", 5},
    {"seed", SEED, "N", 0, "Where chance begins (default: another one each time)", 5},
    {"lint", LINT, "on|off", OPTION_ARG_OPTIONAL,
     "At the end, say on stderr which rules of the protocol the host has broken (default with run: on)", 6},
    {"lint-json", LINT_JSON, "FILE", 0, "Write all of it to FILE as JSON", 6},
    {"lint-junit", LINT_JUNIT, "FILE", 0, "Write it to FILE as JUnit XML", 6},
    {"strict", STRICT, NULL, 0, "With run: exit status 3 where COMMAND's is 0 and there are findings", 6},
    {"rig", RIG_FILE, "FILE", 0, "With run: the controllers of a rig file", 5},
    {"to-host", TO_HOST, NULL, 0,
     "With replay: play the controller's side of FILE to a host; --link, --clock real|jump and --speedup apply", 5},
    {"port", PORT, "PATH", 0,
     "With replay: play the host's side of FILE to what is at PATH, a real controller or another; see --may-move", 5},
    {"may-move", MAY_MOVE, NULL, 0, "With replay --port: it may move the stage of what is there", 5},
    {NULL, 'h', NULL, OPTION_HIDDEN, NULL, -1},
    {NULL, 0, NULL, 0, NULL, 0}};

static void once(struct argp_state *state, const char **place, const char *name, const char *value)
{
    if (*place != NULL)
        argp_error(state, "--%s is given twice", name);
    *place = value;
}

static void repeated(struct argp_state *state, const char **places, unsigned *count, unsigned most, const char *name,
                     const char *value)
{
    if (*count == most && most == DR_PORTS)
        argp_error(state, "--%s is given more than %u times; an MPC-200 has %u ports", name, most, DR_PORTS);
    if (*count == most)
        argp_error(state, "--%s is given more than %u times", name, most);
    places[(*count)++] = value;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    typed *t = state->input;
    setup_text *one = &t->one;
    switch (key) {
    case LINK:
        once(state, &t->link, "link", value);
        break;
    case DEVICE:
        repeated(state, one->devices, &one->device_count, DR_PORTS, "device", value);
        break;
    case FIRMWARE:
        once(state, &one->firmware, "firmware", value);
        break;
    case POSITION:
        repeated(state, one->positions, &one->position_count, DR_PORTS, "position", value);
        break;
    case HOME:
        once(state, &one->home, "home", value);
        break;
    case WORK:
        repeated(state, one->works, &one->work_count, DR_PORTS, "work", value);
        break;
    case ANGLE:
        once(state, &one->angle, "angle", value);
        break;
    case QUIRKS:
        once(state, &one->quirks, "quirks", value);
        break;
    case PACE:
        once(state, &one->pace, "pace", value);
        break;
    case TRACE:
        once(state, &t->o->trace, "trace", value);
        break;
    case SPEEDUP:
        once(state, &t->speedup, "speedup", value);
        break;
    case CLOCK:
        once(state, &t->clock, "clock", value);
        break;
    case WAIT_CLIENT:
        t->o->waits_for_client = true;
        break;
    case CONTROL:
        once(state, &t->o->control, "control", value);
        break;
    case DO:
        repeated(state, t->o->dos, &t->o->do_count, OPTIONS_DO_MAX, "do", value);
        break;
    case SCENARIO:
        once(state, &t->o->scenario, "scenario", value);
        break;
    case STATE:
        once(state, &one->state, "state", value);
        break;
    case SEED:
        once(state, &t->seed, "seed", value);
        break;
    case RIG_FILE:
        once(state, &t->rig, "rig", value);
        break;
    case LINT:
        once(state, &t->lint, "lint", value != NULL ? value : "on");
        break;
    case LINT_JSON:
        once(state, &t->o->lint_json, "lint-json", value);
        break;
    case LINT_JUNIT:
        once(state, &t->o->lint_junit, "lint-junit", value);
        break;
    case RECORD:
        once(state, &t->o->record, "record", value);
        break;
    case PANEL:
        t->has_panel = true;
        break;
    case TO_HOST:
        t->to_host = true;
        break;
    case PORT:
        once(state, &t->o->replay_port, "port", value);
        break;
    case MAY_MOVE:
        t->o->may_move = true;
        break;
    case 'h':
        argp_state_help(state, stdout, ARGP_HELP_STD_HELP);
        break;
    case STRICT:
        t->o->is_strict = true;
        break;
    case ARGP_KEY_ARG:
        if (t->word_count == sizeof t->words / sizeof t->words[0])
            argp_error(state, "'%s' is one word too many%s", value,
                       strcmp(t->words[0], "run") == 0 ? "; the command of run stands behind --" : "");
        t->words[t->word_count++] = value;
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

/* -- What the words ask for ------------------------------------------------------------------------------------------ */

static void read_task(options *o, typed *t)
{
    const char *const first = t->word_count > 0 ? t->words[0] : "";
    unsigned at = 0;
    if (strcmp(first, "run") == 0) {
        o->task = TASK_RUN;
        at = 1;
        if (o->command == NULL || o->command[0] == NULL)
            refuse("run: which command? After --: dryrig-emu run mpc -- COMMAND ARGUMENTS");
    } else if (o->command != NULL) {
        refuse("'-- %s' has a meaning after run only: dryrig-emu run mpc -- COMMAND",
               o->command[0] ? o->command[0] : "");
    }
    if (strcmp(first, "replay") == 0) {
        if (t->word_count != 2)
            refuse("replay: one recording, please: dryrig-emu replay FILE");
        if (o->replay_port == NULL ? o->may_move : t->to_host)
            refuse("--port PATH plays the host's side to what is there; --may-move is for it, --to-host is the other "
                   "side");
        o->replay = t->words[1];
        o->task = t->to_host ? TASK_PLAYBACK : TASK_REPLAY;
        o->playback_link = t->link;
        return;
    }
    if (t->to_host)
        refuse("--to-host is for replay: dryrig-emu replay --to-host FILE");
    if (o->replay_port != NULL || o->may_move)
        refuse("--port and --may-move are for replay: dryrig-emu replay FILE --port PATH --may-move");
    if (strcmp(first, "rig") == 0) {
        at = t->word_count > 1 && strcmp(t->words[1], "check") == 0 ? 2 : 1;
        o->task = at == 2 ? TASK_CHECK : TASK_EMULATE;
        if (t->word_count == at)
            refuse("rig: which file? dryrig-emu rig%s FILE", at == 2 ? " check" : "");
        if (t->rig != NULL)
            refuse("rig: one file is enough");
        t->rig = t->words[at++];
    }
    if (t->rig == NULL) {
        if (t->word_count == at)
            refuse("which controller? trio or mpc");
        t->one.controller = t->words[at++];
    }
    if (t->word_count > at)
        refuse(t->rig == NULL ? "one controller at a time: '%s' is one too many"
                              : "the controllers are those of the rig file: '%s' is one too many",
               t->words[at]);
}

static void read_panel(options *o, const typed *t)
{
    if (!t->has_panel)
        return;
    if (o->task != TASK_EMULATE)
        refuse("--panel is for dryrig-emu trio|mpc|rig; with run, start dryrig-panel \"$DRYRIG_CONTROL\" in another "
               "terminal");
    if (o->trace != NULL && strcmp(o->trace, "-") == 0)
        refuse("--panel and --trace - would write over each other; --trace FILE does not");
    o->task = TASK_PANEL;
}

static clock_mode read_clock(const char *text)
{
    static const char *const names[] = {"real", "step", "jump"};
    for (unsigned i = 0; i < 3; i++)
        if (text == NULL || strcasecmp(text, names[i]) == 0)
            return (clock_mode)i;
    refuse("--clock %s: expected real, step or jump", text);
}

static void read_lint(options *o, const char *text)
{
    const bool off = text != NULL && strcasecmp(text, "off") == 0;
    if (text != NULL && !off && strcasecmp(text, "on") != 0)
        refuse("--lint=%s: expected on or off", text);
    o->lints = !off && (text != NULL || o->task == TASK_RUN || o->lint_json != NULL || o->lint_junit != NULL);
    if (off && (o->is_strict || o->lint_json != NULL || o->lint_junit != NULL))
        refuse("--lint=off leaves nothing for --strict, --lint-json and --lint-junit");
    if (o->is_strict && o->task != TASK_RUN)
        refuse("--strict is about the exit status of a command: dryrig-emu run ... --strict -- COMMAND");
}

static void read_one(options *o, const typed *t, bool is_paced_by_default)
{
    setup s;
    setup_problem problem;
    if (!setup_read(&t->one, is_paced_by_default, &s, &problem)) {
        if (strcmp(problem.what, "controller") == 0)
            refuse("'%s': %s", problem.text, problem.why);
        if (strcmp(problem.what, "state") == 0)
            refuse("--state: %s", problem.why);
        refuse("--%s %s: %s", problem.what, problem.text == NULL ? "" : problem.text, problem.why);
    }
    if (t->link != NULL && *t->link == '\0')
        refuse("--link: a path is missing");
    if (!rig_of_one(&o->rig, &s, t->link))
        refuse("no memory");
}

static void read_rig(options *o, const typed *t, bool is_paced_by_default)
{
    char why[1024];
    const setup_text *one = &t->one;
    if (t->link != NULL || one->firmware != NULL || one->home != NULL || one->angle != NULL || one->quirks != NULL ||
        one->pace != NULL || one->state != NULL || one->device_count + one->position_count + one->work_count > 0)
        refuse("what a controller is like stands in the rig file: --link, --device, --firmware, --position, --home, "
               "--work, --angle, --quirks, --pace and --state are for one controller without a file");
    o->rig_file = t->rig;
    if (!rig_read(&o->rig, t->rig, is_paced_by_default, why, sizeof why)) {
        (void)fprintf(stderr, "dryrig-emu: %s\n", why);
        exit(2);
    }
}

static void read_seed(options *o, const char *text)
{
    char why[WHY_ROOM];
    unsigned seed = 0;
    if (text != NULL) {
        if (!values_number(text, 0, 99999999, &seed, why))
            refuse("--seed %s: %s", text, why);
    } else {
        (void)!getrandom(&seed, sizeof seed, GRND_NONBLOCK);
        seed %= 100000000u;
        o->seed_is_chosen = true;
    }
    o->seed = seed;
}

options options_read(int argc, char **argv)
{
    static const struct argp argp = {
        known,
        parse,
        "trio|mpc\n"
        "run trio|mpc -- COMMAND [ARGUMENT...]\n"
        "run --rig FILE -- COMMAND [ARGUMENT...]\n"
        "rig [check] FILE\n"
        "replay FILE\n"
        "replay FILE --port PATH --may-move\n"
        "replay --to-host FILE\n"
        "ctl PATH COMMAND",
        "Stands in for a Sutter TRIO MP-245A (trio) or MPC-200 (mpc) micromanipulator controller on a pseudo-terminal. "
        "Prints 'ready' and the port's path, and runs until SIGINT, SIGTERM or SIGHUP.\n"
        "With run: prints nothing, and runs as long as COMMAND does, which finds the port's path in DRYRIG_PORT.\v"
        "Exit status: 0 stopped by a signal, 1 the port, the link or a report cannot be had, "
        "or a report not be written whole, 2 wrong options. "
        "With run: that of COMMAND; "
        "126 it cannot be executed, 127 it is not there, 128+N signal N ended it; 3 with --strict.",
        NULL,
        NULL,
        NULL};
    typed t;
    options o;
    memset(&t, 0, sizeof t);
    memset(&o, 0, sizeof o);
    t.o = &o;
    argp_err_exit_status = 2;
    int own = 1; /* what stands behind "--" is the command's */
    while (own < argc && strcmp(argv[own], "--") != 0)
        own++;
    if (own < argc)
        o.command = argv + own + 1;
    (void)argp_parse(&argp, own, argv, 0, NULL, &t);

    read_task(&o, &t);
    if (o.task == TASK_REPLAY) /* the recording says the rest */
        return o;
    read_panel(&o, &t);
    o.clock = read_clock(t.clock);
    char why[WHY_ROOM];
    o.speedup = 1;
    if (t.speedup != NULL && !values_number(t.speedup, 1, SPEEDUP_MAX, &o.speedup, why))
        refuse("--speedup %s: %s", t.speedup, why);
    if (o.speedup > 1 && o.clock != CLOCK_REAL)
        refuse("--speedup is for --clock real; step and jump have no speed");
    if (o.task == TASK_PLAYBACK && o.clock == CLOCK_STEP)
        refuse("--clock step is not for replay; real and jump are");
    if (o.task == TASK_PLAYBACK)
        return o;
    if (t.rig != NULL)
        read_rig(&o, &t, o.clock == CLOCK_REAL);
    else
        read_one(&o, &t, o.clock == CLOCK_REAL);
    read_lint(&o, t.lint);
    read_seed(&o, t.seed);
    return o;
}
