// What tests put under sss_hooks: threads, and a ledger of every allocation.

#ifndef SSS_TESTS_HOOKS_H
#define SSS_TESTS_HOOKS_H

#include "../../sss_dipole.h"

#include <stddef.h>

// For hooks.parallel_for: three POSIX threads, uneven pieces, each begun from its end. hooks.user: NULL, or an int that
// counts the calls.
void threads_for(void *user, size_t count, void (*task)(void *, size_t, size_t), void *context);

// The same on one thread: every item alone, in an order that is shuffled. user is not read.
void shuffled_for(void *user, size_t count, void (*task)(void *context, size_t begin, size_t end), void *context);

typedef struct ledger
{
    int calls;   // of allocate
    int fail_at; // the call that gives NULL; -1: none
    int live;    // blocks not yet released
    size_t bytes, peak;
    int progress_calls, cancel_at; // the call that cancels; -1: none
    double last_fraction;
    int fractions_fine, fractions_fell; // all in [0, 1]; calls whose fraction was below that of the call before
} ledger;

// Clears the ledger, into which hooks.allocate and release write, and hooks.progress where it is asked for. Blocks are
// filled with 0xA5: nothing may count on zeroes.
sss_hooks ledger_hooks(ledger *l, int with_progress);

#endif
