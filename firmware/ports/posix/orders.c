/* Orders of the second channel, and what people are told. */
#include "bridge.h"

#include "dr_words.h"
#include "guard_words.h"
#include "say.h"

#include <cjson/cJSON.h>

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define S_US UINT64_C(1000000)
#define ORDER_LASTS_US (5 * S_US)
#define CALIBRATE_LASTS_US (30 * S_US)
#define REFUSALS_APART_US S_US /* at stderr, which hears how many there were between; followers are told each */
#define LOG_USUAL 20u
#define NEED_BITS 16u
#define ORDER_MAX 64u /* longer than any */
#define BLANKS " \t\r"

static bool has(const dr_guard_status *status, unsigned need) { return (status->needs & need) != 0; }

static bool has_surface(const bridge *b)
{
    bool any = false;
    for (unsigned drive = 0; drive < DR_PORTS; drive++)
        any = any || b->rig.limits.drives[drive].retract != DR_TO_NONE;
    return any;
}

/* What to type next; NULL: nothing. */
static const char *next_order(const bridge *b, const dr_guard_status *status)
{
    if (status->state == DR_GUARD_IDLE)
        return status->confirm_wanted ? "confirm" : NULL;
    if (has(status, DR_NEEDS_CLEAR | DR_NEEDS_STOP_RELEASED))
        return "clear";
    if (status->fault == DR_FAULT_TORN)
        return "confirm";
    if (has(status, DR_NEEDS_DEVICE | DR_NEEDS_LOG | DR_NEEDS_REST))
        return NULL;
    if (status->confirm_wanted)
        return "confirm";
    if (has(status, DR_NEEDS_IDENTITY))
        return "clear";
    if (has_surface(b) && !b->surface_said)
        return "surface on|off";
    return has(status, DR_NEEDS_INSIDE) ? "escape on" : "arm";
}

/* -- JSON -------------------------------------------------------------------------------------------------------------- */

static void add_needs(const bridge *b, const dr_guard_status *status, cJSON *to)
{
    cJSON *const list = cJSON_AddArrayToObject(to, "needs");
    for (unsigned bit = 0; bit < NEED_BITS; bit++) {
        if ((status->needs >> bit & 1u) == 0 || guard_words_need(bit) == NULL)
            continue;
        cJSON *const need = cJSON_CreateObject();
        (void)cJSON_AddStringToObject(need, "need", guard_words_need(bit));
        (void)cJSON_AddStringToObject(need, "says", guard_words_need_says(bit));
        (void)cJSON_AddItemToArray(list, need);
    }
    if (!has_surface(b) || b->surface_said)
        return;
    cJSON *const need = cJSON_CreateObject();
    (void)cJSON_AddStringToObject(need, "need", "surface");
    (void)cJSON_AddStringToObject(need, "says",
                                  "a person says whether the tip is in tissue: 'surface on' or 'surface off'");
    (void)cJSON_AddItemToArray(list, need);
}

static void add_position(const bridge *b, const dr_guard_status *status, cJSON *to)
{
    dr_stage stage;
    if (!status->position_known || !dr_stage_get((dr_stage_id)b->rig.limits.drives[status->drive].stage, &stage)) {
        (void)cJSON_AddNullToObject(to, "position");
        return;
    }
    cJSON *const position = cJSON_AddObjectToObject(to, "position");
    (void)cJSON_AddNumberToObject(position, "drive", status->drive + 1);
    cJSON *const um = cJSON_AddArrayToObject(position, "um"), *const steps = cJSON_AddArrayToObject(position, "steps");
    for (unsigned axis = 0; axis < DR_AXES; axis++) {
        (void)cJSON_AddItemToArray(steps, cJSON_CreateNumber(status->position_steps[axis]));
        (void)cJSON_AddItemToArray(
            um, cJSON_CreateNumber((double)status->position_steps[axis] * stage.quanta_per_step / DR_QUANTA_PER_UM));
    }
    if (b->rig.limits.kind == DR_TRIO)
        (void)cJSON_AddNumberToObject(position, "angle_deg", status->angle_deg);
}

static void add_refusal(const bridge *b, const dr_guard_status *status, cJSON *to)
{
    char text[GUARD_WORDS_MAX];
    if (status->last_refusal.reason == DR_REASON_NONE) {
        (void)cJSON_AddNullToObject(to, "last_refusal");
        return;
    }
    cJSON *const refusal = cJSON_AddObjectToObject(to, "last_refusal");
    (void)guard_words_verdict(text, sizeof text, &b->rig, &status->last_refusal);
    (void)cJSON_AddStringToObject(refusal, "command", dr_words_command((dr_op)status->last_op)->name);
    (void)cJSON_AddStringToObject(refusal, "reason", guard_words_reason(status->last_refusal.reason));
    (void)cJSON_AddStringToObject(refusal, "says", text);
}

