/* What dr_words says: every name that the manuals print is known, every index has words, and bytes typed from the
 * manuals' tables come out as the sentences that a person should read. */
#include "dr_words.h"

#include "dr_wire.h"

#include <stdio.h>
#include <string.h>
#include <unity.h>

void setUp(void) {}
void tearDown(void) {}

static char said[512];

#define SAYS(text, call)                                                                                               \
    do {                                                                                                               \
        memset(said, '#', sizeof said);                                                                                \
        const size_t length = (call);                                                                                  \
        TEST_ASSERT_EQUAL_STRING((text), said);                                                                        \
        TEST_ASSERT_EQUAL_size_t(strlen(text), length);                                                                \
    } while (0)

static const dr_words_context trio = {DR_TRIO, DR_FIRMWARE_TRIO, DR_STAGE_TRIO_MP845};
static const dr_words_context mpc = {DR_MPC, DR_FIRMWARE_MPC, DR_STAGE_MPC_MP225};
static const dr_words_context mpc_bare = {DR_MPC, DR_FIRMWARE_MPC, DR_STAGE_NONE};

/* -- Names -------------------------------------------------------------------------------------------------------- */

static void test_controllers_have_names(void)
{
    dr_kind kind = DR_TRIO;
    TEST_ASSERT_TRUE(dr_words_kind_find("MPC", &kind));
    TEST_ASSERT_EQUAL(DR_MPC, kind);
    TEST_ASSERT_TRUE(dr_words_kind_find("trio mp-245a", &kind));
    TEST_ASSERT_EQUAL(DR_TRIO, kind);
    TEST_ASSERT_TRUE(dr_words_kind_find("mpc-200", &kind));
    TEST_ASSERT_FALSE(dr_words_kind_find("mpc-20", &kind));
    TEST_ASSERT_FALSE(dr_words_kind_find("", &kind));
    TEST_ASSERT_EQUAL_STRING("TRIO MP-245A", dr_words_controller(DR_TRIO));
    TEST_ASSERT_EQUAL_STRING("mpc", dr_words_kind(DR_MPC));
}

