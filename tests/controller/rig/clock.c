/* A faster clock: with this library preloaded a process sees time pass RIG_SPEED times as fast as it does. Every process
 * of a run counts from the same moment, RIG_REALTIME_NS and RIG_MONOTONIC_NS. */
#define _GNU_SOURCE
#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/select.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define NS_PER_S 1000000000LL

static double speed = 1.0;
static long long realtime_start, monotonic_start;

static struct timespec timespec_of(long long ns)
{
    struct timespec t = {ns / NS_PER_S, ns % NS_PER_S};
    return t;
}

static long long ns_of(const struct timespec *t)
{
    return t->tv_sec * NS_PER_S + t->tv_nsec;
}

static long long seen(clockid_t clock)
{
    struct timespec t;
    syscall(SYS_clock_gettime, clock, &t);
    if (clock != CLOCK_REALTIME && clock != CLOCK_MONOTONIC)
        return ns_of(&t);
    long long start = clock == CLOCK_REALTIME ? realtime_start : monotonic_start;
    return start + (long long)((double)(ns_of(&t) - start) * speed);
}

static void __attribute__((constructor)) set_up(void)
{
    const char *factor = getenv("RIG_SPEED"), *realtime = getenv("RIG_REALTIME_NS"), *monotonic = getenv("RIG_MONOTONIC_NS");
    if (factor && realtime && monotonic) {
        speed = atof(factor);
        realtime_start = atoll(realtime);
        monotonic_start = atoll(monotonic);
    }
}

static int sleep_seen(long long ns)
{
    if (ns <= 0)
        return 0;
    struct timespec t = timespec_of((long long)((double)ns / speed));
    return syscall(SYS_clock_nanosleep, CLOCK_MONOTONIC, 0, &t, NULL) == 0 ? 0 : errno;
}

int clock_gettime(clockid_t clock, struct timespec *t)
{
    *t = timespec_of(seen(clock));
    return 0;
}

int gettimeofday(struct timeval *restrict t, void *restrict zone)
{
    (void)zone;
    long long ns = seen(CLOCK_REALTIME);
    t->tv_sec = ns / NS_PER_S;
    t->tv_usec = ns % NS_PER_S / 1000;
    return 0;
}

int clock_nanosleep(clockid_t clock, int flags, const struct timespec *wanted, struct timespec *left)
{
    if (left)
        *left = timespec_of(0);
    return sleep_seen(ns_of(wanted) - (flags & TIMER_ABSTIME ? seen(clock) : 0));
}

int nanosleep(const struct timespec *wanted, struct timespec *left)
{
    int error = clock_nanosleep(CLOCK_MONOTONIC, 0, wanted, left);
    if (error)
        errno = error;
    return error ? -1 : 0;
}

int usleep(useconds_t us)
{
    return nanosleep(&(struct timespec){us / 1000000, us % 1000000 * 1000L}, NULL);
}

int select(int count, fd_set *restrict read, fd_set *restrict write, fd_set *restrict except, struct timeval *restrict wait)
{
    struct timespec t, *timeout = NULL;
    if (wait) {
        t = timespec_of((long long)((double)(wait->tv_sec * NS_PER_S + wait->tv_usec * 1000LL) / speed));
        timeout = &t;
    }
    return syscall(SYS_pselect6, count, read, write, except, timeout, NULL);
}
