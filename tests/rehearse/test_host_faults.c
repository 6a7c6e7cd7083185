/* The host library and every fault that dryrig-emu can do, through its pseudo-terminal, with both controllers: each operation,
 * with the fault striking at its first opportunity, after the first command, after the second, ... until it comes too late.
 *
 * Whatever happens: an operation has succeeded, and then the stage is where it says; or it fails with one of the errors that
 * the fault may bring, and a sentence. It never tells a wrong position, and returns within the time that dryrig.h promises.
 * Afterwards the library gets back in step as dryrig.h says, and moves the stage to where it is told.
 *
 *     test_host_faults EMULATOR [STRIDE [SEEDS]]     strikes at every STRIDEth moment (1), with so many seeds (1) */
#define _GNU_SOURCE
#include "step_rig.h"

#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unity.h>

#define MS_US UINT64_C(1000)
#define S_US (1000 * MS_US)
#define WRITES_MAX 60u /* that an operation takes */
#define SETTLED_US (30 * S_US)

static const char *emulator;
static unsigned stride = 1, seeds = 1;
static step_rig rig;
static dryrig *d;

void setUp(void) {}
void tearDown(void) {}

/* -- Operations ------------------------------------------------------------------------------------------------------------ */

typedef enum { TRIO = DRYRIG_TRIO, MPC = DRYRIG_MPC } kind;

/* What an operation has told. */
typedef struct {
    bool has_end; /* `end` was asked for */
    dryrig_position end;
    const int32_t *target; /* it was to go there */
} told;

static const int32_t start_steps[DRYRIG_AXES] = {3000, 4000, 5000};
static const int32_t near_steps[DRYRIG_AXES] = {4600, 3205, 5013}; /* 13 is a CR */
static const int32_t far_steps[DRYRIG_AXES] = {3000, 7333, 9999};

static int op_position(told *t)
{
    t->has_end = true;
    return dryrig_get_position(d, &t->end);
}

static int op_move(told *t)
{
    t->has_end = true;
    t->target = near_steps;
    return dryrig_move_steps(d, near_steps, DRYRIG_ORDER_AUTO, &t->end);
}

static int op_move_in_home_order(told *t)
{
    t->has_end = true;
    t->target = near_steps;
    return dryrig_move_steps(d, near_steps, DRYRIG_ORDER_HOME, &t->end);
}

static int op_line(told *t)
{
    t->has_end = true;
    t->target = near_steps;
    return dryrig_line_steps(d, near_steps, 15, false, &t->end);
}

static unsigned long streamed, off_the_line; /* positions: all, and those that the stage never comes by */
static bool is_stalled;                      /* it does not go in a straight line */

/* In 1,600ths of the way, which X goes one by one. */
static void see_streamed(void *context, const dryrig_motion *motion)
{
    (void)context;
    if (!motion->streamed)
        return;
    const int32_t gone = motion->position.steps[DRYRIG_X] - start_steps[DRYRIG_X];
    bool is_right = gone > 0 && gone % 16 == 0;
    for (int axis = 0; axis < DRYRIG_AXES; axis++) {
        const int32_t way = near_steps[axis] - start_steps[axis];
        const int32_t off = (motion->position.steps[axis] - start_steps[axis]) * 1600 - way * gone;
        is_right = is_right && off > -1600 * 2 && off < 1600 * 2; /* X is told rounded down */
    }
    streamed++;
    off_the_line += !is_right && !is_stalled;
}

static int op_stream(told *t)
{
    t->has_end = true;
    t->target = near_steps;
    dryrig_watch(d, see_streamed, NULL);
    const int result = dryrig_line_steps(d, near_steps, 7, true, &t->end);
    dryrig_watch(d, NULL, NULL);
    return result;
}

static void stop_it(void *context, const dryrig_motion *motion)
{
    (void)context;
    (void)motion;
    (void)dryrig_interrupt(d);
}

static int op_interrupt(told *t)
{
    t->has_end = true;
    dryrig_watch(d, stop_it, NULL);
    const int result = dryrig_line_steps(d, far_steps, 0, false, &t->end);
    dryrig_watch(d, NULL, NULL);
    dryrig_clear_interrupt(d);
    t->target = result == DRYRIG_OK ? far_steps : NULL; /* it was there before */
    return result == DRYRIG_ERR_INTERRUPTED ? DRYRIG_OK : result;
}

