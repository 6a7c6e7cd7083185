#include "dr_panel.h"

#define BIT(button) ((uint8_t)(1u << (button)))
#define TRIO_BUTTONS 0x1Fu /* HOME, WORK, PULSE, RELATIVE, SPEED */
#define MPC_BUTTONS 0xE3u  /* HOME, WORK POS., STOP, NORM/DIAG, CALIBRATE */

#define SPEED_LAST 3u  /* [T page 1] */
#define MODE_LAST 9u   /* [M page 1] */
#define MODE_OF_TWO 5u /* the other one beside 0 when ROE-200 switch 1 is OFF [M table 1] */

/* Switches by bit: number - 1. */
#define SWITCH(byte, number) (((unsigned)(byte) >> ((number)-1u) & 1u) != 0)
#define TRIO_FACTORY 0x30u /* external 5 and 6 ON [T table 1] */
#define MPC_FACTORY 0x70u  /* 5, 6 and 7 ON [M table 3]; the others come from the controller */
#define ROE_FACTORY 0x0Bu  /* 1, 2 and 4 ON [P]; 4 is reserved [M table 1] */
#define DIAGONAL_BITS 0x0Fu
#define ROE_ALL_MODES 1u
#define ROE_RELATIVE 2u
#define ROE_NOT_CYCLICAL 3u
#define INSIDE_DEVICE 2u
#define INSIDE_NON_LINEAR 4u
#define QUANTA_OF_MP285 8u /* internal switch 2 is ON for these stages [T tables 2 and 4] */

#define UNIT UINT32_C(32768)                /* what cos and sin are in */
#define PART_MIDDLE ((uint16_t)(UNIT / 2u)) /* a drive that has come to rest stands in the middle of its microstep */

enum { EVENT_ANGLE = DR_HOLD_BUTTONS, EVENT_KNOB_RESTS, EVENTS }; /* below: the button of that number was held */

/* -- Small helpers ------------------------------------------------------------------------------------------------- */

static bool is_trio(const dr_panel *p) { return p->controller->kind == DR_TRIO; }
static dr_panel_drive *active_panel(const dr_panel *p) { return &p->drives[p->controller->active]; }
static const dr_drive *active_drive(const dr_panel *p) { return &p->controller->drives[p->controller->active]; }

static dr_stage active_stage(const dr_panel *p)
{
    dr_stage stage = {0, 1, 0, 0, {0, 0, 0}};
    (void)dr_stage_get((dr_stage_id)active_drive(p)->stage, &stage);
    return stage;
}

static bool is_at_rest(const dr_panel *p)
{
    return p->controller->state == DR_STATE_REST && active_drive(p)->stage != DR_STAGE_NONE;
}

/* An ROE-200 locks buttons and knobs of a drive, a TRIO the knobs alone [P]. */
static bool are_knobs_alive(const dr_panel *p) { return is_at_rest(p) && !active_panel(p)->is_locked; }
static bool are_buttons_alive(const dr_panel *p) { return is_trio(p) ? is_at_rest(p) : are_knobs_alive(p); }

static bool apply(dr_panel *p, dr_us now, dr_effect effect, uint8_t value)
{
    return dr_controller_apply(p->controller, now, effect, value);
}

static void beep(dr_panel *p) { p->beeps++; }

static void set_origin(dr_panel *p)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        active_panel(p)->origin_steps[axis] = active_drive(p)->position_steps[axis];
}

static dr_diagonal direction(const dr_panel *p)
{
    return is_trio(p) ? dr_angle_get(p->controller->angle_deg) : dr_diagonal_get(active_drive(p)->diagonal);
}

/* -- Movement by hand ------------------------------------------------------------------------------------------------ */

/* How far the axis can go. */
static uint32_t room_steps(const dr_panel *p, uint8_t axis, bool forward)
{
    const uint32_t at_steps = active_drive(p)->position_steps[axis];
    return forward ? active_stage(p).travel_steps[axis] - at_steps : at_steps;
}

