/* dr_wire against the command tables of the manuals, byte by byte, and against itself there and back. */
#include "dr_wire.h"

#include "unity.h"

#include <stdio.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

/* Coordinates that the vectors below use, least significant byte first [P]. */
#define X_1000 0xE8, 0x03, 0x00, 0x00
#define Y_266667 0xAB, 0x11, 0x04, 0x00   /* 0x000411AB */
#define Z_16909060 0x04, 0x03, 0x02, 0x01 /* 0x01020304 */
#define XYZ X_1000, Y_266667, Z_16909060

/* -- Requests: [T table 6], [M table 9], the Tx rows ---------------------------------------------------------------- */

typedef struct {
    dr_kind kind;
    uint16_t firmware;
    dr_op op;
    uint8_t value;
    bool has[3];
    uint8_t bytes[14];
    size_t count;
} request_vector;

static const request_vector requests[] = {
    {DR_TRIO, 0x312, DR_OP_TRIO_POSITION, 0, {0, 0, 0}, {'c'}, 1},
    {DR_TRIO, 0x312, DR_OP_TRIO_HOME, 0, {0, 0, 0}, {0x68}, 1},
    {DR_TRIO, 0x312, DR_OP_TRIO_WORK, 0, {0, 0, 0}, {0x77}, 1},
    {DR_TRIO, 0x312, DR_OP_TRIO_HOME_TO, 0, {1, 1, 1}, {0x48, XYZ}, 13},
    {DR_TRIO, 0x312, DR_OP_TRIO_WORK_TO, 0, {1, 1, 1}, {0x57, XYZ}, 13},
    {DR_TRIO, 0x312, DR_OP_TRIO_LINE, 15, {1, 1, 1}, {0x53, 0x0F, XYZ}, 14},
    {DR_TRIO, 0x312, DR_OP_TRIO_X, 0, {1, 0, 0}, {0x78, X_1000}, 5},
    {DR_TRIO, 0x312, DR_OP_TRIO_Y, 0, {0, 1, 0}, {0x79, Y_266667}, 5},
    {DR_TRIO, 0x312, DR_OP_TRIO_Z, 0, {0, 0, 1}, {0x7A, Z_16909060}, 5},
    {DR_TRIO, 0x312, DR_OP_TRIO_ANGLE, 90, {0, 0, 0}, {0x41, 0x5A}, 2},
    {DR_TRIO, 0x312, DR_OP_TRIO_RECALIBRATE, 0, {0, 0, 0}, {0x52}, 1},
    {DR_TRIO, 0x312, DR_OP_TRIO_INTERRUPT, 0, {0, 0, 0}, {0x03}, 1},
    {DR_MPC, 0x299, DR_OP_MPC_COUNT, 0, {0, 0, 0}, {0x41}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_DRIVES, 0, {0, 0, 0}, {0x55}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_ACTIVE, 0, {0, 0, 0}, {0x4B}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_POSITION, 0, {0, 0, 0}, {0x43}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_SELECT, 4, {0, 0, 0}, {0x49, 0x04}, 2},
    {DR_MPC, 0x105, DR_OP_MPC_SELECT, 1, {0, 0, 0}, {0x49, 0x01}, 2},
    {DR_MPC, 0x321, DR_OP_MPC_HOME, 0, {0, 0, 0}, {0x48}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_WORK, 0, {0, 0, 0}, {0x59}, 1},
    {DR_MPC, 0x103, DR_OP_MPC_CENTRE, 0, {0, 0, 0}, {0x4E}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_CALIBRATE, 0, {0, 0, 0}, {0x4E}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_MOVE, 0, {1, 1, 1}, {0x4D, XYZ}, 13},
    {DR_MPC, 0x321, DR_OP_MPC_LINE, 15, {1, 1, 1}, {0x53, 0x0F, XYZ}, 14},
    {DR_MPC, 0x321, DR_OP_MPC_INTERRUPT, 0, {0, 0, 0}, {0x03}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_STREAM_OFF, 0, {0, 0, 0}, {0x46}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_STREAM_ON, 0, {0, 0, 0}, {0x4F}, 1},
    {DR_MPC, 0x321, DR_OP_MPC_MODE, 9, {0, 0, 0}, {0x4C, 0x09}, 2},
};

