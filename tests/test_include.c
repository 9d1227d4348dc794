// A source file may include the header for its declarations first, and again with SSS_DIPOLE_IMPLEMENTATION, as happens
// where another header has included it; and once more.

#include "../sss_dipole.h"

#ifndef SSS_DIPOLE_VERSION
#error "SSS_DIPOLE_VERSION is missing"
#endif
#ifdef SSS_DIPOLE_IMPLEMENTED
#error "declarations only, and yet the implementation is here"
#endif

#include "../sss_dipole.h"

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"

#ifndef SSS_DIPOLE_IMPLEMENTED
#error "the implementation does not come once the declarations have been included"
#endif

#include "../sss_dipole.h"

#include "common/test.h"

static void declarations_first_then_the_implementation(void)
{   // Oracle: Jensen et al. 2001, marble, and the linker, which finds each function once.
    sss_dipole_material marble;
    sss_profile profile;
    CHECK(SSS_DIPOLE_VERSION >= 100);
    CHECK_EQUAL(sss_dipole_material_by_name("Marble", &marble), SSS_OK);
    CHECK(marble.sigma_s[0] == 2.19 && marble.eta == 1.5);
    CHECK_EQUAL(sss_dipole_profile(&marble, SSS_DIPOLE_FRESNEL_EXACT, &profile), SSS_OK);
    CHECK_REL(sss_dipole_total(&profile, 0), 0.8303, 1e-4);
}

static void zeroed_structs_are_defaults(void)
{   // Oracle: the promise that zero means the default. = {0} must compile for every struct that a caller fills.
    const sss_hooks hooks = {0};
    const sss_mesh mesh = {0};
    const sss_dipole_light light = {0};
    const sss_dipole_irradiance_options irradiance_options = {0};
    const sss_dipole_gather_options gather_options = {0};
    const sss_dipole_points points = {0};
    const sss_dipole_receivers receivers = {0};
    const sss_dipole_scene scene = {0};
    CHECK(hooks.allocate == NULL && mesh.positions == NULL && points.areas == NULL && receivers.count == 0);
    CHECK_EQUAL(light.kind, SSS_DIPOLE_LIGHT_DIRECTIONAL);
    CHECK_EQUAL(irradiance_options.elements, SSS_DIPOLE_VERTICES);
    CHECK_EQUAL(gather_options.geometry, SSS_DIPOLE_DISTANCE);
    CHECK_EQUAL(gather_options.path, SSS_DIPOLE_PATH_AUTO);
    CHECK(scene.tolerance == 0.0);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(declarations_first_then_the_implementation),
                                      TEST(zeroed_structs_are_defaults)};
    return test_main(argc, argv, "sss_dipole.h included twice", tests, sizeof tests / sizeof *tests);
}