static int op_axis(told *t)
{
    static const int32_t one[DRYRIG_AXES] = {3000, 4000, 5500};
    t->has_end = true;
    t->target = one;
    return dryrig_axis_steps(d, DRYRIG_Z, one[DRYRIG_Z], &t->end);
}

static int op_home(told *t)
{
    t->has_end = true;
    return dryrig_home(d, &t->end);
}

static int op_work(told *t)
{
    int result = dryrig_home(d, &t->end);
    if (result == DRYRIG_OK)
        result = dryrig_work(d, &t->end);
    t->has_end = true;
    return result;
}

static int op_calibrate(told *t)
{
    t->has_end = true;
    return dryrig_calibrate(d, &t->end);
}

static int op_stop(told *t)
{
    t->has_end = true;
    return dryrig_stop(d, &t->end);
}

static int op_angle(told *t)
{
    (void)t;
    return dryrig_set_angle(d, 45);
}

static int op_select(told *t)
{
    (void)t;
    return dryrig_select(d, 2);
}

static int op_mode(told *t)
{
    (void)t;
    return dryrig_set_mode(d, 4);
}

static int op_info(told *t)
{
    dryrig_info info;
    (void)t;
    memset(&info, 0, sizeof info);
    const int result = dryrig_get_info(d, &info);
    if (result == DRYRIG_OK && info.controller == DRYRIG_MPC)
        TEST_ASSERT_TRUE(info.firmware == 0x0321 && info.drive == 1 && info.drives == 2 && info.connected[0] &&
                         info.connected[1] && !info.connected[2] && !info.connected[3]);
    return result;
}

static int op_resync(told *t)
{
    (void)t;
    return dryrig_resync(d);
}

/* What an operation offers to faults. */
enum {
    ANSWERS = 1,
    FRAMES = 2,
    HOST_BYTES = 4,
    STOPS = 8,
    COMMANDS = 16,
    LEGS = 32,
    X_MOVES = 64,
    Y_MOVES = 128,
    Z_MOVES = 256,
    ALL = ANSWERS | HOST_BYTES | COMMANDS,
    ALL_MOVE = LEGS | X_MOVES | Y_MOVES | Z_MOVES
};

typedef struct {
    const char *name;
    int (*run)(told *t);
    uint64_t limit_us; /* dryrig.h, BLOCKING */
    unsigned kinds;    /* bits 1 << kind */
    unsigned offers;
} operation;

#define BOTH (1u << TRIO | 1u << MPC)
#define QUERY_US (12 * S_US)    /* two questions asked twice; in doubt, silence and two more before each */
#define MOTION_US (30 * S_US)   /* 3 x at most 3 s, 2 s; questions before and behind */
#define UNKNOWN_US (160 * S_US) /* to where nobody knows: 3 x 50 s, the travel to and fro, axis by axis, at 3 mm/s */

static const operation operations[] = {
    {"position", op_position, QUERY_US, BOTH, ALL},
    {"info", op_info, 2 * QUERY_US, 1u << MPC, ALL},
    {"angle", op_angle, QUERY_US, 1u << TRIO, ALL},
    {"select", op_select, QUERY_US, 1u << MPC, ALL},
    {"mode", op_mode, QUERY_US, 1u << MPC, ALL},
    {"resync", op_resync, QUERY_US, BOTH, ALL},
    {"stop", op_stop, QUERY_US, BOTH, ALL | STOPS},
    {"move", op_move, MOTION_US, BOTH, ALL | ALL_MOVE},
    {"move in home order", op_move_in_home_order, MOTION_US, 1u << TRIO, ALL | ALL_MOVE},
    {"axis", op_axis, MOTION_US, BOTH, ALL | LEGS | Z_MOVES},
    {"line", op_line, MOTION_US, BOTH, ALL | ALL_MOVE},
    {"stream", op_stream, MOTION_US, 1u << MPC, ALL | ALL_MOVE | FRAMES},
    {"interrupt", op_interrupt, MOTION_US, BOTH, ALL | LEGS | Y_MOVES | Z_MOVES | STOPS},
    {"home", op_home, UNKNOWN_US, BOTH, ALL | ALL_MOVE},
    {"work", op_work, 2 * UNKNOWN_US, BOTH, ALL | ALL_MOVE},
    {"calibrate", op_calibrate, UNKNOWN_US, BOTH, ALL | ALL_MOVE},
};
#define OPERATIONS (sizeof operations / sizeof operations[0])

