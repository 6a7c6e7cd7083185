#include "bridge_port.h"

#include "contacts.h"

#include "dr_guard.h"

#include <string.h>

/* How many records of the log may wait for their line. */
#ifndef BRIDGE_RECORDS
#define BRIDGE_RECORDS 32u
#endif

#define STOPS (1u << DR_INPUT_STOP | 1u << DR_INPUT_STOP_2)
#define PRESSES (1u << DR_INPUT_ARM | 1u << DR_INPUT_TIP_CHANGED | 1u << DR_INPUT_CONFIRM)
enum { BUZZER = 1u << 0, LAMP = 1u << 1, RELAY = 1u << 2 };

#define ALIVE UINT32_C(0xA1E57A11) /* no pattern that memory has by itself */
#define LONGEST_ROUND_US 100000u   /* a clock that goes farther has jumped */
#define SHOW_US 20000u             /* faster than an eye */
#define PIECE 8u                   /* bytes of the limits that one round looks at */
#define LOG_BAUD UINT32_C(115200)
#define LOG_LINE (1u + 2u * DR_RECORD_BYTES + 1u)

static struct {
    dr_guard guard;
    dr_limits limits;
    bool has_limits; /* they were whole when they were read */
    dr_record records[BRIDGE_RECORDS];

    dr_contacts contacts;
    dr_us looked;
    uint16_t told;  /* the guard, of the inputs that are on */
    bool confirmed; /* since the start */
    bool host_is_open;

    dr_us looked_at_guard;
    bool may_move;  /* more than a query has begun to leave, and no end was seen */
    uint8_t query;  /* for the position */
    uint8_t steady; /* outputs */
    bool has_power, wave;

    uint8_t log_line[LOG_LINE];
    uint8_t log_left;

    uint32_t limits_sum, sum; /* as they were read; of the pieces so far */
    size_t summed;
    bool damaged; /* that, or the clock: a reset is due */
    dr_us round;
} b;
static volatile dr_survivor *survivor;

/* -- To the controller --------------------------------------------------------------------------------------------- */

/* Byte by byte: a reset may come between any two, and half a frame must be known of afterwards. Without limits nobody knows
 * the controller's rate, and nothing is sent. */
static void send_device(dr_us now)
{
    uint8_t byte;
    if (!b.has_limits)
        return;
    while (dr_port_line_room(DR_LINE_DEVICE) > 0 && dr_guard_pull_device(&b.guard, now, &byte, 1) == 1) {
        if (dr_guard_is_mid_frame(&b.guard))
            survivor->mid_frame = true;
        b.may_move = b.may_move || byte != b.query;
        dr_port_line_write(DR_LINE_DEVICE, &byte, 1);
    }
    if (dr_guard_is_mid_frame(&b.guard)) /* a cable was pulled within it, or nobody has confirmed yet */
        survivor->mid_frame = true;
    else if (survivor->mid_frame && dr_port_line_is_sent(DR_LINE_DEVICE))
        survivor->mid_frame = false;
}

/* -- From the host and the controller ------------------------------------------------------------------------------ */

/* False: it said nothing. */
static bool hear_host(dr_us now)
{
    uint8_t bytes[DR_FRAME_MAX];
    bool lost = false;
    const size_t count = dr_port_line_read(DR_LINE_HOST, bytes, sizeof bytes, &lost);
    if (lost)
        dr_guard_host_line_error(&b.guard, now);
    if (count > 0)
        dr_guard_push_host(&b.guard, now, bytes, count);
    return count > 0;
}

/* False: it said nothing. A reply that lacks a byte is none: the guard asks again. */
static bool hear_device(dr_us now)
{
    uint8_t bytes[DR_REPLY_MAX];
    bool lost = false;
    const size_t count = dr_port_line_read(DR_LINE_DEVICE, bytes, sizeof bytes, &lost);
    if (count > 0)
        dr_guard_push_device(&b.guard, now, bytes, count);
    return count > 0;
}

static void answer_host(dr_us now)
{
    uint8_t bytes[DR_REPLY_MAX];
    const size_t room = dr_port_line_room(DR_LINE_HOST);
    const size_t count = dr_guard_pull_host(&b.guard, now, bytes, room < sizeof bytes ? room : sizeof bytes);
    dr_port_line_write(DR_LINE_HOST, bytes, count);
}

/* -- People -------------------------------------------------------------------------------------------------------- */

