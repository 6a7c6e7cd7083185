/* keep: what a controller remembers without power. TRIO: positions (they count when external switch 6 is "None"), home,
 * work, angle. MPC-200: positions and work of each drive.
 *
 * A record goes to the slot after the newest one and counts when its check sum is right, so a power cut at any moment
 * leaves the old record or the new one. Written once things have been at rest for a second: memory wears out. */
#ifndef DR_KEEP_H
#define DR_KEEP_H

#include "dr_controller.h" /* dr_controller */
#include "port.h"          /* the slots */

#ifdef __cplusplus
extern "C" {
#endif

#define DR_KEEP_AFTER_US DR_US_PER_S

typedef struct {
    uint8_t record[DR_PORT_SLOT_BYTES]; /* the one that is being written */
    uint16_t newest;                    /* slot of the record that counts, or of the last one that was tried */
    uint16_t serial;                    /* its number */
    uint16_t tries;                     /* slots that did not hold what was written to them */
    dr_us since;                        /* when things last changed; counts while is_changed */
    bool is_changed, is_moving, is_writing;
} dr_keep;

/* Sets a controller that is off as the newest record says. False: there is no record of this controller and these stages,
 * and it stays as it was. */
bool dr_keep_load(dr_keep *keep, dr_controller *c);
/* Something may have changed. */
void dr_keep_touch(dr_keep *keep, dr_us now);
/* Goes on with what there is to do. True: there is more, at *when. */
bool dr_keep_step(dr_keep *keep, const dr_controller *c, dr_us now, dr_us *when);

#ifdef __cplusplus
}
#endif
#endif