static const uint32_t xyz[3] = {1000, 266667, 16909060};

static dr_request request_of(const request_vector *vector)
{
    dr_request request = {0};
    request.op = (uint8_t)vector->op;
    request.value = vector->value;
    for (int axis = 0; axis < 3; axis++) {
        request.steps[axis] = vector->has[axis] ? xyz[axis] : 0;
    }
    return request;
}

static void check_request(const dr_request *want, const dr_request *got)
{
    TEST_ASSERT_EQUAL(want->op, got->op);
    TEST_ASSERT_EQUAL(want->value, got->value);
    const uint8_t axis = dr_wire_axis((dr_op)want->op);
    for (uint8_t i = 0; i < DR_AXES; i++) {
        if (axis == DR_AXES || axis == i) {
            TEST_ASSERT_EQUAL_UINT32(want->steps[i], got->steps[i]);
        }
    }
}

static void requests_are_the_bytes_of_the_manuals(void)
{
    TEST_ASSERT_EQUAL(DR_OPS - 1, COUNT(requests) - 1); /* 'I' stands twice */
    for (size_t i = 0; i < COUNT(requests); i++) {
        const request_vector *vector = &requests[i];
        const dr_request request = request_of(vector);
        uint8_t bytes[DR_FRAME_MAX + 1];
        memset(bytes, 0xA5, sizeof bytes);
        TEST_ASSERT_EQUAL(vector->count, dr_wire_put_request(vector->kind, vector->firmware, &request, bytes));
        TEST_ASSERT_EQUAL_HEX8_ARRAY(vector->bytes, bytes, vector->count);
        TEST_ASSERT_EQUAL_HEX8(0xA5, bytes[vector->count]); /* and not a byte more is written */

        dr_command command;
        TEST_ASSERT_TRUE(dr_command_find(vector->kind, vector->firmware, vector->bytes[0], &command));
        const dr_request back = dr_wire_get_request(&command, vector->bytes);
        check_request(&request, &back);
    }
}

static void upper_case_letters_of_the_trio_mean_the_same(void)
{
    static const char pairs[][2] = {{'c', 'C'}, {'x', 'X'}, {'y', 'Y'}, {'z', 'Z'}};
    for (size_t i = 0; i < COUNT(pairs); i++) {
        const uint8_t lower[] = {(uint8_t)pairs[i][0], X_1000}, upper[] = {(uint8_t)pairs[i][1], X_1000};
        dr_command a, b;
        TEST_ASSERT_TRUE(dr_command_find(DR_TRIO, 0x312, lower[0], &a));
        TEST_ASSERT_TRUE(dr_command_find(DR_TRIO, 0x312, upper[0], &b));
        const dr_request from_lower = dr_wire_get_request(&a, lower), from_upper = dr_wire_get_request(&b, upper);
        check_request(&from_lower, &from_upper);
    }
}

static void a_request_that_the_firmware_lacks_is_not_written(void)
{
    static const struct {
        dr_kind kind;
        uint16_t firmware;
        dr_op op;
    } absent[] = {
        {DR_TRIO, 0x261, DR_OP_TRIO_RECALIBRATE},
        {DR_TRIO, 0x312, DR_OP_MPC_HOME},
        {DR_MPC, 0x321, DR_OP_TRIO_HOME},
        {DR_MPC, 0x299, DR_OP_MPC_LINE},
        {DR_MPC, 0x321, DR_OP_MPC_COUNT},
        {DR_MPC, 0x299, DR_OP_MPC_DRIVES},
        {DR_MPC, 0x104, DR_OP_MPC_CENTRE},
        {DR_MPC, 0x103, DR_OP_MPC_CALIBRATE},
        {DR_MPC, 0x299, DR_OP_MPC_STREAM_ON},
        {DR_MPC, 0x321, DR_OP_NONE},
        {DR_MPC, 0x321, DR_OPS},
    };
    for (size_t i = 0; i < COUNT(absent); i++) {
        dr_request request = {0};
        request.op = (uint8_t)absent[i].op;
        uint8_t bytes[DR_FRAME_MAX] = {0xA5};
        TEST_ASSERT_EQUAL(0, dr_wire_put_request(absent[i].kind, absent[i].firmware, &request, bytes));
        TEST_ASSERT_EQUAL_HEX8(0xA5, bytes[0]);
    }
}

