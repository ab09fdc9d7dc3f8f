/* Calls to the debugger that qemu plays: write a text, leave with a code. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

static inline uint32_t host_call(uint32_t operation, const void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static inline void host_write(const char *text)
{
    (void)host_call(0x04u, text); /* SYS_WRITE0 */
}

static inline void host_exit(int code)
{
    const uint32_t reason[2] = {0x20026u, (uint32_t)code}; /* ADP_Stopped_ApplicationExit */
    (void)host_call(0x20u, reason);                         /* SYS_EXIT_EXTENDED */
    for (;;) {
    }
}

#endif
