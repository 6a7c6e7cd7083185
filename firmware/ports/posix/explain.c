#define _GNU_SOURCE /* strtok_r */
#include "explain.h"

#include "dr_judge.h"
#include "dr_words.h"
#include "guard_words.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TEXT 256u
#define WORDS_MAX 8u
#define SMALL_MARGIN_Q ((int32_t)(20 * DR_QUANTA_PER_UM))
#define LONG_UNSTOPPABLE_MS 1000u

static const char axis_names[] = "XYZ";

static const char *um(char text[32], int64_t quanta)
{
    (void)guard_words_um(text, 32, quanta);
    return text;
}

static void print_box(FILE *out, const dr_box *box)
{
    char a[32], b[32];
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        (void)fprintf(out, "%s%c %s to %s um", axis == 0 ? "" : ", ", axis_names[axis], um(a, box->min_q[axis]),
                      um(b, box->max_q[axis]));
}

/* -- check ------------------------------------------------------------------------------------------------------------- */

static const char *direction(uint8_t to)
{
    static const char *const names[] = {"nowhere", "-X", "+X", "-Y", "+Y", "-Z", "+Z"};
    return names[to < sizeof names / sizeof names[0] ? to : 0];
}

static void print_level(FILE *out, const dr_limits *l, uint8_t drive, uint8_t level)
{
    char text[32];
    if (level >= DR_SPEED_FULL) {
        (void)fprintf(out, "any");
        return;
    }
    (void)fprintf(out, "up to level %u (%s um/s); no motion of fixed speed that is faster", level,
                  um(text, dr_judge_speed(l, drive, level, true)));
}

static void print_surface(FILE *out, const dr_limits *l, uint8_t drive)
{
    const dr_drive_limits *const d = &l->drives[drive];
    char a[32], b[32];
    if (d->retract == DR_TO_NONE) {
        (void)fprintf(out, "  surface       none: nothing keeps a move from being lateral\n");
        return;
    }
    (void)fprintf(out, "  surface       at %c %s um; away from the specimen is %s\n",
                  axis_names[dr_to_axis(d->retract)], um(a, d->surface_q), direction(d->retract));
    (void)fprintf(out, "                sideways only from %s um above it; else along (%d, %d, %d), either way\n",
                  um(b, d->clearance_q), d->approach[DR_X], d->approach[DR_Y], d->approach[DR_Z]);
    (void)fprintf(out, "  speed below   ");
    print_level(out, l, drive, d->slow_level);
    (void)fprintf(out, "\n");
}

static void print_drive(FILE *out, const rig *r, uint8_t drive)
{
    const dr_limits *const l = &r->limits;
    const dr_drive_limits *const d = &l->drives[drive];
    char a[32];
    dr_stage stage;
    if (!dr_stage_get((dr_stage_id)d->stage, &stage))
        return;
    const uint32_t free_points = rig_count_free(l, drive, RIG_POINTS, NULL);
    (void)fprintf(out, "\ndrive %u: %s, microstep %g um\n  box           ", drive + 1u,
                  dr_words_stage((dr_stage_id)d->stage), (double)stage.quanta_per_step / DR_QUANTA_PER_UM);
    print_box(out, &d->box_q);
    (void)fprintf(out, "\n  room          %.1f %% of the box (the rest is obstacles and their margin)\n",
                  100.0 * free_points / RIG_POINTS);
    (void)fprintf(out, "  longest move  %s um\n  speed         ", um(a, d->max_move_q));
    print_level(out, l, drive, d->fast_level);
    (void)fprintf(out, "\n");
    if ((l->rig & DR_RIG_Y_LOCKED_OUT << drive) != 0)
        (void)fprintf(out, "  homing        may leave Y where it is: switch %u is off\n", l->kind == DR_TRIO ? 5u : 8u);
    print_surface(out, l, drive);
}

