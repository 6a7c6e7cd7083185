#include "contacts.h"

void dr_contacts_init(dr_contacts *c, uint16_t closed) { *c = (dr_contacts){.closed = closed}; }

uint16_t dr_contacts_look(dr_contacts *c, uint16_t closed)
{
    const uint16_t other = (uint16_t)(closed ^ c->closed);
    /* One more for those, none for the rest. Eight are 0 again. */
    c->counts[2] = (uint16_t)((c->counts[2] ^ (c->counts[1] & c->counts[0])) & other);
    c->counts[1] = (uint16_t)((c->counts[1] ^ c->counts[0]) & other);
    c->counts[0] = (uint16_t)(~c->counts[0] & other);
    const uint16_t changed = (uint16_t)(other & ~(c->counts[0] | c->counts[1] | c->counts[2]));
    c->closed = (uint16_t)(c->closed ^ changed);
    return changed;
}

int8_t dr_encoder_look(dr_encoder *e, bool a, bool b)
{
    /* A and B close, then open, in this order clockwise: 0 none, 1 A, 2 both, 3 B. */
    const uint8_t at = (uint8_t)(a ? (b ? 2u : 1u) : (b ? 3u : 0u));
    const uint8_t way = (uint8_t)(at + 4u - e->at) % 4u;
    e->at = at;
    if (way == 1u)
        e->quarters++;
    else if (way == 3u)
        e->quarters--; /* 2: a look was missed, and it may have gone either way */
    if (at != 0)
        return 0;
    const int8_t quarters = e->quarters;
    e->quarters = 0;
    return (int8_t)(quarters >= 2 ? 1 : quarters <= -2 ? -1 : 0); /* half of the way seen is enough */
}
