/* dryrig-panel: the panel of an emulated controller in a terminal.
 *
 *     client  lines to and from the emulator's control channel      model     what it has told about itself
 *     screen  the model, drawn (ncurses)                            controls  which key works which control
 *
 * It asks for `state` and `panel` ten times a second while something goes on, three times otherwise, and is told by
 * `subscribe` what goes over the wire. */
#define _GNU_SOURCE   /* signalfd */
#include "client.h"   /* the control channel */
#include "controls.h" /* keys */
#include "screen.h"   /* the terminal */

#include <argp.h>
#include <curses.h> /* keys */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#define ASK_MOVING_MS 100
#define ASK_RESTING_MS 300
#define LISTEN_MS 20   /* between two readings: a stream has a thousand lines a second */
#define DRAW_MS 50     /* at least between two pictures, however fast things happen */
#define SILENT_MS 2000 /* an emulator that owes an answer for so long is stopped, or at work */
#define LINE 440u      /* the control channel takes 511 characters, the name of the controller included */
#define KEY_ESCAPE 27
#define KEY_DELETE 127

typedef struct {
    client link;
    model m;
    int signals;
    bool is_over;
    int status;
    char why[MODEL_TEXT]; /* it is over; "": as asked */

    int64_t ask_ms, draw_ms, listen_ms; /* when next */
    bool waits;                         /* for the answers to what was asked */
    int64_t asked_ms;                   /* when that was */
    unsigned silent_s;                  /* since then, where it is too long */
    bool is_changed;                    /* since it was drawn */
    unsigned beeps;

    unsigned detents;
    bool is_own; /* the emulator's panel: they end together */
    bool is_helping, is_typing;
    char typed[LINE - MODEL_NAME], message[MODEL_TEXT], next[MODEL_NAME];
} panel;