/* Along an axis as "Z from 19,500.0 um"; else as what holds for its points. */
static void print_half(FILE *out, const dr_half *half)
{
    char a[32];
    unsigned axes = 0, axis = 0;
    for (unsigned i = 0; i < DR_AXES; i++)
        if (half->normal[i] != 0) {
            axes++;
            axis = i;
        }
    const int normal = half->normal[axis];
    if (axes == 1 && half->offset_q % normal == 0)
        (void)fprintf(out, "%c %s %s um", axis_names[axis], normal < 0 ? "from" : "up to",
                      um(a, half->offset_q / normal));
    else
        (void)fprintf(out, "all points where %d X %+d Y %+d Z is at most %s um", half->normal[DR_X], half->normal[DR_Y],
                      half->normal[DR_Z], um(a, half->offset_q));
}

static void print_obstacles(FILE *out, const rig *r)
{
    char a[32];
    const dr_limits *const l = &r->limits;
    (void)fprintf(out, "\nobstacles (grown by %s um when a way is checked, and by what a knob may do meanwhile)%s\n",
                  um(a, l->margin_q), l->obstacle_count == 0 ? ": none" : "");
    for (uint8_t i = 0; i < l->obstacle_count; i++) {
        const dr_obstacle *const o = &l->obstacles[i];
        (void)fprintf(out, "  \"%s\", drive %u: ", r->names[i], o->drive + 1u);
        if (o->shape == DR_SHAPE_BOX)
            print_box(out, &o->box_q);
        else
            print_half(out, &o->half_q);
        (void)fprintf(out, "; way out: %s\n",
                      o->shape == DR_SHAPE_HALF ? "along it"
                      : o->exit == DR_TO_NONE   ? "by hand only"
                                                : direction(o->exit));
    }
}

/* The first drive that may be moved. */
static uint8_t first_drive(const dr_limits *l)
{
    uint8_t drive = 0;
    while (drive + 1u < DR_PORTS && l->drives[drive].stage == DR_STAGE_NONE)
        drive++;
    return drive;
}

/* What becomes of a command whatever its place: "checked", "passes", or why it is refused anywhere. */
static void print_fate(FILE *out, const rig *r, const dr_command *command)
{
    const dr_limits *const l = &r->limits;
    char text[GUARD_WORDS_MAX];
    dr_request request = {.op = command->op, .value = 1};
    dr_scene scene = {.drive = first_drive(l), .may_calibrate = true, .angle_deg = DR_ANGLE_DEFAULT_DEG};
    scene.chosen = scene.drive;
    request.value = command->op == DR_OP_TRIO_ANGLE ? l->angle_min_deg
                    : command->op == DR_OP_MPC_MODE ? l->mode_min
                                                    : (uint8_t)(scene.drive + 1u);
    dr_verdict verdict = dr_judge_frame(l, command, &request);
    const bool is_motion = (command->is & DR_IS_MOTION) != 0, is_targeted = (command->is & DR_IS_TARGETED) != 0;
    const bool calibrates = is_motion && !is_targeted && command->op != DR_OP_TRIO_HOME &&
                            command->op != DR_OP_TRIO_WORK && command->op != DR_OP_MPC_HOME &&
                            command->op != DR_OP_MPC_WORK;
    if (verdict.reason == DR_REASON_NONE && is_motion && !is_targeted) {
        (void)rig_count_free(l, scene.drive, 1, scene.start_steps);
        verdict = dr_judge_motion(l, &scene, command, &request);
    }
    (void)fprintf(out, "  %c  %-12s ", command->code, dr_words_command((dr_op)command->op)->name);
    if (verdict.reason != DR_REASON_NONE) {
        (void)guard_words_verdict(text, sizeof text, r, &verdict);
        (void)fprintf(out, "refused: %s\n", text);
    } else if ((command->is & DR_IS_INTERRUPT) != 0) {
        (void)fprintf(out, "always passes\n");
    } else if ((command->is & DR_IS_QUERY) != 0) {
        (void)fprintf(out, "passes at rest\n");
    } else if ((command->is & DR_IS_SETTING) != 0) {
        (void)fprintf(out, "passes at rest%s\n", command->args > 0 ? ", if its value is within the limits" : "");
    } else if (calibrates) {
        (void)fprintf(out, "checked, while armed and after 'allow-calibrate'\n");
    } else {
        (void)fprintf(out, "checked, while armed%s\n",
                      (command->is & DR_IS_STOPPABLE) != 0 ? "" : "; ^C does not stop it");
    }
}

