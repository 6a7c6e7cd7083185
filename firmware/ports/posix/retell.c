#include "retell.h"

#include "guard_words.h"

#include "dr_recording.h"
#include "dr_wire.h"
#include "dr_words.h"

#include <errno.h>
#include <string.h>

#define QUERY_BITS (15u * 10u) /* a position query and its answer */
#define BEFORE_PAUSE 2u        /* bytes of an MPC-200's 'S' that leave before the guard's pause */
#define PAUSE_US 35000u
#define US_PER_S 1000000u

typedef struct {
    const rig *r;
    FILE *to;
    char name[DR_RECORDING_NAME]; /* "": this start is not of this configuration */
    unsigned told, others;        /* starts */
    uint64_t now_us, last_us;     /* of the present record; of the last line */
    dr_us when;                   /* of the last record */
    dr_record motion;             /* that was allowed and has not left yet */
    bool waits;                   /* there is one */
    bool moves;                   /* a motion has left, and its end is not told yet */
    bool good;                    /* everything could be written */
} teller;

static void put(teller *t, dr_recorded_kind kind, uint64_t when_us, const uint8_t *bytes, size_t count)
{
    if (when_us < t->last_us)
        when_us = t->last_us;
    t->last_us = when_us;
    t->good = dr_recording_bytes(t->to, when_us, when_us, t->name, kind, bytes, count) && t->good;
}

static void put_kept(teller *t, dr_recorded_kind kind, const dr_record *record)
{
    put(t, kind, t->now_us, record->bytes, record->count < DR_RECORD_TEXT ? record->count : DR_RECORD_TEXT);
}

static void put_words(teller *t, const dr_record *record)
{
    char words[GUARD_WORDS_MAX], text[GUARD_WORDS_MAX + 32u];
    (void)guard_words_record(words, sizeof words, t->r, record);
    (void)snprintf(text, sizeof text, "%s: %s", guard_words_event(record->event), words);
    if (t->now_us > t->last_us)
        t->last_us = t->now_us;
    t->good = dr_recording_event(t->to, t->last_us, t->last_us, t->name, text) && t->good;
}

static bool is_motion(const teller *t, const dr_record *record)
{
    dr_command command;
    return dr_command_find((dr_kind)t->r->limits.kind, t->r->limits.firmware, record->bytes[0], &command) &&
           (command.is & DR_IS_MOTION) != 0;
}

/* The motion that waited leaves now. */
static void put_motion(teller *t)
{
    const dr_record *const m = &t->motion;
    const size_t first = m->op == DR_OP_MPC_LINE ? BEFORE_PAUSE : m->count;
    t->waits = false;
    t->moves = true;
    put(t, DR_RECORDING_FROM_HOST, t->now_us, m->bytes, first);
    if (first < m->count)
        put(t, DR_RECORDING_FROM_HOST, t->now_us + PAUSE_US, m->bytes + first, m->count - first);
}

static dr_command position_query(const teller *t)
{
    dr_command query = {0, 0, 0, 0, 0, 0, 0};
    const dr_kind kind = (dr_kind)t->r->limits.kind;
    (void)dr_command_for(kind, t->r->limits.firmware, kind == DR_TRIO ? DR_OP_TRIO_POSITION : DR_OP_MPC_POSITION,
                         &query);
    return query;
}

static void put_query(teller *t)
{
    const dr_command query = position_query(t);
    const uint64_t baud = t->r->limits.kind == DR_TRIO ? DR_BAUD_TRIO : DR_BAUD_MPC;
    const uint64_t took_us = (uint64_t)QUERY_BITS * US_PER_S / baud;
    put(t, DR_RECORDING_FROM_HOST, t->now_us > took_us ? t->now_us - took_us : 0, &query.code, 1);
}

static void put_reading(teller *t, const dr_record *record)
{
    uint8_t bytes[DR_REPLY_MAX];
    const dr_command query = position_query(t);
    dr_reply reply = {.value = record->item};
    memcpy(reply.steps, record->position_steps, sizeof reply.steps);
    put_query(t);
    put(t, DR_RECORDING_TO_HOST, t->now_us, bytes, dr_wire_put_reply(&query, &reply, bytes));
}

