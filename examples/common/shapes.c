#include "shapes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

const double SHAPES_WICK = 0.52;

static int allocate(model *m, size_t vertices, size_t triangles)
{
    memset(m, 0, sizeof *m);
    m->positions = malloc(3 * vertices * sizeof *m->positions);
    m->normals = malloc(3 * vertices * sizeof *m->normals);
    m->triangles = malloc(3 * triangles * sizeof *m->triangles);
    if (!m->positions || !m->normals || !m->triangles)
    {
        model_free(m);
        return -1;
    }
    return 0;
}

static void add_vertex(model *m, double x, double y, double z)
{
    float *const p = m->positions + 3 * m->vertex_count++;
    p[0] = (float)x;
    p[1] = (float)y;
    p[2] = (float)z;
}

static void add_triangle(model *m, size_t a, size_t b, size_t c)
{
    uint32_t *const t = m->triangles + 3 * m->triangle_count++;
    t[0] = (uint32_t)a;
    t[1] = (uint32_t)b;
    t[2] = (uint32_t)c;
}

int shape_normals(model *m)
{
    const sss_mesh mesh = model_mesh(m, 1.0);
    return sss_dipole_vertex_normals(&mesh, m->normals) == SSS_OK ? 0 : -1;
}

static int finish(model *m)
{
    const int status = shape_normals(m);
    if (status != 0)
    {
        model_free(m);
    }
    return status;
}

// ---- candle ----

// The outline of half a cut through the candle, from the middle of the bottom over the rim to the middle of the hollow:
// straight pieces whose corners are rounded off. Radius, height, and how much of the ridges a point follows.
typedef struct outline
{
    double r, y, ridged;
} outline;

static const outline corners[] = {{0.0, 0.0, 0.0}, {0.25, 0.0, 1.0}, {0.25, 1.0, 1.0}, {0.175, 0.97, 0.6},
                                  {0.175, 0.30, 0.6}, {0.0, 0.27, 0.0}};
enum
{
    CORNERS = sizeof corners / sizeof corners[0]
};

static const double ROUND = 0.035; // how far from a corner its rounding begins
static const double RIDGE = 0.10;  // height of the ridges, share of the radius

static double segment_length(int i)
{
    return hypot(corners[i + 1].r - corners[i].r, corners[i + 1].y - corners[i].y);
}

static outline along_segment(int i, double at)
{
    const outline a = corners[i], b = corners[i + 1];
    const double t = at / segment_length(i);
    const outline p = {a.r + t * (b.r - a.r), a.y + t * (b.y - a.y), a.ridged + t * (b.ridged - a.ridged)};
    return p;
}

// The point at a distance along the outline; a corner gives way to the parabola that touches both its sides.
static outline outline_at(double distance)
{
    int i = 0;
    while (i < CORNERS - 2 && distance > segment_length(i))
    {
        distance -= segment_length(i++);
    }
    const double length = segment_length(i);
    const int corner = distance < ROUND ? i : i + 1;
    const double from = corner == i ? distance : distance - length; // signed, from the nearer corner
    if (fabs(from) >= ROUND || corner == 0 || corner == CORNERS - 1)
    {
        return along_segment(i, fmin(distance, length));
    }
    const outline before = along_segment(corner - 1, segment_length(corner - 1) - ROUND), middle = corners[corner],
                  after = along_segment(corner, ROUND);
    const double t = 0.5 + 0.5 * from / ROUND, a = (1.0 - t) * (1.0 - t), b = 2.0 * t * (1.0 - t), c = t * t;
    const outline p = {a * before.r + b * middle.r + c * after.r, a * before.y + b * middle.y + c * after.y,
                       a * before.ridged + b * middle.ridged + c * after.ridged};
    return p;
}

int shape_candle(size_t rings, size_t sectors, model *out)
{
    if (allocate(out, rings * sectors + 2, 2 * rings * sectors) != 0)
    {
        return -1;
    }
    double length = 0.0;
    for (int i = 0; i < CORNERS - 1; ++i)
    {
        length += segment_length(i);
    }
    for (size_t ring = 0; ring < rings; ++ring)
    {
        const outline p = outline_at(length * ((double)ring + 0.6) / ((double)rings + 0.2));
        for (size_t s = 0; s < sectors; ++s)
        {
            const double phi = 2.0 * PI * (double)s / (double)sectors;
            const double r = p.r * (1.0 + RIDGE * p.ridged * cos(4.0 * phi));
            add_vertex(out, r * cos(phi), p.y, -r * sin(phi));
        }
    }
    const size_t bottom = rings * sectors, hollow = bottom + 1, last = (rings - 1) * sectors;
    add_vertex(out, 0.0, corners[0].y, 0.0);
    add_vertex(out, 0.0, corners[CORNERS - 1].y, 0.0);
    for (size_t s = 0; s < sectors; ++s)
    {
        const size_t next = (s + 1) % sectors;
        add_triangle(out, bottom, next, s);
        add_triangle(out, hollow, last + s, last + next);
        for (size_t ring = 0; ring + 1 < rings; ++ring)
        {
            const size_t a = ring * sectors, b = a + sectors;
            add_triangle(out, a + s, a + next, b + next);
            add_triangle(out, a + s, b + next, b + s);
        }
    }
    return finish(out);
}

// ---- cube ----

static const double ROUNDED = 0.22; // radius of the edges, half an edge being 1

