#define _GNU_SOURCE /* getline */
#include "ctl.h"

#include <cjson/cJSON.h>

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#define ANSWER_LIMIT_S 15 /* an order takes 5 s at most */

static const char *text_of(const cJSON *object, const char *key)
{
    const char *const text = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, key));
    return text != NULL ? text : "";
}

static bool is_true(const cJSON *object, const char *key)
{
    return cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(object, key)) != 0;
}

static void print_position(const cJSON *position)
{
    const cJSON *const um = cJSON_GetObjectItemCaseSensitive(position, "um");
    if (!cJSON_IsArray(um) || cJSON_GetArraySize(um) != 3)
        return;
    (void)printf("position: drive %d at %.3f, %.3f, %.3f um\n",
                 (int)cJSON_GetNumberValue(cJSON_GetObjectItemCaseSensitive(position, "drive")),
                 cJSON_GetNumberValue(cJSON_GetArrayItem(um, 0)), cJSON_GetNumberValue(cJSON_GetArrayItem(um, 1)),
                 cJSON_GetNumberValue(cJSON_GetArrayItem(um, 2)));
}

/* What follows is the news of this time. */
static void print_time(void)
{
    const time_t now = time(NULL);
    struct tm parts;
    char text[16] = "";
    if (localtime_r(&now, &parts) != NULL && strftime(text, sizeof text, "%H:%M:%S", &parts) > 0)
        (void)printf("\n%s\n", text);
}

static void print_status(const cJSON *all, const char *path)
{
    const cJSON *one;
    (void)printf("state:    %s", text_of(all, "state"));
    if (*text_of(all, "fault_says") != '\0')
        (void)printf(": %s", text_of(all, "fault_says"));
    if (*text_of(all, "disarmed_says") != '\0')
        (void)printf(": %s", text_of(all, "disarmed_says"));
    (void)printf("%s\n", is_true(all, "alarm") ? " SOMETHING MAY STILL MOVE" : "");
    if (*text_of(all, "device_says") != '\0')
        (void)printf("port:     %s\n", text_of(all, "device_says"));
    cJSON_ArrayForEach(one, cJSON_GetObjectItemCaseSensitive(all, "needs"))(void)
        printf("needs:    %s: %s\n", text_of(one, "need"), text_of(one, "says"));
    print_position(cJSON_GetObjectItemCaseSensitive(all, "position"));
    if (is_true(all, "in_tissue"))
        (void)printf("surface:  on: only straight lines along the approach pass\n");
    if (is_true(all, "escape"))
        (void)printf("escape:   on: only lines that lead out of what is forbidden, 1 mm at most\n");
    if (is_true(all, "may_calibrate"))
        (void)printf("calibration: may start now\n");
    const cJSON *const refusal = cJSON_GetObjectItemCaseSensitive(all, "last_refusal");
    if (cJSON_IsObject(refusal))
        (void)printf("refused:  '%s': %s\n", text_of(refusal, "command"), text_of(refusal, "says"));
    if (*text_of(all, "next") != '\0')
        (void)printf("next:     dryrig-guard ctl %s %s\n", path, text_of(all, "next"));
}

static void print_log(const cJSON *list)
{
    const cJSON *one;
    cJSON_ArrayForEach(one, list)(void)
        printf("%s %-11s %s\n", text_of(one, "time"), text_of(one, "event"), text_of(one, "says"));
}

/* Returns the exit status that the answer stands for. */
static int tell(const char *line, const char *path, bool follows, bool is_json)
{
    cJSON *const all = cJSON_Parse(line);
    const bool done = all != NULL && is_true(all, "ok");
    if (is_json) {
        (void)fputs(line, stdout);
    } else if (all == NULL) {
        (void)fprintf(stderr, "dryrig-guard: %s: no answer of a guard\n", path);
    } else {
        const cJSON *const list = cJSON_GetObjectItemCaseSensitive(all, "log");
        if (follows)
            print_time();
        if (*text_of(all, "state") != '\0')
            print_status(all, path);
        print_log(list);
    }
    if (all != NULL && !done)
        (void)fprintf(stderr, "dryrig-guard: %s\n", text_of(all, "why"));
    (void)fflush(stdout);
    cJSON_Delete(all);
    return done ? 0 : CTL_NOT_DONE;
}

static int connect_to(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    const size_t length = strlen(path);
    if (length == 0 || length >= sizeof address.sun_path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    memcpy(address.sun_path, path, length + 1);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd >= 0 && connect(fd, (const struct sockaddr *)&address, sizeof address) == 0)
        return fd;
    const int error = errno;
    if (fd >= 0)
        (void)close(fd);
    errno = error;
    return -1;
}

int ctl_run(const char *path, const char *order, bool follows, bool is_json)
{
    char *line = NULL;
    size_t room = 0;
    int status = 1;
    const struct timeval limit = {follows ? 0 : ANSWER_LIMIT_S, 0};
    const int fd = connect_to(path);
    FILE *const guard = fd >= 0 ? fdopen(fd, "r+") : NULL;
    if (guard == NULL) {
        (void)fprintf(stderr, "dryrig-guard: %s: %s%s\n", path, strerror(errno),
                      errno == ECONNREFUSED || errno == ENOENT ? ". Does a guard run with --control there?" : "");
        if (fd >= 0)
            (void)close(fd);
        return 1;
    }
    (void)setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    (void)signal(SIGPIPE, SIG_IGN); /* a guard that hangs up is to be told of, not to be died of */
    if (fprintf(guard, "%s\n", order) > 0 && fflush(guard) == 0)
        while (getline(&line, &room, guard) > 0) {
            status = tell(line, path, follows, is_json);
            if (!follows)
                break;
        }
    if (line == NULL || (status == 1 && !follows))
        (void)fprintf(stderr, "dryrig-guard: %s: the guard does not answer\n", path);
    else if (follows)
        (void)fprintf(stderr, "dryrig-guard: %s: the guard has ended, or has hung up\n", path);
    free(line);
    (void)fclose(guard);
    return status;
}
