"""Services for both packages: checks of arguments, texts of data, the cache, progress, compiled code, BLAS threads."""
