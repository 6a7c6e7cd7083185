/* The public functions: errors, options, units, queries, settings. Motions are in motion.c. */
#include "session.h"

#include "dr_words.h" /* names of stages */

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* -- Errors -------------------------------------------------------------------------------------------------------- */

static const struct {
    int error;
    dryrig_fault fault;
    const char *name, *text;
} errors[] = {
    {DRYRIG_OK, DRYRIG_FAULT_NONE, "ok", "done"},
    {DRYRIG_ERR_ARGUMENT, DRYRIG_FAULT_CALLER, "argument", "the library was called with an impossible argument"},
    {DRYRIG_ERR_NO_STAGE, DRYRIG_FAULT_CALLER, "no-stage", "the stage is not known, so there are no microns"},
    {DRYRIG_ERR_RANGE, DRYRIG_FAULT_CALLER, "range", "the controller has no such position or value"},
    {DRYRIG_ERR_UNSUPPORTED, DRYRIG_FAULT_CALLER, "unsupported", "this controller has no such command"},
    {DRYRIG_ERR_MEMORY, DRYRIG_FAULT_COMPUTER, "memory", "out of memory"},
    {DRYRIG_ERR_NO_PORT, DRYRIG_FAULT_COMPUTER, "no-port", "there is no such port"},
    {DRYRIG_ERR_PORT_BUSY, DRYRIG_FAULT_COMPUTER, "port-busy", "another program has the port"},
    {DRYRIG_ERR_PORT, DRYRIG_FAULT_COMPUTER, "port", "the system does not let the port be used"},
    {DRYRIG_ERR_LINK, DRYRIG_FAULT_CONTROLLER, "link", "the port failed while in use"},
    {DRYRIG_ERR_TIMEOUT, DRYRIG_FAULT_CONTROLLER, "timeout", "the controller did not answer in time"},
    {DRYRIG_ERR_GARBLED, DRYRIG_FAULT_CONTROLLER, "garbled", "the answer is not a documented one"},
    {DRYRIG_ERR_OUT_OF_STEP, DRYRIG_FAULT_CONTROLLER, "out-of-step", "could not get in step with the controller"},
    {DRYRIG_ERR_REFUSED, DRYRIG_FAULT_CONTROLLER, "refused", "the controller refused"},
    {DRYRIG_ERR_STOOD_STILL, DRYRIG_FAULT_CONTROLLER, "stood-still", "the stage did not move"},
    {DRYRIG_ERR_ELSEWHERE, DRYRIG_FAULT_CONTROLLER, "elsewhere", "the stage did not reach its target"},
    {DRYRIG_ERR_CHANGING, DRYRIG_FAULT_CONTROLLER, "changing", "the position keeps changing"},
    {DRYRIG_ERR_INTERRUPTED, DRYRIG_FAULT_PERSON, "interrupted", "interrupted"},
    {DRYRIG_ERR_STOPPED, DRYRIG_FAULT_PERSON, "stopped", "stopped on the controller"},
    {DRYRIG_ERR_OTHER_DRIVE, DRYRIG_FAULT_PERSON, "other-drive", "another drive was made active on the controller"},
    {DRYRIG_ERR_CANNOT_STOP, DRYRIG_FAULT_PERSON, "cannot-stop", "this motion cannot be stopped"},
};

#define ERRORS (sizeof errors / sizeof errors[0])

static size_t find_error(int error)
{
    size_t i = 0;
    while (i < ERRORS && errors[i].error != error)
        i++;
    return i;
}

const char *dryrig_strerror(int error)
{
    const size_t i = find_error(error);
    return i < ERRORS ? errors[i].text : "unknown error";
}

const char *dryrig_error_name(int error)
{
    const size_t i = find_error(error);
    return i < ERRORS ? errors[i].name : "unknown";
}

dryrig_fault dryrig_fault_of(int error)
{
    const size_t i = find_error(error);
    return i < ERRORS ? errors[i].fault : DRYRIG_FAULT_CALLER;
}

/* -- Opening ------------------------------------------------------------------------------------------------------- */

dryrig_options dryrig_defaults(dryrig_controller controller)
{
    dryrig_options options;
    memset(&options, 0, sizeof options);
    options.controller = controller;
    options.baud = controller == DRYRIG_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC;
    options.margin = 3;
    options.grace_ms = 2000;
    options.answer_ms = 1000;
    return options;
}