static void move_by(dr_panel *p, dr_us now, bool forward, const uint32_t way_steps[DR_AXES])
{
    dr_hand hand = {DR_HAND_PLACE, p->controller->active, 0, {0, 0, 0}};
    bool is_moved = false;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const uint32_t way = way_steps[axis];
        hand.steps[axis] = active_drive(p)->position_steps[axis] + (forward ? way : 0u - way);
        is_moved = is_moved || way != 0;
    }
    if (is_moved)
        (void)dr_controller_poke(p->controller, now, &hand);
}

static void move_axis(dr_panel *p, dr_us now, uint8_t axis, bool forward, uint32_t steps)
{
    const uint32_t room = room_steps(p, axis, forward);
    uint32_t way[DR_AXES] = {0, 0, 0};
    way[axis] = steps < room ? steps : room;
    move_by(p, now, forward, way);
}

/* How many steps along the diagonal until this axis, which stands so far within a microstep, would leave its travel; at most
 * `steps`. In 1/32768 of a microstep its room has more than 32 bits: it is divided in two pieces. */
static uint32_t within(uint32_t room, uint16_t part, uint16_t share, bool forward, uint32_t steps)
{
    if (share == 0)
        return steps;
    const uint32_t room_part = forward ? UNIT - 1u - part : part;
    const uint32_t way = room / share * UNIT + (room % share * UNIT + room_part) / share;
    return way < steps ? way : steps;
}

/* Goes this axis' share of a way along the diagonal. Returns the microsteps that it comes through. */
static uint32_t go_on(uint16_t *part, uint16_t share, bool forward, uint32_t way)
{
    const uint32_t whole = way / UNIT * share, rest = way % UNIT * share;
    const uint32_t begin =
        forward ? *part : *part + share * UNIT; /* back, it is counted from `share` microsteps before */
    const uint32_t reached = forward ? begin + rest : begin - rest;
    *part = (uint16_t)(reached % UNIT);
    return whole + (forward ? reached / UNIT : share - reached / UNIT);
}

/* Along the diagonal: X by cos, Z by sin, each to the microstep that the exact place is in. The fraction is kept, so that
 * many small turns go as straight and as far as one large one. Where an axis meets its end, both stop. */
static void move_along(dr_panel *p, dr_us now, bool forward, uint32_t steps)
{
    const dr_diagonal along = direction(p);
    uint16_t *part = active_panel(p)->part;
    uint32_t way[DR_AXES] = {0, 0, 0};
    steps = within(room_steps(p, DR_X, forward), part[0], along.cos, forward, steps);
    steps = within(room_steps(p, DR_Z, forward), part[1], along.sin, forward, steps);
    way[DR_X] = go_on(&part[0], along.cos, forward, steps);
    way[DR_Z] = go_on(&part[1], along.sin, forward, steps);
    move_by(p, now, forward, way);
}

/* 2.85 um along the diagonal, this axis' share of it to the nearest microstep [P]. */
static uint32_t pulse_steps(uint16_t share, uint8_t quanta_per_step)
{
    return (DR_PULSE_QUANTA_100 * share + 50u * UNIT * quanta_per_step) / (100u * UNIT * quanta_per_step);
}

static uint32_t fitting(uint32_t pulses, uint32_t room, uint32_t pulse)
{
    return pulse > 0 && room / pulse < pulses ? room / pulse : pulses;
}

/* Whole pulses only; those for which an axis has no room are not made. */
static void move_pulses(dr_panel *p, dr_us now, bool forward, uint32_t pulses)
{
    const dr_diagonal along = direction(p);
    const uint8_t q = active_stage(p).quanta_per_step;
    uint32_t way[DR_AXES] = {pulse_steps(along.cos, q), 0, pulse_steps(along.sin, q)};
    pulses = fitting(pulses, room_steps(p, DR_X, forward), way[DR_X]);
    pulses = fitting(pulses, room_steps(p, DR_Z, forward), way[DR_Z]);
    way[DR_X] *= pulses;
    way[DR_Z] *= pulses;
    move_by(p, now, forward, way);
}

/* -- Knobs ----------------------------------------------------------------------------------------------------------- */

