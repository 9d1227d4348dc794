// What an atlas is called on the command line, and what there is to say of it.
#ifndef EXAMPLES_ATLAS_REPORT_H
#define EXAMPLES_ATLAS_REPORT_H

#include "../../sss_atlas.h"

#ifdef __cplusplus
extern "C" {
#endif

// "orthographic", "area", "convex"; NULL for an unknown method.
const char *atlas_method_name(sss_atlas_method method);

// Returns 0, or -1 for an unknown name.
int atlas_method_by_name(const char *name, sss_atlas_method *out);

// Its stats on standard output, as lines atlas_KEY=VALUE.
void atlas_report(const sss_atlas *atlas);

#ifdef __cplusplus
}
#endif

#endif
