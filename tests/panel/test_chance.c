/* Whatever hands and a host do in whatever order: nobody is lost, no drive leaves its travel, and it does not matter how often
 * the caller comes in between. Two benches live through the same random hours; one is visited all the time, one only when
 * something is done to it. */
#include "bench.h"

static uint32_t seed;

static uint32_t chance(uint32_t below)
{
    seed = seed * UINT32_C(1664525) + UINT32_C(1013904223);
    return (seed >> 8) % below;
}

typedef struct {
    uint32_t after_us;
    uint32_t what, which, much;
} deed;

static deed any_deed(void)
{
    static const uint32_t spans[] = {1, 100, 20 * MS, 500 * MS, 3 * S, 12 * S};
    return (deed){1 + chance(spans[chance(6)]), chance(16), chance(16), chance(UINT32_C(1) << 20)};
}

static void host(const deed *d)
{
    static const char trio[] = "cChwHWSxyzAR\x03Q", mpc[] = "UKCIHYNMSLF\x03qA";
    uint8_t frame[14] = {(uint8_t)(b.c.kind == DR_TRIO ? trio : mpc)[d->which % 14]};
    dr_command command;
    size_t count = 1;
    if (dr_command_find((dr_kind)b.c.kind, b.c.firmware, frame[0], &command))
        count += command.args;
    for (size_t i = 1; i < count; i++)
        frame[i] = (uint8_t)(command.args <= 1  ? d->much % 95
                             : (i + 3) % 4 == 2 ? d->much % 4
                             : (i + 3) % 4 == 3 ? 0
                                                : d->much);
    dr_panel_settle(&b.p, b.clock);
    dr_controller_push(&b.c, b.clock, frame, count);
}

static void act(const deed *d)
{
    uint8_t bytes[64];
    const dr_us clock = b.clock;
    if (d->what < 4)
        (void)dr_panel_press(&b.p, clock, (dr_button)(d->which % DR_BUTTONS));
    else if (d->what < 8)
        (void)dr_panel_release(&b.p, clock, (dr_button)(d->which % DR_BUTTONS));
    else if (d->what < 11)
        (void)dr_panel_turn(&b.p, clock, (dr_knob)(d->which % DR_KNOBS), (int16_t)(d->much % 4001 - 2000u));
    else if (d->what < 13)
        host(d);
    else if (d->what == 13)
        (void)dr_panel_switch(&b.p, (dr_switches)(d->which % 4), (uint8_t)(d->much % 5), (uint8_t)(d->much / 8 % 9),
                              d->much & 64);
    else if (d->what == 14 && d->which == 0)
        dr_panel_power(&b.p, clock, d->much % 4 > 0);
    dr_panel_settle(&b.p, clock);
    (void)dr_controller_pull(&b.c, clock, bytes, sizeof bytes);
}

/* Where the life of a controller that is visited at every due instant, and at others, would differ from one that is not. */
typedef struct {
    dr_look look;
    uint8_t state, active, ready;
    uint16_t lost, kept;
    uint32_t at[DR_PORTS][DR_AXES], home[DR_AXES], work[DR_PORTS][DR_AXES];
    dr_note notes[64];
    uint16_t count;
} life;

static void look_at(life *out)
{
    *out = (life){.state = b.c.state, .active = b.c.active, .ready = (uint8_t)dr_controller_ready(&b.c)};
    dr_panel_look(&b.p, b.clock, &out->look);
    out->lost = b.c.lost_bytes;
    out->kept = b.c.kept_bytes;
    for (uint8_t axis = 0; axis < DR_AXES; axis++) {
        out->home[axis] = b.c.home_steps[axis];
        for (uint8_t drive = 0; drive < b.c.drive_count; drive++)
            out->work[drive][axis] = b.drives[drive].work_steps[axis];
    }
    for (uint8_t drive = 0; drive < b.c.drive_count; drive++) {
        dr_stage stage = {0, 1, 0, 0, {0, 0, 0}};
        (void)dr_stage_get((dr_stage_id)b.drives[drive].stage, &stage);
        dr_controller_position(&b.c, drive, b.clock, out->at[drive]);
        for (uint8_t axis = 0; axis < DR_AXES; axis++)
            TEST_ASSERT_LESS_OR_EQUAL_UINT32(stage.travel_steps[axis], out->at[drive][axis]);
    }
    while (dr_notes_take(&b.notes, &out->notes[out->count]))
        out->count++;
}

static void expect_equal(const life *often, const life *seldom)
{
    TEST_ASSERT_EQUAL(often->state, seldom->state);
    TEST_ASSERT_EQUAL(often->active, seldom->active);
    TEST_ASSERT_EQUAL(often->ready, seldom->ready);
    TEST_ASSERT_EQUAL(often->lost, seldom->lost);
    TEST_ASSERT_EQUAL(often->kept, seldom->kept);
    TEST_ASSERT_EQUAL(often->look.screen, seldom->look.screen);
    TEST_ASSERT_EQUAL(often->look.moving, seldom->look.moving);
    TEST_ASSERT_EQUAL(often->look.is_locked, seldom->look.is_locked);
    TEST_ASSERT_EQUAL(often->look.is_setting_angle, seldom->look.is_setting_angle);
    TEST_ASSERT_EQUAL(often->look.beeps, seldom->look.beeps);
    TEST_ASSERT_EQUAL(often->look.speed, seldom->look.speed);
    TEST_ASSERT_EQUAL(often->look.angle, seldom->look.angle);
    TEST_ASSERT_EQUAL_INT32_ARRAY(often->look.quanta, seldom->look.quanta, 3);
    TEST_ASSERT_EQUAL_INT32(often->look.along_quanta, seldom->look.along_quanta);
    TEST_ASSERT_EQUAL_UINT32_ARRAY(often->home, seldom->home, 3);
    TEST_ASSERT_EQUAL_UINT32_ARRAY(often->work[0], seldom->work[0], DR_PORTS * DR_AXES);
    TEST_ASSERT_EQUAL_UINT32_ARRAY(often->at[0], seldom->at[0], DR_PORTS * DR_AXES);
    TEST_ASSERT_EQUAL(often->count, seldom->count);
    for (uint16_t i = 0; i < often->count; i++) {
        TEST_ASSERT_EQUAL(often->notes[i].what, seldom->notes[i].what);
        TEST_ASSERT_EQUAL_UINT32(often->notes[i].when, seldom->notes[i].when);
        TEST_ASSERT_EQUAL_UINT32(often->notes[i].value, seldom->notes[i].value);
        TEST_ASSERT_EQUAL_UINT32_ARRAY(often->notes[i].steps, seldom->notes[i].steps, 3);
    }
}

