// A parallel_for on POSIX threads, in the form that sss_hooks wants.
#ifndef EXAMPLES_THREADS_H
#define EXAMPLES_THREADS_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

// How many processors this machine offers, at least 1.
int threads_available(void);

// Calls task on ranges that cover [0, count) once each, on thread_count threads (this one included), and returns
// when all are done. Where the system refuses a thread the others do its share.
void threads_parallel_for(int thread_count, size_t count, void (*task)(void *context, size_t begin, size_t end),
                          void *context);

// The same as sss_hooks.parallel_for: user points to the thread_count (int), or is NULL for all processors.
void threads_hook(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end), void *context);

#ifdef __cplusplus
}
#endif

#endif
