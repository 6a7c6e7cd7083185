#define _GNU_SOURCE /* mkdtemp, pipe2, prctl */
#include "step_rig.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>
#include <unity.h>

#define ARGUMENTS 32
#define ANSWER 65536
#define SLICE_US 2000u /* how long the line is left alone while something is under way */
#define LAG_US 100000u /* how far the emulator's clock may lag while nothing is */

/* -- The control channel ------------------------------------------------------------------------------------------------- */

static cJSON *ask(const step_rig *rig, const char *line)
{
    static char text[ANSWER];
    cJSON *answer = NULL;
    TEST_ASSERT_GREATER_THAN(0, dprintf(rig->control, "%s\n", line));
    if (fgets(text, sizeof text, rig->answers) != NULL)
        answer = cJSON_Parse(text);
    TEST_ASSERT_NOT_NULL_MESSAGE(answer, line);
    return answer;
}

static bool is_ok(const cJSON *answer) { return cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(answer, "ok")); }

/* The emulator's clock comes to where the library's is. */
static void catch_up(step_rig *rig)
{
    char line[64];
    (void)snprintf(line, sizeof line, "advance %lluus", (unsigned long long)(rig->now_us - rig->told_us));
    cJSON *const answer = ask(rig, line);
    TEST_ASSERT_TRUE_MESSAGE(is_ok(answer), line);
    rig->told_us = rig->now_us;
    rig->is_idle = cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(answer, "idle"));
    cJSON_Delete(answer);
}

cJSON *step_rig_ask(step_rig *rig, const char *line)
{
    if (rig->told_us != rig->now_us)
        catch_up(rig);
    rig->is_idle = false; /* who knows */
    return ask(rig, line);
}

void step_rig_do(step_rig *rig, const char *format, ...)
{
    char line[512];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(line, sizeof line, format, arguments);
    va_end(arguments);
    cJSON *const answer = step_rig_ask(rig, line);
    TEST_ASSERT_TRUE_MESSAGE(is_ok(answer), line);
    cJSON_Delete(answer);
}

void step_rig_advance(step_rig *rig, uint64_t us)
{
    rig->now_us += us;
    if (!rig->is_idle || rig->now_us - rig->told_us > LAG_US)
        catch_up(rig);
}

void step_rig_steps(step_rig *rig, const char *key, int32_t steps[DRYRIG_AXES])
{
    cJSON *const state = step_rig_ask(rig, "state");
    const cJSON *const controller = cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(state, "controllers"), 0);
    const cJSON *const active = cJSON_GetObjectItemCaseSensitive(controller, "active");
    const cJSON *const device = cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(controller, "devices"),
                                                   active == NULL ? 0 : active->valueint - 1);
    const cJSON *const list = cJSON_GetObjectItemCaseSensitive(device, key);
    TEST_ASSERT_EQUAL_INT_MESSAGE(DRYRIG_AXES, cJSON_GetArraySize(list), key);
    for (int axis = 0; axis < DRYRIG_AXES; axis++)
        steps[axis] = cJSON_GetArrayItem(list, axis)->valueint;
    cJSON_Delete(state);
}

/* -- The program ---------------------------------------------------------------------------------------------------------- */

/* In the child. */
static void run_emulator(int out, const char *const *arguments)
{
    (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
    (void)dup2(out, STDOUT_FILENO);
    (void)close(STDERR_FILENO);
    char *writable[ARGUMENTS] = {strdup(arguments[0])}; /* as execv() asks for */
    for (int i = 1; i < ARGUMENTS - 1 && arguments[i] != NULL; i++)
        writable[i] = strdup(arguments[i]);
    if (writable[0] != NULL)
        (void)execv(writable[0], writable);
    _exit(127);
}

static void connect_to(step_rig *rig)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    rig->control = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    (void)snprintf(address.sun_path, sizeof address.sun_path, "%s", rig->socket);
    TEST_ASSERT_EQUAL_MESSAGE(0, connect(rig->control, (const struct sockaddr *)&address, sizeof address), rig->socket);
    rig->answers = fdopen(rig->control, "r");
    TEST_ASSERT_NOT_NULL(rig->answers);
}

