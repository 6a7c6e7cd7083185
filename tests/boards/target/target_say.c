#include "target.h"

void target_say(const char *text)
{
    while (*text != '\0')
        target_put(*text++);
}

void target_say_uint(uint32_t value)
{
    char digits[10];
    uint8_t count = 0;
    do {
        digits[count++] = (char)('0' + value % 10u);
        value /= 10u;
    } while (value > 0);
    while (count > 0)
        target_put(digits[--count]);
}

void target_say_hex(uint8_t value)
{
    static const char digits[] = "0123456789abcdef";
    target_put(digits[value >> 4]);
    target_put(digits[value & 15u]);
}
