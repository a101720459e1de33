"""Analyses: response curves, peaks, modes, self-excited vibration, stability, sensitivities, integration in time."""
