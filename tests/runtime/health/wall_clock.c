// The wall clock of a program, moved by the nanoseconds that the file WALL_STEP begins with.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <time.h>

static const volatile int64_t *step_ns;

__attribute__((constructor)) static void open_step(void) {
    static const int64_t none = 0;
    int fd = open(getenv("WALL_STEP"), O_RDONLY | O_CLOEXEC);
    void *memory = mmap(0, sizeof none, PROT_READ, MAP_SHARED, fd, 0);
    step_ns = memory == MAP_FAILED ? &none : memory;
}

int clock_gettime(clockid_t clock, struct timespec *now) {
    static int (*ask)(clockid_t, struct timespec *);
    if (!ask) ask = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
    int failed = ask(clock, now);
    if (!failed && clock == CLOCK_REALTIME && step_ns) {
        int64_t total = now->tv_sec * INT64_C(1000000000) + now->tv_nsec + *step_ns;
        now->tv_sec = total / 1000000000;
        now->tv_nsec = total % 1000000000;
    }
    return failed;
}
