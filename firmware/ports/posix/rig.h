/* rig: reads the configuration of a guard: a text in microns becomes the limits that the core enforces. Compiled ones
 * (image.h) are read too.
 *
 * Every key is checked; a wrong one is an error with file and line. What only the owner knows has no default. Rounding to
 * quanta is exact and safe: limits inwards, obstacles outwards. (A multiple of 1/64 um is exact in binary, and reading a
 * decimal never carries it across one.)
 * Errors are the author's of the file. Thread-safety: functions of their arguments only. */
#ifndef RIG_H
#define RIG_H

#include "dr_limits.h"

#define RIG_NAME_MAX 32u   /* of an obstacle, the closing 0 included */
#define RIG_WHY_MAX 1024u  /* room for every explanation */
#define RIG_CONE_SLICES 8u /* boxes that stand for a cone; a cylinder takes one */
#define RIG_GRID 24u       /* points an axis on which room is counted */
#define RIG_POINTS (RIG_GRID * RIG_GRID * RIG_GRID)

typedef struct {
    dr_limits limits;                           /* good: dr_limits_check() has passed them */
    char names[DR_OBSTACLES_MAX][RIG_NAME_MAX]; /* of the obstacles; boxes that stand for one cone share its name */
} rig;

/* Reads a file. False: why[] says "FILE:LINE: what is wrong and what was expected" (a compiled one
 * has no lines), and *out must not be used. */
bool rig_read(rig *out, const char *path, char *why, size_t room);

/* Ports up to the last that has a drive. */
uint8_t rig_ports(const dr_limits *limits);

/* At how many of RIG_POINTS points of a grid in a drive's box a tip may stand; it stops counting at `enough`. one: where the
 * last of them is; NULL: never mind. */
uint32_t rig_count_free(const dr_limits *limits, uint8_t drive, uint32_t enough, uint32_t one[DR_AXES]);

#endif
