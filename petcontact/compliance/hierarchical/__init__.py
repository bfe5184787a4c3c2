"""The contact system of a body in space on an H-matrix."""
