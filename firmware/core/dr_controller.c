#include "dr_controller.h"

#define BOOT_US DR_US_PER_S                /* "ready about one second after power-on" [O] */
#define SMALL_MOVE_STEPS 16u               /* quirk small-move-silent [P] */
#define CALIBRATION_OUT_UM 1000u           /* where a TRIO's calibration ends on each axis [O] */
#define CALIBRATION_BEYOND_UM 250u         /* how far an MPC's calibration goes beyond 0 (chosen [P]) */
#define LAST_POSITIVE UINT32_C(0x7FFFFFFF) /* quirk endless-negative: what lies above is "negative" */
#define MODE_LAST 9u                       /* [M table 9, 'L'] */
#define STOPPED_BY_HAND 0x80u              /* in out_op, beside the dr_op of the move whose CR it is */

/* The most that can happen within one call without a byte leaving: every kept command may end without an answer, in up to
 * LEGS legs, each after a streamed frame. */
#define LEGS 4u
#define EVENTS_MAX ((DR_KEPT_MAX + 2u) * (LEGS + 2u))

/* -- Small helpers ------------------------------------------------------------------------------------------------- */

static dr_kind kind_of(const dr_controller *c) { return (dr_kind)c->kind; }
static dr_drive *active_drive(const dr_controller *c) { return &c->drives[c->active]; }
static bool has_quirk(const dr_controller *c, uint16_t quirk) { return (c->quirks & quirk) != 0; }
static bool is_moving(const dr_controller *c) { return c->state == DR_STATE_MOVING || c->state == DR_STATE_PAUSED; }

/* How much of the leg is done, while it moves. */
static dr_us leg_elapsed_us(const dr_controller *c, dr_us now)
{
    return c->state == DR_STATE_PAUSED ? c->leg_began : now - c->leg_began;
}

static void count_up(uint16_t *counter)
{
    if (*counter < UINT16_MAX)
        (*counter)++;
}

static void copy_bytes(uint8_t *to, const uint8_t *from, size_t count)
{
    for (size_t i = 0; i < count; i++)
        to[i] = from[i];
}

static void copy_point(uint32_t to[DR_AXES], const uint32_t from[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        to[axis] = from[axis];
}

static void set_point(uint32_t steps[DR_AXES], uint32_t value)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        steps[axis] = value;
}

static bool is_connected(const dr_controller *c, uint8_t drive)
{
    return drive < c->drive_count && c->drives[drive].stage != DR_STAGE_NONE;
}

static uint8_t connected_drives(const dr_controller *c)
{
    uint8_t bits = 0;
    for (uint8_t drive = 0; drive < c->drive_count; drive++)
        if (is_connected(c, drive))
            bits = (uint8_t)(bits | 1u << drive);
    return bits;
}

static void activate_lowest(dr_controller *c)
{
    c->active = 0;
    for (uint8_t drive = c->drive_count; drive > 0; drive--)
        if (is_connected(c, (uint8_t)(drive - 1u)))
            c->active = (uint8_t)(drive - 1u);
}

static dr_stage active_stage(const dr_controller *c)
{
    dr_stage stage = {0, 1, 0, 0, {0, 0, 0}};
    (void)dr_stage_get((dr_stage_id)active_drive(c)->stage, &stage);
    return stage;
}

/* -- Notes --------------------------------------------------------------------------------------------------------- */

void dr_notes_init(dr_notes *notes, dr_note *ring, uint16_t size) { *notes = (dr_notes){ring, size, 0, 0, 0}; }

bool dr_notes_take(dr_notes *notes, dr_note *out)
{
    if (notes->count == 0)
        return false;
    *out = notes->ring[notes->first];
    notes->first = (uint16_t)((notes->first + 1u) % notes->size);
    notes->count--;
    return true;
}

static void put_note(const dr_controller *c, const dr_note *note)
{
    dr_notes *notes = c->notes;
    if (notes->count == notes->size) {
        notes->first = (uint16_t)((notes->first + 1u) % notes->size);
        notes->count--;
        notes->missed++;
    }
    notes->ring[((uint32_t)notes->first + notes->count) % notes->size] = *note;
    notes->count++;
}

static void note_value(const dr_controller *c, dr_us when, dr_note_kind what, uint8_t op, uint32_t value)
{
    if (c->notes != NULL)
        put_note(c, &(dr_note){when, (uint8_t)what, op, c->active, 0, {0}, value, {0, 0, 0}});
}

static void note_point(const dr_controller *c, dr_us when, dr_note_kind what, uint32_t value, const uint32_t *steps)
{
    if (c->notes != NULL)
        put_note(c,
                 &(dr_note){when, (uint8_t)what, c->move_op, c->active, 0, {0}, value, {steps[0], steps[1], steps[2]}});
}

static void note_bytes(const dr_controller *c, dr_us when, dr_note_kind what, uint8_t op, const uint8_t *bytes,
                       uint8_t count, uint32_t value)
{
    if (c->notes != NULL) {
        dr_note note = {when, (uint8_t)what, op, c->active, count, {0}, value, {0, 0, 0}};
        copy_bytes(note.bytes, bytes, count);
        put_note(c, &note);
    }
}

/* -- Replies ------------------------------------------------------------------------------------------------------- */

size_t dr_controller_ready(const dr_controller *c) { return (size_t)(c->out_bytes - c->out_at) + c->interrupt_crs; }

