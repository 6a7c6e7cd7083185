#include "screen.h"

#include "controls.h" /* buttons and their keys */
#include "terminal.h" /* is it one? */

#include "dr_words.h" /* names, numbers */

#include <curses.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LEFT 27      /* columns of the display and the buttons */
#define VIEWS_MIN 12 /* rows */
#define LOG_INDENT 14

enum { PAIR_PLAIN = 1, PAIR_GREEN, PAIR_BLUE, PAIR_RED, PAIR_HOST, PAIR_UNIT };

/* -- The terminal -------------------------------------------------------------------------------------------------------- */

static bool is_open;

void screen_close(void)
{
    if (is_open)
        (void)endwin();
    is_open = false;
}

bool screen_open(void)
{
    (void)setlocale(LC_ALL, "");
    if (!terminal_is_known()) /* newterm() would not leave everything as it was */
        return false;
    if (newterm(NULL, stdout, stdin) == NULL)
        return false;
    is_open = true;
    (void)atexit(screen_close);
    (void)cbreak();
    (void)noecho();
    (void)nonl();
    (void)nodelay(stdscr, TRUE);
    (void)keypad(stdscr, TRUE);
    (void)set_escdelay(25);
    (void)curs_set(0);
    if (has_colors()) {
        (void)start_color();
        (void)use_default_colors();
        (void)init_pair(PAIR_PLAIN, COLOR_BLACK, COLOR_WHITE);
        (void)init_pair(PAIR_GREEN, COLOR_BLACK, COLOR_GREEN);
        (void)init_pair(PAIR_BLUE, COLOR_WHITE, COLOR_BLUE);
        (void)init_pair(PAIR_RED, COLOR_WHITE, COLOR_RED);
        (void)init_pair(PAIR_HOST, COLOR_CYAN, -1);
        (void)init_pair(PAIR_UNIT, COLOR_YELLOW, -1);
    }
    return true;
}

int screen_key(void)
{
    const int key = getch();
    return key == ERR ? -1 : key;
}

void screen_beep(void) { (void)beep(); }

/* -- Pieces -------------------------------------------------------------------------------------------------------------- */

/* Text that is cut at the end of its field. */
__attribute__((format(printf, 4, 5))) static void put(int row, int column, int width, const char *format, ...)
{
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    (void)mvaddnstr(row, column, text, width);
}

static void draw_box(int row, int column, int rows, int columns, const char *title)
{
    (void)mvaddch(row, column, ACS_ULCORNER);
    (void)mvhline(row, column + 1, ACS_HLINE, columns - 2);
    (void)mvaddch(row, column + columns - 1, ACS_URCORNER);
    (void)mvvline(row + 1, column, ACS_VLINE, rows - 2);
    (void)mvvline(row + 1, column + columns - 1, ACS_VLINE, rows - 2);
    (void)mvaddch(row + rows - 1, column, ACS_LLCORNER);
    (void)mvhline(row + rows - 1, column + 1, ACS_HLINE, columns - 2);
    (void)mvaddch(row + rows - 1, column + columns - 1, ACS_LRCORNER);
    put(row, column + 2, columns - 4, " %s ", title);
}

static void draw_title(const screen_view *v)
{
    const model *const m = v->m;
    char left[160], right[64];
    const char *const host = m->port[0] == '\0' ? "unplugged" : m->is_open ? "open" : "nobody has it open";
    (void)snprintf(left, sizeof left, " %s %s  %.24s: %s", dr_words_controller(m->kind), m->firmware,
                   m->port[0] == '\0' ? "USB" : m->port, host);
    if (m->controllers > 1) {
        const size_t length = strlen(left);
        (void)snprintf(left + length, sizeof left - length, "  '%.12s', Tab: next", m->name);
    }
    (void)snprintf(right, sizeof right, "%s%s %.3f s ", v->silent_s > 0 ? "NO ANSWER since " : "",
                   strcmp(m->clock, "real") == 0 ? "" : m->clock, (double)m->now_us / 1e6);
    (void)attrset(A_REVERSE);
    (void)mvhline(0, 0, ' ' | A_REVERSE, COLS);
    put(0, COLS - (int)strlen(right), (int)strlen(right), "%s", right);
    put(0, 0, COLS - (int)strlen(right) - 1, "%s", left);
    (void)attrset(A_NORMAL);
}

/* -- Display and buttons ------------------------------------------------------------------------------------------------- */

