// The meshes of meshes.h.

#include "meshes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int allocate(mesh_data *mesh, size_t vertex_count, size_t triangle_count)
{
    memset(mesh, 0, sizeof *mesh);
    mesh->positions = (float *)calloc(3 * vertex_count + 1, sizeof(float));
    mesh->normals = (float *)calloc(3 * vertex_count + 1, sizeof(float));
    mesh->triangles = (uint32_t *)calloc(3 * triangle_count + 1, sizeof(uint32_t));
    if (mesh->positions == NULL || mesh->normals == NULL || mesh->triangles == NULL)
    {
        mesh_free(mesh);
        return 1;
    }
    mesh->vertex_count = vertex_count;
    mesh->triangle_count = triangle_count;
    return 0;
}

void mesh_free(mesh_data *mesh)
{
    free(mesh->positions);
    free(mesh->normals);
    free(mesh->triangles);
    memset(mesh, 0, sizeof *mesh);
}

int mesh_copy(const mesh_data *in, mesh_data *out)
{
    if (allocate(out, in->vertex_count, in->triangle_count) != 0)
        return 1;
    memcpy(out->positions, in->positions, 3 * in->vertex_count * sizeof(float));
    memcpy(out->normals, in->normals, 3 * in->vertex_count * sizeof(float));
    memcpy(out->triangles, in->triangles, 3 * in->triangle_count * sizeof(uint32_t));
    return 0;
}

sss_mesh mesh_view(const mesh_data *mesh, double mm_per_unit)
{
    sss_mesh view;
    memset(&view, 0, sizeof view);
    view.positions = mesh->positions;
    view.normals = mesh->normals;
    view.triangles = mesh->triangles;
    view.vertex_count = mesh->vertex_count;
    view.triangle_count = mesh->triangle_count;
    view.mm_per_unit = mm_per_unit;
    return view;
}

// ---- Measures ----

// Twice the area times the normal.
static void triangle_cross(const mesh_data *mesh, size_t triangle, double cross[3])
{
    double p[3][3];
    for (size_t k = 0; k < 3; ++k)
        for (size_t axis = 0; axis < 3; ++axis)
            p[k][axis] = mesh->positions[3 * (size_t)mesh->triangles[3 * triangle + k] + axis];
    for (int axis = 0; axis < 3; ++axis)
    {
        const int b = (axis + 1) % 3, c = (axis + 2) % 3;
        cross[axis] = (p[1][b] - p[0][b]) * (p[2][c] - p[0][c]) - (p[1][c] - p[0][c]) * (p[2][b] - p[0][b]);
    }
}

double mesh_triangle_area(const mesh_data *mesh, size_t triangle)
{
    double c[3];
    triangle_cross(mesh, triangle, c);
    return 0.5 * sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
}

double mesh_area(const mesh_data *mesh)
{
    double total = 0.0;
    for (size_t t = 0; t < mesh->triangle_count; ++t)
        total += mesh_triangle_area(mesh, t);
    return total;
}

double mesh_extent(const mesh_data *mesh)
{
    double extent = 0.0;
    for (size_t axis = 0; axis < 3; ++axis)
    {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (size_t v = 0; v < mesh->vertex_count; ++v)
        {
            low = fmin(low, mesh->positions[3 * v + axis]);
            high = fmax(high, mesh->positions[3 * v + axis]);
        }
        extent = fmax(extent, high - low);
    }
    return extent;
}

double mesh_mean_edge(const mesh_data *mesh)
{
    double total = 0.0;
    for (size_t t = 0; t < mesh->triangle_count; ++t)
        for (size_t k = 0; k < 3; ++k)
        {
            const float *a = &mesh->positions[3 * (size_t)mesh->triangles[3 * t + k]];
            const float *b = &mesh->positions[3 * (size_t)mesh->triangles[3 * t + (k + 1) % 3]];
            const double x = (double)a[0] - b[0], y = (double)a[1] - b[1], z = (double)a[2] - b[2];
            total += sqrt(x * x + y * y + z * z);
        }
    return total / (3.0 * (double)mesh->triangle_count);
}

void mesh_vertex_areas(const mesh_data *mesh, double *weights)
{
    for (size_t v = 0; v < mesh->vertex_count; ++v)
        weights[v] = 0.0;
    for (size_t t = 0; t < mesh->triangle_count; ++t)
    {
        const double third = mesh_triangle_area(mesh, t) / 3.0;
        for (size_t k = 0; k < 3; ++k)
            weights[mesh->triangles[3 * t + k]] += third;
    }
}

typedef struct directed_edge
{
    uint32_t low, high;
    int sign;
} directed_edge;

