header = "sss_hao.h"
all_series = "floats references harmonics"
geometries = "floats"
own_rows = 2
