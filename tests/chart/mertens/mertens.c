// Repeats the paper's experiments.      build/tests/chart/mertens FOLDER [--quick] [--models FOLDER] [WHAT...]
//   WHAT  figure3 figure4 table3 table4 table5; all without any

#define SSS_DIPOLE_IMPLEMENTATION
#include "../../../sss_dipole.h"
#define SSS_BEM_IMPLEMENTATION
#include "../../../sss_bem.h"

#include "mertens.h"

#include <stdio.h>
#include <string.h>

static const struct
{
    const char *name;
    int (*run)(const mertens_settings *s);
} experiments[] = {{"figure3", mertens_figure3},
                   {"figure4", mertens_figure4},
                   {"table3", mertens_table3},
                   {"table4", mertens_table4},
                   {"table5", mertens_table5}};

int main(int argc, char **argv)
{
    mertens_settings s = {"", "", 2100000, 140000, 1.0, 64, 0};
    if (argc < 2)
    {
        fprintf(stderr, "usage: %s FOLDER [--quick] [--models FOLDER] [figure3|figure4|table3|table4|table5...]\n",
                argv[0]);
        return 2;
    }
    s.folder = argv[1];
    for (int i = 2; i < argc; ++i)
    {
        if (strcmp(argv[i], "--quick") == 0)
        {
            s.triangles_max = s.paper_oracle_max = 2100;
            s.seconds = 0.05;
            s.receivers = 24;
            s.coarser = 2;
        }
        if (strcmp(argv[i], "--models") == 0 && i + 1 < argc) s.models = argv[i + 1];
    }
    for (size_t i = 0; i < sizeof experiments / sizeof experiments[0]; ++i)
    {
        if (experiment_wanted(argc, argv, "--models", experiments[i].name) && experiments[i].run(&s) != 0)
        {
            fprintf(stderr, "%s failed\n", experiments[i].name);
            return 1;
        }
    }
    return 0;
}
