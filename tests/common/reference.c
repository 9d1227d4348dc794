// The converged reference of reference.h.

#define _POSIX_C_SOURCE 200809L // pthreads

#include "reference.h"

#include <float.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

// Splits after which a receiver counts as not converging: each costs two rules, so this is some seconds. And halvings
// of one triangle after which it counts as holding a singularity: its size is then 2^-100 of what it was.
#define MAX_SPLITS 2000000u
#define MAX_DEPTH 200

// ---- The kernel: one channel of R_d around one receiver ----

// A source's contribution is scale z (1 + sigma s) exp(-sigma s) / s^3 with s^2 = |x - center|^2 + lift2.
// Distance-only geometry: center = x_o, lift = z. Placed: center = x_o - z_r n or x_o + z_v n, lift = 0.
typedef struct kernel
{
    double scale;        // alpha' / (4 pi)
    double sigma;        // sigma_tr, 1/mm
    double z[2];         // z_r, z_v, mm
    double center[2][3]; // mm, relative to x_o
    double lift2[2];     // mm^2
    double guard2[2];    // mm^2, s^2 counts as at least this
} kernel;

static void make_kernel(const sss_profile *profile, int channel, sss_dipole_geometry geometry, double guard,
                        const double normal[3], kernel *k)
{
    memset(k, 0, sizeof *k);
    k->scale = profile->alpha_p[channel] / (4.0 * PI);
    k->sigma = profile->sigma_tr[channel];
    k->z[0] = profile->z_r[channel];
    k->z[1] = profile->z_v[channel];
    for (int source = 0; source < 2; ++source)
    {
        const double side = source == 0 ? -1.0 : 1.0; // the real source lies below the surface
        if (geometry == SSS_DIPOLE_PLACED)
            for (int axis = 0; axis < 3; ++axis)
                k->center[source][axis] = side * k->z[source] * normal[axis];
        else
            k->lift2[source] = k->z[source] * k->z[source];
        k->guard2[source] = guard * k->z[source] * guard * k->z[source];
    }
}

static double kernel_at(const kernel *k, int source, double from_source2)
{
    const double s2 = fmax(from_source2, k->guard2[source]);
    const double s = sqrt(s2);
    if (k->sigma == 0.0)
        return k->scale * k->z[source] / (s2 * s);
    return k->scale * k->z[source] * (1.0 + k->sigma * s) * exp(-k->sigma * s) / (s2 * s);
}

static double distance2(const double a[3], const double b[3])
{
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return x * x + y * y + z * z;
}

// ---- One rule on one triangle ----

typedef struct patch
{
    double p[3][3]; // corners, mm, relative to x_o
    double E[3];    // irradiance at the corners
    double integral;
    double error;
    int depth;      // halvings since the mesh's triangle
} patch;

// Radon's rule of degree 5: the centroid, and two orbits of three points (a, a, 1 - 2a) in barycentric coordinates.
//   a = (6 -+ sqrt 15)/21, weights 9/40 and (155 -+ sqrt 15)/1200.
// The centroid with one orbit alone makes a rule of degree 2: the orbit's total weight follows from the second
// moment of a barycentric coordinate, (1/18) / (2 (a - 1/3)^2). Two such rules measure how smooth the integrand is.
static const double rule_weight[3] = {0.225, 0.12593918054482715, 0.13239415278850618};
static const double rule_a[2] = {0.10128650732345634, 0.47014206410511509};

typedef struct samples
{
    double x[7][3];
    double E[7];
    double h;           // distance from the centroid to the farthest corner
    double area;
    double E_max;
} samples;

