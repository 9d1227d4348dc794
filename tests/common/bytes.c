#include "bytes.h"

#include <stdlib.h>
#include <string.h>

int write_bytes(void *user, const void *data, size_t count)
{
    bytes *b = (bytes *)user;
    if (b->fail_at-- == 0)
        return 1;
    if (b->count + count > b->room)
    {
        b->room = 2 * (b->count + count) + 4096;
        b->data = (unsigned char *)realloc(b->data, b->room);
    }
    memcpy(b->data + b->count, data, count);
    b->count += count;
    return 0;
}

int read_bytes(void *user, void *data, size_t count)
{
    bytes *b = (bytes *)user;
    if (count > b->count - b->read)
        return 1;
    memcpy(data, b->data + b->read, count);
    b->read += count;
    return 0;
}

int same_bytes(const bytes *a, const bytes *b)
{
    return a->count == b->count && memcmp(a->data, b->data, a->count) == 0;
}
