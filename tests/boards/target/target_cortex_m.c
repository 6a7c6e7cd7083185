#include "target.h"

#include <stdbool.h>
#include <stddef.h>

#include "startup.h" /* dr_fault */

#define REGISTER(address) (*(volatile uint32_t *)(uintptr_t)(address))
#define SYSTICK_CONTROL REGISTER(0xE000E010u)
#define SYSTICK_RELOAD REGISTER(0xE000E014u)
#define SYSTICK_VALUE REGISTER(0xE000E018u)

/* -- Semihosting: QEMU carries it out ------------------------------------------------------------------------------ */

enum { SYS_WRITE0 = 0x04, SYS_EXIT_EXTENDED = 0x20, APPLICATION_EXIT = 0x20026 };

static void semihosting(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

static char line[256];
static size_t length;

static void flush(void)
{
    line[length] = '\0';
    semihosting(SYS_WRITE0, line);
    length = 0;
}

void target_put(int character)
{
    line[length++] = (char)character;
    if (character == '\n' || length == sizeof line - 1)
        flush();
}

static void finish(int status)
{
    const uint32_t how[2] = {APPLICATION_EXIT, (uint32_t)status};
    flush();
    semihosting(SYS_EXIT_EXTENDED, how);
}

void dr_fault(void)
{
    target_say("fault\n");
    finish(99);
}

/* -- Work ---------------------------------------------------------------------------------------------------------- */

/* QEMU with -icount shift=10 takes 1,024 ns for an instruction, which are 25.6 ticks of 25 MHz. */
uint32_t target_work(void)
{
    static uint32_t looked = 0xFFFFFFu;
    static uint64_t ticks;
    const uint32_t now = SYSTICK_VALUE;
    ticks += (looked - now) & 0xFFFFFFu;
    looked = now;
    return (uint32_t)(ticks * 10u / 256u);
}

/* -- What newlib asks for ------------------------------------------------------------------------------------------ */

extern char end_of_data __asm__("end");
void *_sbrk(ptrdiff_t size);
void *_sbrk(ptrdiff_t size)
{
    static char *top = &end_of_data;
    char *const before = top;
    top += size;
    return before;
}
int _write(int file, const char *text, int count);
int _write(int file, const char *text, int count)
{
    (void)file;
    for (int i = 0; i < count; i++)
        target_put(text[i]);
    return count;
}
int _read(int file, char *text, int count);
int _read(int file, char *text, int count)
{
    (void)file;
    (void)text;
    (void)count;
    return 0;
}
int _close(int file);
int _close(int file)
{
    (void)file;
    return -1;
}
int _lseek(int file, int offset, int from);
int _lseek(int file, int offset, int from)
{
    (void)file;
    (void)offset;
    (void)from;
    return 0;
}
int _fstat(int file, void *status);
int _fstat(int file, void *status)
{
    (void)file;
    (void)status;
    return -1;
}
int _isatty(int file);
int _isatty(int file) { return file >= 0; }
int _kill(int process, int signal);
int _kill(int process, int signal)
{
    (void)process;
    (void)signal;
    finish(98);
    return 0;
}
int _getpid(void);
int _getpid(void) { return 1; }
void _exit(int status);
void _exit(int status)
{
    finish(status);
    for (;;) {}
}

int main(void)
{
    SYSTICK_RELOAD = 0xFFFFFFu;
    SYSTICK_VALUE = 0;
    SYSTICK_CONTROL = 5u; /* on, the processor's clock, no interrupt */
    finish(target_main());
    return 0;
}
