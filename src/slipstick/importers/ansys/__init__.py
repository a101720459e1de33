"""Ansys: archives, .full files, HBMAT exports."""
