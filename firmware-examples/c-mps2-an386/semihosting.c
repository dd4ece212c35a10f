/* Semihosting by the break point that Arm reserves for it; without an emulator or a debugger it is a fault. */
#include "semihosting.h"

enum { WRITE0 = 0x04, EXIT_EXTENDED = 0x20, APPLICATION_EXIT = 0x20026 };

static void call(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

void print(const char *text)
{
    call(WRITE0, text);
}

void print_word(uint32_t word)
{
    char text[10] = " ";
    for (int k = 8; k > 0; k--, word >>= 4) text[k] = "0123456789abcdef"[word & 15];
    print(text);
}

_Noreturn void end_with(int status)
{
    const uint32_t block[2] = {APPLICATION_EXIT, (uint32_t)status};
    for (;;) call(EXIT_EXTENDED, block);
}
