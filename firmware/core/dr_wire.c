#include "dr_wire.h"

/* -- Coordinates: least significant byte first --------------------------------------------------------------------- */

static void put_uint(uint8_t *bytes, uint32_t value, uint8_t count)
{
    for (uint8_t i = 0; i < count; i++)
        bytes[i] = (uint8_t)(value >> (8u * i));
}

static uint32_t get_uint(const uint8_t *bytes, uint8_t count)
{
    uint32_t value = 0;
    for (uint8_t i = 0; i < count; i++)
        value |= (uint32_t)bytes[i] << (8u * i);
    return value;
}

static void put_point(uint8_t *bytes, const uint32_t steps[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        put_uint(bytes + 4u * axis, steps[axis], 4);
}

static void get_point(const uint8_t *bytes, uint32_t steps[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        steps[axis] = get_uint(bytes + 4u * axis, 4);
}

/* -- Requests ------------------------------------------------------------------------------------------------------ */

uint8_t dr_wire_axis(dr_op op)
{
    return op >= DR_OP_TRIO_X && op <= DR_OP_TRIO_Z ? (uint8_t)(op - DR_OP_TRIO_X) : (uint8_t)DR_AXES;
}

size_t dr_wire_put_request(dr_kind kind, uint16_t firmware, const dr_request *request, uint8_t *bytes)
{
    dr_command command;
    if (!dr_command_for(kind, firmware, (dr_op)request->op, &command))
        return 0;
    bytes[0] = command.code;
    if (command.args == DR_ARGS_BYTE || command.args == DR_ARGS_LINE)
        bytes[1] = request->value;
    if (command.args == DR_ARGS_AXIS)
        put_uint(bytes + 1, request->steps[dr_wire_axis((dr_op)command.op)], 4);
    if (command.args == DR_ARGS_POINT || command.args == DR_ARGS_LINE)
        put_point(bytes + 1 + command.args - DR_ARGS_POINT, request->steps);
    return 1u + command.args;
}

dr_request dr_wire_get_request(const dr_command *command, const uint8_t *bytes)
{
    dr_request request = {command->op, 0, {0, 0, 0}};
    if (command->args == DR_ARGS_BYTE || command->args == DR_ARGS_LINE)
        request.value = bytes[1];
    if (command->args == DR_ARGS_AXIS)
        request.steps[dr_wire_axis((dr_op)command->op)] = get_uint(bytes + 1, 4);
    if (command->args == DR_ARGS_POINT || command->args == DR_ARGS_LINE)
        get_point(bytes + 1 + command->args - DR_ARGS_POINT, request.steps);
    return request;
}

void dr_framer_reset(dr_framer *framer) { framer->have = framer->want = 0; }

dr_framed dr_framer_push(dr_framer *framer, dr_kind kind, uint16_t firmware, uint8_t byte, dr_command *command)
{
    if (framer->have == 0) {
        if (byte == DR_CR || byte == DR_LF)
            return DR_FRAMED_FILLER;
        if (!dr_command_find(kind, firmware, byte, command))
            return DR_FRAMED_UNKNOWN;
        framer->want = (uint8_t)(1u + command->args);
    }
    framer->bytes[framer->have++] = byte;
    if (framer->have < framer->want)
        return DR_FRAMED_PART;
    dr_framer_reset(framer);
    (void)dr_command_find(kind, firmware, framer->bytes[0], command); /* it was found when the frame began */
    return DR_FRAMED_WHOLE;
}

/* -- Replies ------------------------------------------------------------------------------------------------------- */

size_t dr_wire_put_reply(const dr_command *command, const dr_reply *reply, uint8_t *bytes)
{
    const uint8_t last = (uint8_t)(command->reply - 1u);
    switch (command->op) {
    case DR_OP_TRIO_POSITION:
        put_point(bytes, reply->steps);
        bytes[12] = reply->value;
        break;
    case DR_OP_MPC_POSITION:
        bytes[0] = reply->value;
        put_point(bytes + 1, reply->steps);
        break;
    case DR_OP_MPC_DRIVES:
        bytes[0] = reply->value;
        for (uint8_t port = 0; port < DR_PORTS; port++)
            bytes[1u + port] = (uint8_t)((reply->connected >> port) & 1);
        break;
    case DR_OP_MPC_ACTIVE: /* minor version first [M note 15]; below 3.00 the drive alone */
        bytes[0] = reply->value;
        if (last > 1)
            put_uint(bytes + 1, reply->firmware, 2);
        break;
    case DR_OP_MPC_COUNT:
    case DR_OP_MPC_SELECT: /* up to 1.05 the CR alone */
        bytes[0] = reply->value;
        break;
    default:
        break;
    }
    bytes[last] = DR_CR;
    return command->reply;
}

static bool is_drive(uint8_t value) { return value >= 1u && value <= DR_PORTS; }

static bool is_bcd(uint16_t value)
{
    for (uint8_t digit = 0; digit < 4; digit++)
        if ((((unsigned)value >> (4u * digit)) & 0xFu) > 9u)
            return false;
    return true;
}

bool dr_wire_get_reply(const dr_command *command, const uint8_t *bytes, size_t count, dr_reply *out)
{
    *out = (dr_reply){0, 0, 0, {0, 0, 0}};
    if (count != command->reply || bytes[count - 1u] != DR_CR)
        return false;
    switch (command->op) {
    case DR_OP_TRIO_POSITION:
        get_point(bytes, out->steps);
        out->value = bytes[12];
        return out->value <= DR_ANGLE_MAX_DEG;
    case DR_OP_MPC_POSITION:
        out->value = bytes[0];
        get_point(bytes + 1, out->steps);
        return is_drive(out->value);
    case DR_OP_MPC_DRIVES: {
        uint8_t connected = 0;
        out->value = bytes[0];
        for (uint8_t port = 0; port < DR_PORTS; port++) {
            if (bytes[1u + port] > 1u)
                return false;
            out->connected = (uint8_t)(out->connected | bytes[1u + port] << port);
            connected = (uint8_t)(connected + bytes[1u + port]);
        }
        return is_drive(out->value) && connected == out->value;
    }
    case DR_OP_MPC_ACTIVE:
        out->value = bytes[0];
        if (count > 2u)
            out->firmware = (uint16_t)get_uint(bytes + 1, 2);
        return is_drive(out->value) && is_bcd(out->firmware);
    case DR_OP_MPC_COUNT:
        out->value = bytes[0];
        return is_drive(out->value);
    case DR_OP_MPC_SELECT:
        if (count > 1u)
            out->value = bytes[0];
        return count == 1u || is_drive(out->value) || out->value == DR_NO_SUCH_DRIVE;
    default:
        return true;
    }
}

/* -- Streamed positions: 24 bits an axis behind a signature ---------------------------------------------------------- */

void dr_wire_put_stream(const uint32_t steps[DR_AXES], uint8_t *bytes)
{
    put_uint(bytes, UINT32_C(0xFFFFFF), 3);
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        put_uint(bytes + 3u + 3u * axis, steps[axis], 3);
}

bool dr_wire_get_stream(const uint8_t *bytes, uint32_t steps[DR_AXES])
{
    for (uint8_t axis = 0; axis < DR_AXES; axis++)
        steps[axis] = get_uint(bytes + 3u + 3u * axis, 3);
    return get_uint(bytes, 3) == UINT32_C(0xFFFFFF);
}