static cJSON *status_object(const bridge *b, const dr_guard_status *status, const char *wrong)
{
    char hash[16];
    cJSON *const all = cJSON_CreateObject();
    (void)cJSON_AddBoolToObject(all, "ok", wrong == NULL);
    if (wrong != NULL)
        (void)cJSON_AddStringToObject(all, "why", wrong);
    (void)cJSON_AddStringToObject(all, "state", guard_words_state(status->state));
    (void)cJSON_AddStringToObject(all, "fault", guard_words_fault(status->fault));
    if (status->fault != DR_FAULT_NONE)
        (void)cJSON_AddStringToObject(all, "fault_says", guard_words_fault_says(status->fault));
    if (status->state == DR_GUARD_DISARMED && b->disarmed_says != NULL)
        (void)cJSON_AddStringToObject(all, "disarmed_says", b->disarmed_says);
    if (has(status, DR_NEEDS_DEVICE) && b->device_says[0] != '\0')
        (void)cJSON_AddStringToObject(all, "device_says", b->device_says);
    add_needs(b, status, all);
    const char *const next = next_order(b, status);
    if (next != NULL)
        (void)cJSON_AddStringToObject(all, "next", next);
    (void)cJSON_AddBoolToObject(all, "confirm_wanted", status->confirm_wanted);
    (void)cJSON_AddBoolToObject(all, "in_tissue", status->in_tissue);
    (void)cJSON_AddBoolToObject(all, "escape", status->escape);
    (void)cJSON_AddBoolToObject(all, "may_calibrate", status->may_calibrate);
    (void)cJSON_AddBoolToObject(all, "alarm", status->buzzer);
    (void)cJSON_AddBoolToObject(all, "host_open", b->host.opens > 0);
    (void)cJSON_AddBoolToObject(all, "within_frame", dr_guard_is_mid_frame(&b->guard));
    add_position(b, status, all);
    add_refusal(b, status, all);
    (void)cJSON_AddNumberToObject(all, "forwarded", status->forwarded);
    (void)cJSON_AddNumberToObject(all, "refused", status->refused);
    (void)cJSON_AddNumberToObject(all, "dropped_bytes", status->dropped_bytes);
    (void)cJSON_AddNumberToObject(all, "quarantined_bytes", status->quarantined_bytes);
    (void)cJSON_AddNumberToObject(all, "log_missed", status->log_missed);
    (void)cJSON_AddStringToObject(all, "config", b->options->config);
    (void)snprintf(hash, sizeof hash, "%08X", dr_limits_crc(&b->rig.limits));
    (void)cJSON_AddStringToObject(all, "config_hash", hash);
    (void)cJSON_AddNumberToObject(all, "config_revision", b->rig.limits.revision);
    return all;
}

static void answer(control_client *who, cJSON *all)
{
    char *const line = cJSON_PrintUnformatted(all);
    control_say(who, line != NULL ? line : "{\"ok\":false,\"why\":\"out of memory\"}");
    cJSON_free(line);
    cJSON_Delete(all);
}

static void answer_status(const bridge *b, control_client *who, const char *wrong)
{
    dr_guard_status status;
    dr_guard_get_status(&b->guard, &status);
    answer(who, status_object(b, &status, wrong));
}

static void answer_log(const bridge *b, control_client *who, unsigned count)
{
    char time_text[JOURNAL_TIME_MAX], words[GUARD_WORDS_MAX], hex[2 * DR_RECORD_BYTES + 1];
    cJSON *const all = cJSON_CreateObject();
    (void)cJSON_AddBoolToObject(all, "ok", true);
    cJSON *const list = cJSON_AddArrayToObject(all, "log");
    for (unsigned n = count; n > 0; n--) {
        const journal_entry *const entry = journal_last(&b->journal, n - 1);
        if (entry == NULL)
            continue;
        cJSON *const one = cJSON_CreateObject();
        journal_time(time_text, entry->wall_us);
        (void)guard_words_record(words, sizeof words, &b->rig, &entry->record);
        journal_hex(hex, &entry->record);
        (void)cJSON_AddStringToObject(one, "time", time_text);
        (void)cJSON_AddStringToObject(one, "event", guard_words_event(entry->record.event));
        (void)cJSON_AddStringToObject(one, "says", words);
        (void)cJSON_AddStringToObject(one, "record", hex);
        (void)cJSON_AddItemToArray(list, one);
    }
    answer(who, all);
}

