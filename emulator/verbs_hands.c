/* Verbs for hands: what a person does at the controls of a controller, and what its display shows (dr_panel.h). */
#include "language.h"

#include "dr_words.h" /* names */

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#define PRESS_US UINT64_C(100000) /* how long `press` holds a button down: an ordinary press (chosen) */
#define DETENTS_MAX 30000u
#define BIT(number) (1u << (number))
#define TRIO BIT(DR_TRIO)
#define MPC BIT(DR_MPC)
#define DEGREES_PER_RADIAN 57.29577951308232

/* A control by the name that people write: the first name for a control is the one that is told. */
typedef struct {
    const char *name;
    unsigned kinds; /* of controllers that have it */
    int control;
} control_name;

static const control_name buttons[] = {{"home", TRIO | MPC, DR_BUTTON_HOME},  {"work", TRIO | MPC, DR_BUTTON_WORK},
                                       {"pulse", TRIO, DR_BUTTON_PULSE},      {"relative", TRIO, DR_BUTTON_RELATIVE},
                                       {"speed", TRIO, DR_BUTTON_SPEED},      {"stop", MPC, DR_BUTTON_STOP},
                                       {"diagonal", MPC, DR_BUTTON_DIAGONAL}, {"calibrate", MPC, DR_BUTTON_CALIBRATE},
                                       {"angle", TRIO, DR_BUTTON_PULSE}, /* as the same buttons are also labelled */
                                       {"lock", TRIO, DR_BUTTON_SPEED},       {"set", MPC, DR_BUTTON_STOP},
                                       {"center", MPC, DR_BUTTON_CALIBRATE},  {"norm", MPC, DR_BUTTON_DIAGONAL},
                                       {"diag", MPC, DR_BUTTON_DIAGONAL},     {NULL, 0, 0}};
static const control_name knobs[] = {{"x", TRIO | MPC, DR_KNOB_X},
                                     {"y", TRIO | MPC, DR_KNOB_Y},
                                     {"z", TRIO | MPC, DR_KNOB_Z},
                                     {"d", TRIO, DR_KNOB_D},
                                     {"manipulator", MPC, DR_KNOB_MANIPULATOR},
                                     {"mode", MPC, DR_KNOB_MODE},
                                     {NULL, 0, 0}};
static const control_name banks[] = {{"rear", TRIO | MPC, DR_SWITCHES_REAR},
                                     {"internal", TRIO, DR_SWITCHES_INTERNAL},
                                     {"roe", MPC, DR_SWITCHES_ROE},
                                     {"right", MPC, DR_SWITCHES_RIGHT},
                                     {NULL, 0, 0}};

static instrument *ins_of(const telling *t) { return &t->s->ins; }
static dr_kind kind_of(const telling *t) { return (dr_kind)t->s->ins.controller.kind; }

/* The control of this controller that a word names; NULL: none. */
static const control_name *find_control(const telling *t, const control_name *names, const char *word)
{
    for (const control_name *n = names; word != NULL && n->name != NULL; n++)
        if ((n->kinds & BIT(kind_of(t))) != 0 && strcasecmp(word, n->name) == 0)
            return n;
    return NULL;
}

/* The next word as a control of this controller. */
static bool read_control(telling *t, const control_name *names, int *control, const char **name)
{
    const char *const word = telling_next(t);
    const control_name *const found = find_control(t, names, word);
    if (found != NULL) {
        *control = found->control;
        *name = found->name;
        return true;
    }
    char why[WHY_ROOM] = "expected one of ";
    const size_t begun = strlen(why);
    size_t length = begun;
    for (const control_name *n = names; n->name != NULL; n++)
        if ((n->kinds & BIT(kind_of(t))) != 0 && length < sizeof why)
            length += (size_t)snprintf(why + length, sizeof why - length, "%s%s", length > begun ? ", " : "", n->name);
    if (names == buttons && find_control(t, knobs, word) != NULL && length < sizeof why)
        (void)snprintf(why + length, sizeof why - length, "; it is turned: knob %s +1", word);
    if (names == knobs && find_control(t, buttons, word) != NULL && length < sizeof why)
        (void)snprintf(why + length, sizeof why - length, "; it is pressed: press %s", word);
    return telling_about(t, word, why);
}

