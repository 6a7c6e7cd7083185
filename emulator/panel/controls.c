#include "controls.h"

#include <curses.h> /* keys */
#include <string.h>

const control_button *controls_buttons(dr_kind kind)
{
    static const control_button trio[] = {{'h', "HOME", "home", "set", "hold home 3s"},
                                          {'w', "WORK", "work", "set", "hold work 3s"},
                                          {'p', "PULSE (ANGLE)", "pulse", "angle", "hold pulse 3s"},
                                          {'r', "RELATIVE", "relative", "set 0", "hold relative 3s"},
                                          {'s', "SPEED (LOCK)", "speed", "lock", "hold speed 3s"},
                                          {0, NULL, NULL, NULL, NULL}};
    static const control_button mpc[] = {{'h', "HOME", "home", NULL, NULL},
                                         {'w', "WORK POS.", "work", "lock", "hold work 2s"},
                                         {'s', "STOP/SET", "stop", "set", "hold stop 1s\npress work"},
                                         {'d', "NORM/DIAG", "diagonal", NULL, NULL},
                                         {'c', "CENTER (CALIBRATE)", "calibrate", NULL, NULL},
                                         {0, NULL, NULL, NULL, NULL}};
    return kind == DR_TRIO ? trio : mpc;
}

const control_knob *controls_knobs(dr_kind kind)
{
    static const control_knob trio[] = {
        {KEY_RIGHT, "x", 1, false}, {KEY_LEFT, "x", -1, false}, {KEY_UP, "y", 1, false},
        {KEY_DOWN, "y", -1, false}, {KEY_NPAGE, "z", 1, false}, {KEY_PPAGE, "z", -1, false},
        {']', "d", 1, false},       {'[', "d", -1, false},      {0, NULL, 0, false}};
    static const control_knob mpc[] = {{KEY_RIGHT, "x", 1, false},
                                       {KEY_LEFT, "x", -1, false},
                                       {KEY_UP, "y", 1, false},
                                       {KEY_DOWN, "y", -1, false},
                                       {KEY_NPAGE, "z", 1, false},
                                       {KEY_PPAGE, "z", -1, false},
                                       {'m', "manipulator", 1, true},
                                       {'M', "manipulator", -1, true},
                                       {'+', "mode", 1, true},
                                       {'-', "mode", -1, true},
                                       {0, NULL, 0, false}};
    return kind == DR_TRIO ? trio : mpc;
}

const char *const *controls_help(dr_kind kind)
{
    static const char *const trio[] = {
        "The panel (ROE) of a TRIO. A small letter presses a button, its capital holds",
        "it for 3 seconds. The screen is green: it counts from the beginning of travel;",
        "blue: from a place of yours; red: it moves, or the knobs are locked.",
        "",
        " h HOME      goes home: X and Z, then Y. Again: pause, go on.  H: home is here",
        " w WORK      goes to the work position.  Again: pause, go on.  W: it is here",
        " p PULSE     one short step, 2.85 um, along the angle.",
        " P (ANGLE)   for 10 s knob D sets the angle.",
        " r RELATIVE  the screen counts from your origin, or not.  R: the origin is here",
        " s SPEED     how far a knob moves: 0 farthest, 3 finest.  S: lock the knobs",
        "",
        " arrows      knobs X and Y            PgDn PgUp   knob Z, down and up",
        " ] [         knob D: X and Z together along the angle",
        "",
        "First steps: h goes home. Turn the knobs; W stores the place as work position",
        "(hear the beep). Turn on, press w: it comes back.",
        "",
        "What a host gets that asks with c stands above the log: microsteps from the",
        "beginning of travel, whatever the screen counts from, low byte first, then the",
        "angle and a CR. During a move it waits for the end of the move.",
        NULL};
    static const char *const mpc[] = {"The panel (ROE-200) of an MPC-200. A small letter presses a button.",
                                      "",
                                      " h HOME      goes to 0,0,0, first back along the diagonal",
                                      " w WORK POS. goes to the work position: from home only.   W (2 s): lock, unlock",
                                      " s STOP/SET  stops every move.   S (with WORK POS.): the work position is here",
                                      " d NORM/DIAG knob Z moves along the diagonal; the display counts from there",
                                      " c CENTER    calibrates (up to firmware 1.03: goes to the centre of travel)",
                                      " m M         MANIPULATOR: the next device that is connected, the one before",
                                      " + -         MODE: 0 goes farther when turned fast, 1 far .. 9 finest",
                                      "",
                                      " arrows      knobs X and Y            PgDn PgUp   knob Z, down and up",
                                      "",
                                      "First steps: h goes home. Turn the knobs; S stores the place as work position",
                                      "(hear the beep). h goes home again, and from there w to the work position.",
                                      "",
                                      "What a host gets that asks with C stands above the log: the active device,",
                                      "then microsteps from the beginning of travel, low byte first, then a CR. The",
                                      "display counts otherwise in diagonal mode; the wire never does. During a move",
                                      "the answer waits for the end of the move.",
                                      NULL};
    return kind == DR_TRIO ? trio : mpc;
}

static bool is_any(const char *name, const char *first, const char *second)
{
    return strcmp(name, first) == 0 || strcmp(name, second) == 0;
}

static const char *hint_moving(const model *m, const char *name, control_use use)
{
    if (m->kind == DR_MPC)
        return strcmp(name, "stop") == 0 ? NULL : "it moves: only STOP works until it is there";
    if (use == CONTROL_TURNED)
        return "it moves: the knobs are dead until it is there";
    return use == CONTROL_PRESSED && is_any(name, "home", "work")
               ? NULL
               : "it moves: only the button of this move works, and pauses it";
}

static const char *hint_locked(const model *m, const char *name, control_use use)
{
    if (m->kind == DR_TRIO)
        return use == CONTROL_TURNED ? "the knobs are locked: S unlocks them" : NULL;
    const bool unlocks = strcmp(name, "work") == 0 && use == CONTROL_HELD;
    const bool stops = strcmp(name, "stop") == 0 && use == CONTROL_PRESSED;
    return unlocks || stops || strcmp(name, "manipulator") == 0 ? NULL : "this drive is locked: W unlocks it";
}

const char *controls_hint(const model *m, const char *name, control_use use)
{
    unsigned connected = 0;
    for (unsigned i = 0; i < m->device_count; i++)
        connected += m->devices[i].is_there;
    if (strcmp(m->state, "off") == 0)
        return "it has no power: o switches it on";
    if (strcmp(m->state, "wedged") == 0)
        return "it hangs: switch it off and on again, with o";
    if (connected == 0)
        return "nothing is connected: all controls are dead";
    const char *hint = m->moves ? hint_moving(m, name, use) : m->is_locked ? hint_locked(m, name, use) : NULL;
    if (hint == NULL && !m->moves && strcmp(name, "manipulator") == 0 && connected == 1)
        hint = "no other device is connected";
    if (hint == NULL && !m->moves && strcmp(name, "work") == 0 && use == CONTROL_PRESSED &&
        !model_active(m)->work_is_set)
        hint = m->kind == DR_TRIO ? "no work position is stored yet: W stores this place"
                                  : "no work position is stored yet: S stores this place";
    return hint;
}
