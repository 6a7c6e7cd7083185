/* Stopping a move from another thread: the thread that moves gets DRYRIG_ERR_INTERRUPTED and where it stands.
 * A signal handler may call dryrig_interrupt() just the same.
 *
 *     example_stop_from_thread PORT STAGE AFTER_MS */
#define _POSIX_C_SOURCE 200809L /* nanosleep */

#include <dryrig/dryrig.h>

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static long after_ms;

static void *stop_later(void *d)
{
    const struct timespec span = {after_ms / 1000, after_ms % 1000 * 1000000};
    nanosleep(&span, NULL);
    dryrig_interrupt(d);
    return NULL;
}

int main(int argc, char **argv)
{
    if (argc != 4) {
        fprintf(stderr, "usage: %s PORT STAGE AFTER_MS\n", argv[0]);
        return 2;
    }
    after_ms = atol(argv[3]);
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
    pthread_t thread;
    if (pthread_create(&thread, NULL, stop_later, d) != 0) {
        dryrig_close(d);
        return 1;
    }
    const double far_um[DRYRIG_AXES] = {20000, 20000, 20000};
    dryrig_position end;
    const int result = dryrig_move_um(d, far_um, DRYRIG_ORDER_AUTO, &end);
    pthread_join(thread, NULL); /* it must not use the handle after dryrig_close() */
    if (result == DRYRIG_ERR_INTERRUPTED && end.drive > 0)
        printf("stopped at %.3f %.3f %.3f um\n", end.um[DRYRIG_X], end.um[DRYRIG_Y], end.um[DRYRIG_Z]);
    else
        fprintf(stderr, "%s\n", result == DRYRIG_OK ? "it was there before" : dryrig_why(d));
    dryrig_close(d);
    return result == DRYRIG_ERR_INTERRUPTED ? 0 : 1;
}