/* Behind a streamed frame that is still leaving, a CR is all that can come. */
static void answer_cr(dr_controller *c, dr_us when, uint8_t op)
{
    static const uint8_t cr = DR_CR;
    if (c->out_at == c->out_bytes)
        c->out_at = c->out_bytes = 0;
    c->out[c->out_bytes++] = DR_CR;
    c->out_op = op;
    note_bytes(c, when, DR_NOTE_REPLY, op, &cr, 1, 0);
}

static void answer(dr_controller *c, dr_us when, const dr_command *command, const dr_reply *reply)
{
    c->out_at = 0;
    c->out_bytes = (uint8_t)dr_wire_put_reply(command, reply, c->out);
    c->out_op = command->op;
    note_bytes(c, when, DR_NOTE_REPLY, command->op, c->out, c->out_bytes, 0);
}

dr_op dr_controller_answering(const dr_controller *c, bool *first)
{
    *first = c->out_at == 0 || c->out_at >= c->out_bytes;
    if (c->out_at < c->out_bytes)
        return (dr_op)(c->out_op & ~STOPPED_BY_HAND);
    if (c->interrupt_crs > 0)
        return c->kind == DR_TRIO ? DR_OP_TRIO_INTERRUPT : DR_OP_MPC_INTERRUPT;
    return DR_OP_NONE;
}

bool dr_controller_answers_stop(const dr_controller *c)
{
    return (c->out_op & STOPPED_BY_HAND) != 0 && c->out_at + 1u == c->out_bytes;
}

/* -- Moves: which legs they are made of ------------------------------------------------------------------------------ */

#define X_BIT (1u << DR_X)
#define Y_BIT (1u << DR_Y)
#define Z_BIT (1u << DR_Z)
#define ALL_BITS (X_BIT | Y_BIT | Z_BIT)

static uint32_t speed_quanta_per_s(const dr_controller *c)
{
    if (c->kind == DR_MPC && has_quirk(c, DR_QUIRK_MEASURED_SPEEDS))
        return dr_measured_quanta_per_s(c->move_level);
    return dr_speed_quanta_per_s((dr_stage_id)active_drive(c)->stage, c->move_level);
}

/* The axes of a leg in home order: X and Z by angle, then Y. 45 degrees: together; below, Z first; above, X [T page 1]. */
static uint8_t home_order_axes(uint8_t angle_deg, uint8_t leg)
{
    if (leg == 2)
        return Y_BIT;
    if (angle_deg == 45)
        return leg == 0 ? X_BIT | Z_BIT : 0;
    return (angle_deg < 45) == (leg == 0) ? Z_BIT : X_BIT;
}