static void draw_display(const model *m)
{
    static const char *const names[MODEL_COLOURS] = {"dark", "display", "green", "blue", "red"};
    static const int pairs[MODEL_COLOURS] = {0, PAIR_PLAIN, PAIR_GREEN, PAIR_BLUE, PAIR_RED};
    char text[sizeof m->text];
    (void)snprintf(text, sizeof text, "%s", m->text);
    draw_box(1, 0, 6, LEFT, names[m->colour]);
    (void)attrset(COLOR_PAIR(pairs[m->colour]));
    char *rest = text;
    for (int row = 0; row < 4; row++) {
        const char *const line = rest == NULL ? NULL : strsep(&rest, "\n");
        put(2 + row, 1, LEFT - 2, " %-*s", LEFT - 3, line == NULL ? "" : line);
    }
    (void)attrset(A_NORMAL);
}

static bool is_down(const model *m, const char *button)
{
    char name[64];
    (void)snprintf(name, sizeof name, " %s ", button);
    return strstr(m->down, name) != NULL;
}

static void draw_buttons(const model *m)
{
    int row = 7;
    for (const control_button *b = controls_buttons(m->kind); b->key != 0; b++, row++) {
        const char *const led = strcmp(b->name, "diagonal") != 0 ? "" : m->led_diagonal ? "  (*) LED" : "  ( ) LED";
        put(row, 0, LEFT, " %c ", b->key);
        (void)attrset(is_down(m, b->name) ? A_REVERSE : A_BOLD);
        put(row, 3, LEFT - 3, "%s", b->label);
        (void)attrset(A_NORMAL);
        put(row, 3 + (int)strlen(b->label), LEFT - 3 - (int)strlen(b->label), "%s", led);
        if (b->held != NULL)
            put(row, 19, LEFT - 19, "%c %s", b->key - 'a' + 'A', b->held);
    }
    if (m->kind == DR_TRIO)
        put(row, 0, LEFT, " a capital holds it for 3 s");
    else
        put(row, 0, LEFT, " m M MANIPULATOR  + - MODE");
}

/* -- Views --------------------------------------------------------------------------------------------------------------- */

/* Where a place is in a window of so many cells, when one looks along an axis. */
typedef struct {
    int row, column, rows, columns; /* inside the box */
    const model_device *d;
    unsigned down_axis;
    bool is_up; /* the axis grows upward */
} window;

static int cell(uint32_t steps, uint32_t travel_steps, int cells)
{
    return travel_steps == 0 ? 0 : (int)((uint64_t)steps * (uint64_t)(cells - 1) / travel_steps);
}

static int row_of(const window *w, const uint32_t steps[DR_AXES])
{
    const int at = cell(steps[w->down_axis], w->d->stage.travel_steps[w->down_axis], w->rows);
    return w->row + (w->is_up ? w->rows - 1 - at : at);
}

static int column_of(const window *w, const uint32_t steps[DR_AXES])
{
    return w->column + cell(steps[DR_X], w->d->stage.travel_steps[DR_X], w->columns);
}

static void mark(const window *w, const uint32_t steps[DR_AXES], chtype what)
{
    (void)mvaddch(row_of(w, steps), column_of(w, steps), what);
}

static void draw_way(const window *w, const uint32_t from[DR_AXES], const uint32_t to[DR_AXES])
{
    const int row = row_of(w, from), column = column_of(w, from);
    const int rows = row_of(w, to) - row, columns = column_of(w, to) - column;
    const int longest = abs(rows) > abs(columns) ? abs(rows) : abs(columns);
    for (int i = 0; i <= longest; i++)
        (void)mvaddch(row + (longest == 0 ? 0 : rows * i / longest),
                      column + (longest == 0 ? 0 : columns * i / longest), ACS_BULLET);
}

static void draw_view(const model *m, const window *w)
{
    const model_device *const d = w->d;
    static const uint32_t zero[DR_AXES] = {0};
    if (!d->is_there) {
        put(w->row + w->rows / 2, w->column + 2, w->columns - 2, "nothing is connected");
        return;
    }
    const uint32_t *from = NULL;
    for (unsigned i = 0; i < d->path_count; i++) {
        const uint32_t *const to = d->path_steps[(d->path_first + i) % MODEL_PATH];
        draw_way(w, from == NULL ? to : from, to);
        from = to;
    }
    if (from != NULL)
        draw_way(w, from, d->at_steps);
    if (d->is_on_leg)
        mark(w, d->leg_to_steps, 'x');
    mark(w, m->kind == DR_TRIO ? m->home_steps : zero, 'H');
    if (d->work_is_set)
        mark(w, d->work_steps, 'W');
    mark(w, d->at_steps, 'O' | A_BOLD | A_REVERSE);
}

static void draw_views(const model *m, int rows)
{
    const model_device *const d = model_active(m);
    const int columns = (COLS - LEFT - 1) / 2, left = LEFT + 1;
    const window top = {2, left + 1, rows - 2, columns - 2, d, DR_Y, true};
    const window side = {2, left + columns + 1, rows - 2, columns - 2, d, DR_Z, false};
    draw_box(1, left, rows, columns, "above: X right Y up");
    draw_box(1, left + columns, rows, columns, "side: X right Z down");
    draw_view(m, &top);
    draw_view(m, &side);
}

