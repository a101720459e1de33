"""Plain matrices: MatrixMarket, Harwell-Boeing, npz."""
