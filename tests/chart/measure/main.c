// Measures cases of the chart into a CSV file that begins with its columns.
//   build/tests/chart/measure OUT.csv [--case GLOB] [--method GLOB] [--receivers N] [--threads N] [--runs N]
//                             [--rounds N] [--seconds S] [--quick]
//   build/tests/chart/measure --cases [GLOB]     their names;  --methods [GLOB]  those of the methods
// --quick: meshes thinned fortyfold, few runs: to see that it works. A case whose mesh is not there is left out with a
// message. Status 1 where something failed; the file then has what did not.

#define _POSIX_C_SOURCE 200809L

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../../../sss_bem.h"
#define SSS_HAO_IMPLEMENTATION
#include "../../../sss_hao.h"

#include "../chart.h"

#include "../../common/test.h"

#include <fnmatch.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct arguments
{
    const char *out, *cases;
    double thin;
    chart_settings s;
} arguments;

static int usage(const char *program)
{
    fprintf(stderr,
            "usage: %s OUT.csv [--case GLOB] [--method GLOB] [--receivers N] [--threads N] [--runs N] [--rounds N]\n"
            "       [--seconds S] [--quick];  %s --cases [GLOB];  %s --methods [GLOB]\n",
            program, program, program);
    return 2;
}

static int read_arguments(int argc, char **argv, arguments *a)
{
    a->out = argv[1];
    for (int i = 2; i < argc; ++i)
    {
        const char *const value = i + 1 < argc ? argv[i + 1] : "";
        if (strcmp(argv[i], "--quick") == 0)
        {
            a->thin = 40.0;
            a->s.variants_max = 2;
            a->s.receivers = 20;
            continue;
        }
        if (strcmp(argv[i], "--case") == 0) a->cases = value;
        else if (strcmp(argv[i], "--method") == 0) a->s.method = value;
        else if (strcmp(argv[i], "--receivers") == 0) a->s.receivers = (size_t)strtoul(value, NULL, 10);
        else if (strcmp(argv[i], "--threads") == 0) a->s.threads = atoi(value);
        else if (strcmp(argv[i], "--runs") == 0) a->s.runs = atoi(value);
        else if (strcmp(argv[i], "--rounds") == 0) a->s.rounds = atoi(value);
        else if (strcmp(argv[i], "--seconds") == 0) a->s.seconds = atof(value);
        else return 1;
        ++i;
    }
    return a->s.receivers < 1 || a->s.threads < 1 || a->s.runs < 5 || a->s.rounds < 1 ||
           a->s.runs * a->s.rounds > 256 || !(a->s.seconds > 0.0);
}

static void list_cases(const char *pattern)
{
    for (size_t i = 0; i < chart_entry_count(); ++i)
    {
        char name[CHART_NAME_SIZE];
        chart_entry_name(chart_entry_at(i), name);
        if (fnmatch(pattern, name, 0) == 0)
        {
            puts(name);
        }
    }
}

static void list_methods(const char *pattern)
{
    for (size_t i = 0; chart_method_at(i); ++i)
    {
        if (fnmatch(pattern, chart_method_at(i)->name, 0) == 0)
        {
            puts(chart_method_at(i)->name);
        }
    }
}

static int measure_entry(const chart_entry *entry, const arguments *a, FILE *csv)
{
    char name[CHART_NAME_SIZE];
    chart_case c;
    const double start = test_seconds();
    chart_entry_name(entry, name);
    const int status = chart_case_create(entry, a->thin, &c);
    if (status == CHART_LEFT_OUT)
    {
        fprintf(stderr, "%s: there is no such mesh (tests/dragon.sh fetches the dragon): left out\n", name);
        return 0;
    }
    const int failed = status != 0 || chart_measure(&c, &a->s, csv) != 0;
    printf("%s: %.0f s%s\n", name, test_seconds() - start, failed ? "  FAILED" : "");
    fflush(stdout);
    chart_case_free(&c);
    return failed;
}

int main(int argc, char **argv)
{
    arguments a = {NULL, "*", 1.0, chart_defaults()};
    if (argc >= 2 && argc <= 3 && strcmp(argv[1], "--cases") == 0)
    {
        list_cases(argc == 3 ? argv[2] : "*");
        return 0;
    }
    if (argc >= 2 && argc <= 3 && strcmp(argv[1], "--methods") == 0)
    {
        list_methods(argc == 3 ? argv[2] : "*");
        return 0;
    }
    if (argc < 2 || argv[1][0] == '-' || read_arguments(argc, argv, &a) != 0)
    {
        return usage(argv[0]);
    }
    a.s.log = stdout;
    FILE *const csv = fopen(a.out, "w");
    int failed = 0, measured = 0;
    if (!csv)
    {
        perror(a.out);
        return 1;
    }
    fprintf(csv, "%s\n", chart_columns);
    for (size_t i = 0; i < chart_entry_count(); ++i)
    {
        char name[CHART_NAME_SIZE];
        chart_entry_name(chart_entry_at(i), name);
        if (fnmatch(a.cases, name, 0) == 0)
        {
            failed = measure_entry(chart_entry_at(i), &a, csv) != 0 || failed;
            measured = 1;
        }
    }
    if (!measured)
    {
        fprintf(stderr, "there is no case %s\n", a.cases);
    }
    return fclose(csv) != 0 || failed || !measured;
}
