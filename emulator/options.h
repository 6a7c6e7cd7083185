/* options: the command line of dryrig-emu, checked and turned into what it stands for. */
#ifndef OPTIONS_H
#define OPTIONS_H

#include "dr_controller.h" /* dr_drive, dr_kind */

#define SPEEDUP_MAX 1000u

typedef struct {
    dr_kind kind;
    uint16_t firmware; /* binary-coded decimal */
    dr_drive drives[DR_PORTS];
    uint8_t drive_count;          /* ports: 1 on a TRIO, DR_PORTS on an MPC-200 */
    uint32_t home_steps[DR_AXES]; /* TRIO */
    uint8_t angle_deg;            /* TRIO */
    uint16_t quirks;              /* DR_QUIRK_* */
    uint8_t byte_quirks;          /* INSTRUMENT_* */
    uint16_t quirk_ids;           /* the same, by name: bit 1 << dr_quirk_id */
    bool is_paced;
    unsigned speedup;  /* 1 to SPEEDUP_MAX */
    const char *link;  /* NULL: none */
    const char *trace; /* NULL: none; "-": stderr */
} options;

/* Ends the program after --help or --version (exit status 0), or when something is wrong (2, and stderr says what is allowed). */
options options_read(int argc, char **argv);

#endif
