// bake: mesh in, shaded mesh out. Reads a glTF scene, lights it, lets the light travel inside the material, and
// writes the radiosity at the vertices as a coloured mesh, a picture, or plain floats.   bake --help

#define _POSIX_C_SOURCE 200809L // stat, access

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define SSS_DIPOLE_IMPLEMENTATION
#include "../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../sss_bem.h"
#define SSS_ATLAS_IMPLEMENTATION
#include "../sss_atlas.h"
#define SSS_HAO_IMPLEMENTATION
#include "../sss_hao.h"

#include "../tests/chart/chart.h"
#include "../tests/common/reference.h"
#include "common/atlas_report.h"
#include "common/atlas_texture.h"
#include "common/camera.h"
#include "common/gl_context.h"
#include "common/image.h"
#include "common/lights.h"
#include "common/methods.h"
#include "common/model.h"
#include "common/services.h"
#include "common/shade.h"
#include "common/threads.h"

enum
{
    EXIT_BAD = 2,
    TEXT_SIZE = 1024,
    PATH_SIZE = 4096,
    ATLAS_SIZE = 1024,
    SUPERSAMPLE = 4 // samples a pixel along each side
};

static const double MM_PER_METRE = 1000.0; // glTF's unit of length is the metre
static const double FLOOR_ROOM = 0.07;     // share of the object's size by which the picture moves down for its image
static const double SPURIOUS = 0.001;      // share of vertices above which placed sources are warned of
static const double ETA = 1.3;             // of the measured materials of Jensen et al. 2001
// What --method direct gathers at texels unasked, in pairs of a texel and a far triangle; near ones cost each texel as
// much as NEAR_PAIRS.
static const double MOST_PAIRS = 2e10, NEAR_PAIRS = 2e4;

// ---- options ----

typedef struct options
{
    const char *in, *method, *material, *out, *png, *dump, *dump_irradiance, *irradiance, *geometry, *exit;
    const char *atlas, *atlas_png, *atlas_method, *atlas_values, *storage, *cache, *changes;
    const char *program, *chart_folder;
    double sigma_s[3], sigma_a[3], albedo[3], mfp[3]; // NaN: not given
    double eta, size_mm, mm_per_unit, tolerance, guard, exposure, roughness, floor, soft, azimuth, elevation, zoom;
    double ambient[3], background[3], budget_ms;
    unsigned changing; // of --changes
    int width, height, threads, reference, atlas_size, directions, references, order; // 0: not given
    int no_shadows, report, chart, help;
    lights lights;
} options;

// What everything hangs on; freed in one place.
typedef struct bake
{
    options o;
    model model;
    sss_dipole_material material;
    sss_profile profile;
    sss_mesh mesh;
    double size_mm, area_mm2, edge_mm, irradiance_ms;
    double rel_l2, rel_max, reference_error; // of --reference
    size_t reference_receivers;
    size_t spurious;                         // vertices brighter than any light on the surface
    float *irradiance, *seen, *radiosity;
    method_job job;
    method_result result;
    atlas_texture atlas;
    char error[TEXT_SIZE];
} bake;

static int fail(bake *b, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(b->error, sizeof b->error, format, arguments);
    va_end(arguments);
    return -1;
}

static const char usage[] =
    "usage: bake IN.glb [options]\n"
    "\n"
    "Lights a mesh, lets the light travel inside its material, and writes the radiosity at its vertices.\n"
    "\n"
    "material, one of\n"
    "  --material NAME         measured: ";

static const char usage_after_materials[] =
    "  --sigma-s R,G,B --sigma-a R,G,B   reduced scattering and absorption coefficients, 1/mm\n"
    "  --albedo R,G,B --mfp R,G,B        diffuse albedo in [0,1] and mean free path, mm\n"
    "  --eta N                 index of refraction over that of the outside (1.3, or the measured material's)\n"
    "size\n"
    "  --size-mm S             largest extent of the object\n"
    "  --mm-per-unit S         length of the file's unit (1000: glTF's unit is the metre)\n"
    "light, at least one of\n"
    "  --light X,Y,Z[,R,G,B]   towards a distant light, and its irradiance in W/mm^2 (1,1,1); up to 8 times\n"
    "  --soft DEGREES          angular radius of the lights (0)\n"
    "  --ambient R,G,B         irradiance from even surroundings (0,0,0)\n"
    "  --irradiance E.f32      float32 [vertices][3], entering Fresnel included, in place of the lights,\n"
    "                          which then only show as reflections\n"
    "  --no-shadows            the object does not shadow itself\n"
    "method\n";

static const char usage_after_methods[] =
    "  --geometry distance|placed|either   where the dipole sits: by distance only, or at the receiver (distance,\n"
    "                          auto: either; bem only places, hao only knows distance)\n"
    "  --tolerance T           relative L2 error allowed (0.001 direct, 0.01 bem and auto, 0.005 the sums of hao)\n"
    "  --guard G               bem: no source gives more than it does G of its depth away, G in [0,1] (1); 0: no\n"
    "                          guard\n"
    "  --threads N             (all processors)\n"
    "auto\n"
    "  --changes LIST          light, geometry, material: what will be computed again, so that only its time counts\n"
    "                          (nothing: a still picture)\n"
    "  --budget-ms T           for each time that something changes\n"
    "hao\n"
    "  --directions N          lights in advance, 4 to 4098 (198)\n"
    "  --storage references|harmonics|table|float|vectors   how integrals are kept (references)\n"
    "  --references N          reference points (1.22 vertices^0.683)\n"
    "  --order N               of spherical harmonics, 1 to 8 (3 with reference points, 7 alone)\n"
    "  --cache FILE            keeps the integrals from run to run: read where they are of this mesh, size, material\n"
    "                          and these options, else written\n"
    "output, at least one of\n"
    "  --out OUT.glb           mesh in the input's vertex order with COLOR_0 = radiosity, linear\n"
    "  --png OUT.png           picture\n"
    "  --atlas OUT.glb         mesh with texture coordinates, vertices split at seams, and the radiosity as its\n"
    "                          base colour texture inside the file: sRGB, white is the brightest texel, whose\n"
    "                          radiosity stands in the material's extras.white and in the report\n"
    "  --atlas-png OUT.png     that texture\n"
    "  --dump B.f32            radiosity, float32 [vertices][3], W/mm^2\n"
    "  --dump-irradiance E.f32 irradiance, float32 [vertices][3]\n"
    "  --report                key=value lines on standard output\n"
    "  --reference N           measures rel_l2 and rel_max against the converged reference at N vertices\n"
    "  --chart [FOLDER]        measures every method over its knobs on this mesh, material and light, no shadows,\n"
    "                          against the converged integral; prints the tables, and writes chart.csv, chart.svg and\n"
    "                          chart.md into the folder; takes minutes. At --reference vertices (100)\n"
    "atlas\n"
    "  --atlas-size N          texels on a side, 1 to 16384 (1024)\n"
    "  --atlas-method orthographic|area|convex   how charts are laid flat (area)\n"
    "  --atlas-values texels|vertices            gathers at every texel, or interpolates between the vertices:\n"
    "                          finer detail on coarse meshes against time (texels with bem, and with direct\n"
    "                          where that takes some twenty seconds of two cores at most; else vertices;\n"
    "                          lambert: always vertices, since it is the same; hao: knows only these)\n"
    "picture\n"
    "  --camera AZIMUTH,ELEVATION[,ZOOM]   degrees; 0,0 looks from +z (25,10,1)\n"
    "  --resolution WIDTHxHEIGHT           (960x960)\n"
    "  --exposure F            times the automatic exposure (1)\n"
    "  --exit paper|conserving the factor from radiosity to radiance (paper)\n"
    "  --roughness R           of the surface in reflections, 0: none (0.35)\n"
    "  --floor F               how strongly a polished floor mirrors the object, in [0,1] (0)\n"
    "  --background R,G,B      sRGB in [0,1], darker towards the edges (0.16,0.17,0.19)\n"
    "\n"
    "Exit status: 0 done, 2 wrong arguments, unreadable input or failure: nothing is then written.\n";

