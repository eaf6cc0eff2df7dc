"""The vehicle in continuous time for simulation: equations, generated C code, and the solver around it."""
