#define _POSIX_C_SOURCE 200809L // sysconf

#include "threads.h"

#include <pthread.h>
#include <unistd.h>

enum
{
    MAX_THREADS = 256,
    // Ranges handed out per thread: enough that a slow range does not leave the other threads idle at the end.
    RANGES_PER_THREAD = 16
};

typedef struct work
{
    pthread_mutex_t lock;
    size_t next, count, step;
    void (*task)(void *context, size_t begin, size_t end);
    void *context;
} work;

int threads_available(void)
{
    const long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count < 1 ? 1 : count > MAX_THREADS ? MAX_THREADS : (int)count;
}

static void *take_ranges(void *argument)
{
    work *const shared = argument;
    for (;;)
    {
        pthread_mutex_lock(&shared->lock);
        const size_t begin = shared->next;
        const size_t end = shared->count - begin < shared->step ? shared->count : begin + shared->step;
        shared->next = end;
        pthread_mutex_unlock(&shared->lock);
        if (begin == end)
        {
            return NULL;
        }
        shared->task(shared->context, begin, end);
    }
}

void threads_parallel_for(int thread_count, size_t count, void (*task)(void *context, size_t begin, size_t end),
                          void *context)
{
    const int wanted = thread_count < 1 ? 1 : thread_count > MAX_THREADS ? MAX_THREADS : thread_count;
    work shared = {.count = count, .task = task, .context = context};
    shared.step = count / ((size_t)wanted * RANGES_PER_THREAD) + 1;
    if (pthread_mutex_init(&shared.lock, NULL) != 0)
    {
        task(context, 0, count);
        return;
    }
    pthread_t threads[MAX_THREADS];
    int started = 0;
    while (started < wanted - 1 && pthread_create(&threads[started], NULL, take_ranges, &shared) == 0)
    {
        ++started;
    }
    take_ranges(&shared);
    for (int i = 0; i < started; ++i)
    {
        pthread_join(threads[i], NULL);
    }
    pthread_mutex_destroy(&shared.lock);
}

void threads_hook(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end), void *context)
{
    threads_parallel_for(user ? *(const int *)user : threads_available(), count, task, context);
}