static void place_samples(const patch *t, samples *q)
{
    double e[2][3], cross[3];
    for (int axis = 0; axis < 3; ++axis)
    {
        e[0][axis] = t->p[1][axis] - t->p[0][axis];
        e[1][axis] = t->p[2][axis] - t->p[0][axis];
        q->x[0][axis] = (t->p[0][axis] + t->p[1][axis] + t->p[2][axis]) / 3.0;
    }
    cross[0] = e[0][1] * e[1][2] - e[0][2] * e[1][1];
    cross[1] = e[0][2] * e[1][0] - e[0][0] * e[1][2];
    cross[2] = e[0][0] * e[1][1] - e[0][1] * e[1][0];
    q->area = 0.5 * sqrt(cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]);
    q->E[0] = (t->E[0] + t->E[1] + t->E[2]) / 3.0;
    q->h = 0.0;
    q->E_max = 0.0;
    for (int k = 0; k < 3; ++k)
    {
        q->h = fmax(q->h, distance2(t->p[k], q->x[0]));
        q->E_max = fmax(q->E_max, fabs(t->E[k]));
        for (int orbit = 0; orbit < 2; ++orbit)
        {   // The point whose k-th barycentric coordinate is 1 - 2a: centroid + (1 - 3a)(p_k - centroid).
            const double step = 1.0 - 3.0 * rule_a[orbit];
            const int i = 1 + 3 * orbit + k;
            for (int axis = 0; axis < 3; ++axis)
                q->x[i][axis] = q->x[0][axis] + step * (t->p[k][axis] - q->x[0][axis]);
            q->E[i] = q->E[0] + step * (t->E[k] - q->E[0]);
        }
    }
    q->h = sqrt(q->h);
}

// The error of the rule for one source, given its value and those of the two embedded rules of degree 2.
//
// With u = h/s and w = sigma h at the centroid: along any ray from the centroid s^2 is a quadratic with both complex
// roots at distance s, so that in steps lambda h the kernel over its value at the centroid has the majorant
//     M(lambda) = (1 - lambda u)^-4 exp(lambda w/(1 - lambda u)),
// made of (1-u)^-3 for 1/s^3, 1/(1-u) for 1 + sigma s, and u/(1-u) for (s - s_0)/s_0. Its m-th coefficient is
//     c_m(u, w) = sum_j C(m+3, m-j) u^(m-j) w^j/j!.
// E is linear, so the rule integrates E times the Taylor polynomial of degree 4 exactly. The remainder is at most
// M^(5)(1)/5! = (1-u)^-4 exp(w/(1-u)) c_5(u/(1-u), w/(1-u)^2), once for the integral and once for the rule, whose
// weights are positive and add up to 1.
static double rule_error(const kernel *k, int source, const samples *q, double f_centroid, double value,
                         const double embedded[2])
{
    const double d2 = distance2(q->x[0], k->center[source]);
    const double nearest = fmax(0.0, sqrt(d2) - q->h);
    const double s2 = nearest * nearest + k->lift2[source];
    // Whatever happens between the samples, the contribution lies between 0 and this.
    const double largest =
        s2 > 0.0 || k->guard2[source] > 0.0 ? q->area * q->E_max * kernel_at(k, source, s2) : DBL_MAX;
    if (s2 < k->guard2[source])
    {   // The kernel is constant in the guard's ball: what is exact there is the rule's too, and only the rest can err.
        const double farthest = sqrt(d2) + q->h;
        return largest - q->area * q->E_max * kernel_at(k, source, farthest * farthest + k->lift2[source]);
    }
    const double u = q->h / sqrt(d2 + k->lift2[source]), w = k->sigma * q->h;
    if (!(u < 0.5 && w < 1.0))
        return largest;
    const double U = u / (1.0 - u), W = w / ((1.0 - u) * (1.0 - u));
    const double c_5 = ((((56.0 * U + 70.0 * W) * U + 28.0 * W * W) * U + 28.0 / 6.0 * W * W * W) * U +
                        W * W * W * W / 3.0) * U + W * W * W * W * W / 120.0;
    const double c_2 = (10.0 * U + 5.0 * W) * U + 0.5 * W * W;
    const double lead = exp(w / (1.0 - u)) / ((1.0 - u) * (1.0 - u) * (1.0 - u) * (1.0 - u));
    const double bound = 2.0 * lead * c_5 * f_centroid * q->area * q->E_max;
    // The embedded rules err by the coefficients from 2 on, this one by those from 5 on; twice their ratio for
    // safety, and the last term against both differences vanishing by accident.
    const double difference = fmax(fabs(value - embedded[0]), fabs(value - embedded[1]));
    return fmin(largest, fmin(bound, fmin(1.0, 2.0 * c_5 / c_2) * difference + 1e-3 * bound));
}

