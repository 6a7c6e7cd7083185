/* The configuration compiler: what a text means to the last quantum, and a hundred wrong texts, each refused with its line
 * and its reason. */
#define _GNU_SOURCE /* mkstemp */
#include "rig.h"

#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char trio[] = "format = 1;\n"
                           "revision = 7;\n"
                           "profile = \"trio-mp245a\";\n"
                           "firmware = \"3.12\";\n"
                           "converter_serial = \"FT123\";\n"
                           "external_switch5_on = true;\n"
                           "external_switch6_on = false;\n"
                           "angle_min_deg = 10;\n"
                           "angle_max_deg = 80;\n"
                           "refusal = \"silent\";\n"
                           "on_host_loss = \"stop\";\n"
                           "path_model = \"documented\";\n"
                           "allow_calibrate = false;\n"
                           "knobs_locked = false;\n"
                           "unstoppable_ms = 200;\n"
                           "arm_idle_s = 900;\n"
                           "margin_um = 50;\n"
                           "knob_um_per_s = 5000;\n"
                           "beyond_zero_um = 300;\n"
                           "drives = (\n"
                           "  { number = 1;\n"
                           "    device = \"MP-845\";\n"
                           "    microstep_um = 0.09375;\n"
                           "    box_um = {\n"
                           "      x = (100, 24900);\n"
                           "      y = (100.5, 24900);\n"
                           "      z = (100, 24900); };\n"
                           "    max_move_um = 5000;\n"
                           "    fastest_level = 15;\n"
                           "    surface = {\n"
                           "      retract = \"-z\";\n"
                           "      at_um = 8000;\n"
                           "      clearance_um = 500;\n"
                           "      fastest_level = 3;\n"
                           "      approach = (707, 0, 707); };\n"
                           "  } );\n"
                           "keepouts = (\n"
                           "  { name = \"objective\";\n"
                           "    drive = 1;\n"
                           "    exit = \"-z\";\n"
                           "    box_um = {\n"
                           "      x = (9000, 16000);\n"
                           "      y = (9000, 16000);\n"
                           "      z = (17000, 25000); }; },\n"
                           "  { name = \"bath\";\n"
                           "    drive = 1;\n"
                           "    half = {\n"
                           "      normal = (0, 0, -1);\n"
                           "      through_um = (0, 0, 20000); }; },\n"
                           "  { name = \"cone\";\n"
                           "    drive = 1;\n"
                           "    cone_um = {\n"
                           "      axis = \"z\";\n"
                           "      centre = (12500, 12500);\n"
                           "      from = 12000;\n"
                           "      radius_from = 0;\n"
                           "      to = 16000;\n"
                           "      radius_to = 4000; }; }\n"
                           ");\n";

static const char mpc[] = "format = 1;\n"
                          "revision = 1;\n"
                          "profile = \"mpc-200\";\n"
                          "firmware = \"3.21\";\n"
                          "mpc_home = \"zero\";\n"
                          "allow_stream = true;\n"
                          "roe_mode_min = 3;\n"
                          "drives = (\n"
                          "  { number = 2;\n"
                          "    device = \"MP-285\";\n"
                          "    microstep_um = 0.0625;\n"
                          "    switch8_on = true;\n"
                          "    box_um = { x = (0, 25000); y = (0, 25000); z = (0, 25000); }; },\n"
                          "  { number = 4;\n"
                          "    device = \"MT-800\";\n"
                          "    microstep_um = 0.078125;\n"
                          "    switch8_on = true;\n"
                          "    box_um = { x = (0.001, 21999.999); y = (0, 22000); z = (0, 22000); }; } );\n";

/* libconfig loses a text that stands where none is expected; the program ends then, and so does its memory. */
const char *__lsan_default_suppressions(void); /* NOLINT(bugprone-reserved-identifier): the sanitizer's */
const char *__lsan_default_suppressions(void) { return "leak:libconfig"; } /* NOLINT(bugprone-reserved-identifier) */

static rig read_rig;
static char why[RIG_WHY_MAX];

void setUp(void) { memset(&read_rig, 0, sizeof read_rig); }
void tearDown(void) {}

static bool read_text(const char *text, size_t size)
{
    char path[] = "/tmp/dryrig-rig-XXXXXX";
    const int fd = mkstemp(path);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, fd);
    TEST_ASSERT_EQUAL_INT((int)size, (int)write(fd, text, size));
    (void)close(fd);
    why[0] = '\0';
    const bool good = rig_read(&read_rig, path, why, sizeof why);
    (void)unlink(path);
    if (strncmp(why, path, strlen(path)) == 0) /* what follows is ":LINE: ..." */
        memmove(why, why + strlen(path), strlen(why + strlen(path)) + 1);
    return good;
}

