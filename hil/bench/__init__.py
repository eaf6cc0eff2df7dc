"""The bench: an emulated vehicle behind a CAN bus, in this process or served to others, and what it is driven by."""
