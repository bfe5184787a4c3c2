"""Many cases over ranks."""