/* Sets goal[] to the target of these axes; the others stay. */
static void aim(uint32_t goal[DR_AXES], uint8_t axes, const uint32_t target[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if ((axes & 1u << axis) != 0)
            goal[axis] = target[axis];
}

/* Plans leg c->move_leg of the move from where the drive stands. False: the move has no such leg, it is over. */
static bool plan_leg(dr_controller *c)
{
    const dr_drive *drive = active_drive(c);
    const dr_stage stage = active_stage(c);
    const uint32_t speed = speed_quanta_per_s(c);
    const uint8_t n = c->move_leg;
    const uint8_t q = stage.quanta_per_step;
    bool straight = false;
    uint32_t goal[DR_AXES];
    copy_point(goal, drive->position_steps);

    switch (c->move_op) {
    case DR_OP_TRIO_HOME:
    case DR_OP_TRIO_HOME_TO:
        if (n > 2)
            return false;
        aim(goal, home_order_axes(c->angle_deg, n), c->move_to_steps);
        break;
    case DR_OP_TRIO_WORK:
    case DR_OP_TRIO_WORK_TO: /* Y, then X and Z by angle [T page 1] */
        if (n > 2)
            return false;
        aim(goal, n == 0 ? Y_BIT : home_order_axes(c->angle_deg, (uint8_t)(n - 1u)), c->move_to_steps);
        break;
    case DR_OP_TRIO_RECALIBRATE: /* home order to the beginning of travel, then out on all axes [O] */
        if (n > 3)
            return false;
        if (n == 3)
            set_point(goal, dr_um_to_steps(CALIBRATION_OUT_UM, q));
        else
            aim(goal, home_order_axes(c->angle_deg, n), c->move_to_steps);
        break;
    case DR_OP_MPC_HOME:
    case DR_OP_MPC_CALIBRATE:
        if (n > (c->move_op == DR_OP_MPC_HOME ? 1 : 2))
            return false;
        straight = n == 0;
        if (n == 0)
            dr_diagonal_corner(dr_diagonal_get(drive->diagonal), goal);
        else
            copy_point(goal, c->move_to_steps);
        break;
    case DR_OP_MPC_WORK: /* the Home path from the work position, backwards */
        if (n > 1)
            return false;
        straight = n == 1;
        copy_point(goal, c->move_to_steps);
        if (n == 0)
            dr_diagonal_corner(dr_diagonal_get(drive->diagonal), goal);
        break;
    case DR_OP_TRIO_LINE:
    case DR_OP_MPC_LINE:
    case DR_OP_MPC_CENTRE:
        straight = true;
        /* fall through */
    default: /* one leg on all axes */
        if (n > 0)
            return false;
        copy_point(goal, c->move_to_steps);
        break;
    }

    c->leg = straight ? dr_leg_straight(drive->position_steps, goal, q, speed)
                      : dr_leg_each(drive->position_steps, goal, q, speed);
    if (c->move_op == DR_OP_MPC_CALIBRATE && n == 2) { /* beyond 0 and back, where 'C' still shows 0 */
        static const uint32_t edge[DR_AXES], beyond_quanta[DR_AXES] = {CALIBRATION_BEYOND_UM * DR_QUANTA_PER_UM};
        const dr_leg out = dr_leg_each(edge, beyond_quanta, 1, speed);
        c->leg.lasts_us[DR_X] = 2u * out.lasts_us[DR_X];
    }
    return true;
}

static void finish_move(dr_controller *c, dr_us when)
{
    dr_drive *drive = active_drive(c);
    note_point(c, when, DR_NOTE_ARRIVED, 0, drive->position_steps);
    drive->at_home = c->move_op == DR_OP_MPC_HOME;
    if ((c->move_op == DR_OP_MPC_CALIBRATE || c->move_op == DR_OP_TRIO_RECALIBRATE) &&
        drive->calibration == DR_UNCALIBRATED_CYCLED)
        drive->calibration = DR_CALIBRATED;
    if (c->move_is_endless) {
        c->state = DR_STATE_STRANDED;
        note_value(c, when, DR_NOTE_STRANDED, c->move_op, 0);
        return;
    }
    c->state = DR_STATE_REST;
    if (c->move_answers)
        answer_cr(c, when, c->move_op);
}

/* Begins leg c->move_leg, or ends the move when there is none left. */
static void begin_leg(dr_controller *c, dr_us when)
{
    if (!plan_leg(c)) {
        finish_move(c, when);
        return;
    }
    c->state = DR_STATE_MOVING;
    c->leg_began = when;
    c->microns_streamed = 0;
    if (dr_leg_lasts_us(&c->leg) > 0)
        note_point(c, when, DR_NOTE_LEG, dr_leg_lasts_us(&c->leg), c->leg.to);
}

static void end_leg(dr_controller *c, dr_us when)
{
    copy_point(active_drive(c)->position_steps, c->leg.to);
    c->move_leg++;
    begin_leg(c, when);
}

/* Stops the move where it is. */
static void halt(dr_controller *c, dr_us now)
{
    dr_drive *drive = active_drive(c);
    dr_leg_at(&c->leg, leg_elapsed_us(c, now), drive->position_steps);
    c->state = DR_STATE_REST;
    if (c->move_op == DR_OP_MPC_CALIBRATE || c->move_op == DR_OP_TRIO_RECALIBRATE)
        drive->calibration = DR_UNCALIBRATED;
    note_point(c, now, DR_NOTE_STOPPED, 0, drive->position_steps);
}

/* Begins a move to target[], already within reach of the drive. */
static void begin_move(dr_controller *c, dr_us when, uint8_t op, uint8_t level, const uint32_t target[DR_AXES],
                       bool answers)
{
    c->move_op = op;
    c->move_leg = 0;
    c->move_level = level;
    c->move_answers = answers;
    c->move_is_endless = false;
    copy_point(c->move_to_steps, target);
    active_drive(c)->at_home = false;
    begin_leg(c, when);
}

/* -- Commands ------------------------------------------------------------------------------------------------------ */

/* Cuts a target down to the travel, axis by axis. Returns whether the move will never answer. */
static bool clip(const dr_controller *c, dr_us when, uint8_t op, uint32_t target[DR_AXES])
{
    const dr_stage stage = active_stage(c);
    bool endless = false;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        if (target[axis] <= stage.travel_steps[axis])
            continue;
        note_value(c, when, DR_NOTE_CLIPPED, op, axis);
        if (has_quirk(c, DR_QUIRK_ENDLESS_NEGATIVE) && target[axis] > LAST_POSITIVE) {
            target[axis] = 0;
            endless = true;
        } else {
            target[axis] = stage.travel_steps[axis];
        }
    }
    return endless;
}

/* At 0 degrees Z, at 90 degrees X fails to move [T note 13]: that axis stays, the others go. */
static void hold_axis(const dr_controller *c, dr_us when, uint8_t op, uint32_t target[DR_AXES])
{
    if (c->kind != DR_TRIO || (c->angle_deg != 0 && c->angle_deg != DR_ANGLE_MAX_DEG))
        return;
    const uint8_t axis = c->angle_deg == 0 ? DR_Z : DR_X;
    const uint32_t stays = active_drive(c)->position_steps[axis];
    if (target[axis] != stays)
        note_value(c, when, DR_NOTE_AXIS_STANDS, op, axis);
    target[axis] = stays;
}

static bool is_small(const dr_controller *c, const uint32_t target[DR_AXES])
{
    const uint32_t *at = active_drive(c)->position_steps;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if ((target[axis] > at[axis] ? target[axis] - at[axis] : at[axis] - target[axis]) >= SMALL_MOVE_STEPS)
            return false;
    return true;
}

/* A move to a target that the host has named. */
static void begin_targeted(dr_controller *c, dr_us when, const dr_request *request)
{
    const uint8_t op = request->op;
    const uint8_t axis = dr_wire_axis((dr_op)op);
    uint8_t level = DR_SPEED_FULL;
    uint32_t target[DR_AXES];
    copy_point(target, request->steps);
    if (axis < DR_AXES) {
        copy_point(target, active_drive(c)->position_steps);
        target[axis] = request->steps[axis];
    }
    if (op == DR_OP_TRIO_LINE || op == DR_OP_MPC_LINE) {
        level = (uint8_t)(request->value % DR_SPEED_LEVELS);
        if (level != request->value)
            note_value(c, when, DR_NOTE_SPEED_CUT, op, level);
    }
    const bool endless = clip(c, when, op, target);
    hold_axis(c, when, op, target);
    if (c->kind == DR_MPC && has_quirk(c, DR_QUIRK_SMALL_MOVE_SILENT) && is_small(c, target)) {
        note_value(c, when, DR_NOTE_SMALL_MOVE, op, 0);
        return;
    }
    begin_move(c, when, op, level, target, true);
    c->move_is_endless = endless;
}

