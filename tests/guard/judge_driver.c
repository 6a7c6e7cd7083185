/* judge_driver: reads scenes as lines of integers from stdin, tells each verdict on a line of stdout. For oracle.py, which
 * says what the integers are. Exit 2: a line that is no scene. */
#include "dr_judge.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int64_t next(char **at)
{
    char *end;
    const int64_t value = strtoll(*at, &end, 10);
    if (end == *at) {
        (void)fprintf(stderr, "judge_driver: a number is missing before: %s\n", *at);
        exit(2);
    }
    *at = end;
    return value;
}

static void next_point(char **at, int32_t point[DR_AXES])
{
    for (int axis = 0; axis < 3; axis++)
        point[axis] = (int32_t)next(at);
}

static void read_obstacle(char **at, dr_obstacle *o)
{
    o->shape = (uint8_t)next(at);
    o->exit = (uint8_t)next(at);
    if (o->shape == DR_SHAPE_BOX) {
        next_point(at, o->box_q.min_q);
        next_point(at, o->box_q.max_q);
        return;
    }
    for (int axis = 0; axis < 3; axis++)
        o->half_q.normal[axis] = (int16_t)next(at);
    o->half_q.offset_q = next(at);
}

static void judge_line(char *at)
{
    dr_limits limits;
    dr_limits_problem problem;
    dr_scene scene;
    dr_command command;
    memset(&scene, 0, sizeof scene);
    dr_limits_init(&limits, (dr_kind)next(&at));
    dr_drive_limits *d = &limits.drives[0];
    if (!dr_limits_init_drive(&limits, 0, (dr_stage_id)next(&at)))
        exit(2);
    limits.rig = (uint16_t)next(&at);
    limits.margin_q = (int32_t)next(&at);
    limits.unstoppable_ms = (uint16_t)next(&at);
    next_point(&at, d->box_q.min_q);
    next_point(&at, d->box_q.max_q);
    d->max_move_q = (uint32_t)next(&at);
    d->fast_level = (uint8_t)next(&at);
    d->slow_level = (uint8_t)next(&at);
    d->retract = (uint8_t)next(&at);
    d->surface_q = (int32_t)next(&at);
    d->clearance_q = (uint32_t)next(&at);
    for (int axis = 0; axis < 3; axis++)
        d->approach[axis] = (int16_t)next(&at);
    limits.obstacle_count = (uint8_t)next(&at);
    for (uint8_t i = 0; i < limits.obstacle_count; i++)
        read_obstacle(&at, &limits.obstacles[i]);
    next_point(&at, (int32_t *)scene.start_steps);
    scene.angle_deg = (uint8_t)next(&at);
    scene.in_tissue = next(&at) != 0;
    scene.old[0].is_open = next(&at) != 0;
    next_point(&at, scene.old[0].target_q.min_q);
    scene.old[0].target_q =
        (dr_box){{scene.old[0].target_q.min_q[0], scene.old[0].target_q.min_q[1], scene.old[0].target_q.min_q[2]},
                 {scene.old[0].target_q.min_q[0], scene.old[0].target_q.min_q[1], scene.old[0].target_q.min_q[2]}};
    if (!dr_command_find((dr_kind)limits.kind, limits.firmware, (uint8_t)next(&at), &command))
        exit(2);
    dr_request request = {command.op, (uint8_t)next(&at), {0, 0, 0}};
    next_point(&at, (int32_t *)request.steps);
    if (!dr_limits_check(&limits, &problem)) {
        printf("bad %u %u\n", problem.error, problem.item);
        return;
    }
    dr_verdict verdict = dr_judge_frame(&limits, &command, &request);
    if (verdict.reason == DR_REASON_NONE)
        verdict = dr_judge_motion(&limits, &scene, &command, &request);
    printf("%u %u\n", verdict.reason, verdict.item);
}

int main(void)
{
    char line[8192];
    while (fgets(line, sizeof line, stdin) != NULL)
        judge_line(line);
    return 0;
}