/* -- Faults ---------------------------------------------------------------------------------------------------------------- */

#define BIT(n) (UINT64_C(1) << (n))
#define E(error) BIT(-(DRYRIG_ERR_##error))

typedef struct {
    const char *name; /* as the program lists it */
    const char *more; /* what stands behind it */
    uint64_t errors;  /* that it may bring: bits 1 << -error */
    unsigned strikes; /* what it needs, of `offers` */
    bool needs_power; /* the documented way back may be a power cycle */
} fault_row;

#define NO_CR (E(TIMEOUT) | E(CANNOT_STOP)) /* of a motion, of a stop; a question is asked again */

static const fault_row rows[] = {
    {"drop-byte", "", NO_CR, ANSWERS, false},
    {"delay-byte", "", 0, ANSWERS, false},
    {"delay-byte", "9s", NO_CR, ANSWERS, false},
    {"duplicate-byte", "", 0, ANSWERS, false},
    {"corrupt-byte", "", NO_CR, ANSWERS, false},
    {"drop-cr", "", NO_CR, ANSWERS, false},
    {"late-cr", "", 0, ANSWERS, false},
    {"late-cr", "2s", E(CANNOT_STOP), ANSWERS, false},
    {"late-cr", "9s", NO_CR, ANSWERS, false},
    {"stray-bytes", "", 0, ANSWERS, false},
    {"slow-answer", "", 0, ANSWERS, false},
    {"slow-answer", "9s", NO_CR, ANSWERS, false},
    {"short-frame", "", 0, FRAMES, false}, /* streamed positions are shown; the end is asked for */
    {"torn-frame", "", 0, FRAMES, false},
    {"torn-frame", "1s", 0, FRAMES, false},
    {"lose-host-byte", "", NO_CR, HOST_BYTES, true},
    {"ignore-stop", "", E(CANNOT_STOP), STOPS, false},
    {"wedge", "", NO_CR, COMMANDS, true},
    {"stall-axis", "x", E(ELSEWHERE), X_MOVES, false},
    {"stall-axis", "y", E(ELSEWHERE), Y_MOVES, false},
    {"stall-axis", "z", E(ELSEWHERE), Z_MOVES, false},
    {"slip-axis", "z", 0, Z_MOVES, false}, /* no host can see it: everything succeeds, and the tip is elsewhere */
    {"slow-motion", "", 0, LEGS, false},
    {"slow-motion", "20", E(TIMEOUT), LEGS, false},
    {"power-loss", "", E(TIMEOUT), LEGS, false},
    {"power-loss", "9s", E(TIMEOUT), LEGS, false},
    {"power-loss-forget", "", E(TIMEOUT), LEGS, false}, /* positions begin at 0, and no host can see that either */
    {"usb-unplug", "", E(LINK), COMMANDS, false},
};
#define ROWS (sizeof rows / sizeof rows[0])

/* -- One scenario ---------------------------------------------------------------------------------------------------------- */

typedef struct {
    const fault_row *fault;
    const operation *op;
    kind controller;
    unsigned seed, after; /* so many writes of the library */
} scenario;

static unsigned long scenarios, failures, wrong_positions;
static uint64_t errors_seen[ROWS + 1]; /* the last: of a row of no table */

__attribute__((format(printf, 2, 3))) static void complain(const scenario *s, const char *format, ...)
{
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    /* NOLINTNEXTLINE(clang-analyzer-valist.Uninitialized): the analyzer of LLVM 14 overlooks va_start() */
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    failures++;
    (void)printf("%s, fault %s%s%s, %s, after %u writes, seed %u: %s\n", s->controller == TRIO ? "trio" : "mpc",
                 s->fault->name, *s->fault->more == '\0' ? "" : " ", s->fault->more, s->op->name, s->after, s->seed,
                 text);
}

