/* screen: a model, drawn as the controller's panel in a terminal of at least 80 x 24.
 *
 * The terminal is put back by screen_close(), and where the program ends by itself (atexit).
 * Thread-safety: one terminal, one thread. */
#ifndef SCREEN_H
#define SCREEN_H

#include "model.h" /* what is drawn */

#define SCREEN_COLUMNS 80
#define SCREEN_ROWS 24

typedef struct {
    const model *m;
    unsigned detents;    /* a key turns a knob by */
    unsigned silent_s;   /* so long the emulator has owed an answer; 0: it answers */
    bool is_own;         /* the emulator ends with the panel */
    const char *prompt;  /* a command that is being typed; NULL: none */
    const char *message; /* for the last line; NULL: none */
    bool is_helping;
} screen_view;

/* False: this is no terminal that can be drawn on, and nothing was changed. */
bool screen_open(void);
void screen_close(void);
/* The next key, or -1 when there is none. */
int screen_key(void);
void screen_draw(const screen_view *v);
void screen_beep(void);

#endif