static void begin_home(dr_controller *c, dr_us when, uint8_t op)
{
    const dr_drive *drive = active_drive(c);
    const bool calibrates = op == DR_OP_TRIO_RECALIBRATE || op == DR_OP_MPC_CALIBRATE;
    uint32_t target[DR_AXES] = {0, 0, 0};
    if (op == DR_OP_TRIO_HOME) {
        copy_point(target, c->home_steps);
        (void)clip(c, when, op, target);
        hold_axis(c, when, op, target);
    }
    if (!calibrates && !drive->y_moves_home)
        target[DR_Y] = drive->position_steps[DR_Y];
    begin_move(c, when, op, DR_SPEED_FULL, target, true);
}

/* Is there no work position to go to, or is this not where one goes there from? */
static bool lacks_work(dr_controller *c, dr_us when, uint8_t op)
{
    const dr_drive *drive = active_drive(c);
    if (drive->work_is_set && (op != DR_OP_MPC_WORK || drive->at_home))
        return false;
    note_value(c, when, drive->work_is_set ? DR_NOTE_NOT_AT_HOME : DR_NOTE_NO_WORK, op, 0);
    return true;
}

static void begin_work(dr_controller *c, dr_us when, uint8_t op)
{
    const dr_drive *drive = active_drive(c);
    uint32_t target[DR_AXES];
    if (lacks_work(c, when, op)) {
        answer_cr(c, when, op);
        return;
    }
    copy_point(target, drive->work_steps);
    (void)clip(c, when, op, target);
    hold_axis(c, when, op, target);
    if (op == DR_OP_MPC_WORK && !drive->y_moves_home)
        target[DR_Y] = drive->position_steps[DR_Y];
    begin_move(c, when, op, DR_SPEED_FULL, target, true);
}

static void begin_centre(dr_controller *c, dr_us when, uint8_t op)
{
    const dr_stage stage = active_stage(c);
    uint32_t target[DR_AXES];
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        target[axis] = stage.travel_steps[axis] / 2u;
    begin_move(c, when, op, DR_SPEED_FULL, target, true);
}

static void resume_move(dr_controller *c, dr_us when)
{
    note_point(c, when, DR_NOTE_RESUMED, 0, c->move_to_steps);
    c->move_is_paused = false;
    active_drive(c)->at_home = false;
    begin_leg(c, when);
}

static void begin_motion(dr_controller *c, dr_us when, const dr_command *command, const dr_request *request)
{
    if (c->move_is_paused) {
        resume_move(c, when);
        return;
    }
    switch (command->op) {
    case DR_OP_TRIO_HOME:
    case DR_OP_TRIO_RECALIBRATE:
    case DR_OP_MPC_HOME:
    case DR_OP_MPC_CALIBRATE:
        begin_home(c, when, command->op);
        break;
    case DR_OP_TRIO_WORK:
    case DR_OP_MPC_WORK:
        begin_work(c, when, command->op);
        break;
    case DR_OP_MPC_CENTRE:
        begin_centre(c, when, command->op);
        break;
    default:
        begin_targeted(c, when, request);
        break;
    }
}

static void select_drive(dr_controller *c, dr_us when, const dr_command *command, uint8_t number)
{
    dr_reply reply = {number, 0, 0, {0, 0, 0}};
    if (number >= 1u && is_connected(c, (uint8_t)(number - 1u))) {
        if (c->active != number - 1u)
            c->move_is_paused = false;
        c->active = (uint8_t)(number - 1u);
    } else {
        reply.value = DR_NO_SUCH_DRIVE;
        note_value(c, when, DR_NOTE_BAD_VALUE, command->op, number);
    }
    answer(c, when, command, &reply);
}

static void set_within(const dr_controller *c, dr_us when, uint8_t op, uint8_t *setting, uint8_t value, uint8_t last)
{
    if (value <= last)
        *setting = value;
    else
        note_value(c, when, DR_NOTE_BAD_VALUE, op, value);
}

static void tell_position(dr_controller *c, dr_us when, const dr_command *command)
{
    dr_reply reply = {c->kind == DR_TRIO ? c->angle_deg : (uint8_t)(c->active + 1u), 0, 0, {0, 0, 0}};
    copy_point(reply.steps, active_drive(c)->position_steps);
    answer(c, when, command, &reply);
}

static void tell_drives(dr_controller *c, dr_us when, const dr_command *command)
{
    dr_reply reply = {0, connected_drives(c), 0, {0, 0, 0}};
    for (uint8_t drive = 0; drive < c->drive_count; drive++)
        reply.value = (uint8_t)(reply.value + (is_connected(c, drive) ? 1u : 0u));
    answer(c, when, command, &reply);
}