/* How often a step is doubled because the knob is turned fast. */
static uint8_t doublings(dr_panel *p, dr_us now, dr_knob knob, uint16_t detents)
{
    const bool goes_on = p->turned == knob;
    const dr_us each_us = (now - p->turned_at) / detents;
    p->turned = (uint8_t)knob;
    p->turned_at = now;
    if (!goes_on || each_us >= DR_KNOB_FAST_US)
        return 0;
    return each_us < DR_KNOB_FASTEST_US ? 3 : each_us < DR_KNOB_FASTER_US ? 2 : 1;
}

static uint16_t steps_per_detent(dr_panel *p, dr_us now, dr_knob knob, uint16_t detents)
{
    const uint8_t mode = active_drive(p)->mode;
    if (!is_trio(p) && mode > 0)
        return (uint16_t)(DR_KNOB_MPC_STEPS >> (mode - 1u));
    const unsigned slow = is_trio(p) ? DR_KNOB_TRIO_STEPS >> 2u * p->speed : DR_KNOB_MPC_MODE_0_STEPS;
    const bool accelerates = !is_trio(p) || SWITCH(p->inside_read, INSIDE_NON_LINEAR);
    return (uint16_t)(accelerates ? slow << doublings(p, now, knob, detents) : slow);
}

/* Does a turn clockwise go forward? TRIO external switches 1-4: ON is counter-clockwise [T table 1]; MPC-200 switches 5-7: ON
 * is clockwise [M table 3]. */
static bool is_clockwise_forward(const dr_panel *p, dr_knob knob)
{
    return is_trio(p) ? !SWITCH(active_panel(p)->rear_read, knob + 1u) : SWITCH(active_panel(p)->rear_read, knob + 5u);
}

static void turn_angle(dr_panel *p, dr_us now, int16_t detents)
{
    int32_t deg = (int32_t)p->controller->angle_deg + detents;
    if (deg < (int32_t)DR_ANGLE_KNOB_FIRST_DEG)
        deg = DR_ANGLE_KNOB_FIRST_DEG;
    if (deg > (int32_t)DR_ANGLE_KNOB_LAST_DEG)
        deg = DR_ANGLE_KNOB_LAST_DEG;
    if (deg != p->controller->angle_deg)
        (void)apply(p, now, DR_EFFECT_ANGLE, (uint8_t)deg);
}

/* Steps through the drives that are connected. */
static void turn_manipulator(dr_panel *p, dr_us now, bool up, uint16_t clicks)
{
    const dr_controller *c = p->controller;
    uint8_t connected[DR_PORTS] = {0}, count = 0, at = 0;
    for (uint8_t drive = 0; drive < c->drive_count; drive++) {
        if (drive == c->active)
            at = count;
        if (c->drives[drive].stage != DR_STAGE_NONE)
            connected[count++] = drive;
    }
    if (count == 0)
        return;
    if (SWITCH(p->inside_read, ROE_NOT_CYCLICAL)) {
        const uint8_t room = (uint8_t)(up ? count - 1u - at : at);
        clicks = clicks < room ? clicks : room;
    }
    const uint8_t way = (uint8_t)(clicks % count);
    const uint8_t to = (uint8_t)((up ? at + way : at + count - way) % count);
    if (to != at)
        (void)apply(p, now, DR_EFFECT_SELECT, connected[to]);
}

/* Modes stop at both ends. */
static void turn_mode(dr_panel *p, dr_us now, bool up, uint16_t clicks)
{
    const uint8_t mode = active_drive(p)->mode;
    uint8_t to = (uint8_t)(up ? MODE_OF_TWO : 0);
    if (SWITCH(p->inside_read, ROE_ALL_MODES)) {
        const uint8_t room = (uint8_t)(up ? MODE_LAST - mode : mode);
        const uint8_t way = (uint8_t)(clicks < room ? clicks : room);
        to = (uint8_t)(up ? mode + way : mode - way);
    }
    if (to != mode)
        (void)apply(p, now, DR_EFFECT_MODE, to);
}

