#include "print.h"

#include <cjson/cJSON.h>

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

static const char axes[] = "xyz";

/* -- JSON ---------------------------------------------------------------------------------------------------------- */

static cJSON *json_begin(const command_line *line, bool ok)
{
    cJSON *object = cJSON_CreateObject();
    (void)cJSON_AddStringToObject(object, "command", line->command->name);
    (void)cJSON_AddBoolToObject(object, "ok", ok);
    return object;
}

static void json_add_position(cJSON *object, const char *name, const dryrig_position *position)
{
    cJSON *item = cJSON_AddObjectToObject(object, name);
    cJSON *steps = cJSON_AddArrayToObject(item, "steps");
    for (int axis = 0; axis < DRYRIG_AXES; axis++)
        (void)cJSON_AddItemToArray(steps, cJSON_CreateNumber(position->steps[axis]));
    if (position->has_um)
        (void)cJSON_AddItemToObject(item, "um", cJSON_CreateDoubleArray(position->um, DRYRIG_AXES));
    if (position->drive > 0)
        (void)cJSON_AddNumberToObject(item, "drive", position->drive);
    if (position->angle_deg >= 0)
        (void)cJSON_AddNumberToObject(item, "angle_deg", position->angle_deg);
}

static void json_end(cJSON *object)
{
    char *text = cJSON_PrintUnformatted(object);
    (void)puts(text != NULL ? text : "{\"ok\":false,\"error\":\"memory\"}");
    cJSON_free(text);
    cJSON_Delete(object);
    (void)fflush(stdout);
}

/* -- People -------------------------------------------------------------------------------------------------------- */

static void print_coordinates(const command_line *line, const dryrig_position *position)
{
    const bool in_um = position->has_um && !line->steps;
    for (int axis = 0; axis < DRYRIG_AXES; axis++) {
        if (in_um)
            (void)printf("%s%c %.3f", axis > 0 ? "  " : "", axes[axis], position->um[axis]);
        else
            (void)printf("%s%c %" PRId32, axis > 0 ? "  " : "", axes[axis], position->steps[axis]);
    }
    (void)printf(in_um ? " um" : " steps");
    if (position->drive > 0)
        (void)printf("  drive %d", position->drive);
    if (position->angle_deg >= 0)
        (void)printf("  angle %d degrees", position->angle_deg);
    (void)putchar('\n');
    (void)fflush(stdout);
}

void print_position(const command_line *line, const dryrig_position *position)
{
    if (!line->json) {
        print_coordinates(line, position);
        return;
    }
    cJSON *object = json_begin(line, true);
    json_add_position(object, "position", position);
    json_end(object);
}

void print_streamed(const command_line *line, const dryrig_position *position)
{
    if (!line->json) {
        print_coordinates(line, position);
        return;
    }
    cJSON *object = cJSON_CreateObject();
    json_add_position(object, "streamed", position);
    json_end(object);
}

void print_done(const command_line *line)
{
    if (line->json)
        json_end(json_begin(line, true));
}

static void json_add_stage(cJSON *object, const dryrig_stage *stage)
{
    cJSON *item = cJSON_AddObjectToObject(object, "stage");
    (void)cJSON_AddStringToObject(item, "name", stage->name);
    (void)cJSON_AddNumberToObject(item, "um_per_step", stage->um_per_step);
    (void)cJSON_AddItemToObject(item, "travel_steps", cJSON_CreateIntArray(stage->travel_steps, DRYRIG_AXES));
    (void)cJSON_AddNumberToObject(item, "full_speed_um_per_s", stage->full_speed_um_per_s);
    (void)cJSON_AddNumberToObject(item, "line_um_per_s", stage->line_um_per_s);
}

static void json_info(const command_line *line, const dryrig_info *info, const dryrig_position *position,
                      const dryrig_stage *stage)
{
    char firmware[16];
    cJSON *object = json_begin(line, true);
    (void)cJSON_AddStringToObject(object, "controller", info->controller == DRYRIG_TRIO ? "trio" : "mpc");
    (void)cJSON_AddStringToObject(object, "port", line->open.port);
    if (info->firmware != 0) {
        (void)snprintf(firmware, sizeof firmware, "%x.%02x", info->firmware >> 8u, info->firmware & 0xFFu);
        (void)cJSON_AddStringToObject(object, "firmware", firmware);
        (void)cJSON_AddBoolToObject(object, "firmware_asked",
                                    info->controller == DRYRIG_MPC && line->open.firmware == 0);
    }
    if (info->controller == DRYRIG_MPC) {
        (void)cJSON_AddNumberToObject(object, "drive", info->drive);
        (void)cJSON_AddNumberToObject(object, "drives", info->drives);
        cJSON *connected = cJSON_AddArrayToObject(object, "connected");
        for (int i = 0; i < DRYRIG_DRIVES; i++)
            if (info->connected[i])
                (void)cJSON_AddItemToArray(connected, cJSON_CreateNumber(i + 1));
    }
    if (stage != NULL)
        json_add_stage(object, stage);
    json_add_position(object, "position", position);
    json_end(object);
}

