"""Analyses: forced response, parameter studies, linear references, integration in time."""
