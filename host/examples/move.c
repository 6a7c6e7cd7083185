/* A relative move: coordinates are absolute, so ask, add, move; and what the errors mean.
 *
 *     example_move PORT trio|mpc STAGE DZ_UM */
#include <dryrig/dryrig.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int step(dryrig *d, double dz_um)
{
    dryrig_position p;
    int result = dryrig_get_position(d, &p);
    if (result != DRYRIG_OK)
        return result;
    p.um[DRYRIG_Z] += dz_um;
    result = dryrig_move_um(d, p.um, DRYRIG_ORDER_AUTO, &p); /* returns when it is there */
    if (result == DRYRIG_OK)
        printf("now at %.3f %.3f %.3f um\n", p.um[DRYRIG_X], p.um[DRYRIG_Y], p.um[DRYRIG_Z]);
    return result;
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        fprintf(stderr, "usage: %s PORT trio|mpc STAGE DZ_UM\n", argv[0]);
        return 2;
    }
    dryrig_options options = dryrig_defaults(strcmp(argv[2], "trio") == 0 ? DRYRIG_TRIO : DRYRIG_MPC);
    options.port = argv[1];
    for (int drive = 0; drive < DRYRIG_DRIVES; drive++)
        options.stage[drive] = argv[3];
    dryrig *d;
    char why[DRYRIG_WHY_MAX];
    if (dryrig_open(&d, &options, why, sizeof why) != DRYRIG_OK) {
        fprintf(stderr, "%s\n", why);
        return 1;
    }
    const int result = step(d, strtod(argv[4], NULL));
    switch (dryrig_fault_of(result)) {
    case DRYRIG_FAULT_NONE:
        break;
    case DRYRIG_FAULT_CALLER: /* nothing was sent: beyond the travel, for instance */
        fprintf(stderr, "refused: %s\n", dryrig_why(d));
        break;
    case DRYRIG_FAULT_COMPUTER:
    case DRYRIG_FAULT_CONTROLLER:
    case DRYRIG_FAULT_PERSON:
        fprintf(stderr, "not done: %s\n", dryrig_why(d));
        break;
    }
    dryrig_close(d);
    return result == DRYRIG_OK ? 0 : 1;
}
