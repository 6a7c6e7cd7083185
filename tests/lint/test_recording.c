/* dr_recording: what is written can be read, and what cannot be read is named with its line. The lines are those of the
 * description in dr_recording.h. */
#include "dr_recording.h"

#include "unity.h"

#include <string.h>

static FILE *file;

void setUp(void)
{
    file = tmpfile();
    TEST_ASSERT_NOT_NULL(file);
}
void tearDown(void) { (void)fclose(file); }

static dr_recording_reader reader_of(const char *text)
{
    dr_recording_reader reader;
    TEST_ASSERT_GREATER_OR_EQUAL(0, fputs(text, file));
    rewind(file);
    (void)dr_recording_open(&reader, file);
    return reader;
}

/* The first record behind line 1 is wrong. */
static void is_wrong(const char *line, const char *why)
{
    char text[DR_RECORDING_LINE * 2];
    dr_recorded r;
    rewind(file);
    (void)snprintf(text, sizeof text, "dryrig-recording 1\n# nothing\n\n%s\n", line);
    dr_recording_reader reader = reader_of(text);
    TEST_ASSERT_FALSE_MESSAGE(dr_recording_next(&reader, &r), line);
    TEST_ASSERT_EQUAL_STRING(why, reader.why);
    TEST_ASSERT_EQUAL(4, reader.line);
}

static void it_is_written_as_described(void)
{
    static const uint8_t answer[] = {0x01, 0x80, 0x0D};
    char text[400] = "";
    TEST_ASSERT_TRUE(dr_recording_begin(file));
    TEST_ASSERT_TRUE(dr_recording_set(file, "mpc", "firmware", "3.21"));
    TEST_ASSERT_TRUE(dr_recording_bytes(file, 2340, 2391, "mpc", DR_RECORDING_FROM_HOST, (const uint8_t *)"C", 1));
    TEST_ASSERT_TRUE(dr_recording_bytes(file, 3512, 3570, "mpc", DR_RECORDING_TO_HOST, answer, sizeof answer));
    TEST_ASSERT_TRUE(dr_recording_event(file, 7200000001, 500061, "mpc", "the port has been opened"));
    rewind(file);
    (void)fread(text, 1, sizeof text - 1, file);
    TEST_ASSERT_EQUAL_STRING("dryrig-recording 1\n"
                             "set mpc firmware 3.21\n"
                             "0.002340 0.002391 mpc > 43\n"
                             "0.003512 0.003570 mpc < 01 80 0D\n"
                             "7200.000001 0.500061 mpc - the port has been opened\n",
                             text);
}

static void what_is_written_can_be_read(void)
{
    uint8_t bytes[DR_RECORDING_BYTES + 1];
    dr_recording_reader reader;
    dr_recorded r;
    for (size_t i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)(i * 4u);
    TEST_ASSERT_TRUE(dr_recording_begin(file));
    TEST_ASSERT_TRUE(dr_recording_set(file, "left", "position", "1,2,3"));
    TEST_ASSERT_TRUE(dr_recording_bytes(file, 1, 2, "left", DR_RECORDING_LOST, bytes, sizeof bytes));
    TEST_ASSERT_TRUE(dr_recording_event(file, 3, 4, "left", "power off"));
    rewind(file);
    TEST_ASSERT_TRUE(dr_recording_open(&reader, file));
    TEST_ASSERT_TRUE(dr_recording_next(&reader, &r));
    TEST_ASSERT_EQUAL('s', r.kind);
    TEST_ASSERT_EQUAL_STRING("left", r.name);
    TEST_ASSERT_EQUAL_STRING("position", r.key);
    TEST_ASSERT_EQUAL_STRING("1,2,3", r.text);
    TEST_ASSERT_TRUE(dr_recording_next(&reader, &r));
    TEST_ASSERT_EQUAL('!', r.kind);
    TEST_ASSERT_EQUAL(DR_RECORDING_BYTES, r.count);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(bytes, r.bytes, DR_RECORDING_BYTES);
    TEST_ASSERT_TRUE(dr_recording_next(&reader, &r)); /* the rest of the same instant */
    TEST_ASSERT_EQUAL_UINT64(1, r.when_us);
    TEST_ASSERT_EQUAL_UINT64(2, r.real_us);
    TEST_ASSERT_EQUAL(1, r.count);
    TEST_ASSERT_EQUAL_HEX8(bytes[DR_RECORDING_BYTES], r.bytes[0]);
    TEST_ASSERT_TRUE(dr_recording_next(&reader, &r));
    TEST_ASSERT_EQUAL_STRING("power off", r.text);
    TEST_ASSERT_FALSE(dr_recording_next(&reader, &r));
    TEST_ASSERT_EQUAL_STRING("", reader.why);
}

static void what_is_no_recording_is_named(void)
{
    TEST_ASSERT_EQUAL_STRING("it is empty; a recording begins with 'dryrig-recording 1'", reader_of("").why);
    rewind(file);
    TEST_ASSERT_EQUAL_STRING("it is no recording: one begins with 'dryrig-recording 1'", reader_of("\x7F"
                                                                                                   "ELF\n")
                                                                                             .why);
    rewind(file);
    TEST_ASSERT_EQUAL_STRING("its version is '2'; this program knows version 1", reader_of("dryrig-recording 2\n").why);
}

static void lines_that_are_wrong_are_named(void)
{
    is_wrong("0.1 0.000000 mpc > 43", "expected two times in seconds, with six decimals each, or 'set'");
    is_wrong("0.000001 0.000000", "a controller's name is missing, or longer than 63 characters");
    is_wrong("0.000001 0.000000 mpc ? 43", "'?' is none of > < ! -");
    is_wrong("0.000001 0.000000 mpc > 4", "'4' is no byte: two hexadecimal digits, with a blank between bytes");
    is_wrong("0.000001 0.000000 mpc > 4G", "'4G' is no byte: two hexadecimal digits, with a blank between bytes");
    is_wrong("0.000001 0.000000 mpc >", "bytes are missing");
    is_wrong("set mpc", "expected: set NAME KEY VALUE");
}

static void a_line_without_its_end_is_torn_off(void)
{
    dr_recorded r;
    dr_recording_reader reader =
        reader_of("dryrig-recording 1\n0.000001 0.000000 mpc > 43\n0.000002 0.000000 mpc < 01");
    TEST_ASSERT_TRUE(dr_recording_next(&reader, &r));
    TEST_ASSERT_FALSE(dr_recording_next(&reader, &r));
    TEST_ASSERT_EQUAL_STRING("the line is torn off: the recording ended in it", reader.why);
    TEST_ASSERT_EQUAL(3, reader.line);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(it_is_written_as_described);
    RUN_TEST(what_is_written_can_be_read);
    RUN_TEST(what_is_no_recording_is_named);
    RUN_TEST(lines_that_are_wrong_are_named);
    RUN_TEST(a_line_without_its_end_is_torn_off);
    return UNITY_END();
}
