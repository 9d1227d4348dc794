header = "sss_bem.h, tolerance 1e-2,"
all_series = "placed"
geometries = "placed"
own_rows = 1