/* The text with the first `find` replaced; *line: where that was. */
static char *changed(const char *text, const char *find, const char *put, unsigned *line)
{
    const char *const at = strstr(text, find);
    TEST_ASSERT_NOT_NULL_MESSAGE(at, find);
    const size_t before = (size_t)(at - text), size = strlen(text) + strlen(put) + 1;
    char *const out = malloc(size);
    TEST_ASSERT_NOT_NULL(out);
    (void)snprintf(out, size, "%.*s%s%s", (int)before, text, put, at + strlen(find));
    *line = 1;
    for (size_t i = 0; i < before; i++)
        *line += text[i] == '\n';
    return out;
}

static bool read_changed(const char *text, const char *find, const char *put)
{
    unsigned line;
    char *const other = changed(text, find, put, &line);
    const bool good = read_text(other, strlen(other));
    free(other);
    return good;
}

/* -- What it means ----------------------------------------------------------------------------------------------------- */

static void a_trio_is_read_to_the_quantum(void)
{
    TEST_ASSERT_TRUE_MESSAGE(read_text(trio, sizeof trio - 1), why);
    const dr_limits *const l = &read_rig.limits;
    TEST_ASSERT_EQUAL(DR_TRIO, l->kind);
    TEST_ASSERT_EQUAL_HEX16(0x0312, l->firmware);
    TEST_ASSERT_EQUAL_UINT32(7, l->revision);
    TEST_ASSERT_EQUAL_MEMORY("FT123\0\0\0\0\0\0\0\0\0\0\0", l->serial, DR_SERIAL_MAX);
    TEST_ASSERT_EQUAL_HEX16(0, l->rig);
    TEST_ASSERT_EQUAL(10, l->angle_min_deg);
    TEST_ASSERT_EQUAL(80, l->angle_max_deg);
    TEST_ASSERT_EQUAL(200, l->unstoppable_ms);
    TEST_ASSERT_EQUAL(900, l->arm_idle_s);
    TEST_ASSERT_EQUAL_INT32(50 * 64, l->margin_q);
    TEST_ASSERT_EQUAL_INT32(5000 * 64, l->knob_q_per_s);
    TEST_ASSERT_EQUAL_INT32(300 * 64, l->beyond_zero_q);
    const dr_drive_limits *const d = &l->drives[0];
    TEST_ASSERT_EQUAL(DR_STAGE_TRIO_MP845, d->stage);
    TEST_ASSERT_EQUAL_INT32(100 * 64 + 32, d->box_q.min_q[DR_Y]);
    TEST_ASSERT_EQUAL_INT32(24900 * 64, d->box_q.max_q[DR_Y]);
    TEST_ASSERT_EQUAL_UINT32(5000 * 64, d->max_move_q);
    TEST_ASSERT_EQUAL(15, d->fast_level);
    TEST_ASSERT_EQUAL(3, d->slow_level);
    TEST_ASSERT_EQUAL(DR_TO_LESS_Z, d->retract);
    TEST_ASSERT_EQUAL_INT32(8000 * 64, d->surface_q);
    TEST_ASSERT_EQUAL_UINT32(500 * 64, d->clearance_q);
    TEST_ASSERT_EQUAL_INT16(707, d->approach[DR_X]);
    TEST_ASSERT_EQUAL(DR_STAGE_NONE, l->drives[1].stage);
    TEST_ASSERT_EQUAL(2 + RIG_CONE_SLICES, l->obstacle_count);
    TEST_ASSERT_EQUAL_STRING("objective", read_rig.names[0]);
    TEST_ASSERT_EQUAL_STRING("bath", read_rig.names[1]);
    TEST_ASSERT_EQUAL_STRING("cone", read_rig.names[2]);
    TEST_ASSERT_EQUAL_STRING("cone", read_rig.names[1 + RIG_CONE_SLICES]);
    TEST_ASSERT_EQUAL(DR_TO_LESS_Z, l->obstacles[0].exit);
    TEST_ASSERT_EQUAL(DR_SHAPE_HALF, l->obstacles[1].shape);
    TEST_ASSERT_EQUAL_INT16(-1, l->obstacles[1].half_q.normal[DR_Z]);
    TEST_ASSERT_EQUAL_INT64(-20000 * 64, l->obstacles[1].half_q.offset_q);
}

static void an_mpc_is_read_with_its_drives_and_permissions(void)
{
    TEST_ASSERT_TRUE_MESSAGE(read_text(mpc, sizeof mpc - 1), why);
    const dr_limits *const l = &read_rig.limits;
    TEST_ASSERT_EQUAL(DR_MPC, l->kind);
    TEST_ASSERT_EQUAL_HEX16(DR_RIG_HOME_IS_ZERO | DR_RIG_MAY_STREAM, l->rig);
    TEST_ASSERT_EQUAL(3, l->mode_min);
    TEST_ASSERT_EQUAL(DR_STAGE_NONE, l->drives[0].stage);
    TEST_ASSERT_EQUAL(DR_STAGE_MPC_MP285, l->drives[1].stage);
    TEST_ASSERT_EQUAL(DR_STAGE_MPC_MT800, l->drives[3].stage);
    TEST_ASSERT_EQUAL(DR_SPEED_FULL, l->drives[1].fast_level);
    TEST_ASSERT_EQUAL(0, l->obstacle_count);
}

