#include "reads.h"

#include <stdint.h>
#include <string.h>
#include <sys/inotify.h>
#include <unistd.h>

int reads_open(const char *path)
{
    const int fd = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    if (fd >= 0 && inotify_add_watch(fd, path, IN_ACCESS | IN_MODIFY) < 0) {
        (void)close(fd);
        return -1;
    }
    return fd;
}

/* A read that returned nothing makes no event. So where nothing has been sent since the last bytes came, every read is one of
 * what was there before; where something has, one that is behind the newest write is. The order of a program's own calls is
 * that of the events; who reads in one thread and writes in another does so when the first has told the second. */
bool reads_look(int fd, bool was_sent)
{
    char events[1024];
    struct inotify_event event;
    bool has_written = false, has_read = false, has_read_behind = false;
    for (ssize_t length; fd >= 0 && (length = read(fd, events, sizeof events)) > 0;)
        for (const char *at = events; at < events + length; at += sizeof event + event.len) {
            memcpy(&event, at, sizeof event);
            has_written = has_written || (event.mask & (uint32_t)IN_MODIFY) != 0;
            has_read = has_read || (event.mask & (uint32_t)IN_ACCESS) != 0;
            if ((event.mask & (uint32_t)(IN_MODIFY | IN_Q_OVERFLOW)) != 0)
                has_read_behind = false;
            else if ((event.mask & (uint32_t)IN_ACCESS) != 0)
                has_read_behind = has_written;
        }
    return has_read_behind || (has_read && !was_sent);
}
