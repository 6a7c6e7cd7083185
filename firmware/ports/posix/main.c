/* dryrig-guard: stands between a host program and a real controller and lets only safe commands through.
 *
 *     dryrig-guard --port PATH --config FILE ...    bridge: runs until a signal
 *     dryrig-guard check FILE                       explain_rig(): what a configuration means
 *     dryrig-guard explain FILE --from X,Y,Z "..."  explain_motion(): would this pass?
 *     dryrig-guard compile FILE --output FILE       image_write(): for a microcontroller
 *     dryrig-guard ctl SOCKET ORDER                 ctl: orders to a guard that runs
 *     dryrig-guard log FILE                         journal_read(): is a log whole? retell(): replay it
 */
#define _GNU_SOURCE /* argp */
#include "bridge.h"
#include "ctl.h"
#include "explain.h"
#include "image.h"
#include "paths.h"
#include "retell.h"

#include <argp.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { EXIT_DONE, EXIT_CANNOT, EXIT_USAGE, EXIT_CONFIG, EXIT_NO = CTL_NOT_DONE };

const char *argp_program_version = "dryrig-guard " DRYRIG_VERSION;

#define STATUS_WORDS                                                                                                   \
    "Exit status: 0 done (run: stopped by a signal); 1 a port, link, socket or file cannot be had; 2 wrong options; "  \
    "3 the "                                                                                                           \
    "configuration is wrong; 4 the answer is no (explain: refused; compile: no higher revision; ctl: not done; log: "  \
    "not whole)."

static bool read_config(rig *r, const char *path)
{
    char why[RIG_WHY_MAX];
    if (rig_read(r, path, why, sizeof why))
        return true;
    (void)fprintf(stderr, "dryrig-guard: %s\n", why);
    return false;
}

static void once(struct argp_state *state, const char **place, const char *name, const char *value)
{
    if (*place != NULL)
        argp_error(state, "%s is given twice", name);
    if (*value == '\0')
        argp_error(state, "%s is empty", name);
    *place = value;
}

static unsigned read_number(const struct argp_state *state, const char *name, const char *text, unsigned least,
                            unsigned most)
{
    const size_t digits = strspn(text, "0123456789");
    const unsigned long number =
        digits > 0 && digits < 9 && text[digits] == '\0' ? strtoul(text, NULL, 10) : most + 1ul;
    if (number < least || number > most)
        argp_error(state, "%s %s: expected a whole number from %u to %u", name, text, least, most);
    return (unsigned)number;
}

/* One file in two roles would be overwritten by one of them. */
static void keep_apart(const struct argp_state *state, const path_use *uses, size_t count)
{
    size_t a, b;
    if (paths_clash(uses, count, &a, &b))
        argp_error(state, "%s %s and %s %s are the same file; choose another path for one of them", uses[a].option,
                   uses[a].path, uses[b].option, uses[b].path);
}

/* -- run --------------------------------------------------------------------------------------------------------------- */

enum {
    OUTPUT = 'o',
    PORT = 256,
    CONFIG,
    LINK,
    CONTROL,
    LOG,
    RECORD,
    FROM,
    DRIVE,
    ANGLE,
    IN_TISSUE,
    MAY_CALIBRATE,
    FOLLOW,
    JSON
};

