// A file in memory, for what sss_*_save writes and sss_*_load reads.

#ifndef SSS_TESTS_BYTES_H
#define SSS_TESTS_BYTES_H

#include <stddef.h>

// Zeroed, with fail_at = -1, it is an empty file. Freed by its owner: free(data).
typedef struct bytes
{
    unsigned char *data;
    size_t count, room, read;
    int fail_at; // the write that fails; -1: none
} bytes;

// user: bytes. Nonzero: the write that is to fail; nothing is left to read.
int write_bytes(void *user, const void *data, size_t count);
int read_bytes(void *user, void *data, size_t count);

int same_bytes(const bytes *a, const bytes *b);

#endif