static void print_commands(FILE *out, const rig *r)
{
    dr_command row;
    (void)fprintf(out, "\ncommands\n");
    for (uint8_t i = 0; dr_command_row((dr_kind)r->limits.kind, i, &row); i++) {
        dr_command command = row;
        if (r->limits.firmware < row.since || r->limits.firmware > row.until)
            continue;
        if (command.code < ' ')
            command.code = '^';
        print_fate(out, r, &command);
    }
}

static void print_warnings(FILE *out, const rig *r)
{
    const dr_limits *const l = &r->limits;
    unsigned count = 0;
    (void)fprintf(out, "\nwarnings\n");
    if (l->obstacle_count == 0 && ++count > 0)
        (void)fprintf(out, "  there are no obstacles: nothing but the box protects the objective and the bath\n");
    if (l->margin_q < SMALL_MARGIN_Q && ++count > 0)
        (void)fprintf(out, "  margin_um is below 20: backlash and overshoot may be more than that\n");
    if ((l->rig & DR_RIG_KNOBS_LOCKED) != 0 && ++count > 0)
        (void)fprintf(out, "  knobs_locked: a knob that is turned all the same is not reckoned with\n");
    if (l->unstoppable_ms > LONG_UNSTOPPABLE_MS && ++count > 0)
        (void)fprintf(out, "  unstoppable_ms is above 1,000: nobody can stop a move of that length by ^C\n");
    if ((l->rig & DR_RIG_CALIBRATES_AT_POWER_ON) != 0 && ++count > 0)
        (void)fprintf(
            out,
            "  external switch 6 is on: the controller moves every axis when its power comes on; no guard can help\n");
    if (l->host_loss == DR_HOST_LOSS_FINISH && ++count > 0)
        (void)fprintf(out, "  on_host_loss = \"finish\": a move goes on when the program that asked for it has died\n");
    if ((l->rig & DR_RIG_STAYS_ARMED) != 0 && ++count > 0)
        (void)fprintf(
            out, "  stay_armed: any program that opens the port may move, for %u s after the last motion of another\n",
            l->arm_idle_s);
    if ((l->rig & DR_RIG_HAS_CUT) != 0 && ++count > 0)
        (void)fprintf(out, "  relay: for a guard on a board; dryrig-guard itself has none and does not run with it\n");
    if (l->refusal == DR_REFUSE_E && ++count > 0)
        (void)fprintf(out, "  refusal = \"E\": some programs take any byte for the end of a move; see the manual\n");
    if (l->serial[0] == 0 && ++count > 0)
        (void)fprintf(out, "  converter_serial is not given: any converter at the port is taken\n");
    if (count == 0)
        (void)fprintf(out, "  none\n");
}

void explain_rig(FILE *out, const rig *r, const char *path)
{
    char firmware[16];
    const dr_limits *const l = &r->limits;
    (void)dr_words_firmware(firmware, sizeof firmware, l->firmware);
    (void)fprintf(out, "%s: good\n  controller    %s, firmware %s\n  revision      %u\n  hash          %08X\n", path,
                  dr_words_controller((dr_kind)l->kind), firmware, l->revision, dr_limits_crc(l));
    (void)fprintf(out, "  refusals      %s\n  host lost     %s\n  disarms       after %u s without a motion; %s\n",
                  l->refusal == DR_REFUSE_E ? "the host gets 'E'" : "the host gets no answer",
                  l->host_loss == DR_HOST_LOSS_STOP ? "a move is stopped" : "a move goes on to its end", l->arm_idle_s,
                  (l->rig & DR_RIG_STAYS_ARMED) == 0 ? "when the host closes its port"
                                                     : "not when the host closes its port at rest");
    (void)fprintf(out, "  unstoppable   moves that ^C does not stop last %u ms at most\n", l->unstoppable_ms);
    for (uint8_t drive = 0; drive < DR_PORTS; drive++)
        print_drive(out, r, drive);
    print_obstacles(out, r);
    print_commands(out, r);
    print_warnings(out, r);
}