static void help(void)
{
    fputs(usage, stdout);
    for (size_t i = 0; i < sss_dipole_material_count(); ++i)
    {
        printf("%s%s", i ? i % 6 ? ", " : ",\n                            " : "", sss_dipole_material_name(i));
    }
    printf("\n%s", usage_after_materials);
    for (size_t i = 0; method_help(i); ++i)
    {
        printf("  --method %s%s\n", method_help(i), i == 0 ? " (default)" : "");
    }
    fputs(usage_after_methods, stdout);
}

// Reads `least` to `most` finite numbers with separators between them; their count, or -1.
static int parse_numbers(const char *text, char separator, int least, int most, double *out)
{
    int count = 0;
    for (;;)
    {
        char *end;
        errno = 0;
        out[count] = strtod(text, &end);
        if (end == text || !isfinite(out[count]))
        {
            return -1;
        }
        ++count;
        if (*end == '\0')
        {
            return count >= least ? count : -1;
        }
        if (*end != separator || count == most)
        {
            return -1;
        }
        text = end + 1;
    }
}

// One number stands for all three channels.
static int parse_rgb(const char *text, double out[3])
{
    const int count = parse_numbers(text, ',', 1, 3, out);
    if (count == 1)
    {
        out[1] = out[2] = out[0];
    }
    return count == 1 || count == 3 ? 0 : -1;
}

static int parse_count(const char *text, int low, int high, int *out)
{
    double number;
    if (parse_numbers(text, ',', 1, 1, &number) < 0 || number < low || number > high || floor(number) != number)
    {
        return -1;
    }
    *out = (int)number;
    return 0;
}

static int parse_light(options *o, const char *text)
{
    double n[6];
    const int count = o->lights.count < LIGHTS_MAX ? parse_numbers(text, ',', 3, 6, n) : -1;
    if ((count != 3 && count != 6) || !(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] > 0.0) ||
        (count == 6 && (n[3] < 0.0 || n[4] < 0.0 || n[5] < 0.0)))
    {
        return -1;
    }
    for (int k = 0; k < 3; ++k)
    {
        o->lights.direction[o->lights.count][k] = n[k];
        o->lights.color[o->lights.count][k] = count == 6 ? n[3 + k] : 1.0;
    }
    ++o->lights.count;
    return 0;
}

static int parse_camera(options *o, const char *text)
{
    double n[3] = {0.0, 0.0, 1.0};
    if (parse_numbers(text, ',', 2, 3, n) < 0 || fabs(n[1]) > 89.0 || n[2] < 0.1 || n[2] > 100.0)
    {
        return -1;
    }
    o->azimuth = n[0];
    o->elevation = n[1];
    o->zoom = n[2];
    return 0;
}

static int parse_resolution(options *o, const char *text)
{
    double n[2];
    if (parse_numbers(text, 'x', 2, 2, n) < 0)
    {
        return -1;
    }
    for (int k = 0; k < 2; ++k)
    {
        if (n[k] < 1.0 || n[k] > 4096.0 || floor(n[k]) != n[k])
        {
            return -1;
        }
    }
    o->width = (int)n[0];
    o->height = (int)n[1];
    return 0;
}

// Options whose value is kept as it stands, and those that are a number within a range.
static int parse_plain(options *o, const char *name, const char *value)
{
    const struct
    {
        const char *name;
        const char **text;
    } texts[] = {{"--method", &o->method}, {"--material", &o->material}, {"--out", &o->out}, {"--png", &o->png},
                 {"--dump", &o->dump}, {"--dump-irradiance", &o->dump_irradiance}, {"--irradiance", &o->irradiance},
                 {"--geometry", &o->geometry}, {"--exit", &o->exit}, {"--atlas", &o->atlas},
                 {"--atlas-png", &o->atlas_png}, {"--atlas-method", &o->atlas_method},
                 {"--atlas-values", &o->atlas_values}, {"--storage", &o->storage}, {"--cache", &o->cache},
                 {"--changes", &o->changes}};
    const struct
    {
        const char *name;
        double *number;
        double low, high;
    } numbers[] = {{"--eta", &o->eta, 0.1, 10.0}, {"--size-mm", &o->size_mm, 1e-30, 1e30},
                   {"--mm-per-unit", &o->mm_per_unit, 1e-30, 1e30}, {"--tolerance", &o->tolerance, 1e-5, 0.5},
                   {"--guard", &o->guard, 0.0, 1.0}, {"--budget-ms", &o->budget_ms, 1e-6, 1e12},
                   {"--exposure", &o->exposure, 1e-6, 1e6}, {"--roughness", &o->roughness, 0.0, 1.0},
                   {"--floor", &o->floor, 0.0, 1.0}, {"--soft", &o->soft, 0.0, 45.0}};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; ++i)
    {
        if (strcmp(name, texts[i].name) == 0)
        {
            *texts[i].text = value;
            return 0;
        }
    }
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; ++i)
    {
        if (strcmp(name, numbers[i].name) == 0)
        {
            return parse_numbers(value, ',', 1, 1, numbers[i].number) == 1 && *numbers[i].number >= numbers[i].low &&
                           *numbers[i].number <= numbers[i].high ? 0 : -1;
        }
    }
    return 1;
}

