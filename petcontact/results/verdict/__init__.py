"""The closing lines of a solve."""
