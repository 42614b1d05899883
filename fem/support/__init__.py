"""Services for both packages: checks of arguments, texts for data, the cache, progress, compiled code, BLAS threads."""