static void only_x_y_and_z_are_commands_of_one_axis(void)
{
    for (int op = DR_OP_NONE; op < DR_OPS; op++) {
        const uint8_t axis = op == DR_OP_TRIO_X   ? DR_X
                             : op == DR_OP_TRIO_Y ? DR_Y
                             : op == DR_OP_TRIO_Z ? DR_Z
                                                  : DR_AXES;
        TEST_ASSERT_EQUAL(axis, dr_wire_axis((dr_op)op));
    }
}

static void coordinates_travel_least_significant_byte_first(void)
{
    dr_command move;
    TEST_ASSERT_TRUE(dr_command_find(DR_MPC, 0x321, 'M', &move));
    for (unsigned bit = 0; bit < 32; bit++) {
        for (size_t axis = 0; axis < DR_AXES; axis++) {
            uint8_t bytes[13] = {'M'}, written[DR_FRAME_MAX];
            bytes[1 + 4 * axis + bit / 8] = (uint8_t)(1u << bit % 8);
            const dr_request request = dr_wire_get_request(&move, bytes);
            for (size_t i = 0; i < DR_AXES; i++) {
                TEST_ASSERT_EQUAL_HEX32(i == axis ? UINT32_C(1) << bit : 0, request.steps[i]);
            }
            TEST_ASSERT_EQUAL(13, dr_wire_put_request(DR_MPC, 0x321, &request, written));
            TEST_ASSERT_EQUAL_HEX8_ARRAY(bytes, written, 13);
        }
    }
}

/* -- The framer ---------------------------------------------------------------------------------------------------- */

static void check_invariant(const dr_framer *framer)
{
    TEST_ASSERT_TRUE((framer->have == 0 && framer->want == 0) ||
                     (0 < framer->have && framer->have < framer->want && framer->want <= DR_FRAME_MAX));
}

static void frames_are_cut_one_byte_at_a_time(void)
{
    for (size_t i = 0; i < COUNT(requests); i++) {
        const request_vector *vector = &requests[i];
        dr_framer framer;
        dr_framer_reset(&framer);
        check_invariant(&framer);
        for (int twice = 0; twice < 2; twice++) {
            for (size_t k = 0; k < vector->count; k++) {
                dr_command command;
                const dr_framed framed =
                    dr_framer_push(&framer, vector->kind, vector->firmware, vector->bytes[k], &command);
                check_invariant(&framer);
                if (k + 1 < vector->count) {
                    TEST_ASSERT_EQUAL(DR_FRAMED_PART, framed);
                    TEST_ASSERT_EQUAL(k + 1, framer.have);
                    TEST_ASSERT_EQUAL(vector->count, framer.want);
                    TEST_ASSERT_EQUAL_HEX8_ARRAY(vector->bytes, framer.bytes, k + 1);
                } else {
                    TEST_ASSERT_EQUAL(DR_FRAMED_WHOLE, framed);
                    TEST_ASSERT_EQUAL(vector->op, command.op);
                    TEST_ASSERT_EQUAL_HEX8_ARRAY(vector->bytes, framer.bytes, vector->count);
                }
            }
        }
    }
}

static void every_byte_value_is_data_inside_a_frame(void)
{
    static const dr_kind kinds[] = {DR_TRIO, DR_MPC};
    for (size_t kind = 0; kind < COUNT(kinds); kind++) {
        for (unsigned value = 0; value < 256; value++) {
            dr_framer framer;
            dr_command command;
            dr_framer_reset(&framer);
            TEST_ASSERT_EQUAL(DR_FRAMED_PART, dr_framer_push(&framer, kinds[kind], 0x321, 'S', &command));
            for (int k = 0; k < 12; k++) {
                TEST_ASSERT_EQUAL(DR_FRAMED_PART,
                                  dr_framer_push(&framer, kinds[kind], 0x321, (uint8_t)value, &command));
            }
            TEST_ASSERT_EQUAL(DR_FRAMED_WHOLE, dr_framer_push(&framer, kinds[kind], 0x321, (uint8_t)value, &command));
            const dr_request request = dr_wire_get_request(&command, framer.bytes);
            TEST_ASSERT_EQUAL(value, request.value);
            TEST_ASSERT_EQUAL_HEX32(value * UINT32_C(0x01010101), request.steps[DR_Z]);
        }
    }
}

