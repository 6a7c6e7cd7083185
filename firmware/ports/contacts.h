/* contacts: what buttons and encoders say, without the bouncing of their contacts. Pure: levels in, events out; the caller
 * looks once every DR_LOOK_US, and a look that comes late is a look.
 *
 * A button counts as closed or open when DR_LOOKS looks in a row say the same: bouncing delays it and is never told. An
 * encoder needs no delay: one of its two contacts bounces while the other stands still, and what that adds is taken away again.
 *
 * Thread-safety: one thread at a time per struct. */
#ifndef DR_CONTACTS_H
#define DR_CONTACTS_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define DR_LOOK_US 1000u /* up to 250 detents a second */
#define DR_LOOKS 8u      /* longer than the contacts of most buttons bounce, shorter than anybody notices */

/* Sixteen buttons, by bit. */
typedef struct {
    uint16_t closed;
    uint16_t counts[3]; /* looks that have said otherwise since; a number of three bits for each button, bit by bit */
} dr_contacts;

void dr_contacts_init(dr_contacts *c, uint16_t closed);
/* Returns the buttons that have closed or opened now. */
uint16_t dr_contacts_look(dr_contacts *c, uint16_t closed);

/* A rotary encoder: both contacts are open at a detent and close and open once between two. Of a turn so fast that a look
 * is missed within a detent, the detent still counts. */
typedef struct {
    uint8_t at;      /* where in the cycle it stands: 0 is a detent */
    int8_t quarters; /* of a cycle, since that */
} dr_encoder;

/* Returns 1 or -1 when a detent was reached, 0 otherwise. Clockwise, 1, is where contact A closes first. */
int8_t dr_encoder_look(dr_encoder *e, bool a, bool b);

#ifdef __cplusplus
}
#endif
#endif
