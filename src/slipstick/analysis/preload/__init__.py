"""Load steps before the vibration: assembly, tightening, static loads, with the history of friction."""
