// Numbers near 0 become 0 from the start of the program on, as in engines that set the processor so.
#if defined(__aarch64__)
#include <cstdint>

__attribute__((constructor)) static void flush_to_zero() {
    uint64_t mode;
    __asm__ volatile("mrs %0, fpcr" : "=r"(mode));
    __asm__ volatile("msr fpcr, %0" : : "r"(mode | uint64_t{1} << 24));
}
#else
#error "flush.cpp is for ARM"
#endif