static void turn_stage(dr_panel *p, dr_us now, dr_knob knob, bool clockwise, uint16_t detents)
{
    const bool forward = clockwise == is_clockwise_forward(p, knob);
    const bool is_along = knob == DR_KNOB_D || (knob == DR_KNOB_Z && active_panel(p)->is_diagonal);
    if (is_along && !is_trio(p) && active_drive(p)->mode == MODE_LAST) {
        move_pulses(p, now, forward, detents);
        return;
    }
    const uint32_t steps = (uint32_t)detents * steps_per_detent(p, now, knob, detents);
    if (is_along)
        move_along(p, now, forward, steps);
    else
        move_axis(p, now, (uint8_t)knob, forward, steps);
}

bool dr_panel_turn(dr_panel *p, dr_us now, dr_knob knob, int16_t detents)
{
    const bool clockwise = detents > 0;
    const uint16_t count = (uint16_t)(clockwise ? (int32_t)detents : -(int32_t)detents);
    dr_panel_settle(p, now);
    if (knob >= DR_KNOBS || (is_trio(p) ? knob > DR_KNOB_D : knob == DR_KNOB_D))
        return false;
    if (count == 0)
        return true;
    if (knob == DR_KNOB_MANIPULATOR) {
        if (p->controller->state == DR_STATE_REST) /* whatever is locked, the other drives can be reached */
            turn_manipulator(p, now, clockwise, count);
    } else if (are_knobs_alive(p)) {
        if (knob == DR_KNOB_MODE)
            turn_mode(p, now, clockwise, count);
        else if (knob == DR_KNOB_D && p->is_setting_angle)
            turn_angle(p, now, detents);
        else
            turn_stage(p, now, knob, clockwise, count);
    }
    return true;
}

/* -- Buttons --------------------------------------------------------------------------------------------------------- */

/* HOME and WORK of a TRIO: go, and during that move, whoever began it: pause, go on [T page 1]. */
static void go_or_pause(dr_panel *p, dr_us now, dr_effect go, dr_op its_move)
{
    if (p->controller->state == DR_STATE_REST)
        (void)apply(p, now, go, 0);
    else if (p->controller->move_op == its_move)
        (void)apply(p, now, p->controller->state == DR_STATE_PAUSED ? DR_EFFECT_RESUME : DR_EFFECT_PAUSE, 0);
}

/* A TRIO's button was released in time. */
static void tap_trio(dr_panel *p, dr_us now, dr_button button)
{
    if (button == DR_BUTTON_HOME)
        go_or_pause(p, now, DR_EFFECT_HOME, DR_OP_TRIO_HOME);
    else if (button == DR_BUTTON_WORK)
        go_or_pause(p, now, DR_EFFECT_WORK, DR_OP_TRIO_WORK);
    else if (!are_buttons_alive(p))
        return;
    else if (button == DR_BUTTON_PULSE)
        move_pulses(p, now, true, 1);
    else if (button == DR_BUTTON_RELATIVE)
        p->is_relative = !p->is_relative;
    else
        p->speed = p->speed < SPEED_LAST ? (uint8_t)(p->speed + 1u) : 0;
}

/* A button has been held long enough. */
static void hold(dr_panel *p, dr_us when, dr_button button)
{
    if (!is_at_rest(p))
        return;
    if (!is_trio(p) || button == DR_BUTTON_SPEED) {
        active_panel(p)->is_locked = !active_panel(p)->is_locked;
    } else if (button == DR_BUTTON_HOME) {
        (void)apply(p, when, DR_EFFECT_STORE_HOME, 0);
    } else if (button == DR_BUTTON_WORK) {
        (void)apply(p, when, DR_EFFECT_STORE_WORK, 0);
    } else if (button == DR_BUTTON_RELATIVE) {
        set_origin(p);
    } else {
        p->is_setting_angle = true;
        p->angle_setting_ends = when + DR_ANGLE_SETTING_US;
    }
    beep(p);
}

static void toggle_diagonal(dr_panel *p)
{
    active_panel(p)->is_diagonal = !active_panel(p)->is_diagonal;
    if (active_panel(p)->is_diagonal)
        set_origin(p);
}

