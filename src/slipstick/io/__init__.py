"""Files in and out: results (netCDF-4), their journal, model files (HDF5)."""