void step_rig_start(step_rig *rig, const char *emulator, const char *controller, const char *const *options)
{
    int out[2];
    char line[128] = "";
    memset(rig, 0, sizeof *rig);
    (void)snprintf(rig->directory, sizeof rig->directory, "/tmp/dryrig-XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(rig->directory));
    (void)snprintf(rig->link, sizeof rig->link, "%s/port", rig->directory);
    (void)snprintf(rig->socket, sizeof rig->socket, "%s/control", rig->directory);
    const char *arguments[ARGUMENTS] = {emulator, controller, "--clock", "step",      "--pace",
                                        "on",     "--link",   rig->link, "--control", rig->socket};
    for (int i = 10; i < ARGUMENTS - 1 && *options != NULL; i++)
        arguments[i] = *options++;
    TEST_ASSERT_EQUAL(0, pipe2(out, O_CLOEXEC));
    rig->pid = fork();
    if (rig->pid == 0)
        run_emulator(out[1], arguments);
    (void)close(out[1]);
    TEST_ASSERT_GREATER_THAN(0, rig->pid);
    TEST_ASSERT_GREATER_THAN(5, read(out[0], line, sizeof line - 1)); /* one write */
    (void)close(out[0]);
    TEST_ASSERT_EQUAL_STRING_LEN_MESSAGE("ready ", line, 6, line);
    connect_to(rig);
}

void step_rig_stop(step_rig *rig)
{
    int how = 0;
    if (rig->pid <= 0)
        return;
    (void)fclose(rig->answers);
    (void)kill(rig->pid, SIGTERM);
    TEST_ASSERT_EQUAL(rig->pid, waitpid(rig->pid, &how, 0));
    rig->pid = 0;
    TEST_ASSERT_EQUAL_MESSAGE(0, rmdir(rig->directory), "the emulator has left something behind");
    TEST_ASSERT_TRUE(WIFEXITED(how) && WEXITSTATUS(how) == 0);
}

/* -- The link ------------------------------------------------------------------------------------------------------------- */

typedef struct {
    step_rig *rig;
    dryrig_link port;
} stepped;

static int step_read(void *context, void *bytes, size_t room, uint32_t timeout_us)
{
    stepped *const s = context;
    const uint64_t end_us = s->rig->now_us + timeout_us;
    for (;;) {
        const int count = s->port.read(s->port.context, bytes, room, 0);
        const uint64_t left_us = end_us - s->rig->now_us, most_us = s->rig->is_idle ? LAG_US : SLICE_US;
        if (count != 0 || left_us == 0)
            return count;
        step_rig_advance(s->rig, left_us < most_us ? left_us : most_us);
    }
}

static int step_write(void *context, const void *bytes, size_t count)
{
    stepped *const s = context;
    if (s->rig->told_us != s->rig->now_us)
        catch_up(s->rig);
    if (s->rig->before_write > 0 && --s->rig->before_write == 0)
        step_rig_do(s->rig, "%s", s->rig->line);
    s->rig->is_idle = false;
    return s->port.write(s->port.context, bytes, count);
}

static int step_purge(void *context)
{
    stepped *const s = context;
    return s->port.purge(s->port.context);
}

static uint64_t step_now(void *context) { return ((const stepped *)context)->rig->now_us; }

static void step_sleep(void *context, uint32_t span_us) { step_rig_advance(((stepped *)context)->rig, span_us); }

static void step_close(void *context)
{
    stepped *const s = context;
    s->port.close(s->port.context);
    free(s);
}

int step_rig_link(step_rig *rig, dryrig_link *out, unsigned baud)
{
    char why[DRYRIG_WHY_MAX];
    stepped *const s = calloc(1, sizeof *s);
    TEST_ASSERT_NOT_NULL(s);
    s->rig = rig;
    const int result = dryrig_link_open(&s->port, rig->link, baud, why, sizeof why);
    if (result != DRYRIG_OK)
        free(s);
    else
        *out = (dryrig_link){s, step_read, step_write, step_purge, step_now, step_sleep, step_close};
    return result;
}