static void facts_and_permissions_become_bits(void)
{
    static const struct {
        const char *text, *find, *put;
        uint16_t bit;
    } facts[] = {
        {trio, "switch5_on = true", "switch5_on = false", DR_RIG_Y_LOCKED_OUT},
        {trio, "switch6_on = false", "switch6_on = true", DR_RIG_CALIBRATES_AT_POWER_ON},
        {trio, "knobs_locked = false", "knobs_locked = true", DR_RIG_KNOBS_LOCKED},
        {trio, "\"documented\"", "\"hull\"", DR_RIG_PATHS_UNKNOWN},
        {trio, "allow_calibrate = false", "allow_calibrate = true", DR_RIG_MAY_CALIBRATE},
        {trio, "allow_calibrate = false", "stay_armed = true", DR_RIG_STAYS_ARMED},
        {trio, "allow_calibrate = false", "relay = true", DR_RIG_HAS_CUT},
        {mpc, "switch8_on = true;\n    box_um = { x = (0, ", "switch8_on = false;\n    box_um = { x = (0, ",
         DR_RIG_HOME_IS_ZERO | DR_RIG_MAY_STREAM | DR_RIG_Y_LOCKED_OUT << 1},
        {mpc, "switch8_on = true;\n    box_um = { x = (0.", "switch8_on = false;\n    box_um = { x = (0.",
         DR_RIG_HOME_IS_ZERO | DR_RIG_MAY_STREAM | DR_RIG_Y_LOCKED_OUT << 3},
    };
    for (size_t i = 0; i < sizeof facts / sizeof facts[0]; i++) {
        TEST_ASSERT_TRUE_MESSAGE(read_changed(facts[i].text, facts[i].find, facts[i].put), why);
        TEST_ASSERT_EQUAL_HEX16(facts[i].bit, read_rig.limits.rig);
    }
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "\"silent\"", "\"E\""), why);
    TEST_ASSERT_EQUAL(DR_REFUSE_E, read_rig.limits.refusal);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "\"stop\"", "\"finish\""), why);
    TEST_ASSERT_EQUAL(DR_HOST_LOSS_FINISH, read_rig.limits.host_loss);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "fastest_level = 15", "fastest_level = \"full\""), why);
    TEST_ASSERT_EQUAL(DR_SPEED_FULL, read_rig.limits.drives[0].fast_level);
}

/* Limits shrink, obstacles and margins grow; a multiple of 1/64 um stays what it is. */
static void rounding_is_always_to_the_safe_side(void)
{
    static const double below = 1.0 / 64 - 1e-7, above = 1.0 / 64 + 1e-7;
    char text[64];
    for (int32_t q = 6400; q < 6400 + 64; q++) {
        (void)snprintf(text, sizeof text, "x = (%.10f, 24900)", q / 64.0);
        TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "x = (100, 24900)", text), why);
        TEST_ASSERT_EQUAL_INT32(q, read_rig.limits.drives[0].box_q.min_q[DR_X]);
        (void)snprintf(text, sizeof text, "x = (%.10f, %.10f)", q / 64.0 - below, q / 64.0 + 20000 + below);
        TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "x = (100, 24900)", text), why);
        TEST_ASSERT_EQUAL_INT32(q, read_rig.limits.drives[0].box_q.min_q[DR_X]);
        TEST_ASSERT_EQUAL_INT32(q + 20000 * 64, read_rig.limits.drives[0].box_q.max_q[DR_X]);
        (void)snprintf(text, sizeof text, "x = (%.10f, %.10f)", q / 64.0 + above, q / 64.0 + 10000 - above);
        TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "x = (9000, 16000)", text), why);
        TEST_ASSERT_EQUAL_INT32(q + 1, read_rig.limits.obstacles[0].box_q.min_q[DR_X]);
        TEST_ASSERT_EQUAL_INT32(q + 10000 * 64 - 1, read_rig.limits.obstacles[0].box_q.max_q[DR_X]);
    }
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "at_um = 8000", "at_um = 8000.001"), why);
    TEST_ASSERT_EQUAL_INT32(8000 * 64, read_rig.limits.drives[0].surface_q); /* up is -z: more is below */
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "clearance_um = 500", "clearance_um = 500.001"), why);
    TEST_ASSERT_EQUAL_UINT32(500 * 64 + 1, read_rig.limits.drives[0].clearance_q);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "max_move_um = 5000", "max_move_um = 4999.999"), why);
    TEST_ASSERT_EQUAL_UINT32(5000 * 64 - 1, read_rig.limits.drives[0].max_move_q);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "margin_um = 50", "margin_um = 50.001"), why);
    TEST_ASSERT_EQUAL_INT32(50 * 64 + 1, read_rig.limits.margin_q);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "through_um = (0, 0, 20000)", "through_um = (0, 0, 19999.999)"), why);
    TEST_ASSERT_EQUAL_INT64(-(20000 * 64 - 1), read_rig.limits.obstacles[1].half_q.offset_q);
}

