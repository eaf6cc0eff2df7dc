"""What records say: rows of blocks, averaged and thinned, and the regression that they make."""