static int by_vertices(const void *a, const void *b)
{
    const directed_edge *const p = (const directed_edge *)a, *const q = (const directed_edge *)b;
    if (p->low != q->low) return p->low < q->low ? -1 : 1;
    return p->high != q->high ? (p->high < q->high ? -1 : 1) : 0;
}

double mesh_border(const mesh_data *mesh)
{
    const size_t count = 3 * mesh->triangle_count;
    directed_edge *const edges = (directed_edge *)malloc((count + 1) * sizeof *edges);
    double sum = 0.0;
    if (edges == NULL) return -1.0;
    for (size_t c = 0; c < count; ++c)
    {
        const uint32_t a = mesh->triangles[c], b = mesh->triangles[c % 3 == 2 ? c - 2 : c + 1];
        edges[c].low = a < b ? a : b;
        edges[c].high = a < b ? b : a;
        edges[c].sign = a < b ? 1 : -1;
    }
    qsort(edges, count, sizeof *edges, by_vertices);
    for (size_t begin = 0, end; begin < count; begin = end)
    {
        const float *const p = &mesh->positions[3 * edges[begin].low];
        const float *const q = &mesh->positions[3 * edges[begin].high];
        int sign = 0;
        for (end = begin; end < count && by_vertices(&edges[begin], &edges[end]) == 0; ++end) sign += edges[end].sign;
        const double x = (double)p[0] - (double)q[0], y = (double)p[1] - (double)q[1], z = (double)p[2] - (double)q[2];
        sum += fabs((double)sign) * sqrt(x * x + y * y + z * z);
    }
    free(edges);
    return sum;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Squared distance of the origin to a + s ab, s in [0, 1].
static double squared_to_segment(const double a[3], const double b[3])
{
    const double ab[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, length2 = dot(ab, ab);
    const double s = length2 > 0.0 ? fmin(fmax(-dot(a, ab) / length2, 0.0), 1.0) : 0.0;
    const double p[3] = {a[0] + s * ab[0], a[1] + s * ab[1], a[2] + s * ab[2]};
    return dot(p, p);
}

// Squared distance of the origin to a triangle: to its plane where the origin lies over it, else to an edge.
static double squared_to_triangle(double p[3][3])
{
    double n[3], e[3][3];
    double nearest = HUGE_VAL;
    int inside = 1;
    for (int k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) e[k][i] = p[(k + 1) % 3][i] - p[k][i];
    n[0] = e[0][1] * e[1][2] - e[0][2] * e[1][1];
    n[1] = e[0][2] * e[1][0] - e[0][0] * e[1][2];
    n[2] = e[0][0] * e[1][1] - e[0][1] * e[1][0];
    for (int k = 0; k < 3; ++k)
    {
        const double outward[3] = {e[k][1] * n[2] - e[k][2] * n[1], e[k][2] * n[0] - e[k][0] * n[2],
                                   e[k][0] * n[1] - e[k][1] * n[0]};
        inside &= dot(p[k], outward) > 0.0; // from the corner to the origin: -p
        nearest = fmin(nearest, squared_to_segment(p[k], p[(k + 1) % 3]));
    }
    return inside ? dot(p[0], n) * dot(p[0], n) / dot(n, n) : nearest;
}

double mesh_distance(const mesh_data *mesh, const double point[3])
{
    double nearest = HUGE_VAL;
    for (size_t t = 0; t < mesh->triangle_count; ++t)
    {
        double p[3][3];
        for (size_t i = 0; i < 9; ++i)
            p[i / 3][i % 3] = (double)mesh->positions[3 * mesh->triangles[3 * t + i / 3] + i % 3] - point[i % 3];
        nearest = fmin(nearest, squared_to_triangle(p));
    }
    return sqrt(nearest);
}

size_t *mesh_vertices_by_area(const mesh_data *mesh, size_t count)
{
    double *area = (double *)malloc(mesh->vertex_count * sizeof *area);
    size_t *index = (size_t *)calloc(count, sizeof *index), next = 0;
    double below = 0.0, total = 0.0;
    if (area == NULL || index == NULL)
    {
        free(area);
        free(index);
        return NULL;
    }
    mesh_vertex_areas(mesh, area);
    for (size_t v = 0; v < mesh->vertex_count; ++v)
        total += area[v];
    for (size_t v = 0; v < mesh->vertex_count && next < count; ++v)
        for (below += area[v]; next < count && ((double)next + 0.5) / (double)count * total < below; ++next)
            index[next] = v;
    free(area);
    return index;
}

void mesh_compute_normals(mesh_data *mesh)
{
    memset(mesh->normals, 0, 3 * mesh->vertex_count * sizeof(float));
    for (size_t t = 0; t < mesh->triangle_count; ++t)
    {
        double c[3];
        triangle_cross(mesh, t, c);
        for (size_t k = 0; k < 3; ++k)
            for (size_t axis = 0; axis < 3; ++axis)
                mesh->normals[3 * (size_t)mesh->triangles[3 * t + k] + axis] += (float)c[axis];
    }
    for (size_t v = 0; v < mesh->vertex_count; ++v)
    {
        float *n = &mesh->normals[3 * v];
        const double length = sqrt((double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2]);
        for (size_t axis = 0; axis < 3; ++axis)
            n[axis] = length > 0.0 ? (float)(n[axis] / length) : (axis == 2 ? 1.0f : 0.0f);
    }
}

int mesh_turn_outward(mesh_data *mesh)
{
    double volume = 0.0; // six times the signed one
    for (size_t t = 0; t < mesh->triangle_count; ++t)
    {
        const float *a = &mesh->positions[3 * (size_t)mesh->triangles[3 * t]];
        const float *b = &mesh->positions[3 * (size_t)mesh->triangles[3 * t + 1]];
        const float *c = &mesh->positions[3 * (size_t)mesh->triangles[3 * t + 2]];
        for (int k = 0; k < 3; ++k)
            volume += (double)a[k] * ((double)b[(k + 1) % 3] * (double)c[(k + 2) % 3] -
                                      (double)b[(k + 2) % 3] * (double)c[(k + 1) % 3]);
    }
    if (!(volume < 0.0))
        return 0;
    for (size_t t = 0; t < mesh->triangle_count; ++t)
    {
        const uint32_t swapped = mesh->triangles[3 * t + 1];
        mesh->triangles[3 * t + 1] = mesh->triangles[3 * t + 2];
        mesh->triangles[3 * t + 2] = swapped;
    }
    for (size_t i = 0; i < 3 * mesh->vertex_count; ++i)
        mesh->normals[i] = -mesh->normals[i];
    return 1;
}

void mesh_transform(mesh_data *mesh, double scale, const double offset[3])
{
    for (size_t v = 0; v < mesh->vertex_count; ++v)
        for (size_t axis = 0; axis < 3; ++axis)
            mesh->positions[3 * v + axis] = (float)((mesh->positions[3 * v + axis] + offset[axis]) * scale);
}

// ---- Made up ----

int mesh_grid(int n, double side, mesh_data *out)
{
    const size_t count = (size_t)n, row = count + 1;
    if (allocate(out, row * row, 2 * count * count) != 0)
        return 1;
    for (size_t j = 0; j < row; ++j)
        for (size_t i = 0; i < row; ++i)
        {
            float *p = &out->positions[3 * (j * row + i)];
            p[0] = (float)(side * ((double)i / (double)count - 0.5));
            p[1] = (float)(side * ((double)j / (double)count - 0.5));
        }
    for (size_t j = 0; j < count; ++j)
        for (size_t i = 0; i < count; ++i)
        {
            uint32_t *t = &out->triangles[6 * (j * count + i)];
            const uint32_t a = (uint32_t)(j * row + i), b = a + 1, c = a + (uint32_t)row, d = c + 1;
            t[0] = a, t[1] = b, t[2] = d;
            t[3] = a, t[4] = d, t[5] = c;
        }
    mesh_compute_normals(out);
    return 0;
}

int mesh_rectangle(double x0, double x1, double y0, double y1, mesh_data *out)
{
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    if (allocate(out, 4, 2) != 0)
        return 1;
    for (size_t v = 0; v < 4; ++v)
    {
        out->positions[3 * v] = (float)((v == 1 || v == 2) ? x1 : x0);
        out->positions[3 * v + 1] = (float)(v >= 2 ? y1 : y0);
    }
    memcpy(out->triangles, triangles, sizeof triangles);
    mesh_compute_normals(out);
    return 0;
}

// Subdivides one octant: points i, j with i + j <= n on the face of the octahedron, pushed out to the sphere. Octants
// keep their own copies of shared edges; positions agree exactly, since they are computed from the same integers.
static void fill_octant(mesh_data *out, size_t octant, size_t n, double radius)
{
    const size_t points = (n + 1) * (n + 2) / 2;
    const double sign[3] = {(octant & 1) ? -1.0 : 1.0, (octant & 2) ? -1.0 : 1.0, (octant & 4) ? -1.0 : 1.0};
    const int flipped = sign[0] * sign[1] * sign[2] < 0.0;
    size_t v = octant * points, t = octant * n * n;
    const size_t first = v;
    for (size_t j = 0; j <= n; ++j)
        for (size_t i = 0; i + j <= n; ++i, ++v)
        {
            const double x = (double)(n - i - j), y = (double)i, z = (double)j;
            const double length = sqrt(x * x + y * y + z * z);
            const double c[3] = {sign[0] * x / length, sign[1] * y / length, sign[2] * z / length};
            for (size_t axis = 0; axis < 3; ++axis)
            {
                out->normals[3 * v + axis] = (float)c[axis];
                out->positions[3 * v + axis] = (float)(radius * c[axis]);
            }
        }
    for (size_t j = 0; j < n; ++j)
        for (size_t i = 0; i + j < n; ++i)
        {
            const size_t row = first + j * (n + 1) - (j * (j > 0 ? j - 1 : 0)) / 2; // rows shrink by one
            const size_t above = row + (n + 1 - j);
            for (int upper = 0; upper <= (i + j + 1 < n ? 1 : 0); ++upper, ++t)
            {
                const size_t a = upper ? row + i + 1 : row + i;
                const size_t b = upper ? above + i + 1 : row + i + 1;
                const size_t c = above + i;
                out->triangles[3 * t] = (uint32_t)a;
                out->triangles[3 * t + 1] = (uint32_t)(flipped ? c : b);
                out->triangles[3 * t + 2] = (uint32_t)(flipped ? b : c);
            }
        }
}

int mesh_sphere(int levels, double radius, mesh_data *out)
{
    const size_t n = (size_t)1 << levels;
    if (allocate(out, 8 * (n + 1) * (n + 2) / 2, 8 * n * n) != 0)
        return 1;
    for (size_t octant = 0; octant < 8; ++octant)
        fill_octant(out, octant, n, radius);
    return 0;
}

// ---- Loaded ----

// One corner of a face: "v", "v/t", "v//n" or "v/t/n"; 0-based vertex, or -1.
static long read_corner(char **cursor, size_t vertex_count)
{
    char *end = *cursor;
    const long index = strtol(*cursor, &end, 10);
    if (end == *cursor)
        return -1;
    while (*end != '\0' && *end != ' ' && *end != '\t' && *end != '\r' && *end != '\n')
        ++end;
    *cursor = end;
    if (index > 0 && (size_t)index <= vertex_count)
        return index - 1;
    if (index < 0 && (size_t)-index <= vertex_count)
        return (long)vertex_count + index;
    return -1;
}

// Counts, or with out->positions set, fills. The file is read twice.
static void read_obj(FILE *file, mesh_data *out, size_t *vertices, size_t *triangles)
{
    char line[1024];
    *vertices = 0;
    *triangles = 0;
    while (fgets(line, sizeof line, file) != NULL)
    {
        if (line[0] == 'v' && line[1] == ' ')
        {
            char *cursor = line + 2;
            for (size_t axis = 0; axis < 3; ++axis)
            {
                const double value = strtod(cursor, &cursor);
                if (out->positions != NULL)
                    out->positions[3 * *vertices + axis] = (float)value;
            }
            ++*vertices;
        }
        else if (line[0] == 'f' && line[1] == ' ')
        {
            char *cursor = line + 2;
            const long first = read_corner(&cursor, *vertices);
            long before = read_corner(&cursor, *vertices);
            for (long corner; first >= 0 && before >= 0 && (corner = read_corner(&cursor, *vertices)) >= 0;
                 before = corner, ++*triangles)
            {
                if (out->triangles == NULL)
                    continue;
                out->triangles[3 * *triangles] = (uint32_t)first;
                out->triangles[3 * *triangles + 1] = (uint32_t)before;
                out->triangles[3 * *triangles + 2] = (uint32_t)corner;
            }
        }
    }
}

int mesh_load_obj(const char *path, mesh_data *out)
{
    size_t vertices, triangles;
    FILE *file = fopen(path, "rb");
    memset(out, 0, sizeof *out);
    if (file == NULL)
        return 1;
    read_obj(file, out, &vertices, &triangles);
    if (vertices == 0 || triangles == 0 || allocate(out, vertices, triangles) != 0)
    {
        (void)fclose(file);
        return 1;
    }
    rewind(file);
    read_obj(file, out, &vertices, &triangles);
    (void)fclose(file);
    mesh_compute_normals(out);
    return 0;
}

int mesh_load_bunny(mesh_data *out)
{
    return mesh_load_obj("/usr/share/glmark2/models/bunny.obj", out);
}

static uint32_t read_32(const unsigned char *bytes)
{
    return (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
}

// The number behind "name": within an object of JSON that begins at text, or otherwise where it lacks.
static size_t json_number(const char *text, const char *name, size_t otherwise)
{
    const char *end = strchr(text, '}'), *found = strstr(text, name);
    if (found == NULL || (end != NULL && found > end))
        return otherwise;
    return (size_t)strtoul(found + strlen(name), NULL, 10);
}

// Object number index of the array "name":[{...},...], whose objects hold no others.
static const char *json_object(const char *json, const char *name, size_t index)
{
    const char *at = strstr(json, name);
    for (size_t i = 0; at != NULL && i <= index; ++i)
        at = strchr(at + 1, '{');
    return at;
}

// The bytes of an accessor, `width` each; NULL where they lie beyond the end.
static const unsigned char *glb_accessor(const char *json, const unsigned char *binary, size_t bytes, size_t index,
                                         size_t width, size_t *count)
{
    const char *accessor = json_object(json, "\"accessors\":[", index), *view;
    size_t offset;
    if (accessor == NULL)
        return NULL;
    view = json_object(json, "\"bufferViews\":[", json_number(accessor, "\"bufferView\":", 0));
    *count = json_number(accessor, "\"count\":", 0);
    if (view == NULL)
        return NULL;
    offset = json_number(accessor, "\"byteOffset\":", 0) + json_number(view, "\"byteOffset\":", 0);
    return *count > 0 && offset < bytes && *count <= (bytes - offset) / width ? binary + offset : NULL;
}

static int read_glb(const char *json, const unsigned char *binary, size_t bytes, mesh_data *out)
{
    const char *primitive = strstr(json, "\"POSITION\":"), *at = strstr(json, "\"indices\":");
    if (primitive == NULL || at == NULL)
        return 1;
    const size_t index = (size_t)strtoul(at + 10, NULL, 10);
    const char *accessor = json_object(json, "\"accessors\":[", index);
    const size_t width = accessor != NULL && json_number(accessor, "\"componentType\":", 0) == 5123 ? 2 : 4;
    size_t vertices = 0, corners = 0;
    const size_t positions = (size_t)strtoul(primitive + 11, NULL, 10);
    const unsigned char *p = glb_accessor(json, binary, bytes, positions, 12, &vertices);
    const unsigned char *i = glb_accessor(json, binary, bytes, index, width, &corners);
    if (p == NULL || i == NULL || allocate(out, vertices, corners / 3) != 0)
        return 1;
    for (size_t k = 0; k < 3 * vertices; ++k)
    {
        const uint32_t bits = read_32(p + 4 * k);
        memcpy(&out->positions[k], &bits, sizeof bits);
    }
    for (size_t k = 0; k < corners; ++k)
    {
        out->triangles[k] = width == 4 ? read_32(i + 4 * k) : (uint32_t)i[2 * k] | (uint32_t)i[2 * k + 1] << 8;
        if (out->triangles[k] >= vertices)
            return 1;
    }
    mesh_compute_normals(out);
    return 0;
}

int mesh_load_glb(const char *path, mesh_data *out)
{
    FILE *file = fopen(path, "rb");
    long size = -1;
    int result = 1;
    memset(out, 0, sizeof *out);
    if (file == NULL)
        return 1;
    if (fseek(file, 0, SEEK_END) == 0)
        size = ftell(file);
    rewind(file);
    unsigned char *bytes = size > 28 ? (unsigned char *)malloc((size_t)size + 1) : NULL;
    if (bytes != NULL && fread(bytes, 1, (size_t)size, file) == (size_t)size && memcmp(bytes, "glTF", 4) == 0)
    {
        const size_t json = read_32(bytes + 12), head = 20 + json + 8;
        if (json < (size_t)size && head < (size_t)size)
        {
            bytes[20 + json] = '\0'; // the length of the next chunk, which the file's size tells as well
            result = read_glb((const char *)bytes + 20, bytes + head, (size_t)size - head, out);
        }
    }
    if (result != 0)
        mesh_free(out);
    free(bytes);
    (void)fclose(file);
    return result;
}

static int read_ply(FILE *file, mesh_data *out)
{
    char line[1024];
    size_t vertices = 0, triangles = 0, corners = 0;
    while (fgets(line, sizeof line, file) != NULL && strncmp(line, "end_header", 10) != 0)
    {
        if (strncmp(line, "element vertex ", 15) == 0)
            vertices = (size_t)strtoul(line + 15, NULL, 10);
        if (strncmp(line, "element face ", 13) == 0)
            triangles = (size_t)strtoul(line + 13, NULL, 10);
    }
    if (vertices == 0 || triangles == 0 || allocate(out, vertices, triangles) != 0)
        return 1;
    for (size_t v = 0; v < vertices && fgets(line, sizeof line, file) != NULL; ++v)
    {
        char *cursor = line;
        for (size_t axis = 0; axis < 3; ++axis)
            out->positions[3 * v + axis] = strtof(cursor, &cursor);
    }
    for (size_t t = 0; t < triangles && fgets(line, sizeof line, file) != NULL; ++t)
    {
        char *cursor = line;
        if (strtoul(cursor, &cursor, 10) != 3)
            return 1;
        for (size_t k = 0; k < 3; ++k, ++corners)
        {
            out->triangles[3 * t + k] = (uint32_t)strtoul(cursor, &cursor, 10);
            if (out->triangles[3 * t + k] >= vertices)
                return 1;
        }
    }
    return corners == 3 * triangles ? 0 : 1;
}

int mesh_load_ply(const char *path, mesh_data *out)
{
    FILE *file = fopen(path, "rb");
    memset(out, 0, sizeof *out);
    if (file == NULL)
        return 1;
    const int result = read_ply(file, out);
    (void)fclose(file);
    if (result != 0)
        mesh_free(out);
    else
        mesh_compute_normals(out);
    return result;
}

int mesh_load_model(const char *name, mesh_data *out)
{
    const char *folders[3] = {getenv("SSS_MODELS"), "build/models", "../shared/models"};
    char path[512];
    if (strcmp(name, "bunny") == 0)
        return mesh_load_bunny(out);
    memset(out, 0, sizeof *out);
    for (size_t i = 0; i < 3; ++i)
    {
        if (folders[i] == NULL)
            continue;
        (void)snprintf(path, sizeof path, "%s/%s.glb", folders[i], name);
        if (mesh_load_glb(path, out) == 0)
            return 0;
        (void)snprintf(path, sizeof path, "%s/%s.ply", folders[i], name);
        if (mesh_load_ply(path, out) == 0)
            return 0;
    }
    return 1;
}

// ---- Made from others ----

int mesh_make(const float *positions, size_t vertex_count, const uint32_t *triangles, size_t triangle_count,
              mesh_data *out)
{
    if (allocate(out, vertex_count, triangle_count) != 0)
        return 1;
    memcpy(out->positions, positions, 3 * vertex_count * sizeof(float));
    memcpy(out->triangles, triangles, 3 * triangle_count * sizeof(uint32_t));
    mesh_compute_normals(out);
    return 0;
}

int mesh_sheet(int n, int m, void (*point)(double s, double t, double out[3]), mesh_data *out)
{
    const size_t columns = (size_t)n + 1, rows = (size_t)m + 1;
    if (allocate(out, columns * rows, 2 * (size_t)n * (size_t)m) != 0)
        return 1;
    for (size_t j = 0; j < rows; ++j)
        for (size_t i = 0; i < columns; ++i)
        {
            double p[3];
            point((double)i / n, (double)j / m, p);
            for (size_t axis = 0; axis < 3; ++axis)
                out->positions[3 * (j * columns + i) + axis] = (float)p[axis];
        }
    for (size_t j = 0; j + 1 < rows; ++j)
        for (size_t i = 0; i + 1 < columns; ++i)
        {
            uint32_t *t = &out->triangles[6 * (j * (columns - 1) + i)];
            const uint32_t a = (uint32_t)(j * columns + i), b = a + 1, c = a + (uint32_t)columns, d = c + 1;
            t[0] = a, t[1] = b, t[2] = d;
            t[3] = a, t[4] = d, t[5] = c;
        }
    mesh_compute_normals(out);
    return 0;
}

typedef struct edge_of_corner
{
    uint32_t low, high, corner; // corner k of triangle t is 3 t + k, its edge runs to the next corner
} edge_of_corner;

static int by_ends(const void *a, const void *b)
{
    const edge_of_corner *x = (const edge_of_corner *)a, *y = (const edge_of_corner *)b;
    if (x->low != y->low)
        return x->low < y->low ? -1 : 1;
    if (x->high != y->high)
        return x->high < y->high ? -1 : 1;
    return x->corner < y->corner ? -1 : x->corner > y->corner;
}

int mesh_refine(const mesh_data *in, mesh_data *out)
{
    const size_t corners = 3 * in->triangle_count;
    edge_of_corner *edges = (edge_of_corner *)malloc((corners + 1) * sizeof *edges);
    uint32_t *middle = (uint32_t *)malloc((corners + 1) * sizeof *middle);
    size_t count = 0;
    memset(out, 0, sizeof *out);
    for (size_t c = 0; edges != NULL && c < corners; ++c)
    {
        const uint32_t a = in->triangles[c], b = in->triangles[c % 3 == 2 ? c - 2 : c + 1];
        edges[c].low = a < b ? a : b;
        edges[c].high = a < b ? b : a;
        edges[c].corner = (uint32_t)c;
    }
    if (edges != NULL)
        qsort(edges, corners, sizeof *edges, by_ends);
    for (size_t i = 0; edges != NULL && middle != NULL && i < corners; ++i)
    {
        count += i == 0 || edges[i].low != edges[i - 1].low || edges[i].high != edges[i - 1].high;
        middle[edges[i].corner] = (uint32_t)(in->vertex_count + count - 1);
    }
    if (edges == NULL || middle == NULL || allocate(out, in->vertex_count + count, 4 * in->triangle_count) != 0)
    {
        free(edges);
        free(middle);
        return 1;
    }
    memcpy(out->positions, in->positions, 3 * in->vertex_count * sizeof(float));
    for (size_t i = 0; i < corners; ++i)
    {
        const float *a = &in->positions[3 * (size_t)edges[i].low], *b = &in->positions[3 * (size_t)edges[i].high];
        for (size_t axis = 0; axis < 3; ++axis)
            out->positions[3 * (size_t)middle[edges[i].corner] + axis] = 0.5f * (a[axis] + b[axis]);
    }
    for (size_t t = 0; t < in->triangle_count; ++t)
    {
        const uint32_t *v = &in->triangles[3 * t], *m = &middle[3 * t];
        const uint32_t four[12] = {v[0], m[0], m[2], m[0], v[1], m[1], m[2], m[1], v[2], m[0], m[1], m[2]};
        memcpy(&out->triangles[12 * t], four, sizeof four);
    }
    mesh_compute_normals(out);
    free(edges);
    free(middle);
    return 0;
}

typedef struct place_of_vertex
{
    float p[3];
    uint32_t vertex;
} place_of_vertex;

static int by_place(const void *a, const void *b)
{
    const place_of_vertex *x = (const place_of_vertex *)a, *y = (const place_of_vertex *)b;
    const int order = memcmp(x->p, y->p, sizeof x->p);
    return order != 0 ? order : (x->vertex < y->vertex ? -1 : x->vertex > y->vertex);
}

int mesh_weld(const mesh_data *in, mesh_data *out)
{
    place_of_vertex *places = (place_of_vertex *)malloc((in->vertex_count + 1) * sizeof *places);
    uint32_t *to = (uint32_t *)malloc((in->vertex_count + 1) * sizeof *to);
    size_t count = 0;
    if (places == NULL || to == NULL || mesh_copy(in, out) != 0)
    {
        free(places);
        free(to);
        return 1;
    }
    for (size_t v = 0; v < in->vertex_count; ++v)
    {
        for (size_t axis = 0; axis < 3; ++axis)
            places[v].p[axis] = in->positions[3 * v + axis] + 0.0f; // -0 becomes 0
        places[v].vertex = (uint32_t)v;
    }
    qsort(places, in->vertex_count, sizeof *places, by_place);
    for (size_t i = 0; i < in->vertex_count; ++i)
    {
        if (i == 0 || memcmp(places[i].p, places[i - 1].p, sizeof places[i].p) != 0)
            memcpy(&out->positions[3 * count++], places[i].p, sizeof places[i].p);
        to[places[i].vertex] = (uint32_t)(count - 1);
    }
    out->vertex_count = count;
    for (size_t c = 0; c < 3 * in->triangle_count; ++c)
        out->triangles[c] = to[in->triangles[c]];
    mesh_compute_normals(out);
    free(places);
    free(to);
    return 0;
}

int mesh_closed_sphere(int levels, double radius, mesh_data *out)
{
    mesh_data octants;
    memset(out, 0, sizeof *out);
    if (mesh_sphere(levels, radius, &octants) != 0)
    {
        return 1;
    }
    const int failed = mesh_weld(&octants, out);
    mesh_free(&octants);
    return failed;
}

int mesh_append(mesh_data *to, const mesh_data *from)
{
    mesh_data sum;
    const size_t V = to->vertex_count, T = to->triangle_count;
    if (allocate(&sum, V + from->vertex_count, T + from->triangle_count) != 0)
    {
        return 1;
    }
    memcpy(sum.positions, to->positions, 3 * V * sizeof(float));
    memcpy(sum.normals, to->normals, 3 * V * sizeof(float));
    memcpy(sum.triangles, to->triangles, 3 * T * sizeof(uint32_t));
    memcpy(sum.positions + 3 * V, from->positions, 3 * from->vertex_count * sizeof(float));
    memcpy(sum.normals + 3 * V, from->normals, 3 * from->vertex_count * sizeof(float));
    for (size_t i = 0; i < 3 * from->triangle_count; ++i)
    {
        sum.triangles[3 * T + i] = from->triangles[i] + (uint32_t)V;
    }
    mesh_free(to);
    *to = sum;
    return 0;
}

// ---- Thinned ----

typedef struct cell_of_vertex
{
    int64_t key;
    uint32_t vertex;
} cell_of_vertex;

static int by_key(const void *a, const void *b)
{
    const int64_t x = ((const cell_of_vertex *)a)->key, y = ((const cell_of_vertex *)b)->key;
    return x < y ? -1 : (x > y ? 1 : 0);
}

typedef struct sorted_triangle
{
    uint32_t v[3];     // smallest index first, order around kept
} sorted_triangle;

static int by_corners(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(sorted_triangle));
}

// The cluster of each vertex and the clusters' mean positions (as vertices of out); the number of clusters.
static size_t cluster_vertices(const mesh_data *in, double cell, cell_of_vertex *cells, uint32_t *cluster, float *means)
{
    size_t count = 0;
    double sum[3] = {0.0, 0.0, 0.0}, members = 0.0;
    for (size_t v = 0; v < in->vertex_count; ++v)
    {
        int64_t key = 0;
        for (size_t axis = 0; axis < 3; ++axis)
            key = key * 2097152 + ((int64_t)floor(in->positions[3 * v + axis] / cell) + 1048576);
        cells[v].key = key;
        cells[v].vertex = (uint32_t)v;
    }
    qsort(cells, in->vertex_count, sizeof *cells, by_key);
    for (size_t i = 0; i < in->vertex_count; ++i)
    {
        const size_t v = cells[i].vertex;
        cluster[v] = (uint32_t)count;
        members += 1.0;
        for (size_t axis = 0; axis < 3; ++axis)
            sum[axis] += in->positions[3 * v + axis];
        if (i + 1 < in->vertex_count && cells[i + 1].key == cells[i].key)
            continue;
        for (size_t axis = 0; axis < 3; ++axis)
        {
            means[3 * count + axis] = (float)(sum[axis] / members);
            sum[axis] = 0.0;
        }
        members = 0.0;
        ++count;
    }
    return count;
}

static size_t cluster_triangles(const mesh_data *in, const uint32_t *cluster, sorted_triangle *kept)
{
    size_t count = 0, unique = 0;
    for (size_t t = 0; t < in->triangle_count; ++t)
    {
        uint32_t c[3];
        size_t least = 0;
        for (size_t k = 0; k < 3; ++k)
        {
            c[k] = cluster[in->triangles[3 * t + k]];
            least = c[k] < c[least] ? k : least;
        }
        if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0])
            continue;
        for (size_t k = 0; k < 3; ++k)
            kept[count].v[k] = c[(least + k) % 3];
        ++count;
    }
    qsort(kept, count, sizeof *kept, by_corners);
    for (size_t i = 0; i < count; ++i)
        if (unique == 0 || by_corners(&kept[unique - 1], &kept[i]) != 0)
            kept[unique++] = kept[i];
    return unique;
}