static void fillers_and_unknown_bytes_do_not_start_a_frame(void)
{
    static const dr_kind kinds[] = {DR_TRIO, DR_MPC};
    static const uint16_t firmware[] = {0x100, 0x103, 0x106, 0x261, 0x299, 0x312, 0x321};
    for (size_t kind = 0; kind < COUNT(kinds); kind++) {
        for (size_t f = 0; f < COUNT(firmware); f++) {
            for (unsigned byte = 0; byte < 256; byte++) {
                dr_framer framer;
                dr_command known, command;
                dr_framer_reset(&framer);
                const dr_framed framed = dr_framer_push(&framer, kinds[kind], firmware[f], (uint8_t)byte, &command);
                check_invariant(&framer);
                if (byte == 0x0D || byte == 0x0A) {
                    TEST_ASSERT_EQUAL(DR_FRAMED_FILLER, framed);
                } else if (!dr_command_find(kinds[kind], firmware[f], (uint8_t)byte, &known)) {
                    TEST_ASSERT_EQUAL(DR_FRAMED_UNKNOWN, framed);
                } else {
                    TEST_ASSERT_EQUAL(known.args == 0 ? DR_FRAMED_WHOLE : DR_FRAMED_PART, framed);
                    continue;
                }
                TEST_ASSERT_EQUAL(0, framer.have);
                /* the next byte starts a new frame */
                TEST_ASSERT_EQUAL(DR_FRAMED_WHOLE, dr_framer_push(&framer, kinds[kind], firmware[f], 'C', &command));
                TEST_ASSERT_EQUAL('C', command.code);
            }
        }
    }
}

static void a_reset_forgets_half_a_frame(void)
{
    dr_framer framer;
    dr_command command;
    dr_framer_reset(&framer);
    (void)dr_framer_push(&framer, DR_MPC, 0x321, 'M', &command);
    (void)dr_framer_push(&framer, DR_MPC, 0x321, 1, &command);
    dr_framer_reset(&framer);
    TEST_ASSERT_EQUAL(0, framer.have);
    TEST_ASSERT_EQUAL(0, framer.want);
    TEST_ASSERT_EQUAL(DR_FRAMED_WHOLE, dr_framer_push(&framer, DR_MPC, 0x321, 'K', &command));
}

/* -- Replies: the Rx rows ------------------------------------------------------------------------------------------- */

typedef struct {
    dr_kind kind;
    uint16_t firmware;
    uint8_t code;
    dr_reply reply;
    uint8_t bytes[14];
    size_t count;
} reply_vector;

