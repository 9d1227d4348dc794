// What the sweeps of one method write: one row for each step and each way of computing it (series).
//   program [--write FOLDER] [TEST]
// Without --write a few steps of every sweep are checked. With it all of them, and FOLDER/stability_METHOD.csv:
//   sweep,series,x,rel_l2,rel_max,predicted,left_out,model,input,said,value,ideal
// rel_l2, rel_max: the method against the converged integral of the same dipole geometry over the same mesh under the
// same light; predicted: what its stats say of that; left_out: the share of values that cannot be compared (leave_out
// in sweeps.c). model: the dipole model itself against what is true. input: what a mesh costs that is not what it
// should be (coarse, rough, holed, turned over), against the one that is; said: what the stats say of the mesh. These
// are never mixed. value, ideal: one thing more that is measured, and what it should be.

#ifndef SSS_TESTS_STABILITY_RECORD_H
#define SSS_TESTS_STABILITY_RECORD_H

#include "../common/test.h"

#include <stddef.h>

// NaN where a number is not measured: an empty field.
typedef struct row
{
    const char *sweep, *series;
    double x;
    double rel_l2, rel_max, predicted, left_out;
    double model;
    double input, said;
    double value, ideal;
} row;

// A row without numbers.
row row_of(const char *sweep, const char *series, double x);

void record(const row *r);

// Whether all steps are wanted.
int record_full(void);

// Steps of a sweep from `first` to `last` by equal factors; the short version takes the ends.
int steps_of(int full);
double step_at(int i, int count, double first, double last);

// test_main with --write.   method  the name in the file's
int record_main(int argc, char **argv, const char *method, const test_case *tests, size_t test_count);

#endif