/* -- Orders ------------------------------------------------------------------------------------------------------------ */

static void set_input(bridge *b, dr_input what, bool on)
{
    dr_guard_input(&b->guard, bridge_now(b), what, on);
    bridge_pump(b);
}

static void press(bridge *b, dr_input what)
{
    set_input(b, what, true);
    set_input(b, what, false);
}

/* An order that has to wait: for two readings that agree, for contacts that have stopped bouncing. */
static void start(bridge *b, control_client *who, order_kind order)
{
    if (b->order != ORDER_NONE) {
        answer_status(b, who, "another order is being carried out");
        return;
    }
    b->order = order;
    b->order_pressed = false;
    b->order_until_us = b->now_us + ORDER_LASTS_US;
    who->waits = true;
    if (order == ORDER_ARM) {
        set_input(b, DR_INPUT_KEY, true);
    } else {
        set_input(b, DR_INPUT_STOP, false);
        set_input(b, DR_INPUT_STOP_2, false);
    }
    orders_continue(b);
}

static void finish(bridge *b, const char *wrong)
{
    b->order = ORDER_NONE;
    for (unsigned i = 0; i < CONTROL_CLIENTS; i++)
        if (b->control.clients[i].fd >= 0 && b->control.clients[i].waits) {
            b->control.clients[i].waits = false;
            answer_status(b, &b->control.clients[i], wrong);
        }
}

static void continue_arming(bridge *b, const dr_guard_status *status)
{
    const unsigned found_by_arming = DR_NEEDS_INSIDE | DR_NEEDS_STEADY;
    if (status->state == DR_GUARD_IDLE) {
        finish(b, NULL);
    } else if (!has(status, DR_NEEDS_REST)) {
        if (b->order_pressed || (status->needs & ~found_by_arming) != 0) {
            finish(b, "not armed: see needs");
        } else {
            b->order_pressed = true;
            press(b, DR_INPUT_ARM);
        }
    }
}

static void continue_clearing(bridge *b, const dr_guard_status *status)
{
    if (has(status, DR_NEEDS_REST | DR_NEEDS_STOP_RELEASED))
        return;
    if (!b->order_pressed) {
        b->order_pressed = true;
        b->disarmed_says = status->state == DR_GUARD_IDLE ? "somebody has said 'clear'" : b->disarmed_says;
        set_input(b, DR_INPUT_KEY, false);
        set_input(b, DR_INPUT_KEY, true);
    } else {
        finish(b, has(status, DR_NEEDS_CLEAR | DR_NEEDS_IDENTITY) ? "the cause is still there: see fault and needs"
                                                                  : NULL);
    }
}

/* Why will it not be armed any more? What was allowed for one time of being armed ends with it. */
static void watch_arming(bridge *b)
{
    dr_guard_status status;
    dr_guard_get_status(&b->guard, &status);
    const bool is_armed = status.state >= DR_GUARD_IDLE && status.state <= DR_GUARD_STOPPING;
    if (is_armed && !b->was_armed)
        b->disarmed_says = NULL;
    if (b->was_armed && b->host_left && status.state != DR_GUARD_IDLE)
        b->disarmed_says = "the host's program has closed the port";
    if (b->was_armed && status.state == DR_GUARD_DISARMED && b->disarmed_says == NULL)
        b->disarmed_says = b->log_said ? "the log could not be written" : "nothing was moved for a while (arm_idle_s)";
    if (b->was_armed && !is_armed && status.escape)
        set_input(b, DR_INPUT_ESCAPE, false);
    b->was_armed = is_armed;
}

void orders_continue(bridge *b)
{
    dr_guard_status status;
    if (b->order != ORDER_NONE) { /* it may have waited for this state, and make another one of it */
        watch_arming(b);
        orders_tell(b);
    }
    if (b->calibrate_until_us != 0 && b->now_us >= b->calibrate_until_us) {
        b->calibrate_until_us = 0;
        set_input(b, DR_INPUT_MAY_CALIBRATE, false);
    }
    for (unsigned step = 0; step < 2 && b->order != ORDER_NONE; step++) { /* pressing, and what came of it */
        dr_guard_get_status(&b->guard, &status);
        if (b->order == ORDER_ARM)
            continue_arming(b, &status);
        else
            continue_clearing(b, &status);
    }
    if (b->order != ORDER_NONE && b->now_us >= b->order_until_us)
        finish(b, "something is under way: see state");
    watch_arming(b);
}

