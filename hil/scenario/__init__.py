"""Scenarios: set-points, faults and expectations at instants, written in a file."""