static void evaluate(const kernel *k, patch *t)
{
    samples q;
    place_samples(t, &q);
    t->integral = 0.0;
    t->error = 0.0;
    if (!(q.area > 0.0) || q.E_max == 0.0)
        return;
    for (int source = 0; source < 2; ++source)
    {
        double f[7], orbit_sum[2], embedded[2];
        for (int i = 0; i < 7; ++i)
            f[i] = kernel_at(k, source, distance2(q.x[i], k->center[source]) + k->lift2[source]);
        orbit_sum[0] = q.E[1] * f[1] + q.E[2] * f[2] + q.E[3] * f[3];
        orbit_sum[1] = q.E[4] * f[4] + q.E[5] * f[5] + q.E[6] * f[6];
        const double value =
            q.area * (rule_weight[0] * q.E[0] * f[0] + rule_weight[1] * orbit_sum[0] + rule_weight[2] * orbit_sum[1]);
        for (int orbit = 0; orbit < 2; ++orbit)
        {
            const double offset = rule_a[orbit] - 1.0 / 3.0;
            const double weight = (1.0 / 18.0) / (2.0 * offset * offset);
            embedded[orbit] = q.area * ((1.0 - weight) * q.E[0] * f[0] + weight / 3.0 * orbit_sum[orbit]);
        }
        t->integral += value;
        t->error += rule_error(k, source, &q, f[0], value, embedded);
    }
    if (!(t->integral <= DBL_MAX)) // a sample fell on a placed source
        t->integral = DBL_MAX;
    if (!(t->error <= DBL_MAX))
        t->error = DBL_MAX;
}

void reference_one_rule(const double corners[3][3], const double E[3], const sss_profile *profile, int channel,
                        sss_dipole_geometry geometry, const double normal[3], double *integral, double *error)
{
    kernel k;
    patch t;
    make_kernel(profile, channel, geometry, 0.0, normal, &k);
    memcpy(t.p, corners, sizeof t.p);
    memcpy(t.E, E, sizeof t.E);
    evaluate(&k, &t);
    *integral = t.integral;
    *error = t.error;
}

// ---- The heap of triangles that may still be split, worst first ----

typedef struct heap
{
    patch *patches;
    size_t count;
    size_t capacity;
} heap;

static int reserve(heap *h, size_t capacity)
{
    if (capacity <= h->capacity)
        return 0;
    const size_t grown = capacity > 2 * h->capacity ? capacity : 2 * h->capacity;
    patch *patches = (patch *)realloc(h->patches, grown * sizeof *patches);
    if (patches == NULL)
        return 1;
    h->patches = patches;
    h->capacity = grown;
    return 0;
}

static void sift_down(heap *h, size_t i)
{
    const patch moved = h->patches[i];
    for (;;)
    {
        size_t child = 2 * i + 1;
        if (child >= h->count)
            break;
        if (child + 1 < h->count && h->patches[child + 1].error > h->patches[child].error)
            ++child;
        if (h->patches[child].error <= moved.error)
            break;
        h->patches[i] = h->patches[child];
        i = child;
    }
    h->patches[i] = moved;
}

static void sift_up(heap *h, size_t i)
{
    const patch moved = h->patches[i];
    while (i > 0 && h->patches[(i - 1) / 2].error < moved.error)
    {
        h->patches[i] = h->patches[(i - 1) / 2];
        i = (i - 1) / 2;
    }
    h->patches[i] = moved;
}

// ---- One channel at one receiver ----

typedef struct totals
{
    long double integral;
    long double error;
} totals;

static totals sum(const heap *h, const totals *settled)
{
    totals all = *settled;
    for (size_t i = 0; i < h->count; ++i)
    {
        all.integral += h->patches[i].integral;
        all.error += h->patches[i].error;
    }
    return all;
}

// Halves the worst patch across its longest edge, so that slivers become compact.
static int split_worst(const kernel *k, heap *h, totals *all)
{
    if (reserve(h, h->count + 1) != 0)
        return 1;
    const patch parent = h->patches[0];
    patch child[2] = {parent, parent};
    int a = 0;
    for (int edge = 1; edge < 3; ++edge)
        if (distance2(parent.p[edge], parent.p[(edge + 1) % 3]) > distance2(parent.p[a], parent.p[(a + 1) % 3]))
            a = edge;
    const int b = (a + 1) % 3;
    for (int c = 0; c < 2; ++c)
    {   // child 0 keeps corner a and gets the midpoint for corner b, child 1 the other way round
        const int moved = c == 0 ? b : a;
        for (int axis = 0; axis < 3; ++axis)
            child[c].p[moved][axis] = 0.5 * (parent.p[a][axis] + parent.p[b][axis]);
        child[c].E[moved] = 0.5 * (parent.E[a] + parent.E[b]);
        child[c].depth = parent.depth + 1;
        evaluate(k, &child[c]);
    }
    all->integral += (long double)child[0].integral + child[1].integral - parent.integral;
    all->error += (long double)child[0].error + child[1].error - parent.error;
    h->patches[0] = child[0];
    sift_down(h, 0);
    h->patches[h->count] = child[1];
    sift_up(h, h->count++);
    return 0;
}

