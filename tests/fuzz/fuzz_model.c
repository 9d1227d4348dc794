// Feeds arbitrary bytes to the glTF loader of the examples, the one parser of bytes there is so far: clang's libFuzzer
// calls this with inputs that it mutates. Whatever the bytes, the loader returns 0 with a sound model, or -1.

#define _POSIX_C_SOURCE 200809L

#define SSS_DIPOLE_IMPLEMENTATION // the loader computes missing normals with it
#include "../../sss_dipole.h"

#include "../../examples/common/model.h"

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check_sound(const model *m)
{
    for (size_t i = 0; i < 3 * m->vertex_count; ++i)
    {
        if (!isfinite(m->positions[i]) || !isfinite(m->normals[i]))
        {
            abort();
        }
    }
    for (size_t i = 0; i < 3 * m->triangle_count; ++i)
    {
        if (m->triangles[i] >= m->vertex_count)
        {
            abort();
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static char path[64];
    char error[256] = "";
    model m;
    memset(&m, 0xa5, sizeof m); // a loader that leaves it alone would be noticed
    snprintf(path, sizeof path, "/dev/shm/fuzz_model_%ld.%s", (long)getpid(),
             size >= 4 && memcmp(data, "glTF", 4) == 0 ? "glb" : "gltf");
    FILE *const file = fopen(path, "wb");
    if (!file || (size > 0 && fwrite(data, 1, size, file) != size) || fclose(file) != 0)
    {
        abort();
    }
    const int status = model_load(path, &m, error, sizeof error);
    remove(path);
    if (status == 0)
    {
        check_sound(&m);
        model_free(&m);
    }
    else if (status != -1 || error[0] == '\0')
    {
        abort();
    }
    return 0;
}