static bool is_controller(dryrig_controller controller)
{
    return controller == DRYRIG_TRIO || controller == DRYRIG_MPC;
}

static dr_kind to_kind(dryrig_controller controller) { return controller == DRYRIG_TRIO ? DR_TRIO : DR_MPC; }

size_t dryrig_stage_names(dryrig_controller controller, char *out, size_t room)
{
    return dr_words_stages(out, room, to_kind(controller));
}

static int set_up(dryrig *d, const dryrig_options *options)
{
    if (!is_controller(options->controller))
        return fail(d, DRYRIG_ERR_ARGUMENT, "options.controller is neither DRYRIG_TRIO nor DRYRIG_MPC");
    if (!(options->margin >= 1 && options->margin <= 1000) || options->grace_ms > 3600000u || options->answer_ms < 1u ||
        options->answer_ms > 60000u)
        return fail(d, DRYRIG_ERR_ARGUMENT,
                    "options: margin must be 1 to 1000, grace_ms 0 to 3,600,000, answer_ms 1 to "
                    "60,000; begin with dryrig_defaults()");
    d->kind = to_kind(options->controller);
    d->firmware = d->kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
    d->firmware_is_known = d->kind == DR_TRIO;
    if (options->firmware != 0) {
        bool is_version = options->firmware >= DR_FIRMWARE_FIRST && options->firmware <= DR_FIRMWARE_LAST;
        for (unsigned digits = options->firmware; digits != 0; digits >>= 4u)
            is_version = is_version && (digits & 0xFu) <= 9u;
        if (!is_version)
            return fail(d, DRYRIG_ERR_ARGUMENT, "options.firmware is 0x%X, which is no version: 0x0321 is 3.21",
                        options->firmware);
        d->firmware = (uint16_t)options->firmware;
        d->firmware_is_known = true;
    }
    for (size_t i = 0; i < (d->kind == DR_TRIO ? 1u : DR_PORTS); i++) {
        if (options->stage[i] != NULL && !dr_words_stage_find(d->kind, options->stage[i], &d->stage[i])) {
            char names[DRYRIG_WHY_MAX * 3 / 4];
            (void)dr_words_stages(names, sizeof names, d->kind);
            return fail(d, DRYRIG_ERR_NO_STAGE, "%s has no stage '%.60s'; there are: %s", dr_words_controller(d->kind),
                        options->stage[i], names);
        }
    }
    d->margin = options->margin;
    d->grace_us = (uint64_t)options->grace_ms * MS_US;
    d->answer_us = options->answer_ms * MS_US;
    d->ask_once = options->ask_once;
    d->is_fast = options->is_fast;
    d->doubt = DOUBT_LATE; /* whoever talked to the controller before may not have heard it out */
    d->streaming = -1;
    return DRYRIG_OK;
}

int dryrig_open(dryrig **out, const dryrig_options *options, char *why, size_t room)
{
    if (why != NULL && room > 0)
        why[0] = '\0';
    if (out != NULL)
        *out = NULL;
    if (out == NULL || options == NULL || (why == NULL && room > 0))
        return DRYRIG_ERR_ARGUMENT;
    int result = DRYRIG_ERR_MEMORY;
    dryrig *d = calloc(1, sizeof *d);
    if (d != NULL)
        result = set_up(d, options);
    if (result == DRYRIG_OK && options->link == NULL && options->port == NULL)
        result = fail(d, DRYRIG_ERR_ARGUMENT, "no port was given");
    if (result == DRYRIG_OK && options->link == NULL)
        result = dryrig_link_open(&d->link, options->port, options->baud, d->why, sizeof d->why);
    else if (options->link != NULL) {
        if (result == DRYRIG_OK)
            d->link = *options->link;
        else
            options->link->close(options->link->context);
    }
    if (result != DRYRIG_OK) {
        if (room > 0)
            (void)snprintf(why, room, "%s", d != NULL && d->why[0] != '\0' ? d->why : dryrig_strerror(result));
        free(d);
        return result;
    }
    *out = d;
    return DRYRIG_OK;
}

void dryrig_close(dryrig *d)
{
    if (d == NULL)
        return;
    d->link.close(d->link.context);
    free(d);
}

