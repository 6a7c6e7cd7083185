/* The panel's model, fed lines of the control channel as an emulator writes them; and lines that no emulator writes. */
#include "model.h"

#include "unity.h"

#include <stdio.h>
#include <string.h>

static model m;
static char why[MODEL_TEXT], next[MODEL_NAME];

void setUp(void)
{
    model_init(&m, "");
    why[0] = next[0] = '\0';
}

void tearDown(void) {}

static model_line take(const char *line) { return model_take(&m, line, why, next); }

#define TRIO                                                                                                           \
    "{\"name\":\"left\",\"controller\":\"trio\",\"firmware\":\"3.12\",\"port\":\"/dev/pts/1\",\"is_open\":true,"       \
    "\"state\":\"rest\",\"active\":1,\"angle_deg\":30,\"home_steps\":[1,2,3],\"devices\":[{\"port\":1,"                \
    "\"model\":\"MP-845\",\"position_steps\":[10667,10668,10669],\"work_steps\":null}]}"
#define MPC                                                                                                            \
    "{\"name\":\"right\",\"controller\":\"mpc\",\"firmware\":\"3.21\",\"port\":\"/dev/pts/2\",\"link\":\"/tmp/mpc\","  \
    "\"is_open\":false,\"state\":\"moving\",\"active\":2,\"devices\":[{\"port\":1,\"model\":\"none\"},{\"port\":2,"    \
    "\"model\":\"MP-225\",\"position_steps\":[16,32,48],\"work_steps\":[7,8,9]}]}"
#define STATE(controllers) "{\"ok\":true,\"clock\":\"step\",\"now_us\":1500000,\"controllers\":[" controllers "]}"

static void take_trio(void) { TEST_ASSERT_EQUAL(MODEL_STATE, take(STATE(TRIO))); }

static void test_a_state_tells_the_controller_and_its_device(void)
{
    take_trio();
    TEST_ASSERT_TRUE(m.is_known);
    TEST_ASSERT_EQUAL_STRING("left", m.name);
    TEST_ASSERT_EQUAL(DR_TRIO, m.kind);
    TEST_ASSERT_EQUAL_STRING("3.12", m.firmware);
    TEST_ASSERT_EQUAL_STRING("/dev/pts/1", m.port);
    TEST_ASSERT_EQUAL_STRING("step", m.clock);
    TEST_ASSERT_EQUAL(1500000, m.now_us);
    TEST_ASSERT_TRUE(m.is_open);
    TEST_ASSERT_EQUAL(1, m.controllers);
    TEST_ASSERT_EQUAL_UINT32_ARRAY(((const uint32_t[]){1, 2, 3}), m.home_steps, 3);
    const model_device *d = model_active(&m);
    TEST_ASSERT_TRUE(d->is_there);
    TEST_ASSERT_FALSE(d->work_is_set);
    TEST_ASSERT_EQUAL_UINT32_ARRAY(((const uint32_t[]){10667, 10668, 10669}), d->at_steps, 3);
    TEST_ASSERT_EQUAL_DOUBLE(1000.03125, model_um(d, 10667)); /* 0.09375 um a microstep [T table 4] */
}

static void test_the_one_that_is_asked_for_is_taken_and_the_next_one_told(void)
{
    model_init(&m, "right");
    TEST_ASSERT_EQUAL(MODEL_STATE, take(STATE(TRIO "," MPC)));
    TEST_ASSERT_EQUAL(DR_MPC, m.kind);
    TEST_ASSERT_EQUAL_STRING("/tmp/mpc", m.port); /* the name that a person has given */
    TEST_ASSERT_EQUAL_STRING("left", next);
    TEST_ASSERT_EQUAL(2, m.controllers);
    TEST_ASSERT_EQUAL(2, m.device_count);
    TEST_ASSERT_EQUAL(1, m.active);
    TEST_ASSERT_FALSE(m.devices[0].is_there);
    TEST_ASSERT_TRUE(model_active(&m)->work_is_set);
    model_choose(&m, next);
    TEST_ASSERT_FALSE(m.is_known);
    TEST_ASSERT_EQUAL(2, m.controllers);
    TEST_ASSERT_EQUAL(MODEL_STATE, take(STATE(TRIO "," MPC)));
    TEST_ASSERT_EQUAL(DR_TRIO, m.kind);
    TEST_ASSERT_EQUAL_STRING("right", next);
}

