/* decode: explains bytes of either protocol, one by one, without a controller. */
#ifndef DECODE_H
#define DECODE_H

#include "options.h"

/* `line->argument[0]` is hexadecimal text, or the name of a recording. Returns an exit status. */
int decode(const command_line *line);

#endif
