/* Two manipulators of different make on one MPC-200: each has its own stage, and motions act on the one selected.
 *
 *     example_two_drives PORT STAGE1 STAGE2 */
#include <dryrig/dryrig.h>

#include <stdio.h>

static int visit(dryrig *d, int drive, const double target_um[DRYRIG_AXES])
{
    dryrig_position end;
    int result = dryrig_select(d, drive);
    if (result == DRYRIG_OK)
        result = dryrig_move_um(d, target_um, DRYRIG_ORDER_AUTO, &end);
    if (result == DRYRIG_OK)
        printf("drive %d at %.3f %.3f %.3f um = %d %d %d steps\n", end.drive, end.um[DRYRIG_X], end.um[DRYRIG_Y],
               end.um[DRYRIG_Z], (int)end.steps[DRYRIG_X], (int)end.steps[DRYRIG_Y], (int)end.steps[DRYRIG_Z]);
    else
        fprintf(stderr, "drive %d: %s\n", drive, dryrig_why(d));
    return result;
}

int main(int argc, char **argv)
{
    if (argc != 4) {
        fprintf(stderr, "usage: %s PORT STAGE1 STAGE2\n", argv[0]);
        return 2;
    }
    dryrig_options options = dryrig_defaults(DRYRIG_MPC);
    options.port = argv[1];
    options.stage[0] = argv[2]; /* drive 1 */
    options.stage[1] = argv[3]; /* drive 2 */
    dryrig *d;
    char why[DRYRIG_WHY_MAX];
    if (dryrig_open(&d, &options, why, sizeof why) != DRYRIG_OK) {
        fprintf(stderr, "%s\n", why);
        return 1;
    }
    const double target_um[DRYRIG_AXES] = {300, 300, 150};
    int result = visit(d, 1, target_um);
    if (result == DRYRIG_OK)
        result = visit(d, 2, target_um);
    dryrig_close(d);
    return result == DRYRIG_OK ? 0 : 1;
}
