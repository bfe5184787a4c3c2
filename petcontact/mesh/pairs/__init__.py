"""Two parts that may touch: meshes that match, who faces whom, and what passes between their
nodes."""
