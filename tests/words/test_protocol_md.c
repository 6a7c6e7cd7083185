/* PROTOCOL.md is true: its tables are those of the core, and its dialogues are what the emulated controllers say, byte by
 * byte, microsecond by microsecond, and word by word. The argument is the path of PROTOCOL.md. */
#include "dr_controller.h"
#include "dr_words.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unity.h>

#define LINE_MAX_BYTES 1024
#define CELLS_MAX 12

static FILE *page;
static unsigned line_number;
static char line[LINE_MAX_BYTES];
static char where[LINE_MAX_BYTES + 64]; /* for messages: the line and its number */

void setUp(void)
{
    rewind(page);
    line_number = 0;
}
void tearDown(void) {}

static bool next_line(void)
{
    if (fgets(line, sizeof line, page) == NULL)
        return false;
    line_number++;
    line[strcspn(line, "\n")] = '\0';
    (void)snprintf(where, sizeof where, "PROTOCOL.md:%u: %s", line_number, line);
    return true;
}

static bool begins_with(const char *text, const char *with) { return strncmp(text, with, strlen(with)) == 0; }

/* Goes on to the line after a heading, "## Quirks". */
static void go_to(const char *heading)
{
    while (next_line())
        if (strcmp(line, heading) == 0)
            return;
    TEST_FAIL_MESSAGE(heading);
}

/* The next row of a table before the next heading of this or a higher level, as cells without blanks around them. */
static size_t next_row(char cells[CELLS_MAX][LINE_MAX_BYTES], const char *stop_at)
{
    while (next_line()) {
        size_t count = 0;
        if (begins_with(line, stop_at))
            return 0;
        if (line[0] != '|' || line[1] == '-')
            continue;
        for (const char *at = line + 1; *at != '\0' && count < CELLS_MAX; count++) {
            const size_t length = strcspn(at, "|");
            size_t first = 0, last = length;
            while (first < last && at[first] == ' ')
                first++;
            while (last > first && at[last - 1] == ' ')
                last--;
            memcpy(cells[count], at + first, last - first);
            cells[count][last - first] = '\0';
            at += at[length] == '|' ? length + 1 : length;
        }
        return count;
    }
    return 0;
}

static uint32_t number_in(const char *text)
{
    uint32_t number = 0;
    for (; *text != '\0'; text++)
        if (*text >= '0' && *text <= '9')
            number = number * 10u + (uint32_t)(*text - '0');
    return number;
}

static uint32_t millionths_in(const char *text)
{
    const char *const point = strchr(text, '.');
    const size_t decimals = point == NULL ? 0 : strlen(point + 1);
    uint32_t number = number_in(text);
    for (size_t i = decimals; i < 6; i++)
        number *= 10u;
    return number;
}

static uint16_t version_in(const char *text)
{
    char digits[5] = "";
    uint16_t version = 0;
    const char *const point = strchr(text, '.');
    TEST_ASSERT_NOT_NULL_MESSAGE(point, where);
    memcpy(digits, point - 1, 4);
    TEST_ASSERT_NULL_MESSAGE(dr_words_firmware_parse(digits, &version), where);
    return version;
}

/* -- Tables ----------------------------------------------------------------------------------------------------- */

/* "all", "3.00+" or "up to 2.99" */
static void check_versions(const dr_command *command, const char *text)
{
    const bool since = strchr(text, '+') != NULL, until = begins_with(text, "up to ");
    TEST_ASSERT_TRUE_MESSAGE(since || until || strcmp(text, "all") == 0, where);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(since ? version_in(text) : DR_FIRMWARE_FIRST, command->since, where);
    TEST_ASSERT_EQUAL_HEX16_MESSAGE(until ? version_in(text) : DR_FIRMWARE_LAST, command->until, where);
}