static error_t parse_run(int key, char *value, struct argp_state *state)
{
    bridge_options *const o = state->input;
    switch (key) {
    case PORT:
        once(state, &o->port, "--port", value);
        break;
    case CONFIG:
        once(state, &o->config, "--config", value);
        break;
    case LINK:
        once(state, &o->link, "--link", value);
        break;
    case CONTROL:
        once(state, &o->control, "--control", value);
        break;
    case LOG:
        once(state, &o->log, "--log", value);
        break;
    case RECORD:
        once(state, &o->record, "--record", value);
        break;
    case ARGP_KEY_ARG:
        argp_error(state, "'%s' is no option, and none of check, explain, compile, ctl, log", value);
        break;
    case ARGP_KEY_END:
        if (o->port == NULL)
            argp_error(state, "--port is missing: where is the controller?");
        if (o->config == NULL)
            argp_error(state, "--config is missing: what are the limits of this rig?");
        keep_apart(state,
                   (const path_use[]){{"--port", o->port, false},
                                      {"--config", o->config, false},
                                      {"--link", o->link, true},
                                      {"--control", o->control, true},
                                      {"--log", o->log, false},
                                      {"--record", o->record, false}},
                   6);
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static int run(int argc, char **argv)
{
    static const struct argp_option known[] = {
        {"port", PORT, "PATH", 0, "The controller: a serial port, or the port of dryrig-emu", 1},
        {"config", CONFIG, "FILE", 0, "The limits of the rig; 'dryrig-guard check FILE' explains them", 1},
        {"link", LINK, "PATH", 0, "Make a symbolic link PATH to the host's port; it is removed at the end", 2},
        {"control", CONTROL, "SOCKET", 0,
         "Take orders at this Unix socket: see 'dryrig-guard ctl'. Without it nothing can arm", 2},
        {"log", LOG, "FILE", 0, "Append what happens to FILE, one line a record; 'dryrig-guard log FILE' verifies it",
         2},
        {"record", RECORD, "FILE", 0,
         "Write the bytes on the controller's line and their times to FILE, for 'dryrig decode' and 'dryrig-emu "
         "replay'",
         2},
        {NULL, 0, NULL, 0, NULL, 0}};
    static const struct argp argp = {
        known,
        parse_run,
        NULL,
        "Stands between a host program and a Sutter TRIO MP-245A or MPC-200 controller "
        "and lets only safe commands through. "
        "The host program opens the port that is printed after 'ready' instead of the "
        "controller's. Other uses: dryrig-guard "
        "check FILE; dryrig-guard explain FILE ...; dryrig-guard compile FILE ...; dryrig-guard ctl SOCKET ...; "
        "dryrig-guard log FILE; each has --help.\v" STATUS_WORDS,
        NULL,
        NULL,
        NULL};
    static bridge b;
    bridge_options o = {NULL, NULL, NULL, NULL, NULL, NULL};
    (void)argp_parse(&argp, argc, argv, 0, NULL, &o);
    if (!read_config(&b.rig, o.config))
        return EXIT_CONFIG;
    if ((b.rig.limits.rig & DR_RIG_HAS_CUT) == 0)
        return bridge_run(&b, &o);
    (void)fprintf(stderr, "dryrig-guard: %s: 'relay' is for a guard on a board: this program cannot open one\n",
                  o.config);
    return EXIT_CONFIG;
}

/* -- check ------------------------------------------------------------------------------------------------------------- */

static error_t parse_file(int key, char *value, struct argp_state *state)
{
    const char **const path = state->input;
    if (key == ARGP_KEY_ARG)
        once(state, path, "the file", value);
    else if (key == ARGP_KEY_END && *path == NULL)
        argp_error(state, "which file?");
    else if (key != ARGP_KEY_END)
        return ARGP_ERR_UNKNOWN;
    return 0;
}

static int check(int argc, char **argv)
{
    static const struct argp argp = {
        NULL, parse_file, "FILE", "Checks a configuration and tells what it allows and refuses.\v" STATUS_WORDS,
        NULL, NULL,       NULL};
    static rig r;
    const char *path = NULL;
    (void)argp_parse(&argp, argc, argv, 0, NULL, &path);
    if (!read_config(&r, path))
        return EXIT_CONFIG;
    explain_rig(stdout, &r, path);
    return fflush(stdout) == 0 ? EXIT_DONE : EXIT_CANNOT;
}

/* -- log --------------------------------------------------------------------------------------------------------------- */

typedef struct {
    const char *path, *config, *record;
} log_options;

static error_t parse_log(int key, char *value, struct argp_state *state)
{
    log_options *const o = state->input;
    switch (key) {
    case CONFIG:
        once(state, &o->config, "--config", value);
        break;
    case RECORD:
        once(state, &o->record, "--record", value);
        break;
    case ARGP_KEY_ARG:
        once(state, &o->path, "the file", value);
        break;
    case ARGP_KEY_END:
        if (o->path == NULL)
            argp_error(state, "which file?");
        if ((o->config == NULL) != (o->record == NULL))
            argp_error(
                state,
                "--record needs --config, and the other way round: a log does not tell which controller it is of");
        keep_apart(state,
                   (const path_use[]){
                       {"the log", o->path, false}, {"--config", o->config, false}, {"--record", o->record, false}},
                   3);
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static int refuse_log(const char *why, int status)
{
    (void)fprintf(stderr, "dryrig-guard: %s\n", why);
    return status;
}

static int retell_log(journal_reader *reader, const log_options *o)
{
    static rig r;
    char why[RIG_WHY_MAX] = "";
    if (!read_config(&r, o->config))
        return EXIT_CONFIG;
    FILE *const to = recording_may_replace(o->record) ? fopen(o->record, "we") : NULL;
    if (to == NULL) {
        (void)snprintf(why, sizeof why, "%s: %s", o->record,
                       errno == EEXIST ? "holds something else than a recording: it stays. Choose another path"
                                       : strerror(errno));
        return refuse_log(why, EXIT_CANNOT);
    }
    const bool is_told = retell(reader, &r, to, why, sizeof why);
    if (fclose(to) == 0 && is_told)
        return EXIT_DONE;
    if (is_told)
        (void)snprintf(why, sizeof why, "%s: %s", o->record, strerror(errno));
    return refuse_log(why, EXIT_NO);
}

static int verify_log(journal_reader *reader)
{
    dr_record record;
    while (journal_read(reader, &record)) {}
    if (reader->why[0] != '\0')
        return refuse_log(reader->why, EXIT_NO);
    (void)printf("%s: whole, %llu records of %llu starts\n", reader->path, (unsigned long long)reader->records,
                 (unsigned long long)reader->starts);
    return EXIT_DONE;
}

static int read_log(int argc, char **argv)
{
    static const struct argp_option known[] = {
        {"record", RECORD, "OUT", 0, "Write the bytes on the controller's line to OUT, for 'dryrig-emu replay'", 1},
        {"config", CONFIG, "RIG", 0, "The configuration under which the log was written", 1},
        {NULL, 0, NULL, 0, NULL, 0}};
    static const struct argp argp = {
        known,
        parse_log,
        "FILE",
        "Verifies that no record of a log was changed, left out or put in; or makes a recording of it.\v" STATUS_WORDS,
        NULL,
        NULL,
        NULL};
    journal_reader reader;
    log_options o = {NULL, NULL, NULL};
    (void)argp_parse(&argp, argc, argv, 0, NULL, &o);
    if (!journal_start_reading(&reader, o.path))
        return refuse_log(reader.why, EXIT_CANNOT);
    const int status = o.record != NULL ? retell_log(&reader, &o) : verify_log(&reader);
    journal_stop_reading(&reader);
    return status;
}

/* -- compile ----------------------------------------------------------------------------------------------------------- */

typedef struct {
    const char *from, *to;
} compile_options;

static error_t parse_compile(int key, char *value, struct argp_state *state)
{
    compile_options *const o = state->input;
    switch (key) {
    case OUTPUT:
        once(state, &o->to, "--output", value);
        break;
    case ARGP_KEY_ARG:
        once(state, &o->from, "the configuration", value);
        break;
    case ARGP_KEY_END:
        if (o->from == NULL || o->to == NULL)
            argp_error(state, "expected a configuration and --output, as: rig.conf -o rig.bin");
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static int compile(int argc, char **argv)
{
    static const struct argp_option known[] = {
        {"output", OUTPUT, "FILE", 0, "Where the binary goes. It is replaced as a whole, by a higher revision only", 1},
        {NULL, 0, NULL, 0, NULL, 0}};
    static const struct argp argp = {known,
                                     parse_compile,
                                     "CONFIGURATION",
                                     "Writes a configuration as the binary that the guard of a microcontroller loads. "
                                     "'dryrig-guard check' tells what "
                                     "a binary holds.\v" STATUS_WORDS,
                                     NULL,
                                     NULL,
                                     NULL};
    static rig r;
    char why[RIG_WHY_MAX];
    compile_options o = {NULL, NULL};
    (void)argp_parse(&argp, argc, argv, 0, NULL, &o);
    if (!read_config(&r, o.from))
        return EXIT_CONFIG;
    const image_result result = image_write(o.to, &r.limits, why, sizeof why);
    if (result != IMAGE_WRITTEN) {
        (void)fprintf(stderr, "dryrig-guard: %s\n", why);
        return result == IMAGE_NOT_NEWER ? EXIT_NO : EXIT_CANNOT;
    }
    (void)printf("%s: %u bytes, revision %lu, hash %08lX\n", o.to, DR_LIMITS_IMAGE_BYTES,
                 (unsigned long)r.limits.revision, (unsigned long)dr_limits_crc(&r.limits));
    return fflush(stdout) == 0 ? EXIT_DONE : EXIT_CANNOT;
}

/* -- explain ----------------------------------------------------------------------------------------------------------- */

typedef struct {
    const char *path, *motion;
    explain_scene scene;
} explain_options;

static error_t parse_explain(int key, char *value, struct argp_state *state)
{
    explain_options *const o = state->input;
    switch (key) {
    case FROM:
        once(state, &o->scene.from, "--from", value);
        break;
    case DRIVE:
        o->scene.drive = (uint8_t)(read_number(state, "--drive", value, 1, DR_PORTS) - 1u);
        break;
    case ANGLE:
        o->scene.angle_deg = (uint8_t)read_number(state, "--angle", value, 0, DR_ANGLE_MAX_DEG);
        break;
    case IN_TISSUE:
        o->scene.in_tissue = true;
        break;
    case MAY_CALIBRATE:
        o->scene.may_calibrate = true;
        break;
    case ARGP_KEY_ARG:
        once(state, o->path == NULL ? &o->path : &o->motion, "the command (put it in quotation marks)", value);
        break;
    case ARGP_KEY_END:
        if (o->motion == NULL)
            argp_error(state, "expected a configuration and a command, as: rig.conf --from 1000,2000,500 \"line 2000 "
                              "2000 500 speed 8\"");
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static int explain(int argc, char **argv)
{
    static const struct argp_option known[] = {
        {"from", FROM, "X,Y,Z", 0, "Where the tip is, in microns", 1},
        {"drive", DRIVE, "N", 0, "The active drive, 1 to 4 (default 1)", 1},
        {"angle", ANGLE, "DEG", 0, "TRIO: its angle (default 30)", 1},
        {"in-tissue", IN_TISSUE, NULL, 0, "As after 'surface on'", 1},
        {"may-calibrate", MAY_CALIBRATE, NULL, 0, "As after 'allow-calibrate'", 1},
        {NULL, 0, NULL, 0, NULL, 0}};
    static const struct argp argp = {
        known,
        parse_explain,
        "FILE \"COMMAND\"",
        "Tells whether a guard that is armed would let a command pass, and by which rule not. Lengths are "
        "microns: \"line 1000 2000 500 speed 8\", \"x 1200\", \"home\".\v" STATUS_WORDS,
        NULL,
        NULL,
        NULL};
    static rig r;
    char why[RIG_WHY_MAX];
    explain_options o = {NULL, NULL, {.angle_deg = DR_ANGLE_DEFAULT_DEG}};
    (void)argp_parse(&argp, argc, argv, 0, NULL, &o);
    if (!read_config(&r, o.path))
        return EXIT_CONFIG;
    switch (explain_motion(stdout, &r, &o.scene, o.motion, why, sizeof why)) {
    case EXPLAIN_ALLOWED:
        return EXIT_DONE;
    case EXPLAIN_REFUSED:
        return EXIT_NO;
    case EXPLAIN_WRONG:
        break;
    }
    (void)fprintf(stderr, "dryrig-guard: \"%s\": %s\n", o.motion, why);
    return EXIT_USAGE;
}

/* -- ctl --------------------------------------------------------------------------------------------------------------- */

typedef struct {
    const char *path;
    char order[CONTROL_LINE_MAX];
    bool follows, is_json;
} ctl_options;

static error_t parse_ctl(int key, char *value, struct argp_state *state)
{
    ctl_options *const o = state->input;
    const size_t used = strlen(o->order);
    switch (key) {
    case FOLLOW:
        o->follows = true;
        break;
    case JSON:
        o->is_json = true;
        break;
    case ARGP_KEY_ARG:
        if (o->path == NULL)
            o->path = value;
        else if (used + strlen(value) + 2u > sizeof o->order || strchr(value, '\n') != NULL)
            argp_error(state, "the order is too long");
        else
            (void)snprintf(o->order + used, sizeof o->order - used, "%s%s", used > 0 ? " " : "", value);
        break;
    case ARGP_KEY_END:
        if (o->order[0] == '\0')
            argp_error(state, "expected a socket and an order, as: /run/rig.sock status");
        if (o->follows && strcmp(o->order, "status") != 0)
            argp_error(state, "--follow is for status");
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return 0;
}

static int ctl(int argc, char **argv)
{
    static const struct argp_option known[] = {
        {"follow", FOLLOW, NULL, 0, "status: tell every change and every refusal, until the guard ends", 1},
        {"json", JSON, NULL, 0, "Print the guard's answers as they come", 1},
        {NULL, 0, NULL, 0, NULL, 0}};
    static const struct argp argp = {
        known,
        parse_ctl,
        "SOCKET ORDER",
        "Gives an order to a guard that runs with --control SOCKET: status, arm, disarm, stop, clear, confirm, "
        "allow-calibrate, surface on|off, escape on|off, tip-changed, log [N].\v" STATUS_WORDS,
        NULL,
        NULL,
        NULL};
    ctl_options o = {NULL, "", false, false};
    (void)argp_parse(&argp, argc, argv, 0, NULL, &o);
    return ctl_run(o.path, o.follows ? "follow" : o.order, o.follows, o.is_json);
}

/* -- Which ------------------------------------------------------------------------------------------------------------- */

/* A program that is started without stdin, stdout or stderr must not get a port under their numbers. */
static void fill_standard_fds(void)
{
    int fd;
    while ((fd = open("/dev/null", O_RDWR)) >= 0 && fd <= STDERR_FILENO) {}
    if (fd > STDERR_FILENO)
        (void)close(fd);
}

int main(int argc, char **argv)
{
    static struct {
        char shown[24];
        int (*run)(int, char **);
    } uses[] = {
        {"dryrig-guard check", check}, {"dryrig-guard explain", explain}, {"dryrig-guard compile", compile},
        {"dryrig-guard ctl", ctl},     {"dryrig-guard log", read_log},
    };
    argp_err_exit_status = EXIT_USAGE;
    fill_standard_fds();
    for (size_t i = 0; argc > 1 && i < sizeof uses / sizeof uses[0]; i++)
        if (strcmp(argv[1], strchr(uses[i].shown, ' ') + 1) == 0) {
            argv[1] = uses[i].shown; /* the name in its messages */
            return uses[i].run(argc - 1, argv + 1);
        }
    return run(argc, argv);
}
