#include "core_link.h"

#include "dr_words.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void die(const char *why)
{
    (void)fprintf(stderr, "core_link: %s\n", why);
    exit(3);
}

/* -- From the controller to the host ------------------------------------------------------------------------------- */

static void deliver(core_link *link, uint8_t byte, uint64_t at_us)
{
    if (link->count == sizeof link->inbox / sizeof link->inbox[0])
        die("the host does not read");
    const size_t at = (link->first + link->count++) % (sizeof link->inbox / sizeof link->inbox[0]);
    link->inbox[at].at_us = at_us > link->held_until_us ? at_us : link->held_until_us;
    link->inbox[at].byte = byte;
}

static void carry(core_link *link, uint8_t byte, uint64_t at_us)
{
    core_fate fate = PASS;
    if (link->to_host != NULL)
        fate = link->to_host(link, link->to_host_count, &byte);
    link->to_host_count++;
    if (fate == DROP)
        return;
    if (fate == HOLD)
        link->held_until_us = at_us + link->hold_us;
    if (fate == AFTER_EXTRA)
        deliver(link, link->extra, at_us);
    deliver(link, byte, at_us);
    if (fate == TWICE)
        deliver(link, byte, at_us);
}

static void note_breaches(core_link *link)
{
    dr_note note;
    while (dr_notes_take(&link->notes, &note))
        if (note.what == DR_NOTE_KEPT || note.what == DR_NOTE_CLIPPED || note.what == DR_NOTE_UNKNOWN ||
            note.what == DR_NOTE_SPEED_CUT || note.what == DR_NOTE_BAD_VALUE || note.what == DR_NOTE_STOP_IGNORED ||
            note.what == DR_NOTE_WEDGED || note.what == DR_NOTE_LOST || note.what == DR_NOTE_FILLER) {
            char text[300];
            const dr_words_context context = {link->ins.controller.kind, link->ins.controller.firmware, DR_STAGE_NONE};
            (void)dr_words_note(text, sizeof text, &context, &note);
            if (getenv("CORE_LINK_TRACE") != NULL)
                (void)fprintf(stderr, "breach at %llu us: %s\n", (unsigned long long)link->now_us, text);
            link->breaches++;
        }
}

static void advance(core_link *link, uint64_t until_us)
{
    for (;;) {
        const bool happens = link->event != NULL && link->event_us <= until_us;
        const uint64_t stop_us = happens ? (link->event_us > link->now_us ? link->event_us : link->now_us) : until_us;
        uint8_t bytes[64];
        size_t count;
        while (instrument_run(&link->ins, stop_us, bytes, sizeof bytes, &count)) {
            for (size_t i = 0; i < count; i++)
                carry(link, bytes[i], link->ins.now_us);
            note_breaches(link);
        }
        link->now_us = stop_us;
        uint32_t at[DR_AXES];
        dr_controller_position(&link->ins.controller, 0, (dr_us)stop_us, at);
        for (size_t axis = 0; axis < DR_AXES; axis++)
            link->furthest_steps = at[axis] > link->furthest_steps ? at[axis] : link->furthest_steps;
        if (!happens)
            return;
        void (*event)(core_link *) = link->event;
        link->event = NULL;
        event(link);
    }
}

/* -- The link ------------------------------------------------------------------------------------------------------ */

static int core_read(void *context, void *bytes, size_t room, uint32_t timeout_us)
{
    core_link *link = context;
    const uint64_t end_us = link->now_us + timeout_us;
    uint8_t *out = bytes;
    advance(link, link->now_us);
    for (;;) {
        size_t taken = 0;
        if (link->is_gone)
            return DRYRIG_ERR_LINK;
        while (taken < room && link->count > 0 && link->inbox[link->first].at_us <= link->now_us) {
            out[taken++] = link->inbox[link->first].byte;
            link->first = (link->first + 1) % (sizeof link->inbox / sizeof link->inbox[0]);
            link->count--;
        }
        if (taken > 0)
            link->quiet_since_us = link->now_us;
        if (taken > 0 || link->now_us >= end_us)
            return (int)taken;
        uint64_t next_us = end_us, due_us;
        if (instrument_due(&link->ins, &due_us) && due_us < next_us)
            next_us = due_us;
        if (link->count > 0 && link->inbox[link->first].at_us < next_us)
            next_us = link->inbox[link->first].at_us;
        if (link->event != NULL && link->event_us < next_us)
            next_us = link->event_us;
        advance(link, next_us > link->now_us ? next_us : link->now_us);
        if (next_us == due_us && link->count == 0 && link->now_us < end_us && next_us <= link->now_us)
            continue;
    }
}

