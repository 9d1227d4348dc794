// The cases of the chart: mesh x size x material x light, by name. Whoever measures, computes truth or chooses a method
// takes them from here.
//
// A light is white, as strong as 1 W/mm^2 on a plane that faces it, and casts no shadows: E = F_t max(0, n.w), with the
// mesh's own vertex normals, linear over triangles. The one exception is what its name says: `edge` is masked to one
// side of a plane, as by a screen, so that a hard edge of shadow runs across the surface.

#ifndef SSS_TESTS_CHART_CASES_H
#define SSS_TESTS_CHART_CASES_H

#include "../../sss_dipole.h"
#include "../common/meshes.h"

#include <stddef.h>

// A line of the list. What it is called elsewhere: mesh-material-size-light in small letters, as in chart_case_name.
typedef struct chart_entry
{
    const char *mesh;     // chart_mesh knows it
    const char *material; // of sss_dipole_material_by_name
    double size_mm;       // largest extent along an axis
    const char *light;    // chart_light knows it
} chart_entry;

enum
{
    CHART_LEFT_OUT = -1, // instead of 0: not for this case, or the mesh is not there; no failure
    CHART_NAME_SIZE = 96
};

// The list; NULL behind its end.
size_t chart_entry_count(void);
const chart_entry *chart_entry_at(size_t index);

// "bunny-marble-50-front".
void chart_entry_name(const chart_entry *entry, char name[CHART_NAME_SIZE]);

// By name; NULL where there is none.
const chart_entry *chart_entry_by_name(const char *name);

// A lit object, built from an entry or by somebody else (bake --chart).
typedef struct chart_case
{
    char name[CHART_NAME_SIZE]; // the entry's, "-thinned" behind it where it is
    const char *mesh_name, *material_name, *light_name;
    double size_mm;
    mesh_data mesh;           // as loaded; owned
    sss_mesh view;            // of it, with its scale
    sss_profile profile;
    sss_dipole_material material;
    sss_dipole_light *lights; // [light_count] directional ones and environments of bands 0 and 1; owned
    size_t light_count;
    int edge;                 // 1: lit only where edge_plane . (x, y, z, 1) > 0, x in the mesh's units; else 0 there
    double edge_plane[4];
    float *irradiance;        // [V][3], at the vertices of `mesh`; owned
} chart_case;

// Meshes: bunny, dragon (dragon_res2), leaf (a bent closed shell, thin as an ear), slab (1 x 1 x 1/10), sphere, cube;
// triangles face outward. thin: about so many times fewer triangles, for a quick look; 1: none.
// Returns 0, CHART_LEFT_OUT where a model is not there, or 1 with *out zeroed.
int chart_mesh(const char *name, double thin, mesh_data *out);

// Lights: front, side, behind, environment (brighter above), edge (front, masked). Sets lights, light_count, edge and
// edge_plane of a case that has its mesh. Returns 0, or 1 for an unknown name or where memory is short.
int chart_light(const char *name, chart_case *c);

// All of it. Returns 0; CHART_LEFT_OUT where the mesh is not there; 1 on failure; *out is then zeroed.
int chart_case_create(const chart_entry *entry, double thin, chart_case *out);
void chart_case_free(chart_case *c);

// E of the case's lights at the vertices of a mesh in the same place.   irradiance [V][3] of that mesh
// Returns 0, or nonzero.
int chart_irradiance(const chart_case *c, const sss_mesh *mesh, float *irradiance);

#endif