/* -- explain ----------------------------------------------------------------------------------------------------------- */

typedef struct {
    char *words[WORDS_MAX];
    unsigned count, next;
} line;

/* A decimal number at the text's beginning: strtod() would take "nan" and "0x10" as well. False: there is none. */
static bool take_number(const char *text, char **end, double *out)
{
    *out = strtod(text, end);
    return *end != text && (size_t)(*end - text) <= strspn(text, "+-.0123456789") && *out >= -1e6 && *out <= 1e6;
}

static bool read_number(const char *text, double *out)
{
    char *end;
    return text != NULL && take_number(text, &end, out) && *end == '\0';
}

static const char *next_word(line *l) { return l->next < l->count ? l->words[l->next++] : NULL; }

/* The microstep nearest to it. A place below 0 is one far beyond, as on the wire. */
static uint32_t to_steps(double length_um, uint8_t quanta_per_step)
{
    return (uint32_t)(int32_t)lround(length_um * DR_QUANTA_PER_UM / quanta_per_step);
}

static bool find_command(const dr_limits *l, const char *name, dr_command *out)
{
    for (uint8_t i = 0; name != NULL && dr_command_row((dr_kind)l->kind, i, out); i++)
        if (l->firmware >= out->since && l->firmware <= out->until &&
            strcmp(dr_words_command((dr_op)out->op)->name, name) == 0)
            return true;
    return false;
}

static bool is_wrong(char *why, size_t room, const rig *r, const char *what)
{
    dr_command command;
    int used = snprintf(why, room, "%s. Known commands:", what);
    for (uint8_t i = 0; used > 0 && (size_t)used < room && dr_command_row((dr_kind)r->limits.kind, i, &command); i++)
        if (r->limits.firmware >= command.since && r->limits.firmware <= command.until)
            used += snprintf(why + used, room - (size_t)used, " %s", dr_words_command((dr_op)command.op)->name);
    if (used > 0 && (size_t)used < room)
        (void)snprintf(why + used, room - (size_t)used, ". As in \"line 1000 2000 500 speed 8\" (um)");
    return false;
}

static bool read_motion(line *words, const rig *r, uint8_t quanta_per_step, dr_command *command, dr_request *request,
                        char *why, size_t room)
{
    double number;
    if (!find_command(&r->limits, next_word(words), command))
        return is_wrong(why, room, r, "no such command");
    *request = (dr_request){.op = command->op};
    const uint8_t only = dr_wire_axis((dr_op)command->op);
    for (unsigned axis = 0; (command->is & DR_IS_TARGETED) != 0 && axis < DR_AXES; axis++) {
        if (only < DR_AXES && only != axis)
            continue;
        if (!read_number(next_word(words), &number))
            return is_wrong(why, room, r, "a coordinate is missing, or is no number of microns");
        request->steps[axis] = to_steps(number, quanta_per_step);
    }
    if (command->args == DR_ARGS_LINE) {
        const char *const word = next_word(words);
        if (word == NULL || strcmp(word, "speed") != 0)
            return is_wrong(why, room, r, "'speed' and its level are missing");
    }
    if (command->args == DR_ARGS_LINE || command->args == DR_ARGS_BYTE) {
        if (!read_number(next_word(words), &number) || number < 0 || number > 255 || number != floor(number))
            return is_wrong(why, room, r, "a whole number from 0 to 255 is missing");
        request->value = (uint8_t)number;
    }
    return next_word(words) == NULL || is_wrong(why, room, r, "there is something behind the command");
}