/* A stop counts at once, everything else when it has stopped bouncing. */
static void look_at_inputs(dr_us now)
{
    const uint16_t levels = (uint16_t)(dr_port_inputs() ^ STOPS);
    if (now - b.looked >= DR_LOOK_US) {
        b.looked = now;
        (void)dr_contacts_look(&b.contacts, levels);
    }
    const uint16_t on = (uint16_t)((levels & STOPS) | (b.contacts.closed & ~STOPS)), changed = on ^ b.told;
    b.told = on;
    uint16_t mask = 1;
    for (uint8_t input = 0; input <= DR_INPUT_CONFIRM && changed != 0; input++, mask = (uint16_t)(mask << 1))
        if ((changed & mask) != 0) {
            dr_guard_input(&b.guard, now, (dr_input)input, (on & mask) != 0);
            send_device(now); /* a stop is not kept waiting for the other contact */
        }
    const bool is_open = dr_port_host_is_open();
    if (is_open != b.host_is_open)
        dr_guard_link(&b.guard, now, is_open, b.has_limits);
    b.host_is_open = is_open;
    b.confirmed = b.confirmed || (changed & on & 1u << DR_INPUT_CONFIRM) != 0;
}

static bool lamp(const dr_guard_status *status, dr_us now)
{
    const uint32_t at = now >> 17;        /* eighths of a second, about */
    if (status->fault != DR_FAULT_NONE) { /* its number, and a pause */
        const uint32_t in = at % (2u * status->fault + 8u);
        return in < 2u * status->fault && in % 2u == 0;
    }
    if (status->state == DR_GUARD_STOPPED)
        return at % 8u < 4u;
    if (status->confirm_wanted)
        return at % 2u == 0;
    if (status->state == DR_GUARD_LOCKED || status->state == DR_GUARD_DISARMED)
        return at % 16u == 0;
    return true;
}

/* There are limits, and the controller does not move by itself when it gets power, or somebody has made room for that. */
static bool may_have_power(const dr_guard_status *status)
{
    const bool moves = (b.limits.rig & DR_RIG_CALIBRATES_AT_POWER_ON) != 0;
    return b.has_limits && !status->cut && (!moves || b.confirmed);
}

static void look_at_guard(dr_us now)
{
    dr_guard_status status;
    b.looked_at_guard = now;
    dr_guard_get_status(&b.guard, &status);
    b.steady = (uint8_t)((status.buzzer ? BUZZER : 0u) | (lamp(&status, now) ? LAMP : 0u));
    b.has_power = may_have_power(&status);
    b.may_move = status.state >= DR_GUARD_CHECKING && status.state <= DR_GUARD_STOPPING;
}

static void drive_outputs(void)
{
    b.wave = b.has_power && !b.wave;
    dr_port_outputs((uint8_t)(b.steady | (b.wave ? RELAY : 0u)));
}

/* -- The log: '#' and the record in hexadecimal, as in the log of dryrig-guard ---------------------------------------- */

static void put_log_line(const dr_record *record)
{
    static const char digits[] = "0123456789abcdef";
    uint8_t bytes[DR_RECORD_BYTES], *at = b.log_line;
    dr_record_put(record, bytes);
    *at++ = '#';
    for (uint8_t i = 0; i < DR_RECORD_BYTES; i++) {
        *at++ = (uint8_t)digits[bytes[i] >> 4];
        *at++ = (uint8_t)digits[bytes[i] & 15u];
    }
    *at = '\n';
    b.log_left = LOG_LINE;
}

static void tell_log(void)
{
    dr_record record;
    const size_t room = dr_port_line_room(DR_LINE_LOG);
    if (b.log_left == 0 && room > 0 && !b.may_move && dr_guard_pull_log(&b.guard, &record)) /* slow: a ^C would wait */
        put_log_line(&record);
    const size_t count = b.log_left < room ? b.log_left : room;
    dr_port_line_write(DR_LINE_LOG, b.log_line + LOG_LINE - b.log_left, count);
    b.log_left = (uint8_t)(b.log_left - count);
}

/* -- The watchdog -------------------------------------------------------------------------------------------------- */

/* The limits in memory, a piece each round. */
static void check_limits(void)
{
    const size_t left = sizeof b.limits - b.summed, count = left < PIECE ? left : PIECE;
    b.sum = dr_crc32c(b.sum, (const uint8_t *)&b.limits + b.summed, count);
    b.summed += count;
    if (b.summed < sizeof b.limits)
        return;
    b.damaged = b.damaged || b.sum != b.limits_sum;
    b.summed = 0;
    b.sum = 0;
}

/* Fed by a round in which all that must hold did: the loop came round, the clock went on, and has never gone too far. */
static void feed_watchdog(dr_us now)
{
    const dr_us lasted = now - b.round;
    b.round = now;
    check_limits();
    b.damaged = b.damaged || lasted > LONGEST_ROUND_US;
    if (!b.damaged && dr_port_stack_holds() && lasted > 0)
        dr_port_watchdog_feed();
}

/* -- The loop ------------------------------------------------------------------------------------------------------ */

