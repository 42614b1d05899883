"""Direct solution of sparse symmetric systems whose matrices are sums of Kronecker products."""
