/* A host program in plain C with termios, as many are: the commands of both controllers, at the pace that the manuals ask for.
 *
 *     client trio|mpc blocking|polling|leaving     its port is $DRYRIG_PORT
 *
 * `blocking` reads with VMIN and VTIME; `polling` has the port non-blocking and takes bytes as they come, as programs with an
 * event loop do. `leaving` is not right: it reads one byte too few of a position, and the rest with the next answer, at once.
 * Exits with 0 where every answer was the documented one. */
#define _DEFAULT_SOURCE /* cfmakeraw */
#include <fcntl.h>
#include <poll.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#define LIMIT_MS 60000
#define ANSWER_MAX 14

static int port;
static bool is_polling;

static void pause_ms(long ms)
{
    const struct timespec span = {0, ms * 1000000};
    (void)nanosleep(&span, NULL);
}

static void give_up(const char *what)
{
    perror(what);
    exit(1);
}

static void open_port(const char *path)
{
    struct termios line;
    port = open(path, O_RDWR | O_NOCTTY | (is_polling ? O_NONBLOCK : 0));
    if (port < 0 || tcgetattr(port, &line) != 0)
        give_up(path);
    cfmakeraw(&line);
    line.c_cflag |= CLOCAL | CREAD;
    line.c_cc[VMIN] = 0;
    line.c_cc[VTIME] = 1;
    if (tcsetattr(port, TCSANOW, &line) != 0 || tcflush(port, TCIOFLUSH) != 0)
        give_up("tcsetattr");
    pause_ms(2);
}

static void say(const void *bytes, size_t count)
{
    if (write(port, bytes, count) != (ssize_t)count)
        give_up("write");
}

/* Exactly so many bytes, then the pause between an answer and a command. */
static void hear(unsigned char *answer, size_t count)
{
    size_t have = 0;
    for (int turns = 0; have < count; turns++) {
        struct pollfd wait = {port, POLLIN, 0};
        if (turns > LIMIT_MS / 100 || (is_polling && poll(&wait, 1, LIMIT_MS) != 1))
            give_up("no answer");
        const ssize_t got = read(port, answer + have, is_polling ? 1 : count - have);
        if (got < 0)
            give_up("read");
        have += (size_t)got;
    }
    if (answer[count - 1] != '\r')
        give_up("not a CR");
    pause_ms(2);
}

static size_t frame_of(unsigned char *frame, const char *head, size_t head_count, const unsigned steps[3])
{
    memcpy(frame, head, head_count);
    for (size_t i = 0; i < 12; i++)
        frame[head_count + i] = (unsigned char)(steps[i / 4] >> 8 * (i % 4));
    return head_count + 12;
}

static void expect_at(char code, const unsigned steps[3], size_t first)
{
    unsigned char answer[ANSWER_MAX], wanted[12];
    say(&code, 1);
    hear(answer, sizeof answer);
    (void)frame_of(wanted, "", 0, steps);
    if (memcmp(answer + first, wanted, sizeof wanted) != 0)
        give_up("elsewhere");
}

static void leave_one(bool is_mpc)
{
    unsigned char answer[ANSWER_MAX];
    say(is_mpc ? "C" : "c", 1);
    for (size_t have = 0; have < 13;)
        have += (size_t)read(port, answer, 13 - have);
    pause_ms(3);
    say(is_mpc ? "K" : "A\055", is_mpc ? 1 : 2);
    hear(answer, is_mpc ? 5 : 2);
}

int main(int argc, char **argv)
{
    static const unsigned there[3] = {16000, 8000, 3338}, back[3] = {15000, 8000, 3338}; /* 3338 = 0x0D0A */
    unsigned char frame[14], answer[ANSWER_MAX];
    const char *const path = getenv("DRYRIG_PORT");
    if (argc != 3 || path == NULL)
        return 2;
    const bool is_mpc = strcmp(argv[1], "mpc") == 0;
    is_polling = strcmp(argv[2], "polling") == 0;
    open_port(path);
    if (strcmp(argv[2], "leaving") == 0) {
        leave_one(is_mpc);
        return 0;
    }
    if (is_mpc) {
        say("K", 1);
        hear(answer, 4);
        say("U", 1);
        hear(answer, 6);
        say("I\001", 2);
        hear(answer, 2);
        say("F", 1);
        hear(answer, 1);
    }
    say(frame, frame_of(frame, is_mpc ? "M" : "H", 1, there));
    hear(answer, 1);
    expect_at(is_mpc ? 'C' : 'c', there, is_mpc ? 1 : 0);
    (void)frame_of(frame, "S\017", 2, back);
    say(frame, is_mpc ? 2 : 14);
    if (is_mpc) {
        pause_ms(30);
        say(frame + 2, 12);
    }
    hear(answer, 1);
    expect_at(is_mpc ? 'C' : 'c', back, is_mpc ? 1 : 0);
    say(is_mpc ? "H" : "h", 1);
    hear(answer, 1);
    say("\003", 1);
    hear(answer, 1);
    return close(port) == 0 ? 0 : 1;
}
