"""Linear structures seen through the few directions that matter: contacts, loads and outputs."""
