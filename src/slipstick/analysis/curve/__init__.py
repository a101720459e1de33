"""Response curves: the one road from what is asked for to a branch."""