static void visit_until(dr_us until)
{
    const uint32_t kept_seed = seed;
    for (unsigned visits = 0; visits < 8 && dr_us_before(b.clock, until); visits++) {
        dr_us when;
        b.clock += chance(until - b.clock);
        dr_panel_settle(&b.p, b.clock);
        if (dr_panel_due(&b.p, &when))
            TEST_ASSERT_TRUE(dr_us_before(b.clock, when)); /* all that was due is done */
        if (dr_controller_due(&b.c, &when))
            TEST_ASSERT_TRUE(dr_us_before(b.clock, when));
    }
    seed = kept_seed; /* both benches live through the same deeds */
}

/* Benches point into themselves, so the two lives are lived one after the other and compared. */
static void live(dr_kind kind, uint32_t first_seed, unsigned deeds, bool often, life *lives)
{
    seed = first_seed;
    bench_set_up(kind);
    b.drives[2].stage = kind == DR_TRIO ? DR_STAGE_NONE : DR_STAGE_MPC_MP865;
    if (chance(4) == 0)
        b.c.quirks =
            (uint16_t)(chance(256) & ~(uint32_t)DR_QUIRK_STREAM_AT_POWER_UP); /* who comes late misses frames */
    bench_start();
    for (unsigned i = 0; i < deeds; i++) {
        const deed d = any_deed();
        const dr_us until = b.clock + d.after_us;
        if (often)
            visit_until(until);
        b.clock = until;
        act(&d);
        look_at(&lives[i]);
    }
}

enum { DEEDS = 100 };
static life lives[2][DEEDS];

static void live_twice(dr_kind kind)
{
    for (uint32_t life_seed = 1; life_seed <= 150; life_seed++) {
        live(kind, life_seed, DEEDS, true, lives[0]);
        live(kind, life_seed, DEEDS, false, lives[1]);
        for (unsigned i = 0; i < DEEDS; i++)
            expect_equal(&lives[0][i], &lives[1][i]);
    }
}

static void a_trio_lives_the_same_however_often_it_is_visited(void) { live_twice(DR_TRIO); }
static void an_mpc_lives_the_same_however_often_it_is_visited(void) { live_twice(DR_MPC); }

/* In whole numbers of 64 bits: the exact place in 1/32768 of a microstep, X by cos and Z by sin; where one of them would leave
 * its travel, both stand [P]. */
static int64_t farthest(int64_t at, int64_t share, bool forward, uint32_t travel_steps, int64_t steps)
{
    const int64_t room = forward ? ((int64_t)travel_steps + 1) * 32768 - 1 - at : at;
    return share > 0 && room / share < steps ? room / share : steps;
}

static void any_turn_along_any_angle_is_exact(void)
{
    seed = 1;
    for (unsigned deg = 0; deg <= 90; deg++) {
        const dr_diagonal along = dr_angle_get((uint8_t)deg);
        bench_set_up(DR_TRIO);
        dr_drive_init(&b.drives[0], DR_STAGE_TRIO_MP865);
        b.c.angle_deg = (uint8_t)deg;
        bench_start();
        dr_stage stage;
        TEST_ASSERT_TRUE(dr_stage_get(DR_STAGE_TRIO_MP865, &stage));
        int64_t x = (int64_t)b.drives[0].position_steps[DR_X] * 32768 + 16384;
        int64_t z = (int64_t)b.drives[0].position_steps[DR_Z] * 32768 + 16384;
        for (unsigned turn = 0, speed = 0; turn < 100; turn++) {
            static const uint32_t detents[] = {2, 20, 2000, 30001};
            const bool forward = chance(2) == 0;
            const uint32_t count = chance(detents[chance(4)]);
            const int64_t steps = (int64_t)count * (64 >> 2 * speed);
            int64_t way = farthest(x, along.cos, forward, stage.travel_steps[DR_X], steps);
            way = farthest(z, along.sin, forward, stage.travel_steps[DR_Z], way);
            x += (forward ? way : -way) * along.cos;
            z += (forward ? way : -way) * along.sin;
            bench_turn(DR_KNOB_D, forward ? (int)count : -(int)count);
            bench_expect_at((uint32_t)(x / 32768), b.drives[0].position_steps[DR_Y], (uint32_t)(z / 32768));
            if (chance(10) == 0) {
                bench_tap(DR_BUTTON_SPEED);
                speed = (speed + 1) % 4;
            }
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN(a_trio_lives_the_same_however_often_it_is_visited);
    RUN(an_mpc_lives_the_same_however_often_it_is_visited);
    RUN(any_turn_along_any_angle_is_exact);
    return UNITY_END();
}