static bool ask_once;

static dryrig_options options_for(kind controller)
{
    dryrig_options options = dryrig_defaults(controller == TRIO ? DRYRIG_TRIO : DRYRIG_MPC);
    options.stage[0] = controller == TRIO ? "MP-845" : "MP-225";
    options.stage[1] = options.stage[0];
    options.ask_once = ask_once;
    return options;
}

static void open_port(kind controller)
{
    dryrig_link link;
    dryrig_options options = options_for(controller);
    TEST_ASSERT_EQUAL(DRYRIG_OK, step_rig_link(&rig, &link, options.baud));
    options.link = &link;
    TEST_ASSERT_EQUAL(DRYRIG_OK, dryrig_open(&d, &options, NULL, 0));
}

static void close_port(void)
{
    dryrig_close(d);
    d = NULL;
}

static bool is_there(const int32_t is[DRYRIG_AXES], const int32_t wanted[DRYRIG_AXES])
{
    return memcmp(is, wanted, sizeof(int32_t[DRYRIG_AXES])) == 0;
}

static bool rule_is_left(void)
{
    cJSON *const answer = step_rig_ask(&rig, "faults");
    const bool left = cJSON_GetArraySize(cJSON_GetObjectItemCaseSensitive(answer, "active")) > 0;
    cJSON_Delete(answer);
    return left;
}

static void check_told(const scenario *s, int result, const told *t)
{
    int32_t truth[DRYRIG_AXES];
    const bool tells = result == DRYRIG_OK || (t->has_end && t->end.drive != -1 && (s->op->offers & LEGS) != 0);
    if (!t->has_end || !tells)
        return;
    step_rig_steps(&rig, "position_steps", truth);
    wrong_positions += !is_there(t->end.steps, truth);
    if (!is_there(t->end.steps, truth))
        complain(s, "%s: tells %d %d %d, and it is at %d %d %d", dryrig_error_name(result), t->end.steps[0],
                 t->end.steps[1], t->end.steps[2], truth[0], truth[1], truth[2]);
    if (result == DRYRIG_OK && t->target != NULL && !is_there(truth, t->target))
        complain(s, "ok, and it is at %d %d %d", truth[0], truth[1], truth[2]);
}

/* What no host can see. A line moves all axes in one leg. */
static void check_slip(const scenario *s)
{
    int32_t steps[DRYRIG_AXES], tip[DRYRIG_AXES];
    if (strcmp(s->fault->name, "slip-axis") != 0 || s->op->run != op_line)
        return;
    step_rig_steps(&rig, "position_steps", steps);
    step_rig_steps(&rig, "tip_steps", tip);
    if (is_there(steps, tip))
        complain(s, "the tip has gone along");
}

static void check_result(const scenario *s, int result, uint64_t spent_us)
{
    const bool is_row = s->fault >= rows && s->fault < rows + ROWS;
    const size_t row = is_row ? (size_t)(s->fault - rows) : ROWS;
    if (spent_us > s->op->limit_us)
        complain(s, "%s after %llu ms", dryrig_error_name(result), (unsigned long long)(spent_us / MS_US));
    if (result == DRYRIG_OK)
        return;
    errors_seen[row] |= BIT(-result);
    if ((s->fault->errors & BIT(-result)) == 0 || dryrig_fault_of(result) == DRYRIG_FAULT_CALLER)
        complain(s, "an error that it should not bring: %s: %s", dryrig_error_name(result), dryrig_why(d));
    if (strlen(dryrig_why(d)) < 10)
        complain(s, "%s without a reason", dryrig_error_name(result));
}

/* The way back that dryrig.h describes: the next call gets in step by itself; after LINK the port is opened anew; OUT_OF_STEP wants a person to look, to switch the
 * controller off and on where the stage stands short of its target, and dryrig_resync(). */
