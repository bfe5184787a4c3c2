"""Who computes which cases when: groups, shrinking chunks, one counter for all ranks."""