static bool read_number(telling *t, unsigned least, unsigned most, unsigned *number)
{
    char why[WHY_ROOM];
    const char *const word = telling_word(t);
    return values_number(word, least, most, number, why) || telling_about(t, word, why);
}

/* -- Buttons, knobs, switches -------------------------------------------------------------------------------------------- */

/* A button that is down, and goes up by itself. */
typedef struct {
    planned base;
    station *s;
    dr_button button;
} pressed;

static void let_go(planned *what)
{
    pressed *const it = (pressed *)what;
    (void)dr_panel_release(&it->s->ins.panel, instrument_now(&it->s->ins), it->button);
    free(it);
}

void verbs_hands_close(engine *e)
{
    for (planned *p = e->plans, *next; p != NULL; p = next) {
        next = p->next;
        if (p->strike == let_go) {
            engine_unplan(e, p);
            free(p);
        }
    }
}

/* Goes down now, and up again when the controllers' clock has gone on so far. */
static bool hold_down(telling *t, int button, const char *name, uint64_t span_us)
{
    instrument *const ins = ins_of(t);
    if ((ins->panel.down & BIT(button)) != 0)
        return telling_wrong(t, "'%s' is down already; 'release %s' lets it go", name, name);
    pressed *const it = calloc(1, sizeof *it);
    if (it == NULL)
        return telling_wrong(t, "no memory");
    *it = (pressed){{.strike = let_go, .when_us = ins->now_us + span_us}, t->s, (dr_button)button};
    engine_plan(t->l->e, &it->base);
    (void)dr_panel_press(&ins->panel, instrument_now(ins), it->button);
    return true;
}

static bool do_press(telling *t)
{
    int button = 0;
    const char *name = "";
    return read_control(t, buttons, &button, &name) && telling_ends(t) && hold_down(t, button, name, PRESS_US);
}

static bool do_hold(telling *t)
{
    int button = 0;
    const char *name = "";
    uint64_t span_us;
    return read_control(t, buttons, &button, &name) && telling_time(t, &span_us) && telling_ends(t) &&
           hold_down(t, button, name, span_us);
}

/* Before it goes up by itself. */
static bool do_release(telling *t)
{
    int button = 0;
    const char *name = "";
    if (!read_control(t, buttons, &button, &name) || !telling_ends(t))
        return false;
    for (planned *p = t->l->e->plans; p != NULL; p = p->next)
        if (p->strike == let_go && ((pressed *)p)->s == t->s && ((pressed *)p)->button == (dr_button)button) {
            engine_unplan(t->l->e, p);
            let_go(p);
            return true;
        }
    return telling_wrong(t, "'%s' is not down", name);
}

static bool do_knob(telling *t)
{
    int knob = 0;
    const char *name = "";
    unsigned detents = 0;
    if (!read_control(t, knobs, &knob, &name))
        return false;
    char why[WHY_ROOM];
    const char *const word = telling_word(t);
    const bool is_back = word[0] == '-', is_signed = is_back || word[0] == '+';
    if (!values_number(word + (is_signed ? 1 : 0), 0, DETENTS_MAX, &detents, why)) {
        (void)snprintf(why, sizeof why, "expected a whole number of detents from -%u to %u", DETENTS_MAX, DETENTS_MAX);
        return telling_about(t, word, why);
    }
    if (!telling_ends(t))
        return false;
    (void)dr_panel_turn(&ins_of(t)->panel, instrument_now(ins_of(t)), (dr_knob)knob,
                        (int16_t)(is_back ? -(int)detents : (int)detents));
    return true;
}

/* How many there are of a bank at a drive (index). */
static unsigned switches_in(const telling *t, int bank)
{
    switch (bank) {
    case DR_SWITCHES_REAR:
        return kind_of(t) == DR_TRIO ? 6 : 8;
    case DR_SWITCHES_RIGHT:
        return 2;
    default:
        return 4;
    }
}

/* Whose switch it is: RIGHT TRAN 1 and 2 of an MPC-200 are those of its devices A and B [M table 4], 1 of each (dr_panel.h). */
static void find_switch(int bank, uint8_t *drive, uint8_t *number)
{
    if (bank != DR_SWITCHES_RIGHT)
        return;
    *drive = (uint8_t)(*drive / 2u * 2u + *number - 1u);
    *number = 1;
}

