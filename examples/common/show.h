// Shows the scenes of scenes.h in a window or as a strip of pictures, and says what every stage of a frame takes. What
// makes radiosity of irradiance is the caller's.
#ifndef EXAMPLES_SHOW_H
#define EXAMPLES_SHOW_H

#include <stddef.h>

#include "glossy.h"
#include "scenes.h"

#ifdef __cplusplus
extern "C" {
#endif

enum
{
    SHOW_STAGES = 4
};

typedef struct show show;

// The caller's part. Each returns 0, or -1 with the reason in reason [1024].
typedef struct show_calls
{
    int (*start)(void *user, show *s, char *reason);   // a scene is new, or has a new size
    int (*scatter)(void *user, show *s, char *reason); // from E and scene.now to B
    int (*key)(void *user, show *s, int key, char *reason); // one that the show does not know
    const char *(*describe)(void *user, const show *s); // what the times are of: material, mode
    void *user;
} show_calls;

struct show
{
    const show_calls *calls;
    const char *mesh;         // of the user's, in place of the cube; may be NULL
    gl_context *context;
    scene scene;
    glossy *drawn;            // the caller gives it the material
    glossy_view view;
    double eta;               // of the medium: the caller's as well
    float *E, *B;             // [V][3] irradiance and radiosity
    double time, shape_time;  // s
    int lit, held;            // lit: as in scene_light; held: the shape stays, the lights go on
    double ms[SHOW_STAGES];   // since the last report,
    int frames;               // in so many frames
    char reason[1024];        // of the last failure
};

// Keys: space the other scene, L lights, + - size, H holds the shape, the rest is the caller's; dragging turns.
// Both return 0, or -1 with the reason in s->reason; *s begins zeroed but for calls and mesh.
int show_window(show *s, const char *title);

// A row of pictures for each scene to a PNG file. For the times the same frames once more without pictures: after key I
// as they are and with the shape held, and after another I; a third I must lead back.
int show_strip(show *s, const char *png);

// Frees what a show holds, as it must after either.
void show_close(show *s);

#ifdef __cplusplus
}
#endif

#endif
