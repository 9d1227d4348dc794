#include "objects.h"

#include "../../examples/common/threads.h"
#include "../common/reference.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int object_create(mesh_data *mesh, const double albedo[3], double eta, object *out)
{
    double sigma_s[3], sigma_a[3];
    sss_dipole_material material;
    memset(out, 0, sizeof *out);
    out->mesh = *mesh;
    memset(mesh, 0, sizeof *mesh);
    out->view = mesh_view(&out->mesh, 1.0);
    out->irradiance = (float *)calloc(3 * out->mesh.vertex_count, sizeof(float));
    out->radiosity = (float *)calloc(3 * out->mesh.vertex_count, sizeof(float));
    out->receivers = (size_t *)malloc(out->mesh.vertex_count * sizeof(size_t));
    for (int k = 0; k < 3; ++k)
    {
        sigma_s[k] = albedo[k];
        sigma_a[k] = 1.0 - albedo[k];
    }
    out->areas = (double *)malloc(out->mesh.vertex_count * sizeof(double));
    if (!out->irradiance || !out->radiosity || !out->receivers || !out->areas ||
        sss_dipole_material_from_coefficients(sigma_s, sigma_a, eta, &material) != SSS_OK ||
        sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &out->profile) != SSS_OK)
    {
        object_free(out);
        return 1;
    }
    mesh_vertex_areas(&out->mesh, out->areas);
    return 0;
}

void object_free(object *o)
{
    mesh_free(&o->mesh);
    free(o->irradiance);
    free(o->radiosity);
    free(o->receivers);
    free(o->areas);
    free(o->truth);
    memset(o, 0, sizeof *o);
}

int object_light(object *o, double x, double y, double z)
{
    sss_dipole_light light;
    sss_dipole_irradiance_options options;
    memset(&light, 0, sizeof light);
    memset(&options, 0, sizeof options);
    light.direction[0] = x;
    light.direction[1] = y;
    light.direction[2] = z;
    light.color[0] = light.color[1] = light.color[2] = 1.0;
    options.eta = o->profile.eta;
    return sss_dipole_irradiance(&o->view, &light, 1, &options, o->irradiance) != SSS_OK;
}

int object_add_receivers(object *o, size_t begin, size_t end, size_t step)
{
    for (size_t v = begin; v < end; v += step)
    {
        if (v >= o->mesh.vertex_count || o->count >= o->mesh.vertex_count)
        {
            return 1;
        }
        o->receivers[o->count++] = v;
    }
    return 0;
}

int object_find_truth(object *o, double guard, double tolerance)
{
    const reference_options options = {SSS_DIPOLE_PLACED, SSS_DIPOLE_VERTICES, tolerance, guard};
    double sum = 0.0, sum_error = 0.0, *errors;
    free(o->truth);
    o->truth = (double *)malloc(3 * o->count * sizeof(double));
    errors = (double *)malloc(3 * o->count * sizeof(double));
    const int failed = !o->truth || !errors ||
                       reference_radiosity_many(&o->view, &o->profile, o->irradiance, &options, o->mesh.positions,
                                                o->mesh.normals, o->receivers, o->count, threads_available(),
                                                o->truth, errors) != 0;
    for (size_t i = 0; i < 3 * o->count && !failed; ++i)
    {
        const double weight = o->areas[o->receivers[i / 3]];
        sum += weight * o->truth[i] * o->truth[i];
        sum_error += weight * errors[i] * errors[i];
    }
    o->truth_error = failed ? 1.0 : sqrt(sum_error / sum);
    free(errors);
    return failed;
}

int object_shade(object *o, double tolerance, double guard, double *predicted)
{
    sss_bem_options options;
    sss_bem_stats stats;
    sss_hooks hooks;
    sss_bem *bem = NULL;
    memset(&options, 0, sizeof options);
    memset(&hooks, 0, sizeof hooks);
    options.tolerance = tolerance;
    options.guard = guard;
    hooks.parallel_for = threads_hook;
    const int failed = sss_bem_create(&o->view, &o->profile, &options, &hooks, &bem) != SSS_OK ||
                       sss_bem_set_irradiance(bem, SSS_BEM_VERTICES, o->irradiance) != SSS_OK ||
                       sss_bem_shade(bem, o->radiosity) != SSS_OK ||
                       sss_bem_predict_error(bem, 0, NULL) != SSS_OK || sss_bem_get_stats(bem, &stats) != SSS_OK;
    if (predicted)
    {
        *predicted = failed ? (double)NAN : stats.predicted_error;
    }
    sss_bem_free(bem);
    return failed;
}

outcome object_compare(const object *o, size_t begin, size_t end)
{
    outcome r = {0.0, 0.0, 0.0, 0.0, 1};
    double sum = 0.0, sum_difference = 0.0, largest = 0.0, largest_difference = 0.0;
    for (size_t i = 0; i < 3 * o->count; ++i)
    {
        const double weight = o->areas[o->receivers[i / 3]];
        const double difference = (double)o->radiosity[3 * o->receivers[i / 3] + i % 3] - o->truth[i];
        sum += weight * o->truth[i] * o->truth[i];
        largest = fmax(largest, fabs(o->truth[i]));
        if (i / 3 >= begin && i / 3 < end)
        {
            sum_difference += weight * difference * difference;
            largest_difference = fmax(largest_difference, fabs(difference));
        }
    }
    r.rel_l2 = sqrt(sum_difference / sum);
    r.rel_max = largest_difference / largest;
    for (size_t i = 0; i < 3 * o->mesh.vertex_count; ++i)
    {
        r.finite = r.finite && isfinite(o->radiosity[i]);
        r.largest = fmax(r.largest, (double)o->radiosity[i]);
    }
    return r;
}
