/* Linked by mutate.py around Unity's runner of tests (ld --wrap). In the environment:
 *   PICK=0110...  runs the tests with a 1 only, by their order in main()
 *   TRACE=FILE    a line for each: its name, its processor time in us and, where the core was compiled with
 *                 -finstrument-functions, the addresses of the functions that it entered
 * A program ends with its first test that fails: the rest would find nothing new. */
#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define ENTERED_MAX 4096u

static void *entered[ENTERED_MAX];

void __cyg_profile_func_enter(void *function, void *caller);
void __cyg_profile_func_exit(void *function, void *caller);
void __real_UnityDefaultTestRun(UnityTestFunction test, const char *name, int line);
void __wrap_UnityDefaultTestRun(UnityTestFunction test, const char *name, int line);

void __cyg_profile_func_enter(void *function, void *caller)
{
    (void)caller;
    size_t at = (size_t)function / 4u % ENTERED_MAX;
    while (entered[at] != NULL && entered[at] != function)
        at = (at + 1u) % ENTERED_MAX;
    entered[at] = function;
}

void __cyg_profile_func_exit(void *function, void *caller)
{
    (void)function;
    (void)caller;
}

static void trace(const char *path, const char *name, clock_t used)
{
    FILE *file = fopen(path, "a");
    if (file == NULL)
        exit(EXIT_FAILURE);
    (void)fprintf(file, "%s %.0f", name, (double)used * 1e6 / CLOCKS_PER_SEC);
    for (size_t i = 0; i < ENTERED_MAX; i++)
        if (entered[i] != NULL)
            (void)fprintf(file, " %lx", (unsigned long)entered[i]);
    (void)fprintf(file, "\n");
    (void)fclose(file);
}

void __wrap_UnityDefaultTestRun(UnityTestFunction test, const char *name, int line)
{
    static size_t count;
    const char *pick = getenv("PICK"), *path = getenv("TRACE");
    const size_t index = count++;
    if (pick != NULL && (index >= strlen(pick) || pick[index] != '1'))
        return;
    memset(entered, 0, sizeof entered);
    const clock_t before = clock();
    __real_UnityDefaultTestRun(test, name, line);
    if (path != NULL)
        trace(path, name, clock() - before);
    if (Unity.TestFailures > 0)
        exit(UnityEnd());
}