static void test_a_controller_that_is_not_there_is_refused(void)
{
    model_init(&m, "middle");
    TEST_ASSERT_EQUAL(MODEL_REFUSED, take(STATE(TRIO)));
    TEST_ASSERT_EQUAL_STRING("there is no controller 'middle'", why);
}

static void test_a_panel_tells_the_display(void)
{
    take_trio();
    TEST_ASSERT_EQUAL(
        MODEL_PANEL,
        take("{\"ok\":true,\"controller\":\"trio\",\"text\":\"X 1\\nY 2\",\"screen\":\"blue\",\"moving\":\"home\","
             "\"locked\":true,\"relative\":true,\"setting_angle\":true,\"speed\":3,\"leds\":{},"
             "\"down\":[\"home\",\"work\"],\"beeps\":4}"));
    TEST_ASSERT_TRUE(m.is_shown && m.is_locked && m.is_relative && m.sets_angle && m.moves);
    TEST_ASSERT_FALSE(m.led_diagonal);
    TEST_ASSERT_EQUAL(MODEL_BLUE, m.colour);
    TEST_ASSERT_EQUAL_STRING("X 1\nY 2", m.text);
    TEST_ASSERT_EQUAL(3, m.mode);
    TEST_ASSERT_EQUAL(4, m.beeps);
    TEST_ASSERT_EQUAL_STRING(" home work ", m.down);
    TEST_ASSERT_EQUAL(MODEL_PANEL,
                      take("{\"ok\":true,\"screen\":\"dark\",\"moving\":null,\"leds\":{\"diagonal\":true}}"));
    TEST_ASSERT_EQUAL(MODEL_DARK, m.colour);
    TEST_ASSERT_TRUE(m.led_diagonal);
    TEST_ASSERT_FALSE(m.moves);
    TEST_ASSERT_EQUAL_STRING(" ", m.down);
}

static void test_the_answer_of_the_wire_is_that_of_the_protocol(void)
{
    char hex[64];
    take_trio();
    model_position_answer(&m, hex);
    TEST_ASSERT_EQUAL_STRING("AB 29 00 00 AC 29 00 00 AD 29 00 00 1E 0D", hex);
    model_init(&m, "");
    (void)take(STATE(MPC));
    model_position_answer(&m, hex);
    TEST_ASSERT_EQUAL_STRING("02 10 00 00 00 20 00 00 00 30 00 00 00 0D", hex);
}

/* -- What happens ---------------------------------------------------------------------------------------------------- */

static void note(const char *controller, const char *rest)
{
    char line[400];
    (void)snprintf(line, sizeof line, "{\"event\":\"note\",\"controller\":\"%s\",\"when_us\":7,%s}", controller, rest);
    TEST_ASSERT_EQUAL(MODEL_EVENT, take(line));
}

static void test_who_said_what_is_in_the_log_newest_first(void)
{
    take_trio();
    note("left", "\"note\":\"request\",\"device\":1,\"bytes\":\"63\",\"text\":\"tell position and angle\"");
    note("left", "\"note\":\"reply\",\"device\":1,\"bytes\":\"0D\",\"text\":\"done\"");
    note("left", "\"note\":\"hand\",\"device\":1,\"bytes\":\"00\",\"text\":\"by hand: go home\"");
    note("right", "\"note\":\"request\",\"device\":1,\"bytes\":\"43\",\"text\":\"of another controller\"");
    model_say(&m, "beep");
    static const model_side sides[] = {MODEL_HAPPENED, MODEL_HAPPENED, MODEL_TO_HOST, MODEL_FROM_HOST};
    static const char *const texts[] = {"beep", "by hand: go home", "done", "tell position and angle"};
    static const char *const hex[] = {"", "", "0D", "63"};
    for (unsigned i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL(sides[i], model_entry_at(&m, i)->side);
        TEST_ASSERT_EQUAL_STRING(texts[i], model_entry_at(&m, i)->text);
        TEST_ASSERT_EQUAL_STRING(hex[i], model_entry_at(&m, i)->hex);
    }
    TEST_ASSERT_NULL(model_entry_at(&m, 4));
}