// 0: taken, -1: bad value, 1: no such option.
static int parse_value(options *o, const char *name, const char *value)
{
    const struct
    {
        const char *name;
        double *rgb;
    } colors[] = {{"--sigma-s", o->sigma_s}, {"--sigma-a", o->sigma_a}, {"--albedo", o->albedo}, {"--mfp", o->mfp},
                  {"--ambient", o->ambient}, {"--background", o->background}};
    for (size_t i = 0; i < sizeof colors / sizeof colors[0]; ++i)
    {
        if (strcmp(name, colors[i].name) == 0)
        {
            double *const c = colors[i].rgb;
            return parse_rgb(value, c) == 0 && c[0] >= 0.0 && c[1] >= 0.0 && c[2] >= 0.0 ? 0 : -1;
        }
    }
    if (strcmp(name, "--light") == 0)
    {
        return parse_light(o, value);
    }
    if (strcmp(name, "--camera") == 0)
    {
        return parse_camera(o, value);
    }
    if (strcmp(name, "--resolution") == 0)
    {
        return parse_resolution(o, value);
    }
    if (strcmp(name, "--threads") == 0)
    {
        return parse_count(value, 1, 256, &o->threads);
    }
    if (strcmp(name, "--reference") == 0)
    {
        return parse_count(value, 1, 1000000000, &o->reference);
    }
    if (strcmp(name, "--atlas-size") == 0)
    {
        return parse_count(value, 1, 16384, &o->atlas_size);
    }
    if (strcmp(name, "--directions") == 0)
    {
        return parse_count(value, 4, 4098, &o->directions);
    }
    if (strcmp(name, "--references") == 0)
    {
        return parse_count(value, 3, 1000000000, &o->references);
    }
    if (strcmp(name, "--order") == 0)
    {
        return parse_count(value, 1, 8, &o->order);
    }
    return parse_plain(o, name, value);
}

static void default_options(options *o)
{
    memset(o, 0, sizeof *o);
    o->method = "direct";
    o->exit = "paper";
    o->eta = o->size_mm = o->mm_per_unit = o->guard = NAN;
    for (int k = 0; k < 3; ++k)
    {
        o->sigma_s[k] = o->sigma_a[k] = o->albedo[k] = o->mfp[k] = NAN;
        o->background[k] = 0.16 + 0.015 * k * (k + 1) / 2.0;
    }
    o->exposure = o->zoom = 1.0;
    o->roughness = 0.35;
    o->azimuth = 25.0;
    o->elevation = 10.0;
    o->width = o->height = 960;
    o->threads = threads_available();
}

// The method decides where the command line is silent; where it cannot do what that says, nothing is done.
static int choose_geometry(bake *b)
{
    const char *const only = method_geometry(b->o.method);
    const int automatic = strcmp(b->o.method, "auto") == 0;
    if (!b->o.geometry)
    {
        b->o.geometry = only ? only : automatic ? "either" : "distance";
    }
    if (strcmp(b->o.geometry, "distance") != 0 && strcmp(b->o.geometry, "placed") != 0 &&
        !(automatic && strcmp(b->o.geometry, "either") == 0))
    {
        return fail(b, "--geometry is distance or placed%s, not '%s'", automatic ? " or either" : "", b->o.geometry);
    }
    if (only && strcmp(b->o.geometry, only) != 0)
    {
        return fail(b, "--method %s knows --geometry %s only; for %s take --method direct", b->o.method, only,
                    b->o.geometry);
    }
    if (isfinite(b->o.guard) && strcmp(b->o.method, "bem") != 0)
    {
        return fail(b, "--guard is for --method bem");
    }
    return 0;
}

static int check_hao_options(bake *b)
{
    const options *const o = &b->o;
    const int hao = strcmp(o->method, "hao") == 0;
    if (!hao && (o->directions || o->references || o->order || o->storage || o->cache))
    {
        return fail(b, "--directions, --storage, --references, --order and --cache are for --method hao");
    }
    if (o->storage && !method_hao_storage(o->storage))
    {
        return fail(b, "--storage is references, harmonics, table, float or vectors, not '%s'", o->storage);
    }
    if (hao && o->atlas_values && strcmp(o->atlas_values, "texels") == 0)
    {
        return fail(b, "--method hao knows radiosity at vertices only; for --atlas-values texels take --method direct");
    }
    return 0;
}

// "light,geometry" to bits.
static int take_changes(bake *b)
{
    static const char *const names[] = {"light", "geometry", "material"};
    const char *at = b->o.changes ? b->o.changes : "";
    if ((b->o.changes || b->o.budget_ms > 0.0) && strcmp(b->o.method, "auto") != 0)
    {
        return fail(b, "--changes and --budget-ms are for --method auto");
    }
    while (*at)
    {
        const size_t length = strcspn(at, ",");
        unsigned k = 0;
        while (k < 3 && (strlen(names[k]) != length || strncmp(at, names[k], length) != 0))
        {
            ++k;
        }
        if (k == 3)
        {
            return fail(b, "--changes is a list of light, geometry, material, not '%s'", b->o.changes);
        }
        b->o.changing |= 1u << k; // as SSS_DIPOLE_CHANGES_* are numbered
        at += length + (at[length] == ',');
    }
    return b->o.changes && !b->o.changing ? fail(b, "--changes names nothing") : 0;
}

static int check_atlas_options(bake *b)
{
    const options *const o = &b->o;
    sss_atlas_method method;
    if (!o->atlas && !o->atlas_png && (o->atlas_size || o->atlas_method || o->atlas_values))
    {
        return fail(b, "--atlas-size, --atlas-method and --atlas-values go with --atlas or --atlas-png");
    }
    if (o->atlas_method && atlas_method_by_name(o->atlas_method, &method) != 0)
    {
        return fail(b, "--atlas-method is orthographic, area or convex, not '%s'", o->atlas_method);
    }
    if (o->atlas_values && strcmp(o->atlas_values, "texels") != 0 && strcmp(o->atlas_values, "vertices") != 0)
    {
        return fail(b, "--atlas-values is texels or vertices, not '%s'", o->atlas_values);
    }
    return 0;
}

static int check_options(bake *b)
{
    const options *const o = &b->o;
    if (!o->in)
    {
        return fail(b, "no input file");
    }
    if (!method_by_name(o->method))
    {
        return fail(b, "there is no method '%s'", o->method);
    }
    if (choose_geometry(b) != 0)
    {
        return -1;
    }
    if (strcmp(o->exit, "paper") != 0 && strcmp(o->exit, "conserving") != 0)
    {
        return fail(b, "--exit is paper or conserving, not '%s'", o->exit);
    }
    if (isfinite(o->size_mm) && isfinite(o->mm_per_unit))
    {
        return fail(b, "give --size-mm or --mm-per-unit, not both");
    }
    if (!o->irradiance && o->lights.count == 0 && o->ambient[0] + o->ambient[1] + o->ambient[2] <= 0.0)
    {
        return fail(b, "no light: give --light, --ambient or --irradiance");
    }
    if (!o->out && !o->png && !o->atlas && !o->atlas_png && !o->dump && !o->dump_irradiance && !o->report &&
        !o->reference && !o->chart)
    {
        return fail(b, "nothing to do: give --out, --png, --atlas, --atlas-png, --dump, --dump-irradiance, --report, "
                    "--reference or --chart");
    }
    if (o->chart && o->irradiance)
    {
        return fail(b, "--chart: a file of irradiance does not say where its light comes from; give --light or "
                    "--ambient");
    }
    return check_hao_options(b) == 0 && take_changes(b) == 0 ? check_atlas_options(b) : -1;
}