const char *dryrig_why(const dryrig *d) { return d == NULL ? "there is no handle" : d->why; }

int enter(dryrig *d)
{
    if (d == NULL)
        return DRYRIG_ERR_ARGUMENT;
    if (d->within)
        return DRYRIG_ERR_ARGUMENT; /* d->why belongs to the call that is under way */
    d->within = true;
    d->why[0] = '\0';
    return DRYRIG_OK;
}

int leave(dryrig *d, int result)
{
    d->within = false;
    return result;
}

/* -- Units --------------------------------------------------------------------------------------------------------- */

dr_stage_id stage_of(const dryrig *d, int drive)
{
    if (d->kind == DR_TRIO)
        return d->stage[0];
    return drive >= 1 && drive <= (int)DR_PORTS ? d->stage[drive - 1] : DR_STAGE_NONE;
}

static double um_of(double steps, const dr_stage *stage)
{
    return steps * stage->quanta_per_step / DR_QUANTA_PER_UM; /* exact: a multiple of 1/64 */
}

dryrig_position to_position(const dryrig *d, const dr_reply *reply)
{
    dryrig_position p;
    memset(&p, 0, sizeof p);
    p.drive = d->kind == DR_TRIO ? 0 : reply->value;
    p.angle_deg = d->kind == DR_TRIO ? reply->value : -1;
    dr_stage stage;
    p.has_um = dr_stage_get(stage_of(d, p.drive != 0 ? p.drive : d->drive), &stage);
    for (size_t axis = 0; axis < DR_AXES; axis++) {
        p.steps[axis] = (int32_t)reply->steps[axis]; /* at most 24 bits: exchange.c */
        p.um[axis] = p.has_um ? um_of((double)p.steps[axis], &stage) : 0;
    }
    return p;
}

static const char axis_names[DR_AXES] = {'X', 'Y', 'Z'};

/* The longest travel of an axis: of one stage, or of all that the controller drives. */
static uint32_t longest_travel(const dryrig *d, dr_stage_id id, size_t axis)
{
    uint32_t longest = 0;
    dr_stage stage;
    for (int i = DR_STAGE_NONE + 1; i < DR_STAGES; i++)
        if ((id == DR_STAGE_NONE || i == (int)id) && dr_stage_get((dr_stage_id)i, &stage) && stage.kind == d->kind &&
            stage.travel_steps[axis] > longest)
            longest = stage.travel_steps[axis];
    return longest;
}

int check_target(dryrig *d, dr_stage_id id, const int32_t steps[DRYRIG_AXES])
{
    for (size_t axis = 0; axis < DR_AXES; axis++) {
        const uint32_t last = longest_travel(d, id, axis);
        if (steps[axis] < 0 || (uint32_t)steps[axis] > last)
            return fail(d, DRYRIG_ERR_RANGE,
                        "%c: %" PRId32 " steps is outside the travel of %s, 0 to %" PRIu32 " steps", axis_names[axis],
                        steps[axis], id == DR_STAGE_NONE ? "any stage" : dr_words_stage(id), last);
    }
    return DRYRIG_OK;
}

static int no_stage(dryrig *d, int drive)
{
    char names[DRYRIG_WHY_MAX * 3 / 4], which[24] = "";
    (void)dr_words_stages(names, sizeof names, d->kind);
    if (drive > 0)
        (void)snprintf(which, sizeof which, " of drive %d", drive);
    return fail(d, DRYRIG_ERR_NO_STAGE, "microns need the stage%s, as the size of a step depends on it: %s", which,
                names);
}

int convert_um(dryrig *d, dr_stage_id id, const double um[DRYRIG_AXES], int32_t steps[DRYRIG_AXES])
{
    dr_stage stage;
    if (!dr_stage_get(id, &stage))
        return no_stage(d, d->drive);
    for (size_t axis = 0; axis < DR_AXES; axis++) {
        const double last_um = um_of((double)stage.travel_steps[axis], &stage);
        const double exact = um[axis] * DR_QUANTA_PER_UM / stage.quanta_per_step;
        if (!(um[axis] >= 0) || !(exact < (double)stage.travel_steps[axis] + 0.5)) /* so, a NaN is refused as well */
            return fail(d, DRYRIG_ERR_RANGE, "%c: %.10g um is outside the travel of %s, 0 to %.10g um",
                        axis_names[axis], um[axis], dr_words_stage(id), last_um);
        steps[axis] = (int32_t)(exact + 0.5);
    }
    return DRYRIG_OK;
}

