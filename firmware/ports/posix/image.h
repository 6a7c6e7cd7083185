/* image: a configuration as the fixed binary of dr_limits.h, in a file: what a microcontroller loads.
 *
 * Thread-safety: functions of their arguments only; who writes a file at the same time writes all of it or none. */
#ifndef IMAGE_H
#define IMAGE_H

#include "dr_limits.h"

/* Do these bytes begin as an image does? */
bool image_is(const void *bytes, size_t size);
/* What is wrong with an image that dr_limits_get() refused. */
const char *image_problem(uint8_t error);

typedef enum { IMAGE_WRITTEN, IMAGE_NOT_NEWER, IMAGE_CANNOT } image_result;

/* Writes the image. The file has it whole or, whatever happens, what it had before. NOT_NEWER: it holds another
 * configuration whose revision is not below this one's; CANNOT: it cannot be written. why[] says more. */
image_result image_write(const char *path, const dr_limits *limits, char *why, size_t room);

#endif
