// A source file may include the headers for their declarations first, and again with SSS_X_IMPLEMENTATION, as happens
// where another header has included them; and once more.

#include "../sss_atlas.h"
#include "../sss_bem.h"
#include "../sss_dipole.h"

#if !defined(SSS_DIPOLE_VERSION) || !defined(SSS_BEM_VERSION) || !defined(SSS_ATLAS_VERSION)
#error "a version is missing"
#endif
#if defined(SSS_DIPOLE_IMPLEMENTED) || defined(SSS_BEM_IMPLEMENTED) || defined(SSS_ATLAS_IMPLEMENTED)
#error "declarations only, and yet an implementation is here"
#endif

#include "../sss_atlas.h"
#include "../sss_bem.h"
#include "../sss_dipole.h"

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"

#define SSS_BEM_IMPLEMENTATION
#include "../sss_bem.h"

#define SSS_ATLAS_IMPLEMENTATION
#include "../sss_atlas.h"

#if !defined(SSS_DIPOLE_IMPLEMENTED) || !defined(SSS_BEM_IMPLEMENTED) || !defined(SSS_ATLAS_IMPLEMENTED)
#error "the implementation does not come once the declarations have been included"
#endif

#include "../sss_atlas.h"
#include "../sss_bem.h"
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
    // A cube's face seen from its middle, without absorption: a sixth of 4 pi.
    static const double corners[12] = {-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0};
    static const double source[3] = {0.0, 0.0, 1.0};
    CHECK(SSS_BEM_VERSION >= 100);
    CHECK_REL(sss_bem_form_factor(corners, 4, source, 1.0, 0.0), 2.0943951023931953, 1e-12);
    CHECK(SSS_ATLAS_VERSION >= 100 && sss_atlas_glsl(SSS_ATLAS_GLSL_PLACE) != NULL);
    sss_atlas_free(NULL);
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
    const sss_bem_options bem_options = {0};
    const sss_bem_taylor taylor = {0};
    const sss_atlas_options atlas_options = {0};
    CHECK(hooks.allocate == NULL && mesh.positions == NULL && points.areas == NULL && receivers.count == 0);
    CHECK_EQUAL(light.kind, SSS_DIPOLE_LIGHT_DIRECTIONAL);
    CHECK_EQUAL(irradiance_options.elements, SSS_DIPOLE_VERTICES);
    CHECK_EQUAL(gather_options.geometry, SSS_DIPOLE_DISTANCE);
    CHECK_EQUAL(gather_options.path, SSS_DIPOLE_PATH_AUTO);
    CHECK(scene.tolerance == 0.0 && bem_options.tolerance == 0.0 && bem_options.guard == 0.0 && taylor.samples == 0);
    CHECK_EQUAL(bem_options.oracle, SSS_BEM_ORACLE_CONTRIBUTION);
    CHECK_EQUAL(bem_options.path, SSS_BEM_PATH_AUTO);
    CHECK_EQUAL(atlas_options.method, SSS_ATLAS_ORTHOGRAPHIC);
    CHECK(atlas_options.size == 0 && atlas_options.border == 0 && atlas_options.texels_per_mm == 0.0);
}

int main(int argc, char **argv)
{
    static const test_case tests[] = {TEST(declarations_first_then_the_implementation),
                                      TEST(zeroed_structs_are_defaults)};
    return test_main(argc, argv, "headers included twice", tests, sizeof tests / sizeof *tests);
}
