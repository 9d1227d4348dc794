#include "scene.h"

#include "../../examples/common/threads.h"
#include "../common/reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int scene_create(mesh_data *mesh, const double albedo[3], double eta, scene *out)
{
    double sigma_s[3], sigma_a[3];
    sss_dipole_material material;
    memset(out, 0, sizeof *out);
    out->mesh = *mesh;
    memset(mesh, 0, sizeof *mesh);
    const size_t V = out->mesh.vertex_count;
    out->view = mesh_view(&out->mesh, 1.0);
    out->visible = (float *)malloc(V * sizeof(float));
    out->irradiance = (float *)calloc(3 * V, sizeof(float));
    out->receivers = (size_t *)malloc(V * sizeof(size_t));
    out->areas = (double *)malloc(V * sizeof(double));
    for (int k = 0; k < 3; ++k)
    {
        sigma_s[k] = albedo[k];
        sigma_a[k] = 1.0 - albedo[k];
    }
    if (!out->visible || !out->irradiance || !out->receivers || !out->areas ||
        sss_dipole_material_from_coefficients(sigma_s, sigma_a, eta, &material) != SSS_OK ||
        sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &out->profile) != SSS_OK)
    {
        scene_free(out);
        return 1;
    }
    for (size_t v = 0; v < V; ++v)
    {
        out->visible[v] = 1.0f;
    }
    mesh_vertex_areas(&out->mesh, out->areas);
    return 0;
}

void scene_free(scene *s)
{
    mesh_free(&s->mesh);
    free(s->visible);
    free(s->irradiance);
    free(s->receivers);
    free(s->areas);
    memset(s, 0, sizeof *s);
}

int scene_light(scene *s, double x, double y, double z)
{
    const double length = sqrt(x * x + y * y + z * z), direction[3] = {x / length, y / length, z / length};
    sss_dipole_light light;
    sss_dipole_irradiance_options options;
    memset(&light, 0, sizeof light);
    memset(&options, 0, sizeof options);
    for (int k = 0; k < 3; ++k)
    {
        light.direction[k] = s->light[k] = direction[k];
        light.color[k] = 1.0;
    }
    light.visibility = s->visible;
    options.eta = s->profile.eta;
    return sss_dipole_irradiance(&s->view, &light, 1, &options, s->irradiance) != SSS_OK;
}

int scene_add_receivers(scene *s, size_t begin, size_t end, size_t step)
{
    for (size_t v = begin; v < end; v += step)
    {
        if (v >= s->mesh.vertex_count || s->count >= s->mesh.vertex_count)
        {
            return 1;
        }
        s->receivers[s->count++] = v;
    }
    return 0;
}

int scene_truth(const scene *s, const float *irradiance, const float *normals, sss_dipole_geometry geometry,
                double guard, double tolerance, double *B)
{
    const reference_options options = {geometry, SSS_DIPOLE_VERTICES, tolerance, guard};
    double *const errors = (double *)malloc(3 * s->count * sizeof(double));
    const int result = !errors ? 1
                               : reference_radiosity_many(&s->view, &s->profile, irradiance, &options,
                                                          s->mesh.positions, normals, s->receivers, s->count,
                                                          threads_available(), B, errors);
    for (size_t i = 0; i < 3 * s->count && result == 2; ++i)
    {   // The others' are good.
        if (!(errors[i] <= 10.0 * tolerance * B[i])) B[i] = (double)NAN;
    }
    free(errors);
    return result == 1;
}

outcome scene_compare(const scene *s, const float *B, const double *truth, size_t begin, size_t end)
{
    outcome r = {0.0, 0.0, 0.0, 0.0, 1};
    double sum = 0.0, sum_difference = 0.0, largest = 0.0, largest_difference = 0.0;
    for (size_t i = 0; i < 3 * s->count; ++i)
    {
        const double weight = s->areas[s->receivers[i / 3]];
        const double difference = (double)B[3 * s->receivers[i / 3] + i % 3] - truth[i];
        if (isnan(truth[i]) || weight == 0.0)
        {
            continue;
        }
        sum += weight * truth[i] * truth[i];
        largest = fmax(largest, fabs(truth[i]));
        if (i / 3 >= begin && i / 3 < end)
        {
            sum_difference += weight * difference * difference;
            largest_difference = fmax(largest_difference, fabs(difference));
        }
    }
    r.rel_l2 = sqrt(sum_difference / sum);
    r.rel_max = largest_difference / largest;
    for (size_t i = 0; i < 3 * s->mesh.vertex_count; ++i)
    {
        r.finite = r.finite && isfinite(B[i]);
        r.largest = fmax(r.largest, (double)B[i]);
        r.smallest = fmin(r.smallest, (double)B[i]);
    }
    r.finite = r.finite && r.smallest >= -1e-5 * r.largest;
    return r;
}
