#define _GNU_SOURCE /* getopt_long, strcasecmp */

#include "options.h"

#include <ctype.h>
#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const command_row commands[] = {
    {CMD_INFO, "info", "", 0, false, false, "what the controller says of itself, its stage, and where it stands", ""},
    {CMD_POSITION, "position", "", 0, false, true, "where the active drive stands", ""},
    {CMD_MOVE, "move", "X Y Z", 3, true, true, "to a position at full speed",
     "An MPC-200 runs all axes at once, each until it is there.\n"
     "A TRIO runs them in an order that protects the tip: --order home: X and Z first, Y last (to withdraw); --order "
     "work:\n"
     "Y first, X and Z last (to approach). Without --order: work when Z grows, home otherwise. X and Z follow the "
     "angle.\n"},
    {CMD_LINE, "line", "X Y Z --speed LEVEL [--stream]", 3, true, true,
     "to a position in a straight line at a chosen speed",
     "LEVEL is 0 (slowest) to 15: 312.5 um/s times LEVEL + 1 on a TRIO, 81.25 um/s times LEVEL + 1 on an MPC-200 "
     "(from\n"
     "firmware 3.00), for the axis with the longest way. --stream (MPC-200) prints the position at every micron.\n"},
    {CMD_AXIS, "axis", "x|y|z VALUE", 2, true, true, "one axis to a coordinate, the others stay", ""},
    {CMD_HOME, "home", "", 0, true, false, "to the home position",
     "TRIO: the one that its HOME button stores. MPC-200: 0, 0, 0.\n"},
    {CMD_WORK, "work", "", 0, true, false, "to the stored work position",
     "An MPC-200 goes there only right after 'home'.\n"},
    {CMD_CALIBRATE, "calibrate", "", 0, true, false, "run to the beginning of travel and count from there",
     "Take the electrode out of the way first. An interrupted calibration leaves an MPC-200 uncalibrated until a "
     "power\n"
     "cycle and a whole calibration.\n"},
    {CMD_ANGLE, "angle", "DEGREES", 1, false, false, "TRIO: set the angle of the dovetail, 0 to 90",
     "At 0 the Z axis, at 90 the X axis does not move.\n"},
    {CMD_SELECT, "select", "N", 1, false, false, "MPC-200: make drive 1 to 4 the active one", ""},
    {CMD_STOP, "stop", "", 0, true, false, "stop what moves (TRIO: a straight line) and say where it stands",
     "For motions that another program began and no longer waits for: the port is one program's at a time.\n"},
    {CMD_MODE, "mode", "N", 1, false, false, "MPC-200: set the mode of the ROE, 0 (coarsest) to 9 (finest)", ""},
    {CMD_PORTS, "ports", "", 0, false, false, "list the serial ports of this machine", ""},
    {CMD_DECODE, "decode", "BYTES|FILE", 1, false, false, "explain bytes, one by one, without a controller",
     "BYTES is hexadecimal text, as one argument: the host's bytes; behind '<' the controller's, behind '>' the host's "
     "again:\n"
     "'43 < 01 80 3E 00 00 00 00 00 00 00 7D 00 00 0D'. They need --controller, and microns --stage.\n"
     "FILE is a recording, as dryrig-emu --record writes it (./beef where the name looks like bytes).\n"},
};

#define COMMANDS (sizeof commands / sizeof commands[0])

static const char options_help[] =
    "Options, before or after the command:\n"
    "  -p, --port PATH          the serial port, or the emulator's PTY or link (default: $DRYRIG_PORT)\n"
    "  -c, --controller NAME    trio (TRIO MP-245A) or mpc (MPC-200)\n"
    "  -s, --stage MODEL        the stage, as on its label; microns need it. MPC-200: one for all drives, or one each\n"
    "      --steps              coordinates are microsteps, not microns\n"
    "      --json               results as JSON, one object a line\n"
    "      --firmware X.YY      the firmware, where the controller cannot tell: TRIO, MPC-200 below 3.00\n"
    "      --baud N             the baud rate (57600 or 128000)\n"
    "      --fast               the controller is emulated, faster than real time (or: $DRYRIG_FAST is set)\n"
    "      --record FILE        write the bytes of both directions, with times, to FILE ('decode' explains it)\n"
    "  -h, --help               this, or help on the command\n"
    "  -V, --version\n";