static bool read_from(const char *text, uint8_t quanta_per_step, uint32_t steps[DR_AXES])
{
    const char *at = text;
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        char *end;
        double number;
        if (!take_number(at, &end, &number) || number < 0 || *end != (axis + 1u < DR_AXES ? ',' : '\0'))
            return false;
        steps[axis] = to_steps(number, quanta_per_step);
        at = end + 1;
    }
    return true;
}

static void print_way(FILE *out, const rig *r, const dr_scene *scene, const dr_command *command,
                      const dr_request *request)
{
    char a[32];
    const dr_path path = dr_judge_path(&r->limits, scene, command, request);
    for (uint8_t stage = 0; stage < path.stages; stage++) {
        (void)fprintf(out, "  %s ",
                      path.straight ? "straight within"
                      : stage == 0  ? "anywhere within"
                                    : "then within    ");
        print_box(out, &path.swept[stage]);
        (void)fprintf(out, "\n");
    }
    (void)fprintf(out, "  margin          %s um around it\n", um(a, dr_judge_margin_q(&r->limits, scene, command)));
}

static explain_result explain_split(FILE *out, const rig *r, const explain_scene *s, line *words, char *why,
                                    size_t room)
{
    dr_stage stage;
    dr_command command = {.op = DR_OP_NONE};
    dr_request request = {.op = DR_OP_NONE};
    char text[GUARD_WORDS_MAX];
    dr_scene scene = {.drive = s->drive,
                      .chosen = s->drive,
                      .angle_deg = s->angle_deg,
                      .may_calibrate = s->may_calibrate,
                      .in_tissue = s->in_tissue};
    if (!dr_stage_get((dr_stage_id)r->limits.drives[s->drive].stage, &stage)) {
        (void)snprintf(why, room, "drive %u is not in the configuration", s->drive + 1u);
        return EXPLAIN_WRONG;
    }
    if (!read_motion(words, r, stage.quanta_per_step, &command, &request, why, room))
        return EXPLAIN_WRONG;
    const bool is_motion = (command.is & DR_IS_MOTION) != 0;
    if (is_motion && (s->from == NULL || !read_from(s->from, stage.quanta_per_step, scene.start_steps))) {
        (void)snprintf(why, room, "where from? --from X,Y,Z in microns, from 0 up, as --from 1000,2000,500");
        return EXPLAIN_WRONG;
    }
    dr_verdict verdict = dr_judge_frame(&r->limits, &command, &request);
    const bool has_way = verdict.reason == DR_REASON_NONE && is_motion;
    if (has_way)
        verdict = dr_judge_motion(&r->limits, &scene, &command, &request);
    (void)guard_words_verdict(text, sizeof text, r, &verdict);
    if (verdict.reason == DR_REASON_NONE)
        (void)fprintf(out, "allowed\n");
    else
        (void)fprintf(out, "refused (%s): %s\n", guard_words_reason(verdict.reason), text);
    const dr_verdict place = dr_judge_place(&r->limits, scene.drive, scene.start_steps);
    if (has_way && verdict.reason == DR_REASON_NONE && place.reason != DR_REASON_NONE) {
        (void)guard_words_verdict(text, sizeof text, r, &place);
        (void)fprintf(out, "  from a forbidden place (%s): the guard is armed there with 'escape on'\n", text);
    }
    if (has_way)
        print_way(out, r, &scene, &command, &request);
    return verdict.reason == DR_REASON_NONE ? EXPLAIN_ALLOWED : EXPLAIN_REFUSED;
}

explain_result explain_motion(FILE *out, const rig *r, const explain_scene *scene, const char *motion, char *why,
                              size_t room)
{
    char copy[TEXT], *rest;
    line words = {{NULL}, 0, 0};
    (void)snprintf(copy, sizeof copy, "%s", motion);
    for (char *word = strtok_r(copy, " \t,", &rest); word != NULL && words.count < WORDS_MAX;
         word = strtok_r(NULL, " \t,", &rest))
        words.words[words.count++] = word;
    return explain_split(out, r, scene, &words, why, room);
}
