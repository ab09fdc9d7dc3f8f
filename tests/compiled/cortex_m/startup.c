/* Reset: zero .bss, let the floating point unit run, call main and tell qemu how it ended. Nothing else is needed. */
#include "semihosting.h"

#include <stdint.h>

#define CPACR (*(volatile uint32_t *)0xE000ED88u)

extern uint32_t bss_begin[], bss_end[], stack_top[];
int main(void);
void reset(void);
static void fault(void);

typedef union {
    uint32_t *stack;
    void (*handler)(void);
} vector;

__attribute__((section(".vectors"), used)) static const vector vectors[] = {
    {.stack = stack_top},  {.handler = reset},    {.handler = fault}, {.handler = fault},
    {.handler = fault},    {.handler = fault},    {.handler = fault},
};

void reset(void)
{
    CPACR |= 0xFu << 20;
    __asm__ volatile("dsb\n isb" ::: "memory");
    for (uint32_t *word = bss_begin; word < bss_end; ++word) {
        *word = 0;
    }
    host_exit(main());
}

static void fault(void)
{
    host_write("fault\n");
    host_exit(1);
}
