"""Solutions along a branch, their schema, and quantities computed from them."""