/* Carries out a whole command, at rest and with nothing left to send. */
static void execute(dr_controller *c, dr_us when, const dr_command *command, const uint8_t *frame)
{
    const dr_request request = dr_wire_get_request(command, frame);
    if (connected_drives(c) == 0) {
        note_value(c, when, DR_NOTE_NO_DRIVE, command->op, 0);
        return;
    }
    if ((command->is & DR_IS_MOTION) != 0) {
        begin_motion(c, when, command, &request);
        return;
    }
    switch (command->op) {
    case DR_OP_TRIO_POSITION:
    case DR_OP_MPC_POSITION:
        tell_position(c, when, command);
        return;
    case DR_OP_MPC_COUNT:
    case DR_OP_MPC_DRIVES:
        tell_drives(c, when, command);
        return;
    case DR_OP_MPC_ACTIVE:
        answer(c, when, command, &(dr_reply){(uint8_t)(c->active + 1u), 0, c->firmware, {0, 0, 0}});
        return;
    case DR_OP_MPC_SELECT:
        select_drive(c, when, command, request.value);
        return;
    case DR_OP_TRIO_ANGLE:
        set_within(c, when, command->op, &c->angle_deg, request.value, DR_ANGLE_MAX_DEG);
        break;
    case DR_OP_MPC_MODE:
        set_within(c, when, command->op, &active_drive(c)->mode, request.value, MODE_LAST);
        break;
    default: /* 'O' and 'F' */
        c->streaming = command->op == DR_OP_MPC_STREAM_ON;
        break;
    }
    answer_cr(c, when, command->op);
}

/* -- What happens by itself ------------------------------------------------------------------------------------------ */

static bool streams(const dr_controller *c) { return c->streaming && c->move_op == DR_OP_MPC_LINE; }

/* A frame is made when the one before has left: on a slow line, of the newest whole micron [P]. */
static bool stream_newest(dr_controller *c, dr_us now)
{
    if (!streams(c) || dr_controller_ready(c) > 0)
        return false;
    const uint8_t q = active_stage(c).quanta_per_step;
    const uint32_t k = dr_leg_microns_by(&c->leg, q, now - c->leg_began);
    if (k == c->microns_streamed)
        return false;
    const dr_us at_us = dr_leg_micron_at_us(&c->leg, q, k);
    uint32_t steps[DR_AXES];
    dr_leg_at(&c->leg, at_us, steps);
    dr_wire_put_stream(steps, c->out);
    c->out_at = 0;
    c->out_bytes = DR_STREAM_FRAME;
    c->out_op = c->move_op;
    c->microns_streamed = k;
    note_bytes(c, c->leg_began + at_us, DR_NOTE_STREAM, c->move_op, c->out, DR_STREAM_FRAME, k);
    return true;
}

static void execute_kept(dr_controller *c, dr_us when)
{
    dr_command command;
    uint8_t frame[DR_FRAME_MAX];
    (void)dr_command_find(kind_of(c), c->firmware, c->kept[0], &command); /* only known frames are kept */
    const uint8_t length = (uint8_t)(1u + command.args);
    copy_bytes(frame, c->kept, length);
    c->kept_bytes = (uint8_t)(c->kept_bytes - length);
    copy_bytes(c->kept, c->kept + length, c->kept_bytes);
    execute(c, when, &command, frame);
}

/* Begins as a controller that has just become able to listen. */
static void awake(dr_controller *c, dr_us when)
{
    static const uint32_t beginning[DR_AXES] = {0, 0, 0};
    c->state = DR_STATE_REST;
    if (c->kind == DR_TRIO && c->calibrates_at_power_on && is_connected(c, c->active))
        begin_move(c, when, DR_OP_TRIO_RECALIBRATE, DR_SPEED_FULL, beginning, false);
}

/* One event that is due by now, the earliest. False: there is none. A kept command that need not wait for a reply to leave
 * starts when the event before it was, not when somebody comes to see. */
static bool settle_one(dr_controller *c, dr_us now, dr_us *before)
{
    dr_us end;
    switch (c->state) {
    case DR_STATE_BOOTING:
        end = c->leg_began + BOOT_US;
        if (dr_us_before(now, end))
            return false;
        awake(c, end);
        *before = end;
        return true;
    case DR_STATE_MOVING:
        if (stream_newest(c, now))
            return true;
        end = c->leg_began + dr_leg_lasts_us(&c->leg);
        if (dr_us_before(now, end))
            return false;
        end_leg(c, end);
        *before = end;
        return true;
    case DR_STATE_REST:
        if (c->kept_bytes == 0 || dr_controller_ready(c) > 0)
            return false;
        execute_kept(c, *before);
        return true;
    default:
        return false;
    }
}

static void settle(dr_controller *c, dr_us now)
{
    dr_us before = now;
    for (uint16_t i = 0; i < EVENTS_MAX && settle_one(c, now, &before); i++) {}
}

bool dr_controller_due(const dr_controller *c, dr_us *when)
{
    if (c->state == DR_STATE_BOOTING) {
        *when = c->leg_began + BOOT_US;
        return true;
    }
    if (c->state != DR_STATE_MOVING)
        return false;
    *when = c->leg_began + dr_leg_lasts_us(&c->leg);
    if (streams(c) && dr_controller_ready(c) == 0) {
        const uint8_t q = active_stage(c).quanta_per_step;
        if (c->microns_streamed < dr_leg_microns(&c->leg, q))
            *when = c->leg_began + dr_leg_micron_at_us(&c->leg, q, c->microns_streamed + 1u);
    }
    return true;
}

/* -- The host's side ------------------------------------------------------------------------------------------------- */