static const char exit_help[] =
    "Exit status: 0 done; 1 trouble with the link or the controller; 2 usage, or a refused target; 130 interrupted.\n";

/* What is printed before the program ends anyway may fail to be: there is nobody left to tell. */
static void help_on_all(void)
{
    (void)puts("Usage: dryrig --port PATH --controller trio|mpc [--stage MODEL] COMMAND ...\n"
               "Drives a TRIO MP-245A or MPC-200 micromanipulator controller, real or emulated.\n\n"
               "Commands:");
    for (size_t i = 0; i < COMMANDS; i++) {
        char left[48];
        (void)snprintf(left, sizeof left, "%s %s", commands[i].name, commands[i].arguments);
        (void)printf("  %-24s %s%s\n", strlen(left) > 24 ? commands[i].name : left,
                     commands[i].id == CMD_LINE ? "X Y Z --speed LEVEL [--stream]: " : "", commands[i].summary);
    }
    (void)printf("\n%s\nCoordinates count from the beginning of travel. 'dryrig COMMAND --help' says more.\n%s",
                 options_help, exit_help);
    for (int i = DRYRIG_TRIO; i <= DRYRIG_MPC; i++) {
        char names[DRYRIG_WHY_MAX];
        (void)dryrig_stage_names((dryrig_controller)i, names, sizeof names);
        (void)printf("Stages of %s: %s.\n", i == DRYRIG_TRIO ? "trio" : "mpc", names);
    }
}

static void help_on(const command_row *command)
{
    (void)printf("Usage: dryrig [OPTIONS] %s %s\n%c%s.\n%s\n%s\n%s", command->name, command->arguments,
                 command->summary[0] == 'M' || command->summary[0] == 'T' ? command->summary[0]
                                                                          : toupper((unsigned char)command->summary[0]),
                 command->summary + 1, command->help, options_help, exit_help);
}

void usage_error(const command_row *command, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    (void)fputs("dryrig: ", stderr);
    (void)vfprintf(stderr, format, arguments);
    va_end(arguments);
    (void)fprintf(stderr, "\nTry 'dryrig%s%s --help'.\n", command != NULL ? " " : "",
                  command != NULL ? command->name : "");
    exit(EXIT_USAGE);
}

double read_um(const command_row *command, const char *what, const char *text)
{
    char *end;
    const double value = strtod(text, &end);
    if (end == text || *end != '\0' || !(value >= -1e12 && value <= 1e12))
        usage_error(command, "%s must be a number of microns, and is '%s'", what, text);
    return value;
}

int32_t read_integer(const command_row *command, const char *what, const char *text)
{
    char *end;
    errno = 0;
    const long value = strtol(text, &end, 10);
    if (end == text || *end != '\0' || errno != 0 || value < INT32_MIN || value > INT32_MAX)
        usage_error(command, "%s must be a whole number, and is '%s'", what, text);
    return (int32_t)value;
}

/* As binary-coded decimals. */
static unsigned read_firmware(const char *text)
{
    const size_t length = strlen(text), point = length - 3u;
    bool is_version = length >= 4 && length <= 5 && text[0] != '0';
    unsigned version = 0;
    for (size_t i = 0; is_version && i < length; i++) {
        is_version = i == point ? text[i] == '.' : isdigit((unsigned char)text[i]) != 0;
        if (i != point)
            version = version << 4u | (unsigned)(text[i] - '0');
    }
    if (!is_version)
        usage_error(NULL, "--firmware must look like 3.21, and is '%s'", text);
    return version;
}

static const command_row *find_command(const char *name)
{
    for (size_t i = 0; i < COMMANDS; i++)
        if (strcmp(commands[i].name, name) == 0)
            return &commands[i];
    usage_error(NULL, "there is no command '%s'", name);
}

/* A coordinate may be negative, if only to be refused: it is no option. */
static bool is_number(const char *text)
{
    return text[0] == '-' && (isdigit((unsigned char)text[1]) || (text[1] == '.' && isdigit((unsigned char)text[2])));
}

enum { OPT_STEPS = 256, OPT_JSON, OPT_FIRMWARE, OPT_BAUD, OPT_SPEED, OPT_STREAM, OPT_ORDER, OPT_RECORD, OPT_FAST };

