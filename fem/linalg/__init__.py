"""Sparse symmetric matrices in blocks, and their direct solution by Cholesky factors."""
