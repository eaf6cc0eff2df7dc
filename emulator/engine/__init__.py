"""Physics engines: what the emulated vehicle needs of one, and those that there are, one folder each."""
