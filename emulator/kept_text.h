/* kept_text: what is kept, as the text of its file. kept_read() is in kept.h.
 *
 * Thread-safety: functions of their arguments only. */
#ifndef KEPT_TEXT_H
#define KEPT_TEXT_H

#include "kept.h"

#include <stdio.h>

/* Whether it could be written, the file says (ferror). */
void kept_print(FILE *file, const kept_state *k);

#endif
