/* dr_panel: hands. What a person does at the TRIO ROE, or at the ROE-200 and the switches of an MPC-200, becomes what the
 * controller does; and what the display shows. A module of its own: a board without hands does not link it.
 *
 *     press, release    buttons              settle   the rest of what was due: a hold that has become long enough
 *     turn              knobs, selectors     due      when something will happen by itself
 *     switch, power     take effect at power-up       look     what a person sees
 *
 * The contract is the controller's: time is an argument that never goes back, nothing blocks, calls out, allocates or asks
 * a clock, and the caller owns every struct. Every call first settles what was due by `now`, in order of time, in the
 * controller too. So, where there is a panel: call dr_panel_settle() before each call of the controller itself, and sleep
 * until the earlier of dr_panel_due() and dr_controller_due().
 *
 * A control acts on what it finds at the instant it acts: a button that is held when a move ends stores the place.
 * While the controller moves, is paused, hangs or is off, every control is dead but for these: HOME and WORK of a TRIO
 * pause and resume their own move, STOP of an MPC-200 stops any. A press that began without power does nothing.
 *
 * Thread-safety: one thread at a time per panel and its controller. Sources: [T page 1], [M page 1], [O], [P "Hand
 * controls"], which also lists every number that nobody gives ("chosen"). */
#ifndef DR_PANEL_H
#define DR_PANEL_H

#include "dr_controller.h"

