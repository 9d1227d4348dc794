// Meshes for tests: made up, loaded, thinned; and what tests measure on them.

#ifndef SSS_TESTS_MESHES_H
#define SSS_TESTS_MESHES_H

#include "../../sss_dipole.h"

#include <stddef.h>
#include <stdint.h>

typedef struct mesh_data
{
    float *positions; // [3 vertex_count]
    float *normals;   // [3 vertex_count], unit length
    uint32_t *triangles;
    size_t vertex_count;
    size_t triangle_count;
} mesh_data;

// All of these return 0, or nonzero with *out zeroed; free with mesh_free.

// Wavefront OBJ: v and f lines, polygons fanned, negative indices; vertices that share a position stay as they are.
int mesh_load_obj(const char *path, mesh_data *out);

// The bunny of Debian's glmark2-data, where it is installed.
int mesh_load_bunny(mesh_data *out);

// One triangle primitive of a binary glTF: float positions, indices of 16 or 32 bits; normals computed. For the models
// that come with the project and for what gltfpack writes, not for files in general (examples/common/model.h).
int mesh_load_glb(const char *path, mesh_data *out);

// Stanford's PLY in ASCII: x y z first among a vertex's numbers, faces of three corners.
int mesh_load_ply(const char *path, mesh_data *out);

// A model by name: "bunny"; else NAME.glb or NAME.ply in $SSS_MODELS, build/models or ../shared/models.
int mesh_load_model(const char *name, mesh_data *out);

// A square of the given side around the origin in z = 0, facing +z, n x n cells of two triangles each.
int mesh_grid(int n, double side, mesh_data *out);

// A rectangle [x0,x1] x [y0,y1] in z = 0 as two triangles, facing +z.
int mesh_rectangle(double x0, double x1, double y0, double y1, mesh_data *out);

// An octahedron whose triangles are split in four `levels` times and pushed out to the radius: 8 * 4^levels triangles.
int mesh_sphere(int levels, double radius, mesh_data *out);

// Every triangle cut into four at the middles of its edges, which triangles share where they share the edge.
int mesh_refine(const mesh_data *in, mesh_data *out);

// A sheet (x(s, t), y(s, t), z(s, t)), (s, t) in [0, 1]^2, of n x m cells; facing s x t.
int mesh_sheet(int n, int m, void (*point)(double s, double t, double out[3]), mesh_data *out);

// Vertices whose positions agree in every bit become one; triangles stay, in their order.
int mesh_weld(const mesh_data *in, mesh_data *out);

// mesh_sphere as one closed surface: the octants' vertices welded.
int mesh_closed_sphere(int levels, double radius, mesh_data *out);

// Adds a mesh to another, normals as they are. Nonzero: `to` is unchanged.
int mesh_append(mesh_data *to, const mesh_data *from);

// Copies of a number of given vertices and triangles, normals computed.
int mesh_make(const float *positions, size_t vertex_count, const uint32_t *triangles, size_t triangle_count,
              mesh_data *out);

// Vertex clustering: one vertex (the mean) for each occupied cell of a cubic grid; degenerate and repeated triangles
// go.
int mesh_cluster(const mesh_data *in, double cell, mesh_data *out);

// Clusters with the cell size that leaves about 1/factor of the triangles.
int mesh_decimate(const mesh_data *in, double factor, mesh_data *out);

// A copy, to be changed freely.
int mesh_copy(const mesh_data *in, mesh_data *out);

void mesh_free(mesh_data *mesh);

sss_mesh mesh_view(const mesh_data *mesh, double mm_per_unit);

// Largest extent along an axis; area of a triangle, of everything; mean edge length; all in mesh units.
double mesh_extent(const mesh_data *mesh);
double mesh_triangle_area(const mesh_data *mesh, size_t triangle);
double mesh_area(const mesh_data *mesh);
double mesh_mean_edge(const mesh_data *mesh);

// Length of edges without a partner that runs the other way, by sorting them; mesh units. Indices tell what is one
// edge: weld first. Negative: out of memory.
double mesh_border(const mesh_data *mesh);

// From a point to the nearest triangle, in mesh units.
double mesh_distance(const mesh_data *mesh, const double point[3]);

// weights[V]: a third of the area of the triangles around each vertex.
void mesh_vertex_areas(const mesh_data *mesh, double *weights);

// Vertices drawn so that each stands for the same area: plain sums over them are then area-weighted. [count], to be
// freed; NULL on failure.
size_t *mesh_vertices_by_area(const mesh_data *mesh, size_t count);

// Recomputes normals: means of the triangles' normals weighted by area.
void mesh_compute_normals(mesh_data *mesh);

// Turns windings and normals round where the surface, taken as closed, has its outside inside (a negative volume), as
// the horses of ../shared/models have. 1 where it did.
int mesh_turn_outward(mesh_data *mesh);

// Moves, then scales, every position.
void mesh_transform(mesh_data *mesh, double scale, const double offset[3]);

#endif