static const struct option long_options[] = {
    {"port", required_argument, NULL, 'p'},
    {"controller", required_argument, NULL, 'c'},
    {"stage", required_argument, NULL, 's'},
    {"steps", no_argument, NULL, OPT_STEPS},
    {"json", no_argument, NULL, OPT_JSON},
    {"firmware", required_argument, NULL, OPT_FIRMWARE},
    {"baud", required_argument, NULL, OPT_BAUD},
    {"fast", no_argument, NULL, OPT_FAST},
    {"speed", required_argument, NULL, OPT_SPEED},
    {"stream", no_argument, NULL, OPT_STREAM},
    {"order", required_argument, NULL, OPT_ORDER},
    {"record", required_argument, NULL, OPT_RECORD},
    {"help", no_argument, NULL, 'h'},
    {"version", no_argument, NULL, 'V'},
    {NULL, 0, NULL, 0},
};

/* As written; what it means together is looked at when all is read. */
typedef struct {
    const char *port, *controller, *stage[DRYRIG_DRIVES], *firmware, *baud, *speed, *order;
    int stage_count;
    bool fast, help;
} raw_options;

static void take_option(int option, raw_options *raw, command_line *line)
{
    switch (option) {
    case 'p':
        raw->port = optarg;
        break;
    case 'c':
        raw->controller = optarg;
        break;
    case 's':
        if (raw->stage_count == DRYRIG_DRIVES)
            usage_error(NULL, "--stage: a controller has at most %d drives", DRYRIG_DRIVES);
        raw->stage[raw->stage_count++] = optarg;
        break;
    case OPT_STEPS:
        line->steps = true;
        break;
    case OPT_JSON:
        line->json = true;
        break;
    case OPT_FIRMWARE:
        raw->firmware = optarg;
        break;
    case OPT_FAST:
        raw->fast = true;
        break;
    case OPT_BAUD:
        raw->baud = optarg;
        break;
    case OPT_SPEED:
        raw->speed = optarg;
        break;
    case OPT_STREAM:
        line->stream = true;
        break;
    case OPT_ORDER:
        raw->order = optarg;
        break;
    case OPT_RECORD:
        line->record = optarg;
        break;
    case 'h':
        raw->help = true;
        break;
    case 'V':
        (void)puts("dryrig " DRYRIG_VERSION);
        exit(EXIT_DONE);
    default: /* getopt has said what is wrong */
        (void)fputs("Try 'dryrig --help'.\n", stderr);
        exit(EXIT_USAGE);
    }
}

/* Options and words in any order. getopt_long stops at the first word ('+'), and would take -5 for an option. */
static void read_words(int argc, char **argv, raw_options *raw, command_line *line)
{
    bool options_end = false;
    int words = 0;
    for (optind = 1; optind < argc;) {
        const int option =
            options_end || is_number(argv[optind]) ? -1 : getopt_long(argc, argv, "+p:c:s:hV", long_options, NULL);
        if (option != -1) {
            take_option(option, raw, line);
            continue;
        }
        if (optind == argc)
            break;
        if (!options_end && strcmp(argv[optind - 1], "--") == 0 && !is_number(argv[optind])) /* getopt has passed it */
            options_end = true;
        if (line->command == NULL)
            line->command = find_command(argv[optind]);
        else if (words < line->command->argument_count)
            line->argument[words++] = argv[optind];
        else if (!raw->help)
            usage_error(line->command, "%s: '%s' is one argument too many", line->command->name, argv[optind]);
        optind++;
    }
    if (line->command == NULL && !raw->help)
        usage_error(NULL, "no command was given");
    if (!raw->help && words < line->command->argument_count)
        usage_error(line->command, "%s needs %s", line->command->name, line->command->arguments);
}

