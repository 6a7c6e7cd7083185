/* driver: runs the core on scenarios that are read as text, and prints what came out and when. The other half is
 * oracle.py, which writes the scenarios and knows the answers from arithmetic of its own.
 *
 * One scenario, a word and its numbers a line (numbers are decimal unless said otherwise):
 *     controller trio|mpc          firmware HEX         quirks BITS          clock US (at the start)
 *     pace US (a byte on the line) angle DEG            calibrates 0|1       home X Y Z
 *     drive STAGE X Y Z DIAGONAL Y_MOVES_HOME [WORK_X WORK_Y WORK_Z]         one a port, in order
 *     start
 *     push AT HEX...               paused AT US         power AT 0|1         connect AT DRIVE STAGE
 *     place AT DRIVE X Y Z         where AT DRIVE       end AT
 * and for each: "AT HEX" for every byte, "where AT X Y Z", "poke AT 0|1", and at the end
 *     end STATE UNKNOWN LOST KEPT
 * Stages are dr_stage_id's names without DR_STAGE_. AT is in us since the start and never goes back. */
#include "sim.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *name;
    dr_stage_id id;
} stages[] = {
    {"NONE", DR_STAGE_NONE},
    {"TRIO_MP845", DR_STAGE_TRIO_MP845},
    {"TRIO_MP865", DR_STAGE_TRIO_MP865},
    {"TRIO_MP285", DR_STAGE_TRIO_MP285},
    {"TRIO_MP265", DR_STAGE_TRIO_MP265},
    {"MPC_MP225", DR_STAGE_MPC_MP225},
    {"MPC_MP285", DR_STAGE_MPC_MP285},
    {"MPC_MP265", DR_STAGE_MPC_MP265},
    {"MPC_MP845", DR_STAGE_MPC_MP845},
    {"MPC_MP865", DR_STAGE_MPC_MP865},
    {"MPC_MT800", DR_STAGE_MPC_MT800},
    {"MPC_MOM", DR_STAGE_MPC_MOM},
};

static dr_stage_id stage_named(const char *name)
{
    for (size_t i = 0; name != NULL && i < sizeof stages / sizeof stages[0]; i++) {
        if (strcmp(name, stages[i].name) == 0) {
            return stages[i].id;
        }
    }
    sim_die("no such stage");
    return DR_STAGE_NONE;
}

static char *word(void) { return strtok(NULL, " \n"); }

static uint64_t number(int base)
{
    const char *text = word();
    char *end = NULL;
    const uint64_t value = text == NULL ? 0 : strtoull(text, &end, base);
    if (text == NULL || *end != '\0') {
        sim_die("a number is missing");
    }
    return value;
}

static void point(uint32_t steps[DR_AXES])
{
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        steps[axis] = (uint32_t)number(10);
    }
}

static size_t printed;

static void print_new_bytes(const sim *s)
{
    for (; printed < s->count; printed++) {
        (void)printf("%" PRIu64 " %02x\n", s->out[printed].at_us, (unsigned)s->out[printed].byte);
    }
}

static void read_drive(sim *s, uint8_t index)
{
    if (index >= DR_PORTS) {
        sim_die("too many drives");
    }
    dr_drive *drive = &s->drives[index];
    dr_drive_init(drive, stage_named(word()));
    point(drive->position_steps);
    drive->diagonal = (uint8_t)number(10);
    drive->y_moves_home = number(10) != 0;
    const char *more = word();
    if (more != NULL) {
        drive->work_is_set = true;
        drive->work_steps[0] = (uint32_t)strtoul(more, NULL, 10);
        drive->work_steps[1] = (uint32_t)number(10);
        drive->work_steps[2] = (uint32_t)number(10);
    }
}

static void push(sim *s)
{
    static uint8_t bytes[65536];
    size_t count = 0;
    const char *text = word();
    for (; text != NULL && text[0] != '\0' && text[1] != '\0' && count < sizeof bytes; text += 2, count++) {
        const char pair[3] = {text[0], text[1], '\0'};
        bytes[count] = (uint8_t)strtoul(pair, NULL, 16);
    }
    sim_push(s, bytes, count);
}

static void act(sim *s, const char *what)
{
    sim_run_to(s, number(10));
    if (strcmp(what, "push") == 0) {
        push(s);
    } else if (strcmp(what, "paused") == 0) {
        dr_controller_paused(&s->c, (uint32_t)number(10));
    } else if (strcmp(what, "where") == 0) {
        uint32_t at[DR_AXES];
        const uint8_t drive = (uint8_t)number(10);
        print_new_bytes(s);
        dr_controller_position(&s->c, drive, sim_clock(s), at);
        (void)printf("where %" PRIu64 " %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", s->now_us, at[0], at[1], at[2]);
    } else if (strcmp(what, "end") == 0) {
        print_new_bytes(s);
        (void)printf("end %u %u %u %u\n", (unsigned)s->c.state, (unsigned)s->c.unknown_bytes, (unsigned)s->c.lost_bytes,
                     (unsigned)s->c.kept_commands);
        sim_free(s);
        return;
    } else {
        dr_hand hand;
        memset(&hand, 0, sizeof hand);
        if (strcmp(what, "power") == 0) {
            hand.what = number(10) != 0 ? DR_HAND_POWER_ON : DR_HAND_POWER_OFF;
        } else if (strcmp(what, "connect") == 0) {
            hand.what = DR_HAND_CONNECT;
            hand.drive = (uint8_t)number(10);
            hand.stage = (uint8_t)stage_named(word());
        } else if (strcmp(what, "place") == 0) {
            hand.what = DR_HAND_PLACE;
            hand.drive = (uint8_t)number(10);
            point(hand.steps);
        } else {
            sim_die("no such line in a scenario");
        }
        print_new_bytes(s);
        (void)printf("poke %" PRIu64 " %d\n", s->now_us, sim_poke(s, &hand) ? 1 : 0);
    }
    sim_pump(s);
}

int main(void)
{
    static char line[200000];
    static sim s;
    dr_us clock = 0;
    uint8_t drives = 0;
    while (fgets(line, sizeof line, stdin) != NULL) {
        const char *what = strtok(line, " \n");
        if (what == NULL) {
            continue;
        }
        if (strcmp(what, "controller") == 0) {
            const char *kind = word();
            sim_init(&s, kind != NULL && strcmp(kind, "trio") == 0 ? DR_TRIO : DR_MPC);
            drives = 0;
            printed = 0;
            clock = 0;
        } else if (strcmp(what, "firmware") == 0) {
            s.c.firmware = (uint16_t)number(16);
        } else if (strcmp(what, "quirks") == 0) {
            s.c.quirks = (uint16_t)number(10);
        } else if (strcmp(what, "clock") == 0) {
            clock = (dr_us)number(10);
        } else if (strcmp(what, "pace") == 0) {
            s.byte_us = (uint32_t)number(10);
        } else if (strcmp(what, "angle") == 0) {
            s.c.angle_deg = (uint8_t)number(10);
        } else if (strcmp(what, "calibrates") == 0) {
            s.c.calibrates_at_power_on = number(10) != 0;
        } else if (strcmp(what, "home") == 0) {
            point(s.c.home_steps);
        } else if (strcmp(what, "drive") == 0) {
            read_drive(&s, drives++);
        } else if (strcmp(what, "start") == 0) {
            sim_start(&s, clock);
        } else {
            act(&s, what);
        }
    }
    return 0;
}
