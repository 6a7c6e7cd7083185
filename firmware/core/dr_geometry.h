/* dr_geometry: does a way touch an obstacle? Exact, in integers: nothing is rounded, a touch counts as a hit.
 *
 * Lengths are quanta of 1/64 um. Every coordinate handed in is within +-DR_FAR_Q, every component of a direction within
 * +-DR_NORMAL_MAX: all products then fit 64 bits. Boxes and half-spaces are closed sets (their faces belong to them).
 * Thread-safety: functions of their arguments only. */
#ifndef DR_GEOMETRY_H
#define DR_GEOMETRY_H

#include "dr_device.h" /* DR_AXES */

#ifdef __cplusplus
extern "C" {
#endif

#define DR_FAR_Q INT32_C(16777216) /* 2^24 quanta = 262 mm: more than twice the longest travel */
#define DR_NORMAL_MAX 1024         /* the largest component of a direction */

typedef struct {
    int32_t min_q[DR_AXES], max_q[DR_AXES];
} dr_box;
typedef struct {
    int32_t from_q[DR_AXES], to_q[DR_AXES];
} dr_segment;
/* All points p with normal . p <= offset: the normal points out of it, to where the tip may be. */
typedef struct {
    int64_t offset_q;
    int16_t normal[DR_AXES];
} dr_half;

/* The smallest box around a segment: what a move between its ends cannot leave, if no axis ever turns back. */
dr_box dr_box_around(const dr_segment *way);
/* The box with every face moved outwards (inwards if negative) by so much. */
dr_box dr_box_grown(const dr_box *box, int32_t by_q);
bool dr_box_is_in(const dr_box *inner, const dr_box *outer);
bool dr_box_touches_box(const dr_box *a, const dr_box *b);

/* The half-space that holds every point within a cube of half-side by_q around a point of `half`. */
dr_half dr_half_grown(const dr_half *half, int32_t by_q);
bool dr_box_touches_half(const dr_box *box, const dr_half *half);

bool dr_segment_touches_box(const dr_segment *way, const dr_box *box);
bool dr_segment_touches_half(const dr_segment *way, const dr_half *half);

/* Is the part of `move` that is not along `direction` (either way) at most tolerance_q long? direction is not 0,0,0;
 * 0 <= tolerance_q <= 65,535. */
bool dr_is_along(const int32_t move_q[DR_AXES], const int16_t direction[DR_AXES], int32_t tolerance_q);
/* normal . p, for comparisons with a half-space's offset. */
int64_t dr_dot(const int16_t normal[DR_AXES], const int32_t p_q[DR_AXES]);
/* The square of a length. */
int64_t dr_length_squared(const int32_t move_q[DR_AXES]);

#ifdef __cplusplus
}
#endif
#endif
