"""Friction contact elements with rubbing motion: parameters, states, forces, tangents and sensitivities."""
