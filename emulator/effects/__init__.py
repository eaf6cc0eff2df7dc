"""Effects that the emulator injects physically: in bodies, floor, friction, drives, transmissions and sensors."""