/* A button of an ROE-200 goes down. Returns whether that was all: WORK POS. may be held. */
static bool press_mpc(dr_panel *p, dr_us now, dr_button button)
{
    if (button == DR_BUTTON_STOP) {
        (void)apply(p, now, DR_EFFECT_STOP, 0);
        return true;
    }
    if (button == DR_BUTTON_WORK && (p->down & BIT(DR_BUTTON_STOP)) == 0)
        return false;
    if (!are_buttons_alive(p))
        return true;
    if (button == DR_BUTTON_HOME) {
        (void)apply(p, now, DR_EFFECT_HOME, 0);
    } else if (button == DR_BUTTON_CALIBRATE) {
        (void)apply(p, now, DR_EFFECT_CALIBRATE, 0);
    } else if (button == DR_BUTTON_DIAGONAL) {
        toggle_diagonal(p);
    } else {
        (void)apply(p, now, DR_EFFECT_STORE_WORK, 0);
        beep(p);
    }
    return true;
}

static bool has_button(const dr_panel *p, dr_button button)
{
    return button < DR_BUTTONS && ((is_trio(p) ? TRIO_BUTTONS : MPC_BUTTONS) & BIT(button)) != 0;
}

bool dr_panel_press(dr_panel *p, dr_us now, dr_button button)
{
    dr_panel_settle(p, now);
    if (!has_button(p, button))
        return false;
    if ((p->down & BIT(button)) != 0)
        return true;
    const bool has_power = p->controller->state != DR_STATE_OFF && p->controller->state != DR_STATE_BOOTING;
    const bool done = !has_power || (!is_trio(p) && press_mpc(p, now, button));
    p->down = (uint8_t)(p->down | BIT(button));
    p->acted = (uint8_t)(done ? p->acted | BIT(button) : p->acted & ~BIT(button));
    if (!done)
        p->pressed_at[button] = now;
    return true;
}

bool dr_panel_release(dr_panel *p, dr_us now, dr_button button)
{
    dr_panel_settle(p, now);
    if (!has_button(p, button))
        return false;
    const bool waits = (p->down & ~p->acted & BIT(button)) != 0;
    p->down = (uint8_t)(p->down & ~BIT(button));
    if (waits && is_trio(p))
        tap_trio(p, now, button);
    else if (waits && are_buttons_alive(p))
        (void)apply(p, now, DR_EFFECT_WORK, 0);
    return true;
}

/* -- What happens by itself ------------------------------------------------------------------------------------------ */

/* The next event, EVENTS when there is none. */
static uint8_t next_event(const dr_panel *p, dr_us *when)
{
    uint8_t next = EVENTS;
    for (uint8_t event = 0; event < EVENTS; event++) {
        dr_us at;
        bool comes;
        if (event == EVENT_ANGLE) {
            comes = p->is_setting_angle;
            at = p->angle_setting_ends;
        } else if (event == EVENT_KNOB_RESTS) {
            comes = p->turned != DR_KNOBS;
            at = p->turned_at + DR_KNOB_REST_US;
        } else {
            comes = (p->down & ~p->acted & BIT(event)) != 0;
            at = p->pressed_at[event] + (is_trio(p) ? DR_HOLD_TRIO_US : DR_HOLD_LOCK_US);
        }
        if (comes && (next == EVENTS || dr_us_before(at, *when))) {
            next = event;
            *when = at;
        }
    }
    return next;
}

static void settle_controller(dr_panel *p, dr_us now) { (void)dr_controller_pull(p->controller, now, NULL, 0); }

static bool settle_one(dr_panel *p, dr_us now)
{
    dr_us when;
    const uint8_t event = next_event(p, &when);
    if (event == EVENTS || dr_us_before(now, when))
        return false;
    settle_controller(p, when);
    if (event == EVENT_ANGLE) {
        p->is_setting_angle = false;
    } else if (event == EVENT_KNOB_RESTS) {
        p->turned = DR_KNOBS;
    } else {
        p->acted = (uint8_t)(p->acted | BIT(event));
        hold(p, when, (dr_button)event);
    }
    return true;
}

