"""Many cases of one problem: parameters over a grid, a list or samples, on one machine or a cluster."""

STUDY_FILE, CURVES_FILE = "study.nc", "curves.nc"
JOURNALS = "study*.journal"
"""What a study keeps in its folder."""
