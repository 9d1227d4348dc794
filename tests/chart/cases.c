// The list of cases.h, and the meshes that it makes up.

#include "cases.h"

#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// Not the product of all: each mesh, material and light, small and large, and the bunny as the chart always had it.
static const chart_entry entries[] = {
    {"bunny", "Marble", 10.0, "front"},
    {"bunny", "Marble", 50.0, "front"},
    {"bunny", "Marble", 200.0, "front"},
    {"bunny", "Skimmilk", 10.0, "front"},
    {"bunny", "Skimmilk", 50.0, "front"},
    {"bunny", "Skimmilk", 200.0, "front"},
    {"bunny", "Marble", 50.0, "edge"},
    {"bunny", "Skin1", 50.0, "side"},
    {"bunny", "Wholemilk", 50.0, "environment"},
    {"dragon", "Marble", 100.0, "behind"},
    {"leaf", "Skin1", 50.0, "behind"},
    {"leaf", "Wholemilk", 20.0, "side"},
    {"leaf", "Ketchup", 100.0, "environment"},
    {"slab", "Skimmilk", 20.0, "behind"},
    {"slab", "Marble", 50.0, "edge"},
    {"slab", "Spectralon", 100.0, "side"},
    {"sphere", "Skimmilk", 1.0, "front"},
    {"sphere", "Ketchup", 20.0, "side"},
    {"cube", "Spectralon", 5.0, "environment"},
    {"cube", "Skin1", 20.0, "edge"},
};

enum
{
    ENTRY_COUNT = sizeof entries / sizeof entries[0]
};

size_t chart_entry_count(void)
{
    return ENTRY_COUNT;
}

const chart_entry *chart_entry_at(size_t index)
{
    return index < ENTRY_COUNT ? &entries[index] : NULL;
}

static void write_name(const char *mesh, const char *material, double size_mm, const char *light,
                       char name[CHART_NAME_SIZE])
{
    snprintf(name, CHART_NAME_SIZE, "%s-%s-%g-%s", mesh, material, size_mm, light);
    for (char *at = name; *at; ++at)
    {
        *at = (char)tolower((unsigned char)*at);
    }
}

void chart_entry_name(const chart_entry *entry, char name[CHART_NAME_SIZE])
{
    write_name(entry->mesh, entry->material, entry->size_mm, entry->light, name);
}

const chart_entry *chart_entry_by_name(const char *name)
{
    for (size_t i = 0; i < ENTRY_COUNT; ++i)
    {
        char its[CHART_NAME_SIZE];
        chart_entry_name(&entries[i], its);
        if (strcmp(its, name) == 0)
        {
            return &entries[i];
        }
    }
    return NULL;
}

// ---- meshes ----

// One side of a box: n x m cells from `corner` along two edges; facing their cross product.
static void add_side(const double corner[3], const double along[2][3], size_t n, size_t m, float *positions,
                     uint32_t *triangles, size_t *vertex_count, size_t *triangle_count)
{
    const size_t first = *vertex_count;
    for (size_t i = 0; i < (n + 1) * (m + 1); ++i)
    {
        const double s = (double)(i % (n + 1)) / (double)n, t = (double)(i / (n + 1)) / (double)m;
        for (int k = 0; k < 3; ++k)
        {
            positions[3 * (first + i) + (size_t)k] = (float)(corner[k] + s * along[0][k] + t * along[1][k]);
        }
    }
    for (size_t i = 0; i < n * m; ++i)
    {
        const uint32_t a = (uint32_t)(first + i / n * (n + 1) + i % n), b = a + 1, c = a + (uint32_t)n + 1, d = c + 1;
        const uint32_t two[6] = {a, b, d, a, d, c};
        memcpy(triangles + 3 * (*triangle_count + 2 * i), two, sizeof two);
    }
    *vertex_count += (n + 1) * (m + 1);
    *triangle_count += 2 * n * m;
}

