#include "dr_limits.h"

#include <string.h>

/* -- CRC-32C: a byte at a time, from what its two nibbles do: 32 words of table, and no shift but by whole bytes --------- */

uint32_t dr_crc32c(uint32_t crc, const uint8_t *bytes, size_t count)
{
    static const uint32_t of_low[16] = {
        0x00000000u, 0xF26B8303u, 0xE13B70F7u, 0x1350F3F4u, 0xC79A971Fu, 0x35F1141Cu, 0x26A1E7E8u, 0xD4CA64EBu,
        0x8AD958CFu, 0x78B2DBCCu, 0x6BE22838u, 0x9989AB3Bu, 0x4D43CFD0u, 0xBF284CD3u, 0xAC78BF27u, 0x5E133C24u,
    };
    static const uint32_t of_high[16] = {
        0x00000000u, 0x105EC76Fu, 0x20BD8EDEu, 0x30E349B1u, 0x417B1DBCu, 0x5125DAD3u, 0x61C69362u, 0x7198540Du,
        0x82F63B78u, 0x92A8FC17u, 0xA24BB5A6u, 0xB21572C9u, 0xC38D26C4u, 0xD3D3E1ABu, 0xE330A81Au, 0xF36E6F75u,
    };
    crc = ~crc;
    for (size_t i = 0; i < count; i++) {
        const uint8_t byte = (uint8_t)(crc ^ bytes[i]);
        crc = crc >> 8 ^ of_low[byte & 15u] ^ of_high[byte >> 4];
    }
    return ~crc;
}

/* -- The layout of the image, written once ------------------------------------------------------------------------------ */

/* Offset in the struct, bytes of one value, how many values running. */
typedef struct {
    uint8_t offset, size, count;
} field;

#define VALUE(type, name)                                                                                              \
    {                                                                                                                  \
        offsetof(type, name), sizeof(((type *)0)->name), 1                                                             \
    }
#define VALUES(type, name)                                                                                             \
    {                                                                                                                  \
        offsetof(type, name), sizeof(((type *)0)->name[0]), sizeof(((type *)0)->name) / sizeof(((type *)0)->name[0])   \
    }
#define FIELDS(table) (sizeof(table) / sizeof(table)[0])

static const field head_fields[] = {
    VALUE(dr_limits, kind),          VALUE(dr_limits, obstacle_count), VALUE(dr_limits, refusal),
    VALUE(dr_limits, host_loss),     VALUE(dr_limits, firmware),       VALUE(dr_limits, rig),
    VALUE(dr_limits, revision),      VALUES(dr_limits, serial),        VALUE(dr_limits, angle_min_deg),
    VALUE(dr_limits, angle_max_deg), VALUE(dr_limits, mode_min),       VALUE(dr_limits, unstoppable_ms),
    VALUE(dr_limits, arm_idle_s),    VALUE(dr_limits, margin_q),       VALUE(dr_limits, knob_q_per_s),
    VALUE(dr_limits, beyond_zero_q),
};
static const field drive_fields[] = {
    VALUE(dr_drive_limits, stage),      VALUE(dr_drive_limits, fast_level),   VALUE(dr_drive_limits, slow_level),
    VALUE(dr_drive_limits, retract),    VALUES(dr_drive_limits, box_q.min_q), VALUES(dr_drive_limits, box_q.max_q),
    VALUE(dr_drive_limits, max_move_q), VALUE(dr_drive_limits, surface_q),    VALUE(dr_drive_limits, clearance_q),
    VALUES(dr_drive_limits, approach),
};
static const field obstacle_fields[] = {
    VALUE(dr_obstacle, shape),          VALUE(dr_obstacle, drive),        VALUE(dr_obstacle, exit),
    VALUES(dr_obstacle, box_q.min_q),   VALUES(dr_obstacle, box_q.max_q), VALUE(dr_obstacle, half_q.offset_q),
    VALUES(dr_obstacle, half_q.normal),
};

static const uint8_t image_head[] = {'D', 'R', 'L', 'M', DR_LIMITS_VERSION_NOW, 0, 0, 0};
#define CRC_BYTES 4u
#define BODY_AT sizeof image_head
#define CRC_AT (DR_LIMITS_IMAGE_BYTES - CRC_BYTES)

static uint64_t load(const uint8_t *from, uint8_t size)
{
    uint16_t two;
    uint32_t four;
    uint64_t eight;
    switch (size) {
    case 1:
        return *from;
    case 2:
        memcpy(&two, from, sizeof two);
        return two;
    case 4:
        memcpy(&four, from, sizeof four);
        return four;
    default:
        memcpy(&eight, from, sizeof eight);
        return eight;
    }
}