static void check_recovery(const scenario *s, int result)
{
    dryrig_position p;
    int32_t truth[DRYRIG_AXES];
    if (result == DRYRIG_ERR_LINK) {
        close_port();
        step_rig_advance(&rig, SETTLED_US); /* the plug is in again */
        open_port(s->controller);
    }
    result = dryrig_get_position(d, &p);
    for (int tries = 0; tries < 3 && (result == DRYRIG_ERR_CHANGING || result == DRYRIG_ERR_GARBLED); tries++)
        result = dryrig_get_position(d, &p); /* it moves, or what was late comes: it will be over */
    if (result == DRYRIG_ERR_OUT_OF_STEP || result == DRYRIG_ERR_TIMEOUT) {
        if (s->fault->needs_power)
            step_rig_do(&rig, "power cycle");
        step_rig_advance(&rig, SETTLED_US);
        result = dryrig_resync(d);
        if (result == DRYRIG_OK)
            result = dryrig_get_position(d, &p);
    }
    if (result != DRYRIG_OK) {
        complain(s, "does not get back in step: %s: %s", dryrig_error_name(result), dryrig_why(d));
        return;
    }
    step_rig_steps(&rig, "position_steps", truth);
    if (!is_there(p.steps, truth))
        complain(s, "back in step it tells %d %d %d, and it is at %d %d %d", p.steps[0], p.steps[1], p.steps[2],
                 truth[0], truth[1], truth[2]);
    if (s->op->run == op_select)
        result = dryrig_select(d, p.drive);
    if (result == DRYRIG_OK)
        result = dryrig_move_steps(d, start_steps, DRYRIG_ORDER_AUTO, &p);
    step_rig_steps(&rig, "position_steps", truth);
    if (result != DRYRIG_OK || !is_there(truth, start_steps))
        complain(s, "the next move: %s: %s; it is at %d %d %d", dryrig_error_name(result), dryrig_why(d), truth[0],
                 truth[1], truth[2]);
}

static void put_in_order(kind controller)
{
    step_rig_do(&rig, "set position 1 %d,%d,%d", start_steps[0], start_steps[1], start_steps[2]);
    step_rig_do(&rig, "set work 1 3100,3100,3100");
    if (controller == TRIO)
        step_rig_do(&rig, "set angle 30");
    else
        step_rig_do(&rig, "set position 2 %d,%d,%d", start_steps[0], start_steps[1], start_steps[2]);
}

/* False: the operation was over before the fault's time came. */
static bool play(const scenario *s)
{
    dryrig_position p;
    told t;
    memset(&t, 0, sizeof t);
    put_in_order(s->controller);
    open_port(s->controller);
    if (s->controller == MPC)
        TEST_ASSERT_EQUAL_MESSAGE(DRYRIG_OK, dryrig_select(d, 1), dryrig_why(d));
    TEST_ASSERT_EQUAL_MESSAGE(DRYRIG_OK, dryrig_get_position(d, &p), dryrig_why(d));
    is_stalled = strcmp(s->fault->name, "stall-axis") == 0;
    (void)snprintf(rig.line, sizeof rig.line, "fault %s %s", s->fault->name, s->fault->more);
    rig.before_write = s->after + 1;
    const uint64_t began_us = rig.now_us;
    const int result = s->op->run(&t);
    const bool has_struck = rig.before_write == 0 && !rule_is_left();
    rig.before_write = 0;
    scenarios++;
    check_told(s, result, &t);
    check_result(s, result, rig.now_us - began_us);
    if (has_struck)
        check_slip(s);
    step_rig_do(&rig, "fault off");
    check_recovery(s, result);
    close_port();
    step_rig_advance(&rig, SETTLED_US);
    return has_struck;
}

static void sweep_operation(scenario *s)
{
    const bool may_strike = (s->op->offers & s->fault->strikes) != 0;
    bool has_struck = may_strike || stride == 1; /* that nothing strikes takes as long as something that does */
    for (s->after = 0; has_struck && s->after < WRITES_MAX; s->after += stride) {
        has_struck = play(s);
        if (s->after == 0 && has_struck != may_strike)
            complain(s, has_struck ? "it strikes" : "it does not strike");
    }
}

