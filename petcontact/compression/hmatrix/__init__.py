"""H-matrices. Elements in space are put into clusters. Blocks between far clusters have low rank by
adaptive cross approximation. The matrix is applied to vectors."""