static void store(uint8_t *to, uint8_t size, uint64_t value)
{
    const uint8_t one = (uint8_t)value;
    const uint16_t two = (uint16_t)value;
    const uint32_t four = (uint32_t)value;
    switch (size) {
    case 1:
        *to = one;
        break;
    case 2:
        memcpy(to, &two, sizeof two);
        break;
    case 4:
        memcpy(to, &four, sizeof four);
        break;
    default:
        memcpy(to, &value, sizeof value);
        break;
    }
}

/* Where bytes of the image go to: a buffer, or only into the CRC. */
typedef struct {
    uint8_t *image;
    size_t at;
    uint32_t crc;
} sink;

static void put_bytes(sink *to, const uint8_t *bytes, size_t count)
{
    if (to->image != NULL)
        memcpy(to->image + to->at, bytes, count);
    to->at += count;
    to->crc = dr_crc32c(to->crc, bytes, count);
}

static void put_struct(sink *to, const field *fields, size_t count, const void *from)
{
    for (size_t i = 0; i < count; i++)
        for (uint8_t n = 0; n < fields[i].count; n++) {
            const uint8_t *at = (const uint8_t *)from + fields[i].offset + (size_t)n * fields[i].size;
            uint64_t value = load(at, fields[i].size);
            uint8_t bytes[sizeof value];
            for (uint8_t byte = 0; byte < fields[i].size; byte++, value >>= 8)
                bytes[byte] = (uint8_t)value;
            put_bytes(to, bytes, fields[i].size);
        }
}

static const uint8_t *get_struct(const uint8_t *image, const field *fields, size_t count, void *out)
{
    for (size_t i = 0; i < count; i++)
        for (uint8_t n = 0; n < fields[i].count; n++) {
            uint64_t value = 0;
            for (uint8_t byte = fields[i].size; byte > 0; byte--)
                value = value << 8 | image[byte - 1u];
            image += fields[i].size;
            store((uint8_t *)out + fields[i].offset + (size_t)n * fields[i].size, fields[i].size, value);
        }
    return image;
}

static uint32_t put_all(const dr_limits *limits, sink to)
{
    static const dr_obstacle none = {0, 0, 0, {{0, 0, 0}, {0, 0, 0}}, {0, {0, 0, 0}}};
    put_bytes(&to, image_head, sizeof image_head);
    put_struct(&to, head_fields, FIELDS(head_fields), limits);
    for (uint8_t i = 0; i < DR_PORTS; i++)
        put_struct(&to, drive_fields, FIELDS(drive_fields), &limits->drives[i]);
    for (uint8_t i = 0; i < DR_OBSTACLES_MAX; i++)
        put_struct(&to, obstacle_fields, FIELDS(obstacle_fields),
                   i < limits->obstacle_count ? &limits->obstacles[i] : &none);
    return to.crc;
}

void dr_limits_put(const dr_limits *limits, uint8_t *image)
{
    const uint32_t crc = put_all(limits, (sink){image, 0, 0});
    for (uint8_t i = 0; i < CRC_BYTES; i++)
        image[CRC_AT + i] = (uint8_t)(crc >> (8u * i));
}

uint32_t dr_limits_crc(const dr_limits *limits) { return put_all(limits, (sink){NULL, 0, 0}); }

static bool has_problem(dr_limits_problem *problem, dr_limits_error error, uint8_t item, uint8_t axis)
{
    *problem = (dr_limits_problem){(uint8_t)error, item, axis};
    return false;
}

static bool check(bool is_good, dr_limits_problem *problem, dr_limits_error error, uint8_t item)
{
    if (!is_good)
        (void)has_problem(problem, error, item, DR_AXES);
    return is_good;
}

