/* minirom: what the images of the Pico SDK call in the RP2040's boot ROM, for a simulator that comes without one.
 *
 * Layout as in the chip's datasheet, section 2.8.3: at 0x10 the magic number, at 0x14 a table of functions by two letters,
 * at 0x16 one of data, at 0x18 the function that searches them. The two that change the flash are breakpoints: the
 * simulator's side does it (pico_board.mjs). Built for size alone; speed is the simulator's. */
#include <stdint.h>

#define CODE(a, b) ((uint32_t)(a) | (uint32_t)(b) << 8)

static uint32_t population(uint32_t value)
{
    uint32_t count = 0;
    for (; value != 0; value >>= 1)
        count += value & 1u;
    return count;
}

static uint32_t leading_zeros(uint32_t value)
{
    uint32_t count = 0;
    for (; count < 32 && (value & 0x80000000u) == 0; value <<= 1)
        count++;
    return count;
}

static uint32_t trailing_zeros(uint32_t value)
{
    uint32_t count = 0;
    for (; count < 32 && (value & 1u) == 0; value >>= 1)
        count++;
    return count;
}

static uint32_t reversed(uint32_t value)
{
    uint32_t result = 0;
    for (uint32_t bit = 0; bit < 32; bit++, value >>= 1)
        result = result << 1 | (value & 1u);
    return result;
}

/* volatile: the compiler must not make calls of memset() and memcpy() of these. */
static void *fill(void *to, uint32_t value, uint32_t count)
{
    for (volatile uint8_t *at = to; count > 0; count--)
        *at++ = (uint8_t)value;
    return to;
}

static void *copy(void *to, const void *from, uint32_t count)
{
    const uint8_t *source = from;
    for (volatile uint8_t *at = to; count > 0; count--)
        *at++ = *source++;
    return to;
}

static void nothing(void) {}
__attribute__((naked)) static void flash_erase(void) { __asm__("bkpt 1\n bx lr"); }   /* offset, count, ... */
__attribute__((naked)) static void flash_program(void) { __asm__("bkpt 2\n bx lr"); } /* offset, data, count */

static void *search(const uint16_t *table, uint32_t code)
{
    for (; table[0] != 0; table += 2)
        if (table[0] == code)
            return (void *)(uintptr_t)table[1];
    return 0;
}

/* The second boot stage, which the image begins with. */
__attribute__((naked)) static void start(void)
{
    __asm__("movs r0, #0\n mov lr, r0\n ldr r0, =0x10000001\n bx r0\n .pool");
}

typedef struct {
    uint32_t stack;
    void (*reset)(void), (*interrupt)(void), (*fault)(void);
    uint8_t magic[4];
    uint16_t functions, data, search, more;
} head;

typedef struct {
    uint32_t code;
    const void *function;
} entry;

/* The tables hold 16-bit addresses, which a linker cannot write: pico_board.mjs fills them in from this one. */
__attribute__((section(".head"), used))
const head minirom_head = {0x20041F00u, start, nothing, nothing, {'M', 'u', 1, 2}, 0x100, 0x180, 0, 0};

__attribute__((section(".entries"), used)) const entry minirom_entries[] = {
    {CODE('P', '3'), population},  {CODE('L', '3'), leading_zeros}, {CODE('T', '3'), trailing_zeros},
    {CODE('R', '3'), reversed},    {CODE('M', 'S'), fill},          {CODE('S', '4'), fill},
    {CODE('M', 'C'), copy},        {CODE('C', '4'), copy},          {CODE('I', 'F'), nothing},
    {CODE('E', 'X'), nothing},     {CODE('F', 'C'), nothing},       {CODE('C', 'X'), nothing},
    {CODE('R', 'E'), flash_erase}, {CODE('R', 'P'), flash_program}, {0, search},
};
