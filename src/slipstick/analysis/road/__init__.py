"""The road of every analysis, from what is asked for to points in memory or in a file; it knows no analysis."""