bool orders_due(const bridge *b, uint64_t *when_us)
{
    uint64_t when = UINT64_MAX;
    if (b->order != ORDER_NONE)
        when = b->order_until_us;
    if (b->calibrate_until_us != 0 && b->calibrate_until_us < when)
        when = b->calibrate_until_us;
    if (b->refusals_left_out > 0 && b->refusals_quiet_us < when)
        when = b->refusals_quiet_us;
    *when_us = when;
    return when != UINT64_MAX;
}

static void order_arm(bridge *b, control_client *who)
{
    if (journal_retry(&b->journal)) /* somebody has made room */
        bridge_pump(b);
    if (has_surface(b) && !b->surface_said)
        answer_status(b, who, "say first whether the tip is in tissue: 'surface on' or 'surface off'");
    else
        start(b, who, ORDER_ARM);
}

static bool is(const char *line, const char *order) { return strcmp(line, order) == 0; }

/* "log", or "log N". */
static bool is_log(const char *line, unsigned *count)
{
    static const char order[] = "log ";
    const char *const number = line + sizeof order - 1;
    *count = LOG_USUAL;
    if (is(line, "log"))
        return true;
    if (strncmp(line, order, sizeof order - 1) != 0 || *number == '\0' || number[strspn(number, "0123456789")] != '\0')
        return false;
    const unsigned long wanted = strtoul(number, NULL, 10);
    *count = wanted < JOURNAL_KEPT ? (unsigned)wanted : JOURNAL_KEPT;
    return true;
}

/* Orders that are done when they have been given. False: it is none of them. */
static bool set_at_once(bridge *b, const char *line)
{
    if (is(line, "disarm")) {
        b->disarmed_says = "somebody has said so";
        set_input(b, DR_INPUT_KEY, false);
    } else if (is(line, "stop")) {
        dr_guard_input(&b->guard, bridge_now(b), DR_INPUT_STOP, true);
        set_input(b, DR_INPUT_STOP_2, true);
    } else if (is(line, "confirm")) {
        press(b, DR_INPUT_CONFIRM);
    } else if (is(line, "tip-changed")) {
        b->disarmed_says = "the tip was changed";
        press(b, DR_INPUT_TIP_CHANGED);
    } else if (is(line, "allow-calibrate")) {
        b->calibrate_until_us = b->now_us + CALIBRATE_LASTS_US;
        set_input(b, DR_INPUT_MAY_CALIBRATE, true);
    } else if (is(line, "surface on") || is(line, "surface off")) {
        b->surface_said = true;
        set_input(b, DR_INPUT_IN_TISSUE, is(line, "surface on"));
    } else if (is(line, "escape on") || is(line, "escape off")) {
        set_input(b, DR_INPUT_ESCAPE, is(line, "escape on"));
    } else {
        return is(line, "status");
    }
    return true;
}

/* As it was meant: without capitals, and blanks or a CR around it. */
static void put_plain(char out[ORDER_MAX], const char *said)
{
    size_t count = 0;
    said += strspn(said, BLANKS);
    for (; *said != '\0' && count < ORDER_MAX - 1; said++)
        out[count++] = (char)tolower((unsigned char)*said);
    while (count > 0 && strchr(BLANKS, out[count - 1]) != NULL)
        count--;
    out[count] = '\0';
}

void orders_take(void *context, control_client *who, const char *said)
{
    bridge *const b = context;
    char line[ORDER_MAX] = "";
    put_plain(line, said);
    unsigned count;
    const bool calibrates = (b->rig.limits.rig & DR_RIG_MAY_CALIBRATE) != 0;
    if (who->waits) { /* one after the other */
        control_say(who, "{\"ok\":false,\"why\":\"the last order has no answer yet\"}");
    } else if (is(line, "arm")) {
        order_arm(b, who);
    } else if (is(line, "clear")) {
        start(b, who, ORDER_CLEAR);
    } else if (is(line, "follow")) {
        who->follows = true;
        answer_status(b, who, NULL);
    } else if (is_log(line, &count)) {
        answer_log(b, who, count);
    } else if (is(line, "allow-calibrate") && !calibrates) {
        answer_status(b, who, "the configuration has no 'allow_calibrate = true': no calibration passes");
    } else if (set_at_once(b, line)) {
        answer_status(b, who, NULL);
    } else {
        control_say(
            who, "{\"ok\":false,\"why\":\"no such order; there are status, follow, arm, disarm, stop, clear, confirm, "
                 "allow-calibrate, surface on|off, escape on|off, tip-changed, log [N]\"}");
    }
}