static bool do_switch(telling *t)
{
    int bank = 0;
    const char *name = "";
    instrument *const ins = ins_of(t);
    unsigned device = ins->controller.active + 1u, number = 0;
    if (!read_control(t, banks, &bank, &name))
        return false;
    const bool is_of_device = kind_of(t) == DR_MPC && bank != DR_SWITCHES_ROE;
    if (is_of_device && telling_take(t, "device") && !read_number(t, 1, ins->controller.drive_count, &device))
        return false;
    if (!read_number(t, 1, switches_in(t, bank), &number))
        return false;
    const bool on = telling_take(t, "on");
    if (!on && !telling_take(t, "off"))
        return telling_wrong(t, "expected on or off behind the number");
    uint8_t drive = (uint8_t)(device - 1u), found = (uint8_t)number;
    find_switch(bank, &drive, &found);
    return telling_ends(t) && (dr_panel_switch(&ins->panel, (dr_switches)bank, drive, found, on) ||
                               telling_wrong(t, "internal switch 2 follows the device that is connected"));
}

/* -- What a person sees -------------------------------------------------------------------------------------------------- */

static double um(int32_t quanta) { return (double)quanta / (double)DR_QUANTA_PER_UM; }

/* Off the horizontal. */
static int angle_deg(const telling *t, const dr_look *look)
{
    if (kind_of(t) == DR_TRIO)
        return look->angle;
    const dr_diagonal along = dr_diagonal_get(look->angle);
    return (int)lround(atan2((double)along.sin, (double)along.cos) * DEGREES_PER_RADIAN);
}

/* One word for what it does, as the display has it in its last line. */
static void name_status(const dr_look *look, char *out, size_t room)
{
    const char *const word = look->is_paused              ? "paused"
                             : look->moving != DR_OP_NONE ? dr_words_command((dr_op)look->moving)->name
                             : look->is_setting_angle     ? "set angle"
                             : look->is_locked            ? "lock"
                                                          : "";
    (void)snprintf(out, room, "%s", word);
    for (char *at = out; *at != '\0'; at++)
        *at = (char)toupper((unsigned char)*at);
}

/* Four lines: coordinates, and beside them what else there is to know. */
static void write_display(const telling *t, const dr_look *look, char *out, size_t room)
{
    char status[16], beside[DR_AXES][16];
    *out = '\0';
    if (look->screen == DR_SCREEN_DARK)
        return;
    if (look->drive == 0) {
        (void)snprintf(out, room, "NO MANIPULATOR\nCONNECTED");
        return;
    }
    name_status(look, status, sizeof status);
    if (kind_of(t) == DR_TRIO) {
        (void)snprintf(beside[0], sizeof beside[0], "%s", look->is_relative ? "RELATIVE" : "ABSOLUTE");
        (void)snprintf(beside[1], sizeof beside[1], "ANGLE %d", angle_deg(t, look));
        (void)snprintf(beside[2], sizeof beside[2], "SPEED %u", (unsigned)look->speed);
    } else {
        (void)snprintf(beside[0], sizeof beside[0], "DRIVE %u", (unsigned)look->drive);
        (void)snprintf(beside[1], sizeof beside[1], "MODE %u", (unsigned)look->speed);
        (void)snprintf(beside[2], sizeof beside[2], look->is_diagonal ? "DIAG %d" : "NORM", angle_deg(t, look));
    }
    size_t length = 0;
    for (unsigned axis = 0; axis < DR_AXES && length < room; axis++)
        length += (size_t)snprintf(out + length, room - length, "%c %9.2f  %s\n", "XYZ"[axis], um(look->quanta[axis]),
                                   beside[axis]);
    if (length >= room)
        return;
    if (look->has_along)
        (void)snprintf(out + length, room - length, "D %9.2f  %s", um(look->along_quanta), status);
    else
        (void)snprintf(out + length, room - length, "%11s  %s", "", status);
    for (size_t end = strlen(out); end > 0 && out[end - 1] == ' '; end--)
        out[end - 1] = '\0';
}

