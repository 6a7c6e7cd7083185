/* A straight line on an MPC-200 that reports its position at every micron.
 *
 *     example_line_with_stream PORT STAGE X_UM Y_UM Z_UM LEVEL */
#include <dryrig/dryrig.h>

#include <stdio.h>
#include <stdlib.h>

static void on_motion(void *context, const dryrig_motion *motion)
{
    long *count = context;
    if (!motion->streamed)
        return; /* ten times a second it is called without a position, for progress bars */
    ++*count;
    printf("%.3f %.3f %.3f\n", motion->position.um[DRYRIG_X], motion->position.um[DRYRIG_Y],
           motion->position.um[DRYRIG_Z]);
}

int main(int argc, char **argv)
{
    if (argc != 7) {
        fprintf(stderr, "usage: %s PORT STAGE X_UM Y_UM Z_UM LEVEL\n", argv[0]);
        return 2;
    }
    dryrig_options options = dryrig_defaults(DRYRIG_MPC);
    options.port = argv[1];
    for (int drive = 0; drive < DRYRIG_DRIVES; drive++)
        options.stage[drive] = argv[2];
    dryrig *d;
    char why[DRYRIG_WHY_MAX];
    if (dryrig_open(&d, &options, why, sizeof why) != DRYRIG_OK) {
        fprintf(stderr, "%s\n", why);
        return 1;
    }
    const double target_um[DRYRIG_AXES] = {strtod(argv[3], NULL), strtod(argv[4], NULL), strtod(argv[5], NULL)};
    long count = 0;
    dryrig_watch(d, on_motion, &count);
    const int result = dryrig_line_um(d, target_um, atoi(argv[6]), true, NULL);
    fprintf(stderr, "%ld positions; %s\n", count, result == DRYRIG_OK ? "done" : dryrig_why(d));
    dryrig_close(d);
    return result == DRYRIG_OK ? 0 : 1;
}