// Below this a sum is made of underflow.
#define NOTHING (DBL_MIN / DBL_EPSILON)

static int converged(const totals *all, double tolerance)
{
    return all->error <= tolerance * fabsl(all->integral) || all->error <= (long double)NOTHING;
}

static int refine(const kernel *k, heap *h, const totals *settled, double tolerance, totals *all)
{
    *all = sum(h, settled);
    for (unsigned splits = 0; splits < MAX_SPLITS && h->count > 0; ++splits)
    {
        if (splits % 4096u == 4095u)
            *all = sum(h, settled); // running differences lose digits
        if (converged(all, tolerance))
        {
            *all = sum(h, settled);
            if (converged(all, tolerance))
                return 0;
        }
        if (h->patches[0].depth >= MAX_DEPTH)
            break;
        if (split_worst(k, h, all) != 0)
            return 1;
    }
    *all = sum(h, settled);
    return converged(all, tolerance) ? 0 : 2;
}

// Keeps in the heap only what is worth splitting: what holds less than a tenth of the allowance is settled. The
// allowance follows from what B is at least: where a sample hits a peak, the sum can be far too large at first.
static void settle_small(heap *h, double tolerance, totals *settled)
{
    const totals nothing = {0.0L, 0.0L};
    long double least = 0.0L;
    for (size_t i = 0; i < h->count; ++i)
        least += fmax(0.0, h->patches[i].integral - h->patches[i].error);
    const long double allowance = 0.1L * tolerance * least / (long double)(h->count + 1);
    size_t kept = 0;
    *settled = nothing;
    for (size_t i = 0; i < h->count; ++i)
    {
        if (h->patches[i].error > allowance)
            h->patches[kept++] = h->patches[i];
        else
        {
            settled->integral += h->patches[i].integral;
            settled->error += h->patches[i].error;
        }
    }
    h->count = kept;
    for (size_t i = kept / 2; i-- > 0;)
        sift_down(h, i);
}

typedef struct receiver
{
    double position[3]; // mesh units
    double normal[3];   // unit length, or zero
} receiver;

static void load_patch(const sss_mesh *mesh, const float *irradiance, sss_dipole_elements elements, size_t triangle,
                       int channel, const receiver *at, patch *t)
{
    for (int corner = 0; corner < 3; ++corner)
    {
        const size_t vertex = mesh->triangles[3 * triangle + (size_t)corner];
        const size_t element = elements == SSS_DIPOLE_VERTICES ? vertex : triangle;
        for (int axis = 0; axis < 3; ++axis)
            t->p[corner][axis] =
                ((double)mesh->positions[3 * vertex + (size_t)axis] - at->position[axis]) * mesh->mm_per_unit;
        t->E[corner] = irradiance[3 * element + (size_t)channel];
    }
}

static int one_channel(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                       const reference_options *options, const receiver *at, int channel, heap *h, double *B,
                       double *error)
{
    kernel k;
    totals settled, all;
    const double tolerance = options->tolerance > 0.0 ? options->tolerance : 1e-6;
    *B = 0.0;
    *error = 0.0;
    if (profile->alpha_p[channel] == 0.0)
        return 0;
    make_kernel(profile, channel, options->geometry, options->guard, at->normal, &k);
    if (reserve(h, mesh->triangle_count) != 0)
        return 1;
    h->count = 0;
    for (size_t triangle = 0; triangle < mesh->triangle_count; ++triangle)
    {
        patch *t = &h->patches[h->count];
        t->depth = 0;
        load_patch(mesh, irradiance, options->elements, triangle, channel, at, t);
        evaluate(&k, t);
        if (t->integral != 0.0 || t->error != 0.0)
            h->count++;
    }
    settle_small(h, tolerance, &settled);
    const int result = refine(&k, h, &settled, tolerance, &all);
    *B = (double)all.integral;
    *error = (double)(all.error + 4.0L * DBL_EPSILON * fabsl(all.integral)); // rounding inside the rules
    return result;
}

static int usable(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                  const reference_options *options)
{
    return mesh != NULL && profile != NULL && irradiance != NULL && options != NULL && mesh->positions != NULL &&
           mesh->triangles != NULL && mesh->mm_per_unit > 0.0 && options->tolerance >= 0.0 && options->guard >= 0.0;
}