#ifdef __cplusplus
extern "C" {
#endif

/* -- The numbers of the panels --------------------------------------------------------------------------------------- */

#define DR_HOLD_TRIO_US UINT32_C(3000000)      /* a button held so long does its second task [T page 1] */
#define DR_HOLD_LOCK_US UINT32_C(2000000)      /* WORK POS. held so long locks and unlocks [M page 1] */
#define DR_ANGLE_SETTING_US UINT32_C(10000000) /* knob D sets the angle for so long [T page 1] */
#define DR_ANGLE_KNOB_FIRST_DEG 1u             /* what knob D can set [T page 1] */
#define DR_ANGLE_KNOB_LAST_DEG 89u

/* Chosen, where the manuals give no number; reasons in [P].
 * TRIO: a detent moves 64, 16, 4 or 1 microsteps at SPEED 0, 1, 2, 3. MPC-200: 256, 128 .. 1 in mode 1, 2 .. 9. Mode 0, and
 * a TRIO with non-linear knobs, doubles its step (64; that of SPEED) when the detents follow each other faster than the
 * first of these, again at the second and at the third. The detents of one call count as evenly spread since the last. */
#define DR_KNOB_TRIO_STEPS 64u
#define DR_KNOB_MPC_STEPS 256u
#define DR_KNOB_MPC_MODE_0_STEPS 64u
#define DR_KNOB_FAST_US 20000u
#define DR_KNOB_FASTER_US 10000u
#define DR_KNOB_FASTEST_US 5000u
#define DR_KNOB_REST_US UINT32_C(100000) /* after so long without a detent the knob begins slowly again */

/* A pulse of the TRIO [T page 1], and an impulse of an MPC-200's mode 9 (chosen: the same). In hundredths of a quantum:
 * 2.85 um. */
#define DR_PULSE_QUANTA_100 18240u

/* -- Controls -------------------------------------------------------------------------------------------------------- */

typedef enum {
    DR_BUTTON_HOME,      /* both */
    DR_BUTTON_WORK,      /* TRIO: WORK; MPC: WORK POS. */
    DR_BUTTON_PULSE,     /* TRIO: PULSE (ANGLE) */
    DR_BUTTON_RELATIVE,  /* TRIO */
    DR_BUTTON_SPEED,     /* TRIO: SPEED (LOCK) */
    DR_BUTTON_STOP,      /* MPC: STOP/SET */
    DR_BUTTON_DIAGONAL,  /* MPC: NORM/DIAG */
    DR_BUTTON_CALIBRATE, /* MPC: CENTER (CALIBRATE) */
    DR_BUTTONS
} dr_button;

#define DR_HOLD_BUTTONS 5u /* the first ones can be held */

typedef enum {
    DR_KNOB_X, /* the first three as DR_X, DR_Y, DR_Z */
    DR_KNOB_Y,
    DR_KNOB_Z,
    DR_KNOB_D,           /* TRIO: along the angle */
    DR_KNOB_MANIPULATOR, /* MPC: the selectors of the ROE-200; a detent is one click */
    DR_KNOB_MODE,
    DR_KNOBS
} dr_knob;

/* DIP switches, numbered from 1 as printed. */
typedef enum {
    DR_SWITCHES_REAR,     /* TRIO: external 1-6 [T table 1]; MPC-200: 1-8 of each drive [M tables 2 and 3] */
    DR_SWITCHES_INTERNAL, /* TRIO: 1-4 [T table 2] */
    DR_SWITCHES_ROE,      /* ROE-200: 1-4 [M table 1] */
    DR_SWITCHES_RIGHT     /* MPC-200: RIGHT TRAN, number 1, of each drive: state only [M table 4] */
} dr_switches;

/* -- The panel ------------------------------------------------------------------------------------------------------- */

/* What a panel keeps of one drive. */
typedef struct {
    uint32_t origin_steps[DR_AXES]; /* relative coordinates count from here */
    uint16_t part[2];               /* where X and Z stand within their microstep after turns along the diagonal, in
                                      * 1/32768 from its lower edge; so that turning back comes back */
    uint8_t rear;                   /* switches as they stand, bit 0 is switch 1 */
    uint8_t rear_read;              /* and as they stood at power-up */
    bool is_locked;
    bool is_diagonal; /* MPC */
    uint8_t right;    /* MPC: RIGHT TRAN, bit 0 */
} dr_panel_drive;

typedef struct {
    dr_controller *controller;
    dr_panel_drive *drives;            /* as many as the controller has */
    dr_us pressed_at[DR_HOLD_BUTTONS]; /* of buttons that are down and have not acted */
    dr_us angle_setting_ends;
    dr_us turned_at;
    uint8_t turned;        /* the accelerated knob that was turned just now; DR_KNOBS: none */
    uint8_t down;          /* buttons, by bit */
    uint8_t acted;         /* those whose release does nothing any more */
    uint8_t inside;        /* the TRIO's internal switches, the ROE-200's, as they stand */
    uint8_t inside_read;   /* and as they stood at power-up */
    uint8_t speed;         /* TRIO: SPEED 0..3 */
    bool is_relative;      /* TRIO */
    bool is_setting_angle; /* TRIO */
    uint8_t beeps;         /* how often it has beeped; wraps */
} dr_panel;

/* The panel of a controller that is set up: switches stand where the controller's settings say, or as the factory does.
 * `drives` has room for the controller's. */
void dr_panel_init(dr_panel *p, dr_controller *controller, dr_panel_drive *drives);

/* False: this panel has no such control. That a control is dead at the moment is no error. */
bool dr_panel_press(dr_panel *p, dr_us now, dr_button button);
bool dr_panel_release(dr_panel *p, dr_us now, dr_button button);
bool dr_panel_turn(dr_panel *p, dr_us now, dr_knob knob, int16_t detents); /* clockwise is positive */

/* False: no such switch; or internal switch 2 of a TRIO against the stage that is connected, which it follows [P].
 * `drive` (index) counts where each drive has its own. */
bool dr_panel_switch(dr_panel *p, dr_switches bank, uint8_t drive, uint8_t number, bool on);
/* How a switch stands. False as well where there is none. */
bool dr_panel_switch_is_on(const dr_panel *p, dr_switches bank, uint8_t drive, uint8_t number);
/* The mains switch. Where there is a panel, power goes through here, so that the switches are read. */
void dr_panel_power(dr_panel *p, dr_us now, bool on);
/* Reads the switches as power-up does: for an owner that has set them before a controller's start. */
void dr_panel_read_switches(dr_panel *p);

void dr_panel_settle(dr_panel *p, dr_us now);
bool dr_panel_due(const dr_panel *p, dr_us *when);

/* -- What a person sees ---------------------------------------------------------------------------------------------- */

typedef enum {
    DR_SCREEN_DARK,  /* no power, or not ready yet */
    DR_SCREEN_PLAIN, /* ROE-200 */
    DR_SCREEN_GREEN, /* TRIO: absolute [T page 1] */
    DR_SCREEN_BLUE,  /* TRIO: relative */
    DR_SCREEN_RED    /* TRIO: it moves, or LOCK */
} dr_screen;

typedef struct {
    uint8_t screen; /* dr_screen */
    uint8_t drive;  /* number, from 1; 0: NO MANIPULATOR CONNECTED [M table 9] */
    uint8_t moving; /* dr_op of the move under way, DR_OP_NONE at rest */
    bool is_paused;
    bool is_locked;
    bool is_relative; /* the coordinates are */
    bool is_diagonal; /* the LED of NORM/DIAG */
    bool is_setting_angle;
    bool has_along; /* the fourth coordinate is shown: always on a TRIO, in diagonal mode on a ROE-200 */
    uint8_t speed;  /* TRIO: SPEED; ROE-200: mode */
    uint8_t angle;  /* TRIO: degrees; ROE-200: the diagonal as a number 0..15 */
    uint8_t beeps;  /* how often it has beeped; wraps */
    int32_t quanta[DR_AXES];
    int32_t along_quanta; /* the way along the diagonal that X and Z amount to (chosen) */
} dr_look;

void dr_panel_look(dr_panel *p, dr_us now, dr_look *out);

#ifdef __cplusplus
}
#endif
#endif
