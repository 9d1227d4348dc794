#define SSS_DIPOLE_IMPLEMENTATION
#include "runs.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum
{
    LINE_SIZE = 2048,
    COLUMNS_MAX = 32
};

static const double UNIT_TRIANGLE = 0.43301270189221932; // sqrt(3)/4, area of the equilateral triangle of edge 1

// ---- lines and columns ----

typedef struct table
{
    char header[LINE_SIZE], line[LINE_SIZE];
    char *names[COLUMNS_MAX], *fields[COLUMNS_MAX];
    size_t count;
} table;

static size_t split(char *line, char **fields)
{
    size_t count = 0;
    line[strcspn(line, "\r\n")] = '\0';
    for (char *at = line; at && count < COLUMNS_MAX;)
    {
        fields[count++] = at;
        at = strchr(at, ',');
        if (at)
        {
            *at++ = '\0';
        }
    }
    return count;
}

// "" where there is no such column.
static const char *field(const table *t, const char *name)
{
    for (size_t i = 0; i < t->count; ++i)
    {
        if (strcmp(t->names[i], name) == 0)
        {
            return t->fields[i];
        }
    }
    return "";
}

static double number(const table *t, const char *name, double missing)
{
    const char *const text = field(t, name);
    char *end;
    const double value = strtod(text, &end);
    return end != text && *end == '\0' ? value : missing;
}

// key=value of the parameters, which ';' separates.
static int parameter(const char *parameters, const char *key, char *value, size_t size)
{
    const size_t length = strlen(key);
    for (const char *at = parameters; at; at = strchr(at, ';') ? strchr(at, ';') + 1 : NULL)
    {
        if (strncmp(at, key, length) == 0 && at[length] == '=')
        {
            snprintf(value, size, "%.*s", (int)strcspn(at + length + 1, ";"), at + length + 1);
            return 1;
        }
    }
    return 0;
}

static double parameter_number(const char *parameters, const char *key, double missing)
{
    char value[64];
    return parameter(parameters, key, value, sizeof value) ? strtod(value, NULL) : missing;
}

// ---- what a line says ----

static int storage_of(const char *parameters)
{
    static const char *const names[] = {"references", "harmonics", "table", "float", "vectors"}; // as sss_hao_storage
    char value[64] = "references";
    parameter(parameters, "storage", value, sizeof value);
    for (int i = 0; i < (int)(sizeof names / sizeof names[0]); ++i)
    {
        if (strcmp(value, names[i]) == 0)
        {
            return i;
        }
    }
    return -1;
}

static void take_run(const table *t, measured_run *run)
{
    const char *const parameters = field(t, "parameters");
    const double triangles = number(t, "triangles", 1.0);
    const double share = parameter_number(parameters, "emitters", triangles) / triangles;
    const int direct = strncmp(field(t, "method"), "direct", 6) == 0;
    snprintf(run->method, sizeof run->method, "%s", field(t, "method"));
    run->tolerance = parameter_number(parameters, "tolerance", 0.0);
    run->density = direct ? pow(4.0, round(log(share) / log(4.0))) : 1.0;
    run->directions = (int)parameter_number(parameters, "directions", 0.0);
    run->storage = strcmp(run->method, "hao") == 0 ? storage_of(parameters) : 0;
    run->precompute_s = number(t, "precompute_s", 0.0);
    run->frame_ms = number(t, "frame_ms", 0.0);
    run->rebuild_ms = number(t, "rebuild_ms", 1e3 * run->precompute_s); // where it is not told: all anew
    run->bytes = number(t, "bytes", 0.0);
    run->rel_l2 = number(t, "rel_l2", NAN);
}

static int take_case(const table *t, measured_case *c)
{
    sss_dipole_material material;
    sss_dipole_scene *const s = &c->scene;
    memset(c, 0, sizeof *c);
    snprintf(c->mesh, sizeof c->mesh, "%s", field(t, "mesh"));
    snprintf(c->material, sizeof c->material, "%s", field(t, "material"));
    snprintf(c->light, sizeof c->light, "%s", field(t, "light"));
    snprintf(c->name, sizeof c->name, "%s %s mm %s %s", c->mesh, field(t, "size_mm"), c->material, c->light);
    s->size_mm = number(t, "size_mm", 0.0);
    s->vertex_count = (size_t)number(t, "vertices", 0.0);
    s->triangle_count = (size_t)number(t, "triangles", 0.0);
    s->lighting = strcmp(c->light, "edge") == 0          ? SSS_DIPOLE_LIGHTING_ANY
                  : strcmp(c->light, "environment") == 0 ? SSS_DIPOLE_LIGHTING_EVEN
                                                         : SSS_DIPOLE_LIGHTING_DISTANT;
    c->model_l2 = -1.0;
    return sss_dipole_material_by_name(c->material, &material) != SSS_OK ||
           sss_dipole_profile(&material, SSS_DIPOLE_FRESNEL_EXACT, &c->profile) != SSS_OK;
}

