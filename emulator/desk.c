#define _GNU_SOURCE /* getline */
#include "desk.h"

#include "observe_json.h" /* what those who subscribe get */

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

/* -- Those who subscribe --------------------------------------------------------------------------------------------------- */

static desk *desk_of(observer *o) { return (desk *)((char *)o - offsetof(desk, observer)); }

static void see(observer *o, const observation *seen)
{
    desk *const d = desk_of(o);
    cJSON *const event = observe_json(seen);
    char *const line = cJSON_PrintUnformatted(event);
    for (unsigned i = 0; line != NULL && i < CONTROL_CLIENTS; i++)
        if (d->control.clients[i].fd >= 0 && d->control.clients[i].follows)
            control_say(&d->control.clients[i], line);
    cJSON_free(line);
    cJSON_Delete(event);
}

/* Looks on as long as somebody wants to know; without, no notes are made. */
static void follow(desk *d)
{
    engine *const e = d->language.e;
    bool wanted = false;
    for (unsigned i = 0; i < CONTROL_CLIENTS; i++)
        wanted = wanted || (d->control.clients[i].fd >= 0 && d->control.clients[i].follows);
    for (unsigned i = 0; i < e->station_count && wanted != d->has_followers; i++)
        if (wanted)
            station_observe(&e->stations[i], &d->links[i]);
        else
            station_unobserve(&e->stations[i], &d->links[i]);
    d->has_followers = wanted;
}

/* -- The socket ------------------------------------------------------------------------------------------------------------ */

static void answer(void *context, control_client *who, const char *line)
{
    desk *const d = context;
    bool follows = false;
    cJSON *const object = language_do(&d->language, line, &follows);
    char *const text = cJSON_PrintUnformatted(object);
    control_say(who, text == NULL ? "{\"ok\":false,\"why\":\"no memory\"}" : text);
    if (who->fd >= 0)
        who->follows = who->follows || follows;
    cJSON_free(text);
    cJSON_Delete(object);
}

/* The loop waits for what the socket and its clients wait for. A descriptor that has been closed is gone from the loop by
 * itself, and its number may be another client's by now. */
static void watch(desk *d)
{
    struct pollfd fds[CONTROL_FDS];
    control_watch(&d->control, fds);
    for (unsigned i = 0; i < CONTROL_FDS; i++) {
        const uint32_t events = EPOLLIN | ((fds[i].events & POLLOUT) != 0 ? (uint32_t)EPOLLOUT : 0u);
        if (fds[i].fd >= 0 && !engine_watch(d->language.e, &d->base, fds[i].fd, events))
            engine_change(d->language.e, &d->base, fds[i].fd, events);
    }
}

static void ready(source *who, uint32_t events)
{
    (void)events;
    desk *const d = (desk *)who;
    struct pollfd fds[CONTROL_FDS];
    control_watch(&d->control, fds);
    if (poll(fds, CONTROL_FDS, 0) > 0)
        control_serve(&d->control, fds, answer, d);
    follow(d);
    watch(d);
}

bool desk_open(desk *d, engine *e, trace *t, const char *path, char *why, size_t room)
{
    memset(d, 0, sizeof *d);
    d->base.ready = ready;
    d->observer.see = see;
    d->language.e = e;
    d->language.trace = t;
    d->links = calloc(e->station_count, sizeof *d->links);
    if (d->links == NULL) {
        (void)snprintf(why, room, "no memory");
        return false;
    }
    for (unsigned i = 0; i < e->station_count; i++)
        d->links[i].who = &d->observer;
    if (!control_open(&d->control, path, why, room))
        return false;
    watch(d);
    return true;
}

void desk_close(desk *d)
{
    if (d->links == NULL)
        return;
    language_close(&d->language);
    for (unsigned i = 0; i < d->language.e->station_count && d->has_followers; i++)
        station_unobserve(&d->language.e->stations[i], &d->links[i]);
    control_close(&d->control);
    free(d->links);
}

/* -- The other side --------------------------------------------------------------------------------------------------------- */

static FILE *connect_to(const char *path)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    if (strlen(path) >= sizeof address.sun_path) {
        errno = ENAMETOOLONG;
        return NULL;
    }
    memcpy(address.sun_path, path, strlen(path) + 1);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd >= 0 && connect(fd, (const struct sockaddr *)&address, sizeof address) == 0)
        return fdopen(fd, "r+");
    const int error = errno;
    if (fd >= 0)
        (void)close(fd);
    errno = error;
    return NULL;
}

/* Returns whether it says that all went well. */
static bool tell(const char *line)
{
    cJSON *const object = cJSON_Parse(line);
    const char *const error = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, "why"));
    const bool done = object != NULL && error == NULL;
    if (done) {
        (void)fputs(line, stdout);
        (void)fflush(stdout);
    } else {
        (void)fprintf(stderr, "dryrig-emu: %s\n", error != NULL ? error : "that is no answer of an emulator");
    }
    cJSON_Delete(object);
    return done;
}

int desk_ctl(const char *path, char **words)
{
    char *line = NULL;
    size_t size = 0;
    FILE *const emulator = connect_to(path);
    if (emulator == NULL) {
        (void)fprintf(stderr, "dryrig-emu: ctl: %s: %s%s\n", path, strerror(errno),
                      errno == ENOENT || errno == ECONNREFUSED ? ". Does an emulator run with --control there?" : "");
        return 1;
    }
    for (char **word = words; *word != NULL; word++)
        (void)fprintf(emulator, "%s%s", word == words ? "" : " ", *word);
    (void)fputc('\n', emulator);
    bool done = false;
    if (fflush(emulator) == 0 && getline(&line, &size, emulator) > 0)
        done = tell(line);
    else
        (void)fprintf(stderr, "dryrig-emu: ctl: %s: no answer\n", path);
    if (done && words[0] != NULL && strcmp(words[0], "subscribe") == 0)
        while (!ferror(stdout) && getline(&line, &size, emulator) > 0) {
            (void)fputs(line, stdout);
            (void)fflush(stdout);
        }
    free(line);
    (void)fclose(emulator);
    return done ? 0 : 1;
}