/* A start of a guard: a controller from here on. */
static void begin(teller *t, const dr_record *record)
{
    char text[16];
    const dr_limits *const l = &t->r->limits;
    const char *const kind = dr_words_kind((dr_kind)l->kind);
    t->when = record->when;
    t->waits = t->moves = false;
    t->name[0] = '\0';
    if (record->position_steps[0] != dr_limits_crc(l)) {
        t->others++;
        return;
    }
    (void)snprintf(t->name, sizeof t->name, t->told == 0 ? "%s" : "%s.%u", kind, t->told + 1u);
    t->told++;
    (void)dr_words_firmware(text, sizeof text, l->firmware);
    t->good = dr_recording_set(t->to, t->name, "controller", kind) && t->good;
    t->good = dr_recording_set(t->to, t->name, "firmware", text) && t->good;
    for (uint8_t drive = 0; drive < rig_ports(l); drive++)
        t->good =
            dr_recording_set(t->to, t->name, "device", dr_words_stage((dr_stage_id)l->drives[drive].stage)) && t->good;
}

/* next: the record behind it, which tells whether the motion's CR came; NULL: there is none. */
static void tell(teller *t, const dr_record *record, const dr_record *next)
{
    static const uint8_t cr = DR_CR, interrupt = DR_INTERRUPT;
    switch (record->event) {
    case DR_EVENT_ALLOWED:
        t->waits = is_motion(t, record);
        t->motion = *record;
        if (!t->waits)
            put_kept(t, DR_RECORDING_FROM_HOST, record);
        break;
    case DR_EVENT_STATE:
        if (t->waits && (record->after == DR_GUARD_MOVING_S || record->after == DR_GUARD_MOVING_U))
            put_motion(t);
        put_words(t, record);
        break;
    case DR_EVENT_STOP:
        t->waits = t->moves = false;
        put(t, DR_RECORDING_FROM_HOST, t->now_us, &interrupt, 1);
        break;
    case DR_EVENT_REPLY:
    case DR_EVENT_QUARANTINED:
        put_kept(t, DR_RECORDING_TO_HOST, record);
        break;
    case DR_EVENT_READING:
        if (t->moves && (next == NULL || next->event != DR_EVENT_ENDED || next->count > 0))
            put(t, DR_RECORDING_TO_HOST, t->last_us, &cr, 1);
        t->moves = false;
        put_reading(t, record);
        break;
    case DR_EVENT_IMPLAUSIBLE:
        put_query(t);
        put_kept(t, DR_RECORDING_TO_HOST, record);
        break;
    case DR_EVENT_ENDED: /* told by the reading before it */
        break;
    default:
        put_words(t, record);
        break;
    }
}

static void take(teller *t, const dr_record *record, const dr_record *next)
{
    if (record->sequence == 0) {
        begin(t, record);
    } else {
        t->now_us += (uint32_t)(record->when - t->when);
        t->when = record->when;
    }
    if (t->name[0] != '\0')
        tell(t, record, next);
}

bool retell(journal_reader *reader, const rig *r, FILE *to, char *why, size_t room)
{
    teller t = {.r = r, .to = to, .good = true};
    dr_record record, next;
    t.good = dr_recording_begin(to);
    bool any = journal_read(reader, &record);
    while (any) {
        any = journal_read(reader, &next);
        take(&t, &record, any && next.sequence != 0 ? &next : NULL);
        record = next;
    }
    if (reader->why[0] != '\0')
        (void)snprintf(why, room, "%s", reader->why);
    else if (!t.good)
        (void)snprintf(why, room, "it cannot be written: %s", strerror(errno));
    else if (t.told == 0)
        (void)snprintf(why, room, "%s: no guard of this configuration (hash %08lX) has written there; %u of other ones",
                       reader->path, (unsigned long)dr_limits_crc(&r->limits), t.others);
    return reader->why[0] == '\0' && t.good && t.told > 0;
}