static int core_write(void *context, const void *bytes, size_t count)
{
    core_link *link = context;
    const uint8_t *in = bytes;
    if (link->is_gone)
        return DRYRIG_ERR_LINK;
    const uint32_t pause_us = (uint32_t)(link->now_us - link->quiet_since_us);
    const bool is_command = !(count == 1 && in[0] == 0x03) && link->ins.controller.framer.have == 0;
    if (is_command && link->writes > 0 && pause_us < link->shortest_pause_us)
        link->shortest_pause_us = pause_us;
    if (!is_command)
        link->line_pause_us = pause_us;
    link->writes++;
    uint32_t told_us = pause_us;
    for (size_t i = 0; i < count; i++) {
        uint8_t byte = in[i];
        core_fate fate = PASS;
        if (link->from_host != NULL)
            fate = link->from_host(link, link->from_host_count, &byte);
        link->from_host_count++;
        advance(link, link->now_us);
        if (fate != DROP && instrument_take(&link->ins, told_us, &byte, 1) != 1)
            die("the line to the controller is full");
        told_us = 0;
        advance(link, link->now_us + (link->ins.is_paced ? 1u + link->ins.byte_num / link->ins.byte_den : 0u));
    }
    link->quiet_since_us = link->now_us;
    return 0;
}

static int core_purge(void *context)
{
    core_link *link = context;
    advance(link, link->now_us);
    while (link->count > 0 && link->inbox[link->first].at_us <= link->now_us) {
        link->first = (link->first + 1) % (sizeof link->inbox / sizeof link->inbox[0]);
        link->count--;
    }
    return link->is_gone ? DRYRIG_ERR_LINK : 0;
}

static uint64_t core_now(void *context) { return ((core_link *)context)->now_us; }

static void core_sleep(void *context, uint32_t span_us)
{
    core_link *link = context;
    advance(link, link->now_us + span_us);
}

static void core_close(void *context) { ((core_link *)context)->is_closed = true; }

dryrig_link core_link_link(core_link *link)
{
    return (dryrig_link){link, core_read, core_write, core_purge, core_now, core_sleep, core_close};
}

/* -- For tests ----------------------------------------------------------------------------------------------------- */

void core_link_init(core_link *link, dr_kind kind)
{
    memset(link, 0, sizeof *link);
    dr_notes_init(&link->notes, link->ring, sizeof link->ring / sizeof link->ring[0]);
    for (size_t i = 0; i < DR_PORTS; i++)
        dr_drive_init(&link->drives[i], i >= 2            ? DR_STAGE_NONE
                                        : kind == DR_TRIO ? DR_STAGE_TRIO_MP845
                                                          : DR_STAGE_MPC_MP225);
    dr_controller_init(&link->ins.controller, kind, link->drives, kind == DR_TRIO ? 1 : DR_PORTS);
    link->ins.controller.notes = &link->notes;
    link->ins.is_paced = true;
    link->shortest_pause_us = UINT32_MAX;
    link->now_us = UINT64_C(0xFFFFFFFF) - 700000u; /* the controller's clock wraps in every test */
}

void core_link_start(core_link *link) { instrument_start(&link->ins, link->now_us); }

dryrig *core_link_open(core_link *link, const dryrig_options *options)
{
    const bool is_trio = link->ins.controller.kind == DR_TRIO;
    dryrig_options own = options != NULL ? *options : dryrig_defaults(is_trio ? DRYRIG_TRIO : DRYRIG_MPC);
    const dryrig_link as_link = core_link_link(link);
    own.link = &as_link;
    for (size_t i = 0; i < DR_PORTS && options == NULL; i++)
        own.stage[i] = link->drives[i].stage == DR_STAGE_NONE || (is_trio && i > 0)
                           ? NULL
                           : dr_words_stage((dr_stage_id)link->drives[i].stage);
    char why[DRYRIG_WHY_MAX];
    if (dryrig_open(&link->d, &own, why, sizeof why) != DRYRIG_OK)
        die(why);
    return link->d;
}

void core_link_pass(core_link *link, uint64_t span_us) { advance(link, link->now_us + span_us); }

void core_link_truth(core_link *link, unsigned drive, int32_t steps[3])
{
    uint32_t at[DR_AXES];
    dr_controller_position(&link->ins.controller, (uint8_t)drive, (dr_us)link->now_us, at);
    for (size_t axis = 0; axis < DR_AXES; axis++)
        steps[axis] = (int32_t)at[axis];
}

unsigned core_link_breaches(core_link *link)
{
    note_breaches(link);
    return link->breaches;
}
