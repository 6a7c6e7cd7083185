/* Proves: a request that is written and read again is the same request, for every operation, value and target, and no frame
 * is longer than DR_FRAME_MAX; the same for replies that are written, read and written again, and for streamed positions of
 * 24 bits. */
#include "dr_wire.h"
#include "proof.h"

static void requests(dr_kind kind, uint16_t firmware)
{
    dr_request request = {anything_8(), anything_8(), {anything_32(), anything_32(), anything_32()}};
    dr_command command;
    uint8_t bytes[DR_FRAME_MAX];
    assume(request.op < DR_OPS && dr_command_for(kind, firmware, (dr_op)request.op, &command));

    const size_t count = dr_wire_put_request(kind, firmware, &request, bytes);
    assert(count == 1u + command.args && count <= DR_FRAME_MAX);
    const dr_request read = dr_wire_get_request(&command, bytes);

    const bool has_value = command.args == DR_ARGS_BYTE || command.args == DR_ARGS_LINE;
    assert(read.op == request.op && read.value == (has_value ? request.value : 0));
    const uint8_t axis = dr_wire_axis((dr_op)request.op);
    for (uint8_t i = 0; i < DR_AXES; i++) {
        const bool has_axis = command.args == DR_ARGS_POINT || command.args == DR_ARGS_LINE || i == axis;
        assert(read.steps[i] == (has_axis ? request.steps[i] : 0));
    }
}

static void replies(dr_kind kind, uint16_t firmware)
{
    dr_command command;
    uint8_t bytes[DR_REPLY_MAX], again[DR_REPLY_MAX];
    dr_reply reply;
    assume(dr_command_row(kind, anything_8(), &command));
    assume(command.since <= firmware && firmware <= command.until);
    for (uint8_t i = 0; i < DR_REPLY_MAX; i++)
        bytes[i] = anything_8();
    if (command.reply == 0 || !dr_wire_get_reply(&command, bytes, command.reply, &reply))
        return;
    assert(dr_wire_put_reply(&command, &reply, again) == command.reply);
    for (uint8_t i = 0; i < command.reply; i++)
        assert(again[i] == bytes[i]);
}

static void streams(void)
{
    const uint32_t steps[DR_AXES] = {anything_32() & 0xFFFFFFu, anything_32() & 0xFFFFFFu, anything_32() & 0xFFFFFFu};
    uint32_t read[DR_AXES];
    uint8_t bytes[DR_STREAM_FRAME];
    dr_wire_put_stream(steps, bytes);
    assert(dr_wire_get_stream(bytes, read));
    for (uint8_t i = 0; i < DR_AXES; i++)
        assert(read[i] == steps[i]);
}

int main(void)
{
    const dr_kind kind = (anything_8() & 1u) != 0 ? DR_MPC : DR_TRIO;
    const uint16_t firmware = anything_16();
    requests(kind, firmware);
    replies(kind, firmware);
    streams();
    proved();
    return 0;
}
