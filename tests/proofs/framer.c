/* Proves: dr_framer_push() keeps its invariant and its promises for input of any bytes and any length, on both controllers
 * and every firmware version. By induction: a reset framer is valid (base); a valid framer takes any byte and is valid again
 * (step). The model checker adds: no access out of bounds, no overflow, no bad shift. */
#include "dr_wire.h"
#include "proof.h"

/* The invariant of dr_wire.h, and what it leaves to the code: a frame that has begun is that of a known command. */
static bool valid(const dr_framer *framer, dr_kind kind, uint16_t firmware)
{
    dr_command command;
    if (framer->have == 0)
        return framer->want == 0;
    return framer->have < framer->want && framer->want <= DR_FRAME_MAX &&
           dr_command_find(kind, firmware, framer->bytes[0], &command) && framer->want == 1u + command.args;
}

int main(void)
{
    const dr_kind kind = (anything_8() & 1u) != 0 ? DR_MPC : DR_TRIO;
    const uint16_t firmware = anything_16();
    dr_framer framer;
    for (uint8_t i = 0; i < DR_FRAME_MAX; i++)
        framer.bytes[i] = anything_8();

    dr_framer_reset(&framer);
    assert(valid(&framer, kind, firmware));

    framer.have = anything_8();
    framer.want = anything_8();
    assume(valid(&framer, kind, firmware));
    const dr_framer before = framer;
    const uint8_t byte = anything_8();
    dr_command command;

    const dr_framed framed = dr_framer_push(&framer, kind, firmware, byte, &command);

    assert(valid(&framer, kind, firmware));
    if (before.have > 0) /* within a frame every byte is data, a ^C and a CR too */
        assert(framed == DR_FRAMED_PART || framed == DR_FRAMED_WHOLE);
    if (framed == DR_FRAMED_WHOLE) {
        assert(framer.have == 0 && before.have == command.args);
        assert(framer.bytes[0] == command.code && framer.bytes[command.args] == byte);
    } else if (framed == DR_FRAMED_PART) {
        assert(framer.have == before.have + 1u && framer.bytes[before.have] == byte);
    } else {
        assert(framer.have == 0);
    }
    proved();
    return 0;
}