static void lose(dr_controller *c, dr_us now, uint8_t op, size_t count)
{
    for (size_t i = 0; i < count; i++)
        count_up(&c->lost_bytes);
    note_value(c, now, DR_NOTE_LOST, op, (uint32_t)count);
}

static void wedge(dr_controller *c, dr_us now, uint8_t op)
{
    if (is_moving(c))
        halt(c, now);
    c->state = DR_STATE_WEDGED;
    c->out_at = c->out_bytes = c->interrupt_crs = c->kept_bytes = 0;
    note_value(c, now, DR_NOTE_WEDGED, op, 0);
}

/* ^C at a frame boundary. An MPC-200 stops any move; a TRIO stops 'S' and does not hear it during any other [T 12, M 14]. */
static void interrupt(dr_controller *c, dr_us now, uint8_t op)
{
    if (is_moving(c)) {
        if (c->kind == DR_TRIO && c->move_op != DR_OP_TRIO_LINE) {
            note_value(c, now, DR_NOTE_STOP_IGNORED, c->move_op, 0);
            return;
        }
        halt(c, now);
        c->move_is_paused = has_quirk(c, DR_QUIRK_PAUSE_ON_STOP);
    }
    c->state = DR_STATE_REST;
    if (connected_drives(c) == 0) {
        note_value(c, now, DR_NOTE_NO_DRIVE, op, 0);
        return;
    }
    static const uint8_t cr = DR_CR;
    if (c->interrupt_crs < UINT8_MAX)
        c->interrupt_crs++;
    note_bytes(c, now, DR_NOTE_REPLY, op, &cr, 1, 0);
}

/* A whole command has arrived. */
static void arrive(dr_controller *c, dr_us now, const dr_command *command)
{
    const uint8_t length = (uint8_t)(1u + command->args);
    const bool queries = command->op == DR_OP_TRIO_POSITION || command->op == DR_OP_MPC_POSITION;
    const bool hurries = command->op == DR_OP_MPC_LINE && c->pause_us < DR_PAUSE_IN_LINE_US;
    note_bytes(c, now, DR_NOTE_REQUEST, command->op, c->framer.bytes, length, 0);
    if ((command->is & DR_IS_INTERRUPT) != 0) {
        interrupt(c, now, command->op);
    } else if ((queries && has_quirk(c, DR_QUIRK_QUERY_WEDGES) && is_moving(c)) ||
               (hurries && has_quirk(c, DR_QUIRK_S_NEEDS_PAUSE))) {
        wedge(c, now, command->op);
    } else if (c->state == DR_STATE_REST && c->kept_bytes == 0 && dr_controller_ready(c) == 0) {
        execute(c, now, command, c->framer.bytes);
    } else if (c->kept_bytes + length > DR_KEPT_MAX) {
        lose(c, now, command->op, length);
    } else {
        copy_bytes(c->kept + c->kept_bytes, c->framer.bytes, length);
        c->kept_bytes = (uint8_t)(c->kept_bytes + length);
        count_up(&c->kept_commands);
        note_value(c, now, DR_NOTE_KEPT, command->op, 0);
    }
}

static void push_byte(dr_controller *c, dr_us now, uint8_t byte)
{
    dr_command command;
    if (c->state == DR_STATE_OFF || c->state == DR_STATE_BOOTING || c->state == DR_STATE_WEDGED) {
        lose(c, now, DR_OP_NONE, 1);
        return;
    }
    if (c->framer.have == 0)
        c->pause_us = 0;
    switch (dr_framer_push(&c->framer, kind_of(c), c->firmware, byte, &command)) {
    case DR_FRAMED_WHOLE:
        arrive(c, now, &command);
        settle(c, now);
        break;
    case DR_FRAMED_FILLER:
        note_bytes(c, now, DR_NOTE_FILLER, DR_OP_NONE, &byte, 1, 0);
        break;
    case DR_FRAMED_UNKNOWN:
        count_up(&c->unknown_bytes);
        note_bytes(c, now, DR_NOTE_UNKNOWN, DR_OP_NONE, &byte, 1, 0);
        break;
    case DR_FRAMED_PART:
    default:
        break;
    }
}

void dr_controller_push(dr_controller *c, dr_us now, const uint8_t *bytes, size_t count)
{
    settle(c, now);
    for (size_t i = 0; i < count; i++)
        push_byte(c, now, bytes[i]);
}

void dr_controller_paused(dr_controller *c, uint32_t pause_us)
{
    /* Before the speed byte or before the coordinates of an 'S' [M table 9; P]; nobody asks about other commands. */
    if (c->framer.have == 1 || c->framer.have == 2)
        c->pause_us = pause_us > UINT32_MAX - c->pause_us ? UINT32_MAX : c->pause_us + pause_us;
}

size_t dr_controller_pull(dr_controller *c, dr_us now, uint8_t *bytes, size_t room)
{
    size_t count = 0;
    settle(c, now);
    while (count < room && dr_controller_ready(c) > 0) { /* at most room times */
        if (c->out_at < c->out_bytes) {
            bytes[count++] = c->out[c->out_at++];
        } else {
            bytes[count++] = DR_CR;
            c->interrupt_crs--;
        }
        if (dr_controller_ready(c) == 0)
            settle(c, now);
    }
    return count;
}

void dr_controller_position(const dr_controller *c, uint8_t drive, dr_us now, uint32_t steps[DR_AXES])
{
    if (is_moving(c) && drive == c->active)
        dr_leg_at(&c->leg, leg_elapsed_us(c, now), steps);
    else
        copy_point(steps, c->drives[drive].position_steps);
}

