"""What a sweep leaves on the disk: a table of scalars, the journals it grows from, shards of
fields."""
