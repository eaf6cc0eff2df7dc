"""CAN buses: in-process lockstep, between processes, and every interface that python-can knows; clocks beside them."""
