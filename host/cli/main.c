/* dryrig: drives a controller from the command line. Reads the line (options.c), does it by the library, prints
 * (print.c). */
#define _GNU_SOURCE /* sigaction */

#include "decode.h"
#include "options.h"
#include "print.h"
#include "record.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

/* -- Signals: a motion is stopped, not left running ---------------------------------------------------------------- */

static dryrig *volatile moving; /* the controller that a motion command has opened */
static volatile sig_atomic_t signals, last_signal;

static void say(const char *text) { (void)!write(STDERR_FILENO, text, strlen(text)); }

static void on_signal(int number)
{
    last_signal = number;
    signals++;
    if (moving == NULL || signals > 2) /* nothing was moved by us, or somebody is impatient */
        _exit(EXIT_SIGNAL + number);
    if (dryrig_interrupt(moving) != DRYRIG_ERR_CANNOT_STOP)
        return;
    if (signals == 2)
        _exit(EXIT_SIGNAL + number);
    say("\ndryrig: a TRIO cannot stop this motion; waiting for its end (once more: leave it running)\n");
}

/* Also where the signal came in ignored, as in a background job: somebody may kill -INT it to stop the motion. */
static void catch_signals(void)
{
    static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
    struct sigaction action;
    memset(&action, 0, sizeof action);
    action.sa_handler = on_signal;
    (void)sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        (void)sigaddset(&action.sa_mask, numbers[i]);
    }
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        (void)sigaction(numbers[i], &action, NULL);
}

/* -- While it moves ------------------------------------------------------------------------------------------------ */

typedef struct {
    const command_line *line;
    bool has_terminal; /* for the progress line */
    bool has_progress; /* something is on it */
} watcher;

static void clear_progress(watcher *w)
{
    if (w->has_progress)
        (void)fputs("\r\033[K", stderr);
    w->has_progress = false;
}

static void on_motion(void *context, const dryrig_motion *motion)
{
    watcher *w = context;
    if (motion->streamed && w->line->stream) {
        clear_progress(w);
        print_streamed(w->line, &motion->position);
    } else if (w->has_terminal && !motion->streamed) {
        const unsigned done =
            motion->elapsed_ms < motion->expected_ms ? motion->elapsed_ms * 100u / motion->expected_ms : 100u;
        (void)fprintf(stderr, "\r%s: %u %% of the time, %.1f s of %.1f s at most\033[K", w->line->command->name, done,
                      motion->elapsed_ms / 1000.0, motion->expected_ms / 1000.0);
        w->has_progress = true;
    }
}

/* -- Commands ------------------------------------------------------------------------------------------------------ */

/* X, Y, Z as the library takes them; `um` or `steps` by the options. */
typedef struct {
    double um[DRYRIG_AXES];
    int32_t steps[DRYRIG_AXES];
} target;

static int axis_of(const command_line *line)
{
    const char *name = line->argument[0];
    const char *found = name[0] != '\0' && name[1] == '\0' ? strchr("xyzXYZ", name[0]) : NULL;
    if (found == NULL)
        usage_error(line->command, "axis: '%s' is none of x, y, z", name);
    return (int)(found - &"xyzXYZ"[0]) % DRYRIG_AXES;
}

/* Before the port is opened: bad numbers need no controller. */
static target read_target(const command_line *line)
{
    static const char *const names[DRYRIG_AXES] = {"X", "Y", "Z"};
    target to;
    memset(&to, 0, sizeof to);
    const bool is_axis = line->command->id == CMD_AXIS;
    const int axis = is_axis ? axis_of(line) : 0;
    for (int i = 0; i < (is_axis ? 1 : DRYRIG_AXES); i++) {
        const char *text = line->argument[is_axis ? 1 : i];
        const char *name = names[is_axis ? axis : i];
        if (line->steps)
            to.steps[is_axis ? axis : i] = read_integer(line->command, name, text);
        else
            to.um[is_axis ? axis : i] = read_um(line->command, name, text);
    }
    return to;
}