// --name value, or --name=value; moves on behind what it took. value is NULL at the end of the line.
static int parse_pair(bake *b, const char *argument, const char *value, int *index)
{
    char name[64];
    const char *const equals = strchr(argument, '=');
    const size_t length = equals ? (size_t)(equals - argument) : strlen(argument);
    snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1), argument);
    const char *const text = equals ? equals + 1 : value;
    const int taken = parse_value(&b->o, name, text ? text : "");
    if (taken == 1)
    {
        return fail(b, "there is no option '%s'", name);
    }
    if (!text)
    {
        return fail(b, "%s needs a value", name);
    }
    *index += equals ? 0 : 1;
    return taken == 0 ? 0 : fail(b, "%s does not take '%s'", name, text);
}

// --chart FOLDER, --chart=FOLDER, or --chart alone: before another option, or at the end.
static void take_chart(options *o, char **argv, int *index)
{
    const char *const argument = argv[*index], *const next = argv[*index + 1];
    o->chart = 1;
    if (argument[7] == '=')
    {
        o->chart_folder = argument + 8;
    }
    else if (next && strncmp(next, "--", 2) != 0)
    {
        o->chart_folder = next;
        ++*index;
    }
}

static int parse_options(bake *b, int argc, char **argv)
{
    options *const o = &b->o;
    default_options(o);
    o->program = argv[0];
    for (int i = 1; i < argc; ++i)
    {
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0)
        {
            o->help = 1;
            return 0;
        }
        if (strcmp(argv[i], "--no-shadows") == 0)
        {
            o->no_shadows = 1;
        }
        else if (strcmp(argv[i], "--report") == 0)
        {
            o->report = 1;
        }
        else if (strcmp(argv[i], "--chart") == 0 || strncmp(argv[i], "--chart=", 8) == 0)
        {
            take_chart(o, argv, &i);
        }
        else if (strncmp(argv[i], "--", 2) != 0)
        {
            if (o->in)
            {
                return fail(b, "two input files: '%s' and '%s'", o->in, argv[i]);
            }
            o->in = argv[i];
        }
        else if (parse_pair(b, argv[i], argv[i + 1], &i) != 0)
        {
            return -1;
        }
    }
    return check_options(b);
}

// ---- the scene ----

static int choose_material(bake *b)
{
    const options *const o = &b->o;
    const int by_sigma = isfinite(o->sigma_s[0]) || isfinite(o->sigma_a[0]);
    const int by_albedo = isfinite(o->albedo[0]) || isfinite(o->mfp[0]);
    if ((o->material != NULL) + by_sigma + by_albedo != 1)
    {
        return fail(b, "give the material once: --material, or --sigma-s and --sigma-a, or --albedo and --mfp");
    }
    const double eta = isfinite(o->eta) ? o->eta : ETA;
    sss_result result;
    if (o->material)
    {
        result = sss_dipole_material_by_name(o->material, &b->material);
        if (result == SSS_OK && isfinite(o->eta))
        {
            b->material.eta = o->eta;
        }
    }
    else if (by_sigma)
    {
        result = sss_dipole_material_from_coefficients(o->sigma_s, o->sigma_a, eta, &b->material);
    }
    else
    {
        result = sss_dipole_material_from_albedo(o->albedo, o->mfp, eta, &b->material);
    }
    if (result == SSS_OK)
    {
        result = sss_dipole_profile(&b->material, SSS_DIPOLE_FRESNEL_EXACT, &b->profile);
    }
    return result == SSS_OK ? 0 : fail(b, "material%s%s: %s%s", o->material ? " " : "", o->material ? o->material : "",
                                       sss_result_string(result),
                                       by_sigma || by_albedo ? " (both options must be given)" : "");
}

// The area and the mean edge length, mm.
static void measure(bake *b)
{
    const model *const m = &b->model;
    double area = 0.0, edges = 0.0;
    for (size_t t = 0; t < m->triangle_count; ++t)
    {
        double e[2][3], squared[3] = {0.0, 0.0, 0.0};
        for (int k = 0; k < 3; ++k)
        {
            double p[3];
            for (int c = 0; c < 3; ++c)
            {
                p[c] = (double)m->positions[3 * (size_t)m->triangles[3 * t + (size_t)c] + (size_t)k];
            }
            e[0][k] = p[1] - p[0];
            e[1][k] = p[2] - p[0];
            squared[0] += e[0][k] * e[0][k];
            squared[1] += e[1][k] * e[1][k];
            squared[2] += (p[2] - p[1]) * (p[2] - p[1]);
        }
        const double x = e[0][1] * e[1][2] - e[0][2] * e[1][1], y = e[0][2] * e[1][0] - e[0][0] * e[1][2],
                     z = e[0][0] * e[1][1] - e[0][1] * e[1][0];
        area += 0.5 * sqrt(x * x + y * y + z * z);
        edges += sqrt(squared[0]) + sqrt(squared[1]) + sqrt(squared[2]);
    }
    b->area_mm2 = area * b->mesh.mm_per_unit * b->mesh.mm_per_unit;
    b->edge_mm = edges * b->mesh.mm_per_unit / (3.0 * (double)m->triangle_count);
}

static int load_scene(bake *b)
{
    if (model_load(b->o.in, &b->model, b->error, sizeof b->error) != 0)
    {
        return -1;
    }
    if (b->model.turned)
    {
        fprintf(stderr, "%s is inside out: its triangles and normals are turned round\n", b->o.in);
    }
    double low[3], high[3];
    const double extent = model_bounds(&b->model, low, high);
    if (!(extent > 0.0))
    {
        return fail(b, "%s: all vertices are in one place, so the object has no size", b->o.in);
    }
    const double unit = isfinite(b->o.mm_per_unit) ? b->o.mm_per_unit : MM_PER_METRE;
    const double mm_per_unit = isfinite(b->o.size_mm) ? b->o.size_mm / extent : unit;
    if (!(mm_per_unit > 0.0) || !isfinite(mm_per_unit) || !isfinite(mm_per_unit * extent))
    {
        return fail(b, "%s: the size is out of range", b->o.in);
    }
    b->size_mm = mm_per_unit * extent;
    if (!isfinite(b->o.size_mm) && !isfinite(b->o.mm_per_unit))
    {
        fprintf(stderr, "no --size-mm: with metres as the file's unit the object is %g mm large\n", b->size_mm);
    }
    b->mesh = model_mesh(&b->model, mm_per_unit);
    measure(b);
    const size_t count = b->model.vertex_count;
    b->irradiance = malloc(3 * count * sizeof *b->irradiance);
    b->radiosity = malloc(3 * count * sizeof *b->radiosity);
    b->seen = malloc(4 * count * sizeof *b->seen);
    return b->irradiance && b->radiosity && b->seen ? 0 : fail(b, "out of memory");
}

