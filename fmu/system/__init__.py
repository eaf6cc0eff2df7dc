"""The vehicle and its controller as one system: SSP 1.0, with sets of parameters."""