/* Positions come out in *end. */
static int carry_out(const command_line *line, dryrig *d, const target *to, int value, dryrig_position *end)
{
    switch (line->command->id) {
    case CMD_POSITION:
        return dryrig_get_position(d, end);
    case CMD_MOVE:
        return line->steps ? dryrig_move_steps(d, to->steps, line->order, end)
                           : dryrig_move_um(d, to->um, line->order, end);
    case CMD_LINE:
        return line->steps ? dryrig_line_steps(d, to->steps, line->speed, line->stream, end)
                           : dryrig_line_um(d, to->um, line->speed, line->stream, end);
    case CMD_AXIS:
        return line->steps ? dryrig_axis_steps(d, value, to->steps[value], end)
                           : dryrig_axis_um(d, value, to->um[value], end);
    case CMD_HOME:
        return dryrig_home(d, end);
    case CMD_WORK:
        return dryrig_work(d, end);
    case CMD_CALIBRATE:
        return dryrig_calibrate(d, end);
    case CMD_STOP:
        return dryrig_stop(d, end);
    case CMD_ANGLE:
        return dryrig_set_angle(d, value);
    case CMD_SELECT:
        return dryrig_select(d, value);
    case CMD_MODE:
        return dryrig_set_mode(d, value);
    case CMD_INFO:
    case CMD_PORTS:
    case CMD_DECODE:
        break; /* not here */
    }
    return DRYRIG_ERR_ARGUMENT;
}

static int exit_status(int result)
{
    if (signals > 0 && (result == DRYRIG_OK || result == DRYRIG_ERR_INTERRUPTED))
        return EXIT_SIGNAL + (int)last_signal;
    if (result == DRYRIG_OK)
        return EXIT_DONE;
    return dryrig_fault_of(result) == DRYRIG_FAULT_CALLER ? EXIT_USAGE : EXIT_LINK;
}

int main(int argc, char **argv)
{
    command_line line = read_command_line(argc, argv);
    const command_id id = line.command->id;
    if (id == CMD_PORTS)
        return print_ports(&line);
    if (id == CMD_DECODE)
        return decode(&line);
    target to;
    memset(&to, 0, sizeof to);
    int value = 0;
    if (id == CMD_MOVE || id == CMD_LINE || id == CMD_AXIS)
        to = read_target(&line);
    if (id == CMD_AXIS)
        value = axis_of(&line);
    if (id == CMD_ANGLE || id == CMD_SELECT || id == CMD_MODE)
        value = read_integer(line.command, line.command->arguments, line.argument[0]);

    catch_signals();
    dryrig *d;
    char why[DRYRIG_WHY_MAX];
    record recorder;
    dryrig_link recorded;
    int result = DRYRIG_OK;
    if (line.record != NULL) {
        result = record_open(&recorder, &line, &recorded, why, sizeof why);
        line.open.link = &recorded;
    }
    if (result == DRYRIG_OK)
        result = dryrig_open(&d, &line.open, why, sizeof why);
    if (result != DRYRIG_OK) {
        print_error(&line, result, why, NULL);
        return exit_status(result);
    }
    watcher w = {&line, !line.json && isatty(STDERR_FILENO) && !(line.stream && isatty(STDOUT_FILENO)), false};
    dryrig_watch(d, on_motion, &w);
    if (line.command->is_motion)
        moving = d;

    dryrig_position end;
    memset(&end, 0, sizeof end);
    end.drive = -1; /* nothing to tell */
    dryrig_info info;
    if (id == CMD_INFO) {
        result = dryrig_get_info(d, &info);
        if (result == DRYRIG_OK)
            result = dryrig_get_position(d, &end);
    } else
        result = carry_out(&line, d, &to, value, &end);
    clear_progress(&w);

    if (result != DRYRIG_OK)
        print_error(&line, result, dryrig_why(d), end.drive >= 0 ? &end : NULL);
    else if (id == CMD_INFO)
        print_info(&line, &info, &end);
    else if (end.drive >= 0)
        print_position(&line, &end);
    else
        print_done(&line);
    moving = NULL;
    dryrig_close(d);
    return exit_status(result);
}
