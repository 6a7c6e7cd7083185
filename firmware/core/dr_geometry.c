#include "dr_geometry.h"

static int32_t smaller(int32_t a, int32_t b) { return a < b ? a : b; }
static int32_t larger(int32_t a, int32_t b) { return a < b ? b : a; }
static int64_t size_of(int64_t value) { return value < 0 ? -value : value; }

/* -- Boxes --------------------------------------------------------------------------------------------------------- */

dr_box dr_box_around(const dr_segment *way)
{
    dr_box box;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        box.min_q[axis] = smaller(way->from_q[axis], way->to_q[axis]);
        box.max_q[axis] = larger(way->from_q[axis], way->to_q[axis]);
    }
    return box;
}

dr_box dr_box_grown(const dr_box *box, int32_t by_q)
{
    dr_box grown;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        grown.min_q[axis] = box->min_q[axis] - by_q;
        grown.max_q[axis] = box->max_q[axis] + by_q;
    }
    return grown;
}

bool dr_box_is_in(const dr_box *inner, const dr_box *outer)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (inner->min_q[axis] < outer->min_q[axis] || inner->max_q[axis] > outer->max_q[axis])
            return false;
    return true;
}

bool dr_box_touches_box(const dr_box *a, const dr_box *b)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (a->max_q[axis] < b->min_q[axis] || a->min_q[axis] > b->max_q[axis])
            return false;
    return true;
}

/* -- Half-spaces: the point of a shape that is deepest along the normal decides ------------------------------------- */

int64_t dr_dot(const int16_t normal[DR_AXES], const int32_t p_q[DR_AXES])
{
    int64_t sum = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        sum += (int64_t)normal[axis] * p_q[axis];
    return sum;
}

dr_half dr_half_grown(const dr_half *half, int32_t by_q)
{
    dr_half grown = *half;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        grown.offset_q += size_of(half->normal[axis]) * by_q;
    return grown;
}

bool dr_box_touches_half(const dr_box *box, const dr_half *half)
{
    int32_t deepest[DR_AXES];
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        deepest[axis] = half->normal[axis] > 0 ? box->min_q[axis] : box->max_q[axis];
    return dr_dot(half->normal, deepest) <= half->offset_q;
}

bool dr_segment_touches_half(const dr_segment *way, const dr_half *half)
{
    return dr_dot(half->normal, way->from_q) <= half->offset_q || dr_dot(half->normal, way->to_q) <= half->offset_q;
}

/* -- A segment and a box -------------------------------------------------------------------------------------------- */

/* A part of the way, 0 at its start and 1 at its end: numerator and positive denominator. */
typedef struct {
    int64_t over, under;
} share;

static bool is_less(share a, share b) { return a.over * b.under < b.over * a.under; }

/* On each axis the segment is between the two faces from one share of the way to another: a hit if all have one in common. */
bool dr_segment_touches_box(const dr_segment *way, const dr_box *box)
{
    share enters = {0, 1}, leaves = {1, 1};
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const int64_t from = way->from_q[axis], step = (int64_t)way->to_q[axis] - from;
        const int64_t to_min = box->min_q[axis] - from, to_max = box->max_q[axis] - from;
        if (step == 0) {
            if (to_min > 0 || to_max < 0)
                return false;
            continue;
        }
        const share in = {step > 0 ? to_min : -to_max, size_of(step)};
        const share out = {step > 0 ? to_max : -to_min, size_of(step)};
        if (is_less(enters, in))
            enters = in;
        if (is_less(out, leaves))
            leaves = out;
    }
    return !is_less(leaves, enters);
}

/* -- Along a line ----------------------------------------------------------------------------------------------------- */

int64_t dr_length_squared(const int32_t move_q[DR_AXES])
{
    int64_t sum = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        sum += (int64_t)move_q[axis] * move_q[axis];
    return sum;
}

/* |move x direction| <= tolerance * |direction|, squared; what would not fit 64 bits squared is too long anyway. */
bool dr_is_along(const int32_t move_q[DR_AXES], const int16_t direction[DR_AXES], int32_t tolerance_q)
{
    int64_t squared = 0, direction_squared = 0, direction_sum = 0;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        direction_squared += (int64_t)direction[axis] * direction[axis];
        direction_sum += size_of(direction[axis]);
    }
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        const uint8_t next = (uint8_t)((axis + 1u) % DR_AXES);
        const int64_t part = (int64_t)move_q[axis] * direction[next] - (int64_t)move_q[next] * direction[axis];
        if (size_of(part) > direction_sum * tolerance_q)
            return false;
        squared += part * part;
    }
    return squared <= (int64_t)tolerance_q * tolerance_q * direction_squared;
}
