/* Where is it? Opens a controller, asks for the position, in microns and in microsteps.
 *
 *     example_where_is_it PORT trio|mpc STAGE */
#include <dryrig/dryrig.h>

#include <stdio.h>
#include <string.h>

int main(int argc, char **argv)
{
    if (argc != 4) {
        fprintf(stderr, "usage: %s PORT trio|mpc STAGE\n", argv[0]);
        return 2;
    }
    dryrig_options options = dryrig_defaults(strcmp(argv[2], "trio") == 0 ? DRYRIG_TRIO : DRYRIG_MPC);
    options.port = argv[1];
    for (int drive = 0; drive < DRYRIG_DRIVES; drive++)
        options.stage[drive] = argv[3]; /* here: the same on every drive */

    dryrig *d;
    char why[DRYRIG_WHY_MAX];
    if (dryrig_open(&d, &options, why, sizeof why) != DRYRIG_OK) {
        fprintf(stderr, "%s\n", why); /* a missing port lists those that there are; a busy one names who has it */
        return 1;
    }
    dryrig_position p;
    const int result = dryrig_get_position(d, &p);
    if (result == DRYRIG_OK)
        printf("%.3f %.3f %.3f um = %d %d %d steps\n", p.um[DRYRIG_X], p.um[DRYRIG_Y], p.um[DRYRIG_Z],
               (int)p.steps[DRYRIG_X], (int)p.steps[DRYRIG_Y], (int)p.steps[DRYRIG_Z]);
    else
        fprintf(stderr, "%s: %s\n", dryrig_strerror(result), dryrig_why(d));
    dryrig_close(d);
    return result == DRYRIG_OK ? 0 : 1;
}
