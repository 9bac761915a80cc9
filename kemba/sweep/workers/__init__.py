"""Cases on Dask workers."""