int mesh_cluster(const mesh_data *in, double cell, mesh_data *out)
{
    int result = 1;
    cell_of_vertex *cells = (cell_of_vertex *)malloc(in->vertex_count * sizeof *cells);
    uint32_t *cluster = (uint32_t *)malloc(in->vertex_count * sizeof *cluster);
    float *means = (float *)malloc(3 * in->vertex_count * sizeof *means);
    sorted_triangle *kept = (sorted_triangle *)malloc(in->triangle_count * sizeof *kept);
    memset(out, 0, sizeof *out);
    if (cells != NULL && cluster != NULL && means != NULL && kept != NULL)
    {
        const size_t vertices = cluster_vertices(in, cell, cells, cluster, means);
        const size_t triangles = cluster_triangles(in, cluster, kept);
        if (triangles > 0 && allocate(out, vertices, triangles) == 0)
        {
            memcpy(out->positions, means, 3 * vertices * sizeof *means);
            for (size_t t = 0; t < triangles; ++t)
                memcpy(&out->triangles[3 * t], kept[t].v, sizeof kept[t].v);
            mesh_compute_normals(out);
            result = 0;
        }
    }
    free(cells);
    free(cluster);
    free(means);
    free(kept);
    return result;
}

int mesh_decimate(const mesh_data *in, double factor, mesh_data *out)
{
    const double want = (double)in->triangle_count / factor;
    double low = mesh_mean_edge(in) * 0.1, high = mesh_extent(in);
    memset(out, 0, sizeof *out);
    for (int step = 0; step < 20; ++step)
    {
        const double cell = sqrt(low * high);
        mesh_free(out);
        if (mesh_cluster(in, cell, out) != 0)
            high = cell;
        else if ((double)out->triangle_count > want * 1.02)
            low = cell;
        else if ((double)out->triangle_count < want * 0.98)
            high = cell;
        else
            return 0;
    }
    return out->triangle_count > 0 ? 0 : 1;
}
