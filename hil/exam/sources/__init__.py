"""Vehicles and axes that share no code with the model or the emulator, for cases of the exam."""
