/* dr_controller.dot is true: whatever is done to a controller, its state changes along an arrow of the graph, and every
 * arrow of the graph happens. The argument is the path of dr_controller.dot. */
#include "dr_controller.h"

#include <stdio.h>
#include <string.h>
#include <unity.h>

static const char *const names[] = {
    [DR_STATE_OFF] = "off",       [DR_STATE_BOOTING] = "booting", [DR_STATE_REST] = "rest",
    [DR_STATE_MOVING] = "moving", [DR_STATE_PAUSED] = "paused",   [DR_STATE_STRANDED] = "stranded",
    [DR_STATE_WEDGED] = "wedged",
};

#define STATES (sizeof names / sizeof names[0])

static bool drawn[STATES][STATES], has_node[STATES], happened[STATES][STATES];
static const char *dot_path;

void setUp(void) {}
void tearDown(void) {}

/* -- The graph --------------------------------------------------------------------------------------------------- */

static unsigned state_named(const char *name)
{
    for (unsigned state = 0; state < STATES; state++)
        if (names[state] != NULL && strcmp(name, names[state]) == 0)
            return state;
    TEST_FAIL_MESSAGE(name);
    return 0;
}

/* Lines of the kinds "a [label=...", "a -> b [label=..."; everything else begins differently. */
static void read_graph(void)
{
    char line[256], from[32], to[32];
    FILE *const dot = fopen(dot_path, "r");
    TEST_ASSERT_NOT_NULL_MESSAGE(dot, dot_path);
    while (fgets(line, sizeof line, dot) != NULL) {
        if (sscanf(line, " %31[a-z] -> %31[a-z] [", from, to) == 2)
            drawn[state_named(from)][state_named(to)] = true;
        else if (sscanf(line, " %31[a-z] [label=%1s", from, to) == 2)
            has_node[state_named(from)] = true;
    }
    (void)fclose(dot);
}

/* -- A controller to which everything is done ---------------------------------------------------------------------- */

typedef struct {
    dr_controller c;
    dr_drive drives[2];
    dr_us now;
    uint32_t seed;
} bench;

static uint32_t chance(bench *b, uint32_t below)
{
    b->seed = b->seed * UINT32_C(1664525) + UINT32_C(1013904223);
    return below > 1 ? (b->seed >> 16) % below : 0;
}

static void went(const bench *b, uint8_t before)
{
    const uint8_t after = b->c.state;
    char what[64];
    if (after == before)
        return;
    (void)snprintf(what, sizeof what, "%s -> %s is not in the graph", names[before], names[after]);
    TEST_ASSERT_TRUE_MESSAGE(drawn[before][after], what);
    happened[before][after] = true;
}

/* To the next instant at which something happens, at most so far. */
static void pass(bench *b, dr_us span_us)
{
    const dr_us until = b->now + span_us;
    const uint8_t before = b->c.state;
    const uint8_t leg = b->c.move_leg;
    dr_us when;
    uint8_t byte;
    b->now = dr_controller_due(&b->c, &when) && dr_us_before(when, until) ? when : until;
    (void)dr_controller_pull(&b->c, b->now, &byte, 0);
    if (before == DR_STATE_MOVING && b->c.state == DR_STATE_MOVING && b->c.move_leg != leg)
        happened[DR_STATE_MOVING][DR_STATE_MOVING] = true;
    went(b, before);
}

static void pull(bench *b)
{
    uint8_t byte;
    const uint8_t before = b->c.state;
    (void)dr_controller_pull(&b->c, b->now, &byte, 1);
    went(b, before);
}

static void push(bench *b, uint8_t byte)
{
    const uint8_t before = b->c.state;
    dr_controller_push(&b->c, b->now, &byte, 1);
    went(b, before);
}

static void send_command(bench *b)
{
    dr_command command;
    uint8_t rows = 0;
    while (dr_command_row((dr_kind)b->c.kind, rows, &command))
        rows++;
    (void)dr_command_row((dr_kind)b->c.kind, (uint8_t)chance(b, rows), &command);
    push(b, command.code);
    if (chance(b, 2) == 0)
        dr_controller_paused(&b->c, 30000);
    for (uint8_t i = 0; i < command.args; i++) {
        /* coordinates up to 65,535 and, at times, "negative" ones */
        const bool high = command.args >= DR_ARGS_AXIS && (command.args - i) % 4u <= 2u && (command.args - i) % 4u > 0;
        push(b, high ? (chance(b, 9) == 0 ? 0xFF : 0) : (uint8_t)chance(b, 256));
    }
}