/* -- Lines --------------------------------------------------------------------------------------------------------------- */

static void draw_knobs(const screen_view *v, int row)
{
    put(row, 0, COLS, " knobs: left right X   up down Y   PgUp PgDn Z%s   n: %u detent%s a key",
        v->m->kind == DR_TRIO ? "   [ ] D" : "", v->detents, v->detents == 1 ? "" : "s");
}

static int write_device(const model_device *d, unsigned number, bool has_name, char *out, size_t room)
{
    if (!d->is_there)
        return snprintf(out, room, " %u none ", number);
    return snprintf(out, room, " %u %s%s%.0f/%.0f/%.0f ", number, has_name ? d->name : "", has_name ? " " : "",
                    model_um(d, d->at_steps[DR_X]), model_um(d, d->at_steps[DR_Y]), model_um(d, d->at_steps[DR_Z]));
}

/* All devices, the active one marked; of a TRIO, whose device is one, the places that it knows. */
static void draw_places(const model *m, int row)
{
    if (m->kind == DR_TRIO) {
        const model_device *const d = model_active(m);
        char work[96] = "none is stored";
        if (d->work_is_set)
            (void)snprintf(work, sizeof work, "%.2f, %.2f, %.2f um", model_um(d, d->work_steps[DR_X]),
                           model_um(d, d->work_steps[DR_Y]), model_um(d, d->work_steps[DR_Z]));
        put(row, 0, COLS, " %s   H home %.2f, %.2f, %.2f um   W work %s", d->name, model_um(d, m->home_steps[DR_X]),
            model_um(d, m->home_steps[DR_Y]), model_um(d, m->home_steps[DR_Z]), work);
        return;
    }
    char text[DR_PORTS][96];
    for (unsigned has_names = 2; has_names-- > 0;) { /* where they have room */
        int width = 0;
        for (unsigned i = 0; i < m->device_count; i++)
            width += write_device(&m->devices[i], i + 1u, has_names == 1, text[i], sizeof text[i]);
        if (width <= COLS)
            break;
    }
    (void)move(row, 0);
    for (unsigned i = 0; i < m->device_count; i++) {
        (void)attrset(i == m->active && m->devices[i].is_there ? A_REVERSE : A_NORMAL);
        (void)addnstr(text[i], COLS - getcurx(stdscr));
        (void)attrset(A_NORMAL);
    }
}

static void draw_answer(const model *m, int row)
{
    const model_device *const d = model_active(m);
    const char letter = m->kind == DR_TRIO ? 'c' : 'C';
    char bytes[64], number[DR_AXES][24];
    if (m->colour == MODEL_DARK || !d->is_there || strcmp(m->state, "stranded") == 0 ||
        strcmp(m->state, "wedged") == 0) {
        put(row, 0, COLS, " %c: a host that asks where it is gets no answer now", letter);
        return;
    }
    if (m->moves) {
        put(row, 0, COLS, " %c waits for the end of the move; on the way there now:", letter);
    } else {
        model_position_answer(m, bytes);
        put(row, 0, COLS, " %c answers %s%s", letter, bytes,
            m->is_relative || m->led_diagonal ? "  absolute, always" : "");
    }
    for (unsigned axis = 0; axis < DR_AXES; axis++)
        (void)dr_words_number(number[axis], sizeof number[axis], d->at_steps[axis]);
    put(row + 1, 0, COLS, "   = X %s, Y %s, Z %s microsteps of %g um", number[DR_X], number[DR_Y], number[DR_Z],
        (double)d->stage.quanta_per_step / (double)DR_QUANTA_PER_UM);
    if (m->kind == DR_TRIO)
        (void)printw(", %u degrees", m->angle_deg);
    else
        (void)printw(", device %u", m->active + 1u);
}

/* Breaks a text between words into lines as wide as the screen, those behind the first indented. Puts lines `from` to `to`
 * (not included) at `row`. Returns how many lines there are. */
static int wrap(const char *text, int indent_behind, int row, int from, int to)
{
    int line = 0;
    for (; *text != '\0'; line++) {
        const int indent = line == 0 ? 0 : indent_behind, width = COLS - indent;
        int length = (int)strlen(text);
        if (length > width) {
            for (length = width; length > (width + 1) / 2 && text[length] != ' ';) /* a character at least */
                length--;
        }
        if (line >= from && line < to)
            put(row + line - from, indent, length, "%s", text);
        text += length;
        text += strspn(text, " ");
    }
    return line;
}