static int64_t now_ms(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static void end(panel *p, int status, const char *why)
{
    p->is_over = true;
    p->status = status;
    (void)snprintf(p->why, sizeof p->why, "%s", why);
}

/* -- To the emulator ----------------------------------------------------------------------------------------------------- */

/* A line about the controller that is shown. */
__attribute__((format(printf, 2, 3))) static void say(panel *p, const char *format, ...)
{
    char line[LINE + MODEL_NAME + 2], text[LINE];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    if (p->m.name[0] == '\0' || text[0] == '@')
        (void)snprintf(line, sizeof line, "%s", text);
    else
        (void)snprintf(line, sizeof line, "@%s %s", p->m.name, text);
    if (!client_say(&p->link, line))
        end(p, 1, "no memory");
}

/* The first `state` tells which controllers there are. */
static void ask(panel *p)
{
    if (!p->m.is_known) {
        if (!client_say(&p->link, "state"))
            end(p, 1, "no memory");
    } else {
        say(p, "state");
    }
    if (p->m.name[0] != '\0' && p->m.is_known)
        say(p, "panel");
    p->waits = true;
    p->asked_ms = now_ms();
}

static void order_lines(panel *p, const char *lines)
{
    char copy[LINE];
    (void)snprintf(copy, sizeof copy, "%s", lines);
    for (char *rest = copy, *line; (line = strsep(&rest, "\n")) != NULL;)
        say(p, "%s", line);
}

/* -- From the emulator --------------------------------------------------------------------------------------------------- */

static void take(panel *p, const char *line)
{
    const bool was_known = p->m.is_known, was_shown = p->m.is_shown;
    char why[MODEL_TEXT] = "";
    p->is_changed = true;
    switch (model_take(&p->m, line, why, was_known ? NULL : p->next)) {
    case MODEL_STATE:
        if (!was_known) /* there is more to ask now */
            p->waits = false;
        p->ask_ms = was_known ? p->ask_ms : now_ms();
        break;
    case MODEL_PANEL:
        p->waits = false;
        p->ask_ms = now_ms() + (p->m.moves || p->m.down[1] != '\0' ? ASK_MOVING_MS : ASK_RESTING_MS);
        if (was_shown && p->m.beeps != p->beeps) {
            screen_beep();
            model_say(&p->m, "beep");
        }
        p->beeps = p->m.beeps;
        break;
    case MODEL_DONE:
        p->ask_ms = now_ms();
        if (strlen(line) > strlen("{\"ok\":true}"))
            (void)snprintf(p->message, sizeof p->message, "%s", line);
        break;
    case MODEL_REFUSED:
        if (was_known)
            (void)snprintf(p->message, sizeof p->message, "%s", why);
        else
            end(p, 1, why);
        break;
    case MODEL_EVENT:
        p->ask_ms = now_ms() < p->ask_ms - ASK_MOVING_MS ? now_ms() + ASK_MOVING_MS : p->ask_ms;
        break;
    case MODEL_NOTHING:
        if (!was_known)
            end(p, 1, "whoever answers there is no emulator");
        break;
    }
}

static void read_emulator(panel *p)
{
    const bool is_there = client_read(&p->link);
    const char *newest = NULL; /* of a stream, whose others would be overwritten at once */
    for (const char *line; !p->is_over && (line = client_next(&p->link)) != NULL;) {
        const bool is_stream = strstr(line, "\"note\":\"stream\"") != NULL;
        if (newest != NULL && !is_stream)
            take(p, newest);
        newest = is_stream ? line : NULL;
        if (!is_stream)
            take(p, line);
    }
    if (newest != NULL && !p->is_over)
        take(p, newest);
    p->listen_ms = now_ms() + LISTEN_MS;
    if (!is_there && !p->is_over)
        end(p, 1, "the emulator has ended");
}

static void watch_silence(panel *p)
{
    const int64_t silent_ms = p->waits ? now_ms() - p->asked_ms : 0;
    const unsigned silent_s = silent_ms < SILENT_MS ? 0 : (unsigned)(silent_ms / 1000);
    p->is_changed = p->is_changed || silent_s != p->silent_s;
    p->silent_s = silent_s;
}

/* -- Keys ---------------------------------------------------------------------------------------------------------------- */

static void type(panel *p, int key)
{
    const size_t length = strlen(p->typed);
    if (key == KEY_ESCAPE || key == KEY_ENTER || key == '\n' || key == '\r') {
        p->is_typing = false;
        if (key != KEY_ESCAPE && length > 0)
            say(p, "%s", p->typed);
    } else if ((key == KEY_BACKSPACE || key == KEY_DELETE || key == '\b') && length > 0) {
        p->typed[length - 1] = '\0';
    } else if (key >= ' ' && key < KEY_DELETE && length + 1 < sizeof p->typed) {
        p->typed[length] = (char)key;
        p->typed[length + 1] = '\0';
    }
}

static void hint(panel *p, const char *control, control_use use)
{
    const char *const why = controls_hint(&p->m, control, use);
    if (why != NULL)
        (void)snprintf(p->message, sizeof p->message, "%s", why);
}

/* The order goes out in any case: the emulator knows better. */
static bool work_control(panel *p, int key)
{
    for (const control_button *b = controls_buttons(p->m.kind); b->key != 0; b++) {
        const bool is_held = key == b->key - 'a' + 'A' && b->held_order != NULL;
        if (!is_held && key != b->key)
            continue;
        hint(p, b->name, is_held ? CONTROL_HELD : CONTROL_PRESSED);
        if (is_held)
            order_lines(p, b->held_order);
        else
            say(p, "press %s", b->name);
        return true;
    }
    for (const control_knob *k = controls_knobs(p->m.kind); k->key != 0; k++)
        if (key == k->key) {
            hint(p, k->name, CONTROL_TURNED);
            say(p, "knob %s %+d", k->name, k->way * (k->is_selector ? 1 : (int)p->detents));
            return true;
        }
    return false;
}

static void choose_next(panel *p)
{
    if (p->m.controllers < 2)
        return;
    model_choose(&p->m, p->next);
    p->waits = false;
    p->ask_ms = now_ms();
}

static void take_key(panel *p, int key)
{
    p->is_changed = true;
    if (key == KEY_RESIZE)
        return;
    p->message[0] = '\0';
    if (p->is_typing) {
        type(p, key);
    } else if (p->is_helping) {
        p->is_helping = false;
    } else if (key == 'q') {
        end(p, 0, "");
    } else if (!p->m.is_shown || work_control(p, key)) {
        return;
    } else if (key == '?') {
        p->is_helping = true;
    } else if (key == ':') {
        p->is_typing = true;
        p->typed[0] = '\0';
    } else if (key == 'n') {
        p->detents = p->detents == 1000 ? 1 : p->detents * 10;
    } else if (key == 'o') {
        say(p, strcmp(p->m.state, "off") == 0 ? "power on" : "power off");
    } else if (key == '\t') {
        choose_next(p);
    } else {
        (void)snprintf(p->message, sizeof p->message, "that key does nothing; ? explains the others");
    }
}

/* -- The loop ------------------------------------------------------------------------------------------------------------ */

static void draw(panel *p)
{
    const screen_view view = {.m = &p->m,
                              .detents = p->detents,
                              .silent_s = p->silent_s,
                              .is_own = p->is_own,
                              .prompt = p->is_typing ? p->typed : NULL,
                              .message = p->message[0] == '\0' ? NULL : p->message,
                              .is_helping = p->is_helping};
    screen_draw(&view);
    p->is_changed = false;
    p->draw_ms = now_ms() + DRAW_MS;
}

static int until(int64_t when_ms, int64_t now)
{
    return when_ms <= now ? 0 : when_ms - now < 1000 ? (int)(when_ms - now) : 1000;
}

static int sleep_ms(const panel *p)
{
    const int64_t now = now_ms();
    int64_t next = p->ask_ms;
    if (p->waits)
        next = p->asked_ms + (p->silent_s > 0 ? (p->silent_s + 1) * 1000 : SILENT_MS);
    if (p->is_changed && p->draw_ms < next)
        next = p->draw_ms;
    if (p->listen_ms > now && p->listen_ms < next)
        next = p->listen_ms;
    return until(next, now);
}

static void run(panel *p)
{
    while (!p->is_over) {
        struct pollfd fds[] = {
            {p->listen_ms > now_ms() ? -1 : p->link.fd, (short)(POLLIN | (p->link.out_count > 0 ? POLLOUT : 0)), 0},
            {STDIN_FILENO, POLLIN, 0},
            {p->signals, POLLIN, 0}};
        const int count = poll(fds, 3, sleep_ms(p)); /* a new size of the window interrupts it */
        if (count < 0 && errno != EINTR)
            end(p, 1, strerror(errno));
        if (count > 0 && fds[2].revents != 0)
            end(p, 0, "");
        if (count > 0 && (fds[1].revents & (POLLHUP | POLLERR | POLLNVAL)) != 0)
            end(p, 1, "the terminal is gone");
        if (count > 0 && (fds[0].revents & POLLOUT) != 0)
            (void)client_flush(&p->link);
        if (count > 0 && (fds[0].revents & ~POLLOUT) != 0)
            read_emulator(p);
        for (int key; !p->is_over && (key = screen_key()) >= 0;)
            take_key(p, key);
        if (!p->waits && now_ms() >= p->ask_ms && !p->is_over)
            ask(p);
        watch_silence(p);
        if (p->is_changed && now_ms() >= p->draw_ms && !p->is_over)
            draw(p);
    }
}

static bool open_signals(panel *p)
{
    sigset_t caught;
    (void)sigemptyset(&caught);
    (void)sigaddset(&caught, SIGINT);
    (void)sigaddset(&caught, SIGQUIT);
    (void)sigaddset(&caught, SIGTERM);
    (void)sigaddset(&caught, SIGHUP);
    (void)sigprocmask(SIG_BLOCK, &caught, NULL);
    p->signals = signalfd(-1, &caught, SFD_NONBLOCK | SFD_CLOEXEC);
    return p->signals >= 0;
}

/* -- Options ------------------------------------------------------------------------------------------------------------- */

const char *argp_program_version = "dryrig-panel " DRYRIG_VERSION;

typedef struct {
    const char *socket, *controller;
    bool is_own;
} options;

#define OWN 1

static error_t parse(int key, char *value, struct argp_state *state)
{
    options *const o = state->input;
    if (key == OWN) {
        o->is_own = true;
        return 0;
    }
    if (key != ARGP_KEY_ARG)
        return ARGP_ERR_UNKNOWN;
    if (state->arg_num > 1)
        argp_error(state, "'%s' is one word too many", value);
    *(state->arg_num == 0 ? &o->socket : &o->controller) = value;
    return 0;
}

int main(int argc, char **argv)
{
    static const struct argp_option known[] = {
        {"own", OWN, NULL, 0, "As 'dryrig-emu --panel' starts it: the emulator ends with this panel, and q says so", 0},
        {0}};
    static const struct argp argp = {
        known,
        parse,
        "SOCKET [CONTROLLER]",
        "Shows and works the panel of an emulated controller: its display, buttons and knobs, where its device is, and "
        "what goes over its wire. SOCKET is that of 'dryrig-emu ... --control SOCKET'; CONTROLLER is a name in a rig "
        "file. Press ? for help.\v"
        "Exit status: 0 ended as asked, 1 no emulator is there, or it has ended; 2 wrong options, or no terminal.",
        NULL,
        NULL,
        NULL};
    static panel p;
    options o = {NULL, "", false};
    argp_err_exit_status = 2;
    (void)argp_parse(&argp, argc, argv, 0, NULL, &o);
    if (o.socket == NULL) {
        (void)fprintf(stderr, "dryrig-panel: which emulator? dryrig-panel SOCKET, the one of dryrig-emu --control\n");
        return 2;
    }
    if (!isatty(STDIN_FILENO) || !isatty(STDOUT_FILENO)) {
        (void)fprintf(stderr, "dryrig-panel: a terminal is needed for input and output\n");
        return 2;
    }
    if (!client_open(&p.link, o.socket, p.why, sizeof p.why) || !open_signals(&p)) {
        (void)fprintf(stderr, "dryrig-panel: %s: %s\n", o.socket, p.why[0] != '\0' ? p.why : strerror(errno));
        return 1;
    }
    if (!screen_open()) {
        (void)fprintf(stderr, "dryrig-panel: the terminal '%s' cannot be drawn on (TERM)\n",
                      getenv("TERM") == NULL ? "" : getenv("TERM"));
        return 2;
    }
    p.detents = 10;
    p.is_own = o.is_own;
    model_init(&p.m, o.controller);
    if (!client_say(&p.link, "subscribe"))
        end(&p, 1, "no memory");
    run(&p);
    screen_close();
    if (p.why[0] != '\0')
        (void)fprintf(stderr, "dryrig-panel: %s: %s\n", o.socket, p.why);
    client_close(&p.link);
    (void)close(p.signals);
    return p.status;
}