/* Every point of the cone is in one of its boxes. */
static void a_cone_is_inside_its_boxes(void)
{
    TEST_ASSERT_TRUE_MESSAGE(read_text(trio, sizeof trio - 1), why);
    for (int z = 12000; z <= 16000; z += 5) {
        const int radius = z - 12000;
        for (int side = -1; side <= 1; side += 2) {
            const int32_t at[DR_AXES] = {(12500 + side * radius) * 64, 12500 * 64, z * 64};
            bool inside = false;
            for (unsigned i = 2; i < 2 + RIG_CONE_SLICES; i++) {
                const dr_box *const box = &read_rig.limits.obstacles[i].box_q;
                inside = inside || (box->min_q[DR_X] <= at[DR_X] && at[DR_X] <= box->max_q[DR_X] &&
                                    box->min_q[DR_Y] <= at[DR_Y] && at[DR_Y] <= box->max_q[DR_Y] &&
                                    box->min_q[DR_Z] <= at[DR_Z] && at[DR_Z] <= box->max_q[DR_Z]);
            }
            TEST_ASSERT_TRUE(inside);
        }
    }
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "radius_from = 0", "radius_from = 4000"), why);
    TEST_ASSERT_EQUAL(3, read_rig.limits.obstacle_count); /* a cylinder is one box */
    TEST_ASSERT_EQUAL_INT32(8500 * 64, read_rig.limits.obstacles[2].box_q.min_q[DR_X]);
    TEST_ASSERT_EQUAL_INT32(16000 * 64, read_rig.limits.obstacles[2].box_q.max_q[DR_Z]);
}

static void what_is_left_out_is_careful(void)
{
    TEST_ASSERT_TRUE_MESSAGE(read_text(mpc, sizeof mpc - 1), why);
    const dr_limits *const l = &read_rig.limits;
    TEST_ASSERT_EQUAL(DR_REFUSE_SILENT, l->refusal);
    TEST_ASSERT_EQUAL(DR_HOST_LOSS_STOP, l->host_loss);
    TEST_ASSERT_EQUAL(200, l->unstoppable_ms);
    TEST_ASSERT_EQUAL(900, l->arm_idle_s);
    TEST_ASSERT_EQUAL_INT32(50 * 64, l->margin_q);
    TEST_ASSERT_EQUAL_UINT32(5000 * 64, l->drives[1].max_move_q);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "      fastest_level = 3;\n", ""), why);
    TEST_ASSERT_EQUAL(3, read_rig.limits.drives[0].slow_level);
}

/* -- What is wrong ----------------------------------------------------------------------------------------------------- */

typedef struct {
    const char *text, *find, *put;
    int below;
    const char *says;
} mutant;

