"""Compiled code of the balance: what is left to sum once the forces are known."""
