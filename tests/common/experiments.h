// What programs share that repeat a paper's experiments, each of which writes a CSV file.

#ifndef SSS_TESTS_EXPERIMENTS_H
#define SSS_TESTS_EXPERIMENTS_H

#include <stdio.h>

// A new file in the folder, begun with a line of its columns; NULL with a message.
FILE *experiment_open(const char *folder, const char *name, const char *columns);

// Whether the arguments ask for this experiment: they name it, or none at all. The first argument is the folder; those
// that begin with '-' are options, of which `valued` (NULL: none) takes the argument behind it.
int experiment_wanted(int argc, char **argv, const char *valued, const char *name);

#endif