bool dr_limits_get(const uint8_t *image, size_t size, dr_limits *out, dr_limits_problem *problem)
{
    uint32_t crc = 0;
    if (size != DR_LIMITS_IMAGE_BYTES)
        return has_problem(problem, DR_LIMITS_SIZE, 0, DR_AXES);
    if (memcmp(image, image_head, 4) != 0)
        return has_problem(problem, DR_LIMITS_MAGIC, 0, DR_AXES);
    if (memcmp(image, image_head, sizeof image_head) != 0)
        return has_problem(problem, DR_LIMITS_VERSION, 0, DR_AXES);
    for (uint8_t i = 0; i < CRC_BYTES; i++)
        crc |= (uint32_t)image[CRC_AT + i] << (8u * i);
    if (dr_crc32c(0, image, CRC_AT) != crc)
        return has_problem(problem, DR_LIMITS_CRC, 0, DR_AXES);
    const uint8_t *from = get_struct(image + BODY_AT, head_fields, FIELDS(head_fields), out);
    for (uint8_t i = 0; i < DR_PORTS; i++)
        from = get_struct(from, drive_fields, FIELDS(drive_fields), &out->drives[i]);
    for (uint8_t i = 0; i < DR_OBSTACLES_MAX; i++)
        from = get_struct(from, obstacle_fields, FIELDS(obstacle_fields), &out->obstacles[i]);
    return dr_limits_check(out, problem);
}

/* -- Defaults ----------------------------------------------------------------------------------------------------------- */

#define UM(um) ((um) * (int32_t)DR_QUANTA_PER_UM)

void dr_limits_init(dr_limits *limits, dr_kind kind)
{
    memset(limits, 0, sizeof *limits);
    limits->kind = (uint8_t)kind;
    limits->refusal = DR_REFUSE_SILENT;
    limits->host_loss = DR_HOST_LOSS_STOP;
    limits->firmware = kind == DR_TRIO ? DR_FIRMWARE_TRIO : DR_FIRMWARE_MPC;
    limits->angle_min_deg = 10;
    limits->angle_max_deg = 80;
    limits->unstoppable_ms = 200; /* human reaction time: such a move needs no stop */
    limits->arm_idle_s = 900;
    limits->margin_q = UM(50);
    limits->knob_q_per_s = UM(5000);
    limits->beyond_zero_q = UM(300); /* an MPC-200 goes 250 um beyond 0 (chosen, [P]) */
}

static int32_t travel_q(const dr_stage *stage, uint8_t axis)
{
    return (int32_t)(stage->travel_steps[axis] * stage->quanta_per_step);
}

bool dr_limits_init_drive(dr_limits *limits, uint8_t drive, dr_stage_id id)
{
    dr_stage stage;
    dr_drive_limits *d = &limits->drives[drive];
    if (!dr_stage_get(id, &stage))
        return false;
    memset(d, 0, sizeof *d);
    d->stage = (uint8_t)id;
    d->fast_level = d->slow_level = DR_SPEED_FULL;
    d->max_move_q = (uint32_t)UM(5000);
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        d->box_q.min_q[axis] = UM(100);
        d->box_q.max_q[axis] = travel_q(&stage, axis) - UM(100);
    }
    return true;
}

/* -- Does it make sense? ------------------------------------------------------------------------------------------------ */

#define FOR_TRIO_ONLY (DR_RIG_Y_LOCKED_OUT | DR_RIG_CALIBRATES_AT_POWER_ON)
#define Y_LOCKED_OUT_OF_ANY (DR_RIG_Y_LOCKED_OUT * ((1u << DR_PORTS) - 1u))
#define FOR_MPC_ONLY (DR_RIG_HOME_IS_ZERO | DR_RIG_MAY_STREAM | Y_LOCKED_OUT_OF_ANY)
#define FOR_BOTH                                                                                                       \
    (DR_RIG_KNOBS_LOCKED | DR_RIG_PATHS_UNKNOWN | DR_RIG_MAY_CALIBRATE | DR_RIG_HAS_CUT | DR_RIG_STAYS_ARMED)
#define MODE_LAST 9u /* [M table 9, 'L'] */

#define OFFSET_FAR ((int64_t)DR_AXES * DR_NORMAL_MAX * DR_FAR_Q)

static bool is_within(int64_t value, int64_t min, int64_t max) { return min <= value && value <= max; }

static bool is_version(uint16_t firmware)
{
    for (uint8_t digit = 0; digit < 4; digit++)
        if ((((unsigned)firmware >> (4u * digit)) & 0xFu) > 9u)
            return false;
    return firmware >= DR_FIRMWARE_FIRST;
}

static bool is_padded_text(const uint8_t *text, uint8_t size)
{
    bool ended = false;
    for (uint8_t i = 0; i < size; i++) {
        if (text[i] == 0)
            ended = true;
        else if (ended || !is_within(text[i], ' ' + 1, '~'))
            return false;
    }
    return true;
}