/* -- Hands ----------------------------------------------------------------------------------------------------------- */

static void forget_line(dr_controller *c)
{
    dr_framer_reset(&c->framer);
    c->out_at = c->out_bytes = c->interrupt_crs = c->kept_bytes = 0;
    c->pause_us = 0;
}

static void power_off(dr_controller *c, dr_us now)
{
    if (is_moving(c))
        halt(c, now);
    forget_line(c);
    c->move_is_paused = false;
    c->state = DR_STATE_OFF;
    note_value(c, now, DR_NOTE_POWER_OFF, DR_OP_NONE, 0);
}

static void set_out(dr_controller *c)
{
    forget_line(c);
    c->move_is_paused = false;
    c->streaming = c->kind == DR_MPC && has_quirk(c, DR_QUIRK_STREAM_AT_POWER_UP);
    activate_lowest(c);
    c->state = DR_STATE_REST;
}

static void power_on(dr_controller *c, dr_us now)
{
    set_out(c);
    for (uint8_t i = 0; i < c->drive_count; i++) {
        dr_drive *drive = &c->drives[i];
        drive->mode = 0;
        drive->at_home = false;
        if (drive->calibration == DR_UNCALIBRATED)
            drive->calibration = DR_UNCALIBRATED_CYCLED;
    }
    note_value(c, now, DR_NOTE_POWER_ON, DR_OP_NONE, 0);
    if (has_quirk(c, DR_QUIRK_BOOT_SECOND)) {
        c->state = DR_STATE_BOOTING;
        c->leg_began = now;
    } else {
        awake(c, now);
    }
}

static bool can_connect(const dr_controller *c, const dr_hand *hand)
{
    return hand->stage == DR_STAGE_NONE ||
           dr_stage_fits((dr_stage_id)hand->stage, kind_of(c), c->firmware, (uint8_t)(hand->drive + 1u)) == DR_FIT_YES;
}

static void connect(dr_controller *c, dr_us now, const dr_hand *hand)
{
    dr_drive *drive = &c->drives[hand->drive];
    dr_stage stage;
    const bool in_use = hand->drive == c->active;
    if (in_use && is_moving(c)) {
        halt(c, now);
        if (c->move_answers) {
            c->state = DR_STATE_STRANDED;
            note_value(c, now, DR_NOTE_STRANDED, c->move_op, 0);
        }
    }
    drive->stage = hand->stage;
    drive->at_home = false;
    if (dr_stage_get((dr_stage_id)hand->stage, &stage))
        for (uint8_t axis = 0; axis < DR_AXES; axis++)
            if (drive->position_steps[axis] > stage.travel_steps[axis])
                drive->position_steps[axis] = stage.travel_steps[axis];
    if (in_use)
        c->move_is_paused = false;
    if (!is_connected(c, c->active))
        activate_lowest(c);
    note_value(c, now, DR_NOTE_CONNECTED, DR_OP_NONE, hand->stage);
}

static void place(dr_controller *c, dr_us now, const dr_hand *hand)
{
    dr_drive *drive = &c->drives[hand->drive];
    dr_stage stage;
    (void)dr_stage_get((dr_stage_id)drive->stage, &stage);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        drive->position_steps[axis] =
            hand->steps[axis] < stage.travel_steps[axis] ? hand->steps[axis] : stage.travel_steps[axis];
    drive->at_home = false;
    note_point(c, now, DR_NOTE_PLACED, 0, drive->position_steps);
}

bool dr_controller_poke(dr_controller *c, dr_us now, const dr_hand *hand)
{
    settle(c, now);
    switch (hand->what) {
    case DR_HAND_POWER_OFF:
        if (c->state == DR_STATE_OFF)
            return false;
        power_off(c, now);
        return true;
    case DR_HAND_POWER_ON:
        if (c->state != DR_STATE_OFF)
            return false;
        power_on(c, now);
        return true;
    case DR_HAND_CONNECT:
        if (hand->drive >= c->drive_count || !can_connect(c, hand))
            return false;
        connect(c, now, hand);
        return true;
    case DR_HAND_PLACE:
        if (c->state != DR_STATE_REST || !is_connected(c, hand->drive))
            return false;
        place(c, now, hand);
        return true;
    default:
        return false;
    }
}

/* -- The panel's effects ---------------------------------------------------------------------------------------------- */

static bool is_possible(const dr_controller *c, dr_effect effect, uint8_t value)
{
    const bool trio = c->kind == DR_TRIO;
    if (!is_connected(c, c->active))
        return false;
    switch (effect) {
    case DR_EFFECT_PAUSE:
        return c->state == DR_STATE_MOVING && (c->move_op == DR_OP_TRIO_HOME || c->move_op == DR_OP_TRIO_WORK);
    case DR_EFFECT_RESUME:
        return c->state == DR_STATE_PAUSED;
    case DR_EFFECT_STOP:
        return !trio && (c->state == DR_STATE_MOVING || c->state == DR_STATE_STRANDED);
    default:
        break;
    }
    if (c->state != DR_STATE_REST)
        return false;
    switch (effect) {
    case DR_EFFECT_CALIBRATE:
        return !trio;
    case DR_EFFECT_SELECT:
        return !trio && is_connected(c, value);
    case DR_EFFECT_MODE:
        return !trio && value <= MODE_LAST;
    case DR_EFFECT_ANGLE:
        return trio && value <= DR_ANGLE_MAX_DEG;
    case DR_EFFECT_STORE_HOME:
        return trio;
    default:
        return true;
    }
}

