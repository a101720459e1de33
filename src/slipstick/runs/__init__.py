"""Cases computed into folders, and gone on with: everything is kept as it comes, nothing is printed."""
