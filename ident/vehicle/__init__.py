"""Geometry, parameters, kinematics and dynamics of the platform (paper, sections 2-5)."""