// A point of the sharp cube goes to the sphere of that radius about the nearest point of a smaller cube.
static void add_rounded(model *m, const double p[3])
{
    double inner[3], d[3], length = 0.0;
    for (int k = 0; k < 3; ++k)
    {
        inner[k] = fmax(-(1.0 - ROUNDED), fmin(1.0 - ROUNDED, p[k]));
        d[k] = p[k] - inner[k];
        length += d[k] * d[k];
    }
    length = sqrt(length);
    add_vertex(m, inner[0] + ROUNDED * d[0] / length, inner[1] + ROUNDED * d[1] / length,
               inner[2] + ROUNDED * d[2] / length);
}

// Faces share the vertices of their edges: a lattice point gets its vertex when it is first met.
static size_t lattice_vertex(model *m, uint32_t *index, size_t divisions, const size_t at[3])
{
    uint32_t *const slot = index + (at[0] * (divisions + 1) + at[1]) * (divisions + 1) + at[2];
    if (*slot == UINT32_MAX)
    {
        double p[3];
        for (int k = 0; k < 3; ++k)
        {
            p[k] = 2.0 * (double)at[k] / (double)divisions - 1.0;
        }
        *slot = (uint32_t)m->vertex_count;
        add_rounded(m, p);
    }
    return *slot;
}

static void add_face(model *m, uint32_t *index, size_t n, size_t axis, int far_side)
{
    const size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (size_t i = 0; i < n; ++i)
    {
        for (size_t j = 0; j < n; ++j)
        {
            size_t corner[4];
            for (size_t c = 0; c < 4; ++c) // around the cell, as seen from the far side of the axis
            {
                size_t at[3];
                at[axis] = far_side ? n : 0;
                at[u] = i + (c == 1 || c == 2);
                at[v] = j + (c >= 2);
                corner[far_side ? c : 3 - c] = lattice_vertex(m, index, n, at);
            }
            const size_t flip = (i + j) % 2; // diagonals in both directions favour none
            add_triangle(m, corner[flip], corner[flip + 1], corner[flip + 2]);
            add_triangle(m, corner[flip + 2], corner[(flip + 3) % 4], corner[flip]);
        }
    }
}

int shape_cube(size_t divisions, model *out)
{
    const size_t lattice = (divisions + 1) * (divisions + 1) * (divisions + 1);
    uint32_t *const index = malloc(lattice * sizeof *index);
    if (!index || allocate(out, 6 * divisions * divisions + 2, 12 * divisions * divisions) != 0)
    {
        free(index);
        memset(out, 0, sizeof *out);
        return -1;
    }
    memset(index, 0xff, lattice * sizeof *index);
    for (size_t side = 0; side < 6; ++side)
    {
        add_face(out, index, divisions, side / 2, (int)(side % 2));
    }
    free(index);
    return finish(out);
}

// ---- deformations ----

void shape_twist(const float *rest, size_t count, double height, double turns, double pinch, float *out)
{
    for (size_t i = 0; i < count; ++i)
    {
        const double x = (double)rest[3 * i], y = (double)rest[3 * i + 1], z = (double)rest[3 * i + 2];
        const double t = fmax(0.0, fmin(1.0, y / height)), angle = 2.0 * PI * turns * t;
        const double waist = 1.0 - pinch * sin(PI * t) * sin(PI * t);
        out[3 * i] = (float)(waist * (cos(angle) * x + sin(angle) * z));
        out[3 * i + 1] = (float)y;
        out[3 * i + 2] = (float)(waist * (cos(angle) * z - sin(angle) * x));
    }
}

// A lattice point's gradient: one of the twelve directions to the middles of a cube's edges, drawn by mixing the bits
// of its coordinates; the product with (x, y, z) is taken at once.
static double gradient(long i, long j, long k, double x, double y, double z)
{
    uint32_t h = (uint32_t)i * 0x8da6b343u ^ (uint32_t)j * 0xd8163841u ^ (uint32_t)k * 0xcb1ab31fu;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    h = (h ^ h >> 15) % 12;
    const double a = h < 8 ? x : y, b = h < 4 ? y : z;
    return (h & 1 ? -a : a) + (h & 2 ? -b : b);
}

static double fade(double t)
{
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0);
}

static double mix(double a, double b, double t)
{
    return a + t * (b - a);
}

double shape_perlin(const double p[3])
{
    const double low[3] = {floor(p[0]), floor(p[1]), floor(p[2])};
    const double x = p[0] - low[0], y = p[1] - low[1], z = p[2] - low[2], u = fade(x), v = fade(y), w = fade(z);
    const long i = (long)low[0], j = (long)low[1], k = (long)low[2];
    double plane[2];
    for (int c = 0; c < 2; ++c)
    {
        plane[c] = mix(mix(gradient(i, j, k + c, x, y, z - c), gradient(i + 1, j, k + c, x - 1.0, y, z - c), u),
                       mix(gradient(i, j + 1, k + c, x, y - 1.0, z - c),
                           gradient(i + 1, j + 1, k + c, x - 1.0, y - 1.0, z - c), u), v);
    }
    return mix(plane[0], plane[1], w);
}

void shape_noise(const float *rest, const float *normals, size_t count, double amplitude, double period,
                 const double offset[3], float *out)
{
    for (size_t i = 0; i < count; ++i)
    {
        double p[3];
        for (size_t k = 0; k < 3; ++k)
        {
            p[k] = (double)rest[3 * i + k] / period + offset[k];
        }
        const double height = amplitude * shape_perlin(p);
        for (size_t k = 0; k < 3; ++k)
        {
            out[3 * i + k] = (float)((double)rest[3 * i + k] + height * (double)normals[3 * i + k]);
        }
    }
}