static void test_frames_of_a_stream_and_detents_of_a_knob_are_one_entry(void)
{
    take_trio();
    note("left", "\"note\":\"request\",\"bytes\":\"63\",\"text\":\"first\"");
    for (unsigned i = 0; i < 200; i++)
        note("left", "\"note\":\"stream\",\"bytes\":\"FF\",\"text\":\"a frame\"");
    note("left", "\"note\":\"placed\",\"device\":1,\"steps\":[1,1,1],\"text\":\"here\"");
    note("left", "\"note\":\"placed\",\"device\":1,\"steps\":[2,1,1],\"text\":\"there\"");
    TEST_ASSERT_EQUAL(3, m.log_count);
    TEST_ASSERT_EQUAL_STRING("there", model_entry_at(&m, 0)->text);
    TEST_ASSERT_EQUAL_STRING("a frame", model_entry_at(&m, 1)->text);
    TEST_ASSERT_EQUAL_STRING("first", model_entry_at(&m, 2)->text);
}

static void test_the_log_keeps_the_newest(void)
{
    char text[16];
    for (unsigned i = 0; i < 3 * MODEL_LOG; i++) {
        (void)snprintf(text, sizeof text, "%u", i);
        model_say(&m, text);
    }
    TEST_ASSERT_EQUAL_STRING("191", model_entry_at(&m, 0)->text);
    TEST_ASSERT_EQUAL_STRING("128", model_entry_at(&m, MODEL_LOG - 1)->text);
    TEST_ASSERT_NULL(model_entry_at(&m, MODEL_LOG));
}

static void leg(const char *what, unsigned x, unsigned y, unsigned z)
{
    char text[100];
    (void)snprintf(text, sizeof text, "\"note\":\"%s\",\"device\":1,\"steps\":[%u,%u,%u],\"text\":\"\"", what, x, y, z);
    note("left", text);
}

static void corner(const model_device *d, unsigned i, uint32_t x, uint32_t y, uint32_t z)
{
    TEST_ASSERT_EQUAL_UINT32_ARRAY(((const uint32_t[]){x, y, z}), d->path_steps[(d->path_first + i) % MODEL_PATH], 3);
}

static void test_the_path_has_a_corner_where_a_leg_ended(void)
{
    take_trio();
    const model_device *d = model_active(&m);
    leg("leg", 10667, 10668, 0);
    TEST_ASSERT_TRUE(d->is_on_leg);
    TEST_ASSERT_EQUAL(0, d->leg_to_steps[DR_Z]);
    leg("leg", 0, 10668, 0);
    leg("stopped", 500, 10668, 0);
    TEST_ASSERT_FALSE(d->is_on_leg);
    leg("placed", 564, 10668, 0);
    leg("placed", 564, 10668, 0);
    corner(d, 0, 10667, 10668, 10669);
    corner(d, 1, 10667, 10668, 0);
    corner(d, d->path_count - 2, 500, 10668, 0);
    corner(d, d->path_count - 1, 564, 10668, 0);
    for (unsigned i = 0; i < 2 * MODEL_PATH; i++)
        leg("placed", i, 0, 0);
    TEST_ASSERT_EQUAL(MODEL_PATH, d->path_count);
    corner(d, 0, MODEL_PATH, 0, 0);
}

static void test_another_device_has_been_nowhere(void)
{
    take_trio();
    leg("placed", 1, 2, 3);
    TEST_ASSERT_EQUAL(2, model_active(&m)->path_count);
    TEST_ASSERT_EQUAL(MODEL_STATE,
                      take(STATE("{\"name\":\"left\",\"controller\":\"trio\",\"devices\":[{\"port\":1,"
                                 "\"model\":\"MP-285\",\"position_steps\":[1,2,3],\"work_steps\":null}]}")));
    TEST_ASSERT_EQUAL(1, model_active(&m)->path_count);
    TEST_ASSERT_EQUAL_DOUBLE(0.125, model_um(model_active(&m), 1));
}

/* -- Orders, and nonsense ------------------------------------------------------------------------------------------- */

