/* From reset to main. */
#include "semihosting.h"

#include <stddef.h>
#include <stdint.h>

extern uint32_t data_begin[], data_end[], bss_begin[], bss_end[], stack_top[];
extern const uint32_t data_stored[];

int main(void);

void start(void)
{
    /* The floating-point unit is off after reset: full access to coprocessors 10 and 11. */
    volatile uint32_t *const coprocessor_access = (volatile uint32_t *)0xe000ed88;
    *coprocessor_access |= 0xfu << 20;
    __asm__ volatile("dsb\n isb" ::: "memory");
    const uint32_t *from = data_stored;
    for (uint32_t *to = data_begin; to < data_end;) *to++ = *from++;
    for (uint32_t *to = bss_begin; to < bss_end;) *to++ = 0;
    end_with(main());
}

/* A fault ends the program: on a robot, the safe action. */
static void fault(void)
{
    end_with(2);
}

/* What the processor reads at reset: stack, start, then the handlers of faults and system calls. */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*handlers[15])(void);
} vectors = {
    stack_top,
    {start, fault, fault, fault, fault, fault, NULL, NULL, NULL, NULL, fault, fault, NULL, fault, fault},
};
