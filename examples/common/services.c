#define _POSIX_C_SOURCE 200809L // clock_gettime, isatty

#include "services.h"

#include <stdio.h>
#include <time.h>
#include <unistd.h>

#include "threads.h"

static void parallel_for(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end),
                         void *context)
{
    threads_parallel_for(((const services *)user)->threads, count, task, context);
}

static int is_shown(const services *s)
{
    return s->what && isatty(STDERR_FILENO);
}

void services_end_progress(const services *s)
{
    if (is_shown(s))
    {
        fprintf(stderr, "\r%40s\r", "");
        fflush(stderr);
    }
}

static int progress(void *user, double fraction)
{
    services *const s = user;
    const int percent = (int)(100.0 * fraction);
    if (is_shown(s) && percent != s->last_percent)
    {
        services_end_progress(s);
        if (percent < 100)
        {
            fprintf(stderr, "%s: %d %% ", s->what, percent);
            fflush(stderr);
        }
        s->last_percent = percent;
    }
    return 0;
}

sss_hooks services_hooks(services *s)
{
    const sss_hooks hooks = {.user = s, .parallel_for = parallel_for, .progress = progress};
    s->last_percent = -1;
    return hooks;
}

double services_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