static const reply_vector replies[] = {
    /* 'c': X, Y, Z, angle, CR */
    {DR_TRIO, 0x312, 'c', {30, 0, 0, {1000, 266667, 16909060}}, {XYZ, 30, 0x0D}, 14},
    {DR_TRIO, 0x312, 'C', {13, 0, 0, {0x0D0D0D0D, 3, 0}}, {13, 13, 13, 13, 3, 0, 0, 0, 0, 0, 0, 0, 13, 13}, 14},
    {DR_TRIO, 0x312, 'h', {0, 0, 0, {0}}, {0x0D}, 1},
    {DR_TRIO, 0x312, 'A', {0, 0, 0, {0}}, {0x0D}, 1},
    {DR_TRIO, 0x312, 0x03, {0, 0, 0, {0}}, {0x0D}, 1},
    /* 'A' below 3.00: count, CR */
    {DR_MPC, 0x200, 'A', {4, 0, 0, {0}}, {0x04, 0x0D}, 2},
    /* 'U': count, four flags, CR */
    {DR_MPC, 0x321, 'U', {1, 0x1, 0, {0}}, {1, 1, 0, 0, 0, 0x0D}, 6},
    {DR_MPC, 0x321, 'U', {2, 0xA, 0, {0}}, {2, 0, 1, 0, 1, 0x0D}, 6},
    {DR_MPC, 0x321, 'U', {4, 0xF, 0, {0}}, {4, 1, 1, 1, 1, 0x0D}, 6},
    /* 'K': drive, CR; from 3.00 drive, minor, major, CR [M note 15: 3.15 is 0x15 0x03] */
    {DR_MPC, 0x299, 'K', {2, 0, 0, {0}}, {0x02, 0x0D}, 2},
    {DR_MPC, 0x315, 'K', {3, 0, 0x315, {0}}, {0x03, 0x15, 0x03, 0x0D}, 4},
    {DR_MPC, 0x321, 'K', {1, 0, 0x321, {0}}, {0x01, 0x21, 0x03, 0x0D}, 4},
    /* 'C': drive, X, Y, Z, CR */
    {DR_MPC, 0x321, 'C', {4, 0, 0, {1000, 266667, 16909060}}, {4, XYZ, 0x0D}, 14},
    /* 'I': CR to 1.05; drive or 'E', CR from 1.06 */
    {DR_MPC, 0x105, 'I', {0, 0, 0, {0}}, {0x0D}, 1},
    {DR_MPC, 0x106, 'I', {3, 0, 0, {0}}, {0x03, 0x0D}, 2},
    {DR_MPC, 0x321, 'I', {'E', 0, 0, {0}}, {'E', 0x0D}, 2},
    {DR_MPC, 0x321, 'S', {0, 0, 0, {0}}, {0x0D}, 1},
    {DR_MPC, 0x321, 'L', {0, 0, 0, {0}}, {0x0D}, 1},
};

static dr_command command_of(const reply_vector *vector)
{
    dr_command command;
    TEST_ASSERT_TRUE(dr_command_find(vector->kind, vector->firmware, vector->code, &command));
    return command;
}

static void replies_are_the_bytes_of_the_manuals(void)
{
    for (size_t i = 0; i < COUNT(replies); i++) {
        const reply_vector *vector = &replies[i];
        const dr_command command = command_of(vector);
        uint8_t bytes[DR_REPLY_MAX + 1];
        memset(bytes, 0xA5, sizeof bytes);
        TEST_ASSERT_EQUAL(vector->count, dr_wire_put_reply(&command, &vector->reply, bytes));
        TEST_ASSERT_EQUAL_HEX8_ARRAY(vector->bytes, bytes, vector->count);
        TEST_ASSERT_EQUAL_HEX8(0xA5, bytes[vector->count]);

        dr_reply back;
        TEST_ASSERT_TRUE(dr_wire_get_reply(&command, vector->bytes, vector->count, &back));
        TEST_ASSERT_EQUAL(vector->reply.value, back.value);
        TEST_ASSERT_EQUAL_HEX8(vector->reply.connected, back.connected);
        TEST_ASSERT_EQUAL_HEX16(vector->reply.firmware, back.firmware);
        if (vector->code == 'c' || vector->code == 'C') {
            TEST_ASSERT_EQUAL_UINT32_ARRAY(vector->reply.steps, back.steps, 3);
        }
    }
}

static void every_command_has_a_reply_of_the_length_of_its_row(void)
{
    static const uint16_t firmware[] = {0x100, 0x103, 0x105, 0x106, 0x299, 0x300, 0x321};
    for (size_t f = 0; f < COUNT(firmware); f++) {
        for (int kind = 0; kind < 2; kind++) {
            for (int code = 0; code < 256; code++) {
                dr_command command;
                if (dr_command_find((dr_kind)kind, firmware[f], (uint8_t)code, &command)) {
                    const dr_reply reply = {1, 0x1, firmware[f], {1, 2, 3}};
                    uint8_t bytes[DR_REPLY_MAX];
                    const size_t count = dr_wire_put_reply(&command, &reply, bytes);
                    TEST_ASSERT_EQUAL(command.reply, count);
                    TEST_ASSERT_EQUAL_HEX8(0x0D, bytes[count - 1]);
                    dr_reply back;
                    TEST_ASSERT_TRUE(dr_wire_get_reply(&command, bytes, count, &back));
                }
            }
        }
    }
}

