"""Bodies from CAD files, by Gmsh's Python package, which is an optional extra."""
