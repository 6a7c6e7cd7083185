/* The codec under libFuzzer: what is cut from any bytes is a known command; what is read back is what was written. */
#include "dr_wire.h"

#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void must(bool condition)
{
    if (!condition) {
        abort();
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size < 3) {
        return 0;
    }
    const dr_kind kind = data[0] & 1 ? DR_TRIO : DR_MPC;
    const uint16_t firmware = (uint16_t)(data[1] << 8 | data[2]);
    dr_framer framer;
    dr_command command;
    dr_framer_reset(&framer);
    for (size_t k = 3; k < size; k++) {
        const uint8_t had = framer.have;
        const dr_framed framed = dr_framer_push(&framer, kind, firmware, data[k], &command);
        must((framer.have == 0 && framer.want == 0) ||
             (0 < framer.have && framer.have < framer.want && framer.want <= DR_FRAME_MAX) ||
             framed == DR_FRAMED_WHOLE);
        must(had == 0 || framed == DR_FRAMED_PART || framed == DR_FRAMED_WHOLE);
        if (framed == DR_FRAMED_WHOLE) {
            uint8_t again[DR_FRAME_MAX];
            const dr_request request = dr_wire_get_request(&command, framer.bytes);
            const size_t count = dr_wire_put_request(kind, firmware, &request, again);
            must(count == 1u + command.args);
            must(memcmp(again + 1, framer.bytes + 1, command.args) == 0);
            /* the same bytes as a reply: refused, or written again alike */
            dr_reply reply;
            for (size_t n = 0; n <= DR_REPLY_MAX && k + n < size; n++) {
                if (dr_wire_get_reply(&command, data + k, n, &reply)) {
                    must(n == command.reply);
                    must(dr_wire_put_reply(&command, &reply, again) == n);
                    must(memcmp(again, data + k, n) == 0);
                }
            }
        }
    }
    uint32_t steps[DR_AXES];
    uint8_t frame[DR_STREAM_FRAME];
    if (size >= DR_STREAM_FRAME && dr_wire_get_stream(data, steps)) {
        dr_wire_put_stream(steps, frame);
        must(memcmp(frame, data, DR_STREAM_FRAME) == 0);
    }
    return 0;
}