static int read_irradiance(bake *b)
{
    const char *const path = b->o.irradiance;
    const size_t count = 3 * b->model.vertex_count;
    struct stat status;
    if (stat(path, &status) != 0 || !S_ISREG(status.st_mode))
    {
        return fail(b, "cannot read %s: %s", path, errno ? strerror(errno) : "not a regular file");
    }
    if ((unsigned long long)status.st_size != count * sizeof(float))
    {
        return fail(b, "%s: %lld bytes, but %zu vertices need %zu (float32, RGB)", path, (long long)status.st_size,
                    b->model.vertex_count, count * sizeof(float));
    }
    FILE *const file = fopen(path, "rb");
    const size_t got = file ? fread(b->irradiance, sizeof(float), count, file) : 0;
    if (file)
    {
        fclose(file);
    }
    for (size_t i = 0; i < count && got == count; ++i)
    {
        if (!isfinite(b->irradiance[i]) || b->irradiance[i] < 0.0f)
        {
            return fail(b, "%s: value %zu is negative or not a number", path, i);
        }
    }
    return got == count ? 0 : fail(b, "cannot read %s", path);
}

static int light_scene(bake *b)
{
    lights *const l = &b->o.lights;
    memcpy(l->ambient, b->o.ambient, sizeof l->ambient);
    l->softness = b->o.soft;
    l->no_shadows = b->o.no_shadows;
    if (b->o.irradiance)
    {
        for (size_t i = 0; i < 4 * b->model.vertex_count; ++i)
        {
            b->seen[i] = 1.0f;
        }
        return read_irradiance(b);
    }
    const double start = services_seconds();
    const int reflections = b->o.png && b->o.roughness > 0.0;
    const int status = lights_irradiance(l, &b->model, b->material.eta, b->o.threads, b->irradiance,
                                         reflections ? b->seen : NULL, b->error, sizeof b->error);
    b->irradiance_ms = 1e3 * (services_seconds() - start);
    return status;
}

// A placed source may come close to another part of a thin or folded surface and then shows light that is not there.
// On a plane no radiosity is larger than the largest irradiance: what is beyond that has this cause.
static void look_for_spurious_light(bake *b)
{
    const size_t count = b->model.vertex_count;
    float most[3] = {0.0f, 0.0f, 0.0f};
    for (size_t i = 0; i < 3 * count; ++i)
    {
        most[i % 3] = fmaxf(most[i % 3], b->irradiance[i]);
    }
    for (size_t v = 0; v < count; ++v)
    {
        const float *const B = b->radiosity + 3 * v;
        b->spurious += B[0] > most[0] || B[1] > most[1] || B[2] > most[2];
    }
    if ((double)b->spurious > SPURIOUS * (double)count)
    {
        fprintf(stderr, "%.2g %% of the vertices are brighter than any light on it: at this size the object has\n"
                "parts too thin for placed sources; --geometry distance --method direct does not mind\n",
                100.0 * (double)b->spurious / (double)count);
    }
}

// ---- the atlas ----

// Made before the light travels, so that charts that do not fit are found at once.
static int make_atlas(bake *b)
{
    const options *const o = &b->o;
    sss_atlas_options wanted = {.size = o->atlas_size ? (size_t)o->atlas_size : ATLAS_SIZE, .method = SSS_ATLAS_AREA};
    if (!o->atlas && !o->atlas_png)
    {
        return 0;
    }
    if (o->atlas_method)
    {
        atlas_method_by_name(o->atlas_method, &wanted.method);
    }
    return atlas_texture_create(&b->mesh, &wanted, o->threads, &b->atlas, b->error, sizeof b->error);
}

// What --help promises of --atlas-values.
static int gathers_at_texels(const bake *b)
{
    const options *const o = &b->o;
    const int direct = strcmp(o->method, "direct") == 0 ||
                       (strcmp(o->method, "auto") == 0 && strcmp(o->geometry, "placed") != 0);
    const double pairs = (double)b->atlas.texels.count * ((double)b->model.triangle_count + NEAR_PAIRS);
    return strcmp(o->method, "hao") != 0 &&
           (o->atlas_values ? strcmp(o->atlas_values, "texels") == 0 : !direct || pairs <= MOST_PAIRS);
}

static int paint_atlas(bake *b)
{
    if (!b->atlas.atlas)
    {
        return 0;
    }
    if (b->result.has_points)
    {
        atlas_texture_take_gathered(&b->atlas);
    }
    else
    {
        atlas_texture_interpolate(&b->atlas, &b->mesh, b->radiosity);
    }
    return atlas_texture_paint(&b->atlas, b->error, sizeof b->error);
}

static void report_atlas(const bake *b)
{
    if (b->atlas.atlas)
    {
        atlas_report(b->atlas.atlas);
        printf("atlas_s=%.3f\natlas_texels=%zu\natlas_values=%s\natlas_values_ms=%.3f\natlas_white=%.9g\n",
               b->atlas.seconds, b->atlas.texels.count, b->result.has_points ? "texels" : "vertices",
               b->result.points_ms, b->atlas.white);
    }
}

// Methods that bake cannot run, or that do not know this light: ranked for nobody.
static unsigned methods_left_out(const bake *b)
{
    const options *const o = &b->o;
    const int texels = o->atlas_values && strcmp(o->atlas_values, "texels") == 0;
    const unsigned no_hao = o->irradiance || texels || o->tolerance > 0.1 ? 1u << SSS_DIPOLE_METHOD_HAO : 0u;
    return 1u << SSS_DIPOLE_METHOD_POINTS | no_hao; // points: needs a thinned copy of the mesh
}

// For auto, where Lambert's error is not predicted to be small, it is measured for this very light, shadows included.
static int ask_what_it_needs(bake *b)
{
    const options *const o = &b->o;
    const int automatic = strcmp(o->method, "auto") == 0;
    services s = {.threads = o->threads};
    const sss_hooks hooks = services_hooks(&s);
    sss_dipole_scene scene;
    sss_result result = sss_dipole_measure(&b->mesh, &scene);
    scene.pixel_mm = o->png ? b->size_mm / o->width : 0.0;
    scene.tolerance = o->tolerance;
    scene.threads = o->threads;
    scene.changes = o->changing;
    scene.frame_budget_ms = o->budget_ms;
    scene.left_out = methods_left_out(b);
    scene.lighting = o->irradiance                         ? SSS_DIPOLE_LIGHTING_ANY
                     : o->lights.count == 0                ? SSS_DIPOLE_LIGHTING_EVEN
                     : o->no_shadows                       ? SSS_DIPOLE_LIGHTING_DISTANT
                                                           : SSS_DIPOLE_LIGHTING_ANY;
    scene.geometries = strcmp(o->geometry, "placed") == 0     ? SSS_DIPOLE_ONLY_PLACED
                       : strcmp(o->geometry, "distance") == 0 ? SSS_DIPOLE_ONLY_DISTANCE
                                                              : SSS_DIPOLE_EITHER_GEOMETRY;
    result = result == SSS_OK ? sss_dipole_needs(&b->profile, &scene, &b->job.advice) : result;
    if (result == SSS_OK && automatic && b->job.advice.need != SSS_DIPOLE_NEED_LAMBERT)
    {
        result = sss_dipole_lambert_error(&b->mesh, &b->profile, b->irradiance, 0, &hooks, &scene.lambert_error);
        result = result == SSS_OK ? sss_dipole_needs(&b->profile, &scene, &b->job.advice) : result;
    }
    return result == SSS_OK ? 0 : fail(b, "what the scene needs: %s", sss_result_string(result));
}

