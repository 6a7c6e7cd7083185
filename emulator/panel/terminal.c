#include "terminal.h"

#include <curses.h>
#include <stdio.h>
#include <unistd.h>

#include <term.h> /* last: its capabilities are macros with everyday names */

static bool read_capabilities(void)
{
    int wrong;
    return isatty(STDOUT_FILENO) && setupterm(NULL, STDOUT_FILENO, &wrong) == OK;
}

bool terminal_is_known(void)
{
    if (!read_capabilities())
        return false;
    const bool can_be_drawn_on = cursor_address != NULL; /* "dumb" is known too, and newterm() takes it */
    (void)del_curterm(cur_term);
    return can_be_drawn_on;
}

void terminal_keep(terminal *t) { t->is_kept = tcgetattr(STDIN_FILENO, &t->settings) == 0; }

void terminal_restore(const terminal *t)
{
    if (!t->is_kept)
        return;
    (void)tcsetattr(STDIN_FILENO, TCSAFLUSH, &t->settings);
    if (!read_capabilities())
        return;
    const char *const commands[] = {exit_attribute_mode, keypad_local, cursor_normal, exit_ca_mode};
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++)
        if (commands[i] != NULL)
            (void)putp(commands[i]);
    (void)fflush(stdout);
    (void)del_curterm(cur_term);
}
