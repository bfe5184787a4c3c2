"""From a problem to its discrete contact problem: interfaces, meshes, data in every load state,
laws."""