static int run_method(bake *b)
{
    const options *const o = &b->o;
    b->job.mesh = b->mesh;
    b->job.profile = &b->profile;
    b->job.irradiance = b->irradiance;
    b->job.lights = o->irradiance ? NULL : &o->lights;
    b->job.model = &b->model;
    b->job.hao.storage = o->storage;
    b->job.hao.cache = o->cache;
    b->job.hao.directions = (size_t)o->directions;
    b->job.hao.references = (size_t)o->references;
    b->job.hao.order = (size_t)o->order;
    b->job.geometry = strcmp(o->geometry, "placed") == 0 ? SSS_DIPOLE_PLACED : SSS_DIPOLE_DISTANCE;
    b->job.tolerance = o->tolerance;
    b->job.guard = !isfinite(o->guard) ? 0.0 : o->guard > 0.0 ? o->guard : -1.0;
    b->job.threads = o->threads;
    if (b->atlas.atlas && gathers_at_texels(b))
    {
        b->job.points.positions = b->atlas.positions;
        b->job.points.normals = b->atlas.normals;
        b->job.points.count = b->atlas.texels.count;
        b->job.point_radiosity = b->atlas.gathered;
    }
    b->job.announce = 1;
    b->job.report = o->report;
    if (ask_what_it_needs(b) != 0)
    {
        return -1;
    }
    const int status = method_by_name(o->method)(&b->job, b->radiosity, &b->result, b->error, sizeof b->error);
    if (status == 0 && b->result.geometry == SSS_DIPOLE_PLACED)
    {
        look_for_spurious_light(b);
    }
    return status;
}

// ---- report ----

static void print_rgb(const char *key, const double c[3])
{
    printf("%s=%.9g,%.9g,%.9g\n", key, c[0], c[1], c[2]);
}

// What each method would do here, the first one first: on this many threads of the chart's machine.
static void print_ranking(const sss_dipole_advice *a)
{
    for (size_t i = 0; i < a->ranking_count; ++i)
    {
        const sss_dipole_choice *const c = &a->ranking[i];
        printf("ranking_%zu=%s tolerance %g", i + 1, sss_dipole_method_name(c->method), c->tolerance);
        if (c->directions)
        {
            printf(" directions %zu storage %d", c->directions, c->storage);
        }
        printf(" error %.2g precompute_s %.3g frame_ms %.3g rebuild_ms %.3g bytes %.3g cost_ms %.3g %s\n",
               c->predicted_error, c->precompute_s, c->frame_ms, c->rebuild_ms, c->bytes, c->cost_ms,
               c->meets ? "meets" : "misses");
    }
    printf("ranking_reason=%s\nranking_extrapolated=%d\nmodel_error=%.3g\n", a->ranking_reason, a->extrapolated,
           a->model_error);
}

static void print_report(const bake *b)
{
    static const char *const needs[] = {"lambert", "local", "global"};
    const sss_dipole_advice *const a = &b->job.advice;
    double albedo[3], mfp[3];
    printf("vertices=%zu\ntriangles=%zu\nmm_per_unit=%.9g\nsize_mm=%.9g\narea_mm2=%.9g\n", b->model.vertex_count,
           b->model.triangle_count, b->mesh.mm_per_unit, b->size_mm, b->area_mm2);
    printf("turned_round=%d\nlights=%zu\nsoft_degrees=%.9g\nshadows=%d\n", b->model.turned,
           b->o.irradiance ? (size_t)0 : b->o.lights.count, b->o.soft, !b->o.no_shadows && !b->o.irradiance);
    print_rgb("ambient", b->o.ambient);
    print_rgb("sigma_s", b->material.sigma_s);
    print_rgb("sigma_a", b->material.sigma_a);
    printf("eta=%.9g\n", b->material.eta);
    if (sss_dipole_material_to_albedo(&b->material, albedo, mfp) == SSS_OK)
    {
        print_rgb("albedo", albedo);
        print_rgb("mfp_mm", mfp);
    }
    printf("method=%s\nthreads=%d\n%s", b->result.method, b->o.threads, b->result.parameters);
    if (b->result.geometry == SSS_DIPOLE_PLACED)
    {
        printf("spurious_vertices=%zu\n", b->spurious);
    }
    printf("irradiance_ms=%.3f\nprecompute_s=%.6f\nframe_ms=%.3f\nbytes=%zu\npredicted_error=%.3g\n", b->irradiance_ms,
           b->result.precompute_s, b->result.frame_ms, b->result.bytes, b->result.predicted_error);
    printf("needs=%s\nneeds_error=%.3g\nneeds_lambert_error=%.3g\nneeds_crossing=%.3g\nneeds_radius_mm=%.4g\n"
           "needs_spacing_mm=%.4g\nneeds_samples=%.4g\nneeds_reason=%s\n",
           needs[a->need], a->predicted_error, a->lambert_error, a->crossing, a->radius_mm, a->spacing_mm,
           a->sample_count, a->reason);
    print_ranking(a);
    report_atlas(b);
}

// A third of the area of the triangles at each vertex, in square units of the file.
static void vertex_areas(const model *m, double *area)
{
    memset(area, 0, m->vertex_count * sizeof *area);
    for (size_t t = 0; t < m->triangle_count; ++t)
    {
        const uint32_t *const v = m->triangles + 3 * t;
        double e[2][3];
        for (int i = 0; i < 6; ++i)
        {
            e[i / 3][i % 3] = (double)m->positions[3 * (size_t)v[1 + i / 3] + (size_t)(i % 3)] -
                              (double)m->positions[3 * (size_t)v[0] + (size_t)(i % 3)];
        }
        const double x = e[0][1] * e[1][2] - e[0][2] * e[1][1], y = e[0][2] * e[1][0] - e[0][0] * e[1][2],
                     z = e[0][0] * e[1][1] - e[0][1] * e[1][0];
        for (int c = 0; c < 3; ++c)
        {
            area[v[c]] += sqrt(x * x + y * y + z * z) / 6.0;
        }
    }
}

typedef struct comparison
{
    size_t count;
    size_t *indices;
    double *area, *B, *error;
} comparison;

