"""Outlines of bodies, arcs, Gmsh files."""
