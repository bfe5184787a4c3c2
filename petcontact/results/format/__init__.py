"""The layout of result files."""