static void draw_log(const model *m, int row, int rows)
{
    static const char signs[] = {[MODEL_FROM_HOST] = '>', [MODEL_TO_HOST] = '<', [MODEL_HAPPENED] = '-'};
    static const int pairs[] = {[MODEL_FROM_HOST] = PAIR_HOST, [MODEL_TO_HOST] = PAIR_UNIT, [MODEL_HAPPENED] = 0};
    (void)mvhline(row, 0, ACS_HLINE, COLS);
    put(row, 2, COLS - 2, " the wire: > host, < controller ");
    int bottom = row + rows; /* the first row that is taken below */
    const model_entry *e;
    for (unsigned i = 0; bottom > row + 1 && (e = model_entry_at(m, i)) != NULL; i++) {
        char text[sizeof e->text + sizeof e->hex + 64];
        (void)snprintf(text, sizeof text, "%11.6f %c %s%s%s", (double)e->when_us / 1e6, signs[e->side], e->hex,
                       e->hex[0] == '\0' ? "" : "  ", e->text);
        const int lines = wrap(text, LOG_INDENT, 0, 0, 0);
        const int skipped = lines > bottom - row - 1 ? lines - (bottom - row - 1) : 0; /* no room for its beginning */
        bottom -= lines - skipped;
        (void)attrset(COLOR_PAIR(pairs[e->side]));
        (void)wrap(text, LOG_INDENT, bottom, skipped, lines);
        (void)attrset(A_NORMAL);
    }
}

static const char *what_q_does(const screen_view *v)
{
    return v->is_own ? "q ends the emulator too" : "q ends the panel alone";
}

/* What goes on by itself, and what keys are for. */
static void draw_hints(const screen_view *v, int row)
{
    if (v->m->waits_for_client)
        put(row, 0, COLS - 1, " the clock waits until a host opens the port   ? help   %s", what_q_does(v));
    else if (strcmp(v->m->clock, "step") == 0)
        put(row, 0, COLS - 1, " the clock stands: ':advance 1s' moves it   ? help   %s", what_q_does(v));
    else
        put(row, 0, COLS - 1, " ? help   o mains off, on   : any command   %s", what_q_does(v));
}

static void draw_last_line(const screen_view *v)
{
    const int row = LINES - 1;
    (void)attrset(v->prompt == NULL ? A_BOLD : A_NORMAL);
    if (v->prompt != NULL) {
        const int skip = (int)strlen(v->prompt) > COLS - 3 ? (int)strlen(v->prompt) - (COLS - 3) : 0;
        put(row, 0, COLS - 1, ":%s_", v->prompt + skip);
    } else if (v->silent_s > 0) {
        put(row, 0, COLS - 1, " The emulator has not answered for %u s. What is shown is old, and keys wait.",
            v->silent_s);
    } else if (v->message != NULL) {
        put(row, 0, COLS - 1, " %s", v->message);
    }
    (void)attrset(A_NORMAL);
    if (v->prompt == NULL && v->silent_s == 0 && v->message == NULL && v->m->is_shown)
        draw_hints(v, row);
}

/* -- The whole ----------------------------------------------------------------------------------------------------------- */

static void draw_help(const model *m)
{
    int row = 0;
    for (const char *const *line = controls_help(m->kind); *line != NULL && row < LINES - 2; line++)
        put(row++, 1, COLS - 1, "%s", *line);
    put(LINES - 1, 0, COLS - 1, " n detents a key   o mains   : a command of dryrig-control(7)   (any key: back)");
}

void screen_draw(const screen_view *v)
{
    const model *const m = v->m;
    (void)erase();
    if (COLS < SCREEN_COLUMNS || LINES < SCREEN_ROWS) {
        char text[128];
        (void)snprintf(text, sizeof text, "This panel needs %d x %d characters, here are %d x %d. Enlarge it; q quits.",
                       SCREEN_COLUMNS, SCREEN_ROWS, COLS, LINES);
        (void)wrap(text, 0, 0, 0, LINES);
    } else if (v->is_helping && m->is_known) {
        draw_help(m);
    } else if (!m->is_known || !m->is_shown) {
        put(0, 0, COLS, " waiting for the emulator ... (q quits)");
        if (v->silent_s > 0)
            put(2, 0, COLS, " It has not answered for %u s: it is stopped, or at work.", v->silent_s);
        else
            draw_last_line(v);
    } else {
        const int views = VIEWS_MIN + (LINES - SCREEN_ROWS) / 2;
        draw_title(v);
        draw_display(m);
        draw_buttons(m);
        draw_views(m, views);
        draw_knobs(v, views + 1);
        draw_places(m, views + 2);
        draw_answer(m, views + 3);
        draw_log(m, views + 5, LINES - views - 6);
        draw_last_line(v);
    }
    (void)refresh();
}
