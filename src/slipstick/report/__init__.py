"""Reports: one self-contained page of results that any browser opens, today and later, without a server."""
