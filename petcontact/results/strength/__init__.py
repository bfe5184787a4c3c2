"""Where stress has no bound, and how strongly it grows there: corners, edges, and their K."""
