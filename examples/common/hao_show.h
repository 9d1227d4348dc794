// A program that lets a light circle an object, in a window or for a strip of pictures, drawn as hao_view.h does. How
// radiosity comes about is the caller's.
#ifndef EXAMPLES_HAO_SHOW_H
#define EXAMPLES_HAO_SHOW_H

#include "hao_view.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct hao_show hao_show;

struct hao_show
{
    // The caller's part. Both return 0, or -1 with the reason in s->reason.
    int (*start)(void *user, hao_show *s);   // once: from mesh and profile to object and look.bytes
    int (*relight)(void *user, hao_show *s); // from look.to_light to the radiosities in `view`, look.ms and look.error,
                                             // and to `brightness`, which the exposure follows
    void *user;
    const sss_hao *object;   // with reference points, for the vertex shader
    const float *brightness; // [vertex_count][3] radiosity

    model m;
    sss_mesh mesh;        // of m, in its size
    sss_profile profile;
    hao_view *view;
    hao_look look;
    double first_exposure; // where the light began; 0: not known yet
    int by_shader;        // the vertex shader shades reference points: G
    char reason[1024];    // of the last failure
};

// Runs the program of this name, with the options
//     [MESH.glb] [--material NAME] [--size-mm S] [--glsl 0|1] [--headless OUT.png]
// *s begins zeroed but for the caller's part. Returns the exit status: 0, or 2 after saying why.
int hao_show_run(hao_show *s, const char *name, int argc, char **argv);

#ifdef __cplusplus
}
#endif

#endif
