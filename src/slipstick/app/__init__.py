"""The application: case files, the command line and its progress display."""
