"""Bodies of revolution: an outline turned about an axis."""
