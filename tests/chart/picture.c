#include "picture.h"

#include "../../examples/common/camera.h"
#include "../../examples/common/gl_context.h"
#include "../../examples/common/model.h"
#include "../../examples/common/shade.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum
{
    SIDE = 512,       // pixels
    SUPERSAMPLE = 2,  // samples a pixel along each side
    BYTES = 3 * SIDE * SIDE
};

struct picture
{
    gl_context *context;
    shade *drawing;
    shade_view view;
    unsigned char best[BYTES], other[BYTES];
};

static int draw(picture *p, const float *radiosity, unsigned char *rgb)
{
    char error[256] = "";
    shade_set_radiosity(p->drawing, radiosity, NULL);
    return shade_picture(p->drawing, &p->view, SIDE, SIDE, SUPERSAMPLE, rgb, error, sizeof error);
}

picture *picture_create(const chart_case *c, const float *radiosity)
{
    char error[256] = "";
    model m;
    picture *const p = (picture *)calloc(1, sizeof *p);
    if (!p)
    {
        return NULL;
    }
    memset(&m, 0, sizeof m);
    m.positions = c->mesh.positions;
    m.normals = c->mesh.normals;
    m.triangles = c->mesh.triangles;
    m.vertex_count = c->mesh.vertex_count;
    m.triangle_count = c->mesh.triangle_count;
    // The light comes from (1,1,1); from here a third of what is seen is lit and a third is not.
    p->view.eye.azimuth = -20.0;
    p->view.eye.elevation = 10.0;
    p->view.eye.zoom = 1.0;
    camera_fit(&p->view.eye, m.positions, m.vertex_count, 1.0);
    p->view.exposure = shade_exposure(&m, &p->view.eye, radiosity);
    p->context = gl_context_create_headless(16, 16, error, sizeof error);
    p->drawing = p->context ? shade_create(p->context, &m, NULL, error, sizeof error) : NULL;
    if (!p->drawing || shade_set_profile(p->drawing, &c->profile, SSS_DIPOLE_EXIT_PAPER) != 0 ||
        draw(p, radiosity, p->best) != 0)
    {
        picture_free(p);
        return NULL;
    }
    return p;
}

void picture_free(picture *p)
{
    if (p)
    {
        shade_free(p->drawing);
        gl_context_free(p->context);
        free(p);
    }
}

double picture_rmse(picture *p, const float *radiosity)
{
    double sum = 0.0;
    if (draw(p, radiosity, p->other) != 0)
    {
        return -1.0;
    }
    for (size_t i = 0; i < BYTES; ++i)
    {
        const double difference = ((double)p->other[i] - (double)p->best[i]) / 255.0;
        sum += difference * difference;
    }
    return sqrt(sum / BYTES);
}