// A box around the origin whose six sides keep their own vertices along the edges, so that normals are theirs.
static int make_box(const double size[3], const size_t cells[3], mesh_data *out)
{
    size_t vertices = 0, triangles = 0;
    for (size_t axis = 0; axis < 3; ++axis)
    {
        const size_t n = cells[(axis + 1) % 3], m = cells[(axis + 2) % 3];
        vertices += 2 * (n + 1) * (m + 1);
        triangles += 4 * n * m;
    }
    float *const positions = (float *)malloc(3 * vertices * sizeof *positions);
    uint32_t *const indices = (uint32_t *)malloc(3 * triangles * sizeof *indices);
    size_t v = 0, t = 0;
    for (size_t side = 0; side < 6 && positions && indices; ++side)
    {
        const size_t axis = side / 2, first = (axis + 1 + side % 2) % 3, second = (axis + 2 - side % 2) % 3;
        double corner[3], along[2][3] = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
        for (size_t k = 0; k < 3; ++k)
        {
            corner[k] = -0.5 * size[k];
        }
        corner[axis] = side % 2 ? -0.5 * size[axis] : 0.5 * size[axis];
        along[0][first] = size[first];
        along[1][second] = size[second];
        add_side(corner, (const double (*)[3])along, cells[first], cells[second], positions, indices, &v, &t);
    }
    const int failed = !positions || !indices || mesh_make(positions, v, indices, t, out) != 0;
    free(positions);
    free(indices);
    return failed;
}

// An ear: a sphere flattened to a shell whose thickness is nearly the same up to a round rim, then bent along both
// axes.
static int make_leaf(int levels, mesh_data *out)
{
    static const double LENGTH = 1.0, WIDTH = 0.66, THICKNESS = 0.04, BEND = 0.55, CUP = 0.5; // radii of curvature
    if (mesh_closed_sphere(levels, 0.5, out) != 0)
    {
        return 1;
    }
    for (size_t v = 0; v < out->vertex_count; ++v)
    {
        float *const p = out->positions + 3 * v;
        const double z = 2.0 * (double)p[2], x = LENGTH * (double)p[0], y = WIDTH * (double)p[1];
        const double height = 0.5 * THICKNESS * copysign(sqrt(fabs(z)), z); // (1 - r^2)^(1/4) of the distance r
        const double low = CUP - sqrt(CUP * CUP - y * y) + height;          // across: a trough that opens towards +z
        const double angle = x / BEND, radius = BEND - low;                 // along: bent towards +z as well
        p[0] = (float)(radius * sin(angle));
        p[1] = (float)y;
        p[2] = (float)(BEND - radius * cos(angle));
    }
    mesh_compute_normals(out);
    return 0;
}

static int load_model(const char *name, double thin, mesh_data *out)
{
    mesh_data loaded;
    if (mesh_load_model(name, &loaded) != 0)
    {
        return CHART_LEFT_OUT;
    }
    if (!(thin > 1.0))
    {
        *out = loaded;
        return 0;
    }
    const int failed = mesh_decimate(&loaded, thin, out);
    mesh_free(&loaded);
    return failed;
}

int chart_mesh(const char *name, double thin, mesh_data *out)
{
    static const double slab[3] = {1.0, 1.0, 0.1}, cube[3] = {1.0, 1.0, 1.0};
    const int levels = thin > 1.0 ? 6 - (int)ceil(log(thin) / log(4.0)) : 6;
    const double scale = thin > 1.0 ? 1.0 / sqrt(thin) : 1.0;
    memset(out, 0, sizeof *out);
    if (strcmp(name, "bunny") == 0)
    {
        return load_model("bunny", thin, out);
    }
    if (strcmp(name, "dragon") == 0)
    {
        return load_model("dragon_res2", thin, out);
    }
    if (strcmp(name, "leaf") == 0)
    {
        return make_leaf(levels > 2 ? levels : 2, out);
    }
    if (strcmp(name, "sphere") == 0)
    {
        return mesh_closed_sphere(levels > 2 ? levels : 2, 0.5, out);
    }
    if (strcmp(name, "slab") == 0)
    {
        const size_t n = (size_t)ceil(70.0 * scale), m = (size_t)ceil(7.0 * scale);
        const size_t cells[3] = {n, n, m};
        return make_box(slab, cells, out);
    }
    if (strcmp(name, "cube") == 0)
    {
        const size_t n = (size_t)ceil(48.0 * scale);
        const size_t cells[3] = {n, n, n};
        return make_box(cube, cells, out);
    }
    return 1;
}

// ---- lights ----

static void aim(sss_dipole_light *light, double x, double y, double z)
{
    light->kind = SSS_DIPOLE_LIGHT_DIRECTIONAL;
    light->direction[0] = x;
    light->direction[1] = y;
    light->direction[2] = z;
    for (int k = 0; k < 3; ++k)
    {
        light->color[k] = 1.0;
    }
}