void dr_panel_settle(dr_panel *p, dr_us now)
{
    for (uint8_t i = 0; i <= EVENTS && settle_one(p, now);
         i++) { /* each once, and the angle setting that PULSE begins */
    }
    settle_controller(p, now);
}

bool dr_panel_due(const dr_panel *p, dr_us *when) { return next_event(p, when) != EVENTS; }

/* -- Switches and power ---------------------------------------------------------------------------------------------- */

static uint8_t switches_of(const dr_panel *p, dr_switches bank)
{
    switch (bank) {
    case DR_SWITCHES_REAR:
        return is_trio(p) ? 6 : 8;
    case DR_SWITCHES_INTERNAL:
        return is_trio(p) ? 4 : 0;
    case DR_SWITCHES_ROE:
        return is_trio(p) ? 0 : 4;
    case DR_SWITCHES_RIGHT:
    default:
        return is_trio(p) ? 0 : 1;
    }
}

static bool has_switch(const dr_panel *p, dr_switches bank, uint8_t drive, uint8_t number)
{
    const bool is_of_drive = bank == DR_SWITCHES_REAR || bank == DR_SWITCHES_RIGHT;
    return number >= 1u && number <= switches_of(p, bank) && (!is_of_drive || drive < p->controller->drive_count);
}

bool dr_panel_switch_is_on(const dr_panel *p, dr_switches bank, uint8_t drive, uint8_t number)
{
    if (!has_switch(p, bank, drive, number))
        return false;
    if (bank == DR_SWITCHES_REAR)
        return SWITCH(p->drives[drive].rear, number);
    if (bank == DR_SWITCHES_RIGHT)
        return SWITCH(p->drives[drive].right, number);
    if (bank == DR_SWITCHES_INTERNAL && number == INSIDE_DEVICE)
        return active_stage(p).quanta_per_step == QUANTA_OF_MP285;
    return SWITCH(p->inside, number);
}

bool dr_panel_switch(dr_panel *p, dr_switches bank, uint8_t drive, uint8_t number, bool on)
{
    if (!has_switch(p, bank, drive, number))
        return false;
    if (bank == DR_SWITCHES_INTERNAL && number == INSIDE_DEVICE)
        return on == dr_panel_switch_is_on(p, bank, drive, number);
    uint8_t *byte = bank == DR_SWITCHES_REAR    ? &p->drives[drive].rear
                    : bank == DR_SWITCHES_RIGHT ? &p->drives[drive].right
                                                : &p->inside;
    const uint8_t bit = BIT(number - 1u);
    *byte = (uint8_t)(on ? *byte | bit : *byte & ~bit);
    return true;
}

/* What the panel forgets without power, and a press across it. */
static void forget(dr_panel *p)
{
    p->acted = p->down;
    p->turned = DR_KNOBS;
    p->speed = 0;
    p->is_relative = p->is_setting_angle = false;
    for (uint8_t i = 0; i < p->controller->drive_count; i++)
        p->drives[i] = (dr_panel_drive){.part = {PART_MIDDLE, PART_MIDDLE},
                                        .rear = p->drives[i].rear,
                                        .rear_read = p->drives[i].rear_read,
                                        .right = p->drives[i].right};
}

void dr_panel_read_switches(dr_panel *p)
{
    dr_controller *c = p->controller;
    p->inside_read = p->inside;
    for (uint8_t i = 0; i < c->drive_count; i++) {
        const uint8_t rear = p->drives[i].rear;
        p->drives[i].rear_read = rear;
        if (is_trio(p)) {
            c->drives[i].y_moves_home = SWITCH(rear, 5);
            c->calibrates_at_power_on = SWITCH(rear, 6);
        } else {
            c->drives[i].diagonal = rear & DIAGONAL_BITS;
            c->drives[i].y_moves_home = SWITCH(rear, 8);
        }
    }
}

