// Two objects that deform under moving lights, as in Mertens et al. 2003: 0, a candle that twists round its flame
// (figure 6.7), and 1, a cube, or any mesh, that ripples with Perlin noise under a spot light (figure 6.6).
#ifndef EXAMPLES_SCENES_H
#define EXAMPLES_SCENES_H

#include <stddef.h>

#include "model.h"

#ifdef __cplusplus
extern "C" {
#endif

enum
{
    SCENES = 2
};

typedef struct scene
{
    const char *name;
    model rest, now;        // the mesh at rest, and as scene_move left it
    double extent, size_mm; // of the mesh at rest, in its units and in mm
    double step;            // seconds from picture to picture that show the movement
    double elevation, zoom; // of the camera
    int index, own_mesh;    // own_mesh: the user's in place of the cube
    float *visible;         // [2][V]
} scene;

// mesh: a file for scene 1 in place of the cube, or NULL. Returns 0, or -1 with the reason in error_text, *out then
// being empty.
int scene_open(int index, const char *mesh, scene *out, char *error_text, size_t error_size);
void scene_close(scene *s);

// Positions and normals at t seconds. Returns 0, or -1 where they make no mesh.
int scene_move(scene *s, double t);

// The irradiance [V][3] on it as it is now, from the lights at t seconds, shadows included, entering a medium of index
// eta.   lit  1: the first lamp, the flame or the spot light; 2: the second one; 3: both
// Returns 0, or -1 with the reason in error_text.
int scene_light(const scene *s, double t, int lit, double eta, float *irradiance, char *error_text, size_t error_size);

#ifdef __cplusplus
}
#endif

#endif
