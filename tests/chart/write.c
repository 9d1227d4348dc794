// The files of chart_write.

#define _POSIX_C_SOURCE 200809L

#include "chart.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

enum
{
    PATH_SIZE = 4096
};

// Runs a script of this folder; what it writes to stdout goes to `out`, or stays where it is. Returns 0, or nonzero.
static int run_script(const char *program, const char *script, const char *csv, const char *picture, const char *out)
{
    char path[PATH_SIZE];
    const char *const slash = strrchr(program, '/');
    int status = 1;
    snprintf(path, sizeof path, "%.*s/../tests/chart/%s", slash ? (int)(slash - program) : 1, slash ? program : ".",
             script);
    fflush(stdout);
    const pid_t child = fork();
    if (child == 0)
    {
        if (!out || freopen(out, "w", stdout))
        {
            execlp("sh", "sh", path, csv, picture, (char *)NULL);
        }
        _exit(127);
    }
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR)
    {
    }
    if (child < 0 || status != 0)
    {
        fprintf(stderr, "%s failed: is gnuplot there, and the program in its place in build/?\n", path);
    }
    return child < 0 || status != 0;
}

static int write_csv(const chart_case *c, const chart_settings *s, const char *path)
{
    FILE *const csv = fopen(path, "w");
    if (!csv)
    {
        perror(path);
        return 1;
    }
    fprintf(csv, "%s\n", chart_columns);
    const int failed = chart_measure(c, s, csv);
    return fclose(csv) != 0 || failed;
}

int chart_write(const chart_case *c, const chart_settings *s, const char *program, const char *folder)
{
    char temporary[] = "/tmp/chart-XXXXXX", csv[PATH_SIZE], svg[PATH_SIZE], md[PATH_SIZE];
    const char *const to = folder ? folder : mkdtemp(temporary);
    if (!to || (mkdir(to, 0777) != 0 && errno != EEXIST) || strlen(to) + 16 > PATH_SIZE)
    {
        perror(to ? to : temporary);
        return 1;
    }
    snprintf(csv, sizeof csv, "%s/chart.csv", to);
    snprintf(svg, sizeof svg, "%s/chart.svg", to);
    snprintf(md, sizeof md, "%s/chart.md", to);
    int failed = write_csv(c, s, csv) != 0 || run_script(program, "markdown.sh", csv, NULL, NULL) != 0;
    if (folder && !failed)
    {
        failed = run_script(program, "markdown.sh", csv, NULL, md) != 0 ||
                 run_script(program, "draw.sh", csv, svg, NULL) != 0;
    }
    if (!folder)
    {
        remove(csv);
        rmdir(to);
    }
    return failed;
}