static void test_an_order_is_carried_out_or_refused(void)
{
    TEST_ASSERT_EQUAL(MODEL_DONE, take("{\"ok\":true}"));
    TEST_ASSERT_EQUAL(MODEL_REFUSED, take("{\"ok\":false,\"why\":\"'x': expected something else\"}"));
    TEST_ASSERT_EQUAL_STRING("'x': expected something else", why);
}

static void repeated(char *out, size_t room, const char *before, const char *what, unsigned times, const char *behind)
{
    size_t length = (size_t)snprintf(out, room, "%s", before);
    for (unsigned i = 0; i < times; i++)
        length += (size_t)snprintf(out + length, room - length, "%s", what);
    (void)snprintf(out + length, room - length, "%s", behind);
}

static void test_what_no_emulator_says_harms_nobody(void)
{
    static const char *const lines[] = {
        "",
        "hello",
        "{",
        "[]",
        "7",
        "null",
        "{}",
        "{\"controllers\":7}",
        "{\"controllers\":[]}",
        "{\"controllers\":[7,{}]}",
        "{\"controllers\":[{\"name\":\"a\",\"controller\":\"lathe\"}]}",
        "{\"ok\":\"yes\"}",
        "{\"event\":7}",
        "{\"screen\":7}",
        "{\"event\":\"note\"}",
        "{\"event\":\"note\",\"controller\":\"left\"}",
        "{\"screen\":\"pink\",\"down\":[7,null]}",
        "{\"event\":\"note\",\"controller\":\"left\",\"note\":\"leg\",\"device\":9,\"steps\":[1,2,3]}",
        "{\"event\":\"note\",\"controller\":\"left\",\"note\":\"leg\",\"device\":1,\"steps\":[1,2]}",
        "{\"event\":\"note\",\"controller\":\"left\",\"note\":\"leg\",\"device\":1,\"steps\":[1,2,-3]}",
        "{\"event\":\"note\",\"controller\":\"left\",\"note\":\"leg\",\"device\":1,\"steps\":[1,2,1e99]}"};
    for (unsigned turn = 0; turn < 2; turn++) {
        for (size_t i = 0; i < sizeof lines / sizeof *lines; i++)
            (void)take(lines[i]);
        take_trio();
    }
    TEST_ASSERT_FALSE(model_active(&m)->is_on_leg);
    TEST_ASSERT_EQUAL(1, model_active(&m)->path_count);
    char line[4096];
    repeated(line, sizeof line,
             "{\"controllers\":[{\"name\":\"left\",\"controller\":\"mpc\",\"active\":99,\"devices\":[",
             "{\"model\":\"MP-225\",\"position_steps\":[1,2,3]},", 40, "{}]}]}");
    TEST_ASSERT_EQUAL(MODEL_STATE, take(line));
    TEST_ASSERT_EQUAL(DR_PORTS, m.device_count);
    TEST_ASSERT_EQUAL(0, m.active);
    repeated(line, sizeof line, "{\"screen\":\"red\",\"down\":[\"home\"", ",\"button\"", 100, "]}");
    TEST_ASSERT_EQUAL(MODEL_PANEL, take(line));
    TEST_ASSERT_LESS_THAN(sizeof m.down, strlen(m.down));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_state_tells_the_controller_and_its_device);
    RUN_TEST(test_the_one_that_is_asked_for_is_taken_and_the_next_one_told);
    RUN_TEST(test_a_controller_that_is_not_there_is_refused);
    RUN_TEST(test_a_panel_tells_the_display);
    RUN_TEST(test_the_answer_of_the_wire_is_that_of_the_protocol);
    RUN_TEST(test_who_said_what_is_in_the_log_newest_first);
    RUN_TEST(test_frames_of_a_stream_and_detents_of_a_knob_are_one_entry);
    RUN_TEST(test_the_log_keeps_the_newest);
    RUN_TEST(test_the_path_has_a_corner_where_a_leg_ended);
    RUN_TEST(test_another_device_has_been_nowhere);
    RUN_TEST(test_an_order_is_carried_out_or_refused);
    RUN_TEST(test_what_no_emulator_says_harms_nobody);
    return UNITY_END();
}
