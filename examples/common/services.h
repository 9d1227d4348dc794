// What programs hand to the library while it works: threads, and progress on a terminal; and a clock.
#ifndef EXAMPLES_SERVICES_H
#define EXAMPLES_SERVICES_H

#include "../../sss_dipole.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct services
{
    int threads;
    const char *what;  // is going on, before a progress in per cent where stderr is a terminal; NULL: silent
    int last_percent;  // shown
} services;

// Hooks that use s, which has to stay where it is.
sss_hooks services_hooks(services *s);

// Wipes a progress that stands in the terminal's line.
void services_end_progress(const services *s);

// Seconds on a clock that only runs forward.
double services_seconds(void);

#ifdef __cplusplus
}
#endif

#endif
