#include "hands.h"

#include "contacts.h"
#include "emulator.h"
#include "port.h"

enum { KNOBS = (DR_PORT_INPUTS - DR_INPUT_KNOB_X) / 2 };
enum { OUTPUT_BUZZER = 1u << 0, OUTPUT_LED = 1u << 1 };

static dr_panel panel;
static dr_panel_drive drives[DR_PORTS];
static dr_contacts buttons;
static dr_encoder knobs[KNOBS];
static dr_us looked, beeped;
static uint8_t beeps; /* that were heard */
static uint8_t outputs;

const dr_panel *dr_hands_panel(void) { return &panel; }

static bool is_trio(void) { return panel.controller->kind == DR_TRIO; }

static void press(dr_us now, uint8_t input, bool down)
{
    if (input < DR_INPUT_MAINS) {
        const bool is_same = is_trio() || input < DR_INPUT_STOP;
        const dr_button button = (dr_button)(is_same ? input : input - DR_INPUT_STOP + DR_BUTTON_STOP);
        (void)(down ? dr_panel_press : dr_panel_release)(&panel, now, button);
    } else if (down && is_trio()) {
        dr_panel_power(&panel, now, panel.controller->state == DR_STATE_OFF);
    } else if (down) {
        (void)dr_panel_turn(&panel, now, DR_KNOB_MANIPULATOR, 1);
    }
}

static void look(dr_us now)
{
    const uint16_t inputs = dr_port_inputs();
    const uint16_t changed = dr_contacts_look(&buttons, inputs);
    bool is_used = false;
    for (uint8_t input = 0; input < DR_INPUT_KNOB_X; input++)
        if ((changed >> input & 1u) != 0) {
            press(now, input, (buttons.closed >> input & 1u) != 0);
            is_used = true;
        }
    for (uint8_t i = 0; i < KNOBS; i++) {
        const unsigned pair = (unsigned)inputs >> (DR_INPUT_KNOB_X + 2u * i);
        const int8_t detents = dr_encoder_look(&knobs[i], (pair & 1u) != 0, (pair & 2u) != 0);
        if (detents == 0)
            continue;
        (void)dr_panel_turn(&panel, now, (dr_knob)(is_trio() || i < DR_KNOB_D ? i : i + 1u), detents);
        is_used = true;
    }
    if (is_used || panel.beeps != beeps) /* a hold acts, and beeps, while nothing changes */
        dr_emulator_touch(now);
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
    dr_controller *c = dr_emulator_prepare();
    dr_panel_init(&panel, c, drives);
    const uint16_t inputs = dr_port_inputs();
    dr_contacts_init(&buttons, inputs); /* what is pressed by now was not pressed with the power on */
    for (uint8_t i = 0; i < KNOBS; i++)
        knobs[i] = (dr_encoder){0, 0};
    looked = dr_port_now_us();
    beeps = panel.beeps;
    outputs = 0;
    dr_panel_power(&panel, looked, true);
}

void dr_hands_step(void)
{
    const dr_us now = dr_port_now_us();
    dr_panel_settle(&panel, now);
    if (now - looked >= DR_LOOK_US) {
        looked = now;
        look(now);
        show(now);
    }
    dr_emulator_loop(now, true, looked + DR_LOOK_US);
}
