"""In front of the connector: buses, clock, CANopen master, recorder, and the bench that composes them."""
