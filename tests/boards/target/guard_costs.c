/* Says what the guard's calls cost at most on the machine it is built for, one line a call: "NAME WORK". An armed guard of a
 * TRIO with as many obstacles as there may be. */
#include "target.h"

#include "dr_guard.h"

#include <string.h>

#define RECORDS 16u

static dr_limits limits;
static dr_guard guard;
static dr_record records[RECORDS];
static dr_us now;
static uint32_t began;

static void begin(void) { began = target_work(); }

static void end(const char *name)
{
    const uint32_t work = (target_work() - began) & TARGET_WORK_MASK;
    target_say(name);
    target_put(' ');
    target_say_uint(work);
    target_put('\n');
}

static const uint8_t reply[] = {0x10, 0x27, 0, 0, 0x10, 0x27, 0, 0, 0x10, 0x27, 0, 0, 30, DR_CR};
static const uint8_t line[] = {'S', 0, 0x10, 0x37, 0, 0, 0x10, 0x37, 0, 0, 0x10, 0x37, 0, 0};

/* Its query leaves; what it is answered is here but for the last byte. */
static void almost_answer(dr_us after_us)
{
    uint8_t bytes[DR_FRAME_MAX];
    now += after_us;
    (void)dr_guard_pull_device(&guard, now, bytes, sizeof bytes);
    dr_guard_push_device(&guard, now, reply, sizeof reply - 1u);
}

static void answer(dr_us after_us)
{
    almost_answer(after_us);
    dr_guard_push_device(&guard, now, reply + sizeof reply - 1u, 1);
}

static void set_limits(void)
{
    dr_limits_init(&limits, DR_TRIO);
    (void)dr_limits_init_drive(&limits, 0, DR_STAGE_TRIO_MP845);
    limits.obstacle_count = DR_OBSTACLES_MAX;
    for (uint8_t i = 0; i < DR_OBSTACLES_MAX; i++) {
        dr_obstacle *const o = &limits.obstacles[i];
        o->shape = i % 2u == 0 ? DR_SHAPE_BOX : DR_SHAPE_HALF;
        for (uint8_t axis = 0; axis < DR_AXES; axis++) {
            o->box_q.min_q[axis] = INT32_C(1400000) + i;
            o->box_q.max_q[axis] = INT32_C(1500000);
            o->half_q.normal[axis] = (int16_t)(-100 * (axis + 1));
        }
        o->half_q.offset_q = -INT64_C(900000000);
    }
}

int target_main(void)
{
    uint8_t bytes[DR_FRAME_MAX];
    dr_guard_status status;
    set_limits();
    begin();
    dr_guard_init(&guard, &limits, records, RECORDS);
    end("guard-init");
    dr_guard_start(&guard, now, DR_START_POWER_ON);
    dr_guard_link(&guard, now, true, true);
    dr_guard_input(&guard, now, DR_INPUT_KEY, true);
    answer(DR_US_PER_S);
    dr_guard_input(&guard, now, DR_INPUT_ARM, true);
    answer(2000);
    answer(100000);
    begin();
    (void)dr_guard_pull_device(&guard, now, bytes, sizeof bytes);
    end("guard-pull-at-rest");
    begin();
    dr_guard_get_status(&guard, &status);
    end("guard-status-at-rest");
    dr_guard_push_host(&guard, now, line, sizeof line - 1u);
    begin();
    dr_guard_push_host(&guard, now, line + sizeof line - 1u, 1);
    end("guard-push-last-byte-of-S");
    almost_answer(2000);
    begin();
    dr_guard_push_device(&guard, now, reply + sizeof reply - 1u, 1);
    end("guard-judges-S-32-obstacles");
    now += 2000;
    begin();
    const size_t count = dr_guard_pull_device(&guard, now, bytes, sizeof bytes);
    end("guard-pull-frame");
    begin();
    (void)dr_guard_pull_device(&guard, now, bytes, sizeof bytes);
    end("guard-pull-seals");
    begin();
    (void)dr_guard_pull_device(&guard, now, bytes, sizeof bytes);
    end("guard-pull-moving");
    begin();
    dr_guard_get_status(&guard, &status);
    end("guard-status-moving");
    begin();
    dr_guard_push_host(&guard, now, (const uint8_t *)"\x03", 1);
    end("guard-push-interrupt-moving");
    begin();
    const size_t stops = dr_guard_pull_device(&guard, now, bytes, sizeof bytes);
    end("guard-pull-interrupt");
    return count == sizeof line && stops == 1 && bytes[0] == DR_INTERRUPT ? 0 : 1;
}