static void use_hands(bench *b)
{
    static const dr_stage_id stages[] = {DR_STAGE_TRIO_MP845, DR_STAGE_MPC_MP225};
    dr_hand hand = {.steps = {1000, 0, 5000}};
    hand.what = (uint8_t)chance(b, DR_HAND_PLACE + 1);
    hand.drive = (uint8_t)chance(b, b->c.drive_count);
    hand.stage = (uint8_t)(b->drives[hand.drive].stage != DR_STAGE_NONE ? DR_STAGE_NONE : stages[b->c.kind]);
    const uint8_t before = b->c.state;
    (void)dr_controller_poke(&b->c, b->now, &hand);
    went(b, before);
}

static void press_buttons(bench *b)
{
    const uint8_t before = b->c.state;
    const dr_effect effect = (dr_effect)chance(b, DR_EFFECT_STORE_WORK + 1);
    (void)dr_controller_apply(&b->c, b->now, effect, (uint8_t)chance(b, 100));
    went(b, before);
}

static void live(dr_kind kind, uint16_t quirks, uint32_t seed)
{
    static bench b;
    memset(&b, 0, sizeof b);
    b.seed = seed;
    dr_controller_init(&b.c, kind, b.drives, kind == DR_TRIO ? 1 : 2);
    for (uint8_t i = 0; i < b.c.drive_count; i++)
        dr_drive_init(&b.drives[i], kind == DR_TRIO ? DR_STAGE_TRIO_MP845 : DR_STAGE_MPC_MP225);
    b.c.quirks = quirks;
    b.c.calibrates_at_power_on = seed % 2u == 0;
    dr_controller_start(&b.c, b.now);
    for (unsigned step = 0; step < 2000; step++) {
        const uint32_t what = chance(&b, 100);
        if (what < 25)
            send_command(&b);
        else if (what < 50)
            pass(&b, chance(&b, 1000000));
        else if (what < 75)
            pull(&b);
        else if (what < 90)
            press_buttons(&b);
        else
            use_hands(&b);
    }
}

/* -- Tests ------------------------------------------------------------------------------------------------------- */

static void test_every_state_is_drawn(void)
{
    read_graph();
    for (unsigned state = 0; state < STATES; state++)
        TEST_ASSERT_TRUE_MESSAGE(has_node[state], names[state]);
}

static void test_every_change_is_an_arrow_and_every_arrow_happens(void)
{
    char what[64];
    for (uint32_t seed = 0; seed < 40; seed++)
        for (int kind = DR_TRIO; kind <= DR_MPC; kind++) {
            live((dr_kind)kind, 0, seed);
            live((dr_kind)kind, DR_QUIRK_BOOT_SECOND | DR_QUIRK_ENDLESS_NEGATIVE | DR_QUIRK_PAUSE_ON_STOP, seed);
            live((dr_kind)kind, DR_QUIRK_S_NEEDS_PAUSE | DR_QUIRK_ENDLESS_NEGATIVE | DR_QUIRK_SMALL_MOVE_SILENT, seed);
            live((dr_kind)kind, DR_QUIRK_QUERY_WEDGES, seed);
        }
    for (unsigned from = 0; from < STATES; from++)
        for (unsigned to = 0; to < STATES; to++) {
            (void)snprintf(what, sizeof what, "%s -> %s never happens", names[from], names[to]);
            TEST_ASSERT_TRUE_MESSAGE(!drawn[from][to] || happened[from][to], what);
        }
}

int main(int argc, char **argv)
{
    if (argc != 2) {
        (void)fprintf(stderr, "%s dr_controller.dot: which graph?\n", argv[0]);
        return 2;
    }
    dot_path = argv[1];
    UNITY_BEGIN();
    RUN_TEST(test_every_state_is_drawn);
    RUN_TEST(test_every_change_is_an_arrow_and_every_arrow_happens);
    return UNITY_END();
}
