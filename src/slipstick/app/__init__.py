"""The application: the command line and its progress display."""