/* [T] tables 2, 4 and 5 with their footnotes; [M] tables 6, 7 and 8 with theirs. */
static void test_every_printed_stage_name_is_known(void)
{
    static const struct {
        dr_kind kind;
        dr_stage_id id;
        const char *names[12];
    } rows[] = {
        {DR_TRIO,
         DR_STAGE_TRIO_MP845,
         {"MP-845", "MP-845/M", "MP-845S/M", "MP-845[S]/M", "MP-245", "MP-245/M", "MP-245[S]/M", "MP-x45[S]/M",
          "MP-X45", "mp845s", "mp-845S"}},
        {DR_TRIO, DR_STAGE_TRIO_MP865, {"MP-865/M", "mp-865"}},
        {DR_TRIO, DR_STAGE_TRIO_MP285, {"MP-285/M", "3DMS", "3dms", "MT-78", "MOM", "som"}},
        {DR_TRIO, DR_STAGE_TRIO_MP265, {"MP-265/M"}},
        {DR_MPC, DR_STAGE_MPC_MP225, {"MP-225/M", "MP-225", "mp225"}},
        {DR_MPC, DR_STAGE_MPC_MP285, {"MP-285/M", "3DMS", "MPC-78", "mpc78", "SOM"}},
        {DR_MPC, DR_STAGE_MPC_MP265, {"MP-265/M", "MP-265"}},
        {DR_MPC,
         DR_STAGE_MPC_MP845,
         {"MP-x45[S]/M", "MP-x45/M", "MP-245[S]/M", "MP-845[S]/M", "MP-845", "MPC-x8", "MPC-X8", "MPC-48", "MPC-88"}},
        {DR_MPC, DR_STAGE_MPC_MP865, {"MP-865/M"}},
        {DR_MPC, DR_STAGE_MPC_MT800, {"MT-800", "MT-8x0", "MT-820", "MT-22xx", "MT-2200"}},
        {DR_MPC, DR_STAGE_MPC_MOM, {"MOM", "mom"}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++)
        for (size_t k = 0; rows[i].names[k] != NULL; k++) {
            dr_stage_id id = DR_STAGE_NONE;
            TEST_ASSERT_TRUE_MESSAGE(dr_words_stage_find(rows[i].kind, rows[i].names[k], &id), rows[i].names[k]);
            TEST_ASSERT_EQUAL_MESSAGE(rows[i].id, id, rows[i].names[k]);
        }
}

static void test_no_other_name_is_a_stage(void)
{
    static const char *const neither[] = {"",       "none",    "MP-84",   "MP-8455", "MP-845/", "MP-845/MM", "MP-865S",
                                          "MP-345", "MPC-x",   "MPC-888", "-MP-845", "MP--845", "MT-8x1",    "MT-22x",
                                          "845",    "MP-845 ", "MPC-",    "3DM",     "MOMS"};
    dr_stage_id id = DR_STAGE_NONE;
    for (size_t i = 0; i < sizeof neither / sizeof neither[0]; i++) {
        TEST_ASSERT_FALSE_MESSAGE(dr_words_stage_find(DR_TRIO, neither[i], &id), neither[i]);
        TEST_ASSERT_FALSE_MESSAGE(dr_words_stage_find(DR_MPC, neither[i], &id), neither[i]);
    }
    /* [T] names no MP-225 and no MPC-78; [M] names no MT-78 */
    TEST_ASSERT_FALSE(dr_words_stage_find(DR_TRIO, "MP-225", &id));
    TEST_ASSERT_FALSE(dr_words_stage_find(DR_TRIO, "MPC-78", &id));
    TEST_ASSERT_FALSE(dr_words_stage_find(DR_MPC, "MT-78", &id));
    TEST_ASSERT_EQUAL(DR_STAGE_NONE, id);
}

static void test_every_stage_finds_itself_by_its_name(void)
{
    for (unsigned i = DR_STAGE_NONE + 1; i < DR_STAGES; i++) {
        dr_stage stage;
        dr_stage_id id = DR_STAGE_NONE;
        TEST_ASSERT_TRUE(dr_stage_get((dr_stage_id)i, &stage));
        TEST_ASSERT_TRUE(dr_words_stage_find((dr_kind)stage.kind, dr_words_stage((dr_stage_id)i), &id));
        TEST_ASSERT_EQUAL(i, id);
    }
    TEST_ASSERT_EQUAL_STRING("none", dr_words_stage(DR_STAGE_NONE));
    TEST_ASSERT_EQUAL_STRING("MP-845", dr_words_stage(DR_STAGE_MPC_MP845));
    TEST_ASSERT_EQUAL_STRING("MT-800", dr_words_stage(DR_STAGE_MPC_MT800));
}

static void test_stage_lists(void)
{
    SAYS("MP-845 (also MP-245, MP-x45), MP-865, MP-285 (also 3DMS, MT-78, MOM, SOM), MP-265",
         dr_words_stages(said, sizeof said, DR_TRIO));
    SAYS("MP-225, MP-285 (also 3DMS, MPC-78, SOM), MP-265, MP-845 (also MP-245, MP-x45, MPC-x8), MP-865, "
         "MT-800 (also MT-8x0, MT-22xx), MOM",
         dr_words_stages(said, sizeof said, DR_MPC));
}

/* [M] table 7: firmware and ports */
static void test_why_a_stage_does_not_fit(void)
{
    SAYS("", dr_words_fit(said, sizeof said, DR_STAGE_MPC_MP845, DR_MPC, 0x0319, 1));
    SAYS("MP-845 needs firmware 3.19 or later, this is 3.16",
         dr_words_fit(said, sizeof said, DR_STAGE_MPC_MP845, DR_MPC, 0x0316, 1));
    SAYS("MOM works with firmware 3.13 and 3.16 only, this is 3.21",
         dr_words_fit(said, sizeof said, DR_STAGE_MPC_MOM, DR_MPC, 0x0321, 1));
    SAYS("MOM works on ports 1 and 3 only (port A of each controller), this is port 2",
         dr_words_fit(said, sizeof said, DR_STAGE_MPC_MOM, DR_MPC, 0x0316, 2));
    SAYS("this MP-225 is a stage of the other controller, not of the TRIO MP-245A",
         dr_words_fit(said, sizeof said, DR_STAGE_MPC_MP225, DR_TRIO, 0x0312, 1));
}

static void test_every_command_has_words(void)
{
    for (unsigned op = 0; op < DR_OPS; op++) {
        const dr_command_words *const words = dr_words_command((dr_op)op);
        TEST_ASSERT_NOT_NULL(words->name);
        TEST_ASSERT_TRUE(strlen(words->name) > 0 && strlen(words->asks) > 0 && strlen(words->meaning) > 0);
        TEST_ASSERT_EQUAL('.', words->meaning[strlen(words->meaning) - 1]);
        TEST_ASSERT_TRUE(op == DR_OP_NONE || words->source[0] == '[');
    }
    TEST_ASSERT_EQUAL_PTR(dr_words_command(DR_OP_NONE), dr_words_command(DR_OPS));
    TEST_ASSERT_EQUAL_STRING("home", dr_words_command(DR_OP_TRIO_HOME)->name);
}

static void test_command_names_are_unique_in_their_controller(void)
{
    dr_command a, b;
    for (int kind = DR_TRIO; kind <= DR_MPC; kind++)
        for (uint8_t i = 0; dr_command_row((dr_kind)kind, i, &a); i++)
            for (uint8_t k = 0; dr_command_row((dr_kind)kind, k, &b); k++)
                TEST_ASSERT_EQUAL(a.op == b.op, strcmp(dr_words_command((dr_op)a.op)->name,
                                                       dr_words_command((dr_op)b.op)->name) == 0);
}

static void test_quirks(void)
{
    uint16_t core = 0;
    unsigned observed = 0, of_bytes = 0;
    for (unsigned i = 0; i < DR_QUIRK_IDS; i++) {
        const dr_quirk_words *const words = dr_words_quirk((dr_quirk_id)i);
        dr_quirk_id id = DR_QUIRK_IDS;
        TEST_ASSERT_NOT_NULL(words);
        TEST_ASSERT_TRUE(dr_words_quirk_find(words->name, &id));
        TEST_ASSERT_EQUAL(i, id);
        TEST_ASSERT_TRUE(strlen(words->meaning) > 0 && words->source[0] == '[');
        TEST_ASSERT_EQUAL_MESSAGE(0, core & words->core, "two quirks, one bit");
        core = (uint16_t)(core | words->core);
        observed += words->observed ? 1u : 0u;
        of_bytes += words->core == 0 ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_HEX16(0x00FF, core); /* the eight of dr_controller.h */
    TEST_ASSERT_EQUAL(4, observed);
    TEST_ASSERT_EQUAL(3, of_bytes);
    TEST_ASSERT_NULL(dr_words_quirk(DR_QUIRK_IDS));

    dr_quirk_id id = DR_QUIRK_IDS;
    TEST_ASSERT_TRUE(dr_words_quirk_find("Boot-Second", &id));
    TEST_ASSERT_EQUAL_HEX16(DR_QUIRK_BOOT_SECOND, dr_words_quirk(id)->core);
    TEST_ASSERT_FALSE(dr_words_quirk_find("observed", &id));
    TEST_ASSERT_FALSE(dr_words_quirk_find("boot", &id));
}

/* -- Numbers ------------------------------------------------------------------------------------------------------- */

static void test_numbers(void)
{
    SAYS("0", dr_words_number(said, sizeof said, 0));
    SAYS("999", dr_words_number(said, sizeof said, 999));
    SAYS("1,000", dr_words_number(said, sizeof said, 1000));
    SAYS("266,667", dr_words_number(said, sizeof said, 266667));
    SAYS("18,446,744,073,709,551,615", dr_words_number(said, sizeof said, UINT64_MAX));
}

static void test_microns_are_exact_and_short(void)
{
    SAYS("0.0", dr_words_um(said, sizeof said, 0));
    SAYS("25,000.0", dr_words_um(said, sizeof said, UINT64_C(400000) * 4u));    /* MP-225 */
    SAYS("25,000.0313", dr_words_um(said, sizeof said, UINT64_C(266667) * 6u)); /* MP-845 on a TRIO: .03125 */
    SAYS("24,999.9844", dr_words_um(said, sizeof said, UINT64_C(533333) * 3u)); /* MP-845 on an MPC: .984375 */
    SAYS("0.125", dr_words_um(said, sizeof said, 8));
    SAYS("0.0156", dr_words_um(said, sizeof said, 1));
    SAYS("0.9844", dr_words_um(said, sizeof said, 63));
    SAYS("0.5", dr_words_um(said, sizeof said, 32));
    SAYS("100.0", dr_words_um(said, sizeof said, 6400));
    for (uint64_t quanta = 0; quanta < 64; quanta++) { /* against exact decimals: 1/64 = 0.015625 */
        char whole[32];
        const uint64_t tenthousandths = (quanta * 15625u + 50u) / 100u;
        (void)snprintf(whole, sizeof whole, "7.%04u", (unsigned)tenthousandths);
        while (whole[strlen(whole) - 1] == '0' && whole[strlen(whole) - 2] != '.')
            whole[strlen(whole) - 1] = '\0';
        SAYS(whole, dr_words_um(said, sizeof said, UINT64_C(448) + quanta));
    }
}

static void test_firmware(void)
{
    uint16_t version = 0xFFFF;
    SAYS("3.21", dr_words_firmware(said, sizeof said, 0x0321));
    SAYS("1.03", dr_words_firmware(said, sizeof said, 0x0103));
    SAYS("12.90", dr_words_firmware(said, sizeof said, 0x1290));
    TEST_ASSERT_NULL(dr_words_firmware_parse("3.21", &version));
    TEST_ASSERT_EQUAL_HEX16(0x0321, version);
    TEST_ASSERT_NULL(dr_words_firmware_parse("1.00", &version));
    TEST_ASSERT_EQUAL_HEX16(0x0100, version);
    TEST_ASSERT_NULL(dr_words_firmware_parse("12.90", &version));
    TEST_ASSERT_EQUAL_HEX16(0x1290, version);

    static const char *const wrong[] = {"",     "3",    "3.",   "3.2",   "3.211", ".21",    "v3.21",
                                        "3,21", "3.2x", "321",  "3.21 ", " 3.21", "-3.21",  "123.45",
                                        "0.99", "0.00", "3.-1", "+3.21", "3. 21", "3.2\xB2"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        TEST_ASSERT_NOT_NULL_MESSAGE(dr_words_firmware_parse(wrong[i], &version), wrong[i]);
        TEST_ASSERT_EQUAL_HEX16(0x1290, version);
    }
}

/* -- Bytes --------------------------------------------------------------------------------------------------------- */

#define BYTES(...) (const uint8_t[]){__VA_ARGS__}, sizeof((const uint8_t[]){__VA_ARGS__})
#define ASKS(text, context, ...) SAYS(text, dr_words_request(said, sizeof said, &(context), BYTES(__VA_ARGS__)))
#define ANSWERS(text, context, op, ...)                                                                                \
    SAYS(text, dr_words_reply(said, sizeof said, &(context), (op), BYTES(__VA_ARGS__)))

static void test_trio_requests(void)
{
    ASKS("tell position and angle", trio, 0x63);
    ASKS("tell position and angle", trio, 0x43);
    ASKS("go home", trio, 0x68);
    ASKS("go to work", trio, 0x77);
    ASKS("stop", trio, 0x03);
    ASKS("recalibrate", trio, 0x52);
    ASKS("set the angle to 45 degrees", trio, 0x41, 45);
    ASKS("set the angle to 91 degrees, which is not within 0 to 90 and changes nothing", trio, 0x41, 91);
    ASKS("move to X 25,000.0313 um (266,667 steps)", trio, 0x78, 0xAB, 0x11, 0x04, 0x00);
    ASKS("move to Z 0.0938 um (1 step)", trio, 0x7A, 0x01, 0x00, 0x00, 0x00);
    ASKS("move in home order to X 93.75 um (1,000 steps), Y 187.5 um (2,000), Z 281.25 um (3,000)", trio, 0x48, 0xE8,
         0x03, 0, 0, 0xD0, 0x07, 0, 0, 0xB8, 0x0B, 0, 0);
    ASKS("move straight at speed 0 (312.5 um/s) to X 0.0 um (0 steps), Y 0.0 um (0), Z 0.0 um (0)", trio, 0x53, 0, 0, 0,
         0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    ASKS("move to Y 402,653,183.9063 um (4,294,967,295 steps, beyond the travel of 266,667, -1 as a signed number)",
         trio, 0x79, 0xFF, 0xFF, 0xFF, 0xFF);
}

static void test_mpc_requests(void)
{
    ASKS("move to X 1,000.0 um (16,000 steps), Y 0.0 um (0), Z 25,000.0 um (400,000)", mpc, 0x4D, 0x80, 0x3E, 0, 0, 0,
         0, 0, 0, 0x80, 0x1A, 0x06, 0);
    ASKS("move to X 16,000 steps, Y 0 steps, Z 4,294,967,295 steps = -1 as a signed number", mpc_bare, 0x4D, 0x80, 0x3E,
         0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF);
    ASKS("move straight at speed 15 (1,300.0 um/s) to X 16,000 steps, Y 0 steps, Z 0 steps", mpc_bare, 0x53, 15, 0x80,
         0x3E, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    ASKS("move straight at speed 23, which counts as 7 (650.0 um/s) to X 0.0 um (0 steps), Y 0.0 um (0), Z 0.0 um (0)",
         mpc, 0x53, 23, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0);
    ASKS("make active drive 2", mpc, 0x49, 2);
    ASKS("make active drive 0x32 '2', which is no drive: they are the bytes 0x01 to 0x04", mpc, 0x49, 0x32);
    ASKS("set mode 9", mpc, 0x4C, 9);
    ASKS("set mode 10, which is not within 0 to 9 and changes nothing", mpc, 0x4C, 10);
    ASKS("calibrate", mpc, 0x4E);
    const dr_words_context old = {DR_MPC, 0x0103, DR_STAGE_MPC_MP225};
    ASKS("go to the centre", old, 0x4E);
}

static void test_bytes_that_are_no_command(void)
{
    ASKS("0x63 'c' is no command of the MPC-200 with firmware 3.21", mpc, 0x63);
    ASKS("0xEE is no command of the TRIO MP-245A with firmware 3.12", trio, 0xEE);
    ASKS("line: 2 bytes of a command that has 14", mpc, 0x53, 0x0F);
    ASKS("move: 1 byte of a command that has 13", mpc, 0x4D);
    ASKS("position: 2 bytes of a command that has 1", mpc, 0x43, 0x0D);
    SAYS("nothing", dr_words_request(said, sizeof said, &mpc, (const uint8_t *)"", 0));
}

static void test_replies(void)
{
    ANSWERS("X 1,000.0313 um (10,667 steps), Y 0.0 um (0), Z 0.0 um (0), angle 30 degrees", trio, DR_OP_TRIO_POSITION,
            0xAB, 0x29, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 30, 0x0D);
    ANSWERS("drive 2: X 1,000.0 um (16,000 steps), Y 0.0 um (0), Z 0.0 um (0)", mpc, DR_OP_MPC_POSITION, 2, 0x80, 0x3E,
            0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x0D);
    ANSWERS("2 drives connected: 1, 3", mpc, DR_OP_MPC_DRIVES, 2, 1, 0, 1, 0, 0x0D);
    ANSWERS("drive 1 is active, firmware 3.15", mpc, DR_OP_MPC_ACTIVE, 1, 0x15, 0x03, 0x0D); /* [M] note 15 */
    ANSWERS("drive 4 is active", mpc, DR_OP_MPC_SELECT, 4, 0x0D);
    ANSWERS("error: no such drive is connected", mpc, DR_OP_MPC_SELECT, 0x45, 0x0D);
    ANSWERS("move: task complete", mpc, DR_OP_MPC_MOVE, 0x0D);
    ANSWERS("home: task complete", trio, DR_OP_TRIO_HOME, 0x0D);

    const dr_words_context old = {DR_MPC, 0x0105, DR_STAGE_MPC_MP225};
    ANSWERS("1 drive connected", old, DR_OP_MPC_COUNT, 1, 0x0D);
    ANSWERS("drive 1 is active", old, DR_OP_MPC_ACTIVE, 1, 0x0D);
    ANSWERS("task complete", old, DR_OP_MPC_SELECT, 0x0D);
}

static void test_bytes_that_are_no_reply(void)
{
    ANSWERS("no answer to position: 13 bytes instead of 14", mpc, DR_OP_MPC_POSITION, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
            0, 0x0D);
    ANSWERS("no answer to move: the last byte is 0x49 'I', not CR", mpc, DR_OP_MPC_MOVE, 0x49);
    ANSWERS("no answer to select: a value that no controller sends there", mpc, DR_OP_MPC_SELECT, 9, 0x0D);
    ANSWERS("an answer to no command of this controller", mpc, DR_OP_TRIO_HOME, 0x0D);
    ANSWERS("an answer to no command of this controller", mpc, DR_OP_NONE, 0x0D);
    SAYS("no answer to move: 0 bytes instead of 1",
         dr_words_reply(said, sizeof said, &mpc, DR_OP_MPC_MOVE, (const uint8_t *)"", 0));
}

static void test_streamed_positions(void)
{
    SAYS("at X 1.0 um (16 steps), Y 0.0 um (0), Z 0.8125 um (13)",
         dr_words_stream(said, sizeof said, &mpc, BYTES(0xFF, 0xFF, 0xFF, 16, 0, 0, 0, 0, 0, 0x0D, 0, 0)));
    SAYS("no streamed position: it does not begin with FF FF FF",
         dr_words_stream(said, sizeof said, &mpc, BYTES(0xFF, 0xFF, 0, 16, 0, 0, 0, 0, 0, 0x0D, 0, 0)));
    SAYS("no streamed position: 1 byte instead of 12", dr_words_stream(said, sizeof said, &mpc, BYTES(0x0D)));
}

/* -- Notes --------------------------------------------------------------------------------------------------------- */

#define NOTES(text, context, ...)                                                                                      \
    do {                                                                                                               \
        const dr_note note = {__VA_ARGS__};                                                                            \
        SAYS(text, dr_words_note(said, sizeof said, &(context), &note));                                               \
    } while (0)

static void test_notes(void)
{
    NOTES("go home", mpc, .what = DR_NOTE_REQUEST, .op = DR_OP_MPC_HOME, .bytes = {0x48}, .count = 1);
    NOTES("home: task complete", mpc, .what = DR_NOTE_REPLY, .op = DR_OP_MPC_HOME, .bytes = {0x0D}, .count = 1);
    NOTES("CR between commands, swallowed", mpc, .what = DR_NOTE_FILLER, .bytes = {0x0D}, .count = 1);
    NOTES("LF between commands, swallowed", mpc, .what = DR_NOTE_FILLER, .bytes = {0x0A}, .count = 1);
    NOTES("0xEE is no command of the MPC-200 with firmware 3.21, ignored", mpc, .what = DR_NOTE_UNKNOWN,
          .bytes = {0xEE}, .count = 1);
    NOTES("1 byte of the host was lost", mpc, .what = DR_NOTE_LOST, .value = 1);
    NOTES("2,000 bytes of the host were lost", mpc, .what = DR_NOTE_LOST, .value = 2000);
    NOTES("drive 2 runs to X 1,000.0 um (16,000 steps), Y 0.0 um (0), Z 0.0 um (0) in 333.334 ms", mpc,
          .what = DR_NOTE_LEG, .drive = 1, .value = 333334, .steps = {16000, 0, 0});
    NOTES("has arrived at X 0.0 um (0 steps), Y 0.0 um (0), Z 0.0 um (0)", trio, .what = DR_NOTE_ARRIVED);
    NOTES("drive 1 was stopped at X 0.0625 um (1 step), Y 0.0 um (0), Z 0.0 um (0)", mpc, .what = DR_NOTE_STOPPED,
          .steps = {1, 0, 0});
    NOTES("the target of Y is beyond the travel", mpc, .what = DR_NOTE_CLIPPED, .value = DR_Y);
    NOTES("X does not move at an angle of 90 degrees", trio, .what = DR_NOTE_AXIS_STANDS, .value = DR_X);
    NOTES("Z does not move at an angle of 0 degrees", trio, .what = DR_NOTE_AXIS_STANDS, .value = DR_Z);
    NOTES("0x5B '[' is out of range for angle and changes nothing", trio, .what = DR_NOTE_BAD_VALUE,
          .op = DR_OP_TRIO_ANGLE, .value = 91);
    NOTES("MP-845 was plugged into port 3", mpc, .what = DR_NOTE_CONNECTED, .drive = 2, .value = DR_STAGE_MPC_MP845);
    NOTES("by hand: go home", trio, .what = DR_NOTE_HAND, .value = DR_EFFECT_HOME);
    NOTES("by hand: go to work", mpc, .what = DR_NOTE_HAND, .value = DR_EFFECT_WORK);
    NOTES("by hand: calibrate", mpc, .what = DR_NOTE_HAND, .value = DR_EFFECT_CALIBRATE);
    NOTES("by hand: pause", trio, .what = DR_NOTE_HAND, .value = DR_EFFECT_PAUSE);
    NOTES("by hand: go on", trio, .what = DR_NOTE_HAND, .value = DR_EFFECT_RESUME);
    NOTES("by hand: stop", mpc, .what = DR_NOTE_HAND, .value = DR_EFFECT_STOP);
    NOTES("by hand: select drive 2", mpc, .what = DR_NOTE_HAND, .value = DR_EFFECT_SELECT, .bytes = {1}, .count = 1);
    NOTES("by hand: set mode 5", mpc, .what = DR_NOTE_HAND, .value = DR_EFFECT_MODE, .bytes = {5}, .count = 1);
    NOTES("by hand: set the angle to 30 degrees", trio, .what = DR_NOTE_HAND, .value = DR_EFFECT_ANGLE, .bytes = {30},
          .count = 1);
    NOTES("by hand: this place is home", trio, .what = DR_NOTE_HAND, .value = DR_EFFECT_STORE_HOME);
    NOTES("by hand: this place is the work position", trio, .what = DR_NOTE_HAND, .value = DR_EFFECT_STORE_WORK);
    NOTES("by hand: go home", trio, .what = DR_NOTE_HAND, .value = DR_EFFECT_HOME);
    NOTES("by hand: select drive 2", mpc, .what = DR_NOTE_HAND, .value = DR_EFFECT_SELECT, .bytes = {1}, .count = 1);
    NOTES("by hand: set the angle to 45 degrees", trio, .what = DR_NOTE_HAND, .value = DR_EFFECT_ANGLE, .bytes = {45},
          .count = 1);
    NOTES("port 3 was unplugged", mpc, .what = DR_NOTE_CONNECTED, .drive = 2, .value = DR_STAGE_NONE);
}

static void test_every_note_has_a_name_and_a_line(void)
{
    const char *seen[DR_NOTE_STARTED + 1];
    for (unsigned kind = 0; kind <= DR_NOTE_STARTED; kind++) {
        const dr_note note = {.what = (uint8_t)kind, .op = DR_OP_MPC_MOVE, .bytes = {0x4D}, .count = 1};
        TEST_ASSERT_TRUE(dr_words_note(said, sizeof said, &mpc, &note) > 0);
        TEST_ASSERT_NULL(strpbrk(said, "\r\n"));
        seen[kind] = dr_words_note_name((dr_note_kind)kind);
        TEST_ASSERT_TRUE(strcmp(seen[kind], "?") != 0);
        for (unsigned before = 0; before < kind; before++)
            TEST_ASSERT_TRUE(strcmp(seen[kind], seen[before]) != 0);
    }
    TEST_ASSERT_EQUAL_STRING("?", dr_words_note_name((dr_note_kind)(DR_NOTE_STARTED + 1)));
}

/* -- Room ---------------------------------------------------------------------------------------------------------- */

static void test_every_room_is_respected(void)
{
    static const uint8_t move[13] = {0x4D, 0x80, 0x3E, 0, 0, 0, 0, 0, 0, 0x80, 0x1A, 0x06, 0};
    char whole[256];
    const size_t length = dr_words_request(whole, sizeof whole, &mpc, move, sizeof move);
    TEST_ASSERT_EQUAL_size_t(length, dr_words_request(NULL, 0, &mpc, move, sizeof move));
    for (size_t room = 1; room <= length + 1; room++) {
        memset(said, '#', sizeof said);
        TEST_ASSERT_EQUAL_size_t(length, dr_words_request(said, room, &mpc, move, sizeof move));
        TEST_ASSERT_EQUAL_size_t(room - 1, strlen(said));
        TEST_ASSERT_EQUAL(0, memcmp(whole, said, room - 1));
        TEST_ASSERT_EQUAL('#', said[room]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_controllers_have_names);
    RUN_TEST(test_every_printed_stage_name_is_known);
    RUN_TEST(test_no_other_name_is_a_stage);
    RUN_TEST(test_every_stage_finds_itself_by_its_name);
    RUN_TEST(test_stage_lists);
    RUN_TEST(test_why_a_stage_does_not_fit);
    RUN_TEST(test_every_command_has_words);
    RUN_TEST(test_command_names_are_unique_in_their_controller);
    RUN_TEST(test_quirks);
    RUN_TEST(test_numbers);
    RUN_TEST(test_microns_are_exact_and_short);
    RUN_TEST(test_firmware);
    RUN_TEST(test_trio_requests);
    RUN_TEST(test_mpc_requests);
    RUN_TEST(test_bytes_that_are_no_command);
    RUN_TEST(test_replies);
    RUN_TEST(test_bytes_that_are_no_reply);
    RUN_TEST(test_streamed_positions);
    RUN_TEST(test_notes);
    RUN_TEST(test_every_note_has_a_name_and_a_line);
    RUN_TEST(test_every_room_is_respected);
    return UNITY_END();
}
