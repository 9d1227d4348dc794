// Profiles of the materials by name, for programs that hold the implementation of sss_dipole.h.

#ifndef SSS_TESTS_PROFILES_H
#define SSS_TESTS_PROFILES_H

#include "../../sss_dipole.h"

#include <math.h>

// A profile that no check can take for a good one, if it could not be made.
static inline sss_profile failed_profile(void)
{
    sss_profile profile;
    for (int c = 0; c < 3; ++c)
        profile.alpha_p[c] = profile.sigma_tr[c] = profile.z_r[c] = profile.z_v[c] = (double)NAN;
    profile.eta = profile.F_internal = profile.F_external = (double)NAN;
    return profile;
}

static inline sss_profile profile_of(const char *name)
{
    sss_dipole_material material;
    sss_profile profile;
    if (sss_dipole_material_by_name(name, &material) != SSS_OK ||
        sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &profile) != SSS_OK)
        return failed_profile();
    return profile;
}

#endif
