#include "hands.h"

#include "contacts.h"
#include "emulator.h"
#include "port.h"

#define KNOB_COUNT ((DR_PORT_INPUTS - DR_HANDS_KNOB_X) / 2u)
#define BUTTONS ((1u << DR_HANDS_KNOB_X) - 1u)
#define KNOBS (0xFFFFu - BUTTONS)
enum { OUTPUT_BUZZER = 1u << 0, OUTPUT_LED = 1u << 1 };

static dr_panel panel;
static dr_panel_drive drives[DR_PORTS];
static dr_contacts buttons;
static dr_encoder knobs[KNOB_COUNT];
static uint16_t seen; /* of the inputs, at the last look */
static bool has_due;  /* the panel has something to do by itself, */
static dr_us due;     /* at this instant */
static dr_us looked, beeped;
static uint8_t beeps; /* that were heard */
static uint8_t outputs;

const dr_panel *dr_hands_panel(void) { return &panel; }

static bool is_trio(void) { return panel.controller->kind == DR_TRIO; }

static void press(dr_us now, uint8_t input, bool down)
{
    if (input < DR_HANDS_MAINS) {
        const bool is_same = is_trio() || input < DR_HANDS_STOP;
        const dr_button button = (dr_button)(is_same ? input : input - DR_HANDS_STOP + DR_BUTTON_STOP);
        (void)(down ? dr_panel_press : dr_panel_release)(&panel, now, button);
    } else if (down && is_trio()) {
        dr_panel_power(&panel, now, panel.controller->state == DR_STATE_OFF);
    } else if (down) {
        (void)dr_panel_turn(&panel, now, DR_KNOB_MANIPULATOR, 1);
    }
}

/* Returns whether a hand has done anything. What an AVR does here a thousand times a second it does not have for a stream. */
static bool look(dr_us now)
{
    const uint16_t inputs = dr_port_inputs();
    const unsigned changed = dr_contacts_look(&buttons, inputs) & BUTTONS;
    const unsigned turned = (unsigned)(inputs ^ seen) & KNOBS;
    bool is_used = changed != 0;
    seen = inputs;
    for (uint8_t input = 0; changed != 0 && input < DR_HANDS_KNOB_X; input++)
        if ((changed >> input & 1u) != 0)
            press(now, input, ((unsigned)buttons.closed >> input & 1u) != 0);
    for (uint8_t i = 0; turned != 0 && i < KNOB_COUNT; i++) {
        const unsigned pair = (unsigned)inputs >> ((unsigned)DR_HANDS_KNOB_X + 2u * i);
        const int8_t detents = dr_encoder_look(&knobs[i], (pair & 1u) != 0, (pair & 2u) != 0);
        if (detents == 0)
            continue;
        (void)dr_panel_turn(&panel, now, (dr_knob)(is_trio() || i < DR_KNOB_D ? i : i + 1u), detents);
        is_used = true;
    }
    return is_used;
}

static void show(dr_us now)
{
    const dr_controller *c = panel.controller;
    uint8_t high = outputs & OUTPUT_BUZZER;
    if (panel.beeps != beeps) {
        beeps = panel.beeps;
        beeped = now;
        high = OUTPUT_BUZZER;
    } else if (now - beeped >= DR_BEEP_US) {
        high = 0;
    }
    const bool has_power = c->state != DR_STATE_OFF && c->state != DR_STATE_BOOTING;
    const dr_panel_drive *drive = &drives[c->active];
    if (has_power && (is_trio() ? c->state != DR_STATE_REST || drive->is_locked : drive->is_diagonal))
        high |= OUTPUT_LED;
    if (high != outputs)
        dr_port_outputs(high);
    outputs = high;
}

void dr_hands_begin(void)
{
    dr_panel_init(&panel, dr_emulator_prepare(), drives);
    dr_contacts_init(&buttons, dr_port_inputs()); /* what is pressed by now was not pressed with the power on */
    for (uint8_t i = 0; i < KNOB_COUNT; i++)
        knobs[i] = (dr_encoder){0, 0};
    looked = dr_port_now_us();
    beeps = panel.beeps;
    seen = 0;
    outputs = 0;
    has_due = false;
    dr_panel_power(&panel, looked, true);
}

void dr_hands_step(void)
{
    const dr_us now = dr_port_now_us();
    bool is_used = has_due && !dr_us_before(now, due);
    if (is_used)
        dr_panel_settle(&panel, now);
    if (now - looked >= DR_LOOK_US) {
        looked = now;
        is_used = look(now) || is_used;
        show(now);
    }
    if (is_used) {
        has_due = dr_panel_due(&panel, &due);
        dr_emulator_touch(now);
    }
    dr_emulator_step_at(now, looked + DR_LOOK_US - now);
}
