"""Studies: millions of samples of a finger, on local processes or on a Dask cluster, that go on where they ended."""