/* STOP on the ROE ends any move; the host's sends its one CR all the same [O]. */
static void stop_by_hand(dr_controller *c, dr_us now)
{
    if (c->state == DR_STATE_MOVING)
        halt(c, now);
    c->state = DR_STATE_REST;
    if (c->move_answers) {
        answer_cr(c, now, c->move_op);
        c->out_op = (uint8_t)(c->move_op | STOPPED_BY_HAND);
    }
}

/* What a host would ask for, but without a CR. */
static void begin_by_hand(dr_controller *c, dr_us now, dr_op op)
{
    dr_command command;
    if (!dr_command_for(kind_of(c), c->firmware, op, &command))
        (void)dr_command_for(kind_of(c), c->firmware, DR_OP_MPC_CENTRE,
                             &command); /* no calibration yet [M table 9, 'N'] */
    c->move_is_paused = false;          /* a move that ^C paused is dropped */
    execute(c, now, &command, &command.code);
    c->move_answers = false;
}

bool dr_controller_apply(dr_controller *c, dr_us now, dr_effect effect, uint8_t value)
{
    settle(c, now);
    if (!is_possible(c, effect, value))
        return false;
    const bool trio = c->kind == DR_TRIO;
    dr_drive *drive = active_drive(c);
    note_bytes(c, now, DR_NOTE_HAND, DR_OP_NONE, &value, 1, effect);
    switch (effect) {
    case DR_EFFECT_HOME:
        begin_by_hand(c, now, trio ? DR_OP_TRIO_HOME : DR_OP_MPC_HOME);
        break;
    case DR_EFFECT_WORK:
        if (lacks_work(c, now, trio ? DR_OP_TRIO_WORK : DR_OP_MPC_WORK))
            return false;
        begin_by_hand(c, now, trio ? DR_OP_TRIO_WORK : DR_OP_MPC_WORK);
        break;
    case DR_EFFECT_CALIBRATE:
        begin_by_hand(c, now, DR_OP_MPC_CALIBRATE);
        break;
    case DR_EFFECT_PAUSE:
        c->leg_began = now - c->leg_began;
        c->state = DR_STATE_PAUSED;
        break;
    case DR_EFFECT_RESUME:
        c->leg_began = now - c->leg_began;
        c->state = DR_STATE_MOVING;
        break;
    case DR_EFFECT_STOP:
        stop_by_hand(c, now);
        break;
    case DR_EFFECT_SELECT:
        if (c->active != value)
            c->move_is_paused = false;
        c->active = value;
        break;
    case DR_EFFECT_MODE:
        drive->mode = value;
        break;
    case DR_EFFECT_ANGLE:
        c->angle_deg = value;
        break;
    case DR_EFFECT_STORE_HOME:
        copy_point(c->home_steps, drive->position_steps);
        break;
    case DR_EFFECT_STORE_WORK:
        copy_point(drive->work_steps, drive->position_steps);
        drive->work_is_set = true;
        break;
    }
    settle(c, now);
    return true;
}

/* -- Rehearsing faults of the mechanics ------------------------------------------------------------------------------ */

bool dr_controller_spoil_leg(dr_controller *c, dr_us now, uint8_t axis, uint16_t times)
{
    dr_leg *leg = &c->leg;
    if (c->state != DR_STATE_MOVING || c->leg_began != now || times == 0 ||
        dr_leg_lasts_us(leg) > (uint32_t)INT32_MAX / times)
        return false;
    for (uint8_t i = 0; i < DR_AXES; i++)
        leg->lasts_us[i] *= times;
    if (axis < DR_AXES) {
        const uint32_t from = leg->from[axis], to = leg->to[axis];
        leg->to[axis] = to > from ? from + (to - from) / 2u : from - (from - to) / 2u;
        leg->lasts_us[axis] = leg->to[axis] == from ? 0 : (leg->lasts_us[axis] + 1u) / 2u;
    }
    note_point(c, now, DR_NOTE_LEG, dr_leg_lasts_us(leg), leg->to);
    return true;
}

/* -- Setting up ------------------------------------------------------------------------------------------------------ */

void dr_drive_init(dr_drive *drive, dr_stage_id id)
{
    dr_stage stage = {DR_MPC, 1, 0, 0, {0, 0, 0}};
    (void)dr_stage_get(id, &stage);
    *drive = (dr_drive){.stage = (uint8_t)id, .diagonal = DR_DIAGONAL_DEFAULT, .y_moves_home = true};
    if (stage.kind == DR_TRIO)
        set_point(drive->position_steps, dr_um_to_steps(CALIBRATION_OUT_UM, stage.quanta_per_step));
}

void dr_controller_init(dr_controller *c, dr_kind kind, dr_drive *drives, uint8_t drive_count)
{
    *c = (dr_controller){.drives = drives, .drive_count = drive_count, .kind = (uint8_t)kind, .state = DR_STATE_OFF};
    c->firmware = kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
    c->angle_deg = DR_ANGLE_DEFAULT_DEG;
    c->calibrates_at_power_on = true;
    c->move_op = DR_OP_NONE;
}

void dr_controller_start(dr_controller *c, dr_us now)
{
    set_out(c);
    note_value(c, now, DR_NOTE_STARTED, DR_OP_NONE, 0);
}