static void check_commands(dr_kind kind, const char *heading)
{
    static char cells[CELLS_MAX][LINE_MAX_BYTES];
    uint8_t row = 0;
    dr_command command;
    go_to(heading);
    go_to("### Commands");
    while (next_row(cells, "##") >= 6) {
        for (const char *code = strchr(cells[0], '`'); code != NULL; code = strchr(code, '`')) { /* "`63` `43`" */
            TEST_ASSERT_TRUE_MESSAGE(dr_command_row(kind, row++, &command), where);
            TEST_ASSERT_EQUAL_HEX8_MESSAGE(strtoul(code + 1, NULL, 16), command.code, where);
            TEST_ASSERT_EQUAL_MESSAGE(number_in(cells[2]), 1u + command.args, where);
            TEST_ASSERT_EQUAL_MESSAGE(number_in(cells[3]), command.reply, where);
            check_versions(&command, cells[4]);
            code = strchr(code + 1, '`') + 1;
        }
    }
    TEST_ASSERT_FALSE_MESSAGE(dr_command_row(kind, row, &command), "a command is missing in PROTOCOL.md");
}

static void test_commands(void)
{
    check_commands(DR_TRIO, "## TRIO MP-245A");
    check_commands(DR_MPC, "## MPC-200");
}

static unsigned check_stages(dr_kind kind, const char *heading)
{
    static char cells[CELLS_MAX][LINE_MAX_BYTES];
    unsigned count = 0;
    go_to(heading);
    go_to("### Stages");
    while (next_row(cells, "##") >= 9) {
        dr_stage_id id = DR_STAGE_NONE;
        dr_stage stage;
        if (strcmp(cells[0], "stage") == 0)
            continue;
        TEST_ASSERT_TRUE_MESSAGE(dr_words_stage_find(kind, cells[0], &id), where);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(cells[0], dr_words_stage(id), where);
        TEST_ASSERT_TRUE(dr_stage_get(id, &stage));
        TEST_ASSERT_EQUAL_MESSAGE(number_in(cells[2]), stage.quanta_per_step, where);
        /* 1/64 um is 15,625 millionths; steps a micron are printed to thousandths */
        TEST_ASSERT_EQUAL_MESSAGE(stage.quanta_per_step * 15625u, millionths_in(cells[3]), where);
        TEST_ASSERT_EQUAL_MESSAGE((64000u + stage.quanta_per_step / 2u) / stage.quanta_per_step,
                                  millionths_in(cells[4]) / 1000u, where);
        for (unsigned axis = 0; axis < DR_AXES; axis++)
            TEST_ASSERT_EQUAL_MESSAGE(number_in(cells[5 + axis]), stage.travel_steps[axis], where);
        TEST_ASSERT_EQUAL_MESSAGE(number_in(cells[8]), stage.full_speed_um_per_s, where);
        if (kind == DR_MPC && strcmp(cells[9], "all") != 0)
            TEST_ASSERT_EQUAL_HEX16_MESSAGE(version_in(cells[9]), stage.since, where);
        else
            TEST_ASSERT_EQUAL_HEX16_MESSAGE(DR_FIRMWARE_FIRST, stage.since, where);
        count++;
    }
    return count;
}

static void test_stages(void)
{
    const unsigned trio = check_stages(DR_TRIO, "## TRIO MP-245A");
    const unsigned mpc = check_stages(DR_MPC, "## MPC-200");
    TEST_ASSERT_EQUAL(DR_STAGES - 1, trio + mpc);
}

static void check_speed(const char *text, uint32_t quanta_per_s)
{
    char said[32];
    (void)dr_words_um(said, sizeof said, quanta_per_s);
    if (strchr(text, '.') == NULL)
        *strchr(said, '.') = '\0';
    TEST_ASSERT_EQUAL_STRING_MESSAGE(said, text, where);
}

static void test_speeds(void)
{
    static char cells[CELLS_MAX][LINE_MAX_BYTES];
    uint8_t level = 0;
    go_to("## MPC-200");
    go_to("### Speeds");
    while (next_row(cells, "##") >= 4) {
        if (strcmp(cells[0], "s") == 0)
            continue;
        TEST_ASSERT_EQUAL_MESSAGE(number_in(cells[0]), level, where);
        check_speed(cells[1], dr_speed_quanta_per_s(DR_STAGE_TRIO_MP845, level));
        check_speed(cells[2], dr_speed_quanta_per_s(DR_STAGE_MPC_MP225, level));
        check_speed(cells[3], dr_measured_quanta_per_s(level));
        level++;
    }
    TEST_ASSERT_EQUAL(DR_SPEED_LEVELS, level);
}

