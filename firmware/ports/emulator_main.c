#include "emulator.h"

#include "keep.h"
#include "port.h"

/* What the image is; the build says it (CMakeLists.txt). */
#ifndef EMULATOR_KIND
#define EMULATOR_KIND DR_TRIO
#endif
#ifndef EMULATOR_TRIO_STAGES
#define EMULATOR_TRIO_STAGES DR_STAGE_TRIO_MP845
#endif
#ifndef EMULATOR_MPC_STAGES
#define EMULATOR_MPC_STAGES DR_STAGE_MPC_MP225, DR_STAGE_MPC_MP225
#endif

/* By the two straps for stages: none closed (as built), first, second, both. */
static const uint8_t trio_stages[4][DR_PORTS] = {{EMULATOR_TRIO_STAGES},
                                                 {DR_STAGE_TRIO_MP865},
                                                 {DR_STAGE_TRIO_MP285},
                                                 {DR_STAGE_TRIO_MP265}};
static const uint8_t mpc_stages[4][DR_PORTS] = {
    {EMULATOR_MPC_STAGES},
    {DR_STAGE_MPC_MP285, DR_STAGE_MPC_MP285},
    {DR_STAGE_MPC_MP845, DR_STAGE_MPC_MP845},
    {DR_STAGE_MPC_MP225, DR_STAGE_MPC_MP225, DR_STAGE_MPC_MP225, DR_STAGE_MPC_MP225}};

static dr_controller controller;
static dr_drive drives[DR_PORTS];
static dr_keep keep;
static dr_us heard; /* when the host's last byte was taken */

const dr_controller *dr_emulator_controller(void) { return &controller; }

/* -- The line's pace, where it has none of its own ----------------------------------------------------------------- */

#define LAG_US 3000u /* a loop that comes late makes up for no more than this */
static uint32_t byte_ns;
static dr_us line_at;       /* when the byte that is on the line began */
static uint16_t line_at_ns; /* and so much later */

/* How many bytes the line could have carried since line_at. */
static size_t carried(dr_us now)
{
    if (now - line_at > LAG_US)
        line_at = now - LAG_US;
    const uint32_t elapsed_ns = (now - line_at) * 1000u;
    return elapsed_ns < line_at_ns ? 0 : (size_t)((elapsed_ns - line_at_ns) / byte_ns);
}

static dr_us after_bytes(size_t count) { return line_at + (line_at_ns + (uint32_t)count * byte_ns) / 1000u; }

static void carry(size_t count)
{
    const uint32_t ns = line_at_ns + (uint32_t)count * byte_ns;
    line_at += ns / 1000u;
    line_at_ns = (uint16_t)(ns % 1000u);
}

/* -- The loop ------------------------------------------------------------------------------------------------------ */

static void hear(dr_us now)
{
    uint8_t bytes[DR_FRAME_MAX];
    const size_t count = dr_port_read(bytes, sizeof bytes);
    if (now - heard > DR_US_PER_S)
        heard = now - DR_US_PER_S; /* a pause is long enough by then, and the clock wraps */
    if (count == 0)
        return;
    dr_controller_paused(&controller, now - heard);
    dr_controller_push(&controller, now, bytes, count);
    heard = now;
    dr_keep_touch(&keep, now);
}

/* True: there are bytes left, and the line may carry the next one at *when. */
static bool tell(dr_us now, dr_us *when)
{
    uint8_t bytes[DR_REPLY_MAX];
    size_t room = dr_port_room();
    if (room > sizeof bytes)
        room = sizeof bytes;
    if (!dr_port_has_pace()) {
        const size_t can = carried(now);
        room = can < room ? can : room;
    }
    const size_t count = dr_controller_pull(&controller, now, bytes, room);
    dr_port_write(bytes, count);
    if (!dr_port_has_pace())
        carry(count);
    *when = dr_port_has_pace() ? now : after_bytes(1) + 1u;
    return dr_controller_ready(&controller) > 0;
}

static void sooner(bool also, dr_us other, bool *has_end, dr_us *until)
{
    if (also && (!*has_end || dr_us_before(other, *until)))
        *until = other;
    *has_end = *has_end || also;
}

void dr_emulator_step_at(dr_us now, dr_us longest_us)
{
    dr_us until = now, other;
    if (dr_controller_ready(&controller) == 0) {
        line_at = now;
        line_at_ns = 0;
    }
    hear(now);
    bool has_end = tell(now, &until);
    const bool keeps = dr_keep_step(&keep, &controller, now, &other);
    if (!dr_port_waits())
        return;
    sooner(keeps, other, &has_end, &until);
    const bool moves = dr_controller_due(&controller, &other);
    sooner(moves, other, &has_end, &until);
    sooner(longest_us > 0, now + longest_us, &has_end, &until);
    dr_port_wait(has_end, until);
}

void dr_emulator_step(void) { dr_emulator_step_at(dr_port_now_us(), 0); }

void dr_emulator_touch(dr_us now) { dr_keep_touch(&keep, now); }

dr_controller *dr_emulator_prepare(void)
{
    const uint8_t straps = dr_port_begin();
    const dr_kind built_for = EMULATOR_KIND;
    const bool is_trio = (built_for == DR_TRIO) != ((straps & DR_STRAP_OTHER) != 0);
    const uint8_t set = (uint8_t)((straps & DR_STRAP_STAGES) >> DR_STRAP_STAGES_SHIFT);
    const uint8_t *stages = is_trio ? trio_stages[set] : mpc_stages[set];
    const uint32_t baud = is_trio ? DR_BAUD_TRIO : DR_BAUD_MPC;

    for (uint8_t i = 0; i < DR_PORTS; i++)
        dr_drive_init(&drives[i], (dr_stage_id)stages[i]);
    dr_controller_init(&controller, is_trio ? DR_TRIO : DR_MPC, drives, is_trio ? 1 : DR_PORTS);
    controller.calibrates_at_power_on = (straps & DR_STRAP_KEEP) == 0;
    (void)dr_keep_load(&keep, &controller);
    byte_ns = UINT32_C(1000000000) / (baud / DR_BITS_PER_BYTE);
    dr_port_open(baud);
    heard = dr_port_now_us();
    dr_keep_touch(&keep, heard);
    return &controller;
}

void dr_emulator_begin(void)
{
    const dr_hand power_on = {.what = DR_HAND_POWER_ON};
    dr_controller *const c = dr_emulator_prepare();
    (void)dr_controller_poke(c, heard, &power_on);
}
