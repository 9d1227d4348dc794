// The version in the first line of a header: "// sss_NAME.h - vMAJOR.MINOR.PATCH - ...".

#ifndef SSS_TESTS_VERSION_H
#define SSS_TESTS_VERSION_H

#include <stdio.h>
#include <string.h>

// 10000 major + 100 minor + patch; -1 where the file cannot be read, -2 where its first line is another.
static inline int version_in_first_line(const char *header)
{
    FILE *file = fopen(header, "r");
    char line[256], name[64];
    int major, minor, patch;
    if (file == NULL)
        return -1;
    const int whole = fgets(line, (int)sizeof line, file) != NULL &&
                      sscanf(line, "// %63s - v%d.%d.%d", name, &major, &minor, &patch) == 4;
    (void)fclose(file);
    return whole && strcmp(name, header) == 0 ? 10000 * major + 100 * minor + patch : -2;
}

#endif
