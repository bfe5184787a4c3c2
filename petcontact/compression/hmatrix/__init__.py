"""H-matrices: clusters of elements in space, blocks of low rank by adaptive cross approximation,
products with vectors."""
