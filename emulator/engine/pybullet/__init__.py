"""PyBullet: sequential impulses on generalized coordinates, semi-implicit Euler."""
