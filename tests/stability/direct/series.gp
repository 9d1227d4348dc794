header = "sss_dipole.h, direct gather,"
all_series = "distance placed"
geometries = "distance placed"
own_rows = 1
