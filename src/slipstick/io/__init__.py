"""Files in and out: results (netCDF-4), arrays and matrices."""
