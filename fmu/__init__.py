"""The identified model as a Functional Mock-up Unit (FMI 2.0 and 3.0)."""
