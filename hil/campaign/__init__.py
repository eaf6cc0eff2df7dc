"""Drives a planned campaign through a CANopen master, records it, and reads it back."""
