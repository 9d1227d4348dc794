#include "experiments.h"

#include <string.h>

FILE *experiment_open(const char *folder, const char *name, const char *columns)
{
    char path[512];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *const file = fopen(path, "w");
    if (!file)
    {
        perror(path);
        return NULL;
    }
    fprintf(file, "%s\n", columns);
    return file;
}

int experiment_wanted(int argc, char **argv, const char *valued, const char *name)
{
    int named = 0;
    for (int i = 2; i < argc; ++i)
    {
        if (valued != NULL && strcmp(argv[i], valued) == 0)
        {
            ++i;
        }
        else if (argv[i][0] != '-')
        {
            named = 1;
            if (strcmp(argv[i], name) == 0)
                return 1;
        }
    }
    return !named;
}