/* What the contacts and the host say that stops leaves at once. */
static void let_stops_through(dr_us now)
{
    look_at_inputs(now);
    if (hear_host(now))
        send_device(now);
}

/* A stop must not wait: it is looked for between any two things that may take long, and of what is put off to the end one is
 * done a round. It never sleeps: contacts have no interrupt. */
void dr_bridge_step(void)
{
    const dr_us now = dr_port_now_us();
    let_stops_through(now);
    send_device(now);
    let_stops_through(now);
    if (hear_device(now))
        let_stops_through(now);
    answer_host(now);
    let_stops_through(now);
    if (now - b.looked_at_guard >= SHOW_US) {
        look_at_guard(now);
    } else {
        tell_log();
        feed_watchdog(now);
    }
    drive_outputs();
}

/* -- The start ----------------------------------------------------------------------------------------------------- */

typedef enum { PLACE_BLANK, PLACE_DAMAGED, PLACE_GOOD } place;

static place read_configuration(uint8_t which)
{
    uint8_t image[DR_LIMITS_IMAGE_BYTES];
    dr_limits_problem problem;
    bool is_blank = true;
    dr_port_configuration(which, image, sizeof image);
    for (size_t i = 0; i < sizeof image && is_blank; i++)
        is_blank = image[i] == image[0]; /* as memory is when it was never written, or erased */
    if (is_blank)
        return PLACE_BLANK;
    return dr_limits_get(image, sizeof image, &b.limits, &problem) ? PLACE_GOOD : PLACE_DAMAGED;
}

/* The newest configuration that is whole. False: there is none. *doubtful: a damaged one may have been newer. */
static bool read_limits(bool *doubtful)
{
    uint8_t newest = DR_PORT_CONFIGURATIONS;
    uint32_t revision = 0;
    *doubtful = false;
    for (uint8_t which = 0; which < DR_PORT_CONFIGURATIONS; which++) {
        const place is = read_configuration(which);
        *doubtful = *doubtful || is == PLACE_DAMAGED;
        if (is == PLACE_GOOD && (newest == DR_PORT_CONFIGURATIONS || b.limits.revision > revision)) {
            newest = which;
            revision = b.limits.revision;
        }
    }
    return newest < DR_PORT_CONFIGURATIONS && read_configuration(newest) == PLACE_GOOD;
}

static dr_start how_it_ended(void)
{
    survivor = dr_port_survivor();
    if (survivor->alive == ALIVE)
        return survivor->mid_frame ? DR_START_MID_FRAME : DR_START_AFTER_RESET;
    survivor->mid_frame = false;
    survivor->alive = ALIVE;
    return DR_START_POWER_ON;
}

static uint8_t query_of(const dr_limits *limits)
{
    dr_command query = {0, 0, 0, 0, 0, 0, 0};
    (void)dr_command_for((dr_kind)limits->kind, limits->firmware,
                         limits->kind == DR_TRIO ? DR_OP_TRIO_POSITION : DR_OP_MPC_POSITION, &query);
    return query.code;
}

void dr_bridge_begin(void)
{
    bool doubtful;
    memset(&b, 0, sizeof b);
    (void)dr_port_begin();
    b.has_limits = read_limits(&doubtful);
    b.limits_sum = dr_crc32c(0, (const uint8_t *)&b.limits, sizeof b.limits);
    const uint32_t baud = b.has_limits && b.limits.kind == DR_MPC ? DR_BAUD_MPC : DR_BAUD_TRIO;
    dr_port_line_open(DR_LINE_LOG, LOG_BAUD);
    dr_port_line_open(DR_LINE_HOST, baud);
    if (b.has_limits)
        dr_port_line_open(DR_LINE_DEVICE, baud);
    b.query = query_of(&b.limits);
    const uint16_t levels = (uint16_t)(dr_port_inputs() ^ STOPS);
    dr_contacts_init(&b.contacts, levels);
    b.told = levels & PRESSES; /* what is held at the start must be let go before it is a press */
    dr_guard_init(&b.guard, b.has_limits ? &b.limits : NULL, b.records, BRIDGE_RECORDS);

    const dr_us now = b.looked = b.round = dr_port_now_us();
    dr_guard_start(&b.guard, now, how_it_ended());
    dr_guard_link(&b.guard, now, false, b.has_limits); /* a UART cannot tell who is there: the proof of identity will */
    if (doubtful) {                                    /* these limits may not be the newest: CONFIRM before ARM */
        dr_guard_input(&b.guard, now, DR_INPUT_TIP_CHANGED, true);
        dr_guard_input(&b.guard, now, DR_INPUT_TIP_CHANGED, false);
    }
    send_device(now); /* after a reset: ^C */
    dr_port_watchdog_start();
}