static void a_reply_of_another_length_or_without_cr_is_refused(void)
{
    for (size_t i = 0; i < COUNT(replies); i++) {
        const reply_vector *vector = &replies[i];
        const dr_command command = command_of(vector);
        uint8_t bytes[DR_REPLY_MAX + 1] = {0};
        memcpy(bytes, vector->bytes, vector->count);
        dr_reply back;
        for (size_t count = 0; count <= DR_REPLY_MAX + 1; count++) {
            TEST_ASSERT_EQUAL(count == vector->count, dr_wire_get_reply(&command, bytes, count, &back));
        }
        bytes[vector->count - 1] = 0x0A;
        TEST_ASSERT_FALSE(dr_wire_get_reply(&command, bytes, vector->count, &back));
    }
}

static void a_reply_that_no_controller_sends_is_refused(void)
{
    static const reply_vector absurd[] = {
        {DR_TRIO, 0x312, 'c', {0}, {XYZ, 91, 0x0D}, 14}, /* an angle above 90 */
        {DR_TRIO, 0x312, 'c', {0}, {XYZ, 255, 0x0D}, 14},
        {DR_MPC, 0x200, 'A', {0}, {0, 0x0D}, 2}, /* none connected: nothing is answered */
        {DR_MPC, 0x200, 'A', {0}, {5, 0x0D}, 2},
        {DR_MPC, 0x321, 'U', {0}, {0, 0, 0, 0, 0, 0x0D}, 6},
        {DR_MPC, 0x321, 'U', {0}, {5, 1, 1, 1, 1, 0x0D}, 6},
        {DR_MPC, 0x321, 'U', {0}, {1, 2, 0, 0, 0, 0x0D}, 6}, /* a flag is 0 or 1 */
        {DR_MPC, 0x321, 'U', {0}, {1, 1, 0, 0, 9, 0x0D}, 6},
        {DR_MPC, 0x321, 'U', {0}, {2, 1, 0, 0, 0, 0x0D}, 6}, /* the count is that of the flags */
        {DR_MPC, 0x299, 'K', {0}, {0, 0x0D}, 2},             /* drives are 1 to 4 */
        {DR_MPC, 0x299, 'K', {0}, {5, 0x0D}, 2},
        {DR_MPC, 0x321, 'K', {0}, {0, 0x21, 0x03, 0x0D}, 4},
        {DR_MPC, 0x321, 'K', {0}, {'1', 0x21, 0x03, 0x0D}, 4},
        {DR_MPC, 0x321, 'K', {0}, {1, 0x2A, 0x03, 0x0D}, 4}, /* not decimal */
        {DR_MPC, 0x321, 'K', {0}, {1, 0xA2, 0x03, 0x0D}, 4},
        {DR_MPC, 0x321, 'K', {0}, {1, 0x21, 0x0F, 0x0D}, 4},
        {DR_MPC, 0x321, 'K', {0}, {1, 0x21, 0xF0, 0x0D}, 4},
        {DR_MPC, 0x321, 'C', {0}, {0, XYZ, 0x0D}, 14},
        {DR_MPC, 0x321, 'C', {0}, {5, XYZ, 0x0D}, 14},
        {DR_MPC, 0x321, 'I', {0}, {0, 0x0D}, 2},
        {DR_MPC, 0x321, 'I', {0}, {5, 0x0D}, 2},
        {DR_MPC, 0x321, 'I', {0}, {'1', 0x0D}, 2},
    };
    for (size_t i = 0; i < COUNT(absurd); i++) {
        const dr_command command = command_of(&absurd[i]);
        dr_reply back;
        TEST_ASSERT_EQUAL(command.reply, absurd[i].count);
        char which[32];
        (void)snprintf(which, sizeof which, "row %u of absurd[]", (unsigned)i);
        TEST_ASSERT_FALSE_MESSAGE(dr_wire_get_reply(&command, absurd[i].bytes, absurd[i].count, &back), which);
    }
}

/* -- Streamed positions [M note 16] --------------------------------------------------------------------------------- */