static void measure_errors(bake *b, const comparison *c)
{
    double off = 0.0, uncertain = 0.0, all = 0.0, worst = 0.0, brightest = 0.0;
    for (size_t i = 0; i < 3 * c->count; ++i)
    {
        const size_t v = c->indices[i / 3];
        const double d = (double)b->radiosity[3 * v + i % 3] - c->B[i];
        off += c->area[v] * d * d;
        uncertain += c->area[v] * c->error[i] * c->error[i];
        all += c->area[v] * c->B[i] * c->B[i];
        worst = fmax(worst, fabs(d));
        brightest = fmax(brightest, fabs(c->B[i]));
    }
    b->rel_l2 = all > 0.0 ? sqrt(off / all) : sqrt(off);
    b->rel_max = brightest > 0.0 ? worst / brightest : worst;
    b->reference_error = all > 0.0 ? sqrt(uncertain / all) : sqrt(uncertain);
    b->reference_receivers = c->count;
}

// Compares with the converged integral at vertices spread evenly over the vertex order.
static int compare_with_reference(bake *b)
{
    const size_t vertices = b->model.vertex_count;
    comparison c = {.count = (size_t)b->o.reference < vertices ? (size_t)b->o.reference : vertices};
    c.indices = malloc(c.count * sizeof *c.indices);
    c.area = malloc(vertices * sizeof *c.area);
    c.B = malloc(3 * c.count * sizeof *c.B);
    c.error = malloc(3 * c.count * sizeof *c.error);
    int status = c.indices && c.area && c.B && c.error ? 0 : fail(b, "out of memory");
    if (status == 0)
    {
        for (size_t i = 0; i < c.count; ++i)
        {
            c.indices[i] = (size_t)((double)vertices * ((double)i + 0.5) / (double)c.count);
        }
        vertex_areas(&b->model, c.area);
        // A hundredth of what is asked for; reference_error, its estimate, bounds its error from far above.
        const double asked = b->o.tolerance > 0.0 ? b->o.tolerance : 1e-3;
        const reference_options exact = {.geometry = b->result.geometry, .elements = SSS_DIPOLE_VERTICES,
                                         .tolerance = fmax(1e-6, 0.01 * asked), .guard = b->result.guard};
        const int code = reference_radiosity_many(&b->mesh, &b->profile, b->irradiance, &exact, b->mesh.positions,
                                                  b->mesh.normals, c.indices, c.count, b->o.threads, c.B, c.error);
        status = code == 1 ? fail(b, "the reference ran out of memory") : 0;
        if (code == 2)
        {
            fprintf(stderr, "the reference did not converge everywhere: see reference_error\n");
        }
    }
    if (status == 0)
    {
        measure_errors(b, &c);
    }
    free(c.indices);
    free(c.area);
    free(c.B);
    free(c.error);
    return status;
}

// ---- the chart of this scene ----

// The lights as the chart knows them. [LIGHTS_MAX LIGHTS_SAMPLES + 1]
static int chart_lights(const lights *l, chart_case *c)
{
    enum
    {
        MOST = LIGHTS_MAX * LIGHTS_SAMPLES
    };
    double (*const direction)[3] = malloc(2 * MOST * sizeof *direction);
    c->lights = calloc(MOST + 1, sizeof *c->lights);
    if (!direction || !c->lights)
    {
        free(direction);
        return -1;
    }
    double (*const color)[3] = direction + MOST;
    c->light_count = lights_directions(l, direction, color);
    for (size_t i = 0; i < c->light_count; ++i)
    {
        memcpy(c->lights[i].direction, direction[i], sizeof direction[i]);
        memcpy(c->lights[i].color, color[i], sizeof color[i]);
    }
    free(direction);
    if (l->ambient[0] + l->ambient[1] + l->ambient[2] > 0.0)
    {
        sss_dipole_light *const surroundings = &c->lights[c->light_count++];
        surroundings->kind = SSS_DIPOLE_LIGHT_ENVIRONMENT;
        for (int k = 0; k < 3; ++k)
        {
            surroundings->sh[0][k] = l->ambient[k] * 2.0 / sqrt(3.14159265358979323846); // radiance E/pi over Y_00
        }
    }
    return 0;
}

// The file's name without folder and ending, and without what a CSV file cannot hold.
static void chart_mesh_name(const char *path, char name[64])
{
    const char *const slash = strrchr(path, '/');
    snprintf(name, 64, "%s", slash ? slash + 1 : path);
    name[strcspn(name, ".")] = '\0';
    for (char *at = name; *at; ++at)
    {
        *at = strchr(",\" \t", *at) ? '_' : *at;
    }
}

static int write_chart(bake *b)
{
    char name[64];
    chart_case c = {.mesh_name = name, .material_name = b->o.material ? b->o.material : "own", .light_name = "own",
                    .size_mm = b->size_mm, .profile = b->profile, .material = b->material};
    chart_settings s = chart_defaults();
    chart_mesh_name(b->o.in, name);
    snprintf(c.name, sizeof c.name, "%s", name);
    s.threads = b->o.threads;
    s.receivers = b->o.reference > 0 ? (size_t)b->o.reference : s.receivers;
    s.log = stderr;
    int status = mesh_make(b->model.positions, b->model.vertex_count, b->model.triangles, b->model.triangle_count,
                           &c.mesh) == 0 ? 0 : -1;
    c.irradiance = malloc(3 * b->model.vertex_count * sizeof *c.irradiance);
    if (status == 0 && c.irradiance && chart_lights(&b->o.lights, &c) == 0)
    {
        memcpy(c.mesh.normals, b->model.normals, 3 * b->model.vertex_count * sizeof(float));
        c.view = mesh_view(&c.mesh, b->mesh.mm_per_unit);
        status = chart_irradiance(&c, &c.view, c.irradiance) == 0 &&
                 chart_write(&c, &s, b->o.program, b->o.chart_folder) == 0 ? 0 : fail(b, "the chart failed");
    }
    else
    {
        status = fail(b, "out of memory");
    }
    chart_case_free(&c);
    return status;
}

// ---- output: all files or none ----

typedef int (*write_function)(bake *b, const char *path);

static int write_floats(bake *b, const char *path, const float *values)
{
    const size_t count = 3 * b->model.vertex_count;
    FILE *const file = fopen(path, "wb");
    const size_t written = file ? fwrite(values, sizeof *values, count, file) : 0;
    const int closed = file ? fclose(file) : -1;
    return written == count && closed == 0 ? 0 : fail(b, "cannot write %s: %s", path, strerror(errno));
}

static int write_radiosity(bake *b, const char *path)
{
    return write_floats(b, path, b->radiosity);
}

static int write_irradiance(bake *b, const char *path)
{
    return write_floats(b, path, b->irradiance);
}

static int write_mesh(bake *b, const char *path)
{
    return model_save_glb(path, &b->model, b->radiosity, b->error, sizeof b->error);
}

