// The guard that sss_bem.h takes when it is asked for none, for references that must have the same.

#ifndef SSS_TESTS_DEFAULT_GUARD_H
#define SSS_TESTS_DEFAULT_GUARD_H

#include "../../sss_bem.h"

#include <math.h>
#include <string.h>

// NaN on failure.
static inline double default_guard(void)
{
    static const float positions[9] = {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f};
    static const uint32_t triangle[3] = {0, 1, 2};
    const sss_mesh mesh = {positions, NULL, triangle, 3, 1, 1.0};
    sss_profile profile;
    sss_bem_stats stats;
    sss_bem *bem = NULL;
    memset(&profile, 0, sizeof profile);
    for (int k = 0; k < 3; ++k)
    {
        profile.alpha_p[k] = 0.5;
        profile.sigma_tr[k] = profile.z_r[k] = 1.0;
        profile.z_v[k] = 2.0;
    }
    profile.eta = 1.0;
    const int failed = sss_bem_create(&mesh, &profile, NULL, NULL, &bem) != SSS_OK ||
                       sss_bem_get_stats(bem, &stats) != SSS_OK;
    sss_bem_free(bem);
    return failed ? (double)NAN : stats.guard;
}

#endif