static int check_drive(dryrig *d, int drive)
{
    if (d->kind == DR_TRIO ? drive != 0 : drive < 1 || drive > DRYRIG_DRIVES)
        return fail(d, DRYRIG_ERR_RANGE, "drive %d: %s", drive,
                    d->kind == DR_TRIO ? "a TRIO has one manipulator, 0" : "an MPC-200 has drives 1 to 4");
    return DRYRIG_OK;
}

int dryrig_um_to_steps(dryrig *d, int drive, const double um[DRYRIG_AXES], int32_t steps[DRYRIG_AXES])
{
    int result = enter(d);
    if (result < 0)
        return result;
    if (um == NULL || steps == NULL)
        return leave(d, fail(d, DRYRIG_ERR_ARGUMENT, "a null pointer"));
    result = check_drive(d, drive);
    return leave(d, result < 0 ? result : convert_um(d, stage_of(d, drive), um, steps));
}

int dryrig_steps_to_um(dryrig *d, int drive, const int32_t steps[DRYRIG_AXES], double um[DRYRIG_AXES])
{
    int result = enter(d);
    if (result < 0)
        return result;
    if (um == NULL || steps == NULL)
        return leave(d, fail(d, DRYRIG_ERR_ARGUMENT, "a null pointer"));
    dr_stage stage;
    result = check_drive(d, drive);
    if (result == DRYRIG_OK && !dr_stage_get(stage_of(d, drive), &stage))
        result = no_stage(d, drive);
    if (result == DRYRIG_OK)
        result = check_target(d, stage_of(d, drive), steps);
    for (size_t axis = 0; result == DRYRIG_OK && axis < DR_AXES; axis++)
        um[axis] = um_of((double)steps[axis], &stage);
    return leave(d, result);
}

int dryrig_get_stage(dryrig_controller controller, const char *name, dryrig_stage *out)
{
    dr_stage_id id;
    dr_stage stage;
    if (!is_controller(controller) || name == NULL || out == NULL)
        return DRYRIG_ERR_ARGUMENT;
    if (!dr_words_stage_find(to_kind(controller), name, &id) || !dr_stage_get(id, &stage))
        return DRYRIG_ERR_NO_STAGE;
    memset(out, 0, sizeof *out);
    out->name = dr_words_stage(id);
    out->um_per_step = um_of(1, &stage);
    for (size_t axis = 0; axis < DR_AXES; axis++)
        out->travel_steps[axis] = (int32_t)stage.travel_steps[axis];
    out->full_speed_um_per_s = dr_speed_quanta_per_s(id, DR_SPEED_FULL) / (double)DR_QUANTA_PER_UM;
    out->line_um_per_s = dr_speed_quanta_per_s(id, 0) / (double)DR_QUANTA_PER_UM;
    return DRYRIG_OK;
}

/* -- Queries ------------------------------------------------------------------------------------------------------- */

static int get_position(dryrig *d, dryrig_position *out)
{
    if (out == NULL)
        return fail(d, DRYRIG_ERR_ARGUMENT, "a null pointer");
    const int result = settle(d, 0, out);
    if (result == DRYRIG_OK && d->drive == 0)
        d->drive = (uint8_t)out->drive;
    return result;
}

int dryrig_get_position(dryrig *d, dryrig_position *out)
{
    const int result = enter(d);
    return result < 0 ? result : leave(d, get_position(d, out));
}

static int get_info(dryrig *d, dryrig_info *out)
{
    if (out == NULL)
        return fail(d, DRYRIG_ERR_ARGUMENT, "a null pointer");
    memset(out, 0, sizeof *out);
    out->controller = d->kind == DR_TRIO ? DRYRIG_TRIO : DRYRIG_MPC;
    if (d->kind == DR_MPC) {
        answer active = {{0}, 0, {0, 0, 0, {0}}}, drives = active;
        int result = need_firmware(d);
        if (result == DRYRIG_OK)
            result = ask(d, DR_OP_MPC_ACTIVE, &active);
        dr_command row;
        const bool one_by_one = dr_command_for(d->kind, d->firmware, DR_OP_MPC_DRIVES, &row);
        if (result == DRYRIG_OK)
            result = ask(d, one_by_one ? DR_OP_MPC_DRIVES : DR_OP_MPC_COUNT, &drives);
        if (result < 0)
            return result;
        out->drive = active.reply.value;
        out->drives = drives.reply.value;
        for (size_t i = 0; i < DR_PORTS; i++)
            out->connected[i] = one_by_one && ((drives.reply.connected & (1u << i)) != 0);
    }
    out->firmware = d->firmware_is_known ? d->firmware : 0;
    return DRYRIG_OK;
}

