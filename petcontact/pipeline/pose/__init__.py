"""The discrete contact problem of a problem: interfaces, meshes, data in every load state, laws."""
