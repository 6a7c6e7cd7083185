/* Says what the controller says in a set of scenarios, with virtual time stamps: byte for byte the same on every machine. */
#include "rig.h"
#include "target.h"

static rig r;

static void told(dr_us when, uint8_t byte)
{
    target_say_uint(when);
    target_put(' ');
    target_say_hex(byte);
    target_put('\n');
}

static void say(const char *what)
{
    target_say(what);
    target_put('\n');
}

static void send(const char *bytes, size_t count, dr_us then_us)
{
    rig_send(&r, bytes, count);
    rig_run_us(&r, then_us);
}

#define SEND(bytes, then_us) send(bytes, sizeof(bytes) - 1, then_us)

static void trio(dr_us clock)
{
    rig_begin(&r, DR_TRIO, clock);
    SEND("c", 10000);
    SEND("\xEE\x22\r\n", 1000);
    SEND("H\x40\x9C\0\0\x0D\x03\0\0\xFF\xFF\x01\0", 12000000);
    SEND("c", 10000);
    SEND("A\x3C", 5000);
    SEND("W\x03\0\0\0\x00\x10\x01\0\x55\xAA\0\0", 300000);
    SEND("c\x03", 15000000);
    SEND("S\x07\xFF\xFF\xFF\xFF\x01\x02\x03\0\x03\x02\x01\0", 1234567);
    SEND("\x03", 5000);
    SEND("c", 10000);
    SEND("A\x2D", 5000);
    SEND("h", 30000000);
    SEND("R", 5000000);
    SEND("x\x0D\x0D\0\0y\x0D\x0D\0\0z\x0D\x0D\0\0c", 4000000);
}

static void mpc(dr_us clock, uint8_t diagonal)
{
    rig_begin(&r, DR_MPC, clock);
    r.drives[0].diagonal = diagonal;
    SEND("U", 10000);
    SEND("K", 10000);
    SEND("M\x12\x34\x01\0\x10\x20\x02\0\x0D\x03\x01\0", 4000000);
    SEND("C", 10000);
    SEND("H", 1000001);
    SEND("\x03", 10000);
    SEND("C", 10000);
    SEND("N", 10000000);
    SEND("O", 10000);
    SEND("S", 30000);
    SEND("\x0F\x80\x07\0\0\x03\x01\0\0\xC0\x03\0\0", 200000);
    SEND("S", 30000);
    SEND("\x01\x03\x07\0\0\x0D\x01\0\0\xC0\x13\0\0", 333333);
    SEND("CC\x03", 10000);
    SEND("I\x02", 10000);
    SEND("S", 30000);
    SEND("\x0C\x80\x02\0\0\0\0\0\0\0\0\0\0", 200000);
    SEND("I\x04", 10000);
    SEND("F", 10000);
    SEND("H", 1000000);
    SEND("Y", 1000000);
}

int target_main(void)
{
    r.told = told;
    say("trio");
    trio(0);
    say("trio, the clock wraps");
    trio(UINT32_MAX - UINT32_C(25000000));
    for (uint8_t diagonal = 0; diagonal < 16; diagonal = (uint8_t)(diagonal + 5)) {
        say("mpc");
        mpc(UINT32_MAX - UINT32_C(4321) * diagonal * 100u, diagonal);
    }
    return 0;
}
