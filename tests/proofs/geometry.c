/* Proves of dr_geometry:
 *
 *   boxes    two boxes touch exactly if they have a point in common; a grown box holds what is so near (all coordinates);
 *   half     a box touches a half-space if it has a point in it (coordinates up to 31, components of the normal up to 3);
 *   widths   no product overflows for any coordinate and direction that the header allows.
 *
 * half is proved for small numbers, because nobody can multiply wide ones by logic alone, and segments are tried one by one
 * (tests/guard/test_geometry.c); nothing in that code depends on a size but the widths of the products, which are proved for all. */
#include "dr_geometry.h"
#include "proof.h"

static bool is_in(const int32_t p_q[DR_AXES], const dr_box *box)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        if (p_q[axis] < box->min_q[axis] || p_q[axis] > box->max_q[axis])
            return false;
    return true;
}

static void any_point(int32_t p_q[DR_AXES], int32_t far_q)
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        p_q[axis] = anything_between(-far_q, far_q);
}

static dr_box any_box(int32_t far_q)
{
    dr_box box;
    any_point(box.min_q, far_q);
    any_point(box.max_q, far_q);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        assume(box.min_q[axis] <= box.max_q[axis]);
    return box;
}

void proof_boxes(void)
{
    int32_t p_q[DR_AXES], q_q[DR_AXES];
    const dr_box a = any_box(DR_FAR_Q), b = any_box(DR_FAR_Q);
    const int32_t by_q = anything_between(0, DR_FAR_Q);
    any_point(p_q, DR_FAR_Q);
    any_point(q_q, DR_FAR_Q);
    if (is_in(p_q, &a) && is_in(p_q, &b))
        assert(dr_box_touches_box(&a, &b));
    if (dr_box_touches_box(&a, &b)) { /* the point that they have in common */
        for (uint8_t axis = 0; axis < DR_AXES; axis++)
            q_q[axis] = a.min_q[axis] > b.min_q[axis] ? a.min_q[axis] : b.min_q[axis];
        assert(is_in(q_q, &a) && is_in(q_q, &b));
    }
    if (dr_box_is_in(&a, &b) && is_in(p_q, &a))
        assert(is_in(p_q, &b));
    const dr_box grown = dr_box_grown(&a, by_q);
    any_point(q_q, DR_FAR_Q);
    bool is_near = is_in(p_q, &a);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        is_near = is_near && q_q[axis] - p_q[axis] <= by_q && p_q[axis] - q_q[axis] <= by_q;
    if (is_near)
        assert(is_in(q_q, &grown));
    proved();
}

static dr_half any_half(int16_t most)
{
    dr_half half;
    half.offset_q = anything_between(-DR_FAR_Q, DR_FAR_Q);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        half.normal[axis] = (int16_t)anything_between(-most, most);
    return half;
}

void proof_half(void)
{
    int32_t p_q[DR_AXES];
    const dr_box box = any_box(31);
    const dr_half half = any_half(3);
    any_point(p_q, 31);
    if (is_in(p_q, &box) && dr_dot(half.normal, p_q) <= half.offset_q)
        assert(dr_box_touches_half(&box, &half));
    proved();
}

/* Any of 26 bits, which is more than DR_FAR_Q needs; its highest bits are one bit, which spares the model checker a proof. */
static int32_t any_26_bits(void) { return (int32_t)(anything_32() << 6) >> 6; }
static int16_t any_12_bits(void) { return (int16_t)((int16_t)(anything_16() << 4) >> 4); }

void proof_widths(void)
{
    dr_segment way;
    dr_box box;
    dr_half half;
    int16_t direction[DR_AXES];
    int32_t move_q[DR_AXES];
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        way.from_q[axis] = any_26_bits();
        way.to_q[axis] = any_26_bits();
        box.min_q[axis] = any_26_bits();
        box.max_q[axis] = any_26_bits();
        move_q[axis] = any_26_bits();
        direction[axis] = any_12_bits();
        half.normal[axis] = any_12_bits();
    }
    half.offset_q = (int64_t)any_26_bits() * 4096;
    half = dr_half_grown(&half, any_26_bits());
    (void)dr_segment_touches_half(&way, &half);
    (void)dr_box_touches_half(&box, &half);
    (void)dr_segment_touches_box(&way, &box);
    (void)dr_length_squared(move_q);
    (void)dr_is_along(move_q, direction, (int32_t)anything_16());
    proved();
}
