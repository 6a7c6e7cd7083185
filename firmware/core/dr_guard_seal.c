/* The seal over the guard's memory. See dr_guard_rooms.h. */
#include "dr_guard_rooms.h"

/* By words, which takes a machine of 8 bits half as long as by bytes. Any one flipped bit changes it. */
static uint32_t sum_of(const dr_guard *g)
{
    const uint8_t *const bytes = (const uint8_t *)g;
    uint32_t sum = 0, word;
    for (size_t at = 0; at < offsetof(dr_guard, word_end); at += sizeof word) {
        memcpy(&word, bytes + at, sizeof word);
        sum += word;
    }
    return sum;
}

void dr_g_seal(dr_guard *g)
{
    g->seal = sum_of(g);
    g->sealed = true;
}

/* Nothing that was in memory can be believed, the log's place not either. A motion may be under way: ^C, unless the controller
 * may be waiting for the rest of a frame. */
static void fall_apart(dr_guard *g)
{
    const bool torn = g->torn != 0 || g->fault == DR_FAULT_TORN || is_leaving(g) || g->task == TASK_SEND;
    memset(g, 0, sizeof *g);
    dr_g_set_mode(g, MODE_LOCKED);
    g->fault = DR_FAULT_DAMAGED;
    g->shown_state = DR_GUARD_LOCKED;
    g->torn = torn;
    g->stops_out = torn ? 0 : 1;
    g->last_refusal.axis = DR_AXES;
    g->last_refusal.item = DR_NO_ITEM;
}

bool dr_g_is_damaged(const dr_guard *g) { return g->sealed && g->seal != sum_of(g); }

void dr_g_unseal(dr_guard *g)
{
    if (dr_g_is_damaged(g))
        fall_apart(g);
    g->sealed = false;
}
