"""The gap of the platform: rows, candidates, visibility, simulation."""