static void streamed_frames_are_ff_ff_ff_and_three_times_24_bits(void)
{
    static const uint32_t steps[3] = {1000, 266667, 0x102030};
    static const uint8_t frame[12] = {0xFF, 0xFF, 0xFF, 0xE8, 0x03, 0x00, 0xAB, 0x11, 0x04, 0x30, 0x20, 0x10};
    uint8_t bytes[13] = {0};
    bytes[12] = 0xA5;
    uint32_t back[3];
    dr_wire_put_stream(steps, bytes);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(frame, bytes, 12);
    TEST_ASSERT_EQUAL_HEX8(0xA5, bytes[12]);
    TEST_ASSERT_TRUE(dr_wire_get_stream(frame, back));
    TEST_ASSERT_EQUAL_UINT32_ARRAY(steps, back, 3);
    for (unsigned bit = 0; bit < 24; bit++) {
        const uint32_t one[3] = {UINT32_C(1) << bit, UINT32_C(0xFFFFFF) ^ (UINT32_C(1) << bit), bit};
        dr_wire_put_stream(one, bytes);
        TEST_ASSERT_TRUE(dr_wire_get_stream(bytes, back));
        TEST_ASSERT_EQUAL_UINT32_ARRAY(one, back, 3);
    }
    for (int k = 0; k < 3; k++) {
        memcpy(bytes, frame, 12);
        bytes[k] = 0xFE;
        TEST_ASSERT_FALSE(dr_wire_get_stream(bytes, back));
    }
}

/* -- There and back with any values ---------------------------------------------------------------------------------- */

static uint32_t next_random(uint64_t *state)
{
    *state = *state * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return (uint32_t)(*state >> 32);
}

static void anything_encoded_is_decoded_again(void)
{
    uint64_t seed = 1;
    static const uint16_t firmware[] = {0x103, 0x106, 0x262, 0x299, 0x321};
    for (int round = 0; round < 20000; round++) {
        const dr_kind kind = next_random(&seed) % 2 ? DR_MPC : DR_TRIO;
        const uint16_t version = firmware[next_random(&seed) % COUNT(firmware)];
        dr_request request = {0};
        request.op = (uint8_t)(next_random(&seed) % DR_OPS);
        dr_command row;
        if (!dr_command_for(kind, version, (dr_op)request.op, &row)) {
            continue;
        }
        request.value = row.args == DR_ARGS_BYTE || row.args == DR_ARGS_LINE ? (uint8_t)next_random(&seed) : 0;
        for (uint8_t axis = 0; axis < DR_AXES; axis++) {
            const uint32_t steps = next_random(&seed);
            request.steps[axis] = row.args >= DR_ARGS_POINT || dr_wire_axis((dr_op)request.op) == axis ? steps : 0;
        }
        uint8_t bytes[DR_FRAME_MAX];
        const size_t count = dr_wire_put_request(kind, version, &request, bytes);
        TEST_ASSERT_EQUAL(row.args + 1, count);
        dr_framer framer;
        dr_command command;
        dr_framer_reset(&framer);
        for (size_t k = 0; k < count; k++) {
            TEST_ASSERT_EQUAL(k + 1 < count ? DR_FRAMED_PART : DR_FRAMED_WHOLE,
                              dr_framer_push(&framer, kind, version, bytes[k], &command));
        }
        const dr_request back = dr_wire_get_request(&command, framer.bytes);
        check_request(&request, &back);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(requests_are_the_bytes_of_the_manuals);
    RUN_TEST(upper_case_letters_of_the_trio_mean_the_same);
    RUN_TEST(a_request_that_the_firmware_lacks_is_not_written);
    RUN_TEST(only_x_y_and_z_are_commands_of_one_axis);
    RUN_TEST(coordinates_travel_least_significant_byte_first);
    RUN_TEST(frames_are_cut_one_byte_at_a_time);
    RUN_TEST(every_byte_value_is_data_inside_a_frame);
    RUN_TEST(fillers_and_unknown_bytes_do_not_start_a_frame);
    RUN_TEST(a_reset_forgets_half_a_frame);
    RUN_TEST(replies_are_the_bytes_of_the_manuals);
    RUN_TEST(every_command_has_a_reply_of_the_length_of_its_row);
    RUN_TEST(a_reply_of_another_length_or_without_cr_is_refused);
    RUN_TEST(a_reply_that_no_controller_sends_is_refused);
    RUN_TEST(streamed_frames_are_ff_ff_ff_and_three_times_24_bits);
    RUN_TEST(anything_encoded_is_decoded_again);
    return UNITY_END();
}
