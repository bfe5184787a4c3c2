"""Pairs of parts in contact: matching meshes, facing points, and maps between their nodes."""