static bool is_direction(const int16_t direction[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (!is_within(direction[axis], -DR_NORMAL_MAX, DR_NORMAL_MAX))
            return false;
    return true;
}

static bool is_zero(const int16_t direction[DR_AXES])
{
    return direction[DR_X] == 0 && direction[DR_Y] == 0 && direction[DR_Z] == 0;
}

static dr_limits_error check_head(const dr_limits *l)
{
    if (l->kind != DR_TRIO && l->kind != DR_MPC)
        return DR_LIMITS_KIND;
    if (!is_version(l->firmware))
        return DR_LIMITS_FIRMWARE;
    if ((l->rig & ~(uint32_t)(FOR_BOTH | (l->kind == DR_TRIO ? FOR_TRIO_ONLY : FOR_MPC_ONLY))) != 0)
        return DR_LIMITS_RIG;
    if (!is_padded_text(l->serial, DR_SERIAL_MAX))
        return DR_LIMITS_SERIAL;
    if (l->refusal > DR_REFUSE_E || l->host_loss > DR_HOST_LOSS_FINISH)
        return DR_LIMITS_CHOICE;
    if (l->angle_min_deg < 1u || l->angle_min_deg > l->angle_max_deg || l->angle_max_deg >= DR_ANGLE_MAX_DEG)
        return DR_LIMITS_ANGLES;
    if (l->mode_min > MODE_LAST)
        return DR_LIMITS_MODE;
    if (l->unstoppable_ms > DR_UNSTOPPABLE_MAX_MS)
        return DR_LIMITS_UNSTOPPABLE;
    if (!is_within(l->arm_idle_s, 1, DR_ARM_IDLE_MAX_S))
        return DR_LIMITS_ARM_IDLE;
    if (!is_within(l->margin_q, 0, UM(10000)))
        return DR_LIMITS_MARGIN;
    if (!is_within(l->knob_q_per_s, (l->rig & DR_RIG_KNOBS_LOCKED) != 0 ? 0 : 1, UM(20000)))
        return DR_LIMITS_KNOB;
    if (!is_within(l->beyond_zero_q, 0, UM(10000)))
        return DR_LIMITS_BEYOND_ZERO;
    return DR_LIMITS_GOOD;
}

static bool check_box(const dr_drive_limits *d, const dr_stage *stage, uint8_t item, dr_limits_problem *problem)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        if (d->box_q.min_q[axis] >= d->box_q.max_q[axis])
            return has_problem(problem, DR_LIMITS_BOX, item, axis);
        if (d->box_q.min_q[axis] < 0 || d->box_q.max_q[axis] > travel_q(stage, axis))
            return has_problem(problem, DR_LIMITS_BOX_OUTSIDE, item, axis);
    }
    return true;
}

static bool check_surface(const dr_drive_limits *d, const dr_stage *stage, uint8_t item, dr_limits_problem *problem)
{
    if (d->retract == DR_TO_NONE)
        return check(is_zero(d->approach), problem, DR_LIMITS_APPROACH, item);
    if (d->retract > DR_TO_MORE_Z)
        return has_problem(problem, DR_LIMITS_SURFACE, item, DR_AXES);
    const uint8_t axis = dr_to_axis(d->retract);
    if (!is_within(d->surface_q, 0, travel_q(stage, axis)))
        return has_problem(problem, DR_LIMITS_SURFACE, item, axis);
    const int64_t room = dr_to_more(d->retract) ? (int64_t)d->box_q.max_q[axis] - d->surface_q
                                                : (int64_t)d->surface_q - d->box_q.min_q[axis];
    if (room <= (int64_t)d->clearance_q)
        return has_problem(problem, DR_LIMITS_CLEARANCE, item, axis);
    if (!is_direction(d->approach) || d->approach[axis] == 0)
        return has_problem(problem, DR_LIMITS_APPROACH, item, axis);
    return true;
}

static bool check_drive(const dr_limits *l, uint8_t item, dr_limits_problem *problem)
{
    const dr_drive_limits *d = &l->drives[item];
    dr_stage stage;
    if (d->stage == DR_STAGE_NONE)
        return true;
    if (!dr_stage_get((dr_stage_id)d->stage, &stage) || (l->kind == DR_TRIO && item > 0) ||
        dr_stage_fits((dr_stage_id)d->stage, (dr_kind)l->kind, l->firmware, (uint8_t)(item + 1u)) != DR_FIT_YES)
        return has_problem(problem, DR_LIMITS_STAGE, item, DR_AXES);
    if (!check_box(d, &stage, item, problem))
        return false;
    if (!is_within(d->max_move_q, 1, DR_FAR_Q))
        return has_problem(problem, DR_LIMITS_MAX_MOVE, item, DR_AXES);
    if (d->fast_level > DR_SPEED_FULL || d->slow_level > d->fast_level)
        return has_problem(problem, DR_LIMITS_SPEED, item, DR_AXES);
    return check_surface(d, &stage, item, problem);
}