static void set_stages(const raw_options *raw, command_line *line)
{
    const dryrig_controller controller = line->open.controller;
    if (controller == DRYRIG_TRIO && raw->stage_count > 1)
        usage_error(NULL, "--stage: a TRIO has one");
    for (int i = 0; i < DRYRIG_DRIVES && raw->stage_count > 0; i++) {
        dryrig_stage stage;
        const int which = raw->stage_count == 1 ? 0 : i;
        if (which >= raw->stage_count)
            break;
        if (dryrig_get_stage(controller, raw->stage[which], &stage) != DRYRIG_OK) {
            char names[DRYRIG_WHY_MAX];
            (void)dryrig_stage_names(controller, names, sizeof names);
            usage_error(NULL, "--stage: %s has no stage '%s'; there are: %s", raw->controller, raw->stage[which],
                        names);
        }
        if (i == 0 || controller == DRYRIG_MPC)
            line->open.stage[i] = raw->stage[which];
    }
    line->has_stage = raw->stage_count > 0;
    if (!line->has_stage && !line->steps && line->command->has_coordinates) {
        char names[DRYRIG_WHY_MAX];
        (void)dryrig_stage_names(controller, names, sizeof names);
        usage_error(line->command,
                    "%s: microns need --stage, as the size of a step depends on it (or use --steps). "
                    "Stages: %s",
                    line->command->name, names);
    }
}

static void set_controller(const raw_options *raw, command_line *line)
{
    if (strcasecmp(raw->controller, "trio") != 0 && strcasecmp(raw->controller, "mpc") != 0)
        usage_error(line->command, "--controller must be trio or mpc, and is '%s'", raw->controller);
    line->open = dryrig_defaults(strcasecmp(raw->controller, "trio") == 0 ? DRYRIG_TRIO : DRYRIG_MPC);
    line->has_controller = true;
}

/* Nothing is opened: a recording says itself what the controller was. */
static void set_decode_options(const raw_options *raw, command_line *line)
{
    if (raw->controller == NULL) {
        if (raw->stage_count > 0 || raw->firmware != NULL)
            usage_error(line->command, "--stage and --firmware need --controller");
        return;
    }
    set_controller(raw, line);
    if (raw->firmware != NULL)
        line->open.firmware = read_firmware(raw->firmware);
    set_stages(raw, line);
}

static void set_options(const raw_options *raw, command_line *line)
{
    const command_row *command = line->command;
    if (raw->controller == NULL)
        usage_error(command, "--controller is missing: trio or mpc");
    set_controller(raw, line);
    line->open.is_fast = raw->fast || getenv("DRYRIG_FAST") != NULL;
    line->open.port = raw->port != NULL ? raw->port : getenv("DRYRIG_PORT");
    if (line->open.port == NULL)
        usage_error(command, "--port is missing, and DRYRIG_PORT is not set; 'dryrig ports' lists the serial ports");
    if (raw->firmware != NULL)
        line->open.firmware = read_firmware(raw->firmware);
    if (raw->baud != NULL) {
        const int32_t baud = read_integer(command, "--baud", raw->baud);
        if (baud <= 0)
            usage_error(command, "--baud must be above 0");
        line->open.baud = (unsigned)baud;
    }
    if (command->id != CMD_LINE && (raw->speed != NULL || line->stream))
        usage_error(command, "--speed and --stream belong to 'line'");
    if (command->id == CMD_LINE && raw->speed == NULL)
        usage_error(command, "line needs --speed, 0 (slowest) to 15");
    line->speed = raw->speed != NULL ? read_integer(command, "--speed", raw->speed) : 0;
    if (raw->order != NULL && command->id != CMD_MOVE)
        usage_error(command, "--order belongs to 'move'");
    if (raw->order != NULL && strcmp(raw->order, "home") != 0 && strcmp(raw->order, "work") != 0)
        usage_error(command, "--order must be home or work, and is '%s'", raw->order);
    if (raw->order != NULL)
        line->order = strcmp(raw->order, "home") == 0 ? DRYRIG_ORDER_HOME : DRYRIG_ORDER_WORK;
    set_stages(raw, line);
}

command_line read_command_line(int argc, char **argv)
{
    command_line line;
    raw_options raw;
    memset(&line, 0, sizeof line);
    memset(&raw, 0, sizeof raw);
    read_words(argc, argv, &raw, &line);
    if (raw.help) {
        if (line.command != NULL)
            help_on(line.command);
        else
            help_on_all();
        exit(EXIT_DONE);
    }
    if (line.record != NULL && (line.command->id == CMD_DECODE || line.command->id == CMD_PORTS))
        usage_error(line.command, "--record: %s has nothing to record", line.command->name);
    if (line.command->id == CMD_DECODE)
        set_decode_options(&raw, &line);
    else if (line.command->id != CMD_PORTS)
        set_options(&raw, &line);
    return line;
}
