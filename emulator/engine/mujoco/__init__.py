"""MuJoCo: constraints with impedance solved as a convex problem (Newton), semi-implicit Euler."""