static bool covers(const dr_obstacle *o, const dr_box *box)
{
    if (o->shape == DR_SHAPE_BOX)
        return dr_box_is_in(box, &o->box_q);
    int32_t highest[DR_AXES];
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        highest[axis] = o->half_q.normal[axis] > 0 ? box->max_q[axis] : box->min_q[axis];
    return dr_dot(o->half_q.normal, highest) <= o->half_q.offset_q;
}

static bool check_shape(const dr_obstacle *o, uint8_t item, dr_limits_problem *problem)
{
    if (o->shape == DR_SHAPE_HALF) {
        if (!is_direction(o->half_q.normal) || is_zero(o->half_q.normal) ||
            !is_within(o->half_q.offset_q, -OFFSET_FAR, OFFSET_FAR))
            return has_problem(problem, DR_LIMITS_OBSTACLE_NORMAL, item, DR_AXES);
        return check(o->exit == DR_TO_NONE, problem, DR_LIMITS_OBSTACLE_EXIT, item);
    }
    if (o->shape != DR_SHAPE_BOX)
        return has_problem(problem, DR_LIMITS_SHAPE, item, DR_AXES);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (o->box_q.min_q[axis] > o->box_q.max_q[axis] || o->box_q.min_q[axis] < -DR_FAR_Q ||
            o->box_q.max_q[axis] > DR_FAR_Q)
            return has_problem(problem, DR_LIMITS_OBSTACLE_BOX, item, axis);
    return check(o->exit <= DR_TO_MORE_Z, problem, DR_LIMITS_OBSTACLE_EXIT, item);
}

/* Grown by the margin, as the judge will. Needs a good shape and a good drive. */
static dr_obstacle grown(const dr_obstacle *o, int32_t by_q)
{
    dr_obstacle bigger = *o;
    bigger.box_q = dr_box_grown(&o->box_q, by_q);
    bigger.half_q = dr_half_grown(&o->half_q, by_q);
    return bigger;
}

static bool check_obstacle(const dr_limits *l, uint8_t item, dr_limits_problem *problem)
{
    const dr_obstacle *o = &l->obstacles[item];
    dr_stage stage;
    if (!check_shape(o, item, problem))
        return false;
    if (o->drive >= DR_PORTS || !dr_stage_get((dr_stage_id)l->drives[o->drive].stage, &stage))
        return has_problem(problem, DR_LIMITS_OBSTACLE_DRIVE, item, DR_AXES);
    /* A calibration goes beyond 0 and a reading may: an obstacle there counts. */
    const dr_segment travel = {{0, 0, 0}, {travel_q(&stage, DR_X), travel_q(&stage, DR_Y), travel_q(&stage, DR_Z)}};
    const dr_box whole = dr_box_around(&travel);
    const dr_box near = dr_box_grown(&whole, DR_PLAUSIBLE_BEYOND_Q + l->beyond_zero_q + l->margin_q);
    if (o->shape == DR_SHAPE_BOX ? !dr_box_touches_box(&near, &o->box_q) : !dr_box_touches_half(&near, &o->half_q))
        return has_problem(problem, DR_LIMITS_OBSTACLE_OUTSIDE, item, DR_AXES);
    const dr_obstacle bigger = grown(o, l->margin_q);
    return check(!covers(&bigger, &l->drives[o->drive].box_q), problem, DR_LIMITS_NO_ROOM, o->drive);
}

bool dr_limits_check(const dr_limits *l, dr_limits_problem *problem)
{
    bool any = false;
    const dr_limits_error error = check_head(l);
    *problem = (dr_limits_problem){(uint8_t)error, 0, DR_AXES};
    if (error != DR_LIMITS_GOOD)
        return false;
    for (uint8_t item = 0; item < DR_PORTS; item++) {
        any = any || l->drives[item].stage != DR_STAGE_NONE;
        if (!check_drive(l, item, problem))
            return false;
    }
    if (!any)
        return has_problem(problem, DR_LIMITS_NO_DRIVE, 0, DR_AXES);
    if (l->obstacle_count > DR_OBSTACLES_MAX)
        return has_problem(problem, DR_LIMITS_OBSTACLES, 0, DR_AXES);
    for (uint8_t item = 0; item < l->obstacle_count; item++)
        if (!check_obstacle(l, item, problem))
            return false;
    return true;
}