static void add_switches(const telling *t, cJSON *out)
{
    const instrument *const ins = ins_of(t);
    for (const control_name *n = banks; n->name != NULL; n++) {
        if ((n->kinds & BIT(kind_of(t))) == 0)
            continue;
        cJSON *const list = cJSON_AddArrayToObject(out, n->name);
        for (uint8_t i = 1; i <= switches_in(t, n->control); i++) {
            uint8_t drive = ins->controller.active, number = i;
            find_switch(n->control, &drive, &number);
            const bool is_on = dr_panel_switch_is_on(&ins->panel, (dr_switches)n->control, drive, number);
            (void)cJSON_AddItemToArray(list, cJSON_CreateBool(is_on));
        }
    }
}

static bool do_panel(telling *t)
{
    static const char *const screens[] = {"dark", "plain", "green", "blue", "red"};
    instrument *const ins = ins_of(t);
    cJSON *const out = t->answer;
    const bool is_trio = kind_of(t) == DR_TRIO;
    dr_look look;
    char text[256];
    if (!telling_ends(t))
        return false;
    dr_panel_look(&ins->panel, instrument_now(ins), &look);
    write_display(t, &look, text, sizeof text);
    (void)cJSON_AddStringToObject(out, "controller", dr_words_kind(kind_of(t)));
    (void)cJSON_AddStringToObject(out, "text", text);
    (void)cJSON_AddStringToObject(out, "screen", screens[look.screen]);
    (void)cJSON_AddNumberToObject(out, "device", look.drive);
    if (look.moving != DR_OP_NONE)
        (void)cJSON_AddStringToObject(out, "moving", dr_words_command((dr_op)look.moving)->name);
    else
        (void)cJSON_AddNullToObject(out, "moving");
    (void)cJSON_AddBoolToObject(out, "paused", look.is_paused);
    (void)cJSON_AddBoolToObject(out, "locked", look.is_locked);
    (void)cJSON_AddBoolToObject(out, "relative", look.is_relative);
    (void)cJSON_AddNumberToObject(out, "angle_deg", angle_deg(t, &look));
    (void)cJSON_AddNumberToObject(out, is_trio ? "speed" : "mode", look.speed);
    if (is_trio)
        (void)cJSON_AddBoolToObject(out, "setting_angle", look.is_setting_angle);
    cJSON *const shown = cJSON_AddObjectToObject(out, "shown_um");
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        (void)cJSON_AddNumberToObject(shown, (const char *const[]){"x", "y", "z"}[axis], um(look.quanta[axis]));
    if (look.has_along)
        (void)cJSON_AddNumberToObject(shown, "d", um(look.along_quanta));
    cJSON *const leds = cJSON_AddObjectToObject(out, "leds");
    if (!is_trio)
        (void)cJSON_AddBoolToObject(leds, "diagonal", look.is_diagonal);
    cJSON *const down = cJSON_AddArrayToObject(out, "down");
    unsigned told = 0; /* once, by its first name */
    for (const control_name *n = buttons; n->name != NULL; n++)
        if ((ins->panel.down & ~told & BIT(n->control)) != 0) {
            (void)cJSON_AddItemToArray(down, cJSON_CreateString(n->name));
            told |= BIT(n->control);
        }
    (void)cJSON_AddNumberToObject(out, "beeps", look.beeps);
    add_switches(t, cJSON_AddObjectToObject(out, "switches"));
    return true;
}

const verb verbs_hands[] = {
    {"press", "BUTTON", "press a button for 100 ms", true, do_press},
    {"hold", "BUTTON TIME", "hold a button down for TIME", true, do_hold},
    {"release", "BUTTON", "let a button go that is down", true, do_release},
    {"knob", "x|y|z|d|manipulator|mode [+|-]N", "turn a knob, or a selector, N detents; + is clockwise", true, do_knob},
    {"switch", "rear|internal|roe|right [device N] NUMBER on|off",
     "a DIP switch, as numbered on the box; the controller looks at it when it is switched on", true, do_switch},
    {"panel", "", "tell what the display and the lamps show, and how buttons and switches stand", true, do_panel},
    {NULL, NULL, NULL, false, NULL}};