void print_info(const command_line *line, const dryrig_info *info, const dryrig_position *position)
{
    dryrig_stage stage;
    const bool is_mpc = info->controller == DRYRIG_MPC;
    const char *model = line->open.stage[is_mpc && info->drive > 0 ? info->drive - 1 : 0];
    const bool has_stage = model != NULL && dryrig_get_stage(info->controller, model, &stage) == DRYRIG_OK;
    if (line->json) {
        json_info(line, info, position, has_stage ? &stage : NULL);
        return;
    }
    (void)printf("controller  %s at %s, %u baud\n", is_mpc ? "MPC-200" : "TRIO MP-245A", line->open.port,
                 line->open.baud);
    if (info->firmware == 0)
        (void)puts("firmware    below 3.00 (it does not tell more)");
    else
        (void)printf("firmware    %x.%02x%s\n", info->firmware >> 8u, info->firmware & 0xFFu,
                     is_mpc && line->open.firmware == 0 ? ""
                     : line->open.firmware != 0         ? " (as given)"
                                                        : " (assumed: a TRIO does not tell)");
    if (is_mpc) {
        (void)printf("drives      %d connected", info->drives);
        for (int i = 0, listed = 0; i < DRYRIG_DRIVES; i++)
            if (info->connected[i])
                (void)printf("%s%d", listed++ == 0 ? ": " : ", ", i + 1);
        (void)printf("; %d is active\n", info->drive);
    }
    if (has_stage)
        (void)printf(
            "stage       %s: %g um a step, travel %.10g x %.10g x %.10g um, full speed %g um/s, lines %g to %g um/s\n",
            stage.name, stage.um_per_step, stage.travel_steps[0] * stage.um_per_step,
            stage.travel_steps[1] * stage.um_per_step, stage.travel_steps[2] * stage.um_per_step,
            stage.full_speed_um_per_s, stage.line_um_per_s, stage.line_um_per_s * DRYRIG_SPEEDS);
    (void)printf("position    ");
    print_coordinates(line, position);
}

static const char *fault_name(dryrig_fault fault)
{
    switch (fault) {
    case DRYRIG_FAULT_NONE:
        break;
    case DRYRIG_FAULT_CALLER:
        return "caller";
    case DRYRIG_FAULT_COMPUTER:
        return "computer";
    case DRYRIG_FAULT_CONTROLLER:
        return "controller";
    case DRYRIG_FAULT_PERSON:
        return "person";
    }
    return "none";
}

void print_error(const command_line *line, int error, const char *why, const dryrig_position *position)
{
    (void)fprintf(stderr, "dryrig: %s\n", why[0] != '\0' ? why : dryrig_strerror(error));
    if (line->json) {
        cJSON *object = json_begin(line, false);
        (void)cJSON_AddStringToObject(object, "error", dryrig_error_name(error));
        (void)cJSON_AddStringToObject(object, "fault", fault_name(dryrig_fault_of(error)));
        (void)cJSON_AddStringToObject(object, "message", why[0] != '\0' ? why : dryrig_strerror(error));
        if (position != NULL)
            json_add_position(object, "position", position);
        json_end(object);
    } else if (position != NULL)
        print_coordinates(line, position);
}

/* -- Ports --------------------------------------------------------------------------------------------------------- */

static void add_port(void *context, const char *path, const char *description)
{
    cJSON *ports = context;
    cJSON *port = cJSON_CreateObject();
    (void)cJSON_AddStringToObject(port, "path", path);
    (void)cJSON_AddStringToObject(port, "description", description);
    (void)cJSON_AddItemToArray(ports, port);
}

int print_ports(const command_line *line)
{
    cJSON *object = json_begin(line, true);
    cJSON *ports = cJSON_AddArrayToObject(object, "ports");
    const int result = dryrig_list_ports(add_port, ports);
    if (result != DRYRIG_OK)
        print_error(line, result, "", NULL);
    else if (line->json) {
        json_end(object);
        return EXIT_DONE;
    }
    const cJSON *port;
    cJSON_ArrayForEach(port, ports)(void) printf("%s  %s\n", cJSON_GetStringValue(cJSON_GetObjectItem(port, "path")),
                                                 cJSON_GetStringValue(cJSON_GetObjectItem(port, "description")));
    if (result == DRYRIG_OK && cJSON_GetArraySize(ports) == 0)
        (void)fputs("dryrig: this machine has no serial ports now (PTYs, as the emulator's, are not listed)\n", stderr);
    cJSON_Delete(object);
    return result == DRYRIG_OK ? EXIT_DONE : EXIT_LINK;
}