/* -- Telling people ---------------------------------------------------------------------------------------------------- */

static bool is_resting(uint8_t state)
{
    return state == DR_GUARD_LOCKED || state == DR_GUARD_DISARMED || state == DR_GUARD_IDLE ||
           state == DR_GUARD_FAULT || state == DR_GUARD_STOPPED;
}

/* Is there nothing new for people? Every query and motion is "under way" for a moment: that alone is no news. */
static bool is_same(const dr_guard_status *now, const dr_guard_status *told)
{
    uint16_t needs = now->needs;
    if (is_resting(now->state) && !has(told, DR_NEEDS_REST))
        needs = (uint16_t)(needs & ~(unsigned)DR_NEEDS_REST);
    return now->state == told->state && now->fault == told->fault && needs == told->needs &&
           now->refused == told->refused && now->confirm_wanted == told->confirm_wanted &&
           now->in_tissue == told->in_tissue && now->escape == told->escape &&
           now->may_calibrate == told->may_calibrate && now->buzzer == told->buzzer;
}

static void say_state(bridge *b, const dr_guard_status *now)
{
    const char *const next = next_order(b, now);
    const char *const says = has(now, DR_NEEDS_DEVICE) && now->fault != DR_FAULT_TORN ? b->device_says
                             : now->fault != DR_FAULT_NONE ? guard_words_fault_says(now->fault)
                             : now->state == DR_GUARD_DISARMED && b->disarmed_says != NULL ? b->disarmed_says
                                                                                           : "";
    say("dryrig-guard: %s%s%s\n", guard_words_state(now->state), *says != '\0' ? ": " : "", says);
    if (now->confirm_wanted && now->state == DR_GUARD_IDLE)
        say("  there are no obstacles in %s: only the box protects the objective and the bath\n", b->options->config);
    if (next != NULL && b->options->control != NULL)
        say("  next: dryrig-guard ctl %s %s\n", b->options->control, next);
    else if (next != NULL)
        say("  it cannot be armed: there is no --control socket\n");
}

/* The last one, and how many there were since one was told. */
static void say_refusals(bridge *b, const dr_guard_status *now)
{
    const bridge_options *const o = b->options;
    char text[GUARD_WORDS_MAX];
    const unsigned more = b->refusals_left_out - 1u;
    b->refusals_left_out = 0;
    b->refusals_quiet_us = b->now_us + REFUSALS_APART_US;
    (void)guard_words_verdict(text, sizeof text, &b->rig, &now->last_refusal);
    say("dryrig-guard: refused '%s': %s\n", dr_words_command((dr_op)now->last_op)->name, text);
    if (more > 0 && o->control != NULL)
        say("  and %u more before it: 'dryrig-guard ctl %s log' tells each\n", more, o->control);
    else if (more > 0)
        say("  and %u more before it%s%s%s\n", more, o->log != NULL ? ": " : "", o->log != NULL ? o->log : "",
            o->log != NULL ? " tells each" : "");
}

void orders_end(bridge *b)
{
    orders_tell(b);
    if (b->refusals_left_out > 0)
        say_refusals(b, &b->shown);
}

void orders_tell(bridge *b)
{
    dr_guard_status now;
    dr_guard_get_status(&b->guard, &now);
    if (b->shown_any)
        b->refusals_left_out += now.refused - b->shown.refused;
    if (b->refusals_left_out > 0 && b->now_us >= b->refusals_quiet_us)
        say_refusals(b, &now);
    if (b->shown_any && is_same(&now, &b->shown))
        return;
    if (is_resting(now.state) && !has(&now, DR_NEEDS_REST) &&
        (!b->said_any || now.state != b->said_state || now.fault != b->said_fault)) {
        b->said_any = true;
        b->said_state = now.state;
        b->said_fault = now.fault;
        say_state(b, &now);
    }
    b->shown = now;
    b->shown_any = true;
    for (unsigned i = 0; i < CONTROL_CLIENTS; i++)
        if (b->control.clients[i].fd >= 0 && b->control.clients[i].follows)
            answer(&b->control.clients[i], status_object(b, &now, NULL));
}