static void complete_case(const table *t, const measured_run *run, measured_case *c)
{
    sss_dipole_scene *const s = &c->scene;
    const double spacing = parameter_number(field(t, "parameters"), "spacing_mm", 0.0);
    if (spacing > 0.0 && run->density > 0.5)
    {
        s->spacing_mm = spacing;
    }
    const double error = number(t, "model_l2", -1.0);
    if (error > 0.0 && strncmp(run->method, "lambert", 7) != 0 && !(c->model_l2 > 0.0 && c->model_l2 < error))
    {
        c->model_l2 = error;
    }
}

// Of a mesh that is not known, area and spacing follow from each other.
static void derive_missing(measured_case *c, const measured_mesh *meshes, size_t mesh_count)
{
    sss_dipole_scene *const s = &c->scene;
    const double triangles = (double)s->triangle_count, size = s->size_mm;
    for (size_t i = 0; i < mesh_count; ++i)
    {
        if (strcmp(meshes[i].name, c->mesh) == 0)
        {
            s->area_mm2 = meshes[i].area_mm2 * size * size;
            s->volume_mm3 = meshes[i].volume_mm3 * size * size * size;
            s->spacing_mm = meshes[i].spacing_mm * size;
        }
    }
    if (!(s->area_mm2 > 0.0) && s->spacing_mm > 0.0)
    {
        s->area_mm2 = UNIT_TRIANGLE * s->spacing_mm * s->spacing_mm * triangles;
    }
    if (!(s->spacing_mm > 0.0) && s->area_mm2 > 0.0)
    {
        s->spacing_mm = sqrt(s->area_mm2 / (UNIT_TRIANGLE * triangles));
    }
}

// ---- the file ----

static size_t find_case(const table *t, measured *m)
{
    measured_case wanted;
    if (take_case(t, &wanted) != 0)
    {
        fprintf(stderr, "there is no material '%s'\n", field(t, "material"));
        return (size_t)-1;
    }
    for (size_t i = 0; i < m->case_count; ++i)
    {
        if (strcmp(m->cases[i].name, wanted.name) == 0)
        {
            return i;
        }
    }
    m->cases[m->case_count] = wanted;
    return m->case_count++;
}

static int read_lines(FILE *file, table *t, measured *m)
{
    size_t capacity = 0;
    while (fgets(t->line, sizeof t->line, file))
    {
        if (split(t->line, t->fields) != t->count)
        {
            fprintf(stderr, "a line has not as many columns as the first: %s ...\n", t->line);
            return 1;
        }
        if (m->run_count == capacity)
        {
            capacity = 2 * capacity + 64;
            measured_run *const runs = (measured_run *)realloc(m->runs, capacity * sizeof *runs);
            m->runs = runs ? runs : m->runs;
            measured_case *const cases = (measured_case *)realloc(m->cases, capacity * sizeof *cases);
            m->cases = cases ? cases : m->cases;
            if (!runs || !cases)
            {
                fprintf(stderr, "out of memory\n");
                return 1;
            }
        }
        measured_run *const run = &m->runs[m->run_count];
        memset(run, 0, sizeof *run);
        take_run(t, run);
        run->which = find_case(t, m);
        if (run->which == (size_t)-1 || !(run->frame_ms > 0.0) || !(run->rel_l2 > 0.0) || run->storage < 0)
        {
            fprintf(stderr, "run %zu (%s) makes no sense\n", m->run_count + 1, run->method);
            return 1;
        }
        complete_case(t, run, &m->cases[run->which]);
        ++m->run_count;
    }
    return 0;
}

size_t meshes_read(const char *path, measured_mesh out[MESHES_MAX])
{
    static table t;
    size_t count = 0;
    FILE *const file = fopen(path, "r");
    if (!file || !fgets(t.header, sizeof t.header, file))
    {
        perror(path);
    }
    else
    {
        t.count = split(t.header, t.names);
        while (count < MESHES_MAX && fgets(t.line, sizeof t.line, file) && split(t.line, t.fields) == t.count)
        {
            measured_mesh *const m = &out[count++];
            memset(m, 0, sizeof *m);
            snprintf(m->name, sizeof m->name, "%s", field(&t, "mesh"));
            m->area_mm2 = number(&t, "area_mm2", 0.0);
            m->volume_mm3 = number(&t, "volume_mm3", 0.0);
            m->spacing_mm = number(&t, "spacing_mm", 0.0);
        }
    }
    if (file)
    {
        fclose(file);
    }
    return count;
}

int measured_read(const char *path, const measured_mesh *meshes, size_t mesh_count, measured *out)
{
    static table t;
    memset(out, 0, sizeof *out);
    FILE *const file = fopen(path, "r");
    if (!file || !fgets(t.header, sizeof t.header, file))
    {
        perror(path);
        if (file)
        {
            fclose(file);
        }
        return 1;
    }
    t.count = split(t.header, t.names);
    const int failed = read_lines(file, &t, out);
    fclose(file);
    for (size_t i = 0; i < out->case_count; ++i)
    {
        derive_missing(&out->cases[i], meshes, mesh_count);
    }
    if (failed || out->run_count == 0)
    {
        fprintf(stderr, "%s: no chart\n", path);
        measured_free(out);
        return 1;
    }
    return 0;
}

void measured_free(measured *m)
{
    free(m->runs);
    free(m->cases);
    memset(m, 0, sizeof *m);
}
