"""What each cause adds to the rows of the platform."""