static void test_diagonals(void)
{
    static char cells[CELLS_MAX][LINE_MAX_BYTES];
    uint8_t value = 0;
    go_to("### Home, work, and the diagonal");
    while (next_row(cells, "##") >= 5) {
        if (strcmp(cells[0], "value") == 0)
            continue;
        char switches[16], way[32];
        const dr_diagonal diagonal = dr_diagonal_get(value);
        (void)snprintf(switches, sizeof switches, "%d %d %d %d", value & 1, value >> 1 & 1, value >> 2 & 1,
                       value >> 3 & 1);
        (void)snprintf(way, sizeof way, "%u : %u", diagonal.cos, diagonal.sin);
        TEST_ASSERT_EQUAL_MESSAGE(number_in(cells[0]), value, where);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(switches, cells[1], where);
        TEST_ASSERT_EQUAL_MESSAGE(strstr(cells[2], "more") != NULL ? 90 - number_in(cells[2]) : number_in(cells[2]),
                                  number_in(cells[3]), where);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(way, cells[4], where);
        value++;
    }
    TEST_ASSERT_EQUAL(DR_DIAGONALS, value);
}

static void test_quirks(void)
{
    static char cells[CELLS_MAX][LINE_MAX_BYTES];
    unsigned count = 0;
    go_to("## Quirks");
    while (next_row(cells, "##") >= 3) {
        dr_quirk_id id = DR_QUIRK_IDS;
        if (strcmp(cells[0], "name") == 0)
            continue;
        char name[64] = "";
        (void)sscanf(cells[0], "`%63[^`]", name);
        TEST_ASSERT_TRUE_MESSAGE(dr_words_quirk_find(name, &id), where);
        TEST_ASSERT_EQUAL_MESSAGE(count, id, where);
        TEST_ASSERT_EQUAL_MESSAGE(strchr(cells[0], '*') != NULL, dr_words_quirk(id)->observed, where);
        TEST_ASSERT_EQUAL_MESSAGE(begins_with(cells[1], "MPC-200:"), dr_words_quirk(id)->mpc_only, where);
        count++;
    }
    TEST_ASSERT_EQUAL(DR_QUIRK_IDS, count);
}

/* -- Dialogues -------------------------------------------------------------------------------------------------- */

typedef struct {
    dr_controller controller;
    dr_drive drives[DR_PORTS];
    dr_us now, last; /* last: when the line before happened */
    dr_us wait_us;
    dr_command asked;
} bench;

/* "```mpc MP-225 MP-225", "```mpc MP-225 firmware 1.03" */
static bool set_up(bench *b)
{
    char words[LINE_MAX_BYTES];
    (void)snprintf(words, sizeof words, "%s", line);
    const char *word = strtok(words + 3, " ");
    dr_kind kind;
    uint8_t count = 0;
    if (word == NULL || !dr_words_kind_find(word, &kind))
        return false;
    memset(b, 0, sizeof *b);
    dr_controller_init(&b->controller, kind, b->drives, kind == DR_TRIO ? 1 : DR_PORTS);
    for (word = strtok(NULL, " "); word != NULL; word = strtok(NULL, " ")) {
        dr_stage_id id = DR_STAGE_NONE;
        if (strcmp(word, "firmware") == 0) {
            TEST_ASSERT_NULL_MESSAGE(dr_words_firmware_parse(strtok(NULL, " "), &b->controller.firmware), where);
        } else {
            TEST_ASSERT_TRUE_MESSAGE(dr_words_stage_find(kind, word, &id), where);
            dr_drive_init(&b->drives[count++], id);
        }
    }
    b->now = b->last = UINT32_C(0xFFFFFFFF) - 1000000u; /* the clock wraps on the way */
    dr_controller_start(&b->controller, b->now);
    return true;
}

static dr_words_context context_of(const bench *b)
{
    return (dr_words_context){(dr_kind)b->controller.kind, b->controller.firmware,
                              (dr_stage_id)b->drives[b->controller.active].stage};
}