void dr_panel_power(dr_panel *p, dr_us now, bool on)
{
    dr_panel_settle(p, now);
    if (on == (p->controller->state != DR_STATE_OFF))
        return;
    forget(p);
    if (on)
        dr_panel_read_switches(p);
    (void)dr_controller_poke(p->controller, now, &(dr_hand){.what = on ? DR_HAND_POWER_ON : DR_HAND_POWER_OFF});
}

void dr_panel_init(dr_panel *p, dr_controller *controller, dr_panel_drive *drives)
{
    *p = (dr_panel){.controller = controller, .drives = drives};
    p->inside = p->inside_read = is_trio(p) ? 0 : ROE_FACTORY;
    for (uint8_t i = 0; i < controller->drive_count; i++) {
        const dr_drive *drive = &controller->drives[i];
        uint8_t rear = TRIO_FACTORY;
        if (!is_trio(p))
            rear = (uint8_t)(MPC_FACTORY | drive->diagonal % DR_DIAGONALS | (drive->y_moves_home ? 0x80u : 0));
        drives[i].rear = drives[i].rear_read = rear;
        drives[i].right = 0;
    }
    if (is_trio(p)) {
        (void)dr_panel_switch(p, DR_SWITCHES_REAR, 0, 5, controller->drives[0].y_moves_home);
        (void)dr_panel_switch(p, DR_SWITCHES_REAR, 0, 6, controller->calibrates_at_power_on);
    }
    forget(p);
}

/* -- What a person sees ---------------------------------------------------------------------------------------------- */

static dr_screen screen(const dr_panel *p, const dr_look *look)
{
    if (p->controller->state == DR_STATE_OFF || p->controller->state == DR_STATE_BOOTING)
        return DR_SCREEN_DARK;
    if (!is_trio(p))
        return DR_SCREEN_PLAIN;
    if (look->moving != DR_OP_NONE || look->is_locked)
        return DR_SCREEN_RED;
    return look->is_relative ? DR_SCREEN_BLUE : DR_SCREEN_GREEN;
}

void dr_panel_look(dr_panel *p, dr_us now, dr_look *out)
{
    dr_panel_settle(p, now);
    const dr_controller *c = p->controller;
    const dr_panel_drive *drive = active_panel(p);
    const dr_diagonal along = direction(p);
    const uint8_t q = active_stage(p).quanta_per_step;
    const bool trio = is_trio(p);
    const bool moves = c->state == DR_STATE_MOVING || c->state == DR_STATE_PAUSED || c->state == DR_STATE_STRANDED;
    *out = (dr_look){
        .drive = (uint8_t)(active_drive(p)->stage != DR_STAGE_NONE ? c->active + 1u : 0),
        .moving = moves ? c->move_op : (uint8_t)DR_OP_NONE,
        .is_paused = c->state == DR_STATE_PAUSED,
        .is_locked = drive->is_locked,
        .is_relative = trio ? p->is_relative : drive->is_diagonal && SWITCH(p->inside_read, ROE_RELATIVE),
        .is_diagonal = drive->is_diagonal,
        .is_setting_angle = p->is_setting_angle,
        .has_along = trio || drive->is_diagonal,
        .speed = trio ? p->speed : active_drive(p)->mode,
        .angle = trio ? c->angle_deg : active_drive(p)->diagonal,
        .beeps = p->beeps,
    };
    out->screen = (uint8_t)screen(p, out);

    uint32_t at[DR_AXES];
    int32_t from_origin[DR_AXES];
    dr_controller_position(c, c->active, now, at);
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        from_origin[axis] = (int32_t)at[axis] - (int32_t)drive->origin_steps[axis];
        out->quanta[axis] = (out->is_relative ? from_origin[axis] : (int32_t)at[axis]) * q;
    }
    const bool counts_from_origin = drive->is_diagonal || out->is_relative;
    const int64_t x = counts_from_origin ? from_origin[DR_X] : (int32_t)at[DR_X];
    const int64_t z = counts_from_origin ? from_origin[DR_Z] : (int32_t)at[DR_Z];
    out->along_quanta = (int32_t)((x * along.cos + z * along.sin) * q / (int64_t)UNIT);
}
