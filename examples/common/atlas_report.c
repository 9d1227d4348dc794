#include "atlas_report.h"

#include <stdio.h>
#include <string.h>

static const sss_atlas_method methods[] = {SSS_ATLAS_ORTHOGRAPHIC, SSS_ATLAS_AREA, SSS_ATLAS_CONVEX};

enum
{
    METHODS = sizeof methods / sizeof methods[0]
};

const char *atlas_method_name(sss_atlas_method method)
{
    switch (method)
    {
    case SSS_ATLAS_ORTHOGRAPHIC: return "orthographic";
    case SSS_ATLAS_AREA:         return "area";
    case SSS_ATLAS_CONVEX:       return "convex";
    }
    return NULL;
}

int atlas_method_by_name(const char *name, sss_atlas_method *out)
{
    for (int i = 0; i < METHODS; ++i)
    {
        if (strcmp(name, atlas_method_name(methods[i])) == 0)
        {
            *out = methods[i];
            return 0;
        }
    }
    return -1;
}

void atlas_report(const sss_atlas *atlas)
{
    sss_atlas_stats stats;
    const sss_atlas_stats *const s = &stats;
    if (sss_atlas_get_stats(atlas, &stats) != SSS_OK)
    {
        return;
    }
    printf("atlas_method=%s\natlas_size=%zu\natlas_texels_per_mm=%.6g\natlas_border=%d\natlas_gutter=%d\n",
           atlas_method_name(s->method), s->size, s->texels_per_mm, s->border, s->gutter);
    printf("atlas_triangles=%zu\natlas_charts=%zu\natlas_split=%zu\natlas_vertices=%zu\natlas_seam_mm=%.6g\n",
           s->triangle_count, s->chart_count, s->split_count, s->atlas_vertex_count, s->seam_mm);
    printf("atlas_utilisation=%.6f\natlas_stretch_l2=%.6f\natlas_stretch_linf=%.6g\natlas_angle_distortion=%.6f\n",
           s->utilisation, s->stretch_l2, s->stretch_linf, s->angle_distortion);
    printf("atlas_area_least=%.6g\natlas_area_mean=%.6g\natlas_area_largest=%.6g\natlas_area_share_within=%.6f\n",
           s->area_distortion[0], s->area_distortion[1], s->area_distortion[2], s->area_share_within);
    printf("atlas_overlaps=%zu\natlas_empty_texels=%zu\natlas_unseen_triangles=%zu\natlas_unseen_area=%.6g\n"
           "atlas_texel_area_error=%.3g\natlas_bytes=%zu\n", s->overlaps, s->empty_texels, s->unseen_triangles,
           s->unseen_area, s->texel_area_error, s->bytes);
    fflush(stdout);
}