int dryrig_get_info(dryrig *d, dryrig_info *out)
{
    const int result = enter(d);
    return result < 0 ? result : leave(d, get_info(d, out));
}

/* -- Settings ------------------------------------------------------------------------------------------------------ */

static int check_setting(dryrig *d, dr_kind kind, const char *what, int value, int first, int last)
{
    if (d->kind != kind)
        return fail(d, DRYRIG_ERR_UNSUPPORTED, "%s cannot set the %s", dr_words_controller(d->kind), what);
    if (value < first || value > last)
        return fail(d, DRYRIG_ERR_RANGE, "%s %d: there are %d to %d", what, value, first, last);
    return DRYRIG_OK;
}

static int set_angle(dryrig *d, int angle_deg)
{
    int result = check_setting(d, DR_TRIO, "angle", angle_deg, 0, DRYRIG_ANGLE_MAX_DEG);
    const dr_request request = {DR_OP_TRIO_ANGLE, (uint8_t)angle_deg, {0, 0, 0}};
    answer a = {{0}, 0, {0, 0, 0, {0}}};
    if (result == DRYRIG_OK)
        result = command(d, &request, &a);
    if (result == DRYRIG_OK)
        result = ask(d, DR_OP_TRIO_POSITION, &a);
    if (result < 0)
        return result;
    if (a.reply.value != angle_deg)
        result =
            fail(d, DRYRIG_ERR_REFUSED, "the angle is %u degrees after it was set to %d", a.reply.value, angle_deg);
    return result;
}

int dryrig_set_angle(dryrig *d, int angle_deg)
{
    const int result = enter(d);
    return result < 0 ? result : leave(d, set_angle(d, angle_deg));
}

static int select_drive(dryrig *d, int drive)
{
    int result = check_setting(d, DR_MPC, "drive", drive, 1, DRYRIG_DRIVES);
    const dr_request request = {DR_OP_MPC_SELECT, (uint8_t)drive, {0, 0, 0}};
    answer a = {{0}, 0, {0, 0, 0, {0}}};
    if (result == DRYRIG_OK)
        result = command(d, &request, &a);
    /* Up to 1.05 the answer does not tell whether there is such a drive, and a late CR may pass for it: so, ask. */
    if (result == DRYRIG_OK)
        result = ask(d, DR_OP_MPC_ACTIVE, &a);
    if (result < 0)
        return result;
    if (a.reply.value != drive)
        return fail(d, DRYRIG_ERR_REFUSED, "drive %d is not connected; drive %u stays active", drive, a.reply.value);
    d->drive = (uint8_t)drive;
    d->streaming = -1; /* whether it is the drive's or the controller's is nowhere said */
    return DRYRIG_OK;
}

int dryrig_select(dryrig *d, int drive)
{
    const int result = enter(d);
    return result < 0 ? result : leave(d, select_drive(d, drive));
}

static int set_mode(dryrig *d, int mode)
{
    const int result = check_setting(d, DR_MPC, "mode", mode, 0, DRYRIG_MODES - 1);
    const dr_request request = {DR_OP_MPC_MODE, (uint8_t)mode, {0, 0, 0}};
    answer a;
    return result < 0 ? result : command(d, &request, &a);
}

int dryrig_set_mode(dryrig *d, int mode)
{
    const int result = enter(d);
    return result < 0 ? result : leave(d, set_mode(d, mode));
}

int dryrig_resync(dryrig *d)
{
    const int result = enter(d);
    if (result < 0)
        return result;
    if (d->doubt == DOUBT_NONE || d->doubt == DOUBT_TORN)
        d->doubt = DOUBT_LATE;
    return leave(d, resync(d));
}