static const mutant mutants[] = {
    /* the text itself */
    {trio, "revision = 7;", "revision 7;", 0, "syntax error"},
    {trio, "revision = 7;", "revision = 7; }", 0, "syntax error"},
    {trio, "drives = (", "drives = ((", 16, "syntax error"},
    {trio, "revision = 7;", "revision = 7; revision = 8;", 0, "duplicate setting"},
    {trio, "max_move_um = 5000;", "max_move_um = 5000; max_move_um = 6000;", 0, "duplicate setting"},
    {trio, "revision = 7;", "@include \"other.conf\"", 0, "one file"},
    {trio, "revision = 7;", "revision = 4294967297;", 0, "more than 9 digits"},
    {trio, "max_move_um = 5000;", "max_move_um = 4294972296;", 0, "more than 9 digits"},
    {trio, "revision = 7;", "revision = 0x7;", 0, "decimal"},
    {trio, "revision = 7;", "revision = 7L;", 0, "decimal"},
    {trio, "x = (100, 24900)", "x = [100, 24900.5]", 0, "mismatched element type"},
    /* keys that are not there */
    {trio, "allow_calibrate = false", "stay_armed = 1", 0, "'stay_armed' is true or false"},
    {trio, "allow_calibrate = false", "relay = \"D22\"", 0, "'relay' is true or false"},
    {trio, "margin_um = 50;", "margins_um = 50;", 0, "no key 'margins_um'"},
    {trio, "margin_um = 50;", "margin = 50;", 0, "'margin' has no unit: it is 'margin_um'"},
    {trio, "max_move_um", "max_move", 0, "'max_move' has no unit: it is 'max_move_um'"},
    {trio, "clearance_um", "clearance", 0, "'clearance' has no unit"},
    {trio, "knob_um_per_s", "knob", 0, "'knob' has no unit"},
    {trio, "arm_idle_s", "arm_idle", 0, "'arm_idle' has no unit"},
    {trio, "unstoppable_ms", "unstoppable", 0, "'unstoppable' has no unit"},
    {trio, "angle_min_deg", "angle_min", 0, "'angle_min' has no unit"},
    {trio, "box_um = {", "box = {", 0, "'box' has no unit"},
    {trio, "through_um", "through", 0, "'through' has no unit"},
    {trio, "microstep_um", "microstep", 0, "'microstep' has no unit"},
    {trio, "margin_um = 50;", "margin_mm = 0.05;", 0, "no key 'margin_mm'"},
    {trio, "    exit = \"-z\";", "    exits = \"-z\";", 0, "no key 'exits'"},
    {trio, "      axis = \"z\";", "      along = \"z\";", 0, "no key 'along'"},
    {trio, "      normal = (0, 0, -1);", "      direction = (0, 0, -1);", 0, "no key 'direction'"},
    {trio, "      x = (9000, 16000);", "      u = (9000, 16000);", 0, "no key 'u'"},
    {trio, "revision = 7;", "revision = 7; allow_stream = true;", 0, "no key 'allow_stream'"},
    {mpc, "revision = 1;", "revision = 1; angle_min_deg = 10;", 0, "no key 'angle_min_deg'"},
    {mpc, "revision = 1;", "revision = 1; external_switch6_on = true;", 0, "no key 'external_switch6_on'"},
    {mpc, "revision = 1;", "revision = 1; switch8_on = true;", 0, "no key 'switch8_on'"},
    {trio, "number = 1;", "number = 1; switch8_on = true;", 0, "no key 'switch8_on'"},
    /* keys that are missing: the error stands where the group begins */
    {trio, "format = 1;\n", "", 0, "'format' is missing"},
    {trio, "revision = 7;\n", "", -1, "'revision' is missing"},
    {trio, "profile = \"trio-mp245a\";\n", "", -2, "'profile' is missing"},
    {trio, "firmware = \"3.12\";\n", "", -3, "'firmware' is missing"},
    {trio, "external_switch5_on = true;\n", "", -5, "'external_switch5_on' is missing; it has no default"},
    {trio, "external_switch6_on = false;\n", "", -6, "'external_switch6_on' is missing"},
    {trio, "  { number = 1;", "  {", 0, "'number' is missing"},
    {trio, "    device = \"MP-845\";", "", -1, "'device' is missing"},
    {trio, "    microstep_um = 0.09375;", "", -2, "'microstep_um' is missing"},
    {trio, "      y = (100.5, 24900);", "", -2, "'y' is missing"},
    {trio, "      retract = \"-z\";", "", -1, "'retract' is missing"},
    {trio, "      at_um = 8000;", "", -2, "'at_um' is missing"},
    {trio, "      clearance_um = 500;", "", -3, "'clearance_um' is missing"},
    {trio, "      approach = (707, 0, 707); };", "};", -5, "'approach' is missing"},
    {trio, "name = \"objective\";", "", 0, "'name' is missing"},
    {trio, "    drive = 1;\n    exit", "    exit", -1, "'drive' is missing"},
    {trio, "      normal = (0, 0, -1);", "", -1, "'normal' is missing"},
    {trio, "      radius_to = 4000; };", "};", -6, "'radius_to' is missing"},
    {trio, "      centre = (12500, 12500);", "", -2, "'centre' is missing"},
    {mpc, "device = \"MP-285\";", "", -1, "'device' is missing"},
    {mpc, "    switch8_on = true;\n", "", -3, "'switch8_on' is missing; it has no default"},
    /* values of the wrong kind */
    {trio, "format = 1;", "format = \"1\";", 0, "'format' is a whole number"},
    {trio, "format = 1;", "format = 2;", 0, "'format' is 2; this program knows format 1"},
    {trio, "revision = 7;", "revision = 7.5;", 0, "'revision' is a whole number"},
    {trio, "revision = 7;", "revision = 0;", 0, "'revision' is 0"},
    {trio, "revision = 7;", "revision = -7;", 0, "'revision' is -7"},
    {trio, "\"trio-mp245a\"", "\"trio\"", 0, "'profile' is \"trio\": expected one of"},
    {trio, "\"trio-mp245a\"", "245", 0, "'profile' is a text"},
    {trio, "\"3.12\"", "3.12", 0, "'firmware' is a text"},
    {trio, "\"3.12\"", "\"three\"", 0, "'firmware' is \"three\""},
    {trio, "\"FT123\"", "\"\"", 0, "'converter_serial' has 1 to 16"},
    {trio, "\"FT123\"", "\"FT1234567890123456\"", 0, "'converter_serial' has 1 to 16"},
    {trio, "\"FT123\"", "\"FT 12\"", 0, "without blanks"},
    {trio, "switch5_on = true", "switch5_on = 1", 0, "'external_switch5_on' is true or false"},
    {trio, "switch6_on = false", "switch6_on = \"off\"", 0, "'external_switch6_on' is true or false"},
    {mpc, "switch8_on = true", "switch8_on = 8", 0, "'switch8_on' is true or false"},
    {trio, "\"silent\"", "\"cr\"", 0, "'refusal' is \"cr\": expected one of \"silent\", \"E\""},
    {trio, "\"stop\"", "\"continue\"", 0, "'on_host_loss' is \"continue\""},
    {trio, "\"documented\"", "\"exact\"", 0, "'path_model' is \"exact\""},
    {mpc, "\"zero\"", "\"0\"", 0, "'mpc_home' is \"0\""},
    {trio, "margin_um = 50;", "margin_um = \"50\";", 0, "'margin_um' is a number"},
    {trio, "x = (100, 24900);", "x = 24900;", 0, "'x' is 2 numbers in parentheses"},
    {trio, "x = (100, 24900);", "x = (100, 200, 24900);", 0, "'x' is 2 numbers in parentheses"},
    {trio, "x = (100, 24900);", "x = (100, \"24900\");", 0, "'x' is 2 numbers in parentheses"},
    {trio, "approach = (707, 0, 707)", "approach = (0.7, 0, 0.7)", 0, "whole numbers from -1024 to 1024"},
    {trio, "approach = (707, 0, 707)", "approach = (70, 70)", 0, "'approach' is 3 numbers"},
    {trio, "fastest_level = 15;", "fastest_level = \"fast\";", 0, "0 to 15, or \"full\""},
    {trio, "at_um = 8000", "at_um = true", 0, "'at_um' is a number"},
    {trio, "    box_um = {\n      x = (9000", "    box_um = 5; half = {\n      x = (9000", -3, "one shape"},
    /* values that are nonsense */
    {trio, "angle_min_deg = 10", "angle_min_deg = 0", 0, "'angle_min_deg' is 0: expected 1 to 89"},
    {trio, "angle_max_deg = 80", "angle_max_deg = 90", 0, "'angle_max_deg' is 90: expected 1 to 89"},
    {trio, "angle_min_deg = 10", "angle_min_deg = 81", 0, "'angle_min_deg' is above 'angle_max_deg'"},
    {mpc, "roe_mode_min = 3", "roe_mode_min = 10", 0, "'roe_mode_min' is 10"},
    {trio, "unstoppable_ms = 200", "unstoppable_ms = 60001", 0, "'unstoppable_ms' is 60001"},
    {trio, "unstoppable_ms = 200", "unstoppable_ms = -1", 0, "'unstoppable_ms' is -1"},
    {trio, "arm_idle_s = 900", "arm_idle_s = 0", 0, "'arm_idle_s' is 0"},
    {trio, "arm_idle_s = 900", "arm_idle_s = 2001", 0, "'arm_idle_s' is 2001"},
    {trio, "margin_um = 50", "margin_um = -1", 0, "'margin_um' is -1"},
    {trio, "margin_um = 50", "margin_um = 10001", 0, "'margin_um' is 10001"},
    {trio, "margin_um = 50", "margin_um = 1e400", 0, "'margin_um' is inf"},
    {trio, "knob_um_per_s = 5000", "knob_um_per_s = 0", 0, "only with 'knobs_locked = true'"},
    {trio, "knob_um_per_s = 5000", "knob_um_per_s = 20001", 0, "'knob_um_per_s' is 20001"},
    {trio, "beyond_zero_um = 300", "beyond_zero_um = -300", 0, "'beyond_zero_um' is -300"},
    {trio, "number = 1", "number = 2", 0, "'number' is 2: expected 1 to 1"},
    {mpc, "number = 2", "number = 5", 0, "'number' is 5: expected 1 to 4"},
    {mpc, "number = 4", "number = 2", 0, "drive 2 is told twice"},
    {trio, "\"MP-845\"", "\"MP-225\"", 0, "no device \"MP-225\"; there are MP-845"},
    {mpc, "\"MP-285\"", "\"MP-99\"", 0, "no device \"MP-99\""},
    {mpc, "\"MP-285\"", "\"MOM\"", 0, "MOM"},
    {trio, "microstep_um = 0.09375", "microstep_um = 0.0625", 0,
     "'microstep_um' of an MP-845 on a TRIO MP-245A is 0.093750"},
    {mpc, "microstep_um = 0.078125", "microstep_um = 0.0781", 0,
     "'microstep_um' of an MT-800 on a MPC-200 is 0.078125"},
    {trio, "x = (100, 24900);", "x = (24900, 100);", 0, "must be below the second"},
    {trio, "x = (100, 24900);", "x = (100, 100);", 0, "must be below the second"},
    {trio, "x = (100, 24900);", "x = (-1, 24900);", 0, "beyond the travel of the device, axis x"},
    {trio, "z = (100, 24900); };", "z = (100, 25001); };", 0,
     "beyond the travel of the device, axis z: 0 to 25000.03125 um"},
    {trio, "z = (100, 24900); };", "z = (100, 300000); };", 0, "has 300000: expected"},
    {trio, "x = (100, 24900);", "x = (100.001, 100.015);", 0, "axis x"},
    {trio, "max_move_um = 5000", "max_move_um = 0", 0, "allows no move"},
    {trio, "max_move_um = 5000", "max_move_um = -5", 0, "'max_move_um' is -5"},
    {trio, "fastest_level = 15;", "fastest_level = 16;", 0, "'fastest_level' is 16: expected 0 to 15"},
    {trio, "fastest_level = 15;", "fastest_level = 2;", 0, "below the surface is above that of the drive"},
    {trio, "retract = \"-z\"", "retract = \"none\"", -1, "'retract' is the way out of the specimen"},
    {trio, "retract = \"-z\"", "retract = \"up\"", 0, "'retract' is \"up\""},
    {trio, "at_um = 8000", "at_um = 26000", -2, "not within the travel"},
    {trio, "clearance_um = 500", "clearance_um = 8000", -3, "no room is left above surface"},
    {trio, "clearance_um = 500", "clearance_um = -1", 0, "'clearance_um' is -1"},
    {trio, "approach = (707, 0, 707)", "approach = (1, 1, 0)", -5, "must lead along the axis of 'retract'"},
    {trio, "approach = (707, 0, 707)", "approach = (0, 0, 0)", 0, "that is no direction"},
    {trio, "approach = (707, 0, 707)", "approach = (1025, 0, 707)", 0, "whole numbers from -1024 to 1024"},
    {trio, "name = \"bath\"", "name = \"objective\"", 0, "two obstacles \"objective\""},
    {trio, "name = \"bath\"", "name = \"\"", 0, "'name' has 1 to 31 letters"},
    {trio, "name = \"bath\"", "name = \"a name that is longer than any name\"", 0, "'name' has 1 to 31 letters"},
    {trio, "    drive = 1;\n    exit", "    drive = 5;\n    exit", 0, "'drive' is 5"},
    {trio, "    drive = 1;\n    exit", "    drive = 2;\n    exit", 0, "not among 'drives'"},
    {trio, "exit = \"-z\"", "exit = \"z\"", 0, "'exit' is \"z\""},
    {trio, "      x = (9000, 16000);", "      x = (16000, 9000);", 0, "must be below the second"},
    {trio, "      x = (9000, 16000);", "      x = (90000, 160000);", -4, "A slip of sign or unit?"},
    {trio, "normal = (0, 0, -1)", "normal = (0, 0, 0)", 0, "that is no direction"},
    {trio, "through_um = (0, 0, 20000)", "through_um = (0, 0, 50)", 0, "an obstacle and its margin leave nothing"},
    {trio, "through_um = (0, 0, 20000)", "through_um = (0, 0, 90000)", 0, "nowhere near"},
    {trio, "from = 12000", "from = 16000", 0, "it must be below 'to'"},
    {trio, "radius_to = 4000", "radius_to = -4000", 0, "'radius_to' is -4000"},
    {trio, "axis = \"z\"", "axis = \"w\"", 0, "'axis' is \"w\""},
    {trio, "centre = (12500, 12500)", "centre = (12500, 12500, 0)", 0, "'centre' is 2 numbers"},
};