// Radiance (1 + 0.6 y)/pi: two bands, for which E is exact. It lights a plane that faces up with 1.4, down with 0.6.
static void surround(sss_dipole_light *light)
{
    light->kind = SSS_DIPOLE_LIGHT_ENVIRONMENT;
    for (int k = 0; k < 3; ++k)
    {
        light->sh[0][k] = 2.0 / sqrt(3.14159265358979323846); // 1/pi over Y_00 = 1/(2 sqrt(pi))
        light->sh[1][k] = 0.6 / 3.14159265358979323846 / 0.48860251190291992;
    }
}

// A plane through the middle of the mesh's box.
static void mask(chart_case *c, double x, double y, double z)
{
    const double normal[3] = {x, y, z};
    c->edge = 1;
    c->edge_plane[3] = 0.0;
    for (size_t k = 0; k < 3; ++k)
    {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (size_t v = 0; v < c->mesh.vertex_count; ++v)
        {
            low = fmin(low, c->mesh.positions[3 * v + k]);
            high = fmax(high, c->mesh.positions[3 * v + k]);
        }
        c->edge_plane[k] = normal[k];
        c->edge_plane[3] -= normal[k] * 0.5 * (low + high);
    }
}

int chart_light(const char *name, chart_case *c)
{
    sss_dipole_light *const light = (sss_dipole_light *)calloc(1, sizeof *light);
    if (!light)
    {
        return 1;
    }
    c->edge = 0;
    if (strcmp(name, "front") == 0) aim(light, 1.0, 1.0, 1.0);
    else if (strcmp(name, "side") == 0) aim(light, 1.0, 0.3, 0.1);
    else if (strcmp(name, "behind") == 0) aim(light, -0.5, 0.4, -1.0);
    else if (strcmp(name, "environment") == 0) surround(light);
    else if (strcmp(name, "edge") == 0)
    {
        aim(light, 1.0, 1.0, 1.0);
        mask(c, 0.8, -0.6, 0.1);
    }
    else
    {
        free(light);
        return 1;
    }
    free(c->lights);
    c->lights = light;
    c->light_count = 1;
    return 0;
}

int chart_irradiance(const chart_case *c, const sss_mesh *mesh, float *irradiance)
{
    sss_dipole_irradiance_options options;
    memset(&options, 0, sizeof options);
    options.eta = c->profile.eta;
    if (sss_dipole_irradiance(mesh, c->lights, c->light_count, &options, irradiance) != SSS_OK)
    {
        return 1;
    }
    for (size_t v = 0; v < mesh->vertex_count && c->edge; ++v)
    {
        const float *const p = mesh->positions + 3 * v;
        const double side = c->edge_plane[0] * (double)p[0] + c->edge_plane[1] * (double)p[1] +
                            c->edge_plane[2] * (double)p[2] + c->edge_plane[3];
        if (!(side > 0.0))
        {
            memset(irradiance + 3 * v, 0, 3 * sizeof *irradiance);
        }
    }
    return 0;
}

// ---- cases ----

int chart_case_create(const chart_entry *entry, double thin, chart_case *out)
{
    memset(out, 0, sizeof *out);
    chart_entry_name(entry, out->name);
    if (thin > 1.0)
    {
        snprintf(out->name + strlen(out->name), CHART_NAME_SIZE - strlen(out->name), "-thinned");
    }
    out->mesh_name = entry->mesh;
    out->material_name = entry->material;
    out->light_name = entry->light;
    out->size_mm = entry->size_mm;
    int status = chart_mesh(entry->mesh, thin, &out->mesh);
    if (status == 0)
    {
        out->view = mesh_view(&out->mesh, entry->size_mm / mesh_extent(&out->mesh));
        out->irradiance = (float *)malloc(3 * out->mesh.vertex_count * sizeof *out->irradiance);
        status = !out->irradiance || chart_light(entry->light, out) != 0 ||
                 sss_dipole_material_by_name(entry->material, &out->material) != SSS_OK ||
                 sss_dipole_profile(&out->material, SSS_DIPOLE_FRESNEL_EXACT, &out->profile) != SSS_OK ||
                 chart_irradiance(out, &out->view, out->irradiance) != 0;
    }
    if (status != 0)
    {
        chart_case_free(out);
    }
    return status;
}

void chart_case_free(chart_case *c)
{
    mesh_free(&c->mesh);
    free(c->lights);
    free(c->irradiance);
    memset(c, 0, sizeof *c);
}
