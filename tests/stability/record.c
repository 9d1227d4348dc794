#include "record.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static FILE *g_csv; // NULL: the short version

row row_of(const char *sweep, const char *series, double x)
{
    const double none = (double)NAN;
    const row r = {sweep, series, x, none, none, none, none, none, none, none, none, none};
    return r;
}

void record(const row *r)
{
    const double numbers[9] = {r->rel_l2, r->rel_max, r->predicted, r->left_out, r->model,
                               r->input,  r->said,    r->value,     r->ideal};
    if (!g_csv)
    {
        return;
    }
    fprintf(g_csv, "%s,%s,%.6g", r->sweep, r->series, r->x);
    for (int i = 0; i < 9; ++i)
    {
        if (isnan(numbers[i])) fprintf(g_csv, ",");
        else fprintf(g_csv, ",%.4g", numbers[i]);
    }
    fprintf(g_csv, "\n");
}

int record_full(void)
{
    return g_csv != NULL;
}

int steps_of(int full)
{
    return g_csv ? full : 2;
}

double step_at(int i, int count, double first, double last)
{
    return first * pow(last / first, (double)i / (double)(count - 1));
}

int record_main(int argc, char **argv, const char *method, const test_case *tests, size_t test_count)
{
    char text[512];
    if (argc > 2 && strcmp(argv[1], "--write") == 0)
    {
        snprintf(text, sizeof text, "%s/stability_%s.csv", argv[2], method);
        g_csv = fopen(text, "w");
        if (!g_csv)
        {
            perror(text);
            return 1;
        }
        fprintf(g_csv, "sweep,series,x,rel_l2,rel_max,predicted,left_out,model,input,said,value,ideal\n");
        argv[2] = argv[0];
        argv += 2;
        argc -= 2;
    }
    snprintf(text, sizeof text, "stability of %s", method);
    const int status = test_main(argc, argv, text, tests, test_count);
    return g_csv && fclose(g_csv) != 0 ? 1 : status;
}
