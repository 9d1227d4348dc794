// The method that sss_dipole_needs ranks first, if its own prediction keeps the tolerance.

#include <stdio.h>
#include <string.h>

#include "methods.h"

static const double TOLERANCE = 1e-2; // where the job has none, as in sss_dipole_scene

// Of the ranking, what can be run as one of the other methods, with its knob. NULL where that is not so.
static const char *take_choice(const sss_dipole_choice *c, method_job *job)
{
    job->tolerance = c->tolerance;
    switch (c->method)
    {
    case SSS_DIPOLE_METHOD_LAMBERT: return "lambert";
    case SSS_DIPOLE_METHOD_DIRECT:
        job->geometry = SSS_DIPOLE_DISTANCE;
        return "direct";
    case SSS_DIPOLE_METHOD_PLACED:
        job->geometry = SSS_DIPOLE_PLACED;
        return "direct";
    case SSS_DIPOLE_METHOD_BEM_RENDER:
        job->keep_links = 1;
        return "bem";
    case SSS_DIPOLE_METHOD_BEM: return "bem";
    case SSS_DIPOLE_METHOD_HAO:
        job->hao.directions = c->directions;
        job->hao.storage = method_hao_storage_name(c->storage);
        return "hao";
    default: return NULL;
    }
}

static void say(const method_job *job, const method_result *result, double tolerance, double wanted)
{
    if (job->announce)
    {
        fprintf(stderr, "auto: %s at %g predicts an error of %.2g, more than %g\n", result->method, tolerance,
                result->predicted_error, wanted);
    }
}

// bem measures itself, and is run again with half its tolerance until what it predicts is what was asked for.
static int run_choice(const sss_dipole_choice *c, const method_job *job, double wanted, float *radiosity,
                      method_result *result, char *error_text, size_t error_size)
{
    method_job one = *job;
    const char *const name = take_choice(c, &one);
    const int bem = c->method == SSS_DIPOLE_METHOD_BEM || c->method == SSS_DIPOLE_METHOD_BEM_RENDER;
    int status = 0;
    do
    {
        status = method_by_name(name)(&one, radiosity, result, error_text, error_size);
        if (c->method == SSS_DIPOLE_METHOD_LAMBERT)
        {
            result->predicted_error = c->predicted_error;
        }
        if (status == 0 && result->predicted_error > wanted)
        {
            say(job, result, one.tolerance, wanted);
        }
        one.tolerance *= 0.5;
    } while (status == 0 && bem && result->predicted_error > wanted && one.tolerance >= METHOD_BEM_TIGHTEST);
    return status;
}

int method_auto(const method_job *job, float *radiosity, method_result *result, char *error_text, size_t error_size)
{
    const double wanted = job->tolerance > 0.0 ? job->tolerance : TOLERANCE;
    method_job one = *job;
    for (size_t i = 0; i < job->advice.ranking_count && job->advice.ranking[i].meets; ++i)
    {
        method_job probe = *job;
        const sss_dipole_choice *const c = &job->advice.ranking[i];
        if (!take_choice(c, &probe))
        {
            continue;
        }
        const int status = run_choice(c, job, wanted, radiosity, result, error_text, error_size);
        if (status != 0 || result->predicted_error <= wanted)
        {
            return status;
        }
    }
    one.tolerance = wanted; // what integrates every triangle can be as exact as one likes
    return method_by_name("direct")(&one, radiosity, result, error_text, error_size);
}
