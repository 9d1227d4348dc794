// A camera that orbits a target. Angles in degrees; y is up, azimuth 0 looks along -z, from +z.
#ifndef EXAMPLES_CAMERA_H
#define EXAMPLES_CAMERA_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct camera
{
    double azimuth;   // to the right, seen from above counter-clockwise
    double elevation; // in [-89, 89]
    double zoom;      // 1: the object fills the picture, less a margin; 2: twice as large
    double target[3]; // set by camera_fit, in the mesh's units
    double distance;  // set by camera_fit, at zoom 1
    double radius;    // set by camera_fit: no vertex is farther from the target
} camera;

// Aims at the vertices [3 count] so that all of them are inside a picture of this aspect (width/height) at zoom 1.
void camera_fit(camera *c, const float *positions, size_t count, double aspect);

// Turns and zooms as the mouse asks: drag in pixels, scroll in steps.
void camera_orbit(camera *c, double drag_x, double drag_y, double scroll);

// The matrix from the mesh's units to clip space, columns first, and where the eye is.
void camera_matrix(const camera *c, double aspect, float view_projection[16], float eye[3]);

#ifdef __cplusplus
}
#endif

#endif