/* Where an error about a whole obstacle or drive is told is looked up by what stands there, see the two lines that follow. */
static unsigned expected_line(const mutant *m, unsigned line)
{
    if (strstr(m->says, "leave nothing") != NULL)
        return 24; /* box_um of the drive */
    if (strstr(m->says, "nowhere near") != NULL)
        return 45; /* name of the obstacle */
    return (unsigned)((int)line + m->below);
}

static void a_hundred_mutants_are_refused_with_line_and_reason(void)
{
    char message[RIG_WHY_MAX + 256], expected[32];
    TEST_ASSERT_GREATER_OR_EQUAL_UINT(100, sizeof mutants / sizeof mutants[0]);
    for (size_t i = 0; i < sizeof mutants / sizeof mutants[0]; i++) {
        const mutant *const m = &mutants[i];
        unsigned line;
        char *const text = changed(m->text, m->find, m->put, &line);
        const bool good = read_text(text, strlen(text));
        free(text);
        (void)snprintf(message, sizeof message, "'%s' for '%s': %s", m->put, m->find, why);
        TEST_ASSERT_FALSE_MESSAGE(good, message);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, m->says), message);
        (void)snprintf(expected, sizeof expected, ":%u: ", expected_line(m, line));
        TEST_ASSERT_EQUAL_STRING_LEN_MESSAGE(expected, why, strlen(expected), message);
    }
}