/* "4D 80 3E  words": the bytes, and where the words begin. */
static size_t bytes_in(const char *text, uint8_t bytes[DR_FRAME_MAX], const char **words)
{
    size_t count = 0;
    memset(bytes, 0, DR_FRAME_MAX);
    for (; *text != '\0' && *text != ' ' && count < DR_FRAME_MAX; count++) {
        char *end;
        bytes[count] = (uint8_t)strtoul(text, &end, 16);
        TEST_ASSERT_EQUAL_MESSAGE(2, end - text, where);
        text = *end == ' ' ? end + 1 : end;
    }
    *words = text + strspn(text, " ");
    return count;
}

static void host_says(bench *b, const char *text)
{
    uint8_t bytes[DR_FRAME_MAX], again[DR_FRAME_MAX];
    const char *words;
    char said[LINE_MAX_BYTES];
    const size_t count = bytes_in(text, bytes, &words);
    const dr_words_context context = context_of(b);
    TEST_ASSERT_TRUE_MESSAGE(dr_command_find(context.kind, context.firmware, bytes[0], &b->asked), where);
    (void)dr_words_request(said, sizeof said, &context, bytes, count);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(words, said, where);
    const dr_request request = dr_wire_get_request(&b->asked, bytes);
    TEST_ASSERT_EQUAL_MESSAGE(count, dr_wire_put_request(context.kind, context.firmware, &request, again), where);
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(bytes, again, count, where);

    TEST_ASSERT_EQUAL_MESSAGE(0, dr_controller_ready(&b->controller), where);
    dr_controller_push(&b->controller, b->now, bytes, count);
    b->last = b->now;
}

static void unit_says(bench *b, const char *text)
{
    uint8_t bytes[DR_FRAME_MAX], got[DR_FRAME_MAX];
    const char *words;
    char said[LINE_MAX_BYTES];
    const size_t count = bytes_in(text, bytes, &words);
    size_t have = dr_controller_pull(&b->controller, b->now, got, count);
    while (have < count && dr_controller_due(&b->controller, &b->now))
        have += dr_controller_pull(&b->controller, b->now, got + have, count - have);
    TEST_ASSERT_EQUAL_MESSAGE(count, have, where);
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(bytes, got, count, where);
    TEST_ASSERT_EQUAL_MESSAGE(b->wait_us, (dr_us)(b->now - b->last), where);

    const dr_words_context context = context_of(b);
    if (count == DR_STREAM_FRAME)
        (void)dr_words_stream(said, sizeof said, &context, bytes, count);
    else
        (void)dr_words_reply(said, sizeof said, &context, (dr_op)b->asked.op, bytes, count);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(words, said, where);
    b->last = b->now;
    b->wait_us = 0;
}

static void test_dialogues(void)
{
    static bench b;
    unsigned dialogues = 0, answers = 0;
    while (next_line()) {
        if (!begins_with(line, "```") || !set_up(&b))
            continue;
        dialogues++;
        while (next_line() && !begins_with(line, "```")) {
            const char *const rest = line + 6;
            if (begins_with(line, "host  ")) {
                host_says(&b, rest);
            } else if (begins_with(line, "wait  ")) {
                b.wait_us = number_in(rest); /* "600.021 ms" */
            } else if (begins_with(line, "unit  ")) {
                unit_says(&b, rest);
                answers++;
            } else {
                TEST_FAIL_MESSAGE(where);
            }
        }
        uint8_t more;
        TEST_ASSERT_EQUAL_MESSAGE(0, dr_controller_pull(&b.controller, b.now, &more, 1), where);
        dr_us due;
        TEST_ASSERT_FALSE_MESSAGE(dr_controller_due(&b.controller, &due), where);
    }
    TEST_ASSERT_EQUAL(3, dialogues);
    TEST_ASSERT_GREATER_THAN(20, answers);
}

int main(int argc, char **argv)
{
    page = argc > 1 ? fopen(argv[1], "r") : NULL;
    if (page == NULL) {
        (void)fprintf(stderr, "%s PROTOCOL.md: cannot read the page\n", argv[0]);
        return 2;
    }
    UNITY_BEGIN();
    RUN_TEST(test_commands);
    RUN_TEST(test_stages);
    RUN_TEST(test_speeds);
    RUN_TEST(test_diagonals);
    RUN_TEST(test_quirks);
    RUN_TEST(test_dialogues);
    (void)fclose(page);
    return UNITY_END();
}