static void sweep_fault(const fault_row *fault, kind controller, unsigned seed)
{
    char text[16];
    (void)snprintf(text, sizeof text, "%u", seed);
    const char *const options[] = {"--seed", text, NULL};
    step_rig_start(&rig, emulator, controller == TRIO ? "trio" : "mpc", options);
    for (size_t op = 0; op < OPERATIONS; op++) {
        scenario s = {fault, &operations[op], controller, seed, 0};
        if ((operations[op].kinds & 1u << controller) != 0)
            sweep_operation(&s);
    }
    step_rig_stop(&rig);
}

static void sweep(kind controller)
{
    for (size_t row = 0; row < ROWS; row++)
        for (unsigned seed = 1; seed <= seeds; seed++)
            sweep_fault(&rows[row], controller, seed);
    TEST_ASSERT_EQUAL_UINT(0, failures);
    TEST_ASSERT_EQUAL_UINT(0, off_the_line);
}

static void every_fault_with_a_trio(void) { sweep(TRIO); }
static void every_fault_with_an_mpc(void) { sweep(MPC); }

/* These tests can fail: a library that believes a first answer tells wrong positions, and they notice. */
static void believing_a_first_answer_is_noticed(void)
{
    static const fault_row corrupt = {"corrupt-byte", "", ~UINT64_C(0), ANSWERS, false};
    const char *const options[] = {"--seed", "1", NULL};
    scenario s = {&corrupt, &operations[0], MPC, 1, 0};
    unsigned long before;
    ask_once = true;
    (void)printf("this is meant to be: ");
    step_rig_start(&rig, emulator, "mpc", options);
    for (before = wrong_positions; before == wrong_positions && s.seed < 50; s.seed++)
        (void)play(&s);
    step_rig_stop(&rig);
    ask_once = false;
    TEST_ASSERT_GREATER_THAN(before, wrong_positions);
    failures = 0;
}

/* A fault that is new must come with its row. */
static void every_fault_of_the_program_has_its_row(void)
{
    const char *const options[] = {NULL};
    const cJSON *entry;
    step_rig_start(&rig, emulator, "mpc", options);
    cJSON *const answer = step_rig_ask(&rig, "faults");
    const cJSON *const list = cJSON_GetObjectItemCaseSensitive(answer, "faults");
    size_t row = 0;
    cJSON_ArrayForEach(entry, list)
    {
        const char *const name = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(entry, "fault"));
        TEST_ASSERT_TRUE_MESSAGE(row < ROWS, name);
        TEST_ASSERT_EQUAL_STRING(name, rows[row].name); /* in the program's order */
        while (row < ROWS && strcmp(rows[row].name, name) == 0)
            row++;
    }
    TEST_ASSERT_EQUAL_UINT(ROWS, row);
    cJSON_Delete(answer);
    step_rig_stop(&rig);
}

static void tell_errors(const char *what, uint64_t errors)
{
    (void)printf(" %s:", what);
    for (int error = 1; error < 64; error++)
        if ((errors & BIT(error)) != 0)
            (void)printf(" %s", dryrig_error_name(-error));
}

/* What a row says that a fault may bring, it does bring. */
static void every_error_of_a_row_comes(void)
{
    for (size_t row = 0; row < ROWS; row++)
        if (rows[row].errors != errors_seen[row]) {
            (void)printf("%s %s", rows[row].name, rows[row].more);
            tell_errors("expected", rows[row].errors);
            tell_errors("came", errors_seen[row]);
            (void)printf("\n");
            failures++;
        }
    TEST_ASSERT_EQUAL_UINT(0, failures);
}

int main(int argc, char **argv)
{
    if (argc < 2)
        return 2;
    emulator = argv[1];
    stride = argc > 2 ? (unsigned)strtoul(argv[2], NULL, 10) : 1;
    seeds = argc > 3 ? (unsigned)strtoul(argv[3], NULL, 10) : 1;
    UNITY_BEGIN();
    RUN_TEST(every_fault_of_the_program_has_its_row);
    RUN_TEST(believing_a_first_answer_is_noticed);
    RUN_TEST(every_fault_with_a_trio);
    RUN_TEST(every_fault_with_an_mpc);
    if (stride == 1)
        RUN_TEST(every_error_of_a_row_comes);
    (void)printf("%lu scenarios, %lu streamed positions\n", scenarios, streamed);
    return UNITY_END();
}