// All three channels; the heap's memory is kept from one receiver to the next.
static int one_receiver(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                        const reference_options *options, const float position[3], const float normal[3], heap *h,
                        double B[3], double error[3])
{
    receiver at;
    double length2 = 0.0;
    int worst = 0;
    for (int axis = 0; axis < 3; ++axis)
    {
        at.position[axis] = position[axis];
        at.normal[axis] = normal != NULL ? normal[axis] : 0.0;
        length2 += at.normal[axis] * at.normal[axis];
    }
    if (options->geometry == SSS_DIPOLE_PLACED && !(length2 > 0.0))
        return 1;
    for (int axis = 0; axis < 3 && length2 > 0.0; ++axis)
        at.normal[axis] /= sqrt(length2);
    for (int channel = 0; channel < 3; ++channel)
    {
        double b, e;
        const int result = one_channel(mesh, profile, irradiance, options, &at, channel, h, &b, &e);
        if (result == 1)
            return 1;
        worst = result > worst ? result : worst;
        B[channel] = b;
        error[channel] = e;
    }
    return worst;
}

int reference_radiosity(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                        const reference_options *options, const float position[3], const float normal[3], double B[3],
                        double error[3])
{
    heap h = {NULL, 0, 0};
    double b[3], e[3];
    if (!usable(mesh, profile, irradiance, options) || position == NULL || B == NULL || error == NULL)
        return 1;
    const int result = one_receiver(mesh, profile, irradiance, options, position, normal, &h, b, e);
    free(h.patches);
    if (result != 1)
    {
        memcpy(B, b, sizeof b);
        memcpy(error, e, sizeof e);
    }
    return result;
}

// ---- Many receivers ----

typedef struct job
{
    const sss_mesh *mesh;
    const sss_profile *profile;
    const float *irradiance;
    const reference_options *options;
    const float *positions;
    const float *normals;
    const size_t *indices;
    size_t count;
    double *B;
    double *error;
    pthread_mutex_t lock;
    size_t next; // under lock
    int worst;   // under lock; 1 (failed outright) outranks 2
} job;

static void note_result(job *j, int result)
{
    if (j->worst != 1 && result > 0)
        j->worst = result == 1 ? 1 : (j->worst > result ? j->worst : result);
}

static void *work(void *pointer)
{
    job *j = (job *)pointer;
    heap h = {NULL, 0, 0};
    int result = 0;
    for (;;)
    {
        (void)pthread_mutex_lock(&j->lock);
        note_result(j, result);
        const size_t row = j->next++;
        (void)pthread_mutex_unlock(&j->lock);
        if (row >= j->count)
            break;
        const size_t index = j->indices != NULL ? j->indices[row] : row;
        const float *normal = j->normals != NULL ? &j->normals[3 * index] : NULL;
        result = one_receiver(j->mesh, j->profile, j->irradiance, j->options, &j->positions[3 * index], normal, &h,
                              &j->B[3 * row], &j->error[3 * row]);
    }
    free(h.patches);
    return NULL;
}

#define MAX_THREADS 64

int reference_radiosity_many(const sss_mesh *mesh, const sss_profile *profile, const float *irradiance,
                             const reference_options *options, const float *positions, const float *normals,
                             const size_t *indices, size_t index_count, int threads, double *B, double *error)
{
    pthread_t thread[MAX_THREADS];
    int started = 0;
    job j;
    if (!usable(mesh, profile, irradiance, options) || positions == NULL || B == NULL || error == NULL)
        return 1;
    memset(&j, 0, sizeof j);
    j.mesh = mesh;
    j.profile = profile;
    j.irradiance = irradiance;
    j.options = options;
    j.positions = positions;
    j.normals = normals;
    j.indices = indices;
    j.count = index_count;
    j.B = B;
    j.error = error;
    if (pthread_mutex_init(&j.lock, NULL) != 0)
        return 1;
    const int helpers = threads > MAX_THREADS ? MAX_THREADS - 1 : threads - 1;
    while (started < helpers && pthread_create(&thread[started], NULL, work, &j) == 0)
        ++started;
    (void)work(&j); // this thread works as well, and alone if none could be started
    for (int i = 0; i < started; ++i)
        (void)pthread_join(thread[i], NULL);
    (void)pthread_mutex_destroy(&j.lock);
    return j.worst;
}
