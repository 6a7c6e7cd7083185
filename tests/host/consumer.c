/* A project that uses the installed library: by find_package and by pkg-config. */
#include <dryrig/dryrig.h>

#include <stdio.h>

int main(void)
{
    dryrig_options options = dryrig_defaults(DRYRIG_MPC);
    dryrig *d;
    char why[DRYRIG_WHY_MAX];
    options.port = "/nowhere/at/all";
    const int result = dryrig_open(&d, &options, why, sizeof why);
    printf("%s\n", dryrig_error_name(result));
    return result == DRYRIG_ERR_NO_PORT ? 0 : 1;
}
