/* options: what the command line of dryrig says. */
#ifndef OPTIONS_H
#define OPTIONS_H

#include "dryrig/dryrig.h"

typedef enum {
    CMD_INFO,
    CMD_POSITION,
    CMD_MOVE,
    CMD_LINE,
    CMD_AXIS,
    CMD_HOME,
    CMD_WORK,
    CMD_CALIBRATE,
    CMD_ANGLE,
    CMD_SELECT,
    CMD_STOP,
    CMD_MODE,
    CMD_PORTS,
    CMD_DECODE
} command_id;

typedef struct {
    command_id id;
    const char *name;
    const char *arguments; /* as in the usage line */
    int argument_count;
    bool is_motion;       /* SIGINT sends an interrupt */
    bool has_coordinates; /* microns need the stage */
    const char *summary;  /* one line */
    const char *help;     /* the rest of --help */
} command_row;

typedef struct {
    dryrig_options open;
    const command_row *command;
    const char *argument[3];
    const char *record; /* NULL: nothing is recorded */
    bool has_stage, has_controller;
    bool steps, json, stream;
    int speed;
    dryrig_order order;
} command_line;

enum { EXIT_DONE = 0, EXIT_LINK = 1, EXIT_USAGE = 2, EXIT_SIGNAL = 128 };

/* Reads the command line. Prints help, the version or what is wrong, and ends the program with EXIT_DONE or EXIT_USAGE.
 * */
command_line read_command_line(int argc, char **argv);
/* Prints "dryrig: " and the rest to stderr, with the way to the help, and ends the program with EXIT_USAGE. */
#if defined(__GNUC__)
__attribute__((noreturn, format(printf, 2, 3)))
#endif
void usage_error(const command_row *command, const char *format, ...);

/* Numbers of arguments: all of the text must be one. `what` names it in the error, which ends the program. */
double read_um(const command_row *command, const char *what, const char *text);
int32_t read_integer(const command_row *command, const char *what, const char *text);

#endif