/* What is cut off anywhere is refused, but where only white space or the end of the last line is missing. */
static void every_truncation_is_refused(void)
{
    for (size_t size = 0; size < sizeof mpc - 3; size++)
        TEST_ASSERT_FALSE_MESSAGE(read_text(mpc, size), "a truncated text was taken");
    TEST_ASSERT_TRUE(read_text(mpc, sizeof mpc - 1));
}

/* A flipped bit is refused with its line, or changes nothing, or only a value within what is allowed. How often, the manual
 * says of its example: these numbers. */
static void what_a_flipped_bit_comes_to_is_in_the_manual(void)
{
    static char manual[65536];
    char said[256];
    unsigned refused = 0, same = 0, other = 0;
    FILE *const file = fopen(MANUAL, "r");
    TEST_ASSERT_NOT_NULL(file);
    manual[fread(manual, 1, sizeof manual - 1, file)] = '\0';
    (void)fclose(file);
    char *const text = strstr(manual, "```") + 3;
    const size_t size = (size_t)(strstr(text, "```") - text);
    TEST_ASSERT_TRUE_MESSAGE(read_text(text, size), why);
    const uint32_t crc = dr_limits_crc(&read_rig.limits);
    for (size_t at = 0; at < size; at++)
        for (unsigned bit = 0; bit < 8; bit++) {
            dr_limits_problem problem;
            text[at] = (char)((unsigned char)text[at] ^ 1u << bit);
            if (!read_text(text, size)) {
                TEST_ASSERT_TRUE_MESSAGE(why[0] == ':' && why[1] >= '1' && why[1] <= '9', why); /* the line */
                refused++;
            } else if (dr_limits_crc(&read_rig.limits) == crc) {
                same++;
            } else {
                TEST_ASSERT_TRUE(dr_limits_check(&read_rig.limits, &problem));
                other++;
            }
            text[at] = (char)((unsigned char)text[at] ^ 1u << bit);
        }
    (void)snprintf(said, sizeof said, "%u,%03u flips of one bit of the\nTRIO's example above, %u,%03u are refused",
                   (refused + same + other) / 1000, (refused + same + other) % 1000, refused / 1000, refused % 1000);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(manual, said), said);
    (void)snprintf(said, sizeof said, "%u,%03u change nothing (remarks, spaces, names), and %u make", same / 1000,
                   same % 1000, other);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(manual, said), said);
}

