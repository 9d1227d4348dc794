// The paper's experiments again: figures 3 and 4, tables 3, 4 and 5 of Mertens et al. 2003. Each writes one CSV file.

#ifndef SSS_TESTS_CHART_MERTENS_H
#define SSS_TESTS_CHART_MERTENS_H

#include "../../common/experiments.h"

#include <stddef.h>

typedef struct mertens_settings
{
    const char *folder;        // of the files that are written
    const char *models;        // folder with the horse, or ""
    size_t triangles_max;      // of table 3
    size_t paper_oracle_max;   // of table 3 with the solid angle oracle, which is slower
    double seconds;            // a time is the median of runs that fill this; three, if they fit into thrice as much
    size_t receivers;          // of a reference
    int coarser;               // splits by which the cube and the candle have fewer
} mertens_settings;

// All return 0, or nonzero on failure with a message.
int mertens_figure3(const mertens_settings *s);
int mertens_figure4(const mertens_settings *s);
int mertens_table3(const mertens_settings *s);
int mertens_table4(const mertens_settings *s);
int mertens_table5(const mertens_settings *s);

#endif
