"""The vehicle as equations, once: geometry in motion, modes, (1)-(21), friction, gears, couplings; forward in time."""