static void what_is_no_configuration_is_told(void)
{
    static char huge[70000];
    TEST_ASSERT_FALSE(rig_read(&read_rig, "/nowhere/rig.conf", why, sizeof why));
    TEST_ASSERT_EQUAL_STRING("/nowhere/rig.conf: No such file or directory", why);
    TEST_ASSERT_FALSE(rig_read(&read_rig, "/", why, sizeof why));
    TEST_ASSERT_EQUAL_STRING("/: Is a directory", why);
    TEST_ASSERT_FALSE(read_text("", 0));
    TEST_ASSERT_EQUAL_STRING(":1: 'format' is missing; it has no default", why);
    memset(huge, '#', sizeof huge);
    TEST_ASSERT_FALSE(read_text(huge, sizeof huge));
    TEST_ASSERT_NOT_NULL(strstr(why, "longer than"));
    TEST_ASSERT_FALSE(read_text(trio, sizeof trio)); /* with its closing 0 */
    TEST_ASSERT_NOT_NULL(strstr(why, "not a text"));
}

static void numbers_in_comments_and_texts_are_no_numbers(void)
{
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "revision = 7;", "revision = 7; # 12345678901 0x7 @"), why);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "revision = 7;", "revision = 7; // 12345678901"), why);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "revision = 7;", "revision = 7; /* 12345678901\n @ */"), why);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "\"bath\"", "\"@ 12345678901 \\\" 0x7\""), why);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(trio, "margin_um = 50;", "margin_um = 50.00000000000001;"), why);
}

static void too_many_obstacles_are_told(void)
{
    static char text[sizeof trio + 64 * 128];
    const int last = (int)(strrchr(trio, ')') - trio);
    int used = snprintf(text, sizeof text, "%.*s", last, trio);
    for (unsigned i = 0; i < 23; i++) /* two and a cone are there */
        used += snprintf(text + used, sizeof text - (size_t)used,
                         ", { name = \"o%u\"; drive = 1; box_um = { x = (1, 2); y = (1, 2); z = (1, 2); }; }\n", i);
    (void)snprintf(text + used, sizeof text - (size_t)used, ");\n");
    TEST_ASSERT_FALSE(read_text(text, strlen(text)));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(why, "more than 32 obstacles"), why);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_trio_is_read_to_the_quantum);
    RUN_TEST(an_mpc_is_read_with_its_drives_and_permissions);
    RUN_TEST(facts_and_permissions_become_bits);
    RUN_TEST(rounding_is_always_to_the_safe_side);
    RUN_TEST(a_cone_is_inside_its_boxes);
    RUN_TEST(what_is_left_out_is_careful);
    RUN_TEST(a_hundred_mutants_are_refused_with_line_and_reason);
    RUN_TEST(every_truncation_is_refused);
    RUN_TEST(what_a_flipped_bit_comes_to_is_in_the_manual);
    RUN_TEST(what_is_no_configuration_is_told);
    RUN_TEST(numbers_in_comments_and_texts_are_no_numbers);
    RUN_TEST(too_many_obstacles_are_told);
    return UNITY_END();
}
