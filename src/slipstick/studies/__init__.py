"""Many cases of one problem: parameters over a grid, a list or samples, on one machine or a cluster."""