static int draw(bake *b, gl_context *context, unsigned char *rgb)
{
    const options *const o = &b->o;
    shade_view view = {.eye = {.azimuth = o->azimuth, .elevation = o->elevation, .zoom = o->zoom},
                       .roughness = o->roughness, .floor = o->floor};
    camera_fit(&view.eye, b->model.positions, b->model.vertex_count, (double)o->width / o->height);
    if (o->floor > 0.0)
    {
        view.eye.target[1] -= FLOOR_ROOM * b->size_mm / b->mesh.mm_per_unit;
    }
    view.exposure = o->exposure * shade_exposure(&b->model, &view.eye, b->radiosity);
    for (int k = 0; k < 3; ++k)
    {
        view.background[0][k] = 0.55 * o->background[k];
        view.background[1][k] = o->background[k];
    }
    shade *const s = shade_create(context, &b->model, &o->lights, b->error, sizeof b->error);
    int status = -1;
    if (s)
    {
        shade_set_profile(s, &b->profile, strcmp(o->exit, "conserving") == 0 ? SSS_DIPOLE_EXIT_CONSERVING
                                                                             : SSS_DIPOLE_EXIT_PAPER);
        shade_set_radiosity(s, b->radiosity, b->seen);
        status = shade_picture(s, &view, o->width, o->height, SUPERSAMPLE, rgb, b->error, sizeof b->error);
    }
    shade_free(s);
    return status;
}

static int write_picture(bake *b, const char *path)
{
    const int width = b->o.width, height = b->o.height;
    unsigned char *const rgb = malloc(3 * (size_t)width * (size_t)height);
    gl_context *const context = gl_context_create_headless(16, 16, b->error, sizeof b->error);
    int status = rgb ? -1 : fail(b, "out of memory");
    if (rgb && context)
    {
        status = draw(b, context, rgb);
    }
    if (status == 0)
    {
        status = image_write_png(path, width, height, rgb, b->error, sizeof b->error);
    }
    gl_context_free(context);
    free(rgb);
    return status;
}

static int write_atlas(bake *b, const char *path)
{
    return atlas_texture_write_glb(&b->atlas, &b->model, path, b->error, sizeof b->error);
}

static int write_atlas_picture(bake *b, const char *path)
{
    return atlas_texture_write_png(&b->atlas, path, b->error, sizeof b->error);
}

enum
{
    OUTPUTS = 6
};

typedef struct output
{
    const char *path;
    write_function write;
    char temporary[PATH_SIZE + 32]; // written first, then renamed; the path itself where that is a device
} output;

static void list_outputs(const options *o, output out[OUTPUTS])
{
    const char *const paths[OUTPUTS] = {o->out, o->png, o->atlas, o->atlas_png, o->dump, o->dump_irradiance};
    const write_function writers[OUTPUTS] = {write_mesh, write_picture, write_atlas, write_atlas_picture,
                                             write_radiosity, write_irradiance};
    for (int i = 0; i < OUTPUTS; ++i)
    {
        out[i].path = paths[i];
        out[i].write = writers[i];
        out[i].temporary[0] = '\0';
    }
}

// Finds out before the work whether its results can be written.
static int check_outputs(bake *b, output out[OUTPUTS])
{
    for (int i = 0; i < OUTPUTS; ++i)
    {
        if (!out[i].path)
        {
            continue;
        }
        for (int k = 0; k < i; ++k)
        {
            if (out[k].path && strcmp(out[k].path, out[i].path) == 0)
            {
                return fail(b, "two outputs go to %s", out[i].path);
            }
        }
        struct stat status;
        const int exists = stat(out[i].path, &status) == 0;
        if (strlen(out[i].path) >= PATH_SIZE || (exists && S_ISDIR(status.st_mode)))
        {
            return fail(b, "cannot write %s: it is a directory, or the name is too long", out[i].path);
        }
        const int device = exists && !S_ISREG(status.st_mode);
        snprintf(out[i].temporary, sizeof out[i].temporary, device ? "%s" : "%s.part%ld", out[i].path,
                 (long)getpid());
        FILE *const probe = fopen(out[i].temporary, "wb");
        if (!probe)
        {
            return fail(b, "cannot write %s: %s", out[i].path, strerror(errno));
        }
        fclose(probe);
        if (!device)
        {
            remove(out[i].temporary); // so that a run that is interrupted leaves nothing
        }
    }
    return 0;
}

static int is_temporary(const output *out)
{
    return out->path && out->temporary[0] && strcmp(out->path, out->temporary) != 0;
}

static int write_outputs(bake *b, const output out[OUTPUTS])
{
    for (int i = 0; i < OUTPUTS; ++i)
    {
        if (out[i].path && out[i].write(b, out[i].temporary) != 0)
        {
            return -1;
        }
    }
    for (int i = 0; i < OUTPUTS; ++i)
    {
        if (is_temporary(&out[i]) && rename(out[i].temporary, out[i].path) != 0)
        {
            return fail(b, "cannot write %s: %s", out[i].path, strerror(errno));
        }
    }
    return 0;
}

static void remove_temporaries(const output out[OUTPUTS])
{
    for (int i = 0; i < OUTPUTS; ++i)
    {
        if (is_temporary(&out[i]))
        {
            remove(out[i].temporary);
        }
    }
}

// ---- the run ----

static int only_chart(const options *o)
{
    return o->chart && !o->out && !o->png && !o->atlas && !o->atlas_png && !o->dump && !o->dump_irradiance &&
           !o->report;
}

static int run(bake *b)
{
    output out[OUTPUTS];
    list_outputs(&b->o, out);
    int status = choose_material(b);
    if (status == 0)
    {
        status = load_scene(b);
    }
    if (status == 0)
    {
        status = check_outputs(b, out);
    }
    if (status == 0 && !only_chart(&b->o))
    {
        status = make_atlas(b) == 0 && light_scene(b) == 0 && run_method(b) == 0 && paint_atlas(b) == 0 ? 0 : -1;
    }
    if (status == 0 && b->o.reference > 0 && !b->o.chart)
    {
        status = compare_with_reference(b);
    }
    if (status == 0 && b->o.chart)
    {
        status = write_chart(b);
    }
    if (status == 0)
    {
        status = write_outputs(b, out);
    }
    if (status == 0 && b->o.report)
    {
        print_report(b);
    }
    if (status == 0 && b->o.reference > 0 && !b->o.chart)
    {
        printf("reference_receivers=%zu\nrel_l2=%.4g\nrel_max=%.4g\nreference_error=%.3g\n", b->reference_receivers,
               b->rel_l2, b->rel_max, b->reference_error);
    }
    if (status != 0)
    {
        remove_temporaries(out);
    }
    return status;
}

int main(int argc, char **argv)
{
    static bake b;
    int status = parse_options(&b, argc, argv);
    if (status == 0 && b.o.help)
    {
        help();
        return fflush(stdout) == 0 ? 0 : EXIT_BAD;
    }
    if (status == 0)
    {
        status = run(&b);
    }
    if (status == 0 && fflush(stdout) != 0)
    {
        status = fail(&b, "cannot write to standard output");
    }
    if (status != 0)
    {
        fprintf(stderr, "bake: %s\n%s", b.error, b.model.vertex_count ? "" : "Try bake --help\n");
    }
    model_free(&b.model);
    atlas_texture_free(&b.atlas);
    free(b.irradiance);
    free(b.seen);
    free(b.radiosity);
    return status == 0 ? 0 : EXIT_BAD;
}
