"""Generic numerics: damped Newton, pseudo-arclength continuation with located events. Knows no vibration."""
